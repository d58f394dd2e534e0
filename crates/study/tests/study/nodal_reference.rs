//! Motion of all nodes in every kind of scene: with all modes of its model a body moves like the nodes, to
//! second order of the displacements if rotations of nodes carry mass.

use flexbody_base::diagnostic::Code;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, Damping, FeModel, NodeSet, RawModel, Reference};
use flexbody_motion::scene::{
    Axes, Carried, CarriedSpin, Drive, FramedScene, History, Initial, Load, OutputErrors, Point,
    Requirements, Scene, Scheme, Spin, Trace, VectorHistory, trace, trace_at,
};
use flexbody_study::trade::NodalReference;
use nalgebra::Vector3;
use oracle::beams::{BeamMass, star};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::general::raw_fixture;
use oracle::mesh::{Mesh, grid};
use oracle::scenes::nothing_happens;
use oracle::unreduced::soft_plate;
use proptest::prelude::*;

/// A number of modes beyond that of any model.
const ALL: usize = 10_000;

/// Limit for implicit steps, which the nodes share, so that the difference is rounding.
const SAME_STEPS: f64 = 1e-7;

/// Ratio of the fastest to the slowest mode above which a test would need too many implicit steps.
const STIFF: f64 = 100.0;

/// Limit for thousands of explicit steps with the tolerances 1e-9 of the body and 1e-8 of the nodes: the
/// difference is the step error, which falls with the tolerance.
const EXPLICIT: f64 = 1e-5;
const FALLS: f64 = 10.0;

/// Returns a model with the interfaces `left` (averaging, with its reference point off the nodes) and `right`
/// (rigid) at its ends along x.
fn with_ends(mut raw: RawModel) -> RawModel {
    let x: Vec<f64> = raw.nodes.positions.iter().map(|x| x[0]).collect();
    let (least, most) = x.iter().fold((f64::INFINITY, -f64::INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
    let near = |at: f64| -> Vec<i64> {
        let nodes = raw.nodes.ids.iter().zip(&x).filter(|(_, x)| (*x - at).abs() < 0.2 * (most - least));
        nodes.map(|(id, _)| *id).collect()
    };
    let mean = |ids: &[i64]| {
        let at = |id: &i64| raw.nodes.ids.iter().position(|own| own == id).expect("a node");
        ids.iter().map(|id| Vector3::from(raw.nodes.positions[at(id)])).sum::<Vector3<f64>>()
            / ids.len() as f64
    };
    let (left, right) = (near(least), near(most));
    let plane = raw.nodes.positions.iter().all(|x| x[2] == 0.0);
    let beside = mean(&left) + 0.1 * (most - least) * Vector3::new(-1.0, 0.4, if plane { 0.0 } else { 0.2 });
    raw.data.interfaces = vec![
        NodeSet {
            coupling: Some(Coupling::Averaging),
            reference: Reference::Point(beside.into()),
            ..NodeSet::new("left", left)
        },
        NodeSet { coupling: Some(Coupling::Rigid), ..NodeSet::new("right", right) },
    ];
    raw
}

/// Returns a skewed rubber beam of a few bricks.
fn solid() -> RawModel {
    let rubber = Material { youngs: 4.0, poisson: 0.3, density: 1.0 };
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid([3, 1, 1]), |[x, y, z]| {
        [0.5 * x + 0.06 * y, 0.4 * y * (1.0 - 0.05 * x), 0.3 * z * (1.0 + 0.1 * y)]
    });
    with_ends(mesh.assemble(&rubber, MassRule::Consistent).raw_model())
}

fn model_of(raw: RawModel) -> FeModel {
    FeModel::from_raw(raw).expect("a sound model").model
}

fn body_of(model: &FeModel, modes: usize) -> FlexBody {
    let modes = ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() };
    convert(model, &ConvertSettings { modes, ..ConvertSettings::default() }, &Context::QUIET)
        .expect("a body")
        .body
}

/// Scales of a body: first circular frequency, mass and length. Forces and the squares of spins are
/// proportional to the amplitude.
struct Size {
    amplitude: f64,
    rate: f64,
    spin: f64,
    fastest: f64,
    force: f64,
    torque: f64,
    plane: bool,
}

impl Size {
    fn new(body: &FlexBody) -> Self {
        Self::of_amplitude(body, 1.0)
    }

    fn of_amplitude(body: &FlexBody, amplitude: f64) -> Self {
        let rate = body.modes().eigenvalue[0].sqrt();
        let mass = body.invariants().mass();
        let radius = (body.invariants().inertia().trace() / mass).sqrt();
        let force = 0.03 * mass * radius * rate * rate * amplitude;
        let fastest = body.modes().eigenvalue.iter().copied().fold(0.0, f64::max).sqrt();
        let spin = rate * amplitude.sqrt();
        Self { amplitude, rate, spin, fastest, force, torque: force * radius, plane: body.dimension() == 2 }
    }

    /// Returns a vector; for a plane body in its plane.
    fn along(&self, v: [f64; 3]) -> Vector3<f64> {
        Vector3::new(v[0], v[1], if self.plane { 0.0 } else { v[2] })
    }

    /// Returns a rotation vector; for a plane body normal to its plane.
    fn about(&self, v: [f64; 3]) -> Vector3<f64> {
        if self.plane { Vector3::new(0.0, 0.0, v[2]) } else { v.into() }
    }

    fn gravity(&self, v: [f64; 3]) -> Option<Vector3<f64>> {
        Some(self.along(v) * (self.amplitude * self.rate * self.rate))
    }

    fn swing(&self, times: f64) -> History {
        History::Sine { amplitude: 1.0, frequency: times * self.rate / std::f64::consts::TAU, phase: 0.3 }
    }

    /// Returns a scene without loads over a period of the first mode.
    fn scene(&self, scheme: Scheme) -> Scene {
        let mut scene = nothing_happens("all nodes", std::f64::consts::TAU / self.rate, 1e-9);
        (scene.run.outputs, scene.run.scheme) = (10, scheme);
        scene.initial = Initial {
            origin: self.along([0.1, 0.2, -0.1]),
            rotation: self.about([0.3, -0.2, 0.5]),
            angular_velocity: self.about([0.05, 0.03, -0.04]) * self.spin,
            ..Initial::default()
        };
        scene
    }

    fn steps(&self, order: usize) -> Scheme {
        // The reduced equations iterate on the modes of a carried body, and on torques.
        Scheme::Conserving { order, step: Some(0.5 / self.fastest) }
    }

    /// Returns forces and torques at both interfaces, along axes of the world and of the model.
    fn at_interfaces(&self, torques: bool) -> Vec<Load> {
        let along = |direction: Vector3<f64>, factor: &History| VectorHistory::Along {
            direction,
            factor: factor.clone(),
        };
        let torque = |v: [f64; 3]| if torques { self.about(v) * self.torque } else { Vector3::zeros() };
        let load = |name: &str, force: [f64; 3], t: [f64; 3], axes: Axes, history: History| Load {
            at: Point::Interface(name.to_owned()),
            force: along(self.along(force) * self.force, &history),
            torque: along(torque(t), &history),
            axes,
        };
        vec![
            load("left", [0.4, 1.0, -0.6], [0.3, -0.5, 0.8], Axes::World, self.swing(0.7)),
            load("right", [-0.7, 0.5, 0.9], [0.2, 0.6, -0.4], Axes::Model, self.swing(1.3)),
        ]
    }

    fn spin(&self, hold: bool) -> Option<Spin> {
        let axis = self.about([0.2, -0.3, 1.0]).normalize();
        let rate = History::Ramp {
            from: 0.1 * self.spin,
            to: 0.3 * self.spin,
            start: 0.0,
            duration: 5.0 / self.rate,
        };
        let velocity = VectorHistory::Along { direction: axis, factor: rate };
        Some(Spin { velocity, axes: Axes::Model, start: None, hold })
    }

    /// Returns a carrier that rotates about a moving axis beside it.
    fn carried(&self, by: Point) -> Option<Carried> {
        // Loads by the square of the spin and by its rate are proportional to the amplitude.
        let (to, change) = (0.2 * self.spin, 0.2 * self.rate * self.amplitude);
        let rate = History::Ramp { from: to - change, to, start: 0.0, duration: 5.0 / self.rate };
        let axis = self.about([0.5, 0.3, 1.0]).normalize();
        let through = Some(self.along([-0.3, 0.2, 0.1]));
        let amplitude = 0.02 * self.rate * self.amplitude;
        let velocity = History::Sine { amplitude, frequency: 0.1 * self.rate, phase: 0.0 };
        let direction = self.along([0.6, -1.0, 0.4]).normalize();
        let turning = VectorHistory::Along { direction: axis, factor: rate };
        Some(Carried {
            by,
            spin: Some(CarriedSpin { velocity: turning, axes: Axes::Model, start: None, through }),
            translation: Some(Drive::Velocity(VectorHistory::Along { direction, factor: velocity })),
        })
    }
}

/// Returns the motion of a body, and its errors relative to the motion of the nodes of its model.
fn errors(model: &FeModel, body: &FlexBody, scene: &Scene) -> (Trace, OutputErrors) {
    let framed = FramedScene::new(body, scene).expect("a stage");
    let (motion, _) = trace(&framed.body, &framed.scene, &Context::QUIET).expect("a motion");
    let nodal = NodalReference::new(model, &framed.body, &framed.scene, &motion, &Context::QUIET)
        .expect("a reference");
    if matches!(scene.run.scheme, Scheme::Conserving { .. }) {
        // Both integrations use the same steps.
        assert_eq!(nodal.time(), motion.time, "the same steps");
    }
    let own = trace_at(&framed.body, &framed.scene, nodal.time(), &Context::QUIET).expect("a motion");
    let errors = nodal.errors(&framed.body, &own).expect("of one model").largest();
    (motion, errors)
}

/// Asserts that the body moves like the nodes with all modes, but not with few modes.
fn assert_same(what: &str, raw: &RawModel, scene: impl Fn(&Size, Scheme) -> Scene) {
    let model = model_of(raw.clone());
    if model.director_mass().is_some() {
        return assert_second_order(what, &model, scene);
    }
    let whole = body_of(&model, ALL);
    let size = Size::new(&whole);
    let explicit = Scheme::Adaptive { tolerance: 1e-9 };
    let mut fine = f64::INFINITY;
    let mut schemes = vec![(explicit, EXPLICIT)];
    // A carried body is integrated explicitly in any scheme.
    if size.fastest < STIFF * size.rate && scene(&size, explicit).carried.is_none() {
        schemes.extend([2, 4, 6].map(|order| (size.steps(order), SAME_STEPS)));
    }
    for (scheme, limit) in schemes {
        let scene = scene(&size, scheme);
        let (motion, errors) = errors(&model, &whole, &scene);
        assert!(
            motion.extremes.deflection.value > 1e-3,
            "{what}, {scheme:?}: {:e}",
            motion.extremes.deflection.value
        );
        let OutputErrors { deflection, stress, reaction, .. } = errors;
        if scheme == explicit {
            fine = stress.expect("a deformed body");
        }
        assert_eq!(reaction.is_some(), scene.prescribes(), "{what}, {scheme:?}");
        assert!(deflection.is_some() && stress.is_some(), "{what}, {scheme:?}");
        let mut found = errors.named().into_iter().filter_map(|(_, error)| error);
        assert!(found.all(|error| error < limit), "{what}, {scheme:?}: {errors:?}");
    }
    let rough = scene(&size, Scheme::Adaptive { tolerance: 1e-6 });
    let rough = errors(&model, &whole, &rough).1.stress.expect("a deformed body");
    assert!(fine * FALLS < rough, "{what}: {rough:e} falls to {fine:e}");
    let scene = scene(&size, explicit);
    let (_, errors) = errors_of_few(&model, &scene);
    assert!(errors.stress.is_some_and(|error| error > 1e-3), "{what} with four modes: {errors:?}");
}

/// Asserts that a body whose rotations carry mass has the kinetic energy of the nodes to second order of the
/// displacements: half the amplitude halves the relative errors. Implicit steps give the errors of explicit
/// steps.
fn assert_second_order(what: &str, model: &FeModel, scene: impl Fn(&Size, Scheme) -> Scene) {
    let whole = body_of(model, ALL);
    let explicit = Scheme::Adaptive { tolerance: 1e-9 };
    let at = |amplitude: f64, implicit: bool| {
        let size = Size::of_amplitude(&whole, amplitude);
        let scene = scene(&size, if implicit { size.steps(6) } else { explicit });
        (errors(model, &whole, &scene).1, scene.carried.is_some())
    };
    let ((coarse, is_carried), (fine, _)) = (at(0.1, false), at(0.05, false));
    let parts =
        |errors: &OutputErrors| [errors.deflection, errors.stress].map(|error| error.expect("deformed"));
    for (coarse, fine) in parts(&coarse).into_iter().zip(parts(&fine)) {
        assert!(fine < 0.01 && (1.7..2.3).contains(&(coarse / fine)), "{what}: {coarse:e} and {fine:e}");
    }
    if let (Some(coarse), Some(fine)) = (coarse.reaction, fine.reaction) {
        // Only the frame has these errors, of third order.
        let least = if is_carried { 1.7 } else { 3.4 };
        assert!(fine < 0.01 && coarse / fine > least, "{what}: {coarse:e} and {fine:e}");
    }
    // A carried body is integrated explicitly in any scheme.
    if !is_carried {
        for (implicit, fine) in parts(&at(0.05, true).0).into_iter().zip(parts(&fine)) {
            assert!((implicit / fine - 1.0).abs() < 0.01, "{what}: {implicit:e} by implicit steps, {fine:e}");
        }
    }
}

fn errors_of_few(model: &FeModel, scene: &Scene) -> (Trace, OutputErrors) {
    errors(model, &body_of(model, 4), scene)
}

#[test]
#[ignore = "slow"]
fn loads_at_interfaces_act_on_their_nodes() {
    for (what, raw, torques) in [
        ("solid", solid(), true),
        ("plane", with_ends(soft_plate()), true),
        ("beams", with_ends(star(BeamMass::Consistent)), true),
        ("massless rotations", with_ends(star(BeamMass::Lumped)), true),
    ] {
        assert_same(what, &raw, |size, scheme| Scene {
            loads: size.at_interfaces(torques),
            watched: vec![Point::Interface("left".to_owned()), Point::Interface("right".to_owned())],
            ..size.scene(scheme)
        });
    }
}

#[test]
#[ignore = "slow"]
fn spin_is_prescribed_with_the_centre_free_or_held() {
    for (what, raw) in [
        ("solid", solid()),
        ("plane", with_ends(soft_plate())),
        ("beams", with_ends(star(BeamMass::Consistent))),
    ] {
        for hold in [false, true] {
            assert_same(what, &raw, |size, scheme| Scene {
                spin: size.spin(hold),
                loads: size.at_interfaces(true),
                gravity: size.gravity([0.0, -0.01, 0.02]),
                ..size.scene(scheme)
            });
        }
    }
}

#[test]
#[ignore = "slow"]
fn ratios_damp_the_modes_on_the_nodes() {
    let scene = |size: &Size, scheme| {
        let mut scene =
            Scene { loads: size.at_interfaces(true), spin: size.spin(false), ..size.scene(scheme) };
        scene.requirements.damping = Some(0.05.into());
        scene
    };
    assert_same("solid", &solid(), scene);
    // The model states the damping.
    let own = solid().with(|data| data.damping = Some(Damping::Ratio(0.08)));
    assert_same("of the model", &own, |size, scheme| Scene {
        loads: size.at_interfaces(true),
        ..size.scene(scheme)
    });
    let rayleigh = solid().with(|data| data.damping = Some(Damping::Rayleigh { alpha: 0.1, beta: 0.02 }));
    assert_same("Rayleigh", &rayleigh, |size, scheme| Scene {
        requirements: Requirements::default(),
        ..scene(size, scheme)
    });
    // The damping ratio of the scene replaces that of the model for the nodes too.
    assert_same("replaced", &rayleigh, |size, scheme| {
        let mut scene = scene(size, scheme);
        scene.requirements.replaces_damping = true;
        scene
    });
}

#[test]
fn what_carries_a_body_moves_it() {
    let interface = || Point::Interface("left".to_owned());
    let rigid = || Point::Interface("right".to_owned());
    for (what, raw, by) in [
        ("averaging", solid(), interface()),
        ("rigid", solid(), rigid()),
        ("plane", with_ends(soft_plate()), interface()),
    ] {
        assert_same(what, &raw, |size, scheme| {
            let mut scene = Scene {
                carried: size.carried(by.clone()),
                gravity: size.gravity([0.01, -0.02, 0.02]),
                ..size.scene(scheme)
            };
            scene.requirements.damping = Some(0.03.into());
            scene
        });
    }
}

/// A node carries beams along a line. For a rotating node, the tolerances of steps are relative to the energy
/// of the spin, which is too large compared with this deformation
/// (`carried_nodes_accelerate_as_carried_modes_to_second_order` covers the spin).
#[test]
fn a_node_carries_beams() {
    let raw = with_ends(star(BeamMass::Consistent));
    let by = Point::Node(raw.nodes.ids[0]);
    assert_same("beams", &raw, |size, scheme| Scene {
        carried: size.carried(by.clone()).map(|carried| Carried { spin: None, ..carried }),
        gravity: size.gravity([0.01, -0.02, 0.02]),
        ..size.scene(scheme)
    });
}

#[test]
#[ignore = "slow"]
fn settled_starts_have_the_static_deformation_of_the_nodes() {
    for (what, raw) in [("solid", solid()), ("beams", with_ends(star(BeamMass::Consistent)))] {
        for driven in [false, true] {
            assert_same(what, &raw, |size, scheme| {
                let mut scene = Scene {
                    loads: size.at_interfaces(true),
                    spin: if driven { size.spin(true) } else { None },
                    ..size.scene(scheme)
                };
                scene.initial.settled = true;
                scene
            });
        }
    }
}

/// A body carried by an interface starts in equilibrium too, under gravity and the acceleration of its
/// carrier: its first frequency is far below that of the free body.
#[test]
fn a_carried_body_starts_in_equilibrium() {
    assert_same("solid", &solid(), |size, scheme| {
        let mut scene = Scene {
            carried: size.carried(Point::Interface("left".to_owned())),
            gravity: size.gravity([0.01, -0.02, 0.02]),
            ..size.scene(scheme)
        };
        scene.initial.settled = true;
        scene
    });
}

/// Halves the implicit steps; the explicit method has error control.
#[test]
fn implicit_and_explicit_steps_meet_in_one_motion() {
    let model = model_of(solid());
    let whole = body_of(&model, ALL);
    let size = Size::new(&whole);
    let scene =
        |scheme| Scene { loads: size.at_interfaces(true), spin: size.spin(false), ..size.scene(scheme) };
    // The reference is accurate; the collocation of order 4 converges like h^4.
    let exact = scene(Scheme::Adaptive { tolerance: 1e-11 });
    let error = |step: f64| {
        let framed =
            FramedScene::new(&whole, &scene(Scheme::Conserving { order: 4, step: Some(step / size.rate) }))
                .map(|framed| (framed.body.into_owned(), framed.scene.into_owned()))
                .expect("a stage");
        let (motion, _) = trace(&framed.0, &framed.1, &Context::QUIET).expect("a motion");
        let nodal =
            NodalReference::new(&model, &framed.0, &framed.1, &motion, &Context::QUIET).expect("a reference");
        let staged = FramedScene::new(&whole, &exact).expect("a stage");
        let own = trace_at(&staged.body, &staged.scene, nodal.time(), &Context::QUIET).expect("a motion");
        nodal.errors(&whole_of(&staged), &own).expect("of one model").largest().stress.expect("deformed")
    };
    let errors = [0.1, 0.05, 0.025].map(error);
    let orders = [errors[0] / errors[1], errors[1] / errors[2]];
    assert!(orders.iter().all(|ratio| (10.0..20.0).contains(ratio)), "{errors:?}");
}

fn whole_of(framed: &FramedScene<'_>) -> FlexBody {
    framed.body.clone().into_owned()
}

#[test]
fn long_work_is_refused_with_what_it_takes() {
    let model = model_of(solid());
    let body = body_of(&model, 4);
    let size = Size::new(&body);
    let mut scene = size.scene(Scheme::Adaptive { tolerance: 1e-9 });
    scene.run.duration = Some(1e12 / size.rate);
    let error =
        NodalReference::refuse(&model, &body, &scene, &Context { longest: Some(1800.0), ..Context::QUIET })
            .expect_err("too long");
    let found = &error.diagnostics()[0];
    assert_eq!(found.code(), Code::WorkLong);
    assert!(found.message().contains("1800 s are allowed"), "{}", found.message());
    assert!(NodalReference::refuse(&model, &body, &scene, &Context::QUIET).is_ok());
    scene.run.duration = Some(1.0 / size.rate);
    assert!(
        NodalReference::refuse(&model, &body, &scene, &Context { longest: Some(1800.0), ..Context::QUIET })
            .is_ok()
    );
}

#[test]
fn geometric_stiffness_is_refused_where_it_acts() {
    let model = model_of(raw_fixture("turbine_blade"));
    let body = body_of(&model, 4);
    let mut scene = Size::new(&body).scene(Scheme::Adaptive { tolerance: 1e-9 });
    let error =
        NodalReference::refuse(&model, &body, &scene, &Context::QUIET).expect_err("geometric stiffness");
    let found = &error.diagnostics()[0];
    assert_eq!(found.code(), Code::Usage);
    assert!(found.message().contains("geometric stiffness"), "{}", found.message());
    scene.carried = Some(Carried { by: Point::Interface("root".to_owned()), spin: None, translation: None });
    assert!(NodalReference::refuse(&model, &body, &scene, &Context::QUIET).is_err());
    // A file of an earlier version, or a scene, may leave it out.
    let mut parts = body.clone().into_parts();
    parts.rotated_stiffness.clear();
    let older = FlexBody::new(parts).expect("a body");
    assert!(NodalReference::refuse(&model, &older, &scene, &Context::QUIET).is_ok());
    scene.run.terms.geometric_stiffness = false;
    assert!(NodalReference::refuse(&model, &body, &scene, &Context::QUIET).is_ok());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    #[ignore = "slow"]
    fn any_load_and_any_spin(
        (force, torque) in (prop::array::uniform3(-1.0f64..1.0), prop::array::uniform3(-1.0f64..1.0)),
        (axis, speed) in (prop::array::uniform3(-1.0f64..1.0), 0.0f64..0.4),
        (order, hold, world) in (1usize..4, any::<bool>(), any::<bool>()),
        (damping, step, swing) in (0.0f64..0.2, 0.02f64..0.2, 0.2f64..2.0),
    ) {
        prop_assume!(Vector3::from(axis).norm() > 0.1);
        let model = model_of(solid());
        let whole = body_of(&model, ALL);
        let size = Size::new(&whole);
        let swinging = |direction: Vector3<f64>, factor: History| VectorHistory::Along { direction, factor };
        let load = Load {
            at: Point::Interface("left".to_owned()),
            force: swinging(Vector3::from(force) * size.force, size.swing(swing)),
            torque: swinging(Vector3::from(torque) * size.torque, size.swing(swing)),
            axes: if world { Axes::World } else { Axes::Model },
        };
        let spin = Spin {
            velocity: swinging(
                Vector3::from(axis).normalize(),
                History::Sine { amplitude: speed * size.rate, frequency: 0.1 * size.rate, phase: 1.0 },
            ),
            axes: Axes::Model,
            start: None,
            hold,
        };
        let scheme = Scheme::Conserving { order: 2 * order, step: Some(step / size.rate) };
        let mut scene = Scene { loads: vec![load], spin: Some(spin), ..size.scene(scheme) };
        scene.requirements.damping = Some(damping.into());
        let (_, errors) = errors(&model, &whole, &scene);
        let mut found = errors.named().into_iter().filter_map(|(_, error)| error);
        prop_assert!(found.all(|error| error < SAME_STEPS), "{:?}", errors);
    }
}
