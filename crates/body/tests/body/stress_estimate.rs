//! The estimate of the geometric stiffness of spin compared with the stress of element code, and with a beam.

use faer::{Mat, Scale};
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::{BodyFrame, relative_norm};
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, GeometricStiffness, LoadKind, RawMatrix, RawModel, UnitLoad};
use nalgebra::{Matrix3, Rotation3, Vector3};
use oracle::beams::shaft;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Mesh, entries};
use oracle::reference::dense_modes;
use std::path::PathBuf;

/// Largest ratio, either way, of the estimated largest change of stiffness to the true one.
const MAX_RATIO: f64 = 1.35;

fn converted(raw: RawModel, frame: BodyFrame) -> FlexBody {
    let model = FeModel::from_raw(raw).expect("a body").model;
    let modes = ModeSettings { wanted: Wanted::Lowest(10), ..ModeSettings::default() };
    let settings = ConvertSettings { modes, frame: frame.into(), ..ConvertSettings::default() };
    convert(&model, &settings, &Context::QUIET).expect("converts").body
}

/// Returns the six matrices of the centrifugal stress of a free body.
fn true_stiffness(mesh: &Mesh, material: &Material) -> Vec<GeometricStiffness<RawMatrix>> {
    let body = mesh.assemble(material, MassRule::Consistent);
    let modes = dense_modes(&body);
    let total: f64 = entries(&body.scalar_mass).map(|(_, _, value)| value).sum();
    let moment = |k: usize| -> f64 {
        entries(&body.scalar_mass).map(|(_, column, value)| value * body.nodes[column as usize][k]).sum()
    };
    let centre = Vector3::from_fn(|k, _| moment(k) / total);
    let matrix = |component: usize| {
        let (k, l) = LoadKind::SPIN[component];
        let e = |axis: usize| Vector3::ith(axis, 1.0);
        let turned = |a: usize, b: usize, x: &Vector3<f64>| e(a).cross(&e(b).cross(x));
        let mut load = Mat::<f64>::zeros(body.n_dofs(), 1);
        for (row, column, value) in entries(&body.scalar_mass) {
            let x = Vector3::from(body.nodes[column as usize]) - centre;
            let a = if k == l { turned(k, k, &x) } else { turned(k, l, &x) + turned(l, k, &x) };
            (0..3).for_each(|i| load[(3 * row as usize + i, 0)] -= value * a[i]);
        }
        let modal = modes.shapes.transpose() * &load;
        let amplitude = Mat::from_fn(modal.nrows(), 1, |p, _| modal[(p, 0)] / modes.eigenvalues[p]);
        let moved = &modes.shapes * &amplitude;
        let moved: Vec<f64> = moved.col(0).iter().copied().collect();
        let load = UnitLoad { kind: LoadKind::Spin, component };
        let matrix = mesh.geometric_stiffness(material, &moved);
        GeometricStiffness { load, matrix: RawMatrix { matrix, digits: 17, path: PathBuf::from("Kg.mtx") } }
    };
    (0..6).map(matrix).collect()
}

/// Returns the largest relative change of stiffness by the geometric stiffness of the body at unit spin about `axis`.
fn true_part(body: &FlexBody, axis: &Vector3<f64>) -> f64 {
    let nf = body.n_modes();
    let sum = body.geometric_stiffness().iter().fold(Mat::zeros(nf, nf), |sum: Mat<f64>, one| {
        let (k, l) = LoadKind::SPIN[one.load.component];
        sum + &one.matrix * Scale(axis[k] * axis[l])
    });
    relative_norm(sum.as_ref(), body.invariants().modal_stiffness().as_ref()).expect("stiff modes")
}

#[test]
fn the_estimate_is_close_to_the_stress_of_elements() {
    let plate = |kind, cells: [i32; 3], size: [f64; 3]| Mesh::block(kind, cells, size);
    let meshes = [
        ("block of hex8", plate(ElementKind::Hex8, [4, 3, 2], [0.3, 0.2, 0.1])),
        ("plate of hex20", plate(ElementKind::Hex20, [4, 3, 1], [0.4, 0.3, 0.01])),
        ("plate of tet10", plate(ElementKind::Tet10, [3, 3, 1], [0.3, 0.3, 0.03])),
        ("block of tet4", plate(ElementKind::Tet4, [4, 2, 2], [0.2, 0.1, 0.1])),
        ("ring of hex8", Mesh::ring(ElementKind::Hex8, 16, 0.3, 0.05)),
        ("bracket of hex20", Mesh::bracket(ElementKind::Hex20, 3, 1, 0.05)),
    ];
    for (name, mesh) in meshes {
        let raw = || mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
        let estimated = converted(raw(), BodyFrame::Com);
        let given = raw().with(|data| data.geometric_stiffness = true_stiffness(&mesh, &Material::STEEL));
        let known = converted(given, BodyFrame::Com);
        assert!(known.estimated_stiffness().is_empty(), "{name}: nothing is missing");
        for axis in [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::new(0.6, 0.0, 0.8)] {
            let (part, known) =
                (estimated.missing_part(&axis, true).expect("missing"), true_part(&known, &axis));
            let ratio = part / known;
            assert!(ratio < MAX_RATIO && ratio > 1.0 / MAX_RATIO, "{name}, {axis:?}: {part:e} for {known:e}");
        }
    }
}

#[test]
fn the_estimate_turns_with_the_model() {
    let mesh = Mesh::bracket(ElementKind::Hex8, 4, 2, 0.05);
    let rotation = Rotation3::from_scaled_axis(Vector3::new(0.3, -0.8, 0.5));
    let turned = mesh.moved(rotation.matrix(), [0.4, -0.3, 0.2]);
    let body = |mesh: &Mesh, frame| {
        converted(mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model(), frame)
    };
    let (upright, oblique) = (body(&mesh, BodyFrame::Com), body(&turned, BodyFrame::Com));
    let principal = body(&mesh, BodyFrame::Principal);
    for axis in [Vector3::x(), Vector3::y(), Vector3::new(0.6, 0.0, 0.8)] {
        let part = upright.missing_part(&axis, true).expect("missing");
        let other = oblique.missing_part(&(rotation * axis), true).expect("missing");
        assert!((part / other - 1.0).abs() < 1e-6, "{part:e}, {other:e}");
        // The frame of the body changes nothing.
        let axes: Matrix3<f64> = principal.frame().axes;
        let other = principal.missing_part(&(axes.transpose() * axis), true).expect("missing");
        assert!((part / other - 1.0).abs() < 1e-6, "{part:e}, {other:e}");
        let back = principal.in_model_axes(Vector3::zeros()).expect("in the axes of the model");
        let other = back.missing_part(&axis, true).expect("missing");
        assert!((part / other - 1.0).abs() < 1e-6, "{part:e}, {other:e}");
    }
}

#[test]
fn a_shaft_about_its_own_axis_has_centrifugal_softening_and_hardly_any_stress() {
    // A beam turns about its axis without any stress; a solid shaft has the stress of its radius.
    let beam = converted(shaft(12, 0.05), BodyFrame::Com);
    let softening = beam.softening(&Vector3::x()).expect("moves");
    assert!(softening > 0.0 && beam.missing_part(&Vector3::x(), true).expect("missing") < 1e-6 * softening);
    let solid = Mesh::cylinder(ElementKind::Hex20, 2, 8, 0.02, 0.8);
    let solid = converted(solid.assemble(&Material::STEEL, MassRule::Consistent).raw_model(), BodyFrame::Com);
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let length = |axis: &Vector3<f64>| -> f64 {
        let along = solid.nodes().positions.iter().map(|x| axis.dot(&Vector3::from(*x)).abs());
        along.fold(0.0, f64::max)
    };
    let long = axes.iter().find(|axis| length(axis) > 0.3).expect("a long axis");
    let (part, softening) = (solid.missing_part(long, true).expect("missing"), solid.softening(long));
    assert!(part < 0.03 * softening.expect("moves"), "{part:e} {softening:?}");
}

#[test]
fn the_stress_of_a_turning_beam_has_the_effect_on_bending_that_theory_gives() {
    let beam = converted(shaft(24, 0.02), BodyFrame::Com);
    // Bending along the axis of the spin, z: T w'^2 with T = m w^2 (1/4 - x^2) / 2, for mass 1 and length 1.
    let estimate = beam.estimated_stiffness();
    let about = estimate.iter().find(|stiffness| stiffness.load.component == 2).expect("spin zz");
    let s = beam.invariants().s().expect("a solid's sums");
    let mode = (0..beam.n_modes()).find(|&j| s[2][2][(j, j)] > 0.9).expect("bends along z");
    let k = 4.730_040_744_862_704f64;
    let (a, b) = ((k / 2.0).cosh(), (k / 2.0).cos());
    let slope = |x: f64| k * ((k * x).sinh() / a - (k * x).sin() / b);
    let value = |x: f64| (k * x).cosh() / a + (k * x).cos() / b;
    let sum = |f: &dyn Fn(f64) -> f64| -> f64 {
        (0..2000).map(|i| f((f64::from(i) + 0.5) / 2000.0 - 0.5)).sum::<f64>() / 2000.0
    };
    let expected = sum(&|x| (0.25 - x * x) / 2.0 * slope(x).powi(2)) / sum(&|x| value(x).powi(2));
    let own = about.matrix[(mode, mode)];
    assert!((own / expected - 1.0).abs() < 0.03, "{own} {expected}");
}
