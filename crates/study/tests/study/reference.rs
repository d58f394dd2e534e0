//! Estimated errors of a body relative to its model, compared with the motion of all nodes; enriched bodies;
//! starts without a shock.

use flexbody_base::diagnostic::Code;
use flexbody_body::basis::{BasisChoice, CraigBampton, ModeSettings};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_body::verification::accept;
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_linalg::gram;
use flexbody_model::{Coupling, Damping, FeModel, NodeSet, RawModel};
use flexbody_motion::scene::{
    Axes, Carried, CarriedSpin, Drive, FramedScene, History, Initial, Load, LoadCases, Measure, ModeStart,
    OtherModes, OutputErrors, Point, Scene, Scheme, Spin, VectorHistory, simulate, trace, trace_at,
};
use flexbody_study::reference::{Enriched, Enrichment, PART_OF_REFERENCE, ReferenceError, enrich};
use flexbody_study::tailoring::{Tailoring, convert_for};
use flexbody_study::trade::NodalReference;
use nalgebra::Vector3;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Mesh, grid};
use oracle::scenes::nothing_happens;
use proptest::prelude::*;

/// Returns a skewed rubber beam of bricks with an interface at one end.
fn model() -> FeModel {
    beam([4, 1, 1])
}

fn beam(cells: [i32; 3]) -> FeModel {
    beam_of(ElementKind::Hex8, MassRule::Consistent, cells)
}

fn beam_of(element: ElementKind, rule: MassRule, cells: [i32; 3]) -> FeModel {
    rooted_beam(element, rule, cells, Coupling::Averaging)
}

fn raw_beam() -> RawModel {
    raw_rooted_beam(ElementKind::Hex8, MassRule::Consistent, [4, 1, 1], Coupling::Averaging)
}

fn rooted_beam(element: ElementKind, rule: MassRule, cells: [i32; 3], coupling: Coupling) -> FeModel {
    FeModel::from_raw(raw_rooted_beam(element, rule, cells, coupling)).expect("a sound model").model
}

fn raw_rooted_beam(element: ElementKind, rule: MassRule, cells: [i32; 3], coupling: Coupling) -> RawModel {
    let rubber = Material { youngs: 4.0, poisson: 0.3, density: 1.0 };
    let mesh = Mesh::from_cells(element, &grid(cells), |[x, y, z]| {
        [0.5 * x + 0.06 * y, 0.4 * y * (1.0 - 0.05 * x), 0.3 * z * (1.0 + 0.1 * y)]
    });
    let raw = mesh.assemble(&rubber, rule).raw_model();
    let nodes = raw.nodes.ids.iter().zip(&raw.nodes.positions).filter(|(_, at)| at[0] < 0.1);
    let root = NodeSet::new("root", nodes.map(|(id, _)| *id).collect());
    let interfaces = vec![NodeSet { coupling: Some(coupling), ..root }];
    raw.with(|data| data.interfaces = interfaces)
}

/// Returns settings with a principal frame, so that loads and spins of the scenes are along principal axes.
fn settings(modes: usize) -> ConvertSettings {
    ConvertSettings {
        frame: BodyFrame::Principal.into(),
        modes: ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() },
        lumped: Vec::new(),
        ..ConvertSettings::default()
    }
}

fn body(model: &FeModel, modes: usize) -> FlexBody {
    convert(model, &settings(modes), &Context::QUIET).expect("a body").body
}

/// Returns the first circular frequency of the model.
fn first_rate(model: &FeModel) -> f64 {
    body(model, 1).modes().eigenvalue[0].sqrt()
}

/// Returns a free rotating body pulled at a node by a force that oscillates from zero, over a few of its
/// first periods.
fn pulled(model: &FeModel, node: usize, force: Vector3<f64>, swing: f64, spin: Vector3<f64>) -> Scene {
    let rate = first_rate(model);
    Scene {
        initial: Initial {
            angular_velocity: spin * rate,
            axes: Axes::Body,
            settled: true,
            ..Initial::default()
        },
        loads: vec![Load {
            at: Point::Node(model.nodes().ids[node]),
            force: VectorHistory::Along {
                direction: force,
                factor: History::Sine {
                    amplitude: 1.0,
                    frequency: swing * rate / std::f64::consts::TAU,
                    phase: 0.0,
                },
            },
            torque: VectorHistory::nothing(),
            axes: Axes::Body,
        }],
        ..nothing_happens("pulled", 2.0 * std::f64::consts::TAU / rate, 1e-9)
    }
}

/// Returns the estimate for a body without enrichment.
fn estimated(model: &FeModel, body: &FlexBody, scene: &Scene) -> ReferenceError {
    let found = enrich(
        model,
        &scene.clone().into(),
        Enrichment { grows: false, is_fine: false },
        &Context::QUIET,
        |_| Ok(body.clone()),
        |body| body,
    )
    .expect("an estimate");
    found.rounds[0].last().expect("an estimate").clone()
}

/// Returns the errors of deflection and stress relative to the motion of all nodes.
fn true_errors(model: &FeModel, body: &FlexBody, scene: &Scene) -> [f64; 2] {
    let errors = all_true_errors(model, body, scene);
    [errors.deflection, errors.stress].map(|error| error.expect("a deformed body"))
}

/// Returns all errors relative to the motion of all nodes.
fn all_true_errors(model: &FeModel, body: &FlexBody, scene: &Scene) -> OutputErrors {
    let framed = FramedScene::new(body, scene).expect("a stage");
    let (motion, _) = trace(&framed.body, &framed.scene, &Context::QUIET).expect("a motion");
    let nodal = NodalReference::new(model, &framed.body, &framed.scene, &motion, &Context::QUIET)
        .expect("a reference");
    nodal.errors(&framed.body, &motion).expect("of one model").largest()
}

/// Prescribed motion of the body frame.
#[derive(Debug, Clone, Copy)]
enum Given {
    /// A growing spin with the centre of mass held.
    Spin,
    /// Carried by the root at rest.
    Rest,
    /// Carried by the root, which oscillates along a line.
    Swing,
    /// Carried by the root, which rotates with growing rate about an axis beside it.
    Turn,
}

/// Returns a body pulled like in [`pulled`] with prescribed motion of its frame.
fn driven(model: &FeModel, given: Given, node: usize, force: Vector3<f64>, swing: f64) -> Scene {
    let rate = first_rate(model);
    let mut scene = pulled(model, node, force, swing, Vector3::zeros());
    let period = std::f64::consts::TAU / rate;
    let growing = VectorHistory::Along {
        direction: Vector3::new(0.3, 0.2, 1.0).normalize(),
        factor: History::Ramp { from: 0.02 * rate, to: 0.04 * rate, start: 0.0, duration: period },
    };
    let root = || Point::Interface("root".to_owned());
    let velocity = VectorHistory::Along {
        direction: Vector3::new(0.2, -0.4, 1.0).normalize(),
        factor: History::Sine { amplitude: 1e-3 * rate, frequency: 0.3 / period, phase: 0.0 },
    };
    match given {
        Given::Spin => {
            scene.spin = Some(Spin { velocity: growing, axes: Axes::Model, start: None, hold: true });
        }
        Given::Rest => scene.carried = Some(Carried { by: root(), spin: None, translation: None }),
        Given::Swing => {
            let translation = Some(Drive::Velocity(velocity));
            scene.carried = Some(Carried { by: root(), spin: None, translation });
        }
        Given::Turn => {
            let through = Some(Vector3::new(-0.4, 0.3, 0.1));
            let spin = CarriedSpin { velocity: growing, axes: Axes::Model, start: None, through };
            scene.carried = Some(Carried { by: root(), spin: Some(spin), translation: None });
        }
    }
    scene
}

const GIVEN: [Given; 4] = [Given::Spin, Given::Rest, Given::Swing, Given::Turn];

#[test]
fn a_body_with_all_modes_lacks_nothing() {
    let model = model();
    let whole = body(&model, usize::MAX);
    let scene = pulled(&model, 7, Vector3::new(1e-4, 2e-4, -1e-4), 0.7, Vector3::new(0.002, 0.003, 0.001));
    let lack = estimated(&model, &whole, &scene);
    // Rounding of the residuals in the norm of K^+.
    assert!(lack.worst < 1e-6, "{lack:?}");
}

#[test]
fn a_driven_body_with_all_modes_lacks_nothing() {
    let model = model();
    let whole = body(&model, usize::MAX);
    for given in GIVEN {
        let scene = driven(&model, given, 17, Vector3::new(1e-5, 2e-5, -1e-5), 0.4);
        let lack = estimated(&model, &whole, &scene);
        assert!(lack.worst < 1e-6 && lack.errors.reaction.is_some(), "{given:?}: {lack:?}");
    }
}

/// Reactions have no static part from which an error could be estimated: truncated modes affect them by their
/// inertia.
#[test]
fn a_driven_body_lacks_in_its_reaction_what_all_nodes_say() {
    let model = model();
    for given in GIVEN {
        for modes in [6, 9] {
            let scene = driven(&model, given, 17, Vector3::new(1e-5, 2e-5, -1e-5), 0.4);
            let body = body(&model, modes);
            let lack = estimated(&model, &body, &scene).errors;
            let found = all_true_errors(&model, &body, &scene);
            let pairs = [
                ("deflection", lack.deflection, found.deflection),
                ("stress", lack.stress, found.stress),
                ("reaction", lack.reaction, found.reaction),
            ];
            for (what, lack, found) in pairs {
                let effectivity = lack.expect(what) / found.expect(what);
                assert!(
                    (0.6..1.7).contains(&effectivity),
                    "{given:?}, {modes} modes, {what}: {effectivity} of {found:?}"
                );
            }
            assert_eq!(lack.attitude, Some(0.0), "{given:?}");
            assert!(found.attitude.is_some_and(|angle| angle < 1e-9), "{given:?}");
        }
    }
}

/// The truncated response of a carried body is added as residual vectors of the free body.
#[test]
fn responses_join_a_body_that_is_carried() {
    let model = model();
    let mut scene = driven(&model, Given::Swing, 17, Vector3::new(1e-5, 2e-5, -1e-5), 0.4);
    scene.requirements.tolerance.errors.stress = 0.05;
    scene.requirements.tolerance.errors.deflection = 0.05;
    scene.requirements.tolerance.errors.reaction = 0.05;
    let tailoring = Tailoring { settings: settings(4), by_band: false, of_motion: false };
    let Enriched { made, rounds } =
        tailoring.convert(&model, &scene.clone().into(), &Context::QUIET).expect("a body");
    let rounds = &rounds[0];
    let (first, last) = (&rounds[0], &rounds[rounds.len() - 1]);
    assert!(first.worst > 1.0 && last.worst < PART_OF_REFERENCE, "{rounds:?}");
    let found = all_true_errors(&model, &made.body, &scene).worst(&scene.requirements.tolerance);
    assert!((0.4..2.5).contains(&(last.worst / found)), "{found} {rounds:?}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    /// The estimate is linear and without gyroscopic terms: it is accurate for small deflections and slow
    /// rotation.
    #[test]
    fn the_estimate_is_near_the_true_error(
        (modes, node) in (3usize..9, 0usize..20),
        force in prop::array::uniform3(-2e-4f64..2e-4),
        (swing, spin) in (0.2f64..1.5, prop::array::uniform3(-0.02f64..0.02)),
    ) {
        let model = model();
        let scene = pulled(&model, node, force.into(), swing, spin.into());
        let body = body(&model, modes);
        let lack = estimated(&model, &body, &scene);
        let [deflection, stress] = true_errors(&model, &body, &scene);
        let effectivity = lack.errors.stress.expect("a deformed body") / stress;
        prop_assert!((0.7..1.4).contains(&effectivity), "stress: {:?} is {} of {}", lack, effectivity, stress);
        let effectivity = lack.errors.deflection.expect("a deformed body") / deflection;
        prop_assert!((0.7..1.4).contains(&effectivity), "deflection: {:?} is {} of {}", lack, effectivity, deflection);
    }
}

/// The mass of ten-node tetrahedra with four points is singular: motions without mass follow loads
/// immediately, both in the nodal motion and in the estimate. A single force has a resultant, so that the
/// body accelerates. A body with all modes lacks only these motions.
#[test]
fn motions_without_mass_follow_a_force_that_accelerates_the_body() {
    let model = beam_of(ElementKind::Tet10, MassRule::Reduced, [1, 1, 1]);
    let force = Vector3::new(1e-5, 2e-5, -1e-5);
    let scene = pulled(&model, 11, force, 0.4, Vector3::zeros());
    for modes in [9, 15, usize::MAX] {
        let body = body(&model, modes);
        let lack = estimated(&model, &body, &scene).errors;
        let [deflection, stress] = true_errors(&model, &body, &scene);
        for (own, found) in [(lack.deflection, deflection), (lack.stress, stress)] {
            let effectivity = own.expect("a deformed body") / found;
            assert!((0.97..1.03).contains(&effectivity), "{modes} modes: {effectivity} of {found}");
        }
    }
}

/// Covers a thousand periods, ten times an earlier limit.
#[test]
#[ignore = "slow"]
fn a_long_run_is_followed() {
    let model = model();
    let mut scene = pulled(&model, 7, Vector3::new(1e-5, 2e-5, -1e-5), 0.7, Vector3::zeros());
    scene.run.duration = scene.run.duration.map(|periods| 500.0 * periods);
    let body = body(&model, 6);
    let lack = estimated(&model, &body, &scene);
    let [deflection, stress] = true_errors(&model, &body, &scene);
    for (own, found) in [(lack.errors.deflection, deflection), (lack.errors.stress, stress)] {
        let effectivity = own.expect("a deformed body") / found;
        assert!((0.7..1.4).contains(&effectivity), "{effectivity} of {found}: {lack:?}");
    }
}

#[test]
fn responses_join_until_what_is_lacking_does_not_count() {
    let model = model();
    let mut scene =
        pulled(&model, 7, Vector3::new(1e-4, 2e-4, -1e-4), 0.7, Vector3::new(0.002, 0.003, 0.001));
    scene.requirements.tolerance.errors.stress = 0.2;
    scene.requirements.tolerance.errors.deflection = 0.2;
    let tailoring = Tailoring { settings: settings(4), by_band: false, of_motion: false };
    let Enriched { made, rounds } =
        tailoring.convert(&model, &scene.clone().into(), &Context::QUIET).expect("a body");
    let rounds = &rounds[0];
    let (first, last) = (&rounds[0], &rounds[rounds.len() - 1]);
    assert!(first.modes == 4 && first.worst > 1.0, "{rounds:?}");
    assert!(last.modes == made.body.n_modes() && last.worst < 0.3 * first.worst, "{rounds:?}");
    // The reference motion of all nodes confirms the estimate, which does not use it.
    let [_, before] = true_errors(&model, &body(&model, 4), &scene);
    let [deflection, after] = true_errors(&model, &made.body, &scene);
    assert!(before > 0.2 && after < 0.3 * before && deflection < 0.1, "{before} {after} {deflection}");
    assert!(after < 2.5 * last.errors.stress.expect("a deformed body"), "{after} {rounds:?}");
    // Every added shape states its origin.
    let provenance = &made.body.modes().provenance;
    assert!(provenance.iter().any(|from| from.contains("motion 1")), "{provenance:?}");
}

#[test]
fn a_shock_is_no_reason_for_modes_without_end() {
    let model = beam([8, 2, 1]);
    let force = Vector3::new(1e-4, 2e-4, -1e-4);
    let mut scene = pulled(&model, 7, force, 0.7, Vector3::zeros());
    scene.loads[0].force = VectorHistory::constant(force);
    scene.initial.settled = false;
    scene.requirements.tolerance.errors.stress = 1e-3;
    scene.requirements.tolerance.errors.deflection = 1e-3;
    let tailoring = Tailoring { settings: settings(6), by_band: false, of_motion: false };
    let shocked = tailoring.convert(&model, &scene.clone().into(), &Context::QUIET).expect("a body");
    let lack = shocked.rounds[0].last().expect("an estimate");
    assert!(lack.worst > 1.0 && lack.modes == shocked.made.body.n_modes(), "{:?}", shocked.rounds);
    assert!(lack.modes < model.rows().len() / 2, "{:?}", shocked.rounds);
    // With a static start the load acts before the motion.
    scene.initial.settled = true;
    let calm = tailoring.convert(&model, &scene.clone().into(), &Context::QUIET).expect("a body");
    assert!(calm.rounds[0].last().expect("an estimate").worst < PART_OF_REFERENCE, "{:?}", calm.rounds);
}

#[test]
#[ignore = "slow"]
fn shapes_of_the_motion_hold_the_tolerances_and_are_no_more_than_free_modes() {
    let model = model();
    let mut scene =
        pulled(&model, 7, Vector3::new(1e-4, 2e-4, -1e-4), 0.7, Vector3::new(0.002, 0.003, 0.001));
    scene.requirements.tolerance.errors.stress = 0.05;
    scene.requirements.tolerance.errors.deflection = 0.05;
    let made = |of_motion: bool| {
        let tailoring = Tailoring { settings: settings(12), by_band: false, of_motion };
        convert_for(&model, &tailoring, &scene.clone().into(), &Context::QUIET).expect("a body")
    };
    let ((free, _), (own, selection)) = (made(false), made(true));
    assert!(own.body.n_modes() <= free.body.n_modes(), "{} {}", own.body.n_modes(), free.body.n_modes());
    assert!(selection.holds(), "{selection:?}");
    let errors = true_errors(&model, &own.body, &scene);
    assert!(errors.iter().all(|error| *error < 0.05), "{errors:?}");
    // Identities of every body.
    accept(&own.body).expect("the identities");
    assert_eq!(own.body.source().settings["basis"], "scene");
}

/// A body with the shapes of two motions serves both; a body with the shapes of one does not serve the other.
#[test]
fn shapes_of_several_motions_serve_all_of_them() {
    let model = model();
    let pull = |direction: Vector3<f64>, node: usize| {
        let mut scene = pulled(&model, node, direction, 0.7, Vector3::zeros());
        scene.requirements.tolerance.errors.stress = 0.05;
        scene.requirements.tolerance.errors.deflection = 0.05;
        scene
    };
    let cases = [pull(Vector3::z() * 2e-4, 7), pull(Vector3::x() * 2e-4, 16)];
    let made = |cases: &[Scene]| {
        let cases = LoadCases::new(cases.to_vec()).expect("a case");
        let tailoring = Tailoring { settings: settings(12), by_band: false, of_motion: true };
        convert_for(&model, &tailoring, &cases, &Context::QUIET).expect("a body")
    };
    let holds = |body: &FlexBody| {
        cases.each_ref().map(|case| true_errors(&model, body, case).iter().all(|error| *error < 0.05))
    };
    let (both, selection) = made(&cases);
    assert!(selection.holds(), "{selection:?}");
    assert_eq!(both.body.source().settings["basis"], "scene");
    assert_eq!(holds(&both.body), [true, true]);
    let [first, second] = cases.each_ref().map(|case| made(std::slice::from_ref(case)).0.body);
    assert_eq!((holds(&first), holds(&second)), ([true, false], [false, true]));
}

#[test]
fn a_basis_made_of_a_motion_needs_a_motion_without_numbered_modes() {
    let model = model();
    let mut scene = pulled(&model, 7, Vector3::x() * 1e-4, 0.7, Vector3::zeros());
    scene.initial.settled = false;
    scene.initial.modes = vec![ModeStart { mode: 0, amplitude: 0.01, rate: 0.0 }];
    let tailoring = Tailoring { settings: settings(4), by_band: false, of_motion: true };
    let refused = convert_for(&model, &tailoring, &scene.clone().into(), &Context::QUIET);
    assert!(refused.expect_err("a refusal").has(Code::Usage));
}

#[test]
fn a_static_start_stays_as_it_is() {
    let model = model();
    let body = body(&model, 8);
    let rate = first_rate(&model);
    let force = Vector3::new(1e-4, 2e-4, -1e-4);
    let mut scene = pulled(&model, 7, force, 0.7, Vector3::zeros());
    scene.loads[0].force = VectorHistory::constant(force);
    scene.spin = Some(Spin {
        velocity: VectorHistory::constant(Vector3::new(0.2, 0.3, 1.0).normalize() * (0.2 * rate)),
        axes: Axes::Model,
        start: None,
        hold: true,
    });
    scene.run.scheme = Scheme::Adaptive { tolerance: 1e-12 };
    let energies = |scene: &Scene| -> Vec<f64> {
        let (recording, _) = simulate(&body, scene, &Context::QUIET).expect("a motion");
        recording.balances.iter().map(|balance| balance.elastic).collect()
    };
    let spread = |energies: &[f64]| {
        let largest = energies.iter().copied().fold(0.0, f64::max);
        energies.iter().map(|energy| (energy / largest - 1.0).abs()).fold(0.0, f64::max)
    };
    let calm = energies(&scene);
    assert!(calm[0] > 0.0 && spread(&calm) < 1e-6, "{calm:?}");
    scene.initial.settled = false;
    assert!(spread(&energies(&scene)) > 0.5);
}

/// The damping of the model acts on the truncated modes too: a force at the frequency of a truncated mode
/// builds up less than without damping (by a third, to 0.46 instead of 0.69 of the stress).
#[test]
fn what_is_lacking_is_damped_as_the_model_is() {
    let undamped = model();
    let rates: Vec<f64> = body(&undamped, 8).modes().eigenvalue.iter().map(|lambda| lambda.sqrt()).collect();
    let scene = pulled(&undamped, 16, Vector3::new(1e-5, 4e-5, 2e-5), rates[6] / rates[0], Vector3::zeros());
    // A tenth of the critical damping at that frequency.
    let damping = Some(Damping::Rayleigh { alpha: 0.0, beta: 0.2 / rates[6] });
    let damped =
        FeModel::from_raw(raw_beam().with(|data| data.damping = damping)).expect("a sound model").model;
    for model in [&undamped, &damped] {
        let few = body(model, 6);
        let estimate = estimated(model, &few, &scene).errors.stress.expect("a deformed body");
        let [_, found] = true_errors(model, &few, &scene);
        assert!((estimate / found - 1.0).abs() < 0.02, "{estimate:.3e}, {found:.3e}");
    }
}

/// Returns the errors of the motion of `body` relative to that of `whole`, both of one model.
fn errors_beside(model: &FeModel, whole: &FlexBody, body: &FlexBody, scene: &Scene) -> OutputErrors {
    let [of_whole, own] = [whole, body].map(|body| FramedScene::new(body, scene).expect("a stage"));
    let (motion, _) = trace(&of_whole.body, &of_whole.scene, &Context::QUIET).expect("a motion");
    let mut same_steps = own.scene.clone().into_owned();
    same_steps.run.scheme = motion.scheme;
    let moved = trace_at(&own.body, &same_steps, &motion.time, &Context::QUIET).expect("a motion");
    let [psi, all] = [&own, &of_whole].map(|framed| framed.body.vectors_of(model).expect("of this model"));
    let shared = gram(psi.as_ref(), model.pencil().apply_stiffness(all.as_ref()).as_ref());
    let modes = OtherModes::new(&own.body, &of_whole.body, shared.as_ref()).expect("of one model");
    Measure::new(&of_whole.body, &of_whole.scene, &motion).of_other(&moved, &modes).largest()
}

/// A Craig-Bampton body keeps its rigid root rigid. With all fixed-interface modes it agrees with a model
/// whose root is rigid; with few modes it has the error of truncation. A model whose root deforms differs by
/// far.
#[test]
fn a_rigid_interface_is_rigid_in_the_model_that_the_body_is_compared_with() {
    let model = rooted_beam(ElementKind::Hex8, MassRule::Consistent, [4, 1, 1], Coupling::Rigid);
    let basis = BasisChoice::CraigBampton(CraigBampton);
    let of = |modes: usize| {
        let settings = ConvertSettings { basis: basis.clone(), ..settings(modes) };
        convert(&model, &settings, &Context::QUIET).expect("a body").body
    };
    let (whole, few) = (of(usize::MAX), of(4));
    let force = Vector3::new(2e-4, 5e-4, -3e-4);
    let free = pulled(&model, 16, force, 0.4, Vector3::new(0.02, 0.01, 0.03));
    let scenes =
        [free, driven(&model, Given::Spin, 16, force, 0.3), driven(&model, Given::Swing, 16, force, 0.3)];
    for (at, scene) in scenes.iter().enumerate() {
        let estimate = estimated(&model, &few, scene);
        let found = errors_beside(&model, &whole, &few, scene);
        for (name, estimate, found) in [
            ("deflection", estimate.errors.deflection, found.deflection),
            ("stress", estimate.errors.stress, found.stress),
        ] {
            let (estimate, found) = (estimate.expect(name), found.expect(name));
            assert!((0.8..1.25).contains(&(estimate / found)), "{at}: {name} {estimate:.2e}, {found:.2e}");
        }
        let nothing = estimated(&model, &whole, scene);
        assert!(nothing.errors.stress.is_some_and(|error| error < 1e-4), "{at}: {:?}", nothing.errors);
        let coupling = estimate.coupling.expect("a rigid root");
        assert_eq!(coupling.interfaces, ["root"]);
        let of_coupling = nothing.coupling.expect("a rigid root").errors.stress.expect("a deformed body");
        assert!(
            of_coupling > 10.0 * nothing.errors.stress.expect("a deformed body"),
            "{at}: {of_coupling:.2e}"
        );
    }
    // Free modes deform the root.
    assert!(estimated(&model, &body(&model, 4), &scenes[0]).coupling.is_none());
}
