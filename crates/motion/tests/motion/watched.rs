//! Velocity and acceleration of watched points, and forces of the reference conditions: compared with
//! differences of positions, with the unreduced equations, and with closed forms.

use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{Damping, FeModel, RawMatrix, RawModel};
use flexbody_motion::dynamics::{NodalEquations, NodalEvaluation, NodalModes, ReferenceConditions};
use flexbody_motion::scene::{LoadCases, ModeStart, Path, Point, Recording, Scene, simulate};
use nalgebra::Vector3;
use oracle::elements::ElementKind;
use oracle::flexible::fixture;
use oracle::general::raw_fixture;
use oracle::scenes::nothing_happens;
use oracle::unreduced::{soft_block, soft_plate};

/// Reads the scene of a text like the program.
fn scene(text: &str) -> Scene {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).expect("written");
    LoadCases::read_single(path, None).expect("a scene")
}

fn recorded(body: &FlexBody, scene: &Scene) -> Recording {
    simulate(body, scene, &Context::QUIET).expect("a motion").0
}

/// Returns the differences of velocity and acceleration from central differences of the positions, relative
/// to the largest.
fn beside_differences(path: &Path, width: f64) -> [f64; 2] {
    let inner = 1..path.place.len() - 1;
    let largest = |vectors: &[Vector3<f64>]| vectors.iter().map(|v| v.norm()).fold(0.0, f64::max);
    let most =
        |left: &dyn Fn(usize) -> Vector3<f64>| inner.clone().map(|i| left(i).norm()).fold(0.0, f64::max);
    let x = &path.place;
    let velocity = |i: usize| path.velocity[i] - (x[i + 1] - x[i - 1]) / (2.0 * width);
    let acceleration = |i: usize| path.acceleration[i] - (x[i + 1] - 2.0 * x[i] + x[i - 1]) / (width * width);
    [most(&velocity) / largest(&path.velocity), most(&acceleration) / largest(&path.acceleration)]
}

/// Half the distance of the output times gives a quarter of the difference. These scenes have no kinks, where
/// differences would not converge.
#[test]
fn velocities_and_accelerations_are_derivatives_of_the_places() {
    let tumbling = "gravity = [0, 0, -9810]\n[initial]\nvelocity = [500, 0, 2000]\nangular_velocity = [28, 900, 4]\n\
        mode = [{ number = 2, amplitude = 1e-4, rate = 3 }]\n[[watch]]\ninterface = \"bolt_wall\"\n[[watch]]\nnode = 20000\n\
        [[load]]\ninterface = \"bolt_base\"\nforce = [30, 0, 10]\nhistory = { amplitude = 1, frequency = 900 }\n";
    let spun = "[initial]\ndeformation = \"static\"\n[spin]\naxis = [0.2, 1, 0.1]\nrate = { amplitude = 700, frequency = 150, phase = 1 }\n\
        [[watch]]\ninterface = \"bolt_wall\"\n";
    let carried = "[carried]\ninterface = \"bolt_base\"\n[carried.spin]\naxis = [0, 1, 0.3]\nthrough = [5, 0, 0]\n\
        rate = { amplitude = 500, frequency = 200 }\n[carried.translation]\ndirection = [1, 0, 0]\n\
        velocity = { amplitude = 300, frequency = 250 }\n[[watch]]\ninterface = \"bolt_wall\"\n[[watch]]\ninterface = \"bolt_base\"\n";
    let body = fixture("bracket_hex20", 6, BodyFrame::Principal);
    for (what, text) in [("tumbling", tumbling), ("spun", spun), ("carried", carried)] {
        let errors = |outputs: usize| -> Vec<[f64; 2]> {
            let duration = 4e-3;
            let text = format!(
                "{}\n[run]\nduration = {duration}\noutputs = {outputs}\ntolerance = 1e-13\n",
                text.trim_end()
            );
            let recording = recorded(&body, &scene(&text));
            recording.paths.iter().map(|path| beside_differences(path, duration / outputs as f64)).collect()
        };
        let (coarse, fine) = (errors(2000), errors(4000));
        for (a, b) in coarse.iter().zip(&fine) {
            for k in 0..2 {
                let order = (a[k] / b[k]).log2();
                println!("{what}: derivative {} {:.1e}, order {order:.3}", k + 1, b[k]);
                assert!((1.9..2.1).contains(&order), "{what}: derivative {}: {} {}", k + 1, a[k], b[k]);
                assert!(b[k] < 0.02, "{what}: derivative {}: {}", k + 1, b[k]);
            }
        }
    }
}

/// For a steady spin about a held axis every point moves on a circle, with the deformation caused by the
/// spin. Explicit steps let rounding grow up to their tolerance, and accelerations amplify it by the largest
/// eigenvalue: the tolerance is therefore the smallest possible.
#[test]
fn a_steady_spin_has_centripetal_accelerations() {
    let body = fixture("bracket_hex20", 6, BodyFrame::Principal);
    let spin = Vector3::new(0.6, 0.0, 0.8) * 800.0;
    let text = "[run]\nduration = 2e-3\noutputs = 40\ntolerance = 1e-14\n[initial]\ndeformation = \"static\"\n\
        [spin]\naxis = [0.6, 0, 0.8]\nrate = 800\nhold = true\n[[watch]]\ninterface = \"bolt_wall\"\n[[watch]]\nnode = 20000\n";
    let recording = recorded(&body, &scene(text));
    for path in &recording.paths {
        assert!(path.deflection[0].norm() > 1e-5, "{}: {}", path.name, path.deflection[0]);
        for (i, state) in recording.states.iter().enumerate() {
            let arm = path.place[i] - state.origin;
            let (velocity, acceleration) = (spin.cross(&arm), spin.cross(&spin.cross(&arm)));
            let [v, a] = [path.velocity[i] - velocity, path.acceleration[i] - acceleration];
            assert!(v.norm() < 1e-9 * velocity.norm(), "{}: {v}", path.name);
            assert!(a.norm() < 1e-8 * acceleration.norm(), "{}: {a}", path.name);
        }
    }
}

/// Returns a model with all of its modes, along its own axes.
fn whole(raw: RawModel) -> (FeModel, FlexBody) {
    let model = FeModel::from_raw(raw).expect("a body").model;
    let modes = ModeSettings { wanted: Wanted::Lowest(10_000), ..ModeSettings::default() };
    let settings = ConvertSettings { modes, frame: BodyFrame::Com.into(), ..ConvertSettings::default() };
    let body = convert(&model, &settings, &Context::QUIET).expect("converts").body;
    (model, body)
}

/// Returns a scene in which the body rotates, translates and vibrates under gravity; all nodes are watched.
/// Deformation, gravity and the square of the spin are proportional to `amplitude`.
fn lively(body: &FlexBody, amplitude: f64) -> Scene {
    let (rate, mass) = (body.modes().eigenvalue[0].sqrt(), body.invariants().mass());
    let plane = body.dimension() == 2;
    let mut scene = nothing_happens("lively", 3.0 / rate, 1e-10);
    scene.run.outputs = 3;
    let axis = if plane { Vector3::z() } else { Vector3::new(0.3, 1.0, -0.2) };
    let flight = Vector3::new(0.2, -0.4, if plane { 0.0 } else { 0.3 });
    scene.initial.angular_velocity = axis * (0.3 * rate * amplitude.sqrt());
    scene.initial.velocity = flight * (rate * body.extent());
    scene.gravity = Some(flight * (0.1 * rate * rate * body.extent() * amplitude));
    let size = 0.02 * body.extent() * mass.sqrt() * amplitude;
    let mode = |mode| ModeStart { mode, amplitude: size, rate: 0.5 * size * rate };
    scene.initial.modes = (0..3).map(mode).collect();
    scene.watched = body.nodes().ids.iter().map(|id| Point::Node(*id)).collect();
    scene
}

/// Largest differences from the unreduced equations: velocities and accelerations of the nodes, relative to
/// the largest, torque of the conditions, and their force relative to that of the accelerations.
#[derive(Debug, Default)]
struct Differences {
    velocity: f64,
    acceleration: f64,
    torque: f64,
    force: f64,
}

fn differences(model: &FeModel, body: &FlexBody, scene: &Scene) -> Differences {
    let recording = recorded(body, scene);
    let equations =
        NodalEquations::new(model, body.frame(), &ReferenceConditions::MeanAxes).expect("equations");
    let lifting = NodalModes::new(&equations, body).expect("the modes of this model");
    let mut at = NodalEvaluation::new(&equations);
    let mut found = Differences::default();
    for (i, state) in recording.states.iter().enumerate() {
        at.set(&equations.state(&lifting.lift(state)).expect("a state")).expect("a state");
        at.add_gravity(&scene.gravity.expect("gravity"));
        let mut udd = vec![0.0; equations.n_rows()];
        let (linear, angular) = at.accelerations(&mut udd).expect("accelerations");
        let (axes, omega) = (at.axes(), state.omega);
        let frame = linear + omega.cross(&axes.tr_mul(&state.velocity));
        let row = |of: &[f64], node: usize| {
            let id = body.nodes().ids[node];
            Vector3::from_fn(|k, _| {
                let own = (0..model.rows().len()).find(|&row| {
                    let label = model.label(row);
                    label.node == id && usize::from(label.direction) == k + 1
                });
                own.map_or(0.0, |row| of[row])
            })
        };
        let size = recording.paths.iter().map(|path| path.acceleration[i].norm()).fold(0.0, f64::max);
        for (node, path) in recording.paths.iter().enumerate() {
            let arm = axes.tr_mul(&(at.place(node) - state.origin));
            let relative = row(&udd, node) + omega.cross(&row(at.displacement_rates(), node)) * 2.0;
            let turned = angular.cross(&arm) + omega.cross(&omega.cross(&arm));
            let expected = axes * (frame + turned + relative);
            let error = (path.acceleration[i] - expected).norm() / size;
            found.acceleration = found.acceleration.max(error);
            let velocity = at.node_velocity(node);
            found.velocity = found.velocity.max((path.velocity[i] - velocity).norm() / velocity.norm());
        }
        let (force, torque) = at.reaction();
        if let Some(own) = &recording.conditions {
            assert!(torque.norm() > 0.0);
            found.torque = found.torque.max((own[i] - torque).norm() / torque.norm());
        } else {
            assert!(body.invariants().general().is_some(), "mean axes");
        }
        found.force = found.force.max(force.norm() / (size * body.invariants().mass()));
    }
    found
}

/// With all modes the nodes of the reduced body have the velocities and accelerations of the unreduced
/// equations, and the forces of the reference conditions equal lambda there; also for damped bodies.
#[test]
fn watched_nodes_and_conditions_are_those_of_the_unreduced_equations() {
    let solid = |mut raw: RawModel, damping: Option<Damping<RawMatrix>>| {
        raw.data.damping = damping;
        raw
    };
    let cases = [
        ("block", solid(soft_block(ElementKind::Hex8, [3, 2, 1]), None)),
        (
            "damped block",
            solid(
                soft_block(ElementKind::Hex8, [3, 2, 1]),
                Some(Damping::Rayleigh { alpha: 0.2, beta: 0.03 }),
            ),
        ),
        ("plate", soft_plate()),
    ];
    for (name, raw) in cases {
        let (model, body) = whole(raw);
        let found = differences(&model, &body, &lively(&body, 1.0));
        let Differences { velocity, acceleration, torque, force } = found;
        assert!(velocity < 1e-9 && acceleration < 1e-9, "{name}: {velocity:e} {acceleration:e}");
        assert!(torque < 1e-8 && force < 1e-10, "{name}: {torque:e} {force:e}");
    }
}

/// If rotations carry mass, the reduced equations hold to second order of the displacements: half the
/// amplitude halves the relative difference of accelerations. The torque of the conditions is then not
/// recorded, because it is no sum over invariants.
#[test]
fn watched_nodes_that_turn_are_those_of_the_unreduced_equations_to_second_order() {
    let (model, body) = whole(raw_fixture("mpc_block"));
    let [coarse, fine] = [0.02, 0.01].map(|amplitude| differences(&model, &body, &lively(&body, amplitude)));
    assert!(fine.velocity < 1e-9 && fine.force < 1e-10, "{fine:?}");
    let ratio = coarse.acceleration / fine.acceleration;
    assert!((1.8..2.2).contains(&ratio) && fine.acceleration < 1e-3, "{coarse:?} and {fine:?}");
}

/// The carrier is the reference condition of a carried body: its reaction is the only constraint force.
#[test]
fn a_carried_body_has_no_mean_axes() {
    let body = fixture("bracket_hex20", 4, BodyFrame::Principal);
    let text = "gravity = [0, 0, -9810]\n[run]\nduration = 1e-3\noutputs = 5\n[carried]\ninterface = \"bolt_base\"\n";
    let recording = recorded(&body, &scene(text));
    assert!(recording.conditions.is_none() && recording.reactions.is_some());
}
