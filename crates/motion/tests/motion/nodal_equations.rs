//! Nodal equations of the library compared with dense oracles, with the reduced equations, and with
//! conservation laws.

use faer::Mat;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{FlexBody, Frame};
use flexbody_eigen::Wanted;
use flexbody_input::{ModelFiles, read_model};
use flexbody_linalg::context::Context;
use flexbody_linalg::{CscMatrix, sum_terms};
use flexbody_model::{Damping, DofLabel, FeModel, RawModel};
use flexbody_motion::dynamics::{
    BodyPoint, Configuration, EquationsOfMotion, EulerParameters, Evaluation, NodalEquations, NodalError,
    NodalEvaluation, NodalModes, Orientation, ReferenceConditions, Terms,
};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use oracle::elements::ElementKind;
use oracle::equations::State;
use oracle::general::{FIXTURES, dense, raw_fixture, to_faer};
use oracle::random::Random;
use oracle::unreduced::{Unreduced, configuration, holding, soft_block, soft_plate, times};

/// Relative rounding limit; conditions at nodes and null vectors of M amplify rounding.
const LIMIT: f64 = 1e-11;

/// Returns solids, plane bodies, general masses without rotary mass, and singular masses.
fn bodies() -> Vec<(String, Unreduced)> {
    let made = [
        ("hex8", soft_block(ElementKind::Hex8, [3, 2, 1])),
        ("tet10", soft_block(ElementKind::Tet10, [1, 1, 1])),
        ("plate", soft_plate()),
    ];
    let made = made.into_iter().map(|(name, raw)| (name.to_owned(), Unreduced::new(raw)));
    let fixtures = FIXTURES.map(|name| (name.to_owned(), Unreduced::fixture(name)));
    made.chain(fixtures.into_iter().filter(|(_, body)| body.model.director_mass().is_none())).collect()
}

/// Returns the shapes without the motions that the conditions forbid: Psi - R (C R)^-1 C Psi.
pub(super) fn held_shapes(body: &Unreduced, held: &[DofLabel]) -> Mat<f64> {
    let rigid = dense(&body.model.rigid_fields(body.frame.origin.into(), 1.0));
    let shapes = dense(&body.shapes);
    let rows: Vec<usize> = held
        .iter()
        .map(|dof| (0..body.rows.len()).find(|&i| body.model.label(i) == *dof).expect("a row"))
        .collect();
    let part = rigid.select_rows(&rows).try_inverse().expect("independent") * shapes.select_rows(&rows);
    let left = shapes - rigid * part;
    to_faer(&left)
}

/// Compares accelerations, momenta and energies with the oracle, whose modes span all displacements that the
/// conditions allow.
fn assert_oracle(
    what: &str,
    body: &Unreduced,
    conditions: &ReferenceConditions,
    shapes: &Mat<f64>,
    limit: f64,
) {
    let equations = NodalEquations::new(&body.model, &body.frame, conditions).expect("equations");
    let oracle = body.oracle(shapes);
    for seed in 0..3 {
        let state = body.moving_state(seed, 0.1);
        let mut evaluation = NodalEvaluation::new(&equations);
        evaluation.set(&equations.state(&configuration(shapes, &state)).expect("a state")).expect("a state");
        let mut errors = Vec::new();
        let mut compare = |name, found: &[f64], expected: &[f64], scale: f64| {
            let difference: f64 = found.iter().zip(expected).map(|(a, b)| (a - b).powi(2)).sum();
            errors.push((name, difference.sqrt() / scale));
        };

        let found = evaluation.configuration();
        let (rate, length) = (body.eigenvalues[0].sqrt(), body.size / body.total_mass.sqrt());
        compare("R'", found.velocity.as_slice(), state.velocity.as_slice(), rate * length);
        compare("omega", found.omega.as_slice(), state.omega.as_slice(), rate);
        let weighted = |x: &DVector<f64>| x.dot(&times(&body.mass, x)).abs().sqrt();
        let rates = times(shapes, &state.qd);
        let error = weighted(&(DVector::from_column_slice(evaluation.displacement_rates()) - &rates));
        compare("u'", &[error], &[0.0], weighted(&rates));

        let (p, l) = evaluation.momenta();
        let linear = oracle.linear_momentum(&state);
        compare("P", p.as_slice(), linear.as_slice(), linear.norm());
        let angular = oracle.angular_momentum(&state) - state.origin.cross(&linear);
        compare("L", l.as_slice(), angular.as_slice(), angular.norm() + length * linear.norm());
        let energy = evaluation.kinetic_energy() + evaluation.elastic_energy();
        compare("energy", &[energy], &[oracle.energy(&state)], energy);

        let expected = oracle.accelerations(&state);
        let mut udd = vec![0.0; equations.n_rows()];
        let (linear, angular) = evaluation.accelerations(&mut udd).expect("accelerations");
        let velocity = state.axes.transpose() * state.velocity;
        let origin = state.axes * (linear + state.omega.cross(&velocity));
        let spin = state.omega.norm_squared();
        // A frame fixed to nodes follows the fastest modes, which sets the scale.
        let size = |from: usize| expected.rows(from, 3).norm();
        compare("R''", origin.as_slice(), &expected.as_slice()[..3], spin * length + size(0));
        compare("omega'", angular.as_slice(), &expected.as_slice()[3..6], spin + size(3));
        let expected = times(shapes, &expected.rows(6, shapes.ncols()).into_owned());
        let error = weighted(&(DVector::from_vec(udd) - &expected));
        compare("u''", &[error], &[0.0], weighted(&expected));
        for (quantity, error) in errors {
            assert!(error < limit, "{what}, seed {seed}: {quantity} {error:e}");
        }
    }
}

#[test]
fn accelerations_are_those_of_the_dense_oracle() {
    for (name, body) in bodies() {
        assert_oracle(&name, &body, &ReferenceConditions::MeanAxes, &body.shapes, 3e-12);
        let held = holding(&body.model);
        let shapes = held_shapes(&body, &held);
        let conditions = ReferenceConditions::Held(held);
        assert_oracle(&format!("{name}, held"), &body, &conditions, &shapes, LIMIT);
    }
}

/// Reduced integration: two thirds of the rank of M are missing.
#[test]
fn masses_of_low_rank_are_condensed() {
    let body = Unreduced::fixture("bar_c3d8r");
    assert_eq!(body.shapes.ncols(), 396 - 216 - 6);
    assert_oracle("bar_c3d8r", &body, &ReferenceConditions::MeanAxes, &body.shapes, 1e-10);
}

/// The axes of the frame only define components.
#[test]
fn the_axes_of_the_frame_do_not_matter() {
    for name in ["mpc_block", "plane_frame"] {
        let body = Unreduced::fixture(name);
        let state = body.moving_state(5, 0.1);
        let turn = if body.model.dimension() == 2 {
            nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), 0.8).into_inner()
        } else {
            Random(4).rotation()
        };
        let run = |axes: Matrix3<f64>| {
            let frame = Frame { axes, ..body.frame };
            let equations =
                NodalEquations::new(&body.model, &frame, &ReferenceConditions::MeanAxes).expect("equations");
            let turned =
                State { axes: state.axes * axes, omega: axes.transpose() * state.omega, ..state.clone() };
            let y = equations.state(&configuration(&body.shapes, &turned)).expect("a state");
            let mut evaluation = NodalEvaluation::new(&equations);
            evaluation.set(&y).expect("a state");
            let gravity = Vector3::new(0.3, -1.0, 0.0) * body.eigenvalues[0] * body.size;
            evaluation.add_gravity(&gravity);
            evaluation.add_force(2, &(gravity * body.total_mass));
            let mut rates = vec![0.0; y.len()];
            evaluation.rates(&mut rates).expect("rates");
            (y, rates, evaluation.place(3), evaluation.node_velocity(3))
        };
        let ((y, rates, place, velocity), (other, turned, moved, speed)) =
            (run(Matrix3::identity()), run(turn));
        assert!((place - moved).norm() < 1e-13 && (velocity - speed).norm() < 1e-12 * velocity.norm());
        for (a, b) in [(&y, &other), (&rates, &turned)] {
            for part in [0..6, 10..13, 13..16, 16..a.len()] {
                let of = |y: &[f64]| DVector::from_column_slice(&y[part.clone()]);
                assert!((of(a) - of(b)).norm() < 1e-11 * of(a).norm(), "{name}: {part:?}");
            }
        }
    }
}

/// Returns a checked model and its body in the principal frame.
fn converted(raw: RawModel, modes: usize) -> (FeModel, FlexBody) {
    let model = FeModel::from_raw(raw).expect("a body").model;
    let modes = ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() };
    let body = convert(&model, &ConvertSettings { modes, ..ConvertSettings::default() }, &Context::QUIET)
        .expect("converts")
        .body;
    (model, body)
}

/// Returns the body with the modes Psi T.
fn in_other_modes(body: FlexBody, t: &Mat<f64>) -> FlexBody {
    let mut parts = body.into_parts();
    let times = |a: &Mat<f64>| a * t;
    parts.invariants = parts.invariants.with_basis(t.as_ref());
    parts.modes.shape = times(&parts.modes.shape);
    parts.modes.rotation = parts.modes.rotation.as_ref().map(times);
    if let Some(internal) = &mut parts.modes.internal {
        internal.shape = &internal.shape * t;
    }
    parts.lumped.clear();
    FlexBody::new(parts).expect("valid parts")
}

/// Returns a modal state with spin and modes of one time scale.
fn modal_state(seed: u64, body: &FlexBody) -> Configuration {
    let mut random = Random(seed);
    let (nf, plane) = (body.n_modes(), body.dimension() == 2);
    let (lambda, mass) = (&body.modes().eigenvalue, body.invariants().mass());
    let (rate, size) = (lambda[0].sqrt(), body.invariants().inertia()[(2, 2)].sqrt());
    let (mut velocity, mut omega) = (
        Vector3::from(random.vector::<3>()) * (rate * size / mass.sqrt()),
        Vector3::from(random.vector::<3>()) * (0.5 * rate),
    );
    let mut attitude = EulerParameters([0.5, -0.5, 0.1, 0.7]);
    if plane {
        (velocity.z, omega.x, omega.y) = (0.0, 0.0, 0.0);
        attitude = EulerParameters([0.6, 0.0, 0.0, -0.8]);
    }
    let length = attitude.0.iter().map(|p| p * p).sum::<f64>().sqrt();
    attitude.0.iter_mut().for_each(|p| *p /= length);
    Configuration {
        origin: Vector3::zeros(),
        attitude,
        velocity,
        omega,
        q: (0..nf).map(|j| 0.1 * size * lambda[0] / lambda[j] * random.signed()).collect(),
        qd: (0..nf).map(|j| 0.1 * size * rate * (lambda[0] / lambda[j]).sqrt() * random.signed()).collect(),
    }
}

/// Returns the velocities nu of a state.
fn velocities(equations: &EquationsOfMotion, state: &Configuration) -> Vec<f64> {
    let velocity = state.attitude.axes().tr_mul(&state.velocity);
    let rigid: Vec<f64> = match equations.n_rigid() {
        3 => vec![velocity.x, velocity.y, state.omega.z],
        _ => velocity.iter().chain(&state.omega).copied().collect(),
    };
    rigid.into_iter().chain(state.qd.iter().copied()).collect()
}

/// Asserts [ZG19] eq. 67 to 72: with H = blkdiag(I, I, Psi), H'(M of all nodes) H and the velocity forces
/// equal those of the reduced equations, for any modes.
fn assert_projection(name: &str, raw: RawModel) {
    let (model, free) = converted(raw, 10);
    let state = modal_state(3, &free);
    let mut random = Random(11);
    let mix = DMatrix::from_fn(10, 10, |i, j| f64::from(u8::from(i == j)) + 0.3 * random.signed());
    let back = mix.clone().try_inverse().expect("a basis");
    let unmixed = |q: &[f64]| (&back * DVector::from_column_slice(q)).as_slice().to_vec();
    let other = Configuration { q: unmixed(&state.q), qd: unmixed(&state.qd), ..state.clone() };
    let mixed = in_other_modes(free.clone(), &to_faer(&mix));
    for (modes, body, state) in [("free", free, state), ("any", mixed, other)] {
        let nodal =
            NodalEquations::new(&model, body.frame(), &ReferenceConditions::MeanAxes).expect("equations");
        let lifting = NodalModes::new(&nodal, &body).expect("the modes of this model");
        let reduced = EquationsOfMotion::new(&body, Terms::ALL);
        let (nf, n, r) = (reduced.n_modes(), reduced.n_velocities(), reduced.n_rigid());
        let lifted = lifting.lift(&state);
        let (q, back) = (DVector::from_vec(state.q.clone()), DVector::from_vec(lifting.project(&lifted).q));
        assert!((back - &q).amax() < 1e-12 * q.amax(), "{name}, {modes} modes: lifted and projected");
        let mut evaluation = NodalEvaluation::new(&nodal);
        evaluation.set(&nodal.state(&lifted).expect("a state")).expect("a state");
        let mut own = Evaluation::new(&reduced);
        own.set(&state.q, &velocities(&reduced, &state));

        // Scales of the accelerations and forces of translation, rotation and modes.
        let (rate, size) = (body.modes().eigenvalue[0], body.invariants().inertia()[(2, 2)].sqrt());
        let root = body.invariants().mass().sqrt();
        let translations = r.div_ceil(2);
        let group = |i: usize| {
            if i < translations {
                0
            } else if i < r {
                1
            } else {
                2
            }
        };
        let acceleration = |i: usize| [rate * size / root, rate, rate * size][group(i)];
        let force = [rate * size * root, rate * size * size, rate * size];
        // Bound of the rounding of products with K: |Psi|'|K| |u|.
        let u = Mat::from_fn(lifted.u.len(), 1, |i, _| lifted.u[i]);
        let mut terms = Mat::zeros(u.nrows(), 1);
        sum_terms(model.stiffness(), u.as_ref(), terms.as_mut(), f64::abs);
        let shapes = lifting.vectors();
        let rounding = |i: usize| match i.checked_sub(r) {
            Some(j) => {
                (0..u.nrows()).map(|row| shapes[(row, j)].abs() * terms[(row, 0)]).sum::<f64>() * f64::EPSILON
            }
            None => 0.0,
        };
        // Zero accelerations give the velocity forces, unit accelerations the columns of the mass matrix.
        for column in 0..=n {
            let a: Vec<f64> = (0..n).map(|i| if i + 1 == column { acceleration(i) } else { 0.0 }).collect();
            let (rigid, modal) = a.split_at(r);
            let (linear, angular) = match rigid {
                [x, y, spin] => (Vector3::new(*x, *y, 0.0), Vector3::new(0.0, 0.0, *spin)),
                rigid => (Vector3::from_column_slice(&rigid[..3]), Vector3::from_column_slice(&rigid[3..])),
            };
            let of_modes = Configuration { q: modal.to_vec(), ..state.clone() };
            let mut forces = vec![0.0; nodal.n_rows()];
            let (f, t) = evaluation.balance(&linear, &angular, &lifting.lift(&of_modes).u, &mut forces);
            let rigid: Vec<f64> = match r {
                3 => vec![f.x, f.y, t.z],
                _ => f.iter().chain(&t).copied().collect(),
            };
            let modal = lifting.vectors().transpose() * Mat::from_fn(forces.len(), 1, |i, _| forces[i]);
            let found: Vec<f64> = rigid.into_iter().chain((0..nf).map(|j| modal[(j, 0)])).collect();
            let mut expected = vec![0.0; n];
            own.balance(&a, &mut expected);
            for (i, (found, expected)) in found.iter().zip(&expected).enumerate() {
                let error = ((found - expected).abs() - rounding(i)) / force[group(i)];
                assert!(error < 1e-11, "{name}, {modes} modes, acceleration {column}: force {i} {error:e}");
            }
        }
    }
}

#[test]
fn projected_on_modes_they_are_the_reduced_equations() {
    for name in ["cube_hex8", "bracket_hex20", "connecting_rod", "bar_c3d8r", "frame_lumped", "hex8_bubbles"]
    {
        assert_projection(name, raw_fixture(name));
    }
    assert_projection("plate", soft_plate());
    assert_projection("tet10", soft_block(ElementKind::Tet10, [2, 1, 1]));
}

/// Larger models that are stored beside the project on some machines.
#[test]
#[ignore = "slow"]
fn real_models_have_the_reduced_equations() {
    let root = oracle::shared();
    for name in
        ["a_beam_c3d20", "e_bracket_near", "f_cube_c3d8", "g_two_1e6", "i_plane_stress", "k_c3d8r_singularM"]
    {
        let folder = root.join("models").join(name);
        if !folder.is_dir() {
            continue;
        }
        let path = |file: &str| folder.join(file);
        let (k, m) = (path("K.mtx.gz"), path("M.mtx.gz"));
        let files = ModelFiles::from_arguments(k, m, path("nodes.csv"), Some(path("dofs.csv")), None)
            .expect("no units");
        let dimension = if name == "i_plane_stress" { 2 } else { 3 };
        // Some models are in mm, t, s without stating it; the numbers are not affected.
        let files = ModelFiles { dimension, allow_implausible: true.into(), ..files };
        assert_projection(name, read_model(&files).expect("readable"));
    }
}

/// Differences of accelerations and their sizes: of the origin (scaled by those of the nodes), of the
/// rotation, and of the nodes.
struct Apart {
    errors: [f64; 3],
    sizes: [f64; 3],
}

/// Compares accelerations of nodes and of all modes under the same loads. Deformation, its rates, the square
/// of the spin and the loads are proportional to `amplitude`.
fn accelerations_apart(
    (model, body): &(FeModel, FlexBody),
    amplitude: f64,
    loads: impl Fn(f64, &mut NodalEvaluation<'_>),
    reduced_loads: impl Fn(f64, &Evaluation<'_>, &mut [f64]),
) -> Apart {
    let nodal = NodalEquations::new(model, body.frame(), &ReferenceConditions::MeanAxes).expect("equations");
    let lifting = NodalModes::new(&nodal, body).expect("the modes of this model");
    let reduced = EquationsOfMotion::new(body, Terms::ALL);
    let nf = reduced.n_modes();
    let mut state = modal_state(9, body);
    state.omega *= amplitude.sqrt();
    state.q.iter_mut().chain(&mut state.qd).for_each(|q| *q *= amplitude);
    let mut evaluation = NodalEvaluation::new(&nodal);
    evaluation.set(&nodal.state(&lifting.lift(&state)).expect("a state")).expect("a state");
    loads(amplitude, &mut evaluation);
    let mut udd = vec![0.0; nodal.n_rows()];
    let (linear, angular) = evaluation.accelerations(&mut udd).expect("accelerations");

    let mut own = Evaluation::new(&reduced);
    own.set(&state.q, &velocities(&reduced, &state));
    let (mut forces, mut expected) = (vec![0.0; reduced.n_velocities()], vec![0.0; reduced.n_velocities()]);
    reduced_loads(amplitude, &own, &mut forces);
    own.accelerations(&forces, &mut expected).expect("accelerations");
    let lifted = lifting.lift(&Configuration { q: expected.split_off(reduced.n_rigid()), ..state });
    let found: Vec<f64> = if nf + 3 == reduced.n_velocities() {
        vec![linear.x, linear.y, angular.z]
    } else {
        linear.iter().chain(&angular).copied().collect()
    };
    let half = found.len().div_ceil(2);
    let weighted = |x: &DVector<f64>| {
        let product = model.pencil().apply_mass(Mat::from_fn(x.len(), 1, |i, _| x[i]).as_ref());
        (0..x.len()).map(|i| x[i] * product[(i, 0)]).sum::<f64>().sqrt()
    };
    let expected_udd = DVector::from_vec(lifted.u);
    let size = weighted(&expected_udd) / body.invariants().mass().sqrt();
    let of_frame = |group: std::ops::Range<usize>| {
        let (a, b) =
            (DVector::from_column_slice(&found[group.clone()]), DVector::from_column_slice(&expected[group]));
        ((a - &b).norm(), b.norm())
    };
    let ((origin, origin_size), (turning, turning_size)) = (of_frame(0..half), of_frame(half..found.len()));
    Apart {
        errors: [origin, turning, weighted(&(DVector::from_vec(udd) - &expected_udd))],
        sizes: [origin_size.max(size), turning_size, weighted(&expected_udd)],
    }
}

/// Asserts that accelerations of all modes agree with those of the nodes. Without rotary mass the equations
/// are equal. With rotary mass the modal equations have the kinetic energy to second order of the
/// displacements: accelerations of the nodes differ by their square, those of the frame by the third power.
fn assert_same_accelerations(
    what: &str,
    whole: &(FeModel, FlexBody),
    loads: impl Fn(f64, &mut NodalEvaluation<'_>),
    reduced_loads: impl Fn(f64, &Evaluation<'_>, &mut [f64]),
) {
    let at = |amplitude: f64| accelerations_apart(whole, amplitude, &loads, &reduced_loads);
    if whole.0.director_mass().is_none() {
        let Apart { errors, sizes } = at(1.0);
        let errors = [0, 1, 2].map(|k| errors[k] / sizes[k]);
        assert!(errors.iter().all(|error| *error < 1e-10), "{what}: {errors:?}");
        return;
    }
    let [coarse, fine] = [0.04, 0.02].map(at);
    let relative = [0, 1, 2].map(|k| fine.errors[k] / fine.sizes[k]);
    let ratios = [0, 1, 2].map(|k| coarse.errors[k] / fine.errors[k]);
    let falls = |k: usize| (if k == 2 { 3.6..4.4 } else { 7.0..9.0 }).contains(&ratios[k]);
    assert!((0..3).all(|k| falls(k) || relative[k] < 1e-10), "{what}: {relative:?} fall by {ratios:?}");
    assert!(relative.iter().all(|error| *error < 0.02), "{what}: {relative:?}");
    assert!(relative[2] > 1e-7, "{what}: no terms of higher order in {relative:?}");
}

/// Gravity and forces at nodes, for solids, plane bodies, general masses and bodies with massless rows.
#[test]
fn loads_accelerate_the_nodes_as_they_accelerate_all_modes() {
    let raws = ["frame_beams", "frame_lumped", "shell_folded", "mpc_block", "plane_frame", "spring_ends"]
        .map(|name| (name, raw_fixture(name)));
    for (name, raw) in
        raws.into_iter().chain([("hex8", soft_block(ElementKind::Hex8, [2, 1, 1])), ("plate", soft_plate())])
    {
        let whole = converted(raw, 10_000);
        let axes = modal_state(9, &whole.1).attitude.axes();
        let lambda = whole.1.modes().eigenvalue[0];
        let gravity = Vector3::new(0.3, -1.0, if whole.1.dimension() == 2 { 0.0 } else { 0.4 }) * lambda;
        let own = axes.transpose() * gravity;
        let node = BodyPoint::node(&whole.1, 4);
        let moment = Vector3::new(0.2, -0.3, 0.5) * (lambda * whole.1.invariants().inertia()[(2, 2)]);
        let moment = if whole.1.dimension() == 2 { Vector3::z() * moment.z } else { moment };
        let mass = whole.1.invariants().mass();
        assert_same_accelerations(
            name,
            &whole,
            |factor, evaluation| {
                evaluation.add_gravity(&(gravity * factor));
                evaluation.add_force(4, &(gravity * (factor * mass)));
                if node.turns() {
                    evaluation.add_torque(4, &(moment * factor));
                }
            },
            |factor, evaluation, forces| {
                evaluation.add_gravity(&(own * factor), forces);
                node.add_force(evaluation, &(own * (factor * mass)), forces);
                if node.turns() {
                    node.add_torque(evaluation, &(axes.tr_mul(&moment) * factor), forces);
                }
            },
        );
    }
}

#[test]
fn damping_matrices_act_on_the_nodes() {
    for name in ["frame_beams", "frame_lumped", "plane_frame"] {
        let raw = raw_fixture(name);
        let n = raw.stiffness.matrix.n_rows();
        let lambda = converted(raw_fixture(name), 1).1.modes().eigenvalue[0];
        let (alpha, beta) = (0.2 * lambda.sqrt(), 0.01 / lambda.sqrt());
        let rayleigh = raw.with(|data| data.damping = Some(Damping::Rayleigh { alpha, beta }));
        assert_same_accelerations(name, &converted(rayleigh, 10_000), |_, _| {}, |_, _, _| {});
        // The damping is proportional to the diagonal of K alone.
        let raw = raw_fixture(name);
        let diagonal: Vec<(u32, u32, f64)> = (0..n as u32)
            .map(|i| (i, i, 0.01 * beta * raw.stiffness.matrix.get(i as usize, i as usize)))
            .collect();
        let matrix = flexbody_model::RawMatrix {
            matrix: CscMatrix::from_triplets(n, n, &diagonal),
            ..raw.stiffness.clone()
        };
        let damped = raw.with(|data| data.damping = Some(Damping::Matrix(matrix)));
        assert_same_accelerations(name, &converted(damped, 10_000), |_, _| {}, |_, _, _| {});
    }
}

/// For a solid the conditions carry the moment of the linear elastic forces about the deformed body, and
/// nothing else.
#[test]
fn conditions_of_solids_hold_the_moment_of_elastic_forces() {
    for (name, raw) in [("hex8", soft_block(ElementKind::Hex8, [3, 2, 1])), ("plate", soft_plate())] {
        let body = Unreduced::new(raw);
        let d = body.model.dimension();
        let held = holding(&body.model);
        let shapes = held_shapes(&body, &held);
        for (conditions, shapes) in
            [(ReferenceConditions::MeanAxes, &body.shapes), (ReferenceConditions::Held(held), &shapes)]
        {
            let equations = NodalEquations::new(&body.model, &body.frame, &conditions).expect("equations");
            let state = body.moving_state(1, 0.2);
            let mut evaluation = NodalEvaluation::new(&equations);
            evaluation
                .set(&equations.state(&configuration(shapes, &state)).expect("a state"))
                .expect("a state");
            // Nodal forces do not change that moment.
            evaluation.add_force(1, &(Vector3::x() * body.eigenvalues[0]));
            let mut rates = vec![0.0; equations.dimension()];
            evaluation.rates(&mut rates).expect("rates");
            let (force, torque) = evaluation.reaction();
            let u = times(shapes, &state.q);
            let elastic = times(&body.stiffness, &u);
            let vector =
                |x: &DVector<f64>, i: usize| Vector3::from_fn(|k, _| if k < d { x[d * i + k] } else { 0.0 });
            let moments = (0..u.len() / d).map(|i| vector(&u, i).cross(&vector(&elastic, i)));
            let expected: Vector3<f64> = moments.clone().sum();
            let size: f64 = moments.map(|m| m.norm()).sum();
            assert!(expected.norm() > 1e-4 * size, "{name}: a moment");
            assert!((torque - expected).norm() < 1e-12 * size, "{name}: {torque} {expected}");
            assert!(force.norm() < 1e-12 * elastic.norm(), "{name}: {force}");
        }
    }
}

#[test]
fn what_has_no_nodal_equations_says_why() {
    let model = |raw: RawModel| FeModel::from_raw(raw).expect("a body").model;
    let refused = |model: &FeModel, conditions: &ReferenceConditions| {
        let error = NodalEquations::new(model, &Frame::model(), conditions).expect_err("refused");
        assert!(error.to_string().starts_with(|c: char| c.is_lowercase() || c.is_ascii_digit()), "{error}");
        error
    };
    let block = model(soft_block(ElementKind::Hex8, [2, 1, 1]));
    let dof = |node, direction| DofLabel { node, direction };
    let held = |dofs: &[DofLabel]| ReferenceConditions::Held(dofs.to_vec());
    let six = [dof(1, 1), dof(1, 2), dof(1, 3), dof(2, 1), dof(2, 2), dof(3, 1)];
    let mut strange = six;
    strange[5] = dof(1000, 1);
    assert_eq!(refused(&block, &held(&strange)), NodalError::DofUnknown(dof(1000, 1)));
    assert_eq!(refused(&block, &held(&six[..5])), NodalError::ConditionCount { expected: 6, found: 5 });
    // Nodes 1, 2, 3 lie on one line.
    assert_eq!(refused(&block, &held(&six)), NodalError::ConditionsDependent);
    assert_eq!(refused(&block, &held(&[dof(1, 1); 6])), NodalError::ConditionsDependent);

    let lumped = model(raw_fixture("frame_lumped"));
    let rotations: Vec<DofLabel> = (0..lumped.rows().len())
        .map(|row| lumped.label(row))
        .filter(|dof| dof.direction > 3)
        .take(6)
        .collect();
    assert_eq!(
        refused(&lumped, &ReferenceConditions::Held(rotations.clone())),
        NodalError::HeldWithoutMass(rotations[0])
    );

    let folded = model(raw_fixture("shell_folded"));
    let error = refused(&folded, &ReferenceConditions::Held(holding(&folded)));
    assert_eq!(error, NodalError::HeldMassSingular { null_vectors: 8 });

    let raw = soft_block(ElementKind::Hex8, [1, 1, 1]).with(|data| data.damping = Some(Damping::Ratio(0.02)));
    assert_eq!(refused(&model(raw), &ReferenceConditions::MeanAxes), NodalError::DampingOfModes);

    let equations =
        NodalEquations::new(&block, &Frame::model(), &ReferenceConditions::MeanAxes).expect("equations");
    let zero = vec![0.0; equations.n_rows()];
    let at = |u: Vec<f64>| flexbody_motion::dynamics::NodalConfiguration {
        origin: Vector3::zeros(),
        attitude: EulerParameters([1.0, 0.0, 0.0, 0.0]),
        velocity: Vector3::zeros(),
        omega: Vector3::zeros(),
        ud: zero.clone(),
        u,
    };
    assert!(equations.state(&at(zero.clone())).is_ok());
    let mut moved = zero.clone();
    moved[0] = 1e-3;
    let error = equations.state(&at(moved)).expect_err("rigid motion in one displacement");
    assert!(matches!(error, NodalError::ConditionsViolated { part } if part > 0.01 && part < 1.0), "{error}");
}

/// Another frame gives the same positions and velocities of the nodes, and the same kinetic energy.
#[test]
fn frames_of_solids_show_the_same_nodes() {
    for (name, raw) in [("hex8", soft_block(ElementKind::Hex8, [3, 2, 1])), ("plate", soft_plate())] {
        let body = Unreduced::new(raw);
        let frame = Frame {
            axes: nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), 0.8).into_inner(),
            ..body.frame
        };
        let equations = |conditions: &ReferenceConditions| {
            NodalEquations::new(&body.model, &frame, conditions).expect("equations")
        };
        let (mean, held) = (
            equations(&ReferenceConditions::MeanAxes),
            equations(&ReferenceConditions::Held(holding(&body.model))),
        );
        let start = configuration(&body.shapes, &body.moving_state(2, 0.1));
        assert!(matches!(held.state(&start), Err(NodalError::ConditionsViolated { .. })), "{name}");
        let changed = held.reframed(&start).expect("another frame");
        let (mut a, mut b) = (NodalEvaluation::new(&mean), NodalEvaluation::new(&held));
        a.set(&mean.state(&start).expect("a state")).expect("a state");
        b.set(&held.state(&changed).expect("a state")).expect("a state");
        let speed = a.node_velocity(0).norm();
        let turned = (a.configuration().omega - b.configuration().omega).norm();
        assert!(turned > 1e-3 * a.configuration().omega.norm(), "{name}: another frame");
        for i in 0..body.positions.len() {
            assert!((a.place(i) - b.place(i)).norm() < 1e-13 * (1.0 + a.place(i).norm()), "{name}: node {i}");
            let difference = (a.node_velocity(i) - b.node_velocity(i)).norm();
            assert!(difference < 1e-11 * speed, "{name}: node {i} {difference:e}");
        }
        assert!((a.kinetic_energy() / b.kinetic_energy() - 1.0).abs() < 1e-12, "{name}");
        // Reframing back gives the first configuration.
        let back = mean.reframed(&b.configuration()).expect("the first frame");
        let difference = DVector::from_vec(back.u) - DVector::from_vec(start.u);
        assert!(difference.amax() < 1e-13 * body.size, "{name}: {:e}", difference.amax());
    }
    let body = Unreduced::fixture("frame_beams");
    let equations =
        NodalEquations::new(&body.model, &body.frame, &ReferenceConditions::MeanAxes).expect("equations");
    let start = configuration(&body.shapes, &body.moving_state(2, 0.1));
    assert_eq!(equations.reframed(&start), Err(NodalError::FrameTied));
}
