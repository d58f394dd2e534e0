//! From matrices in memory to a flex-body file: a steel truss of 3 x 3 x 8 bays, its rods with consistent mass.
//!
//!     cargo run --release --example from_memory -- truss.flex.h5

use flexbody::base::error::Result;
use flexbody::base::progress::SILENT;
use flexbody::base::units::UnitSystem;
use flexbody::body::basis::ModeSettings;
use flexbody::body::convert::{ConvertSettings, convert};
use flexbody::body::flex_body::FlexBody;
use flexbody::formats::flex_body_file;
use flexbody::model::{FeModel, NodeSet, Nodes, RawModel};
use flexbody::numerics::eigen::Wanted;
use flexbody::numerics::linalg::CscMatrix;
use sprs::{CsMat, TriMat};
use std::path::Path;

const YOUNGS: f64 = 2.1e11; // Pa
const DENSITY: f64 = 7850.0; // kg/m^3
const AREA: f64 = 1e-4; // m^2
const BAY: f64 = 0.5; // m

fn main() -> Result<()> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "truss.flex.h5".to_owned());
    let body = write_truss(Path::new(&path))?;
    println!("{path}: mass {} kg, frequencies {:?} Hz", body.invariants().mass, body.frequencies_hz());
    Ok(())
}

/// Converts the truss with 8 modes and writes it.
pub fn write_truss(path: &Path) -> Result<FlexBody> {
    let positions = joints();
    let (stiffness, mass) = matrices(&positions);
    let nodes = Nodes { ids: (1..=positions.len() as i64).collect(), positions };
    let foot = nodes.ids.iter().zip(&nodes.positions).filter(|(_, x)| x[2] == 0.0).map(|(&id, _)| id);
    let foot = NodeSet::new("foot", foot.collect());
    let raw = RawModel {
        units: UnitSystem::parse("m", "kg", "s").expect("known units"),
        interfaces: vec![foot],
        ..RawModel::in_memory("truss", CscMatrix::from_sprs(&stiffness), CscMatrix::from_sprs(&mass), nodes)
    };
    // Every check that the program makes is made here; warnings and notes come with the model.
    let checked = FeModel::from_raw(raw)?;
    let settings = ConvertSettings {
        modes: ModeSettings { wanted: Wanted::Lowest(8), ..ModeSettings::default() },
        ..ConvertSettings::default()
    };
    let conversion = convert(&checked.model, &settings, SILENT)?;
    flex_body_file::write(&conversion.body, path)?;
    Ok(conversion.body)
}

/// Joints on a grid of bays.
fn joints() -> Vec<[f64; 3]> {
    let grid = |(i, j, k): (i32, i32, i32)| [i, j, k].map(|c| BAY * f64::from(c));
    (0..9).flat_map(|k| (0..4).flat_map(move |j| (0..4).map(move |i| grid((i, j, k))))).collect()
}

/// K and M of rods between all joints that are at most one space diagonal of a bay apart.
fn matrices(joints: &[[f64; 3]]) -> (CsMat<f64>, CsMat<f64>) {
    let n = 3 * joints.len();
    let (mut stiffness, mut mass) = (TriMat::new((n, n)), TriMat::new((n, n)));
    for (a, xa) in joints.iter().enumerate() {
        for (b, xb) in joints.iter().enumerate().skip(a + 1) {
            let along: [f64; 3] = std::array::from_fn(|k| xb[k] - xa[k]);
            let length = along.iter().map(|c| c * c).sum::<f64>().sqrt();
            if length > 1.01 * BAY * 3f64.sqrt() {
                continue;
            }
            // Along the rod: EA/L [1 -1; -1 1]. In every direction: rho A L / 6 [2 1; 1 2].
            for (i, j, sign, share) in
                [(a, a, 1.0, 2.0), (b, b, 1.0, 2.0), (a, b, -1.0, 1.0), (b, a, -1.0, 1.0)]
            {
                for k in 0..3 {
                    mass.add_triplet(3 * i + k, 3 * j + k, share * DENSITY * AREA * length / 6.0);
                    for l in 0..3 {
                        let value = sign * YOUNGS * AREA / length.powi(3) * along[k] * along[l];
                        stiffness.add_triplet(3 * i + k, 3 * j + l, value);
                    }
                }
            }
        }
    }
    (stiffness.to_csc(), mass.to_csc())
}
