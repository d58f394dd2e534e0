//! A free body at the extremes of spin, step, deformation and duration: what of energy, momentum and state is
//! kept, or how it ends. `evidence/programs/make_stability.py` makes tables of the JSON lines that this prints.
//!
//!     cargo run --release --example extreme_motion -- body.flex.h5

use flexbody_body::flex_body::FlexBody;
use flexbody_motion::dynamics::{
    Configuration, EmptySpace, EquationsOfMotion, EulerParameters, Motion, Orientation, Terms,
};
use flexbody_motion::integration::{Explicit, Failure, Gauss, Method, System, integrate};
use nalgebra::Vector3;
use serde_json::{Value, json};
use std::f64::consts::TAU;

/// A case: spin in parts of the first circular frequency, first modal coordinate in parts of the radius of
/// gyration times the root of the mass, duration in periods of the first mode.
#[derive(Clone, Copy)]
struct Case {
    spin: f64,
    deformation: f64,
    periods: f64,
    /// The first modal coordinate is larger by this part of it.
    nudge: f64,
}

const PLAIN: Case = Case { spin: 0.05, deformation: 1e-3, periods: 20.0, nudge: 0.0 };

/// Relative change of the initial state of a second run. If its motion differs as much as the error of the
/// integration, the motion is chaotic and not badly integrated.
const NUDGE: f64 = 1e-9;

/// Largest change of energy and angular momentum relative to what there was, largest |q| beside the size of
/// the body, and the state at the end.
struct Run {
    energy: f64,
    angular: f64,
    largest: f64,
    end: Configuration,
}

fn main() {
    let path = std::env::args().nth(1).expect("usage: extreme_motion BODY.flex.h5");
    let body = flexbody_file::read(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
    let fastest = body.modes().eigenvalue[body.n_modes() - 1].sqrt();
    let gauss = |order: usize, part: f64| {
        move |n: usize| Method::Gauss { method: Gauss::new(n, order), step: part / fastest }
    };
    let explicit = |n: usize| Method::Explicit(Explicit::new(n, 1e-12, f64::MAX));
    for spin in [0.0, 0.01, 0.1, 0.5, 0.9, 1.0, 1.1, 2.0, 5.0, 20.0] {
        let case = Case { spin, ..PLAIN };
        let runs = [run(&body, case, gauss(6, 0.1)), run(&body, case, explicit)];
        let nudged = run(&body, Case { nudge: NUDGE, ..case }, explicit);
        let between = |a: &Result<Run, Failure>, b: &Result<Run, Failure>| match (a, b) {
            (Ok(a), Ok(b)) => Value::from(difference(&a.end, &b.end, &body)),
            _ => Value::Null,
        };
        let (apart, nudged) = (between(&runs[0], &runs[1]), between(&nudged, &runs[1]));
        let [a, b] = runs.map(|run| told(&run));
        println!(
            "{}",
            json!({ "family": "spin", "case": spin, "gauss": a, "explicit": b, "apart": apart, "nudged": nudged })
        );
    }
    for part in [0.03f64, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0] {
        // Long enough that no step is cut short by what is looked at.
        let case = Case { periods: PLAIN.periods * part.max(1.0), ..PLAIN };
        let [a, b, c] = [2, 4, 6].map(|order| told(&run(&body, case, gauss(order, part))));
        println!("{}", json!({ "family": "step", "case": part, "gauss2": a, "gauss4": b, "gauss6": c }));
    }
    for deformation in [1e-6, 1e-3, 0.1, 1.0, 10.0, 1e3, 1e6] {
        let case = Case { deformation, ..PLAIN };
        let [a, b] = [told(&run(&body, case, gauss(6, 0.1))), told(&run(&body, case, explicit))];
        println!("{}", json!({ "family": "deformation", "case": deformation, "gauss": a, "explicit": b }));
    }
    let slowest = body.modes().eigenvalue[0].sqrt();
    for steps in [1e4, 1e5, 1e6, 1e7] {
        let case = Case { periods: steps * 0.3 / fastest * slowest / TAU, ..PLAIN };
        println!(
            "{}",
            json!({ "family": "steps", "case": steps, "gauss4": told(&run(&body, case, gauss(4, 0.3))) })
        );
    }
}

/// Spin about an axis near the middle one, the first mode bent.
fn start(body: &FlexBody, case: Case) -> Configuration {
    let mut q = vec![0.0; body.n_modes()];
    q[0] = case.deformation * (1.0 + case.nudge) * size(body);
    Configuration {
        origin: Vector3::zeros(),
        attitude: EulerParameters([1.0, 0.0, 0.0, 0.0]),
        velocity: Vector3::zeros(),
        omega: Vector3::new(0.1, 1.0, 0.05) * (case.spin * body.modes().eigenvalue[0].sqrt()),
        q,
        qd: vec![0.0; body.n_modes()],
    }
}

/// Root of the trace of J: what modal coordinates are beside.
fn size(body: &FlexBody) -> f64 {
    body.invariants().second_moment().trace().sqrt()
}

fn run(body: &FlexBody, case: Case, method: impl Fn(usize) -> Method) -> Result<Run, Failure> {
    let equations = EquationsOfMotion::new(body, Terms::ALL);
    let first = start(body, case);
    let duration = case.periods * TAU / body.modes().eigenvalue[0].sqrt();
    let instants: Vec<f64> = (0..=20).map(|i| duration * f64::from(i) / 20.0).collect();
    let (mut motion, mut state) = Motion::new(&equations, &EmptySpace, &first);
    let mut observer = Motion::new(&equations, &EmptySpace, &first).0;
    let (mut balances, mut largest, mut end) = (Vec::new(), 0.0f64, first);
    let mut method = method(motion.dimension());
    integrate(&mut method, &mut motion, &mut state, &instants, &[], |time, state| {
        let now = observer.evaluate(time, state)?;
        let balance = now.balance();
        balances.push((balance.kinetic + balance.elastic, balance.angular));
        end = now.configuration();
        largest = end.q.iter().fold(largest, |most, q| most.max(q.abs()));
        Ok::<(), Failure>(())
    })?;
    let (energy, angular) = balances[0];
    // What the energy could have of angular momentum: at least what there is.
    let whole = (2.0 * energy * body.invariants().inertia()[(2, 2)]).sqrt();
    let most = |lost: &mut dyn Iterator<Item = f64>, whole: f64| lost.fold(0.0, f64::max) / whole;
    Ok(Run {
        energy: most(&mut balances.iter().map(|b| (b.0 - energy).abs()), energy),
        angular: most(&mut balances.iter().map(|b| (b.1 - angular).norm()), whole),
        largest: largest / size(body),
        end,
    })
}

/// Attitude, and deformation beside its size.
fn difference(a: &Configuration, b: &Configuration, body: &FlexBody) -> f64 {
    let bent = a.q.iter().fold(PLAIN.deformation * size(body), |most, q| most.max(q.abs()));
    let apart = a.q.iter().zip(&b.q).map(|(a, b)| (a - b).abs() / bent).fold(0.0, f64::max);
    apart.max((a.attitude.axes() - b.attitude.axes()).norm())
}

fn told(run: &Result<Run, Failure>) -> Value {
    match run {
        Ok(Run { energy, angular, largest, .. }) => {
            json!({ "energy": energy, "angular": angular, "largest": largest })
        }
        Err(failure) => json!({ "ends": failure.to_string() }),
    }
}
