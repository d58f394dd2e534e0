//! Steps of the classical Runge-Kutta method with a free body, as benches/dynamics.py asks for them:
//! `cargo bench --bench dynamics_steps -- START.json` reads body, start, step and count, and prints the last
//! state.
//!
//! {"body": FILE, "step": s, "steps": n, "repeats": times that the same steps are taken, "velocity": [3],
//! "omega": [3], "q": [nf], "qd": [nf]}, vectors of the frame along its axes, which are those of the world at
//! the start.

use flexbody_motion::dynamics::{EquationsOfMotion, EulerParameters, Evaluation, Orientation, Terms};
use nalgebra::Vector3;
use serde::Deserialize;
use std::path::PathBuf;

#[derive(Deserialize)]
struct Start {
    body: PathBuf,
    step: f64,
    steps: usize,
    repeats: usize,
    velocity: [f64; 3],
    omega: [f64; 3],
    q: Vec<f64>,
    qd: Vec<f64>,
}

/// y = (R, Euler parameters, q, V, omega, qd).
struct Motion<'a> {
    evaluation: Evaluation<'a>,
    nf: usize,
    free: Vec<f64>,
}

impl Motion<'_> {
    fn rates(&mut self, y: &[f64], rates: &mut [f64]) {
        let nf = self.nf;
        let (q, nu) = y[7..].split_at(nf);
        self.evaluation.set(q, nu);
        let (place, turn) = rates.split_at_mut(3);
        let (turn, rest) = turn.split_at_mut(4);
        let euler = EulerParameters([y[3], y[4], y[5], y[6]]);
        place.copy_from_slice((euler.axes() * Vector3::from_column_slice(&nu[..3])).as_slice());
        turn.copy_from_slice(&euler.rate(&Vector3::from_column_slice(&nu[3..6])));
        rest[..nf].copy_from_slice(&nu[6..]);
        self.evaluation.accelerations(&self.free, &mut rest[nf..]).expect("a body with mass");
    }
}

fn main() {
    let Some(path) = std::env::args().skip(1).find(|argument| argument != "--bench") else {
        println!("benches/dynamics.py runs this");
        return;
    };
    let text = std::fs::read_to_string(path).expect("readable");
    let start: Start = serde_json::from_str(&text).expect("a start");
    let body = flexbody_file::read(&start.body).expect("a body");
    let equations = EquationsOfMotion::new(&body, Terms::ALL);
    let (nf, n) = (equations.n_modes(), 7 + equations.n_modes() + equations.n_velocities());
    let mut motion =
        Motion { evaluation: Evaluation::new(&equations), nf, free: vec![0.0; equations.n_velocities()] };
    let head = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
    let first = [&head[..], &start.q, &start.velocity, &start.omega, &start.qd].concat();
    let mut y = first.clone();
    let (mut k, mut at, mut sum) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let h = start.step;
    for _ in 0..start.repeats {
        y.copy_from_slice(&first);
        for _ in 0..start.steps {
            sum.copy_from_slice(&y);
            at.copy_from_slice(&y);
            for (weight, next) in [(h / 6.0, 0.5 * h), (h / 3.0, 0.5 * h), (h / 3.0, h), (h / 6.0, 0.0)] {
                motion.rates(&at, &mut k);
                for i in 0..n {
                    sum[i] += weight * k[i];
                    at[i] = y[i] + next * k[i];
                }
            }
            y.copy_from_slice(&sum);
        }
    }
    let axes = EulerParameters([y[3], y[4], y[5], y[6]]).axes();
    let rows: Vec<Vec<f64>> = axes.row_iter().map(|row| row.iter().copied().collect()).collect();
    println!("{}", serde_json::json!({ "origin": y[..3], "axes": rows, "q": y[7..7 + nf] }));
}
