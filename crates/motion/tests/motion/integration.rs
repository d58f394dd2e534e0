//! Integrators: orders of convergence, conserved quantities, interpolation, jumps, and failures.

use flexbody_motion::integration::{Explicit, Failure, Gauss, Method, Oscillator, System, Work, integrate};

/// Equation y' = f(t, y) with unit scales.
struct Equation<F> {
    dimension: usize,
    rates: F,
    oscillators: Vec<Oscillator>,
}

impl<F: FnMut(f64, &[f64], &mut [f64])> Equation<F> {
    fn new(dimension: usize, rates: F) -> Self {
        Self { dimension, rates, oscillators: Vec::new() }
    }
}

impl<F: FnMut(f64, &[f64], &mut [f64])> System for Equation<F> {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn rates(&mut self, time: f64, state: &[f64], rates: &mut [f64]) -> Result<(), Failure> {
        (self.rates)(time, state, rates);
        Ok(())
    }

    fn scales(&self, _: &[f64], scales: &mut [f64]) {
        scales.fill(1.0);
    }

    fn oscillators(&self) -> &[Oscillator] {
        &self.oscillators
    }
}

const ECCENTRICITY: f64 = 0.5;

/// Returns the two-body problem in the plane: position and velocity, unit gravity, period 2 pi.
fn orbit() -> Equation<impl FnMut(f64, &[f64], &mut [f64])> {
    Equation::new(4, |_, y, rates| {
        let cube = y[0].hypot(y[1]).powi(3);
        rates.copy_from_slice(&[y[2], y[3], -y[0] / cube, -y[1] / cube]);
    })
}

/// Returns the orbit at a time by Kepler's equation; time zero is the closest point.
fn on_orbit(time: f64) -> [f64; 4] {
    let e = ECCENTRICITY;
    let mut anomaly = time;
    for _ in 0..100 {
        anomaly -= (anomaly - e * anomaly.sin() - time) / (1.0 - e * anomaly.cos());
    }
    let (sin, cos) = anomaly.sin_cos();
    let (minor, rate) = ((1.0 - e * e).sqrt(), 1.0 / (1.0 - e * cos));
    [cos - e, minor * sin, -sin * rate, minor * cos * rate]
}

fn gauss(order: usize, step: f64) -> Method {
    Method::Gauss { method: Gauss::new(4, order), step }
}

/// Returns a method with fixed steps, by a tolerance that every step meets.
fn explicit(step: f64) -> Method {
    Method::Explicit(Explicit::new(4, 1e300, step))
}

/// Returns the largest error of an orbit at the given times, and the work.
fn orbit_error(mut method: Method, instants: &[f64]) -> (f64, Work) {
    let mut state = on_orbit(instants[0]);
    let mut worst = 0.0_f64;
    integrate(&mut method, &mut orbit(), &mut state, instants, &[], |time, state| {
        let exact = on_orbit(time);
        worst = state.iter().zip(&exact).map(|(y, exact)| (y - exact).abs()).fold(worst, f64::max);
        Ok::<(), Failure>(())
    })
    .expect("an orbit");
    (worst, method.work())
}

#[test]
fn methods_converge_with_their_order() {
    let order = |of: &dyn Fn(f64) -> Method, steps: f64| {
        let [coarse, fine] = [1.0, 2.0].map(|k| orbit_error(of(6.0 / (k * steps)), &[0.0, 6.0]).0);
        (coarse / fine).log2()
    };
    for (expected, steps) in [(2, 2000.0), (4, 400.0), (6, 160.0)] {
        let found = order(&|step| gauss(expected, step), steps);
        assert!((found - expected as f64).abs() < 0.25, "order {expected}: {found}");
    }
    let found = order(&explicit, 120.0);
    assert!((found - 8.0).abs() < 0.5, "order 8: {found}");
}

#[test]
fn interpolation_has_order_seven() {
    // Times within the steps of both lengths, after one period of the coarser.
    let error = |step: f64| {
        let instants: Vec<f64> =
            [0.0].into_iter().chain((0..40).map(|i| 1.0 + 0.0173 * f64::from(i))).collect();
        orbit_error(explicit(step), &instants).0
    };
    let (coarse, fine) = (error(0.08), error(0.04));
    let found = (coarse / fine).log2();
    assert!(found > 6.5 && fine < 1e-9, "order {found}, error {fine:e}");
}

#[test]
fn the_error_follows_the_tolerance() {
    for tolerance in [1e-4, 1e-7, 1e-10, 1e-13] {
        let (error, work) = orbit_error(
            Method::Explicit(Explicit::new(4, tolerance, 1.0)),
            &[0.0, 20.0 * std::f64::consts::PI],
        );
        // Phase errors grow with the square of the time, here 60.
        assert!(error < 3600.0 * 4.0 * tolerance, "{tolerance:e}: {error:e}, {work:?}");
        assert!(work.rejected * 2 < work.steps, "{work:?}");
    }
}

#[test]
fn gauss_keeps_the_energy_of_the_orbit_within_bounds() {
    let energy = |y: &[f64]| 0.5 * (y[2] * y[2] + y[3] * y[3]) - 1.0 / y[0].hypot(y[1]);
    for (order, limit) in [(2, 2e-2), (4, 2e-3), (6, 3e-4)] {
        let mut state = on_orbit(0.0);
        let (begun, mut early, mut late) = (energy(&state), 0.0_f64, 0.0_f64);
        let instants: Vec<f64> = (0..=3000).map(f64::from).collect();
        integrate(&mut gauss(order, 0.05), &mut orbit(), &mut state, &instants, &[], |time, y| {
            let error = (energy(y) - begun).abs();
            let worst = if time < 1500.0 { &mut early } else { &mut late };
            *worst = worst.max(error);
            // Angular momentum is quadratic and conserved to rounding.
            let momentum = y[0] * y[3] - y[1] * y[2] - (1.0 - ECCENTRICITY * ECCENTRICITY).sqrt();
            assert!(momentum.abs() < 1e-13, "order {order}: angular momentum {momentum:e} at {time}");
            Ok::<(), Failure>(())
        })
        .expect("an orbit");
        assert!(late < limit && late < 1.2 * early, "order {order}: {early:e}, then {late:e}");
    }
}

#[test]
fn stiff_oscillators_are_solved_without_iterations_of_their_own() {
    // A slow pendulum with oscillators of 1e4 times its frequency, with steps of 5000 of their periods.
    let stiffness = [1.0, 1e8];
    let mut system = Equation::new(4, |_, y: &[f64], rates: &mut [f64]| {
        rates.copy_from_slice(&[y[2], y[3], -y[0].sin(), -stiffness[1] * y[1] - 3.0 * y[3]]);
    });
    system.oscillators = vec![
        Oscillator { coordinate: 0, momentum: 2, stiffness: 1.0, damping: 0.0 },
        Oscillator { coordinate: 1, momentum: 3, stiffness: 1e8, damping: 3.0 },
    ];
    let mut state = [0.5, 1e-3, 0.0, 0.0];
    let mut method = gauss(4, 0.1);
    let instants: Vec<f64> = (0..=100).map(f64::from).collect();
    integrate(&mut method, &mut system, &mut state, &instants, &[], |_, _| Ok::<(), Failure>(()))
        .expect("stable");
    let work = method.work();
    assert!(work.rates < 2 * 12 * work.steps, "{work:?}");
    let energy = 0.5 * state[2] * state[2] - state[0].cos();
    assert!((energy + 0.5_f64.cos()).abs() < 1e-7, "energy {energy}");
    assert!(state[1].abs() < 1e-3, "{state:?}");
}

#[test]
fn no_step_passes_over_a_jump() {
    let jump = 0.3 + 1.0 / 3.0;
    let run = |mut method: Method, breaks: &[f64]| {
        let mut system = Equation::new(4, |time, _: &[f64], rates: &mut [f64]| {
            rates.fill(if time < jump { 1.0 } else { -2.0 });
        });
        // The value of f at the jump itself has no effect.
        let mut state = [0.0; 4];
        integrate(&mut method, &mut system, &mut state, &[0.0, 1.0], breaks, |_, _| Ok::<(), Failure>(()))
            .expect("polynomials");
        (state[0] - (jump - 2.0 * (1.0 - jump))).abs()
    };
    assert!(run(gauss(4, 0.4), &[jump]) < 1e-15);
    assert!(run(gauss(4, 0.4), &[]) > 1e-3);
    let explicit = || Method::Explicit(Explicit::new(4, 1e-10, 1.0));
    assert!(run(explicit(), &[jump]) < 1e-14);
}

/// An oscillator of 1000 rad per time that rests until a force begins is passed in a few steps, and then follows the closed form.
#[test]
fn rest_is_passed_in_long_steps() {
    let (rate, start, end) = (1e3, 0.7, 0.71);
    let run = |explicit: Explicit| {
        let mut method = Method::Explicit(explicit);
        let mut system = Equation::new(4, |time, y: &[f64], rates: &mut [f64]| {
            let force = if time < start { 0.0 } else { 1.0 };
            rates.copy_from_slice(&[y[1], rate * rate * (force - y[0]), 0.0, 0.0]);
        });
        let mut state = [0.0; 4];
        integrate(&mut method, &mut system, &mut state, &[0.0, end], &[start], |_, _| Ok::<(), Failure>(()))
            .expect("an oscillation");
        (method.work().steps, state[0])
    };
    let explicit = || Explicit::new(4, 1e-10, 5.8 / rate);
    let ((all, along), (few, own)) = (run(explicit()), run(explicit().longest_at_rest(1.0)));
    let expected = 1.0 - (rate * (end - start)).cos();
    assert!((own - expected).abs() < 1e-7 && (along - expected).abs() < 1e-7, "{own} {along} {expected}");
    // The stability of the oscillation alone would take 120 steps until the force begins.
    assert!(few + 100 < all, "{all} and {few} steps");
}

/// A table and its run may end at times that differ by rounding.
#[test]
fn breaks_a_few_roundings_apart_stop_nothing() {
    for apart in [1, 2, 3, 5, 10, 20, 40, 100] {
        for ends_there in [false, true] {
            let jump: f64 = 0.7;
            let next = (0..apart).fold(jump, |time, _| time.next_up());
            let last = if ends_there { next } else { 1.0 };
            let run = |mut method: Method| {
                let mut system = Equation::new(4, |time, _: &[f64], rates: &mut [f64]| {
                    rates.fill(if time < jump { 1.0 } else { -2.0 });
                });
                let mut state = [0.0; 4];
                let mut seen = Vec::new();
                let observe = |time: f64, _: &[f64]| {
                    seen.push(time);
                    Ok::<(), Failure>(())
                };
                integrate(&mut method, &mut system, &mut state, &[0.0, jump, last], &[jump, next], observe)
                    .expect("polynomials");
                assert_eq!(seen, [0.0, jump, last]);
                (state[0] - (jump - 2.0 * (last - jump))).abs()
            };
            let found = [run(gauss(4, 0.4)), run(Method::Explicit(Explicit::new(4, 1e-10, 1.0)))];
            assert!(found.iter().all(|error| *error < 1e-14), "{apart} roundings: {found:?}");
        }
    }
    // Only the run ends there, like for a table whose last time was computed in another way.
    let mut state = [0.0; 4];
    let mut system = Equation::new(4, |_, _: &[f64], rates: &mut [f64]| rates.fill(1.0));
    let instants = [0.0, 0.7_f64.next_up()];
    let mut method = Method::Explicit(Explicit::new(4, 1e-10, 1.0));
    integrate(&mut method, &mut system, &mut state, &instants, &[0.7], |_, _| Ok::<(), Failure>(()))
        .expect("a straight line");
    assert!((state[0] - 0.7).abs() < 1e-15);
}

#[test]
fn what_cannot_go_on_is_said() {
    let mut never = Equation::new(4, |_, y: &[f64], rates: &mut [f64]| {
        rates.copy_from_slice(&y.iter().map(|y| y * y).collect::<Vec<_>>())
    });
    let mut run = |mut method: Method| {
        let mut state = [1.0; 4];
        let outcome =
            integrate(&mut method, &mut never, &mut state, &[0.0, 2.0], &[], |_, _| Ok::<(), Failure>(()));
        (outcome.expect_err("the solution ends at t = 1"), state)
    };
    let (failure, state) = run(Method::Explicit(Explicit::new(4, 1e-9, 1.0)));
    assert!(matches!(failure, Failure::StepTooSmall { time } if (time - 1.0).abs() < 1e-6), "{failure}");
    assert!(state[0].is_finite());
    let (failure, state) = run(gauss(4, 0.1));
    assert!(matches!(failure, Failure::NotConverged { .. } | Failure::NotFinite { .. }), "{failure}");
    assert!(state[0].is_finite());
}
