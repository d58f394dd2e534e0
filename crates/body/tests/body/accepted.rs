//! Every body made by `convert` passes `check`: with masses that no distribution of points has, with weakly
//! connected parts, in any basis, accuracy and storage.

use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_base::error::ExitCode;
use flexbody_body::basis::{BasisChoice, CraigBampton, CraigChang, FreeSurface, ImportedShapes, Loads};
use flexbody_body::convert::{Conversion, ConvertSettings, convert};
use flexbody_body::flex_body::{FlexBody, MassStructure, Parts};
use flexbody_body::invariants::BodyFrame;
use flexbody_body::verification::{accept, body_identities};
use flexbody_eigen::{Accuracy, Method, Wanted};
use flexbody_linalg::CscMatrix;
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, Damping, FeModel, NodeSet, RawModel, RawShapes};
use nalgebra::{Matrix3, Vector3};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::general::raw_fixture;
use oracle::mesh::{Mesh, entries};
use oracle::random::Random;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::path::PathBuf;

const UNIT: Material = Material { youngs: 1.0, poisson: 0.25, density: 1.0 };

fn converted(raw: RawModel, modes: usize, method: Method, accuracy: Accuracy) -> Conversion {
    let model = FeModel::from_raw(raw).expect("a body").model;
    let mut settings = ConvertSettings { lumped: Vec::new(), ..ConvertSettings::default() };
    (settings.modes.wanted, settings.modes.method) = (Wanted::Lowest(modes), method);
    settings.modes.accuracy = accuracy;
    convert(&model, &settings, &Context::QUIET).expect("converts")
}

/// Asserts the identities of the body, and of the body rounded to 32-bit floats.
fn assert_accepted(conversion: &Conversion, about: &str) {
    let body = &conversion.body;
    let short = body.rounded_to_f32().expect("32-bit floats hold it");
    for (kind, body) in [("f64", body), ("f32", &short)] {
        for check in body_identities(body) {
            let (name, value, limit) = (check.name, check.value, check.limit);
            assert!(check.passed, "{about} {kind} {name}: {value:e} > {limit:e}");
        }
    }
}

/// Returns the model with these entries added to M.
fn with_mass(raw: &RawModel, added: &[(u32, u32, f64)]) -> RawModel {
    let mass = &raw.mass.matrix;
    let all: Vec<_> = entries(mass).chain(added.iter().copied()).collect();
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
        for inertia in [0.5, 50.0] {
            let conversion =
                converted(with_mass(&raw, &[(row, row, inertia)]), 8, Method::Auto, Accuracy::Standard);
            assert_eq!(conversion.body.source().mass_structure, MassStructure::General);
            assert_accepted(&conversion, &format!("direction {direction}, {inertia} kg m2"));
        }
    }
}

/// Returns two blocks end to end with facing nodes connected by springs along all axes.
fn joined_pair(stiffness: f64) -> RawModel {
    let mesh = Mesh::block(ElementKind::Hex8, [3, 2, 1], [0.75, 0.5, 0.25]);
    let other = mesh.moved(&Matrix3::identity(), [0.75, 0.0, 0.0]);
    let [one, two] = [&mesh, &other].map(|mesh| mesh.assemble(&UNIT, MassRule::Consistent).raw_model());
    let n = one.nodes.len();
    let mut raw = one.clone();
    raw.nodes.positions.extend(&two.nodes.positions);
    raw.nodes.ids = (1..=2 * n as i64).collect();
    let at_joint = |i: &usize| raw.nodes.positions[*i][0] == 0.75;
    let pairs = (0..n).filter(at_joint).map(|i| {
        (i, (n..2 * n).find(|j| raw.nodes.positions[*j] == raw.nodes.positions[i]).expect("a partner"))
    });
    let springs: Vec<(u32, u32, f64)> = pairs
        .flat_map(|(i, j)| [(i, i, stiffness), (j, j, stiffness), (i, j, -stiffness), (j, i, -stiffness)])
        .flat_map(|(i, j, value)| (0..3).map(move |k| ((3 * i + k) as u32, (3 * j + k) as u32, value)))
        .collect();
    let both = |a: &CscMatrix, b: &CscMatrix, more: &[(u32, u32, f64)]| {
        let second = entries(b).map(|(i, j, v)| (i + 3 * n as u32, j + 3 * n as u32, v));
        let all: Vec<_> = entries(a).chain(second).chain(more.iter().copied()).collect();
        CscMatrix::from_triplets(6 * n, 6 * n, &all)
    };
    raw.stiffness.matrix = both(&one.stiffness.matrix, &two.stiffness.matrix, &springs);
    raw.mass.matrix = both(&one.mass.matrix, &two.mass.matrix, &[]);
    raw
}

/// Rounding of products with K exceeds the low frequencies of a weak joint, whatever the rounding of rigid
/// motion.
#[test]
fn parts_that_are_joined_weakly_are_a_body() {
    for (method, exponent) in
        [Method::Dense, Method::Lanczos].into_iter().flat_map(|m| [-14, -24, -30].map(|e| (m, e)))
    {
        let about = format!("{method:?} 2^{exponent}");
        let conversion = converted(joined_pair(f64::from(exponent).exp2()), 48, method, Accuracy::Standard);
        assert_accepted(&conversion, &about);
        let certificate = conversion.body.certificate();
        let diagonal = conversion
            .body
            .identities(BodyFrame::Principal)
            .into_iter()
            .find(|check| check.name == "modal_stiffness_diagonal")
            .expect("an identity");
        // The noise of rigid motion is excluded, because it may be small by chance.
        assert!(diagonal.value <= 1e-9 + certificate.eigenvalue_rounding, "{about}: {diagonal:?}");
    }
}

/// Returns the model with inertia of the sizes `10^size` about random axes added to M at random nodes.
fn with_random_inertia(raw: &RawModel, seed: u64, sizes: &[f64]) -> RawModel {
    let labels = raw.dofs.as_deref().expect("labels");
    let row = |node: i64, direction: u8| {
        let same = labels.iter().position(|label| (label.node, label.direction) == (node, direction));
        same.map(|row| row as u32)
    };
    let mut random = Random(seed);
    let mut added = Vec::new();
    for size in sizes.iter().map(|size| 10f64.powf(*size)) {
        let node = labels[(random.next_u64() % labels.len() as u64) as usize].node;
        let axis = Vector3::from_fn(|_, _| random.signed());
        for (k, l) in (0..3u8).flat_map(|k| (0..3u8).map(move |l| (k, l))) {
            if let (Some(i), Some(j)) = (row(node, 4 + k), row(node, 4 + l)) {
                added.push((i, j, size * axis[usize::from(k)] * axis[usize::from(l)]));
            }
        }
    }
    with_mass(raw, &added)
}

/// Returns every kind of basis of the program, for a frame with its first and last node as interfaces.
fn bases(model: &FeModel) -> Vec<BasisChoice> {
    let shapes = Mat::from_fn(model.rows().len(), 4, |i, j| Random((97 * i + j) as u64).signed());
    let raw = RawShapes { matrix: shapes, digits: 17, path: PathBuf::new(), source: None };
    let with_residual_vectors = |loads| FreeSurface { residual_vectors: vec![loads] };
    vec![
        BasisChoice::default(),
        BasisChoice::Free(with_residual_vectors(Loads::Centrifugal)),
        BasisChoice::Free(with_residual_vectors(Loads::Interfaces)),
        BasisChoice::Imported(ImportedShapes::new(model, raw).expect("shapes of the model")),
        BasisChoice::CraigBampton(CraigBampton),
        BasisChoice::CraigChang(CraigChang::default()),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, rng_seed: RngSeed::Fixed(15), ..ProptestConfig::default() })]

    /// Inertia about random axes at random nodes, from 1e-4 to 1e4 times that of the frame, in every basis.
    #[test]
    fn random_masses_of_nodes_are_bodies(seed in any::<u64>(), sizes in proptest::collection::vec(-4.0..4.0f64, 1..5), fast in any::<bool>()) {
        let mut raw = with_random_inertia(&raw_fixture("frame_beams"), seed, &sizes);
        let ids = &raw.nodes.ids;
        let ends = [("first", ids[0]), ("last", ids[ids.len() - 1])];
        raw.data.interfaces = ends
            .map(|(name, node)| NodeSet { coupling: Some(Coupling::Rigid), ..NodeSet::new(name, vec![node]) })
            .into();
        let model = FeModel::from_raw(raw).expect("a body").model;
        for basis in bases(&model) {
            let about = format!("seed {seed}, sizes {sizes:?}, {basis:?}");
            let mut settings = ConvertSettings { basis, ..ConvertSettings::default() };
            settings.modes.wanted = Wanted::Lowest(8);
            settings.modes.accuracy = if fast { Accuracy::Fast } else { Accuracy::Standard };
            assert_accepted(&convert(&model, &settings, &Context::QUIET).expect(&about), &about);
        }
    }
}

/// Written bodies have passed the checks; a failed check ends with exit code 3 and its name.
#[test]
fn a_body_that_breaks_an_identity_is_refused() {
    let mesh = Mesh::block(ElementKind::Hex8, [3, 2, 1], [0.75, 0.5, 0.25]);
    let mut raw = mesh.assemble(&UNIT, MassRule::Consistent).raw_model();
    raw.data.damping = Some(Damping::Ratio(0.02));
    let model = FeModel::from_raw(raw).expect("a body").model;
    let mut settings = ConvertSettings::default();
    settings.modes.wanted = Wanted::Lowest(6);
    let body = convert(&model, &settings, &Context::QUIET).expect("converts").body;
    accept(&body).expect("all identities hold");
    let broken = |change: &dyn Fn(&mut Parts)| -> Vec<&'static str> {
        let mut parts = body.clone().into_parts();
        change(&mut parts);
        let changed = FlexBody::new(parts).expect("no shape changed");
        let error = accept(&changed).expect_err("an identity is broken");
        assert!(
            error.has(Code::BodyUntrustworthy) && error.exit_code() == ExitCode::Untrustworthy,
            "{error}"
        );
        let failed = body_identities(&changed).into_iter().filter(|check| !check.passed);
        failed.map(|check| check.name).collect()
    };
    assert_eq!(broken(&|parts| parts.invariants.primary_mut().mass *= 1.5), ["row_sums", "lumped_errors"]);
    assert_eq!(broken(&|parts| parts.modes.damping_ratio[2] = 0.03), ["damping_ratios"]);
    let heavy = broken(&|parts| parts.invariants.primary_mut().second_moment[(0, 0)] *= -1.0);
    assert!(heavy.contains(&"second_moment_psd") && heavy.contains(&"inertia_triangle"), "{heavy:?}");
}

#[test]
fn inertia_that_is_negative_about_an_axis_is_no_body() {
    let conversion = converted(raw_fixture("frame_beams"), 4, Method::Auto, Accuracy::Standard);
    let mut parts = conversion.body.into_parts();
    // J of an I0 with one negative moment: I0 = tr(J) 1 - J.
    let i0 = parts.invariants.inertia();
    let turned = Matrix3::from_diagonal(&Vector3::new(-i0[(0, 0)], i0[(1, 1)], i0[(2, 2)]));
    parts.invariants.primary_mut().second_moment = Matrix3::identity() * (0.5 * turned.trace()) - turned;
    let changed = FlexBody::new(parts).expect("no shape changed");
    let failed: Vec<_> =
        body_identities(&changed).into_iter().filter(|check| !check.passed).map(|check| check.name).collect();
    assert!(failed.contains(&"inertia_psd"), "{failed:?}");
}
