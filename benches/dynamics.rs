//! Cost of one evaluation of the equations of motion at 20 and 90 modes: `cargo bench --bench dynamics`, with
//! `-- --json` for benches/dynamics.py.
//!
//! Accelerations of a free body from its state, each state another, beside the same equations in dense
//! matrices of nalgebra as they are printed (theory section 6). Processor time on Linux, best of several:
//! other programs only ever slow a run down.

use flexbody_body::flex_body::Frame;
use flexbody_body::invariants::BodyFrame;
use flexbody_model::FeModel;
use flexbody_motion::dynamics::{
    EquationsOfMotion, EulerParameters, Evaluation, NodalConfiguration, NodalEquations, NodalMotion,
    ReferenceConditions, Terms,
};
use flexbody_motion::integration::System;
use nalgebra::{DVector, Vector3};
use oracle::equations::State;
use oracle::flexible::{fixture, moving_state, oracle};
use oracle::general::{quasi_velocities, raw_fixture};
use oracle::random::Random;
use std::time::Instant;

const REPEATS: usize = 5;

/// Seconds that a run should take: long beside the resolution of processor time.
const RUN: f64 = 0.2;

/// Seconds that `work` takes: of the processor where the system tells, else on the clock.
fn seconds(work: impl FnOnce()) -> f64 {
    let processor = || -> Option<f64> {
        let told = std::fs::read_to_string("/proc/self/schedstat").ok()?;
        Some(told.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9)
    };
    let (clock, before) = (Instant::now(), processor());
    work();
    let elapsed = clock.elapsed().as_secs_f64();
    before.zip(processor()).map_or(elapsed, |(before, after)| after - before)
}

/// Seconds of one call, of many in a row.
fn best_seconds(mut work: impl FnMut(usize)) -> f64 {
    let mut run = |calls: usize| seconds(|| (0..calls).for_each(&mut work)) / calls as f64;
    // Long enough to tell how many calls make a run.
    let mut calls = 16;
    while run(calls) * (calls as f64) < 0.1 * RUN {
        calls *= 4;
    }
    let calls = (RUN / run(calls)).ceil() as usize;
    (0..REPEATS).map(|_| run(calls)).fold(f64::INFINITY, f64::min)
}

/// One line of the table, or one JSON object.
fn tell(nf: usize, body: &str, what: &str, seconds: f64, dense: Option<f64>) {
    let us = seconds * 1e6;
    if std::env::args().any(|argument| argument == "--json") {
        println!("{}", serde_json::json!({ "modes": nf, "body": body, "what": what, "us": us }));
        return;
    }
    let ratio = dense.map_or(String::new(), |dense| format!("{:.1}", dense / seconds));
    println!("{nf:>5} {:>40} {us:>10.2} us {ratio:>8}", format!("{body}, {what}"));
}

fn main() {
    for nf in [20, 90] {
        for name in ["bracket_hex20", "shell_folded"] {
            let body = fixture(name, nf, BodyFrame::Principal);
            let mut random = Random(1);
            let states: Vec<State> = (0..16).map(|_| moving_state(&mut random, &body)).collect();
            let velocities: Vec<DVector<f64>> = states.iter().map(quasi_velocities).collect();
            let oracle = oracle(&body);
            let dense = best_seconds(|i| {
                std::hint::black_box(oracle.accelerations(&states[i % states.len()]));
            });
            tell(nf, name, "dense matrices", dense, Some(dense));
            let free = vec![0.0; 6 + nf];
            for (what, terms) in [
                ("all terms", Terms::ALL),
                ("without W3", Terms { w3: false, ..Terms::ALL }),
                ("W1 only", Terms { w1: true, ..Terms::NONE }),
                ("I0 only", Terms::NONE),
            ] {
                let equations = EquationsOfMotion::new(&body, terms);
                let mut evaluation = Evaluation::new(&equations);
                let mut rates = vec![0.0; 6 + nf];
                let cost = best_seconds(|i| {
                    let at = i % states.len();
                    evaluation.set(states[at].q.as_slice(), velocities[at].as_slice());
                    evaluation.accelerations(&free, &mut rates).expect("a body");
                    std::hint::black_box(&rates);
                });
                tell(nf, name, what, cost, Some(dense));
            }
        }
        // Gravity and Jacobians, which implicit integrators take once per step.
        let name = "bracket_hex20";
        let body = fixture(name, nf, BodyFrame::Principal);
        let equations = EquationsOfMotion::new(&body, Terms::ALL);
        let n = equations.n_velocities();
        let mut evaluation = Evaluation::new(&equations);
        let state = moving_state(&mut Random(2), &body);
        evaluation.set(state.q.as_slice(), quasi_velocities(&state).as_slice());
        let (acceleration, mut by_q, mut by_nu) = (vec![0.1; n], vec![0.0; n * nf], vec![0.0; n * n]);
        let jacobian = best_seconds(|_| evaluation.jacobian(&acceleration, &mut by_q, &mut by_nu));
        let mut forces = vec![0.0; n];
        let gravity = best_seconds(|_| evaluation.add_gravity(&Vector3::z(), &mut forces));
        tell(nf, name, "Jacobians", jacobian, None);
        tell(nf, name, "gravity", gravity, None);
    }
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
        let nodal = best_seconds(|_| motion.rates(0.0, &state, &mut rates).expect("rates"));
        tell(model.rows().len(), name, "all nodes", nodal, None);
    }
}
