//! Jobs of FE programs among the fixtures, and the block of steel that most of them model.

use crate::fixtures;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_eigen::Wanted;
use flexbody_input::{InterfaceNodes, InterfaceSource, ModelFiles, read_model};
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, FeModel, RawModel, Reference};
use std::path::{Path, PathBuf};

/// Returns a rigid interface of a node set of the job.
pub fn set(name: &str, set: &str) -> InterfaceSource {
    let nodes = InterfaceNodes::Set(set.to_owned());
    InterfaceSource {
        name: name.to_owned(),
        nodes,
        coupling: Some(Coupling::Rigid),
        reference: Reference::Centre,
    }
}

/// Reads a job in m, kg, s.
pub fn job(path: &Path, interfaces: Vec<InterfaceSource>) -> RawModel {
    let files = ModelFiles::from_job(path, None, interfaces, Some("m,kg,s")).expect("units");
    read_model(&files).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Returns the path of the deck of a job among the small fixtures.
pub fn small(name: &str) -> PathBuf {
    fixtures().join("small").join(name).join("job.inp")
}

/// Converts a model with its lowest modes.
pub fn body(raw: RawModel, modes: usize) -> FlexBody {
    let model = FeModel::from_raw(raw).unwrap_or_else(|error| panic!("{error}")).model;
    let modes = ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() };
    convert(&model, &ConvertSettings { modes, ..ConvertSettings::default() }, &Context::QUIET)
        .expect("a body")
        .body
}

/// Mass of the block of `fixtures/make/make_jobs.py`.
pub const MASS: f64 = 7850.0 * 0.2 * 0.08 * 0.06;

/// Returns the principal moments of inertia of the block.
fn block_inertia() -> [f64; 3] {
    let [a, b, c]: [f64; 3] = [0.2, 0.08, 0.06];
    [b * b + c * c, a * a + c * c, a * a + b * b].map(|sum| MASS * sum / 12.0)
}

/// Fails unless mass and principal moments of inertia are those of the block.
pub fn assert_has_inertia_of_the_block(body: &FlexBody, tolerance: f64) {
    let invariants = body.invariants();
    assert!((invariants.mass() / MASS - 1.0).abs() < tolerance / 10.0, "{}", invariants.mass());
    let mut own: Vec<f64> = (0..3).map(|k| invariants.inertia()[(k, k)]).collect();
    own.sort_by(f64::total_cmp);
    let mut exact = block_inertia();
    exact.sort_by(f64::total_cmp);
    // Consistent masses of bricks integrate a block exactly.
    let near = |(own, exact): (&f64, f64)| (own / exact - 1.0).abs() < tolerance;
    assert!(own.iter().zip(exact).all(near), "{own:?} {exact:?}");
}
