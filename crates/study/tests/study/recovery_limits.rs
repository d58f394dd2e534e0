//! Limits of the errors of recoveries: the measured, bounded and estimated errors beside those of all rows at all
//! instants and of the equations of all nodes, and selections that hold.

use crate::skewed_beam::skewed_beam;
use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{FlexBody, TermGroups};
use flexbody_body::invariants::BodyFrame;
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{AnsweredShapes, DofLabel, FeModel, ModelRecovery, RawModel, RecoveryOperator};
use flexbody_motion::scene::{
    Axes, Carried, FramedScene, History, Initial, Load, Measure, Point, RecoveryLimit, RecoveryMeasure,
    RecoveryTolerance, Scene, Spin, Trace, VectorHistory, trace, trace_at,
};
use flexbody_study::reference::{Enrichment, ReferenceError, enrich};
use flexbody_study::selection::{Selection, select};
use flexbody_study::trade::NodalReference;
use nalgebra::Vector3;
use oracle::scenes::nothing_happens;
use std::f64::consts::TAU;
use std::path::PathBuf;

/// Returns a skewed rubber beam with its stresses, a section force and an interface at each end.
fn model() -> FeModel {
    FeModel::from_raw(raw_model()).expect("a sound model").model
}

fn raw_model() -> RawModel {
    let mut raw = skewed_beam(4.0, 5);
    let side =
        raw.nodes.ids.iter().zip(&raw.nodes.positions).filter(|(_, at)| at[0] < 0.7).map(|(id, _)| *id);
    let operator = RecoveryOperator::Cut { nodes: side.collect(), about: [0.7, 0.2, 0.1] };
    raw.data.recoveries.push(ModelRecovery {
        name: "cut".to_owned(),
        operator,
        path: PathBuf::new(),
        deformed_inertia: false,
    });
    raw
}

fn body(model: &FeModel, modes: usize) -> FlexBody {
    let settings = ConvertSettings {
        frame: BodyFrame::Principal.into(),
        modes: ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() },
        lumped: Vec::new(),
        ..ConvertSettings::default()
    };
    convert(model, &settings, &Context::QUIET).expect("a body").body
}

/// Motion of the body in a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Moving {
    Free,
    Driven,
    Carried,
}

const MOVING: [Moving; 3] = [Moving::Free, Moving::Driven, Moving::Carried];

/// Returns a body that is pulled at its tip by a force that oscillates from zero with `swing` times its first frequency,
/// and whose recovery has the given limit.
fn pulled(whole: &FlexBody, moving: Moving, swing: f64, limit: RecoveryLimit, static_columns: bool) -> Scene {
    let rate = whole.modes().eigenvalue[0].sqrt();
    let frequency = swing * rate / TAU;
    let axis = Vector3::new(0.3, 0.2, 1.0).normalize();
    let mut scene = nothing_happens("pulled", 2.0 * TAU / rate, 1e-9);
    scene.initial = Initial { axes: Axes::Body, settled: true, ..Initial::default() };
    scene.loads = vec![Load {
        at: Point::Interface("tip".to_owned()),
        force: VectorHistory::Along {
            direction: Vector3::new(1e-4, 3e-4, -2e-4),
            factor: History::Sine { amplitude: 1.0, frequency, phase: 0.0 },
        },
        torque: VectorHistory::nothing(),
        axes: Axes::Body,
    }];
    let growing = |to: f64| VectorHistory::Along {
        direction: axis,
        factor: History::Ramp { from: 0.5 * to, to, start: 0.0, duration: TAU / rate },
    };
    match moving {
        Moving::Free => scene.initial.angular_velocity = 0.03 * rate * axis,
        Moving::Driven => {
            scene.spin =
                Some(Spin { velocity: growing(0.05 * rate), axes: Axes::Model, start: None, hold: true });
        }
        Moving::Carried => {
            let by = Point::Interface("root".to_owned());
            scene.carried = Some(Carried { by, spin: None, translation: None });
        }
    }
    scene.requirements.tolerance.errors.recovery = 1.0;
    scene.requirements.tolerance.errors.stress = f64::INFINITY;
    scene.requirements.recoveries =
        vec![RecoveryTolerance { recovery: "stress".to_owned(), limit, static_columns }];
    scene
}

/// Returns the lowest `modes` of a body.
fn lowest(whole: &FlexBody, modes: usize) -> FlexBody {
    let kept: Vec<usize> = (0..modes).collect();
    whole.reduced(&kept, TermGroups::ALL, Vec::new()).expect("a body")
}

/// Returns the motion of the whole body and that of a part of its modes at the same instants, each with its body in the
/// frame of the scene.
fn motions(whole: &FlexBody, few: &FlexBody, scene: &Scene) -> [(FlexBody, Trace); 2] {
    let framed = FramedScene::new(whole, scene).expect("a stage");
    let (reference, _) = trace(whole, scene, &Context::QUIET).expect("a motion");
    let own = trace_at(few, scene, &reference.time, &Context::QUIET).expect("a motion");
    let few = FramedScene::new(few, scene).expect("a stage").body.into_owned();
    [(framed.body.into_owned(), reference), (few, own)]
}

/// Returns the largest von Mises stress of the difference of two motions and that of the first, over all points and
/// instants, from the values of all rows.
fn plainly(motions: &[(FlexBody, Trace); 2], static_columns: bool) -> [f64; 2] {
    let [reference, own] = motions.each_ref().map(|(_, motion)| motion.recovered.as_ref().expect("a limit"));
    let n_modes = motions[1].0.n_modes();
    let (mut apart, mut largest) = (0.0f64, 0.0f64);
    for (a, b) in reference.states.iter().zip(own.states.iter()) {
        let mut b = b.to_vec();
        if !static_columns {
            b[1 + n_modes..].fill(0.0);
        }
        let (a, b) = (reference.maps[0].values(a), own.maps[0].values(&b));
        let difference: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
        for point in &reference.maps[0].points {
            apart = apart.max(point.von_mises(&difference));
            largest = largest.max(point.von_mises(&a));
        }
    }
    [apart, largest]
}

/// The bounded search finds the error that all points at all instants have, with and without static columns, and a limit
/// as value is one as part of the largest.
#[test]
fn measured_errors_are_those_of_all_points_and_instants() {
    let model = model();
    let whole = body(&model, usize::MAX);
    for moving in MOVING {
        for static_columns in [true, false] {
            let relative = pulled(&whole, moving, 0.4, RecoveryLimit::Relative(0.01), static_columns);
            let both = motions(&whole, &lowest(&whole, 6), &relative);
            let [apart, largest] = plainly(&both, static_columns);
            let measured = |scene: &Scene| {
                let [(framed, reference), (_, own)] = &both;
                let measure = Measure::new(framed, scene, reference);
                measure.of_subset(own, &[0, 1, 2, 3, 4, 5]).largest().recovery.expect("a limit")
            };
            let found = measured(&relative);
            let expected = apart / (0.01 * largest);
            // Peaks between the instants are slightly higher.
            assert!((found / expected - 1.0).abs() < 2e-3, "{moving:?} {static_columns}: {found} {expected}");
            let value = RecoveryLimit::Absolute { value: 1e-5 * largest, unit: "kPa".to_owned() };
            let absolute = measured(&pulled(&whole, moving, 0.4, value, static_columns));
            assert!((absolute / found - 1.0).abs() < 2e-3, "{moving:?} {static_columns}: {found} {absolute}");
        }
    }
}

/// A hundred-thousandth of the load has the same error relative to the largest stress, whatever the least deflection of the scene is.
#[test]
fn limits_of_recoveries_hold_below_the_least_deflection() {
    let model = model();
    let whole = body(&model, usize::MAX);
    let measured = |size: f64, least: Option<f64>| {
        let mut scene = pulled(&whole, Moving::Carried, 0.4, RecoveryLimit::Relative(0.01), true);
        let VectorHistory::Along { direction, .. } = &mut scene.loads[0].force else { panic!("a direction") };
        *direction *= size;
        scene.requirements.tolerance.least_deflection = least;
        let both = motions(&whole, &lowest(&whole, 3), &scene);
        let [(framed, reference), (_, own)] = &both;
        let errors = Measure::new(framed, &scene, reference).of_subset(own, &[0, 1, 2]).largest();
        errors.recovery.expect("a limit")
    };
    let stress = measured(1.0, None);
    assert!(stress > 0.01, "{stress}");
    for (size, least) in [(1e-5, None), (1.0, Some(1.0)), (1e-5, Some(1.0))] {
        let small = measured(size, least);
        assert!((small / stress - 1.0).abs() < 1e-2, "{size} {least:?}: {small} {stress}");
    }
}

/// Returns the estimated errors of a body relative to its model.
fn estimated(model: &FeModel, body: &FlexBody, scene: &Scene) -> ReferenceError {
    let nothing = Enrichment { grows: false, is_fine: false };
    let cases = scene.clone().into();
    let found = enrich(model, &cases, nothing, &Context::QUIET, |_| Ok(body.clone()), |body| body);
    found.expect("an estimate").rounds[0].last().expect("an estimate").clone()
}

/// Returns the error of the recovery relative to the equations of all nodes.
pub(crate) fn of_all_nodes(model: &FeModel, body: &FlexBody, scene: &Scene) -> f64 {
    let framed = FramedScene::new(body, scene).expect("a stage");
    let (motion, _) = trace(&framed.body, &framed.scene, &Context::QUIET).expect("a motion");
    let nodal = NodalReference::new(model, &framed.body, &framed.scene, &motion, &Context::QUIET)
        .expect("a reference");
    nodal.errors(&framed.body, &motion).expect("of one model").largest().recovery.expect("a limit")
}

/// The equations of all nodes, whose stresses come from the operator alone, give the errors that are measured against the
/// body with all its modes; the estimate from unbalanced forces is near both. A body with all modes has none.
#[test]
fn errors_relative_to_all_nodes_are_measured_and_estimated() {
    let model = model();
    let whole = body(&model, usize::MAX);
    for moving in MOVING {
        for (modes, static_columns, swing) in [(4, true, 0.4), (8, true, 0.7), (6, false, 0.4)] {
            let relative = pulled(&whole, moving, swing, RecoveryLimit::Relative(0.01), static_columns);
            let few = lowest(&whole, modes);
            let [apart, largest] = plainly(&motions(&whole, &few, &relative), static_columns);
            let expected = apart / (0.01 * largest);
            // A value as limit: the few modes may have another largest stress.
            let value = RecoveryLimit::Absolute { value: 0.01 * largest, unit: "Pa".to_owned() };
            let scene = pulled(&whole, moving, swing, value, static_columns);
            let nodal = of_all_nodes(&model, &few, &scene);
            let estimate = estimated(&model, &few, &scene).errors.recovery.expect("a limit");
            println!(
                "{moving:?} {modes} {static_columns}: measured {expected:.4}, nodes {nodal:.4}, estimate {estimate:.4}"
            );
            assert!((nodal / expected - 1.0).abs() < 5e-3, "{moving:?} {modes}: {nodal} {expected}");
            assert!((0.7..1.4).contains(&(estimate / expected)), "{moving:?} {modes}: {estimate} {expected}");
        }
        let scene = pulled(&whole, moving, 0.4, RecoveryLimit::Relative(0.01), true);
        let none = estimated(&model, &whole, &scene).errors.recovery.expect("a limit");
        assert!(none < 1e-5, "{moving:?}: {none}");
        let none = of_all_nodes(&model, &whole, &scene);
        assert!(none < 1e-3, "{moving:?}: {none}");
    }
}

fn selected(whole: &FlexBody, scene: &Scene) -> Selection {
    select(whole, &[], &scene.clone().into(), &Context::QUIET).expect("a selection")
}

/// A selected body keeps the limit, as all points at all instants show; a program that superposes modes alone needs more
/// of them, and the elastic energy asks for others.
#[test]
fn a_selected_body_keeps_the_limit() {
    let model = model();
    let whole = body(&model, usize::MAX);
    for moving in MOVING {
        let mut counts = Vec::new();
        for static_columns in [true, false] {
            let scene = pulled(&whole, moving, 0.4, RecoveryLimit::Relative(0.01), static_columns);
            let selection = selected(&whole, &scene);
            // A free body turns so fast that the stress of the spin, which this body does not have, decides the verdict.
            let chosen = selection.chosen.as_ref().expect("measured");
            assert!(chosen.passed(), "{moving:?}: {chosen:?}");
            let groups = selection.groups;
            let own = whole.reduced(&selection.modes, groups, selection.terms.clone()).expect("a body");
            let [apart, largest] = plainly(&motions(&whole, &own, &scene), static_columns);
            assert!(apart <= 0.01 * largest, "{moving:?} {static_columns}: {apart} of {largest}");
            counts.push(selection.modes.len());
        }
        println!("{moving:?}: {counts:?} of {} modes", whole.n_modes());
        assert!(counts[0] < counts[1], "{moving:?}: {counts:?}");
    }
}

#[test]
fn limits_of_other_recoveries_and_units_are_refused() {
    let model = model();
    let whole = body(&model, 6);
    let mut scene = pulled(&whole, Moving::Free, 0.4, RecoveryLimit::Relative(0.01), true);
    scene.requirements.recoveries[0].recovery = "gauges".to_owned();
    let error = trace(&whole, &scene, &Context::QUIET).expect_err("no such recovery");
    assert!(error.has(Code::RecoveryUnknown), "{error}");
    let value = RecoveryLimit::Absolute { value: 1.0, unit: "mm".to_owned() };
    let scene = pulled(&whole, Moving::Free, 0.4, value, true);
    let error = trace(&whole, &scene, &Context::QUIET).expect_err("another unit");
    assert!(error.has(Code::SceneBody), "{error}");
}

/// Section forces, whose rows are loads less inertia of one side of a cut, have the errors that the equations of all nodes
/// show, and the estimate is near them.
#[test]
fn errors_of_section_forces_are_measured_and_estimated() {
    let model = model();
    let whole = body(&model, usize::MAX);
    for moving in MOVING {
        let mut scene = pulled(&whole, moving, 0.4, RecoveryLimit::Relative(0.01), true);
        scene.requirements.recoveries[0].recovery = "cut".to_owned();
        let few = lowest(&whole, 6);
        let [(_, reference), (framed, own)] = &motions(&whole, &few, &scene);
        // The scale of the few modes, as that of the other errors.
        let measure = RecoveryMeasure::new(framed, &scene, own.recovered.as_ref()).expect("a limit");
        let history = measure.errors(own.recovered.as_ref().expect("a limit"), reference.recovered.as_ref());
        let measured = history.into_iter().fold(0.0, f64::max);
        let [of_few, of_whole] = [&few, &whole].map(|body| of_all_nodes(&model, body, &scene));
        let estimate = estimated(&model, &few, &scene).errors.recovery.expect("a limit");
        println!(
            "{moving:?}: measured {measured:.4}, nodes {of_few:.4}, estimate {estimate:.4}, whole {of_whole:.1e}"
        );
        assert!((of_few / measured - 1.0).abs() < 0.01, "{moving:?}: {of_few} {measured}");
        assert!((0.7..1.4).contains(&(estimate / of_few)), "{moving:?}: {estimate} {of_few}");
        assert!(of_whole < 1e-3, "{moving:?}: {of_whole}");
    }
}

/// The rows that an FE program has computed for some shapes are not known for the forces that a motion leaves unbalanced:
/// the estimate says so, and a reference of all nodes is refused.
#[test]
fn rows_of_shapes_have_no_estimate() {
    let model = model();
    let whole = body(&model, usize::MAX);
    let scene = pulled(&whole, Moving::Free, 0.4, RecoveryLimit::Relative(0.01), true);
    let few = lowest(&whole, 6);
    // The stresses of all nodes as answers to unit displacements.
    let mut raw = raw_model();
    let RecoveryOperator::Rows { transposed, labels, .. } = &raw.data.recoveries[0].operator else {
        panic!("rows")
    };
    let (n, rows) = (transposed.n_rows(), transposed.n_cols());
    let dof = |row: usize| DofLabel { node: raw.nodes.ids[row / 3], direction: 1 + (row % 3) as u8 };
    let shapes = AnsweredShapes {
        dofs: (0..n).map(dof).collect(),
        displacements: Mat::identity(n, n),
        digits: 15,
        answers: Mat::from_fn(rows, n, |i, j| transposed.get(j, i)),
        answer_digits: 15,
        energies: None,
    };
    raw.data.recoveries[0].operator = RecoveryOperator::Shapes { shapes, labels: labels.clone() };
    let of_shapes = FeModel::from_raw(raw).expect("a sound model").model;
    let estimate = estimated(&of_shapes, &few, &scene);
    assert_eq!(estimate.errors.recovery, None);
    assert!(estimate.remarks(&scene).iter().any(|remark| remark.code() == Code::RecoveryUnjudged));
    assert!(estimated(&model, &few, &scene).remarks(&scene).is_empty());
    let framed = FramedScene::new(&few, &scene).expect("a stage");
    let (motion, _) = trace(&framed.body, &framed.scene, &Context::QUIET).expect("a motion");
    let error = NodalReference::new(&of_shapes, &framed.body, &framed.scene, &motion, &Context::QUIET);
    assert!(error.expect_err("rows of all nodes are not known").has(Code::Usage));
}
