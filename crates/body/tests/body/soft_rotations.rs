//! Sheets whose elements are not quite coplanar: rotations about the normal have a stiffness of the square of the
//! angles between elements, and would act as hinges. The body is that of the flat sheet.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{Conversion, ConvertSettings, convert};
use flexbody_body::verification::{body_identities, verify};
use flexbody_eigen::{Method, Wanted};
use flexbody_linalg::CscMatrix;
use flexbody_linalg::context::Context;
use flexbody_model::{CheckedModel, DofLabel, FeModel, Nodes, RawModel};
use nalgebra::{DMatrix, DVector, Rotation3};
use oracle::sheet::Sheet;

fn converted(model: &FeModel, modes: usize, method: Method) -> Conversion {
    let modes = ModeSettings { wanted: Wanted::Lowest(modes), method, ..ModeSettings::default() };
    convert(model, &ConvertSettings { modes, ..ConvertSettings::default() }, &Context::QUIET)
        .expect("converts")
}

fn find(diagnostics: &[Diagnostic], code: Code) -> Option<&str> {
    diagnostics.iter().find(|diagnostic| diagnostic.code() == code).map(Diagnostic::message)
}

/// Returns the largest deviation of eigenvalues from `expected`, relative.
fn deviation(found: &[f64], expected: &[f64]) -> f64 {
    found.iter().zip(expected).map(|(found, expected)| (found / expected - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn rotations_held_by_misaligned_elements_follow_in_any_axes_units_and_order() {
    let flat = Sheet::new(0.0, 0.0).dense(false);
    let folded = Sheet::new(1e-5, 0.0);
    // Hinges lower frequencies by several percent.
    assert!(folded.dense(true)[3] < 0.9 * flat[3], "{:?} {flat:?}", folded.dense(true));
    let tilt = Rotation3::from_euler_angles(0.4, -0.7, 1.1);
    let reversed: Vec<usize> = folded.order().into_iter().rev().collect();
    for raw in [
        folded.plain(),
        folded.raw(&tilt, 1.0, &folded.order()),
        folded.raw(&tilt, 1000.0, &folded.order()),
        folded.raw(&Rotation3::from_euler_angles(1.5, 0.2, -0.1), 1.0, &reversed),
    ] {
        let CheckedModel { model, diagnostics, .. } = FeModel::from_raw(raw).expect("a body");
        let message = find(&diagnostics, Code::SoftRotationsFollow).expect("soft rotations");
        assert!(message.starts_with("rotations of 15 nodes have less than 1e-6 of the largest"), "{message}");
        for method in [Method::Dense, Method::Lanczos] {
            let converted = converted(&model, 10, method);
            let eigenvalues = &converted.body.modes().eigenvalue;
            assert!(deviation(eigenvalues, &flat) < 1e-6, "{method:?}: {eigenvalues:?} {flat:?}");
            let verified = verify(&converted.body, &model).expect("the same model");
            let broken: Vec<_> = body_identities(&converted.body)
                .into_iter()
                .chain(verified)
                .filter(|check| !check.passed)
                .collect();
            assert!(broken.is_empty(), "{method:?}: {broken:?}");
        }
    }
}

#[test]
fn the_switch_leaves_the_stiffness_as_it_is() {
    let folded = Sheet::new(1e-4, 0.0);
    let raw = RawModel { keep_soft_rotations: true, ..folded.plain() };
    let CheckedModel { model, diagnostics, .. } = FeModel::from_raw(raw).expect("a body");
    assert_eq!(find(&diagnostics, Code::SoftRotationsFollow), None);
    let kept = converted(&model, 10, Method::Dense);
    assert!(deviation(&kept.body.modes().eigenvalue, &folded.dense(true)) < 1e-4);
    assert_eq!(find(&kept.diagnostics, Code::SoftRotationsEffect), None);
}

/// The stated frequency without the terms lies between that of the hinges and the one with the terms.
#[test]
fn the_effect_on_the_lowest_changed_frequency_is_stated() {
    let folded = Sheet::new(1e-4, 0.0);
    let model = FeModel::from_raw(folded.plain()).expect("a body").model;
    let converted = converted(&model, 10, Method::Dense);
    let message = find(&converted.diagnostics, Code::SoftRotationsEffect).expect("an effect");
    let words: Vec<&str> = message.split([' ', ':']).filter(|word| !word.is_empty()).collect();
    let mode: usize = words[1].parse().expect("a mode");
    let numbers: Vec<f64> = words[2..].iter().filter_map(|word| word.parse().ok()).collect();
    let hertz = |eigenvalue: f64| model.units().frequency_of(eigenvalue);
    let with = hertz(converted.body.modes().eigenvalue[mode - 1]);
    let without = hertz(folded.dense(true)[mode - 1]);
    assert!((numbers[0] / with - 1.0).abs() < 1e-5, "{message}");
    assert!(numbers[1] < 0.99 * with && numbers[1] > 0.999 * without, "{message}: {without}");
    let unchanged = converted.body.modes().eigenvalue[..mode - 1].iter().zip(folded.dense(true));
    unchanged.for_each(|(with, without)| assert!(without > 0.95 * with, "{message}"));
}

/// Folds above the limit, a drilling stiffness and rotations that a spring holds stay as K has them.
#[test]
fn folds_and_small_stiffnesses_stay() {
    for (sheet, what) in [
        (Sheet::new(2e-2, 0.0), "a fold"),
        (Sheet::new(0.0, 1e-7), "a flat sheet that is soft in its plane"),
        (Sheet::new(1e-6, 1e-7), "a sheet whose bending in the plane holds the rotation"),
    ] {
        let raw = sheet.raw(&Rotation3::from_euler_angles(0.4, -0.7, 1.1), 1.0, &sheet.order());
        let CheckedModel { model, diagnostics, .. } = FeModel::from_raw(raw).expect("a body");
        assert_eq!(find(&diagnostics, Code::SoftRotationsFollow), None, "{what}");
        let eigenvalues = converted(&model, 6, Method::Dense).body.modes().eigenvalue.clone();
        assert!(deviation(&eigenvalues, &sheet.dense(true)) < 1e-6, "{what}");
    }
}

/// A mass with rotary inertia about all axes turns with the elements around it.
#[test]
fn rotary_inertia_about_the_normal_follows() {
    let inertia = 0.5;
    let node = 7;
    let mut folded = Sheet::new(1e-5, 0.0);
    (3..6).for_each(|axis| folded.m[(6 * node + axis, 6 * node + axis)] += inertia);
    let model = FeModel::from_raw(folded.plain()).expect("a body").model;
    let found = converted(&model, 8, Method::Dense).body.modes().eigenvalue.clone();
    // The flat sheet whose node turns about z exactly as a triangle of nodes around it does.
    let soft = flat_with_inertia(inertia, node, &model);
    assert!(deviation(&found, &soft) < 1e-4, "{found:?} {soft:?}");
}

/// Returns the eigenvalues of the flat sheet with rotary inertia at a node, whose rotation about z is the
/// combination of displacements by which `model` makes it follow.
fn flat_with_inertia(inertia: f64, node: usize, model: &FeModel) -> Vec<f64> {
    let flat = Sheet::new(0.0, 0.0);
    let row = |row: u32| {
        let label = model.label(row as usize);
        6 * (label.node as usize - 1) + usize::from(label.direction) - 1
    };
    let rotation =
        model.soft_rotations().iter().find(|soft_rotation| row(soft_rotation.direction[0].0) / 6 == node);
    let rotation = rotation.expect("the node is soft");
    let along = rotation.direction.iter().find(|(at, _)| row(*at) % 6 == 5).expect("about z").1;
    let mut follow = DVector::zeros(flat.k.nrows());
    for &(at, part) in rotation.term.iter().filter(|(at, _)| row(*at) % 6 < 3) {
        follow[row(at)] = -part / along;
    }
    // Keep displacements and the rotations of the node across z; condense all other rotations.
    let kept: Vec<usize> =
        (0..flat.k.nrows()).filter(|at| at % 6 < 3 || (at / 6 == node && at % 6 < 5)).collect();
    let rest: Vec<usize> = (0..flat.k.nrows()).filter(|at| !kept.contains(at) && at % 6 != 5).collect();
    let block = |a: &[usize], b: &[usize]| DMatrix::from_fn(a.len(), b.len(), |i, j| flat.k[(a[i], b[j])]);
    let coupling = block(&rest, &kept);
    let held = block(&rest, &rest).cholesky().expect("rotations are held");
    let k = block(&kept, &kept) - coupling.transpose() * held.solve(&coupling);
    let follow = DVector::from_iterator(kept.len(), kept.iter().map(|&at| follow[at]));
    let mut m = DMatrix::from_fn(kept.len(), kept.len(), |i, j| flat.m[(kept[i], kept[j])]);
    kept.iter().enumerate().filter(|(_, at)| *at % 6 >= 3).for_each(|(i, _)| m[(i, i)] += inertia);
    m += inertia * &follow * follow.transpose();
    let lower = m.cholesky().expect("mass").l();
    let half = lower.solve_lower_triangular(&k).expect("a factor");
    let scaled = lower.solve_lower_triangular(&half.transpose()).expect("a factor");
    let mut values: Vec<f64> =
        (0.5 * (&scaled + scaled.transpose())).symmetric_eigen().eigenvalues.iter().copied().collect();
    values.sort_by(f64::total_cmp);
    values.split_off(6)
}

/// The parts of a split model keep the terms of their own nodes.
#[test]
fn soft_rotations_of_separate_bodies_are_their_own() {
    let folded = Sheet::new(1e-5, 0.0);
    let one = folded.plain();
    let n = one.stiffness.matrix.n_cols();
    let twice = |matrix: &CscMatrix| {
        let entries: Vec<(u32, u32, f64)> = [0, n]
            .into_iter()
            .flat_map(|from| (0..n).map(move |j| (from, j)))
            .flat_map(|(from, j)| {
                let (rows, values) = matrix.column(j);
                rows.iter().zip(values).map(move |(&i, &v)| (i + from as u32, (j + from) as u32, v))
            })
            .collect();
        CscMatrix::from_triplets(2 * n, 2 * n, &entries)
    };
    let nodes = Nodes {
        ids: one.nodes.ids.iter().copied().chain(one.nodes.ids.iter().map(|id| id + 100)).collect(),
        positions: one.nodes.positions.repeat(2),
    };
    let labels =
        nodes.ids.iter().flat_map(|&node| (1..=6).map(move |direction| DofLabel { node, direction }));
    let (k, m) = (twice(&one.stiffness.matrix), twice(&one.mass.matrix));
    let dofs = Some(labels.collect());
    let raw = RawModel { dofs, ..RawModel::in_memory("sheets", k, m, nodes) };
    let bodies = FeModel::bodies_from_raw(raw).expect("two bodies");
    let whole = FeModel::from_raw(one).expect("a body").model;
    let expected = converted(&whole, 6, Method::Dense);
    for body in &bodies {
        let found = converted(&body.model, 6, Method::Dense);
        assert_eq!(found.body.modes().eigenvalue, expected.body.modes().eigenvalue);
        let effect = |conversion: &Conversion| {
            find(&conversion.diagnostics, Code::SoftRotationsEffect).map(str::to_owned)
        };
        assert_eq!(effect(&found), effect(&expected));
        assert!(effect(&found).is_some());
    }
}
