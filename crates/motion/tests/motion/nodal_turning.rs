//! Nodal equations with rotary mass compared with the carried points, at large rotations.

use super::nodal_equations::held_shapes;
use faer::Mat;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{Carrier, FlexBody, Frame};
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{DofLabel, FeModel, Nodes, RawMatrix, RawModel};
use flexbody_motion::dynamics::{
    AlongFrame, Configuration, EquationsOfMotion, EulerParameters, Evaluation, NodalConfiguration,
    NodalEquations, NodalEvaluation, NodalModes, NodalMotion, NodalPoint, Orientation, Prescribed,
    ReferenceConditions, Terms,
};
use flexbody_motion::integration::{Explicit, Failure, Method, integrate};
use nalgebra::{Complex, DMatrix, DVector, Vector3};
use oracle::attached::{Carriers, masses_on_beams, path, rigid_region};
use oracle::beams::{BeamMass, star};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::equations::State;
use oracle::general::RowKind;
use oracle::mesh::{Mesh, grid};
use oracle::random::Random;
use oracle::turned_energy::{TurnedEnergy, Velocities};
use oracle::turning::{dense, sparse};
use oracle::unreduced::{Unreduced, configuration, holding, times};

/// Displacement step of the differences: errors of sixth order and the rounding of second derivatives balance
/// at some 1e-11.
const STEP: f64 = 1e-2;

/// Limit of the errors of differences; the largest measured error is 2e-10.
const NUMERIC: f64 = 1e-9;

/// Returns a skewed rubber block whose last layer of nodes is rigidly attached to a reference node beside it.
fn block_with_rigid_face() -> (Carriers, RawModel) {
    let rubber = Material { youngs: 4.0, poisson: 0.3, density: 1.0 };
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid([3, 1, 1]), |[x, y, z]| {
        [0.5 * x + 0.06 * y, 0.4 * y * (1.0 - 0.05 * x), 0.3 * z * (1.0 + 0.1 * y)]
    });
    let assembly = mesh.assemble(&rubber, MassRule::Consistent);
    let raw = assembly.raw_model();
    let positions = &raw.nodes.positions;
    let farthest = positions.iter().fold(0.0f64, |m, x| m.max(x[0]));
    let region: Vec<usize> = (0..positions.len()).filter(|&i| positions[i][0] > farthest - 0.2).collect();
    let (full, k) = (dense(&raw.mass.matrix), dense(&raw.stiffness.matrix));
    let mass = DMatrix::from_fn(positions.len(), positions.len(), |i, j| full[(3 * i, 3 * j)]);
    let (carriers, stiffness) = rigid_region(positions, &region, [1.7, 0.3, -0.1], &mass, &k);
    let model = carriers.model("rigid face", &stiffness);
    (carriers, model)
}

/// Returns masses on arms, plus a mass between all rows that is zero in rigid motion: it cannot be
/// represented by points and directors, and rows of rotations carry linear momentum that does not rotate with
/// them.
fn any_mass() -> Unreduced {
    let (carriers, raw) = masses_on_beams(&star(BeamMass::Lumped), 3);
    let (n, positions) = (carriers.rows(), &carriers.positions);
    let first = 3 * positions.len();
    let rigid = DMatrix::from_fn(n, 6, |row, column| {
        let unit = Vector3::ith(column % 3, 1.0);
        match (row < first, column < 3) {
            (true, true) => unit[row % 3],
            (true, false) => unit.cross(&Vector3::from(positions[row / 3]))[row % 3],
            (false, true) => 0.0,
            (false, false) => unit[row % 3],
        }
    });
    let gram = (rigid.transpose() * &rigid).try_inverse().expect("six rigid motions");
    let elastic = DMatrix::identity(n, n) - &rigid * gram * rigid.transpose();
    let mut random = Random(8);
    let mut with_any = |a: &RawMatrix, size: f64| {
        let half = DMatrix::from_fn(n, n, |_, _| random.signed()) * &elastic;
        let sum = dense(&a.matrix) + half.transpose() * &half * size;
        RawMatrix { matrix: sparse(&((&sum + sum.transpose()) * 0.5)), ..a.clone() }
    };
    // Nodes coupled by mass must be coupled by stiffness.
    let (mass, stiffness) = (with_any(&raw.mass, 1e-5), with_any(&raw.stiffness, 1e-5));
    Unreduced::new(RawModel { mass, stiffness, ..raw })
}

/// Returns a state in `shapes` whose largest rotation of a node about an axis is `turn`.
fn turned_state(body: &Unreduced, shapes: &Mat<f64>, seed: u64, turn: f64) -> State {
    let mut state = body.moving_state(seed, 0.1);
    let u = times(shapes, &state.q);
    let rotations = body.rows.iter().zip(u.iter()).filter(|(row, _)| row.kind == RowKind::Rotation);
    let factor = turn / rotations.fold(0.0f64, |m, (_, u)| m.max(u.abs()));
    state.q *= factor;
    state.qd *= factor.min(3.0);
    state
}

fn bodies() -> [(&'static str, Carriers, Unreduced); 2] {
    let (face, solid) = block_with_rigid_face();
    let (arms, beams) = masses_on_beams(&star(BeamMass::Lumped), 3);
    [("rigid face", face, Unreduced::new(solid)), ("arms", arms, Unreduced::new(beams))]
}

/// Returns the difference of two vectors over a scale.
fn apart(a: &[f64], b: &[f64], scale: f64) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt() / scale
}

/// Kinetic energy and momenta equal those of the points carried by the nodes.
#[test]
fn turned_nodes_have_the_energy_and_momenta_of_what_they_carry() {
    for (name, carriers, body) in bodies() {
        let equations =
            NodalEquations::new(&body.model, &body.frame, &ReferenceConditions::MeanAxes).expect("equations");
        for (seed, turn) in [(0, 0.02), (1, 0.4), (2, 1.2)] {
            let state = turned_state(&body, &body.shapes, seed, turn);
            let mut evaluation = NodalEvaluation::new(&equations);
            let y = equations.state(&configuration(&body.shapes, &state)).expect("a state");
            evaluation.set(&y).expect("a state");
            let (u, ud) = (times(&body.shapes, &state.q), times(&body.shapes, &state.qd));
            let zero = DVector::zeros(u.len());
            let motion = path(&state, (&u, &ud, &zero), (Vector3::zeros(), Vector3::zeros()));
            let step = STEP / ud.amax();
            let (energy, linear, angular) = carriers.momenta(&body.frame.origin, &motion, step);
            let (p, l) = evaluation.momenta();
            let turned = |v: Vector3<f64>| state.axes * v;
            let found = evaluation.configuration();
            let size = linear.norm() * body.size / body.total_mass.sqrt();
            let errors = [
                ("T", (evaluation.kinetic_energy() / energy - 1.0).abs()),
                ("P", apart(p.as_slice(), turned(linear).as_slice(), linear.norm())),
                ("L", apart(l.as_slice(), turned(angular).as_slice(), angular.norm() + size)),
                ("omega", apart(found.omega.as_slice(), state.omega.as_slice(), state.omega.norm())),
                ("u'", apart(&found.ud, ud.as_slice(), ud.norm())),
            ];
            for (quantity, error) in errors {
                assert!(error < 1e-9, "{name}, turn {turn}: {quantity} {error:e}");
            }
        }
    }
}

/// The d'Alembert forces on the points, with the accelerations of the equations, balance stiffness, gravity
/// and constraint forces of the conditions; for a driven body the remainder is the driving force.
#[test]
fn turned_nodes_accelerate_as_what_they_carry() {
    for (name, carriers, body) in bodies() {
        let equations =
            NodalEquations::new(&body.model, &body.frame, &ReferenceConditions::MeanAxes).expect("equations");
        for (seed, turn) in [(0, 0.02), (1, 0.4), (2, 1.2)] {
            for driven in ["nothing", "spin", "all"] {
                let state = turned_state(&body, &body.shapes, seed, turn);
                let error = unbalanced(&equations, &carriers, &body, &state, driven);
                for (quantity, error) in error {
                    assert!(error < NUMERIC, "{name}, turn {turn}, driven {driven}: {quantity} {error:e}");
                }
            }
        }
    }
}

/// Returns the imbalance relative to the inertia forces: force, torque, and forces of the rows other than
/// C'lambda.
fn unbalanced(
    equations: &NodalEquations<'_>,
    carriers: &Carriers,
    body: &Unreduced,
    state: &State,
    driven: &str,
) -> [(&'static str, f64); 3] {
    let rate = body.eigenvalues[0].sqrt();
    let given = |linear: Vector3<f64>, angular: Vector3<f64>| match driven {
        "nothing" => Prescribed::NOTHING,
        "spin" => Prescribed { linear: None, angular: Some(AlongFrame(angular)) },
        _ => Prescribed { linear: Some(AlongFrame(linear)), angular: Some(AlongFrame(angular)) },
    };
    let mut evaluation = NodalEvaluation::new(equations);
    let y = equations.state(&configuration(&body.shapes, state)).expect("a state");
    let velocity = state.axes.transpose() * state.velocity;
    evaluation.set_driven(&y, &given(velocity, state.omega)).expect("a state");
    let gravity = Vector3::new(0.3, -1.0, 0.4) * rate * rate;
    evaluation.add_gravity(&gravity);
    let n = equations.n_rows();
    let mut udd = vec![0.0; n];
    let (linear, angular) = match driven {
        "nothing" => evaluation.accelerations(&mut udd),
        _ => {
            let rates = given(Vector3::new(0.2, 0.1, -0.3), Vector3::new(-0.3, 0.2, 0.5) * rate);
            let rates = Prescribed {
                linear: rates.linear.map(|v| AlongFrame(v.0 * rate)),
                angular: rates.angular.map(|w| AlongFrame(w.0 * rate)),
            };
            evaluation.driven_accelerations(&rates, &mut udd)
        }
    }
    .expect("accelerations");

    let (u, ud) = (times(&body.shapes, &state.q), times(&body.shapes, &state.qd));
    let udd = DVector::from_vec(udd);
    let motion = path(state, (&u, &ud, &udd), (linear, angular));
    let origin = &body.frame.origin;
    let step = STEP / ud.amax().max(udd.amax().sqrt());
    let (force, torque, rows) = carriers.inertia_forces(origin, &motion, step);
    let weights = carriers.weights(&(state.axes.transpose() * gravity));
    let places = carriers.places(origin, &u);
    let weight: Vector3<f64> = weights.iter().sum();
    let moment: Vector3<f64> = places.iter().zip(&weights).map(|(y, f)| y.cross(f)).sum();
    let (drive, drive_torque) = evaluation.driving_force();
    let left = rows.clone() + times(&body.stiffness, &u) - carriers.onto_rows(&u, &weights, STEP);

    // C' of mean axes is M R: the imbalance of the rows is their part orthogonal to it.
    let rigid = body.model.rigid_fields((*origin).into(), 1.0);
    let conditions = &body.mass * &rigid;
    let conditions = DMatrix::from_fn(n, 6, |i, j| conditions[(i, j)]);
    let part = conditions.clone().svd(true, true).solve(&left, 1e-12).expect("multipliers");
    let rest = &left - conditions * part;
    let size = force.norm() + weight.norm();
    [
        ("force", (force - weight - drive).norm() / size),
        ("torque", (torque - moment - drive_torque).norm() / (torque.norm() + size * body.size)),
        ("rows", rest.norm() / rows.norm()),
    ]
}

/// Consistent masses of beams, shells and a rigid region: T from blocks of M, and its Lagrange equations.
#[test]
fn general_masses_obey_the_equations_of_their_energy() {
    let fixtures = [("frame_beams", 0.3), ("plane_frame", 0.3), ("mpc_block", 0.3), ("shell_folded", 0.1)];
    let fixtures = fixtures.map(|(name, turn)| (name, Unreduced::fixture(name), turn));
    for (name, body, turn) in fixtures.into_iter().chain([("any mass", any_mass(), 0.1)]) {
        let held = holding(&body.model);
        let shapes = held_shapes(&body, &held);
        let off = Vector3::new(0.3, -0.2, if body.model.dimension() == 2 { 0.0 } else { 0.5 });
        assert_energy(name, &body, &body.shapes, &ReferenceConditions::MeanAxes, Vector3::zeros(), turn);
        assert_energy(name, &body, &body.shapes, &ReferenceConditions::MeanAxes, off * body.size, turn);
        if name != "shell_folded" {
            assert_energy(name, &body, &shapes, &ReferenceConditions::Held(held), Vector3::zeros(), turn);
        }
    }
}

/// Compares energy, momenta and accelerations with the origin of the frame at `off` from the centre of mass.
fn assert_energy(
    name: &str,
    body: &Unreduced,
    shapes: &Mat<f64>,
    conditions: &ReferenceConditions,
    off: Vector3<f64>,
    turn: f64,
) {
    let frame = Frame { origin: body.frame.origin + off, ..body.frame };
    let equations = NodalEquations::new(&body.model, &frame, conditions).expect("equations");
    let positions = frame.to_body(&body.model.nodes().positions);
    let oracle = TurnedEnergy::new(&body.mass, &body.rows, &positions, -off);
    let state = turned_state(body, shapes, 4, turn);
    let (u, ud) = (times(shapes, &state.q), times(shapes, &state.qd));
    let mut evaluation = NodalEvaluation::new(&equations);
    let y = equations.state(&configuration(shapes, &state)).expect("a state");
    evaluation.set(&y).expect("a state");
    let linear = state.axes.transpose() * state.velocity;
    let now = Velocities { linear, omega: state.omega, ud };
    let energy = oracle.kinetic(&u, &now);
    assert!(
        (evaluation.kinetic_energy() / energy - 1.0).abs() < 1e-11,
        "{name}: T {}",
        evaluation.kinetic_energy() / energy - 1.0
    );
    let (p, h) = oracle.momenta(&u, &now);
    let (linear, angular) = evaluation.momenta();
    let (p, h) = (state.axes * p, state.axes * h);
    assert!(apart(linear.as_slice(), p.as_slice(), p.norm()) < 1e-11, "{name}: P");
    assert!(apart(angular.as_slice(), h.as_slice(), h.norm()) < 1e-11, "{name}: L");

    let mut udd = vec![0.0; equations.n_rows()];
    let (linear, angular) = evaluation.accelerations(&mut udd).expect("accelerations");
    let rates = Velocities { linear, omega: angular, ud: DVector::from_vec(udd) };
    let step = STEP * (now.ud.amax().max(now.omega.norm())).recip().min(rates.ud.amax().sqrt().recip());
    let (force, torque, rows) = oracle.inertia_forces(&u, &now, &rates, shapes, step);
    let elastic = times(&body.stiffness, &u);
    let elastic =
        DVector::from_fn(rows.len(), |j, _| (0..u.len()).map(|i| shapes[(i, j)] * elastic[i]).sum());
    let size = body.total_mass.sqrt() * elastic.norm();
    let error = [
        force.norm() / size,
        torque.norm() / (size * (body.size + off.norm() * body.total_mass.sqrt()) / body.total_mass.sqrt()),
        (rows + &elastic).norm() / elastic.norm(),
    ];
    assert!(error.iter().all(|error| *error < 1e-8), "{name}, {conditions:?}, off {off:?}: {error:?}");
}

/// A constant translational velocity changes no acceleration, for any mass.
#[test]
fn flight_changes_no_acceleration() {
    let fixtures = ["frame_beams", "plane_frame", "mpc_block", "shell_folded"]
        .map(|name| (name.to_owned(), Unreduced::fixture(name)));
    let made = bodies().into_iter().map(|(name, _, body)| (name.to_owned(), body));
    let any = [("any mass".to_owned(), any_mass())];
    for (name, body) in fixtures.into_iter().chain(made).chain(any) {
        let plane = body.model.dimension() == 2;
        let off = Vector3::new(0.3, -0.2, if plane { 0.0 } else { 0.5 }) * body.size;
        let frame = Frame { origin: body.frame.origin + off, ..body.frame };
        let equations =
            NodalEquations::new(&body.model, &frame, &ReferenceConditions::MeanAxes).expect("equations");
        let accelerations = |flight: Vector3<f64>| {
            let mut state = turned_state(&body, &body.shapes, 4, 0.1);
            state.velocity += flight;
            let mut evaluation = NodalEvaluation::new(&equations);
            let y = equations.state(&configuration(&body.shapes, &state)).expect("a state");
            evaluation.set(&y).expect("a state");
            let mut udd = vec![0.0; equations.n_rows()];
            let (linear, angular) = evaluation.accelerations(&mut udd).expect("accelerations");
            let velocity = state.axes.transpose() * state.velocity;
            let origin = linear + state.omega.cross(&velocity);
            (DVector::from_vec(udd), angular, origin, evaluation.configuration().ud)
        };
        let speed = turned_state(&body, &body.shapes, 4, 0.1).velocity.norm();
        let (slow, fast) = (
            accelerations(Vector3::zeros()),
            accelerations(Vector3::new(0.6, 0.7, if plane { 0.0 } else { -0.4 }) * (30.0 * speed)),
        );
        let errors = [
            (&slow.0 - &fast.0).norm() / slow.0.norm(),
            (slow.1 - fast.1).norm() / slow.1.norm(),
            (slow.2 - fast.2).norm() / slow.2.norm(),
            apart(&slow.3, &fast.3, DVector::from_column_slice(&slow.3).norm()),
        ];
        // Rounding of thirty times the velocity, multiplied by the frequency ratio of the body in u''.
        assert!(errors.iter().all(|error| *error < 1e-10), "{name}: {errors:?}");
    }
}

/// Energy and momenta of the points are conserved in free motion with large rotations.
#[test]
fn turned_nodes_keep_energy_and_momenta() {
    for (name, carriers, body) in bodies() {
        let equations =
            NodalEquations::new(&body.model, &body.frame, &ReferenceConditions::MeanAxes).expect("equations");
        let start = turned_state(&body, &body.shapes, 1, 0.3);
        let mut state = equations.state(&configuration(&body.shapes, &start)).expect("a state");
        let period = std::f64::consts::TAU / body.eigenvalues[0].sqrt();
        let instants: Vec<f64> = (0..=10).map(|i| 0.1 * period * f64::from(i)).collect();
        let mut method = Method::Explicit(Explicit::new(state.len(), 1e-13, f64::INFINITY));
        let (mut motion, mut other) = (NodalMotion::free(&equations), NodalMotion::free(&equations));
        let mut first: Option<(f64, Vector3<f64>, Vector3<f64>)> = None;
        let mut largest = [0.0f64; 3];
        integrate(&mut method, &mut motion, &mut state, &instants, &[], |time, state| {
            let at = other.evaluate(time, state)?;
            let now = at.configuration();
            let axes = now.attitude.axes();
            let (u, ud) = (DVector::from_vec(now.u), DVector::from_vec(now.ud));
            let zero = DVector::zeros(u.len());
            let seen = State {
                origin: now.origin,
                axes,
                velocity: now.velocity,
                omega: now.omega,
                q: zero.clone(),
                qd: zero.clone(),
            };
            let motion = path(&seen, (&u, &ud, &zero), (Vector3::zeros(), Vector3::zeros()));
            let (kinetic, p, h) = carriers.momenta(&body.frame.origin, &motion, STEP / ud.amax());
            let l = axes * h + now.origin.cross(&(axes * p));
            let now = (kinetic + at.elastic_energy(), axes * p, l);
            let (energy, p, l) = *first.get_or_insert(now);
            let drift =
                [(now.0 / energy - 1.0).abs(), (now.1 - p).norm() / p.norm(), (now.2 - l).norm() / l.norm()];
            largest.iter_mut().zip(drift).for_each(|(worst, drift)| *worst = worst.max(drift));
            Ok::<(), Failure>(())
        })
        .expect("integrates");
        // Momenta drift by the rounding of the oracle differences, the energy by that and the steps.
        assert!(largest.iter().all(|drift| *drift < 1e-11), "{name}: {largest:?}");
    }
}

/// Two discs on a common axis connected by springs. While one disc inclines by phi (complex, of both
/// transverse axes at rest), the other inclines by -phi, and I_d phi'' - i I_p Omega phi' + 2 k phi = 0.
#[test]
fn discs_whirl_at_the_frequencies_of_the_textbook() {
    const SPIN: f64 = 3.0;
    const DIAMETRAL: f64 = 0.5;
    const SPRING: f64 = 2.0;
    const LEAN: f64 = 1e-5;
    for polar in [0.01, 0.3, 1.0] {
        let model = discs(polar, DIAMETRAL, SPRING);
        let equations =
            NodalEquations::new(&model, &Frame::model(), &ReferenceConditions::MeanAxes).expect("equations");
        let start = NodalConfiguration {
            origin: Vector3::zeros(),
            attitude: EulerParameters([1.0, 0.0, 0.0, 0.0]),
            velocity: Vector3::zeros(),
            omega: Vector3::x() * SPIN,
            u: (0..12)
                .map(|row| [0.0, LEAN, -LEAN][usize::from(row == 7) + 2 * usize::from(row == 10)])
                .collect(),
            ud: vec![0.0; 12],
        };
        let mut state = equations.state(&start).expect("a state");
        let instants: Vec<f64> = (0..=20).map(|i| 0.2 * f64::from(i)).collect();
        let mut method = Method::Explicit(Explicit::new(state.len(), 1e-11, f64::INFINITY));
        let (mut motion, mut other) = (NodalMotion::free(&equations), NodalMotion::free(&equations));
        let mut error = 0.0f64;
        // Roots of I_d s^2 - I_p Omega s - 2 k = 0 for phi = exp(i s t). Initially phi = LEAN along y, at
        // rest in the rotating axes: phi' = i Omega phi.
        let root = ((polar * SPIN).powi(2) + 8.0 * SPRING * DIAMETRAL).sqrt();
        let [fast, slow] = [1.0, -1.0].map(|sign| (polar * SPIN + sign * root) / (2.0 * DIAMETRAL));
        let part = (SPIN - slow) / (fast - slow);
        integrate(&mut method, &mut motion, &mut state, &instants, &[], |time, state| {
            let u = other.evaluate(time, state)?.displacements();
            let turning = Complex::new(u[7], u[8]) / LEAN;
            let at = |s: f64| Complex::new(0.0, (s - SPIN) * time).exp();
            error = error.max((turning - (at(fast) * part + at(slow) * (1.0 - part))).norm());
            Ok::<(), Failure>(())
        })
        .expect("integrates");
        // The steps have the tolerance 1e-11 of the energy of the inclination, 1e-10 of that of the spin.
        assert!(error < 1e-7, "I_p {polar}: {error:e}");
    }
}

/// Returns two nodes at one place with a mass and the moments of inertia of a disc about x, and springs
/// between their displacements and rotations.
fn discs(polar: f64, diametral: f64, spring: f64) -> FeModel {
    let mass = DMatrix::from_diagonal(&DVector::from_fn(12, |row, _| match row {
        0..6 => 1.0,
        6 | 9 => polar,
        _ => diametral,
    }));
    let mut k = DMatrix::zeros(12, 12);
    for (a, b, value) in (0..3).map(|i| (i, 3 + i, 5.0)).chain((6..9).map(|i| (i, 3 + i, spring))) {
        for (i, j, sign) in [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)] {
            k[(i, j)] += sign * value;
        }
    }
    let dof = |direction: u8, node: i64| DofLabel { node, direction };
    let dofs = [1, 4].iter().flat_map(|&first| {
        (1..=2).flat_map(move |node| (first..first + 3).map(move |direction| dof(direction, node)))
    });
    let nodes = Nodes { ids: vec![1, 2], positions: vec![[0.0; 3]; 2] };
    let raw = RawModel {
        dofs: Some(dofs.collect()),
        ..RawModel::in_memory("discs", sparse(&k), sparse(&mass), nodes)
    };
    FeModel::from_raw(raw).expect("a body").model
}

/// A body whose frame is carried by a node: accelerations of the nodes and of all modes, and reactions,
/// differ by the square of the deformation. (For consistent beams the remaining mass stays along the axes of
/// the frame, which differ from those of the modes: Coriolis terms of first order.)
#[test]
fn carried_nodes_accelerate_as_carried_modes_to_second_order() {
    let (_, arms) = masses_on_beams(&star(BeamMass::Lumped), 3);
    let (_, face) = block_with_rigid_face();
    let last = *face.nodes.ids.last().expect("nodes");
    for (name, raw, node) in [("arms", arms, 1), ("rigid face", face, last)] {
        let model = FeModel::from_raw(raw).expect("a body").model;
        let modes = ModeSettings { wanted: Wanted::Lowest(10_000), ..ModeSettings::default() };
        let settings = ConvertSettings { modes, ..ConvertSettings::default() };
        let body = convert(&model, &settings, &Context::QUIET).expect("converts").body;
        let carried = body.carried(&Carrier::Node(node)).expect("carried");
        let at = |amplitude| carried_apart(&model, &carried, node, amplitude);
        if name == "rigid face" {
            // The only rotating node is the carrier, so that the equations are equal.
            assert!(at(1.0).iter().all(|error| *error < 1e-11), "{name}: {:?}", at(1.0));
            continue;
        }
        let (coarse, fine) = (at(0.002), at(0.001));
        let ratios = [0, 1, 2].map(|k| coarse[k] / fine[k]);
        assert!(ratios.iter().all(|ratio| (1.9..2.1).contains(ratio)), "{name}: {coarse:?} and {fine:?}");
        assert!(fine.iter().all(|error| *error < 0.01), "{name}: {fine:?}");
    }
}

/// Returns the relative differences of nodal accelerations, carrier force and carrier torque.
fn carried_apart(model: &FeModel, body: &FlexBody, node: i64, amplitude: f64) -> [f64; 3] {
    let conditions = ReferenceConditions::AtRest(NodalPoint::node(model, node as usize - 1));
    let equations = NodalEquations::new(model, body.frame(), &conditions).expect("equations");
    let lifting = NodalModes::new(&equations, body).expect("the modes of this model");
    let reduced = EquationsOfMotion::new(body, Terms::ALL);
    let (nf, rate) = (reduced.n_modes(), body.modes().eigenvalue[0].sqrt());
    let lambda = &body.modes().eigenvalue;
    let mut random = Random(5);
    let size = body.invariants().inertia()[(2, 2)].sqrt();
    let q: Vec<f64> =
        (0..nf).map(|j| 0.1 * amplitude * size * lambda[0] / lambda[j] * random.signed()).collect();
    let qd: Vec<f64> = (0..nf)
        .map(|j| 0.1 * amplitude * size * rate * (lambda[0] / lambda[j]).sqrt() * random.signed())
        .collect();
    let (omega, angular) = (
        Vector3::new(0.3, -0.4, 0.5) * (rate * amplitude.sqrt()),
        Vector3::new(0.2, 0.3, -0.1) * (rate * rate * amplitude),
    );
    let linear = Vector3::new(-0.2, 0.3, 0.4) * (rate * rate * amplitude);
    let start = Configuration {
        origin: Vector3::zeros(),
        attitude: EulerParameters([1.0, 0.0, 0.0, 0.0]),
        velocity: Vector3::zeros(),
        omega,
        q: q.clone(),
        qd: qd.clone(),
    };
    let mut evaluation = NodalEvaluation::new(&equations);
    let y = equations.state(&lifting.lift(&start)).expect("a state");
    let both =
        |linear, angular| Prescribed { linear: Some(AlongFrame(linear)), angular: Some(AlongFrame(angular)) };
    evaluation.set_driven(&y, &both(Vector3::zeros(), omega)).expect("a state");
    let mut udd = vec![0.0; equations.n_rows()];
    evaluation.driven_accelerations(&both(linear, angular), &mut udd).expect("accelerations");
    let (force, torque) = evaluation.driving_force();

    let mut own = Evaluation::new(&reduced);
    let nu: Vec<f64> = [0.0; 3].into_iter().chain(omega.iter().copied()).chain(qd).collect();
    own.set(&q, &nu);
    let mut acceleration: Vec<f64> = linear.iter().chain(&angular).copied().chain(vec![0.0; nf]).collect();
    let mut forces = vec![0.0; nu.len()];
    own.balance(&acceleration, &mut forces);
    let mass = body.invariants().modal_mass();
    let mass = DMatrix::from_fn(nf, nf, |i, j| mass[(i, j)]);
    let qdd = mass.lu().solve(&-DVector::from_column_slice(&forces[6..])).expect("a mass");
    acceleration[6..].copy_from_slice(qdd.as_slice());
    own.balance(&acceleration, &mut forces);
    let lifted = DVector::from_vec(lifting.lift(&Configuration { q: qdd.as_slice().to_vec(), ..start }).u);
    let udd = DVector::from_vec(udd);
    let (f, t) = (Vector3::from_column_slice(&forces[..3]), Vector3::from_column_slice(&forces[3..6]));
    [(&udd - &lifted).norm() / lifted.norm(), (force - f).norm() / f.norm(), (torque - t).norm() / t.norm()]
}
