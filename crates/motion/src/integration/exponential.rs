//! Steps of collocation that solve the oscillators of a system exactly.

use super::explicit::{on_grid, within};
use super::{Failure, Oscillator, System, Work, free_oscillation};
use libm::{cos, hypot, pow};
use nalgebra::{Matrix2, Vector2};

/// Number of nodes of a step: Lobatto points, with both ends.
const NODES: usize = 8;

/// Number of points of the quadrature for slow oscillators: exact to rounding for phases up to [`STIFF`].
const POINTS: usize = 16;

/// Phase of an oscillator in a step from which its particular solution is a polynomial; the recursion of its coefficients then
/// loses no digits. Below, the integral over the step is taken by quadrature.
const STIFF: f64 = 8.0;

/// Largest number of quadratures of [`POINTS`] points in a step, for overdamped oscillators: more need a shorter step.
const MOST_PANELS: usize = 16;

/// Safety factor of the step length, and the limit of its change.
const STEP_SAFETY_FACTOR: f64 = 0.9;
const MIN_STEP_FACTOR: f64 = 1.0 / 3.0;
/// Lengths of steps in an octave. Rounding makes up to 1e-3 of the tolerance, which is near that of 64-bit numbers: on a finer grid
/// lengths would hang on last bits.
const LENGTHS_PER_OCTAVE: f64 = 4.0;
/// Errors and changes below this part of the tolerance are taken for this part, since their digits are those of rounding. Steps
/// therefore grow at most by the factor 1.9.
const LEAST_SEEN: f64 = 3e-3;

/// Tolerance relative to that of explicit steps: where stability limits these, their error is far below their tolerance, and long
/// steps that used all of it would be less accurate than what they replace. The other limit is rounding.
const FINER: f64 = 1e-2;
const FINEST: f64 = 1e-12;

/// Change of the states of a step, relative to the tolerance, that one more iteration would still make at its end.
const ITERATED: f64 = 1e-2;
/// Largest change of the last iteration, relative to the tolerance: the rate of work is that of the states before it.
const SEEN_BY_WORK: f64 = 10.0;
/// Limit of the number of iterations in a step.
const MOST_ITERATIONS: usize = 8;
/// Largest ratio of every second change of an iteration that goes on.
const MAX_CONTRACTION: f64 = 0.1;
/// Part of the length of a step whose iteration did not contract, up to which the next steps grow at first, and the growth of
/// this limit with each step.
const BELOW_REFUSED: f64 = 0.7;
const GROWTH_OF_LIMIT: f64 = 1.05;

/// Integral of a Legendre polynomial of degree 7 from -1, at most.
const INTEGRAL_OF_TOP: f64 = 0.1;
/// Coefficient of t^7 in the Legendre polynomial of degree 7.
const TOP: f64 = 429.0 / 16.0;

/// Error of the peaks that observers see, relative to the scale of the motion.
const SEEN: f64 = 1e-5;

/// Collocation of degree 7 with exact oscillators.
///
/// The system in the coordinates of its [`Oscillator`]s is z' = L z + g(t, z), where L holds the oscillators. In a step g is
/// replaced by the polynomial through its values at eight Lobatto points, and the oscillators under this polynomial are solved
/// in closed form (an exponential collocation: Hochbruck, Ostermann, Exponential integrators, Acta Numerica 19, 2010,
/// section 2.2). Stiff oscillators that follow their forces therefore do not limit the steps, and those that ring keep their
/// phase and amplitude; what limits the steps is how g varies.
///
/// A step is accepted if the root mean square over the entries of error / scale is at most the tolerance, where the error is
/// the effect of the coefficient of degree 7 of g.
#[derive(Debug, Clone)]
pub(super) struct Exponential {
    tolerance: f64,
    longest: f64,
    tableau: Box<Tableau>,
    /// States and g at the nodes, in the coordinates of the oscillators.
    states: [Vec<f64>; NODES],
    remainders: [Vec<f64>; NODES],
    /// Coefficients of the polynomials of g in t from -1 to 1: powers by entries.
    powers: [Vec<f64>; NODES],
    oscillators: Vec<Oscillator>,
    /// Entries that are not of an oscillator.
    plain: Vec<usize>,
    work_entry: Option<usize>,
    /// Change of the energy of the oscillators, p g_p + k x g_x - d p^2, at the nodes. A polynomial through them knows little of it
    /// if an oscillator is fast; the work gets the exact change in its place.
    power: [f64; NODES],
    physical: Vec<f64>,
    scales: Vec<f64>,
    /// Oscillators under a polynomial over a step of this length.
    solvers: Vec<Solver>,
    length: Option<f64>,
    /// Start, end and length of the last step.
    last: Option<[f64; 3]>,
    proposed: f64,
    /// Longest step whose iteration is expected to contract.
    limit: f64,
    /// Ratio of successive changes of the iteration in the last step, for a step of length one.
    contraction: Option<f64>,
    work: Work,
}

/// Nodes of a step from -1 to 1.
#[derive(Debug, Clone)]
struct Tableau {
    nodes: [f64; NODES],
    /// Integrals of the Lagrange polynomials from -1 to each node: nodes by polynomials.
    integrals: [[f64; NODES]; NODES],
    /// Coefficients of the Lagrange polynomials: powers by polynomials.
    powers: [[f64; NODES]; NODES],
    /// Points and weights of the quadrature of slow oscillators.
    quadrature: [(f64, f64); POINTS],
}

/// One oscillator under a polynomial over a step.
#[derive(Debug, Clone)]
struct Solver {
    /// Free motion over the time from the start to each node.
    motions: [Matrix2<f64>; NODES],
    /// Weights of g, nodes by polynomials; `None` for a stiff oscillator, whose particular solution is a polynomial.
    weights: Option<Box<[[Matrix2<f64>; NODES]; NODES]>>,
}

impl Exponential {
    /// Creates the method for `system`, with steps of at most `longest` and an error below `tolerance` times the scales of the
    /// system.
    pub(super) fn new(system: &dyn System, tolerance: f64, longest: f64) -> Self {
        let dimension = system.dimension();
        let zeros = || vec![0.0; dimension];
        let oscillators = system.oscillators().to_vec();
        let is_plain = |at: &usize| {
            !oscillators.iter().any(|oscillator| [oscillator.coordinate, oscillator.momentum].contains(at))
        };
        Self {
            plain: (0..dimension).filter(is_plain).collect(),
            oscillators,
            work_entry: system.work_entry(),
            power: [0.0; NODES],
            tolerance: (FINER * tolerance).max(FINEST).min(tolerance),
            longest,
            tableau: Box::new(Tableau::new()),
            states: std::array::from_fn(|_| zeros()),
            remainders: std::array::from_fn(|_| zeros()),
            powers: std::array::from_fn(|_| zeros()),
            physical: zeros(),
            scales: zeros(),
            solvers: Vec::new(),
            length: None,
            last: None,
            proposed: longest,
            limit: f64::INFINITY,
            contraction: None,
            work: Work::default(),
        }
    }

    pub(super) fn work(&self) -> Work {
        self.work
    }

    /// Returns the length of the last step; zero without one.
    pub(super) fn last_length(&self) -> f64 {
        self.last.map_or(0.0, |[_, _, h]| h)
    }

    /// Returns the length of the next step.
    pub(super) fn proposed(&self) -> f64 {
        self.proposed
    }

    /// Proposes the length of the next step, which continues no other.
    pub(super) fn begin(&mut self, length: f64) {
        (self.last, self.contraction) = (None, None);
        self.proposed = length.min(self.longest);
    }

    /// Tries one step from `time`, at most to `end`, of the proposed length, and returns its end; `None` if the step is too
    /// long, and a shorter one is proposed.
    ///
    /// # Errors
    /// The failures of the system at the state itself.
    pub(super) fn step(
        &mut self,
        system: &mut dyn System,
        time: f64,
        state: &mut [f64],
        end: f64,
    ) -> Result<Option<f64>, Failure> {
        let (h, until) = within(time, self.proposed.min(self.longest), end);
        self.find_scales(system, state);
        let continued = self.start(system, time, state)?;
        if !self.find_solvers(h) {
            return Ok(self.refuse(h, MIN_STEP_FACTOR));
        }
        self.guess(h, continued);
        if self.iterate(system, time, h).is_none() {
            self.limit = BELOW_REFUSED * h;
            return Ok(self.refuse(h, BELOW_REFUSED));
        }
        let error = self.error(h);
        let factor =
            (STEP_SAFETY_FACTOR * pow(error.max(LEAST_SEEN), -1.0 / NODES as f64)).max(MIN_STEP_FACTOR);
        if error.is_nan() || error > 1.0 {
            return Ok(self.refuse(h, if factor < 1.0 { factor } else { MIN_STEP_FACTOR }));
        }
        self.find_powers();
        self.last = Some([time, until, h]);
        self.end(system, h, state);
        self.limit *= GROWTH_OF_LIMIT;
        let next = on_grid(self.longest, (h * factor).min(self.limit), LENGTHS_PER_OCTAVE).min(self.longest);
        // A step that an end shortened tells nothing of longer ones.
        let whole = self.proposed.min(self.limit);
        self.proposed = if h < whole { whole.max(next) } else { next };
        self.work.steps += 1;
        Ok(Some(until))
    }

    /// Proposes a shorter step and forgets the last one.
    fn refuse(&mut self, h: f64, factor: f64) -> Option<f64> {
        self.begin(on_grid(self.longest, h * factor, LENGTHS_PER_OCTAVE));
        self.work.rejected += 1;
        None
    }

    /// Takes the scales of the system; those of the oscillators are the scales of their momenta.
    fn find_scales(&mut self, system: &dyn System, state: &[f64]) {
        system.scales(state, &mut self.scales);
        system.follower_scales(state, &mut self.scales);
        for oscillator in &self.oscillators {
            if oscillator.stiffness > 0.0 {
                self.scales[oscillator.coordinate] =
                    self.scales[oscillator.momentum] / oscillator.stiffness.sqrt();
            }
        }
    }

    /// Sets state and g at the first node. Returns the length of the step that this one continues.
    fn start(&mut self, system: &mut dyn System, time: f64, state: &[f64]) -> Result<Option<f64>, Failure> {
        let before = self.last.filter(|[_, until, _]| *until == time).map(|[_, _, h]| h);
        let [first, .., last] = &mut self.remainders;
        match before {
            // The last node of the last step is here.
            Some(_) => {
                first.copy_from_slice(last);
                self.power[0] = self.power[NODES - 1];
            }
            None => {
                self.states[0].copy_from_slice(state);
                system.enter_oscillators(&mut self.states[0]);
                self.evaluate(system, 0, time)?;
                return Ok(None);
            }
        }
        self.states[0].copy_from_slice(state);
        system.enter_oscillators(&mut self.states[0]);
        Ok(before)
    }

    /// Prepares the oscillators for steps of length `h`. Returns false if one of them decays too fast for such steps.
    fn find_solvers(&mut self, h: f64) -> bool {
        if self.length == Some(h) {
            return true;
        }
        self.length = None;
        self.solvers.clear();
        for oscillator in &self.oscillators {
            let Some(solver) = Solver::new(oscillator, &self.tableau, h) else { return false };
            self.solvers.push(solver);
        }
        self.length = Some(h);
        true
    }

    /// Sets the states at the nodes from the polynomials of the last step, or from constant g.
    fn guess(&mut self, h: f64, continued: Option<f64>) {
        /// Largest ratio of lengths over which the polynomials of a step are extended.
        const EXTENDED: f64 = 1.1;
        match continued.filter(|before| h <= EXTENDED * before) {
            Some(before) => {
                for i in 1..NODES {
                    let t = 1.0 + (self.tableau.nodes[i] + 1.0) * h / before;
                    let target = &mut self.remainders[i];
                    target.fill(0.0);
                    for powers in self.powers.iter().rev() {
                        target.iter_mut().zip(powers).for_each(|(y, c)| *y = *y * t + c);
                    }
                }
            }
            None => {
                let (first, others) = self.remainders.split_at_mut(1);
                others.iter_mut().for_each(|other| other.copy_from_slice(&first[0]));
            }
        }
    }

    /// Iterates states and g at the nodes; `None` if they do not contract.
    fn iterate(&mut self, system: &mut dyn System, time: f64, h: f64) -> Option<()> {
        self.solve(h);
        let (mut earlier, mut before) = (None, None::<f64>);
        for _ in 0..MOST_ITERATIONS {
            for i in 1..NODES {
                let at = time + 0.5 * h * (self.tableau.nodes[i] + 1.0);
                self.evaluate(system, i, at).ok()?;
            }
            let change = self.solve(h) / self.tolerance;
            let ratio = match before {
                Some(before) => Some(change.max(LEAST_SEEN) / before),
                None => self.contraction.map(|contraction| contraction * h),
            };
            if before.is_some() {
                let worst = self.contraction.map_or(0.0, |contraction| 0.5 * contraction * h);
                self.contraction = ratio.map(|ratio| ratio.max(worst).min(1.0) / h);
            }
            let is_solved = |ratio: f64| change <= SEEN_BY_WORK && change * ratio <= ITERATED;
            if change == 0.0 || ratio.is_some_and(is_solved) {
                return Some(());
            }
            // Coordinates and momenta correct each other in turn: two changes together tell of the iteration.
            if !change.is_finite() || earlier.is_some_and(|earlier: f64| change > MAX_CONTRACTION * earlier) {
                return None;
            }
            (earlier, before) = (before, Some(change));
        }
        None
    }

    /// Computes g at a node: the rates there without those of the oscillators.
    fn evaluate(&mut self, system: &mut dyn System, node: usize, time: f64) -> Result<(), Failure> {
        let (z, g) = (&self.states[node], &mut self.remainders[node]);
        self.physical.copy_from_slice(z);
        system.leave_oscillators(&mut self.physical);
        self.work.rates += 1;
        system.rates(time, &self.physical, g)?;
        system.enter_oscillators(g);
        let mut power = 0.0;
        for oscillator in &self.oscillators {
            let (x, p) = (oscillator.coordinate, oscillator.momentum);
            g[x] -= z[p];
            g[p] += oscillator.stiffness * z[x] + oscillator.damping * z[p];
            power += z[p] * g[p] + oscillator.stiffness * z[x] * g[x] - oscillator.damping * z[p] * z[p];
        }
        self.power[node] = power;
        Ok(())
    }

    /// Computes the states at the nodes from g; returns the root mean square of their change in scales.
    fn solve(&mut self, h: f64) -> f64 {
        let (mut sum, half) = (0.0, 0.5 * h);
        for &at in &self.plain {
            let g: [f64; NODES] = std::array::from_fn(|j| self.remainders[j][at]);
            let first = self.states[0][at];
            for i in 1..NODES {
                let next = first + half * dot(&self.tableau.integrals[i], &g);
                // The work is that of the states before, and needs no iteration.
                if self.work_entry != Some(at) {
                    sum += ((next - self.states[i][at]) / self.scales[at]).powi(2);
                }
                self.states[i][at] = next;
            }
        }
        for (one, solver) in self.oscillators.iter().zip(&self.solvers) {
            let (x, p) = (one.coordinate, one.momentum);
            let g: Pairs =
                std::array::from_fn(|j| Vector2::new(self.remainders[j][x], self.remainders[j][p]));
            let first = Vector2::new(self.states[0][x], self.states[0][p]);
            let found = solver.states(one, &self.tableau, h, &first, &g);
            for (i, next) in found.iter().enumerate().skip(1) {
                sum += ((next[0] - self.states[i][x]) / self.scales[x]).powi(2)
                    + ((next[1] - self.states[i][p]) / self.scales[p]).powi(2);
                (self.states[i][x], self.states[i][p]) = (next[0], next[1]);
            }
        }
        (sum / ((NODES - 1) * self.scales.len()) as f64).sqrt()
    }

    /// Returns the root mean square of the effect of the coefficient of degree 7 of g, in scales and relative to the
    /// tolerance.
    fn error(&self, h: f64) -> f64 {
        let top = |at: usize| {
            // The work without that of the oscillators.
            let own = if self.work_entry == Some(at) { 1.0 } else { 0.0 };
            let g: [f64; NODES] = std::array::from_fn(|j| self.remainders[j][at] - own * self.power[j]);
            dot(&self.tableau.powers[NODES - 1], &g).abs() / TOP
        };
        let of_plain = |at: &usize| (0.5 * h * INTEGRAL_OF_TOP * top(*at) / self.scales[*at]).powi(2);
        // An oscillator that is fast beside the polynomial follows it statically.
        let of_oscillator = |oscillator: &Oscillator| {
            let rate = oscillator.stiffness.sqrt();
            let reach = (0.5 * h * INTEGRAL_OF_TOP).min(1.0 / rate);
            2.0 * ((top(oscillator.momentum) + rate * top(oscillator.coordinate)) * reach
                / self.scales[oscillator.momentum])
                .powi(2)
        };
        let sum = self.plain.iter().map(of_plain).sum::<f64>()
            + self.oscillators.iter().map(of_oscillator).sum::<f64>();
        (sum / self.scales.len() as f64).sqrt() / self.tolerance
    }

    /// Computes the polynomials of g, and that of the power of the oscillators.
    fn find_powers(&mut self) {
        for (power, row) in self.powers.iter_mut().zip(&self.tableau.powers) {
            power.fill(0.0);
            for (weight, g) in row.iter().zip(&self.remainders) {
                power.iter_mut().zip(g).for_each(|(power, g)| *power += weight * g);
            }
        }
        if let Some(work) = self.work_entry {
            for (coefficients, row) in self.powers.iter_mut().zip(&self.tableau.powers) {
                coefficients[work] -= dot(row, &self.power);
            }
        }
    }

    /// Writes the state at the last node.
    fn end(&self, system: &dyn System, h: f64, state: &mut [f64]) {
        state.copy_from_slice(&self.states[NODES - 1]);
        if let Some(work) = self.work_entry {
            let gained = self.energy(state) - self.energy(&self.states[0]);
            state[work] += gained - 0.5 * h * dot(&self.tableau.integrals[NODES - 1], &self.power);
        }
        system.leave_oscillators(state);
        system.settle(state);
    }

    /// Returns the energy of the oscillators in a state in their coordinates.
    fn energy(&self, z: &[f64]) -> f64 {
        let of = |oscillator: &Oscillator| {
            0.5 * (z[oscillator.momentum].powi(2) + oscillator.stiffness * z[oscillator.coordinate].powi(2))
        };
        self.oscillators.iter().map(of).sum()
    }

    /// Computes the state at `time` within the last step.
    ///
    /// # Panics
    /// When no step was taken.
    pub(super) fn interpolate(&self, system: &dyn System, time: f64, state: &mut [f64]) {
        let [start, _, h] = self.last.expect("a step was taken");
        let t = 2.0 * (time - start) / h - 1.0;
        // Integrals of the powers from -1 to t.
        let mut integrals = [0.0; NODES];
        let (mut above, mut below) = (1.0, 1.0);
        for (n, integral) in integrals.iter_mut().enumerate() {
            (above, below) = (above * t, -below);
            *integral = 0.5 * h * (above - below) / (n + 1) as f64;
        }
        let first = &self.states[0];
        state.copy_from_slice(first);
        for &at in &self.plain {
            state[at] += self.powers.iter().zip(&integrals).map(|(power, w)| power[at] * w).sum::<f64>();
        }
        for oscillator in &self.oscillators {
            let (x, p) = (oscillator.coordinate, oscillator.momentum);
            let powers: Pairs = std::array::from_fn(|n| Vector2::new(self.powers[n][x], self.powers[n][p]));
            let begun = Vector2::new(first[x], first[p]);
            let z = forced(oscillator, &self.tableau, h, t, &begun, &powers);
            (state[x], state[p]) = (z[0], z[1]);
        }
        if let Some(work) = self.work_entry {
            state[work] += self.energy(state) - self.energy(first);
        }
        system.leave_oscillators(state);
        system.settle(state);
    }

    /// Returns the number of points in the last step through whose parabolas the oscillators are seen to [`SEEN`].
    ///
    /// The peak of a parabola through three points of cos(w t) at distances of D is off by about (w D)^4 / 128. An amplitude
    /// counts as that of its acceleration beside the slowest oscillator.
    pub(super) fn points(&self) -> f64 {
        let Some(h) = self.length else { return 0.0 };
        let rates = self.oscillators.iter().map(|oscillator| oscillator.stiffness.sqrt());
        let slowest = rates.filter(|rate| *rate > 0.0).fold(f64::INFINITY, f64::min);
        let points = |oscillator: &Oscillator| {
            let (x, p, rate) = (oscillator.coordinate, oscillator.momentum, oscillator.stiffness.sqrt());
            let mut z = Vector2::new(self.states[0][x], self.states[0][p]);
            if is_stiff(oscillator, h) {
                let powers: Pairs =
                    std::array::from_fn(|n| Vector2::new(self.powers[n][x], self.powers[n][p]));
                z -= value(&particular(oscillator, h, &powers), -1.0);
            }
            let amplitude = hypot(z[1], rate * z[0]) / self.scales[p] * (rate / slowest);
            h * rate * pow(amplitude / (128.0 * SEEN), 0.25)
        };
        self.oscillators.iter().map(points).fold(0.0, f64::max)
    }
}

fn dot(a: &[f64; NODES], b: &[f64; NODES]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Pairs (x, p) of an oscillator: by nodes, or by powers of t.
type Pairs = [Vector2<f64>; NODES];

/// Returns the slowest and the fastest rate of an oscillator.
fn rates_of(one: &Oscillator) -> (f64, f64) {
    let (rate, decay) = (one.stiffness.max(0.0).sqrt(), 0.5 * one.damping);
    if decay <= rate {
        return (rate, rate);
    }
    let fast = decay + (decay * decay - one.stiffness).max(0.0).sqrt();
    (one.stiffness.max(0.0) / fast, fast)
}

/// Returns true if the particular solution over a step of length `h` is computed as a polynomial.
fn is_stiff(one: &Oscillator, h: f64) -> bool {
    h * rates_of(one).0 >= STIFF
}

/// Returns the free motion over a time: (x, p) from (x, p).
fn free(one: &Oscillator, time: f64) -> Matrix2<f64> {
    let decay = 0.5 * one.damping;
    let [c, s] = free_oscillation(one.stiffness, decay, time);
    Matrix2::new(c + s * decay, s, -one.stiffness * s, c - s * decay)
}

/// Returns the coefficients of the polynomial z with (2/h) dz/dt = L z + g, for the coefficients of g.
fn particular(one: &Oscillator, h: f64, g: &Pairs) -> Pairs {
    let mut z = [Vector2::zeros(); NODES];
    let mut above = Vector2::zeros();
    for n in (0..NODES).rev() {
        // L z_n = (2 / h) (n + 1) z_(n+1) - g_n, with L = (0, 1; -k, -d).
        let side = above * (2.0 / h * (n + 1) as f64) - g[n];
        let p = side[0];
        z[n] = Vector2::new(-(side[1] + one.damping * p) / one.stiffness, p);
        above = z[n];
    }
    z
}

/// Returns the value of a polynomial at t.
fn value(coefficients: &Pairs, t: f64) -> Vector2<f64> {
    coefficients.iter().rev().fold(Vector2::zeros(), |sum, c| sum * t + c)
}

/// Returns the oscillator at t in a step of length `h` from `first` under the polynomial g with the given coefficients.
fn forced(
    one: &Oscillator,
    tableau: &Tableau,
    h: f64,
    t: f64,
    first: &Vector2<f64>,
    g: &Pairs,
) -> Vector2<f64> {
    let passed = 0.5 * h * (t + 1.0);
    if is_stiff(one, h) {
        let z = particular(one, h, g);
        return free(one, passed) * (first - value(&z, -1.0)) + value(&z, t);
    }
    let mut sum = free(one, passed) * first;
    tableau.quadrature(one, h, t, |s, weight| sum += weight * value(g, s));
    sum
}

impl Solver {
    /// Returns `None` for an oscillator that decays too fast for a step of length `h`.
    fn new(one: &Oscillator, tableau: &Tableau, h: f64) -> Option<Self> {
        let passed = |i: usize| 0.5 * h * (tableau.nodes[i] + 1.0);
        let motions = std::array::from_fn(|i| free(one, passed(i)));
        if is_stiff(one, h) {
            return Some(Self { motions, weights: None });
        }
        if panels(one, h) > MOST_PANELS {
            return None;
        }
        let mut weights = Box::new([[Matrix2::zeros(); NODES]; NODES]);
        for (row, &node) in weights.iter_mut().zip(&tableau.nodes) {
            tableau.quadrature(one, h, node, |s, weight| {
                for (sum, lagrange) in row.iter_mut().zip(tableau.lagrange(s)) {
                    *sum += weight * lagrange;
                }
            });
        }
        Some(Self { motions, weights: Some(weights) })
    }

    /// Returns the oscillator at the nodes, for g at the nodes.
    fn states(&self, one: &Oscillator, tableau: &Tableau, h: f64, first: &Vector2<f64>, g: &Pairs) -> Pairs {
        let Some(weights) = &self.weights else {
            let powers = std::array::from_fn(|n| {
                g.iter().zip(&tableau.powers[n]).fold(Vector2::zeros(), |sum, (g, w)| sum + g * *w)
            });
            let z = particular(one, h, &powers);
            let free = first - value(&z, -1.0);
            return std::array::from_fn(|i| self.motions[i] * free + value(&z, tableau.nodes[i]));
        };
        std::array::from_fn(|i| {
            g.iter().zip(&weights[i]).fold(self.motions[i] * first, |sum, (g, weight)| sum + weight * g)
        })
    }
}

/// Returns the number of quadratures that a step of length `h` is divided into for an oscillator.
fn panels(one: &Oscillator, h: f64) -> usize {
    (h * rates_of(one).1 / STIFF).ceil().max(1.0) as usize
}

impl Tableau {
    fn new() -> Self {
        let degree = NODES - 1;
        // Ends, and the roots of P', by Newton's method with (1 - t^2) P'' = 2 t P' - n (n + 1) P.
        let node = |i: usize| {
            let mut t = -cos(std::f64::consts::PI * i as f64 / degree as f64);
            if i == 0 || i == degree {
                return t.signum();
            }
            for _ in 0..20 {
                let (p, slope) = legendre(degree, t);
                let bend = (2.0 * t * slope - (degree * NODES) as f64 * p) / (1.0 - t * t);
                t -= slope / bend;
            }
            t
        };
        let nodes: [f64; NODES] = std::array::from_fn(node);
        let weights = nodes.map(|t| 2.0 / ((degree * NODES) as f64 * legendre(degree, t).0.powi(2)));
        // Coefficients of the Lagrange polynomials, by products of their factors.
        let mut powers = [[0.0; NODES]; NODES];
        for j in 0..NODES {
            let mut product = [0.0; NODES];
            product[0] = 1.0;
            for k in (0..NODES).filter(|&k| k != j) {
                let scale = 1.0 / (nodes[j] - nodes[k]);
                for n in (0..NODES).rev() {
                    let below = if n > 0 { product[n - 1] } else { 0.0 };
                    product[n] = (below - nodes[k] * product[n]) * scale;
                }
            }
            (0..NODES).for_each(|n| powers[n][j] = product[n]);
        }
        let integral = |i: usize, j: usize| {
            let part = |n: usize| {
                let m = n as i32 + 1;
                powers[n][j] * (nodes[i].powi(m) - (-1.0f64).powi(m)) / f64::from(m)
            };
            (0..NODES).map(part).sum::<f64>()
        };
        let mut integrals: [[f64; NODES]; NODES] =
            std::array::from_fn(|i| std::array::from_fn(|j| integral(i, j)));
        integrals[NODES - 1] = weights;
        Self { nodes, integrals, powers, quadrature: gauss_points() }
    }

    /// Returns the Lagrange polynomials at t.
    fn lagrange(&self, t: f64) -> [f64; NODES] {
        std::array::from_fn(|j| (0..NODES).rev().fold(0.0, |sum, n| sum * t + self.powers[n][j]))
    }

    /// Passes the points s of the integral of R((t - s) h / 2) g(s) h / 2 from -1 to t with the weights of g, where R is the
    /// free motion.
    fn quadrature(&self, one: &Oscillator, h: f64, t: f64, mut see: impl FnMut(f64, Matrix2<f64>)) {
        let count = panels(one, h);
        let width = (t + 1.0) / count as f64;
        for panel in 0..count {
            for &(point, weight) in &self.quadrature {
                let s = -1.0 + width * (panel as f64 + 0.5 * (point + 1.0));
                see(s, free(one, 0.5 * h * (t - s)) * (0.25 * h * width * weight));
            }
        }
    }
}

/// Returns the Legendre polynomial of a degree and its slope at t, inside of -1 to 1.
fn legendre(degree: usize, t: f64) -> (f64, f64) {
    let (mut before, mut now) = (1.0, t);
    for n in 1..degree {
        let n = n as f64;
        (before, now) = (now, ((2.0 * n + 1.0) * t * now - n * before) / (n + 1.0));
    }
    (now, degree as f64 * (before - t * now) / (1.0 - t * t))
}

/// Returns points and weights of Gauss-Legendre quadrature.
fn gauss_points() -> [(f64, f64); POINTS] {
    std::array::from_fn(|i| {
        let mut t = -cos(std::f64::consts::PI * (i as f64 + 0.75) / (POINTS as f64 + 0.5));
        for _ in 0..20 {
            let (p, slope) = legendre(POINTS, t);
            t -= p / slope;
        }
        let slope = legendre(POINTS, t).1;
        (t, 2.0 / ((1.0 - t * t) * slope * slope))
    })
}
