//! Stresses with static columns of the forces of motion, beside those of the equations of all nodes: bodies that turn fast
//! and deform, and bodies with a damping matrix.

use crate::random_response::random;
use crate::recovery_limits::of_all_nodes;
use crate::skewed_beam::skewed_beam;
use flexbody_body::basis::{BasisChoice, CraigBampton, ModeSettings};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{FlexBody, MotionLoad};
use flexbody_body::invariants::{BodyFrame, FrameChoice};
use flexbody_eigen::Wanted;
use flexbody_linalg::CscMatrix;
use flexbody_linalg::context::Context;
use flexbody_model::{Damping, FeModel, ModelLoad, RawMatrix, RawModel, RecoveryOperator};
use flexbody_motion::scene::{
    Axes, Carried, CarriedSpin, History, Initial, Load, Point, RecoveryLimit, RecoveryTolerance, Scene, Spin,
    VectorHistory, simulate,
};
use flexbody_study::response::{Band, Place, ResponseRequest};
use nalgebra::{Complex, DMatrix, Vector3};
use oracle::mesh::entries;
use oracle::reference::dense;
use oracle::scenes::nothing_happens;
use std::f64::consts::TAU;
use std::path::PathBuf;

fn model(raw: &RawModel) -> FeModel {
    FeModel::from_raw(raw.clone()).expect("a sound model").model
}

fn body(raw: &RawModel, basis: BasisChoice, modes: usize, frame: impl Into<FrameChoice>) -> FlexBody {
    let settings = ConvertSettings {
        basis,
        frame: frame.into(),
        modes: ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() },
        lumped: Vec::new(),
        ..ConvertSettings::default()
    };
    convert(&model(raw), &settings, &Context::QUIET).expect("a body").body
}

/// Returns a beam whose recovery has columns of the inertia of the deformation.
fn beam() -> RawModel {
    let mut raw = skewed_beam(4.0, 5);
    raw.data.recoveries[0].deformed_inertia = true;
    raw
}

/// Returns a body without columns of some forces of motion.
fn without(body: &FlexBody, load: &[MotionLoad]) -> FlexBody {
    let mut parts = body.clone().into_parts();
    parts.recoveries.iter_mut().for_each(|recovery| recovery.motion.retain(|own| !load.contains(&own.load)));
    FlexBody::new(parts).expect("a body")
}

/// Kind of motion of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Moving {
    Tumbling,
    Driven,
    Carried,
}

/// Returns a beam that turns at `spin` times its first frequency, pulled at its tip by a force that swings at a tenth of it.
fn turning(body: &FlexBody, moving: Moving, spin: f64, force: f64) -> Scene {
    // A beam that is carried at one end vibrates more slowly than a free one.
    let rate = body.modes().eigenvalue[0].sqrt() * if moving == Moving::Carried { 0.16 } else { 1.0 };
    let axis = Vector3::new(0.3, 0.4, 1.0).normalize();
    let mut scene = nothing_happens("turning", TAU / (0.1 * rate), 1e-9);
    scene.run.outputs = 40;
    scene.initial = Initial { axes: Axes::Model, settled: true, ..Initial::default() };
    scene.loads = vec![Load {
        at: Point::Interface("tip".to_owned()),
        force: VectorHistory::Along {
            direction: Vector3::new(0.2, 1.0, -0.7) * force,
            factor: History::Ramp { from: 0.0, to: 1.0, start: 0.0, duration: TAU / (0.2 * rate) },
        },
        torque: VectorHistory::nothing(),
        axes: Axes::Body,
    }];
    let to = spin * rate;
    let velocity = VectorHistory::Along {
        direction: axis,
        factor: History::Ramp { from: 0.5 * to, to, start: 0.0, duration: TAU / (0.12 * rate) },
    };
    match moving {
        Moving::Tumbling => scene.initial.angular_velocity = to * axis,
        Moving::Driven => {
            scene.spin = Some(Spin { velocity, axes: Axes::Model, start: None, hold: true });
        }
        Moving::Carried => {
            let spin = Some(CarriedSpin { velocity, axes: Axes::Model, start: None, through: None });
            let by = Point::Interface("root".to_owned());
            scene.carried = Some(Carried { by, spin, translation: None });
        }
    }
    scene.requirements.tolerance.errors.recovery = 1.0;
    scene.requirements.tolerance.errors.stress = f64::INFINITY;
    let limit = RecoveryLimit::Relative(1.0);
    scene.requirements.recoveries =
        vec![RecoveryTolerance { recovery: "stress".to_owned(), limit, static_columns: true }];
    scene
}

/// The columns of inertia take over most of what the columns of loads and spin leave out while a body turns and deforms;
/// the rest is the motion of the modes that were left out.
#[test]
fn a_turning_deformed_body_has_the_stresses_of_all_nodes() {
    let raw = beam();
    let craig = body(&raw, BasisChoice::CraigBampton(CraigBampton), 2, BodyFrame::Com);
    let free = body(&raw, BasisChoice::default(), 14, BodyFrame::Com);
    let cases = [
        ("Craig-Bampton", &craig, Moving::Tumbling, 5e-3),
        ("Craig-Bampton", &craig, Moving::Driven, 1e-3),
        ("free", &free, Moving::Tumbling, 1.5e-4),
        ("free", &free, Moving::Driven, 3e-5),
    ];
    for (basis, few, moving, limit) in cases {
        let scene = turning(few, moving, 0.15, 4e-4);
        let with = of_all_nodes(&model(&raw), few, &scene);
        let plain = of_all_nodes(&model(&raw), &without(few, &MotionLoad::INERTIA), &scene);
        println!("{basis} {moving:?}: {with:.1e}, without the columns {plain:.1e}");
        assert!(with < limit && with < 0.6 * plain, "{basis} {moving:?}: {with:e} {plain:e}");
    }
}

/// Returns the beam with a viscous damper between the middles of two of its edges, along their connection: most of its
/// damping forces are local, and no small number of modes holds them.
fn damped_beam(rate: f64) -> RawModel {
    let mut raw = skewed_beam(4.0, 5);
    let n = raw.nodes.len();
    let [a, b] = [5usize, 18];
    let x = |node: usize| Vector3::from(raw.nodes.positions[node]);
    let line = (x(b) - x(a)).normalize();
    let row = |node: usize, k: usize| (3 * node + k) as u32;
    let mut entries = Vec::new();
    for (k, l) in (0..3).flat_map(|k| (0..3).map(move |l| (k, l))) {
        let d = rate * line[k] * line[l];
        for (i, j) in [(a, b), (b, a)] {
            entries.extend([(row(i, k), row(i, l), d), (row(i, k), row(j, l), -d)]);
        }
    }
    let matrix = CscMatrix::from_triplets(3 * n, 3 * n, &entries);
    raw.data.damping = Some(Damping::Matrix(RawMatrix { matrix, ..raw.stiffness.clone() }));
    raw
}

/// The forces of a damper act on the body as loads do: with their columns the stresses are those of all nodes, in every
/// basis and for a body that is carried.
#[test]
fn damping_forces_count_as_loads() {
    let raw = damped_beam(0.1);
    let free = body(&raw, BasisChoice::default(), 8, BodyFrame::Com);
    let craig = body(&raw, BasisChoice::CraigBampton(CraigBampton), 4, BodyFrame::Com);
    for (basis, few) in [("free", &free), ("Craig-Bampton", &craig)] {
        let scene = turning(few, Moving::Driven, 0.02, 4e-4);
        let with = of_all_nodes(&model(&raw), few, &scene);
        let plain = of_all_nodes(&model(&raw), &without(few, &[MotionLoad::Damping]), &scene);
        println!("{basis}: {with:.1e}, without the columns {plain:.1e}");
        assert!(with < 1e-3 && with < 0.5 * plain, "{basis}: {with:e} {plain:e}");
    }
}

/// Returns the rows of the first recovery for a unit amplitude of the first named load at the angular frequency `omega`, from
/// dense equations of all nodes.
fn dense_response(raw: &RawModel, omega: f64) -> Vec<Complex<f64>> {
    let [k, m] = [&raw.stiffness.matrix, &raw.mass.matrix].map(dense);
    let d = match &raw.data.damping {
        Some(Damping::Matrix(damping)) => dense(&damping.matrix),
        Some(Damping::Rayleigh { alpha: 0.0, beta }) => &k * *beta,
        _ => panic!("damping of another kind"),
    };
    let n = k.nrows();
    let dynamic =
        DMatrix::from_fn(n, n, |i, j| Complex::new(k[(i, j)] - omega * omega * m[(i, j)], omega * d[(i, j)]));
    let forces = DMatrix::from_fn(n, 1, |i, _| Complex::new(raw.data.named_loads[0].forces[i], 0.0));
    let u = dynamic.lu().solve(&forces).expect("not at a resonance");
    let RecoveryOperator::Rows { transposed, .. } = &raw.data.recoveries[0].operator else { panic!("rows") };
    let mut rows = vec![Complex::new(0.0, 0.0); transposed.n_cols()];
    entries(transposed).for_each(|(row, column, value)| rows[column as usize] += u[row as usize] * value);
    rows
}

/// Returns the model with a unit force along y, spread evenly over the tip.
fn pushed(mut raw: RawModel) -> RawModel {
    let tip = raw.data.interfaces[1].nodes.clone();
    let mut forces = vec![0.0; 3 * raw.nodes.len()];
    tip.iter().for_each(|id| forces[3 * (*id as usize - 1) + 1] = 1.0 / tip.len() as f64);
    raw.data.named_loads =
        vec![ModelLoad { name: "push".to_owned(), forces, preload: false, path: PathBuf::new() }];
    raw
}

/// Rows of a frequency response and of a random vibration have the columns of damping and of acceleration.
#[test]
fn responses_have_the_columns_of_rates() {
    let mut raw = pushed(damped_beam(0.1));
    raw.data.recoveries[0].deformed_inertia = true;
    let craig = body(&raw, BasisChoice::CraigBampton(CraigBampton), 2, BodyFrame::Com);
    let hertz = 0.3 * craig.frequencies_hz()[0];
    let expected = dense_response(&raw, TAU * hertz);
    let size = expected.iter().map(|z| z.norm()).fold(0.0, f64::max);
    let error = |body: &FlexBody| {
        let request = ResponseRequest {
            from: vec![Place::parse("push")],
            rows: vec!["stress".to_owned()],
            band: Band::new(hertz, 1.0001 * hertz),
            ..ResponseRequest::default()
        };
        let (found, _) = request.respond(None, body, None, &Context::QUIET).expect("a response");
        let functions = &found.pairs[0].functions;
        assert_eq!(functions.len(), expected.len());
        let apart = functions.iter().zip(&expected).map(|(one, z)| (one.reduced[0] - z).norm());
        apart.fold(0.0, f64::max) / size
    };
    let with = error(&craig);
    let each = [MotionLoad::Damping, MotionLoad::Acceleration].map(|load| error(&without(&craig, &[load])));
    println!("{with:.1e}, without damping and without acceleration {each:?}");
    assert!(each.iter().all(|plain| with < 0.5 * plain), "{with:e} {each:?}");
    // In a narrow band the root mean square is the magnitude of the response times that of the input.
    let high = 1.0001 * hertz;
    let asked = ResponseRequest {
        from: vec![Place::parse("push")],
        band: Band::new(hertz, high),
        ..ResponseRequest::default()
    };
    let table = format!("hertz,push:amplitude\n{hertz},3.0\n{high},3.0\n");
    let found = random(&asked, None, &craig, &table);
    let input = found.inputs[0].1;
    let apart = found.recoveries[0].rms.iter().zip(&expected).map(|(rms, z)| (rms / input - z.norm()).abs());
    let apart = apart.fold(0.0, f64::max) / size;
    assert!(apart < 1.1 * with, "{apart:e} {with:e}");
}

/// The response outside of the modes is damped in proportion to its stiffness too, and lags by 1 / (1 + i w beta). Rows of the
/// body, and those of all nodes that its error is measured by, agree with dense equations.
#[test]
fn damping_in_proportion_to_the_stiffness_is_in_the_static_columns() {
    let plain = pushed(skewed_beam(4.0, 5));
    let few = |damping: Option<Damping<RawMatrix>>| {
        body(&plain.clone().with(|data| data.damping = damping), BasisChoice::default(), 3, BodyFrame::Com)
    };
    let hertz = 0.1 * few(None).frequencies_hz()[0];
    let beta = 0.1 / (TAU * hertz);
    let raw = plain.clone().with(|data| data.damping = Some(Damping::Rayleigh { alpha: 0.0, beta }));
    let expected = dense_response(&raw, TAU * hertz);
    let size = expected.iter().map(|z| z.norm()).fold(0.0, f64::max);
    let band = Band::new(hertz, 1.0001 * hertz);
    let request = ResponseRequest {
        from: vec![Place::parse("push")],
        rows: vec!["stress".to_owned()],
        band,
        ..ResponseRequest::default()
    };
    let damped = few(raw.data.damping.clone());
    let (found, _) = request.respond(Some(&model(&raw)), &damped, None, &Context::QUIET).expect("a response");
    let functions = &found.pairs[0].functions;
    let apart = |value: &dyn Fn(usize) -> Complex<f64>| {
        (0..expected.len()).map(|row| (value(row) - expected[row]).norm()).fold(0.0, f64::max) / size
    };
    let own = apart(&|row| functions[row].reduced[0]);
    let solved = apart(&|row| functions[row].full[0].expect("solved"));
    println!("{own:.1e}, all nodes {solved:.1e}");
    // Without the lag the columns are off by w beta of their part.
    let lag = 0.1 * damped.part_of_static_columns(&damped.recoveries()[0]);
    assert!(own < 0.1 * lag && solved < 1e-8, "{own:e} of {lag:e}, {solved:e}");
    // Over time, after the start has died away: the rows swing with the amplitude and the phase of the response.
    // A small force, which hardly turns the free body.
    let amplitude = 1e-8;
    let mut scene = nothing_happens("swinging", 6.0 / hertz, 1e-9);
    scene.run.outputs = 240;
    scene.loads = vec![Load::named("push", History::Sine { amplitude, frequency: hertz, phase: 0.0 })];
    let recording = simulate(&damped, &scene, &Context::QUIET).expect("a motion").0;
    let recovered = recording.recovered.expect("rows");
    let mut late = 0.0f64;
    for (time, z) in recording.time.iter().zip(recovered.states.iter()).filter(|(t, _)| **t > 5.0 / hertz) {
        let turn = Complex::from_polar(amplitude, TAU * hertz * time);
        for (row, value) in recovered.recoveries[0].values(z).into_iter().enumerate() {
            late = late.max((value - (expected[row] * turn).im).abs());
        }
    }
    late /= amplitude * size;
    assert!(late < 0.1 * lag, "{late:e} of {lag:e}");
}
