//! Evaluations of the equations of motion and steps of the integrators allocate no heap memory.

use flexbody_body::flex_body::Frame;
use flexbody_body::invariants::BodyFrame;
use flexbody_model::{Damping, FeModel};
use flexbody_motion::dynamics::{
    BodyPoint, Configuration, EmptySpace, EquationsOfMotion, EulerParameters, Evaluation, LoadAxes,
    LoadJacobian, Motion, NodalConfiguration, NodalEquations, NodalEvaluation, NodalMotion, Orientation,
    Prescribed, ReferenceConditions, RotationVector, Terms,
};
use flexbody_motion::integration::{Explicit, Gauss, System as _};
use nalgebra::Vector3;
use oracle::flexible::fixture;
use oracle::general::raw_fixture;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// System allocator that counts per thread, so that other threads of the test harness do not matter.
struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

#[allow(unsafe_code)] // an allocator needs unsafe code
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn evaluations_allocate_nothing() {
    for (name, count) in [("cube_hex8", 12), ("frame_beams", 9)] {
        let body = fixture(name, count, BodyFrame::Principal);
        for terms in [Terms::ALL, Terms::NONE] {
            let equations = EquationsOfMotion::new(&body, terms);
            let (n, nf) = (equations.n_velocities(), equations.n_modes());
            let point = BodyPoint::node(&body, 3);
            let mut by_turn = vec![0.0; 3 * n];
            let (q, nu) = (vec![1e-3; nf], vec![0.1; n]);
            let (mut forces, mut rates) = (vec![0.0; n], vec![0.0; n]);
            let (mut square, mut by_q, mut pi) = (vec![0.0; n * n], vec![0.0; n * nf], vec![0.0; nf]);
            let (mut larger, mut longer) = (vec![0.0; (n + 1) * (n + 1)], vec![0.0; n + 1]);
            let euler = EulerParameters([0.5, -0.5, 0.5, 0.5]);
            let vector = RotationVector(Vector3::new(0.3, 0.2, -1.0));
            let mut evaluation = Evaluation::new(&equations);

            let before = COUNT.get();
            evaluation.set(&q, &nu);
            evaluation.add_gravity(&Vector3::z(), &mut forces);
            point.add_force(&evaluation, &Vector3::x(), &mut forces);
            let mut jacobian = LoadJacobian { by_q: &mut by_q, by_turn: &mut by_turn };
            evaluation.add_gravity_jacobian(&Vector3::z(), &mut jacobian);
            point.add_force_jacobian(&evaluation, &Vector3::x(), LoadAxes::World, &mut jacobian);
            if point.turns() {
                point.add_torque(&evaluation, &Vector3::y(), &mut forces);
                point.add_torque_jacobian(&evaluation, &Vector3::y(), LoadAxes::World, &mut jacobian);
            }
            evaluation.accelerations(&forces, &mut rates).expect("a body");
            evaluation.balance(&rates, &mut forces);
            evaluation.mass_matrix(&mut square);
            evaluation.jacobian(&rates, &mut by_q, &mut square);
            evaluation.modal_momentum(&mut pi);
            evaluation.modal_momentum_rate(&q, &mut pi);
            evaluation.set_momenta(&q, &rates, &Prescribed::NOTHING).expect("a body");
            let energy = evaluation.kinetic_energy() + evaluation.elastic_energy();
            evaluation.mass_matrix_of(&euler, &mut larger);
            evaluation.velocity_forces_of(&euler, &euler.rate(&Vector3::x()).into(), &mut longer);
            evaluation.mass_matrix_of(&vector, &mut square);
            evaluation.velocity_forces_of(&vector, &Vector3::x(), &mut forces);
            let axes = vector.axes();
            assert_eq!(COUNT.get(), before, "{name} {terms:?}");
            assert!(energy > 0.0 && axes.determinant() > 0.0);
            // Checks the counter itself.
            let one = std::hint::black_box(Box::new(energy));
            assert_eq!(COUNT.get(), before + 1);
            drop(one);
        }
    }
}

/// Nodal equations of a solid, with massless rows, and with other null vectors of the mass.
#[test]
fn nodal_evaluations_allocate_nothing() {
    for name in ["bracket_hex20", "frame_lumped", "shell_folded", "plane_frame"] {
        let raw =
            raw_fixture(name).with(|data| data.damping = Some(Damping::Rayleigh { alpha: 0.1, beta: 1e-3 }));
        let model = FeModel::from_raw(raw).expect("a body").model;
        let frame = Frame::model();
        let equations =
            NodalEquations::new(&model, &frame, &ReferenceConditions::MeanAxes).expect("equations");
        let n = equations.n_rows();
        let start = NodalConfiguration {
            origin: Vector3::zeros(),
            attitude: EulerParameters([0.6, 0.0, 0.0, 0.8]),
            velocity: Vector3::x(),
            omega: Vector3::z(),
            u: vec![0.0; n],
            ud: vec![0.0; n],
        };
        let mut state = equations.state(&start).expect("a state");
        let (mut rates, mut scales, mut nodal) = (state.clone(), state.clone(), vec![0.0; n]);
        let loads = |_: f64, at: &mut NodalEvaluation<'_>| {
            at.add_gravity(&Vector3::y());
            at.add_force(1, &Vector3::x());
        };
        let mut motion = NodalMotion::new(&equations, loads);
        let row_forces = vec![1e-3; n];

        let before = COUNT.get();
        motion.rates(0.0, &state, &mut rates).expect("rates");
        motion.scales(&state, &mut scales);
        motion.settle(&mut state);
        let at = motion.evaluate(0.0, &state).expect("a state");
        at.add_row_forces(&row_forces);
        let (linear, angular) = at.accelerations(&mut nodal).expect("accelerations");
        at.balance(&linear, &angular, &row_forces, &mut nodal);
        let energy =
            at.kinetic_energy() + at.elastic_energy() + at.reaction().1.norm() + at.momenta().0.norm();
        let (place, velocity) = (at.place(2), at.node_velocity(2));
        assert_eq!(COUNT.get(), before, "{name}");
        assert!(energy > 0.0 && place.norm() < 1e9 && velocity.norm() > 0.0);
        assert!(scales.iter().all(|scale| *scale > 0.0), "{name}");
    }
}

#[test]
fn steps_allocate_nothing_after_the_first() {
    let body = fixture("cube_hex8", 8, BodyFrame::Principal);
    let equations = EquationsOfMotion::new(&body, Terms::ALL);
    let period = std::f64::consts::TAU / body.modes().eigenvalue[7].sqrt();
    let start = Configuration {
        origin: Vector3::zeros(),
        attitude: EulerParameters([1.0, 0.0, 0.0, 0.0]),
        velocity: Vector3::zeros(),
        omega: Vector3::new(0.1, 1.0, 0.2) / period * 0.01,
        q: vec![0.0; 8],
        qd: vec![0.0; 8],
    };
    let (mut motion, mut state) = Motion::new(&equations, &EmptySpace, &start);
    let (mut explicit, mut gauss) =
        (Explicit::new(motion.dimension(), 1e-9, period), Gauss::new(motion.dimension(), 4));
    let mut time = explicit.step(&mut motion, 0.0, &mut state, period).expect("a step");
    let mut within = state.clone();
    let before = COUNT.get();
    for _ in 0..5 {
        time = explicit.step(&mut motion, time, &mut state, 10.0 * period).expect("a step");
        explicit.interpolate(&mut motion, time, &state, &mut within).expect("a state");
    }
    assert_eq!(COUNT.get(), before, "explicit");
    let step = 0.05 * period;
    gauss.step(&mut motion, time, &mut state, step).expect("a step");
    let before = COUNT.get();
    for i in 1..5 {
        gauss.step(&mut motion, time + f64::from(i) * step, &mut state, step).expect("a step");
    }
    assert_eq!(COUNT.get(), before, "Gauss");
}
