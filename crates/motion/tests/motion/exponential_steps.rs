//! Exponential steps of the adaptive method beside closed forms, and beside explicit steps alone.

use flexbody_motion::integration::{
    Adaptive, Explicit, Failure, Method, Oscillator, System, Work, integrate, integrate_closely,
};

/// Oscillators x' = p, p' = -k x - d p + load(t), the work of the loads and of the damping, and two entries u, v coupled to
/// the first of them:
///
/// ```text
/// y = (x_1 .. x_n, p_1 .. p_n, u, v, W)
/// ```
struct Loaded<L> {
    stiffness: Vec<f64>,
    damping: Vec<f64>,
    load: L,
    /// Of v' = -sin u + coupling x_1, with its reaction u coupling on p_1.
    coupling: f64,
    oscillators: Vec<Oscillator>,
}

impl<L: Fn(f64) -> f64> Loaded<L> {
    fn new(of: &[(f64, f64)], coupling: f64, load: L) -> Self {
        let n = of.len();
        let oscillator =
            |(j, &(stiffness, damping))| Oscillator { coordinate: j, momentum: n + j, stiffness, damping };
        Self {
            stiffness: of.iter().map(|pair| pair.0).collect(),
            damping: of.iter().map(|pair| pair.1).collect(),
            load,
            coupling,
            oscillators: of.iter().enumerate().map(oscillator).collect(),
        }
    }

    fn energy(&self, y: &[f64]) -> f64 {
        let n = self.stiffness.len();
        let of = |j: usize| 0.5 * (y[n + j].powi(2) + self.stiffness[j] * y[j].powi(2));
        let pendulum = 0.5 * y[2 * n + 1].powi(2) - y[2 * n].cos();
        (0..n).map(of).sum::<f64>() + pendulum - self.coupling * y[0] * y[2 * n]
    }

    /// Returns the states at `instants`, and the work.
    fn run(
        &mut self,
        stable: Option<f64>,
        tolerance: f64,
        start: &[f64],
        instants: &[f64],
    ) -> (Vec<Vec<f64>>, Work) {
        let explicit = Explicit::new(start.len(), tolerance, stable.unwrap_or(1.0)).longest_at_rest(1.0);
        let mut method = match stable {
            Some(_) => Method::Adaptive(Box::new(Adaptive::new(explicit, self))),
            None => Method::Explicit(explicit),
        };
        let (mut state, mut all) = (start.to_vec(), Vec::new());
        integrate(&mut method, self, &mut state, instants, &[], |_, y| {
            all.push(y.to_vec());
            Ok::<(), Failure>(())
        })
        .expect("a motion");
        (all, method.work())
    }
}

impl<L: Fn(f64) -> f64> System for Loaded<L> {
    fn dimension(&self) -> usize {
        2 * self.stiffness.len() + 3
    }

    fn rates(&mut self, time: f64, y: &[f64], rates: &mut [f64]) -> Result<(), Failure> {
        let n = self.stiffness.len();
        let load = (self.load)(time);
        let mut power = 0.0;
        for j in 0..n {
            rates[j] = y[n + j];
            rates[n + j] = load - self.stiffness[j] * y[j] - self.damping[j] * y[n + j];
            power += y[n + j] * (load - self.damping[j] * y[n + j]);
        }
        rates[n] += self.coupling * y[2 * n];
        rates[2 * n] = y[2 * n + 1];
        rates[2 * n + 1] = -y[2 * n].sin() + self.coupling * y[0];
        rates[2 * n + 2] = power;
        Ok(())
    }

    fn scales(&self, _: &[f64], scales: &mut [f64]) {
        let n = self.stiffness.len();
        scales.fill(1.0);
        scales[..n].iter_mut().zip(&self.stiffness).for_each(|(scale, k)| *scale = 1.0 / k.sqrt());
        scales[2 * n + 2] = f64::INFINITY;
    }

    fn oscillators(&self) -> &[Oscillator] {
        &self.oscillators
    }

    fn work_entry(&self) -> Option<usize> {
        Some(2 * self.stiffness.len() + 2)
    }

    fn follower_scales(&self, _: &[f64], scales: &mut [f64]) {
        scales[2 * self.stiffness.len() + 2] = 1.0;
    }
}

/// Returns x and p under the load sin t: the static and dynamic response, and the free motion that the start leaves.
fn under_sine(stiffness: f64, damping: f64, start: [f64; 2], t: f64) -> [f64; 2] {
    // x = a sin t + b cos t + free.
    let denominator = (stiffness - 1.0).powi(2) + damping * damping;
    let (a, b) = ((stiffness - 1.0) / denominator, -damping / denominator);
    let (x, v) = (start[0] - b, start[1] - a);
    let decay = 0.5 * damping;
    let square = stiffness - decay * decay;
    let (c, s) = if square > 0.0 {
        let (root, fades) = (square.sqrt(), (-decay * t).exp());
        (fades * (root * t).cos(), fades * (root * t).sin() / root)
    } else {
        let root = (-square).sqrt();
        let [slow, fast] = [-root, root].map(|root| 0.5 * (-(decay + root) * t).exp());
        (slow + fast, (slow - fast) / root)
    };
    let free = x * c + (v + decay * x) * s;
    let rate = v * c - (stiffness * x + decay * v) * s;
    [a * t.sin() + b * t.cos() + free, a * t.cos() - b * t.sin() + rate]
}

/// Oscillators of 3 to 3e5 rad per time, undamped, damped and overdamped, under a slow load, at ends of steps and within them,
/// beside the closed form. Explicit steps would need 5e5 of 12 evaluations.
#[test]
fn oscillators_of_any_rate_follow_a_slow_load() {
    let of = [(9.0, 0.0), (1e4, 2.0), (1e6, 0.0), (1e6, 100.0), (9e10, 3e4), (4e4, 1000.0)];
    let mut system = Loaded::new(&of, 0.0, f64::sin);
    let n = of.len();
    let mut start = vec![0.0; 2 * n + 3];
    // The undamped fast one begins with a ring of its own.
    start[2] = 1e-5;
    let instants: Vec<f64> =
        (0..=200).map(|i| 0.05 * f64::from(i) + if i % 7 == 3 { 0.0137 } else { 0.0 }).collect();
    let (states, work) = system.run(Some(5.8 / 3e5), 1e-10, &start, &instants);
    assert!(work.rates < 40_000, "{work:?}");
    for (t, y) in instants.iter().zip(&states) {
        for (j, &(stiffness, damping)) in of.iter().enumerate() {
            let [x, p] = under_sine(stiffness, damping, [start[j], start[n + j]], *t);
            let rate = stiffness.sqrt();
            let apart = (y[j] - x).abs() * rate + (y[n + j] - p).abs();
            assert!(apart < 1e-8, "oscillator {j} at {t}: {apart:e}");
        }
        // Work and energy agree although the undamped oscillator rings 159 times in each unit of time.
        let balance = system.energy(y) - system.energy(&states[0]) - y[2 * n + 2];
        assert!(balance.abs() < 1e-10, "{t}: {balance:e}");
    }
}

/// A pendulum that shakes a stiff oscillator and is shaken by it, beside explicit steps of a finer tolerance.
#[test]
fn coupled_motion_is_that_of_explicit_steps() {
    let of = [(1e6, 3.0), (4e8, 200.0)];
    let load = |t: f64| 0.5 * (2.0 * t).cos();
    let start = [0.3e-6, 0.0, 0.0, 0.0, 1.0, 0.2, 0.0];
    let instants: Vec<f64> = (0..=40).map(|i| 0.1 * f64::from(i)).collect();
    let mut system = Loaded::new(&of, 20.0, load);
    let (expected, explicit) = system.run(None, 1e-12, &start, &instants);
    let (found, work) = system.run(Some(5.8 / 2e4), 1e-9, &start, &instants);
    assert!(5 * work.rates < explicit.rates, "{work:?}, explicit {explicit:?}");
    for ((t, a), b) in instants.iter().zip(&found).zip(&expected) {
        for (at, scale) in [1e-3, 5e-5, 1.0, 1.0, 1.0, 1.0].into_iter().enumerate() {
            let apart = (a[at] - b[at]).abs() / scale;
            assert!(apart < 1e-6, "entry {at} at {t}: {apart:e}");
        }
        assert!((system.energy(a) - system.energy(&start) - a[6]).abs() < 1e-6, "{t}");
    }
}

/// Steps stay explicit where a fast oscillator drives what is not an oscillator: long ones would not pay.
#[test]
fn motion_that_must_be_followed_is_followed() {
    let of = [(1e4, 0.0)];
    let start = [1e-2, 0.0, 1.0, 0.0, 0.0];
    let instants: Vec<f64> = (0..=20).map(|i| 0.1 * f64::from(i)).collect();
    let mut system = Loaded::new(&of, 50.0, |_| 0.0);
    let (expected, _) = system.run(None, 1e-12, &start, &instants);
    let (alone, explicit) = system.run(None, 1e-9, &start, &instants);
    let (found, work) = system.run(Some(5.8 / 100.0), 1e-9, &start, &instants);
    assert!(work.rates < explicit.rates + explicit.rates / 5, "{work:?}, explicit {explicit:?}");
    let error = |states: &[Vec<f64>]| {
        let apart = states.iter().flatten().zip(expected.iter().flatten()).map(|(a, b)| (a - b).abs());
        apart.fold(0.0, f64::max)
    };
    assert!(error(&found) < 3.0 * error(&alone), "{:e} and {:e}", error(&found), error(&alone));
}

/// Observers see every period of what rings visibly, and few points of what is at rest.
#[test]
fn ringing_is_seen_closely() {
    let seen = |amplitude: f64| {
        let mut system = Loaded::new(&[(1e8, 0.0)], 0.0, |t: f64| t.powi(8));
        let start = [amplitude * 1e-4, 0.0, 0.0, 0.0, 0.0];
        let explicit = Explicit::new(5, 1e-9, 5.8e-4).longest_at_rest(1.0);
        let mut method = Method::Adaptive(Box::new(Adaptive::new(explicit, &system)));
        let (mut state, mut seen) = (start, Vec::new());
        integrate_closely(&mut method, &mut system, &mut state, &[0.0, 1.0], &[], 6, |_, time, y| {
            seen.push((time, y[0] - time.powi(8) / 1e8));
            Ok::<(), Failure>(())
        })
        .expect("a motion");
        assert!(method.work().rates < 2000, "{:?}", method.work());
        seen
    };
    // Parabolas through neighbours find the amplitude of the ring.
    let ring = seen(1e-2);
    let peak = |three: &[(f64, f64)]| {
        let [(a, x), (b, y), (c, z)] = three[..] else { return 0.0 };
        let (before, after) = ((y - x) / (b - a), (z - y) / (c - b));
        let bend = (after - before) / (c - a);
        let slope = before + bend * (b - a);
        if x <= y && y >= z && bend < 0.0 { y - slope * slope / (4.0 * bend) } else { 0.0 }
    };
    let peaks: Vec<f64> = ring.windows(3).map(peak).filter(|peak| *peak > 0.0).collect();
    assert!(peaks.len() > 1000, "{} of 1592 periods", peaks.len());
    let worst = peaks.iter().map(|peak| (peak / 1e-6 - 1.0).abs()).fold(0.0, f64::max);
    // 1e-5 of the motion, whose scale is a hundred times the amplitude. Peaks near the bound of two parabolas are twice as far off.
    assert!(worst < 3e-3, "{worst}");
    assert!(seen(1e-11).len() < 300);
}
