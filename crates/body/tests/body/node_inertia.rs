//! Discs on nodes: the warning about rotary inertia that no rigid mass has.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::verification::Checks;
use flexbody_eigen::Wanted;
use flexbody_linalg::CscMatrix;
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, RawModel};
use oracle::beams::{BeamMass, star};
use oracle::mesh::entries;

/// Returns a star of beams with point masses, and moments of inertia about the axes of the model on the end of
/// one beam.
fn star_with_disc(inertia: [f64; 3]) -> RawModel {
    let mut raw = star(BeamMass::Lumped);
    let n = raw.mass.matrix.n_rows();
    let mut all: Vec<(u32, u32, f64)> = entries(&raw.mass.matrix).collect();
    all.extend((0..3).map(|axis| (6 + 3 + axis as u32, 6 + 3 + axis as u32, inertia[axis])));
    raw.mass.matrix = CscMatrix::from_triplets(n, n, &all);
    raw
}

/// Returns the warnings about inertia of nodes, of the conversion and of the check of the body without its model.
fn warnings(inertia: [f64; 3]) -> [Vec<Diagnostic>; 2] {
    let model = FeModel::from_raw(star_with_disc(inertia)).expect("a body").model;
    let modes = ModeSettings { wanted: Wanted::Lowest(8), ..ModeSettings::default() };
    let settings = ConvertSettings { modes, ..ConvertSettings::default() };
    let conversion = convert(&model, &settings, &Context::QUIET).expect("converts");
    let checks = Checks::of(&conversion.body, None).expect("evaluated");
    assert!(checks.passed());
    let own = |all: Vec<Diagnostic>| {
        all.into_iter().filter(|diagnostic| diagnostic.code() == Code::NodeInertia).collect()
    };
    [own(conversion.diagnostics), own(checks.diagnostics)]
}

#[test]
fn a_disc_of_polar_inertia_only_is_named() {
    let [converted, checked] = warnings([0.0, 0.02, 0.0]);
    assert_eq!((converted.len(), checked.len()), (1, 1));
    let id = star(BeamMass::Lumped).nodes.ids[1];
    let (text, of_file) = (converted[0].message(), checked[0].message());
    // The second moment about the axis of a disc is its inertia about the diameters less half of that about its axis.
    assert!(text.contains(&format!("at node {id} (second moment about an axis -0.01)")), "{text}");
    assert!(!of_file.contains("at node"), "{of_file}");
}

#[test]
fn inertia_of_a_rigid_mass_is_not() {
    // A thin disc, a ball, a rod: the largest moment is at most the sum of the others.
    for inertia in [[0.01, 0.02, 0.01], [0.02; 3], [0.0, 0.02, 0.02]] {
        let [converted, checked] = warnings(inertia);
        assert!(converted.is_empty() && checked.is_empty(), "{inertia:?}: {converted:?}");
    }
}
