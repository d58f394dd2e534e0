//! Cost of one evaluation of the equations of motion at 20 and 90 modes: `cargo bench --bench dynamics`.
//!
//! Accelerations of a free body from its state, each state another, beside the same equations in dense matrices of nalgebra as
//! they are printed (theory section 6). Best of several: interruptions only ever slow a run down.

#[path = "../tests/support/mod.rs"]
mod support;

use flexbody::dynamics::{
    EquationsOfMotion, EulerParameters, Evaluation, NodalConfiguration, NodalEquations, NodalMotion,
    ReferenceConditions, Terms,
};
use flexbody::flex_body::Frame;
use flexbody::integration::System;
use flexbody::invariants::BodyFrame;
use flexbody::model::FeModel;
use nalgebra::{DVector, Vector3};
use std::time::Instant;
use support::equations::State;
use support::flexible::{fixture, lively_state, oracle};
use support::general::{quasi_velocities, raw_fixture};
use support::random::Random;

const REPEATS: usize = 7;

/// Seconds of one call, of `calls` in a row.
fn best_seconds(calls: usize, mut work: impl FnMut(usize)) -> f64 {
    (0..REPEATS)
        .map(|_| {
            let began = Instant::now();
            (0..calls).for_each(&mut work);
            began.elapsed().as_secs_f64() / calls as f64
        })
        .fold(f64::INFINITY, f64::min)
}

fn main() {
    println!("{:>5} {:>30} {:>12} {:>8}", "modes", "accelerations", "us", "ratio");
    for nf in [20, 90] {
        for name in ["bracket_hex20", "shell_folded"] {
            let body = fixture(name, nf, BodyFrame::Principal);
            let mut random = Random(1);
            let states: Vec<State> = (0..16).map(|_| lively_state(&mut random, &body)).collect();
            let velocities: Vec<DVector<f64>> = states.iter().map(quasi_velocities).collect();
            let oracle = oracle(&body);
            let dense = best_seconds(2000 / nf, |i| {
                std::hint::black_box(oracle.accelerations(&states[i % states.len()]));
            });
            println!("{nf:>5} {:>30} {:>12.2} {:>8.1}", format!("{name}, dense"), dense * 1e6, 1.0);
            let free = vec![0.0; 6 + nf];
            for (what, terms) in [
                ("all terms", Terms::ALL),
                ("without W3", Terms { w3: false, ..Terms::ALL }),
                ("W1 only", Terms { w1: true, ..Terms::NONE }),
            ] {
                let equations = EquationsOfMotion::new(&body, terms);
                let mut evaluation = Evaluation::new(&equations);
                let mut rates = vec![0.0; 6 + nf];
                let seconds = best_seconds(200_000 / nf, |i| {
                    let at = i % states.len();
                    evaluation.set(states[at].q.as_slice(), velocities[at].as_slice());
                    evaluation.accelerations(&free, &mut rates).expect("a body");
                    std::hint::black_box(&rates);
                });
                println!(
                    "{nf:>5} {:>30} {:>12.2} {:>8.1}",
                    format!("{name}, {what}"),
                    seconds * 1e6,
                    dense / seconds
                );
            }
        }
    }
    // Gravity and Jacobians, which implicit integrators take once per step.
    let body = fixture("bracket_hex20", 90, BodyFrame::Principal);
    let equations = EquationsOfMotion::new(&body, Terms::ALL);
    let (n, nf) = (equations.n_velocities(), equations.n_modes());
    let mut evaluation = Evaluation::new(&equations);
    let state = lively_state(&mut Random(2), &body);
    evaluation.set(state.q.as_slice(), quasi_velocities(&state).as_slice());
    let (acceleration, mut by_q, mut by_nu) = (vec![0.1; n], vec![0.0; n * nf], vec![0.0; n * n]);
    let jacobian = best_seconds(200, |_| evaluation.jacobian(&acceleration, &mut by_q, &mut by_nu));
    let mut forces = vec![0.0; n];
    let gravity = best_seconds(20_000, |_| evaluation.add_gravity(&Vector3::z(), &mut forces));
    println!("{nf:>5} {:>30} {:>12.2}", "bracket_hex20, Jacobians", jacobian * 1e6);
    println!("{nf:>5} {:>30} {:>12.2}", "bracket_hex20, gravity", gravity * 1e6);
    // All nodes: what the reduction saves.
    for name in ["cube_hex8", "bracket_hex20"] {
        let model = FeModel::from_raw(raw_fixture(name)).expect("a body").model;
        let equations =
            NodalEquations::new(&model, &Frame::model(), &ReferenceConditions::MeanAxes).expect("equations");
        let zero = vec![0.0; equations.n_rows()];
        let start = NodalConfiguration {
            origin: Vector3::zeros(),
            attitude: EulerParameters([1.0, 0.0, 0.0, 0.0]),
            velocity: Vector3::zeros(),
            omega: Vector3::new(0.1, 1.0, 0.2),
            u: zero.clone(),
            ud: zero,
        };
        let state = equations.state(&start).expect("a state");
        let (mut motion, mut rates) = (NodalMotion::free(&equations), state.clone());
        let nodal = best_seconds(50, |_| motion.rates(0.0, &state, &mut rates).expect("rates"));
        println!("{:>5} {:>30} {:>12.2}", model.rows().len(), format!("{name}, all nodes"), nodal * 1e6);
    }
}
