//! Trajectories of all nodes: conserved quantities, agreement with the reduced equations, and the effect of
//! truncated or misprinted equations.

use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, RawModel};
use flexbody_motion::dynamics::{
    Configuration, EmptySpace, EquationsOfMotion, EulerParameters, Evaluation, Motion, NodalConfiguration,
    NodalEquations, NodalEvaluation, NodalModes, NodalMotion, Place, ReferenceConditions, Surroundings,
    Terms,
};
use flexbody_motion::integration::{Explicit, Failure, Gauss, Method, integrate};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use oracle::elements::ElementKind;
use oracle::flexible::oracle;
use oracle::general::raw_fixture;
use oracle::unreduced::{holding, soft_block, soft_plate};

/// Tolerance of the integration, relative to the energy of the internal motion.
const TOLERANCE: f64 = 1e-12;

fn model_of(raw: RawModel) -> FeModel {
    FeModel::from_raw(raw).expect("a body").model
}

/// Returns the body of a model with this number of modes, in the principal frame.
fn body_of(model: &FeModel, modes: usize) -> FlexBody {
    let modes = ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() };
    convert(model, &ConvertSettings { modes, ..ConvertSettings::default() }, &Context::QUIET)
        .expect("converts")
        .body
}

/// A number of modes beyond that of any model.
const ALL: usize = 10_000;

/// Returns the radius of gyration times sqrt(2), the length scale of the body.
fn radius(body: &FlexBody) -> f64 {
    (body.invariants().inertia().trace() / body.invariants().mass()).sqrt()
}

/// Returns a spin about nearly the middle axis (for a plane body z) with `spin` times the first circular
/// frequency, and a translation; without deformation.
fn spinning(body: &FlexBody, spin: f64) -> Configuration {
    let rate = spin * body.modes().eigenvalue[0].sqrt();
    let plane = body.dimension() == 2;
    let (axis, flight) = if plane {
        (Vector3::z(), Vector3::new(0.2, 0.5, 0.0))
    } else {
        (Vector3::new(0.1, 1.0, 0.05), Vector3::new(0.2, 0.5, -0.4))
    };
    let nf = body.n_modes();
    Configuration {
        origin: Vector3::new(0.3, -0.2, 0.0) * radius(body),
        attitude: if plane {
            EulerParameters([0.8, 0.0, 0.0, 0.6])
        } else {
            EulerParameters([0.5, 0.5, -0.5, 0.5])
        },
        velocity: flight * (rate * radius(body)),
        omega: axis * rate,
        q: vec![0.0; nf],
        qd: vec![0.0; nf],
    }
}

/// Returns the spinning configuration with deformation in every mode.
fn tumbling(body: &FlexBody, spin: f64, deformation: f64) -> Configuration {
    let (lambda, size) = (&body.modes().eigenvalue, radius(body) * body.invariants().mass().sqrt());
    let q = lambda.iter().map(|l| deformation * size * lambda[0] / l).collect();
    Configuration { q, ..spinning(body, spin) }
}

/// Returns times over this number of periods of the first mode.
fn instants(body: &FlexBody, periods: f64) -> Vec<f64> {
    let period = std::f64::consts::TAU / body.modes().eigenvalue[0].sqrt();
    (0..=10).map(|i| periods * period * f64::from(i) / 10.0).collect()
}

/// Positions of all nodes at each time, world axes.
type Path = Vec<Vec<Vector3<f64>>>;

fn nodal_path(equations: &NodalEquations<'_>, start: &NodalConfiguration, instants: &[f64]) -> Path {
    let mut state = equations.state(start).expect("a state");
    let mut method = Method::Explicit(Explicit::new(state.len(), TOLERANCE, f64::INFINITY));
    let (mut motion, mut other) = (NodalMotion::free(equations), NodalMotion::free(equations));
    let mut path = Vec::new();
    let nodes = equations.model().nodes().len();
    integrate(&mut method, &mut motion, &mut state, instants, &[], |time, state| {
        let at = other.evaluate(time, state)?;
        path.push((0..nodes).map(|i| at.place(i)).collect());
        Ok::<(), Failure>(())
    })
    .expect("integrates");
    path
}

fn reduced_path(
    model: &FeModel,
    body: &FlexBody,
    surroundings: &dyn Surroundings,
    start: &Configuration,
    instants: &[f64],
) -> Path {
    let equations = EquationsOfMotion::new(body, Terms::ALL);
    let (mut motion, mut state) = Motion::new(&equations, surroundings, start);
    let (mut other, _) = Motion::new(&equations, surroundings, start);
    let mut method = Method::Explicit(Explicit::new(state.len(), TOLERANCE, f64::INFINITY));
    let mut path = Vec::new();
    let (shape, positions) = (&body.modes().shape, &body.nodes().positions);
    assert_eq!(positions.len(), model.nodes().len());
    integrate(&mut method, &mut motion, &mut state, instants, &[], |time, state| {
        let now = other.evaluate(time, state)?;
        let (place, q) = (now.place(), now.evaluation().modal_coordinates());
        let moved = |i: usize| {
            Vector3::from_fn(|k, _| (0..q.len()).map(|j| shape[(3 * i + k, j)] * q[j]).sum::<f64>())
        };
        let node = |i: usize| place.origin + place.axes * (Vector3::from(positions[i]) + moved(i));
        path.push((0..positions.len()).map(node).collect());
        Ok::<(), Failure>(())
    })
    .expect("integrates");
    path
}

/// Returns the largest distance of a node between two paths.
fn distance(a: &Path, b: &Path) -> f64 {
    let pairs = a.iter().zip(b).flat_map(|(a, b)| a.iter().zip(b));
    pairs.fold(0.0, |m, (a, b)| m.max((a - b).norm()))
}

/// Returns the largest change of a distance between nodes, a measure of deformation.
fn stretch(path: &Path) -> f64 {
    let first = &path[0];
    let pairs = path.iter().flat_map(|now| (1..now.len()).map(move |i| (now, i)));
    pairs.fold(0.0, |m, (now, i)| m.max(((now[i] - now[0]).norm() - (first[i] - first[0]).norm()).abs()))
}

/// With all modes the reduced equations equal the nodal ones for solids, a body with massless rotations and a
/// plane body.
#[test]
#[ignore = "slow"]
fn all_modes_move_as_the_nodes_do() {
    let raws = [
        ("hex8", soft_block(ElementKind::Hex8, [3, 2, 1]), 3.0),
        ("tet10", soft_block(ElementKind::Tet10, [1, 1, 1]), 3.0),
        ("plate", soft_plate(), 3.0),
        ("frame_lumped", raw_fixture("frame_lumped"), 1.0),
    ];
    for (name, raw, periods) in raws {
        let model = model_of(raw);
        let body = body_of(&model, ALL);
        let equations =
            NodalEquations::new(&model, body.frame(), &ReferenceConditions::MeanAxes).expect("equations");
        let lifting = NodalModes::new(&equations, &body).expect("the modes of this model");
        let (start, instants) = (tumbling(&body, 0.3, 0.05), instants(&body, periods));
        let nodal = nodal_path(&equations, &lifting.lift(&start), &instants);
        let reduced = reduced_path(&model, &body, &EmptySpace, &start, &instants);
        let (deformation, error) = (stretch(&nodal), distance(&nodal, &reduced));
        assert!(deformation > 0.02 * radius(&body), "{name}: {deformation:e}");
        assert!(error < 1e-8 * deformation, "{name}: {:e}", error / deformation);
    }
}

/// If rotations carry mass, the reduced equations with all modes have the kinetic energy to second order of
/// the displacements: paths differ by the square of the deformation.
#[test]
#[ignore = "slow"]
fn all_modes_move_as_turned_nodes_do_to_second_order() {
    for name in ["plane_frame", "mpc_block", "frame_beams"] {
        let model = model_of(raw_fixture(name));
        let body = body_of(&model, ALL);
        let equations =
            NodalEquations::new(&model, body.frame(), &ReferenceConditions::MeanAxes).expect("equations");
        let lifting = NodalModes::new(&equations, &body).expect("the modes of this model");
        let instants = instants(&body, 0.5);
        let [coarse, fine] = [1.0, 0.5].map(|amplitude: f64| {
            // The deformation by spin is proportional to its square.
            let start = tumbling(&body, 0.2 * amplitude.sqrt(), 0.02 * amplitude);
            let nodal = nodal_path(&equations, &lifting.lift(&start), &instants);
            let reduced = reduced_path(&model, &body, &EmptySpace, &start, &instants);
            (distance(&nodal, &reduced), stretch(&nodal))
        });
        assert!(fine.1 > 0.005 * radius(&body), "{name}: {fine:?}");
        let ratio = coarse.0 / fine.0;
        assert!((3.5..4.5).contains(&ratio), "{name}: {coarse:?} and {fine:?}");
        assert!(fine.0 < 0.1 * fine.1, "{name}: {fine:?}");
    }
}

/// Returns the distance between the motions with mean axes and with a frame fixed to nodes, and the
/// deformation, for spins that are halved.
fn between_frames(model: &FeModel, body: &FlexBody, conditions: &ReferenceConditions) -> Vec<(f64, f64)> {
    let path = |conditions: &ReferenceConditions, spin: f64| {
        let equations = NodalEquations::new(model, body.frame(), conditions).expect("equations");
        let lifting = NodalModes::new(&equations, body).expect("the modes of this model");
        nodal_path(&equations, &lifting.lift(&spinning(body, spin)), &instants(body, 2.0))
    };
    let spins = [0.2, 0.1, 0.05];
    let of_spin = |spin| {
        let nodal = path(&ReferenceConditions::MeanAxes, spin);
        (distance(&nodal, &path(conditions, spin)), stretch(&nodal))
    };
    spins.map(of_spin).to_vec()
}

/// The frame of a solid, or of a solid with a rigid region, affects only K u, which is linear in the
/// displacements from it: motions differ by the square of the deformation.
#[test]
#[ignore = "slow"]
fn mean_axes_and_held_nodes_are_the_same_motion_to_second_order() {
    let model = model_of(soft_block(ElementKind::Hex8, [3, 2, 1]));
    let body = body_of(&model, 8);
    let solid = between_frames(&model, &body, &ReferenceConditions::Held(holding(&model)));
    let model = model_of(raw_fixture("mpc_block"));
    let body = body_of(&model, 8);
    let region = between_frames(&model, &body, &ReferenceConditions::Held(holding(&model)));
    for (what, found) in [("solid", solid), ("rigid region", region)] {
        for pair in found.windows(2) {
            let [distance, deformation] = [pair[0].0 / pair[1].0, pair[0].1 / pair[1].1];
            // The deformation is proportional to the square of the spin.
            assert!(deformation > 3.5 && deformation < 4.5, "{what}: deformation {deformation}");
            assert!((14.0..20.0).contains(&distance), "{what}: distance {distance}");
        }
    }
}

/// Returns linear momentum, and angular momentum about the centre of mass, of a solid: sums of m_ij v_j and
/// x_i x m_ij v_j over positions and velocities of its nodes in the world.
fn momenta_of_nodes(model: &FeModel, at: &NodalEvaluation<'_>) -> (Vector3<f64>, Vector3<f64>) {
    let mass = model.scalar_mass().expect("a solid");
    let weighted = |of: &dyn Fn(usize) -> Vector3<f64>, i: usize| -> Vector3<f64> {
        let (columns, values) = mass.row(i);
        columns.iter().zip(values).map(|(&j, m)| of(j as usize) * *m).sum()
    };
    let whole: f64 = (0..mass.n()).flat_map(|i| mass.row(i).1).sum();
    let centre = (0..mass.n()).map(|i| weighted(&|j| at.place(j), i)).sum::<Vector3<f64>>() / whole;
    let (mut linear, mut angular) = (Vector3::zeros(), Vector3::zeros());
    for i in 0..mass.n() {
        let own = weighted(&|j| at.node_velocity(j), i);
        linear += own;
        angular += (at.place(i) - centre).cross(&own);
    }
    (linear, angular)
}

/// Returns the largest relative drifts of energy, linear and angular momentum in the first and in the second
/// half of a motion.
fn drifts(
    equations: &NodalEquations<'_>,
    start: &NodalConfiguration,
    mut method: Method,
    instants: &[f64],
) -> [[f64; 3]; 2] {
    let model = equations.model();
    let mut state = equations.state(start).expect("a state");
    let (mut motion, mut other) = (NodalMotion::free(equations), NodalMotion::free(equations));
    let (mut first, mut found) = (None, [[0.0f64; 3]; 2]);
    let middle = 0.5 * instants[instants.len() - 1];
    integrate(&mut method, &mut motion, &mut state, instants, &[], |time, state| {
        let at = other.evaluate(time, state)?;
        let (linear, angular) = momenta_of_nodes(model, at);
        let now = (at.kinetic_energy() + at.elastic_energy(), linear, angular);
        let (energy, p, l) = *first.get_or_insert(now);
        let drift =
            [(now.0 / energy - 1.0).abs(), (now.1 - p).norm() / p.norm(), (now.2 - l).norm() / l.norm()];
        let half = &mut found[usize::from(time > middle)];
        half.iter_mut().zip(drift).for_each(|(worst, drift)| *worst = worst.max(drift));
        Ok::<(), Failure>(())
    })
    .expect("integrates");
    found
}

/// Two hundred periods of the first mode.
#[test]
#[ignore = "slow"]
fn long_motion_keeps_energy_and_momenta() {
    let model = model_of(soft_block(ElementKind::Hex8, [3, 2, 1]));
    let body = body_of(&model, ALL);
    let instants: Vec<f64> = (0..=200).map(|i| instants(&body, 60.0)[10] * f64::from(i) / 200.0).collect();
    for conditions in [ReferenceConditions::MeanAxes, ReferenceConditions::Held(holding(&model))] {
        let equations = NodalEquations::new(&model, body.frame(), &conditions).expect("equations");
        let start = spinning_nodes(&equations, &spinning(&body, 0.3));
        let method = Method::Explicit(Explicit::new(equations.dimension(), TOLERANCE, f64::INFINITY));
        for [energy, linear, angular] in drifts(&equations, &start, method, &instants) {
            assert!(energy < 1e-9, "energy {energy:e}");
            // Momenta are conserved to rounding for any error of the method.
            assert!(linear < 1e-12 && angular < 1e-12, "momenta {linear:e} {angular:e}");
        }
    }
    let equations =
        NodalEquations::new(&model, body.frame(), &ReferenceConditions::MeanAxes).expect("equations");
    let fastest = body.modes().eigenvalue[body.n_modes() - 1].sqrt();
    let method = Method::Gauss { method: Gauss::new(equations.dimension(), 4), step: 0.4 / fastest };
    let start = spinning_nodes(&equations, &spinning(&body, 0.3));
    let [before, after] = drifts(&equations, &start, method, &instants[..67]);
    assert!(
        before[0] > 1e-11 && after[0] < 1.5 * before[0] && after[0] < 1e-5,
        "energy {before:?} {after:?}"
    );
    assert!(after[1] < 1e-12 && after[2] < 1e-12, "momenta {after:?}");
}

/// Returns a motion of the frame without deformation.
fn spinning_nodes(equations: &NodalEquations<'_>, start: &Configuration) -> NodalConfiguration {
    let Configuration { origin, attitude, velocity, omega, .. } = start;
    let zero = vec![0.0; equations.n_rows()];
    NodalConfiguration {
        origin: *origin,
        attitude: *attitude,
        velocity: *velocity,
        omega: *omega,
        u: zero.clone(),
        ud: zero,
    }
}

/// Misprint [WP19] (16): the skew part of Q'W2 Qd counted twice.
struct Misprint {
    w2: DMatrix<f64>,
}

impl Surroundings for Misprint {
    fn add_forces(&self, _: f64, _: &Place, evaluation: &Evaluation<'_>, forces: &mut [f64]) {
        let kron = |q: &[f64]| DMatrix::<f64>::identity(3, 3).kronecker(&DVector::from_column_slice(q));
        let mixed =
            kron(evaluation.modal_coordinates()).transpose() * &self.w2 * kron(evaluation.modal_velocity());
        let mixed = Matrix3::from_fn(|k, l| mixed[(k, l)]);
        let torque = (mixed.transpose() - mixed) * evaluation.rigid_velocity().1;
        (0..3).for_each(|k| forces[3 + k] += torque[k]);
    }
}

/// The truncation error falls with the number of modes; the error of a misprint remains with all modes.
#[test]
#[ignore = "slow"]
fn truncation_and_misprints_show_against_the_nodes() {
    let model = model_of(soft_block(ElementKind::Hex8, [3, 2, 1]));
    let whole = body_of(&model, ALL);
    let equations =
        NodalEquations::new(&model, whole.frame(), &ReferenceConditions::MeanAxes).expect("equations");
    let lifting = NodalModes::new(&equations, &whole).expect("the modes of this model");
    let instants = instants(&whole, 6.0);
    let spun = nodal_path(&equations, &spinning_nodes(&equations, &spinning(&whole, 0.3)), &instants);
    let errors = [2, 6, 15, 30, ALL].map(|modes| {
        let body = body_of(&model, modes);
        distance(&spun, &reduced_path(&model, &body, &EmptySpace, &spinning(&body, 0.3), &instants))
            / stretch(&spun)
    });
    assert!(errors.is_sorted_by(|a, b| a > b), "{errors:?}");
    assert!(errors[0] > 0.1 && errors[4] < 1e-8, "{errors:?}");

    let start = tumbling(&whole, 0.3, 0.05);
    let bent = nodal_path(&equations, &lifting.lift(&start), &instants);
    let misprint = Misprint { w2: oracle(&whole).reduced.w2 };
    let printed =
        distance(&bent, &reduced_path(&model, &whole, &misprint, &start, &instants)) / stretch(&bent);
    let right =
        distance(&bent, &reduced_path(&model, &whole, &EmptySpace, &start, &instants)) / stretch(&bent);
    assert!(printed > 1e-3 && right < 1e-8, "printed {printed:e}, right {right:e}");
}

/// The motion of a bracket of 20-node bricks with 2052 rows agrees with that of many modes.
#[test]
#[ignore = "slow"]
fn a_real_model_runs() {
    let model = model_of(raw_fixture("bracket_hex20"));
    let body = body_of(&model, 60);
    let equations =
        NodalEquations::new(&model, body.frame(), &ReferenceConditions::MeanAxes).expect("equations");
    let start = spinning(&body, 0.05);
    let instants = instants(&body, 0.25);
    let nodal = nodal_path(&equations, &spinning_nodes(&equations, &start), &instants);
    let reduced = reduced_path(&model, &body, &EmptySpace, &start, &instants);
    let error = distance(&nodal, &reduced) / stretch(&nodal);
    assert!(error > 1e-8 && error < 0.02, "{error:e}");
}
