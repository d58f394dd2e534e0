//! Named loads and preloads beside equations of all nodes, interface loads of the same nodal forces, and the definition of
//! their resultants.

use crate::skewed_beam::skewed_beam;
use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_base::units::UnitSystem;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{Carrier, FlexBody, TermGroups};
use flexbody_body::invariants::{BodyFrame, FrameChoice};
use flexbody_eigen::Wanted;
use flexbody_linalg::CscMatrix;
use flexbody_linalg::context::Context;
use flexbody_model::{
    FeModel, GeometricStiffness, LoadKind, ModelLoad, RawMatrix, RawModel, RecoveryOperator, Reference,
    UnitLoad,
};
use flexbody_motion::scene::{
    Axes, FramedScene, History, Load, Point, RecoveryLimit, RecoveryTolerance, Scene, Scheme, Trace,
    VectorHistory, instants, simulate, trace, trace_at,
};
use flexbody_study::response::{Band, Direction, Place, ResponseRequest};
use flexbody_study::selection::select;
use flexbody_study::trade::NodalReference;
use nalgebra::{Matrix3, Vector3};
use oracle::mesh::entries;
use oracle::random::Random;
use oracle::reference::{dense, modes_of};
use oracle::scenes::nothing_happens;
use std::f64::consts::TAU;
use std::path::PathBuf;

const ALL: usize = 10_000;

fn named(name: &str, forces: Vec<f64>, preload: bool) -> ModelLoad {
    ModelLoad { name: name.to_owned(), forces, preload, path: PathBuf::new() }
}

/// Returns random nodal forces of the size `size`.
fn random_forces(raw: &RawModel, seed: u64, size: f64) -> Vec<f64> {
    let mut random = Random(seed);
    (0..raw.nodes.len()).flat_map(|_| random.vector::<3>()).map(|value| size * value).collect()
}

/// Returns nodal forces without a resultant: opposite forces on pairs of nodes along their connection.
fn pairs(raw: &RawModel, size: f64) -> Vec<f64> {
    let x = &raw.nodes.positions;
    let mut forces = vec![0.0; 3 * x.len()];
    for (first, second) in [(0, x.len() - 1), (3, 9), (5, 12)] {
        let along = (Vector3::from(x[second]) - Vector3::from(x[first])).normalize() * size;
        for k in 0..3 {
            forces[3 * first + k] += along[k];
            forces[3 * second + k] -= along[k];
        }
    }
    forces
}

/// Returns a skewed beam with the load `push`, which has a resultant.
fn pushed(size: f64) -> RawModel {
    let mut raw = skewed_beam(4.0, 5);
    raw.data.named_loads = vec![named("push", random_forces(&raw, 5, size), false)];
    raw
}

/// Returns a skewed beam with the load `push` and the preload `bolts`.
fn bolted(size: f64) -> RawModel {
    let mut raw = pushed(size);
    raw.data.named_loads.push(named("bolts", pairs(&raw, 3.0 * size), true));
    raw
}

fn model(raw: &RawModel) -> FeModel {
    FeModel::from_raw(raw.clone()).expect("a sound model").model
}

fn body(raw: &RawModel, modes: usize, frame: impl Into<FrameChoice>) -> FlexBody {
    let settings = ConvertSettings {
        frame: frame.into(),
        modes: ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() },
        lumped: Vec::new(),
        ..ConvertSettings::default()
    };
    convert(&model(raw), &settings, &Context::QUIET).expect("a body").body
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0f64, |most, value| most.max(value.abs()))
}

/// Returns the largest difference, relative to the largest value of `exact`.
fn apart(found: &[f64], exact: &[f64]) -> f64 {
    assert_eq!(found.len(), exact.len());
    let difference: Vec<f64> = found.iter().zip(exact).map(|(a, b)| a - b).collect();
    largest(&difference) / largest(exact)
}

/// Returns the stresses of the free model under a static load balanced by its inertia, and its compliance, from all modes of
/// the dense matrices.
fn exact_statics(raw: &RawModel, forces: &[f64]) -> (Vec<f64>, f64) {
    let modes = modes_of(&dense(&raw.stiffness.matrix), &dense(&raw.mass.matrix));
    let n = forces.len();
    let (mut u, mut compliance) = (vec![0.0; n], 0.0);
    assert_eq!(modes.shapes.ncols(), modes.eigenvalues.len(), "flexible modes");
    for (j, lambda) in modes.eigenvalues.iter().enumerate() {
        let load: f64 = (0..n).map(|i| modes.shapes[(i, j)] * forces[i]).sum();
        compliance += load * load / lambda;
        (0..n).for_each(|i| u[i] += modes.shapes[(i, j)] * load / lambda);
    }
    let RecoveryOperator::Rows { transposed, labels, .. } = &raw.data.recoveries[0].operator else {
        panic!("rows")
    };
    let mut rows = vec![0.0; labels.len()];
    entries(transposed).for_each(|(row, column, value)| rows[column as usize] += value * u[row as usize]);
    (rows, compliance)
}

/// Returns the stresses of the body under the constant load at `load` with amplitude 1: modes and static column.
fn static_stresses(body: &FlexBody, load: usize) -> Vec<f64> {
    let (recovery, q) = (&body.recoveries()[0], body.static_modal_coordinates().named);
    let row = |i: usize| {
        let of_modes: f64 = (0..body.n_modes()).map(|j| recovery.modes[(i, j)] * q[(j, load)]).sum();
        recovery.named[(i, load)] + of_modes
    };
    (0..recovery.rows.len()).map(row).collect()
}

#[test]
fn static_stresses_are_those_of_all_nodes_with_any_number_of_modes() {
    let raw = bolted(1.0);
    for (at, load) in raw.data.named_loads.iter().enumerate() {
        let (exact, compliance) = exact_statics(&raw, &load.forces);
        let mut alone = Vec::new();
        for frame in [FrameChoice::from(BodyFrame::Principal), FrameChoice::Interface("root".to_owned())] {
            let whole = body(&raw, 8, frame);
            let of = whole.named_loads()[at].compliance.expect("known");
            assert!((of / compliance - 1.0).abs() < 1e-9, "{of:e} for {compliance:e}");
            let kept: Vec<usize> = vec![0, 2, 5];
            let few = whole.reduced(&kept, TermGroups::ALL, Vec::new()).expect("a body");
            let units = UnitSystem::parse("mm", "t", "ms").expect("units");
            let turned = nalgebra::Rotation3::from_euler_angles(0.3, -0.7, 1.1).into_inner();
            let moved = few.in_frame(Vector3::new(0.4, -1.2, 0.7), turned);
            for one in [flexbody_file::in_units(&whole, &units), moved, Ok(few), Ok(whole)] {
                let one = one.expect("a body");
                let error = apart(&static_stresses(&one, at), &exact);
                assert!(error < 1e-9, "{}, {} modes: {error:e}", load.name, one.n_modes());
                let columns: Vec<f64> =
                    (0..exact.len()).map(|i| one.recoveries()[0].named[(i, at)]).collect();
                alone.push(largest(&columns) / largest(&exact));
                let missing = one.named_load_truncation()[at].expect("known");
                assert!((1e-3..1.0).contains(&missing), "{missing}");
            }
        }
        // The modes alone lack most of the stresses of these local loads.
        assert!(alone.iter().all(|part| *part > 0.1), "{alone:?}");
    }
}

/// Modal loads and resultants of every description of a body are the sums over its nodes.
#[test]
fn loads_follow_frame_basis_and_carrier() {
    let raw = bolted(1.0);
    let com = body(&raw, 6, BodyFrame::Principal);
    let on_root = body(&raw, 6, FrameChoice::Interface("root".to_owned()));
    let turned = nalgebra::Rotation3::from_euler_angles(0.3, -0.7, 1.1).into_inner();
    let descriptions = [
        ("in a frame", com.in_frame(Vector3::new(0.4, -1.2, 0.7), turned).expect("a body")),
        ("of some modes", com.reduced(&[0, 3, 4], TermGroups::ALL, Vec::new()).expect("a body")),
        ("carried", com.carried(&Carrier::Interface("tip".to_owned())).expect("a body")),
        ("carried by a node frame", on_root.carried(&Carrier::Interface("tip".to_owned())).expect("a body")),
        ("in mean axes", on_root.in_mean_axes().expect("a body").into_owned()),
        ("on an interface", com.on_interface("tip").expect("a body")),
        ("on its interface", on_root),
        ("as converted", com),
    ];
    for (what, body) in &descriptions {
        for (load, given) in body.named_loads().iter().zip(&raw.data.named_loads) {
            let axes = body.frame().axes.transpose();
            let (mut modal, mut turning) = (vec![0.0; body.n_modes()], Mat::<f64>::zeros(3, body.n_modes()));
            let (mut force, mut torque, mut moments) = (Vector3::zeros(), Vector3::zeros(), Matrix3::zeros());
            for (node, x) in body.nodes().positions.iter().enumerate() {
                let (x, f) = (Vector3::from(*x), axes * Vector3::from_fn(|k, _| given.forces[3 * node + k]));
                (force, torque, moments) = (force + f, torque + x.cross(&f), moments + x * f.transpose());
                for j in 0..body.n_modes() {
                    let psi = Vector3::from_fn(|k, _| body.modes().shape[(3 * node + k, j)]);
                    modal[j] += psi.dot(&f);
                    (0..3).for_each(|k| turning[(k, j)] += psi.cross(&f)[k]);
                }
            }
            let close = |a: f64, b: f64, size: f64| (a - b).abs() < 1e-10 * size;
            let size = largest(&modal);
            assert!(load.modal.iter().zip(&modal).all(|(a, b)| close(*a, *b, size)), "{what}: modal loads");
            assert!((load.force - force).norm() < 1e-10 * 10.0, "{what}: force");
            assert!((load.torque - torque).norm() < 1e-10 * 10.0, "{what}: torque");
            assert!((load.moments - moments).norm() < 1e-10 * 10.0, "{what}: moments");
            let size = turning.norm_max();
            let apart = (&load.turning - &turning).norm_max();
            assert!(apart < 1e-10 * size, "{what}: turning {apart:e} of {size:e}");
        }
    }
}

/// Returns a free body that tumbles under `push` (an amplitude that swings), with a limit for its stresses.
fn tumbling(body: &FlexBody, scheme: Scheme) -> Scene {
    let rate = body.modes().eigenvalue[0].sqrt();
    let mut scene = nothing_happens("pushed", TAU / rate, 1e-9);
    (scene.run.outputs, scene.run.scheme) = (10, scheme);
    scene.initial.angular_velocity = Vector3::new(0.1, -0.15, 0.2) * rate;
    scene.initial.settled = true;
    let frequency = 0.7 * rate / TAU;
    scene.loads = vec![Load::named("push", History::Sine { amplitude: 1.0, frequency, phase: 0.3 })];
    scene.requirements.tolerance.errors.recovery = 1.0;
    let limit = RecoveryLimit::Relative(1e-3);
    scene.requirements.recoveries =
        vec![RecoveryTolerance { recovery: "stress".to_owned(), limit, static_columns: true }];
    scene
}

/// Returns the errors of the motion of a body relative to that of all nodes.
fn errors(model: &FeModel, body: &FlexBody, scene: &Scene) -> (Trace, Vec<(&'static str, Option<f64>)>) {
    let framed = FramedScene::new(body, scene).expect("a frame");
    let (motion, _) = trace(&framed.body, &framed.scene, &Context::QUIET).expect("a motion");
    let nodal = NodalReference::new(model, &framed.body, &framed.scene, &motion, &Context::QUIET)
        .expect("a reference");
    let own = trace_at(&framed.body, &framed.scene, nodal.time(), &Context::QUIET).expect("a motion");
    let errors = nodal.errors(&framed.body, &own).expect("of one model").largest();
    (motion, errors.named().into_iter().collect())
}

#[test]
fn motion_and_stresses_are_those_of_all_nodes() {
    let raw = bolted(2e-3);
    let whole = body(&raw, ALL, BodyFrame::Com);
    let fastest = whole.modes().eigenvalue.iter().copied().fold(0.0, f64::max).sqrt();
    let steps = Scheme::Conserving { order: 4, step: Some(0.5 / fastest) };
    let scene = tumbling(&whole, steps);
    let (motion, found) = errors(&model(&raw), &whole, &scene);
    let deflection = motion.extremes.deflection.value;
    println!("deflection {deflection:.1e}, errors {found:?}");
    assert!(deflection > 1e-3, "{deflection:e}");
    assert!(found.iter().filter_map(|(_, error)| *error).all(|error| error < 1e-6), "{found:?}");
    assert!(found.iter().any(|(name, error)| *name == "recovery" && error.is_some()), "{found:?}");
    // The torque that the load gains by the deformation is no rounding: without it the attitude is another one.
    let mut parts = whole.clone().into_parts();
    parts.named_loads.iter_mut().for_each(|load| load.turning.fill(0.0));
    let other = FlexBody::new(parts).expect("a body");
    let (_, found) = errors(&model(&raw), &other, &scene);
    let attitude = found.iter().find(|(name, _)| *name == "attitude").and_then(|(_, error)| *error);
    assert!(attitude.is_some_and(|error| error > 1e-5), "{found:?}");
}

/// Returns a beam with a load of unit force, spread evenly over the nodes of the tip, in a direction.
fn pulled(direction: &Vector3<f64>) -> RawModel {
    let mut raw = skewed_beam(4.0, 5);
    let tip = raw.data.interfaces[1].nodes.clone();
    let share = 1.0 / tip.len() as f64;
    let mut forces = vec![0.0; 3 * raw.nodes.len()];
    let mut centre = Vector3::zeros();
    for id in &tip {
        let node = *id as usize - 1;
        centre += Vector3::from(raw.nodes.positions[node]) * share;
        (0..3).for_each(|k| forces[3 * node + k] = share * direction[k]);
    }
    raw.data.interfaces[1].reference = Reference::Point(centre.into());
    raw.data.named_loads = vec![named("pull", forces, false)];
    raw
}

#[test]
fn a_named_load_of_a_unit_force_is_the_interface_load() {
    let direction = Vector3::new(0.5, -0.7, 0.3);
    let raw = pulled(&direction);
    let few = body(&raw, 6, BodyFrame::Principal);
    // Static columns come from one solution, so that their agreement shows the nodal forces of both.
    let rate = few.modes().eigenvalue[0].sqrt();
    let history = History::Sine { amplitude: 1e-3, frequency: 0.4 * rate / TAU, phase: 0.2 };
    let mut scene = nothing_happens("pulled", 1.5 * TAU / rate, 1e-11);
    scene.initial.angular_velocity = Vector3::new(0.1, 0.2, -0.1) * rate;
    let mut runs = Vec::new();
    for named in [true, false] {
        scene.loads = vec![if named {
            Load::named("pull", history.clone())
        } else {
            Load {
                at: Point::Interface("tip".to_owned()),
                force: VectorHistory::Along { direction, factor: history.clone() },
                torque: VectorHistory::nothing(),
                axes: Axes::Model,
            }
        }];
        runs.push(simulate(&few, &scene, &Context::QUIET).expect("a run").0);
    }
    let [a, b] = &runs[..] else { panic!("two runs") };
    let states = |run: &flexbody_motion::scene::Recording| -> Vec<f64> {
        run.states.iter().flat_map(|state| state.q.clone()).collect()
    };
    let attitudes = |run: &flexbody_motion::scene::Recording| -> Vec<f64> {
        run.states.iter().flat_map(|state| state.attitude.0).collect()
    };
    let rows = |run: &flexbody_motion::scene::Recording| -> Vec<f64> {
        let recovered = run.recovered.as_ref().expect("recoveries");
        recovered.states.iter().flat_map(|z| recovered.recoveries[0].values(z)).collect()
    };
    let found =
        [apart(&states(a), &states(b)), apart(&attitudes(a), &attitudes(b)), apart(&rows(a), &rows(b))];
    println!("modal coordinates, attitude, stresses: {found:?}");
    assert!(found.iter().all(|error| *error < 1e-11), "{found:?}");
    assert!(largest(&rows(a)) > 0.0);
}

#[test]
fn responses_to_a_named_load_are_those_to_the_interface_load() {
    let raw = pulled(&Vector3::y());
    let few = body(&raw, 6, BodyFrame::Principal);
    let request = |from: &str| ResponseRequest {
        from: vec![Place::parse(from)],
        to: vec![Place::parse("root:z")],
        rows: vec!["stress".to_owned()],
        band: Band::new(0.001, 1.0),
        damping: Some(0.02),
        ..ResponseRequest::default()
    };
    let of = |from: &str| request(from).respond(None, &few, None, &Context::QUIET).expect("a response").0;
    let (named, at_tip) = (of("pull"), of("tip:y"));
    assert_eq!(named.pairs[0].functions[0].from, Direction::Amplitude);
    let values = |response: &flexbody_study::response::Response| -> Vec<f64> {
        let functions = response.pairs.iter().flat_map(|pair| &pair.functions);
        functions.flat_map(|function| function.reduced.iter().flat_map(|z| [z.re, z.im])).collect()
    };
    let error = apart(&values(&named), &values(&at_tip));
    assert!(error < 1e-11, "{error:e}");
    // The error against the model is estimated with the same equations of all nodes.
    let with = |from: &str| {
        request(from).respond(Some(&model(&raw)), &few, None, &Context::QUIET).expect("a response").0
    };
    let (named, at_tip) = (with("pull"), with("tip:y"));
    assert!(apart(&values(&named), &values(&at_tip)) < 1e-11);
    for (place, code) in [("pull:x", Code::PlaceUnknown), ("nothing", Code::PlaceUnknown)] {
        let error = request(place).respond(None, &few, None, &Context::QUIET).expect_err("refused");
        assert!(error.has(code), "{place}: {error}");
    }
}

#[test]
fn a_preload_is_the_state_of_rest() {
    let raw = bolted(2e-3);
    let (exact, _) = exact_statics(&raw, &raw.data.named_loads[1].forces);
    let few = body(&raw, 4, BodyFrame::Com);
    let mut scene = nothing_happens("at rest", TAU / few.modes().eigenvalue[0].sqrt(), 1e-10);
    scene.run.outputs = 4;
    let (_, found) = simulate(&few, &scene, &Context::QUIET).expect("a run");
    assert!(found.iter().any(|diagnostic| diagnostic.code() == Code::PreloadReleased), "{found:?}");
    scene.initial.settled = true;
    let (run, found) = simulate(&few, &scene, &Context::QUIET).expect("a run");
    assert!(found.iter().all(|diagnostic| diagnostic.code() != Code::PreloadReleased), "{found:?}");
    let recovered = run.recovered.as_ref().expect("recoveries");
    for (state, z) in run.states.iter().zip(recovered.states.iter()) {
        // A preload turns nothing, though its forces on the deformed body have a moment.
        assert!(state.omega.norm() < 1e-12 && state.velocity.norm() < 1e-12, "{state:?}");
        let error = apart(&recovered.recoveries[0].values(z), &exact);
        assert!(error < 1e-9, "{error:e}");
    }
    // A scene may not give it an amplitude.
    scene.loads = vec![Load::named("bolts", History::Constant(1.0))];
    let error = simulate(&few, &scene, &Context::QUIET).expect_err("refused");
    assert!(error.has(Code::SceneContradicts), "{error}");
    scene.loads = vec![Load::named("nuts", History::Constant(1.0))];
    let error = simulate(&few, &scene, &Context::QUIET).expect_err("refused");
    assert!(error.has(Code::SceneBody), "{error}");
}

#[test]
fn a_selected_body_keeps_the_limit_of_stresses() {
    let raw = bolted(2e-3);
    let whole = body(&raw, ALL, BodyFrame::Com);
    let mut scene = tumbling(&whole, Scheme::Adaptive { tolerance: 1e-9 });
    scene.requirements.recoveries[0].limit = RecoveryLimit::Relative(0.02);
    scene.requirements.tolerance.errors.stress = f64::INFINITY;
    (scene.requirements.tolerance.errors.attitude, scene.requirements.tolerance.errors.deflection) =
        (0.05, 0.05);
    let selection = select(&whole, &[], &scene.clone().into(), &Context::QUIET).expect("a selection");
    assert!(selection.modes.len() < whole.n_modes(), "{} modes", selection.modes.len());
    let reduced = whole.reduced(&selection.modes, selection.groups, selection.terms.clone()).expect("a body");
    let (_, found) = errors(&model(&raw), &reduced, &scene);
    println!("{} of {} modes: {found:?}", selection.modes.len(), whole.n_modes());
    let recovery = found.iter().find(|(name, _)| *name == "recovery").and_then(|(_, error)| *error);
    assert!(recovery.is_some_and(|error| error < 1.1), "{found:?}");
}

#[test]
fn loads_that_do_not_fit_are_refused() {
    let raw = skewed_beam(4.0, 3);
    let rows = 3 * raw.nodes.len();
    let refused = |loads: Vec<ModelLoad>| {
        let raw = raw.clone().with(|data| data.named_loads = loads);
        FeModel::from_raw(raw).expect_err("refused")
    };
    let some = random_forces(&raw, 1, 1.0);
    let mut infinite = some.clone();
    infinite[4] = f64::INFINITY;
    for (name, forces, preload, code) in [
        ("bolts", vec![1.0; rows - 3], false, Code::NamedLoadMisfit),
        ("bolts", vec![0.0; rows], false, Code::NamedLoadMisfit),
        ("bolts", infinite, false, Code::MatrixNotFinite),
        ("bolts", some.clone(), true, Code::PreloadUnbalanced),
        ("tip", some.clone(), false, Code::ManifestSyntax),
        ("q_3", some.clone(), false, Code::ManifestSyntax),
        ("", some.clone(), false, Code::ManifestSyntax),
    ] {
        let error = refused(vec![named(name, forces, preload)]);
        assert!(error.has(code), "{name}: {error}");
    }
    let twice = refused(vec![named("a", some.clone(), false), named("a", some, false)]);
    assert!(twice.has(Code::ManifestSyntax), "{twice}");
    // Geometric stiffness of a preload would act always, which no mode of the body shows.
    let error = FeModel::from_raw(with_string(&raw, 1e-3, true)).expect_err("refused");
    assert!(error.has(Code::NamedLoadMisfit), "{error}");
}

/// Returns the model with the load `bolts`, and the geometric stiffness `size` of a string between two nodes for it.
fn with_string(raw: &RawModel, size: f64, preload: bool) -> RawModel {
    let rows = 3 * raw.nodes.len();
    let load = UnitLoad { kind: LoadKind::Named("bolts".to_owned()), component: 0 };
    let string = |k: u32| [(k, k, size), (k + 3, k + 3, size), (k, k + 3, -size), (k + 3, k, -size)];
    let triplets: Vec<_> = (0..3).flat_map(string).collect();
    let matrix = CscMatrix::from_triplets(rows, rows, &triplets);
    let matrix = RawMatrix { matrix, ..raw.stiffness.clone() };
    raw.clone().with(|data| {
        data.named_loads = vec![named("bolts", pairs(raw, 1e-4), preload)];
        data.geometric_stiffness = vec![GeometricStiffness { load, matrix }];
    })
}

/// In the static equilibrium under the amplitude a, (K_ff + a K_geo) q = a Psi'f.
#[test]
fn a_named_load_acts_with_its_geometric_stiffness() {
    let few = body(&with_string(&skewed_beam(4.0, 3), 2.0, false), 12, BodyFrame::Com);
    let mut scene = nothing_happens("pressed", 20.0, 1e-11);
    let amplitude = 0.4;
    scene.initial.settled = true;
    scene.loads = vec![Load::named("bolts", History::Constant(amplitude))];
    let framed = FramedScene::new(&few, &scene).expect("a scene");
    let q = &instants(&framed.body, &framed.scene, &[0.0]).expect("a start")[0].q;
    let (load, stress) = (&framed.body.named_loads()[0], &framed.body.geometric_stiffness()[0].matrix);
    let elastic = framed.body.invariants().modal_stiffness();
    let (mut left, mut bent) = (0.0f64, 0.0f64);
    for i in 0..q.len() {
        let force = |matrix: &Mat<f64>| (0..q.len()).map(|j| matrix[(i, j)] * q[j]).sum::<f64>();
        left = left.max((force(elastic) + amplitude * (force(stress) - load.modal[i])).abs());
        bent = bent.max((amplitude * force(stress)).abs());
    }
    let size = amplitude * largest(&load.modal);
    assert!(left < 1e-6 * size && bent > 0.01 * size, "{left:e} {bent:e} {size:e}");
}
