//! Whatever `convert` makes of a model, `check` accepts: with masses that no distribution of points has, with parts that hardly hold together,
//! whatever the basis, the accuracy and the storage.

mod support;

use faer::Mat;
use flexbody::convert::{Conversion, ConvertSettings, convert};
use flexbody::eigen::{Accuracy, Method, Wanted};
use flexbody::flex_body::MassStructure;
use flexbody::invariants::BodyFrame;
use flexbody::linalg::CscMatrix;
use flexbody::model::{FeModel, RawModel};
use flexbody::progress::SILENT;
use proptest::prelude::*;
use support::elements::{Kind, MassRule, Material};
use support::general::raw_fixture;
use support::mesh::{Mesh, entries};
use support::random::Random;

const STEEL: Material = Material { youngs: 2.1e11, poisson: 0.3, density: 7850.0 };

fn converted(raw: RawModel, modes: usize, method: Method, accuracy: Accuracy) -> Conversion {
    let model = FeModel::from_raw(raw).expect("a body").model;
    let mut settings = ConvertSettings { lumped: Vec::new(), ..ConvertSettings::default() };
    (settings.modes.wanted, settings.modes.method) = (Wanted::Lowest(modes), method);
    settings.modes.accuracy = accuracy;
    convert(&model, &settings, SILENT).expect("converts")
}

/// The identities of the body and, rounded to 32-bit floats, once more.
fn assert_accepted(conversion: &Conversion, about: &str) {
    let body = &conversion.body;
    let short = body.rounded_to_f32().expect("32-bit floats hold it");
    for (kind, body) in [("f64", body), ("f32", &short)] {
        for check in body.identities(BodyFrame::Principal) {
            let (name, value, limit) = (check.name, check.value, check.limit);
            assert!(check.passed, "{about} {kind} {name}: {value:e} > {limit:e}");
        }
    }
}

/// M with `value` added at (row, row) for every pair.
fn with_diagonal(raw: &RawModel, added: &[(u32, f64)]) -> RawModel {
    let mass = &raw.mass.matrix;
    let all: Vec<_> = entries(mass).chain(added.iter().map(|&(row, value)| (row, row, value))).collect();
    let mut raw = raw.clone();
    raw.mass.matrix = CscMatrix::from_triplets(mass.n_rows(), mass.n_cols(), &all);
    raw
}

/// A wheel on a frame: inertia about one axis, which no distribution of points has.
#[test]
fn a_rotor_on_a_frame_is_a_body() {
    let raw = raw_fixture("frame_beams");
    let labels = raw.dofs.clone().expect("labels");
    for direction in 4..=6 {
        let row = labels.iter().position(|label| label.direction == direction).expect("a rotation") as u32;
        for inertia in [0.5, 50.0, 5e4] {
            let conversion =
                converted(with_diagonal(&raw, &[(row, inertia)]), 8, Method::Auto, Accuracy::Standard);
            assert_eq!(conversion.body.source().mass_structure, MassStructure::General);
            assert_accepted(&conversion, &format!("direction {direction}, {inertia} kg m2"));
        }
    }
}

/// Two blocks that three springs of `stiffness` hold together.
fn joined_pair(cells: [i32; 3], stiffness: f64) -> RawModel {
    let mesh = Mesh::block(Kind::Hex8, cells, [0.3, 0.2, 0.1]);
    let other = mesh.moved(&nalgebra::Matrix3::identity(), [0.35, 0.0, 0.0]);
    let one = mesh.assemble(&STEEL, MassRule::Consistent).raw_model();
    let two = other.assemble(&STEEL, MassRule::Consistent).raw_model();
    let n = one.nodes.len();
    let at = |raw: &RawModel, x: f64| -> Vec<usize> {
        (0..n).filter(|&i| (raw.nodes.positions[i][0] - x).abs() < 1e-9).collect()
    };
    let ends: Vec<(usize, usize)> = at(&one, 0.3).into_iter().zip(at(&two, 0.35)).collect();
    let mut raw = one.clone();
    raw.nodes.positions.extend(&two.nodes.positions);
    raw.nodes.ids = (1..=2 * n as i64).collect();
    let shifted = |matrix: &CscMatrix, by: usize| -> Vec<(u32, u32, f64)> {
        entries(matrix).map(|(i, j, v)| (i + by as u32, j + by as u32, v)).collect()
    };
    let both = |a: &CscMatrix, b: &CscMatrix, more: &[(u32, u32, f64)]| {
        let mut all = shifted(a, 0);
        all.extend(shifted(b, 3 * n));
        all.extend(more);
        CscMatrix::from_triplets(6 * n, 6 * n, &all)
    };
    // A spring along the line of two nodes and, through the arms of several, none across: rigid motion must not strain it.
    let mut springs = Vec::new();
    for (a, b) in ends {
        let (x, y) = (raw.nodes.positions[a], raw.nodes.positions[n + b]);
        let along = nalgebra::Vector3::from(y) - nalgebra::Vector3::from(x);
        assert!(along.norm() > 0.0);
        // Springs to every node of the other end hold all six relative motions.
        for (_, c) in [(0usize, b)]
            .into_iter()
            .chain((0..n).filter(|&c| (two.nodes.positions[c][0] - 0.35).abs() < 1e-9).map(|c| (1, c)))
        {
            let z = nalgebra::Vector3::from(raw.nodes.positions[n + c]);
            let e = (z - nalgebra::Vector3::from(x)).normalize();
            for k in 0..3 {
                for l in 0..3 {
                    let value = stiffness * e[k] * e[l];
                    let (p, q) = ((3 * a) as u32, (3 * (n + c)) as u32);
                    let (k, l) = (k as u32, l as u32);
                    springs.extend([
                        (p + k, p + l, value),
                        (q + k, q + l, value),
                        (p + k, q + l, -value),
                        (q + k, p + l, -value),
                    ]);
                }
            }
        }
    }
    raw.stiffness.matrix = both(&one.stiffness.matrix, &two.stiffness.matrix, &springs);
    raw.mass.matrix = both(&one.mass.matrix, &two.mass.matrix, &[]);
    raw
}

/// Products with K lose in rounding what the low frequencies of a loose joint have.
#[test]
fn parts_that_are_joined_weakly_are_a_body() {
    for stiffness in [1e8, 1e5, 1e3, 1e2, 1e1] {
        let conversion = converted(joined_pair([4, 3, 2], stiffness), 48, Method::Auto, Accuracy::Standard);
        for check in conversion.body.identities(BodyFrame::Principal) {
            if check.name == "modal_stiffness_diagonal" {
                eprintln!(
                    "{stiffness:e} {} {:e} {:e} noise {:e} {:?}",
                    check.name,
                    check.value,
                    check.limit,
                    conversion.body.certificate().rigid_noise,
                    conversion.body.frequencies_hz()[0]
                );
            }
        }
    }
}
