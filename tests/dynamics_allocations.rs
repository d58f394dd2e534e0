//! Evaluations of the equations of motion take no memory from the heap.

mod support;

use flexbody::dynamics::{
    BodyPoint, EquationsOfMotion, EulerParameters, Evaluation, LoadAxes, LoadJacobian, Orientation,
    RotationVector, Terms,
};
use flexbody::invariants::BodyFrame;
use nalgebra::Vector3;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use support::flexible::fixture;

/// The system's allocator, counting per thread: other threads of the test harness do not matter.
struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

#[allow(unsafe_code)] // an allocator cannot be written without
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
            let energy = evaluation.kinetic_energy() + evaluation.elastic_energy();
            evaluation.mass_matrix_of(&euler, &mut larger);
            evaluation.velocity_forces_of(&euler, &euler.rate(&Vector3::x()).into(), &mut longer);
            evaluation.mass_matrix_of(&vector, &mut square);
            evaluation.velocity_forces_of(&vector, &Vector3::x(), &mut forces);
            let axes = vector.axes();
            assert_eq!(COUNT.get(), before, "{name} {terms:?}");
            assert!(energy > 0.0 && axes.determinant() > 0.0);
            // The counter counts.
            let one = std::hint::black_box(Box::new(energy));
            assert_eq!(COUNT.get(), before + 1);
            drop(one);
        }
    }
}
