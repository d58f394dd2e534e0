//! Explicit Runge-Kutta steps of order 8 with error control.

use super::{Failure, System, Work};
use libm::{exp2, log2, pow};

/// Safety factor: the next step is chosen for an error of this part of the tolerance.
const STEP_SAFETY_FACTOR: f64 = 0.9;

/// Smallest factor of the step length from one attempt to the next.
const MIN_STEP_FACTOR: f64 = 1.0 / 3.0;
/// Largest factor of the step length from one step to the next.
const MAX_STEP_FACTOR: f64 = 6.0;

/// Number of step lengths per factor of two. The step control chooses among the lengths h 2^(k / 16), where h is the
/// first one, so that rounding does not change the choice. Where stability limits the steps, a control with
/// continuous lengths is chaotic: rounding of 1e-16 grew to the tolerance within some hundred steps, and with it
/// differences between processors. A smaller number takes more steps (16: 2 % more, 4: 9 %).
const LENGTHS_PER_OCTAVE: f64 = 16.0;

/// Step length, relative to the time, below which a step does not advance the time.
const SMALLEST: f64 = 16.0 * f64::EPSILON;

/// Method of Dormand and Prince of order 8 with step control, DOP853 of Hairer, Norsett and Wanner (Solving
/// Ordinary Differential Equations I, II.5 and II.10), with their interpolation of order 7.
///
/// A step is accepted if the root mean square over the entries of error / scale is at most the tolerance,
/// where the error is h e5^2 / sqrt(e5^2 + 0.01 e3^2) of the embedded solutions of order 5 and 3. Undamped
/// oscillations are stable up to about h omega = 6; the step control finds this limit. Step lengths are those of a
/// fixed grid.
#[derive(Debug, Clone)]
pub struct Explicit {
    tolerance: f64,
    longest: f64,
    /// Longest step from a state whose rates are all zero.
    longest_at_rest: f64,
    /// Unit of the grid of step lengths.
    unit: Option<f64>,
    /// Length proposed by the step control for the next step.
    proposed: Option<f64>,
    /// Rates of the stages.
    rates: Vec<Vec<f64>>,
    before: Vec<f64>,
    /// State of a stage.
    stage: Vec<f64>,
    scales: Vec<f64>,
    /// Start, end and length of the last step, whose rates serve the next step and interpolation.
    last: Option<[f64; 3]>,
    /// Coefficients of the interpolation.
    polynomial: Vec<Vec<f64>>,
    interpolates: bool,
    work: Work,
}

impl Explicit {
    /// Creates the method for `dimension` entries, with steps of at most `longest` and an error below
    /// `tolerance` times the scales of the system.
    ///
    /// # Panics
    /// When the tolerance or the longest step is not positive.
    pub fn new(dimension: usize, tolerance: f64, longest: f64) -> Self {
        assert!(tolerance > 0.0 && longest > 0.0, "a positive tolerance and step");
        let zeros = || vec![0.0; dimension];
        Self {
            tolerance,
            longest,
            longest_at_rest: longest,
            unit: None,
            proposed: None,
            rates: vec![zeros(); ALL_STAGES],
            before: zeros(),
            stage: zeros(),
            scales: zeros(),
            last: None,
            polynomial: vec![zeros(); 7],
            interpolates: false,
            work: Work::default(),
        }
    }

    /// Allows steps of at most `longest` from a state at rest, whose rates are all zero: no oscillation limits them. A step
    /// in which something begins to move is judged by its stages, as any other.
    pub fn longest_at_rest(self, longest: f64) -> Self {
        Self { longest_at_rest: longest, ..self }
    }

    /// Returns the longest step, and the longest one from rest.
    pub(super) fn longest_steps(&self) -> (f64, f64) {
        (self.longest, self.longest_at_rest)
    }

    pub(super) fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// Returns the length of the last step; zero without one.
    pub(super) fn last_length(&self) -> f64 {
        self.last.map_or(0.0, |[_, _, h]| h)
    }

    /// Returns the work done so far.
    pub fn work(&self) -> Work {
        self.work
    }

    /// Discards the last step, because f or the state jumps here.
    pub fn restart(&mut self) {
        (self.proposed, self.last) = (None, None);
    }

    /// Takes one step from `time`, at most to `end`, and returns its end.
    ///
    /// # Errors
    /// [`Failure::StepTooSmall`]; the failures of the system at the state itself.
    ///
    /// # Panics
    /// When the state has another number of entries.
    pub fn step(
        &mut self,
        system: &mut dyn System,
        time: f64,
        state: &mut [f64],
        end: f64,
    ) -> Result<f64, Failure> {
        self.before.copy_from_slice(state);
        system.scales(state, &mut self.scales);
        if self.last.is_some_and(|[_, until, _]| until == time) {
            self.rates.swap(0, STAGES);
        } else {
            self.stage.copy_from_slice(state);
            self.evaluate(system, 0, time, 0.0)?;
        }
        let mut length = match self.proposed {
            Some(length) => length,
            None => {
                let first = self.first_length(system, time, end - time)?;
                // A step to the end has any length: breaks may be a few roundings apart.
                if first >= end - time { first } else { self.on_grid(first) }
            }
        };
        let rests = self.rates[0].iter().all(|rate| *rate == 0.0);
        let longest = if rests { self.longest_at_rest } else { self.longest };
        let mut grow = MAX_STEP_FACTOR;
        loop {
            let left = end - time;
            let (h, until) = within(time, length.min(longest), end);
            // Breaks may be one rounding apart: the interval between them is one step of any length.
            let too_short = h <= SMALLEST * time.abs() && h < left;
            if h.is_nan() || too_short {
                return Err(Failure::StepTooSmall { time });
            }
            let error = match self.attempt(system, time, h) {
                Ok(error) => error,
                // No rates at a stage: the next attempt is shorter and closer to the valid state.
                Err(Failure::Rates { .. }) => f64::INFINITY,
                Err(failure) => return Err(failure),
            };
            let factor = (STEP_SAFETY_FACTOR * pow(error, -1.0 / 8.0)).clamp(MIN_STEP_FACTOR, grow);
            if error <= 1.0 {
                let next = self.on_grid(h * factor);
                self.proposed = Some(if h < length { length.max(next) } else { next });
                state.copy_from_slice(&self.stage);
                system.settle(state);
                self.stage.copy_from_slice(state);
                self.evaluate(system, STAGES, until, 0.0)?;
                (self.last, self.interpolates) = (Some([time, until, h]), false);
                self.work.steps += 1;
                return Ok(until);
            }
            self.work.rejected += 1;
            // NaN shrinks the step too.
            length = self.on_grid(h * if factor < 1.0 { factor } else { MIN_STEP_FACTOR });
            grow = 1.0;
        }
    }

    /// Returns the largest length of the grid up to `length`. The first length is the unit of the grid.
    fn on_grid(&mut self, length: f64) -> f64 {
        on_grid(*self.unit.get_or_insert(length), length, LENGTHS_PER_OCTAVE)
    }

    /// Computes the state at `time` within the last step, with order 7.
    ///
    /// # Errors
    /// The failures of the system.
    ///
    /// # Panics
    /// When no step was taken since the start.
    pub fn interpolate(
        &mut self,
        system: &mut dyn System,
        time: f64,
        after: &[f64],
        state: &mut [f64],
    ) -> Result<(), Failure> {
        let [start, _, h] = self.last.expect("a step was taken");
        if !self.interpolates {
            for index in STAGES + 1..ALL_STAGES {
                self.combine(index, h);
                self.evaluate(system, index, start, h)?;
            }
            for (i, (before, after)) in self.before.iter().zip(after).enumerate() {
                let (change, first, last) = (after - before, h * self.rates[0][i], h * self.rates[STAGES][i]);
                self.polynomial[0][i] = change;
                self.polynomial[1][i] = first - change;
                self.polynomial[2][i] = 2.0 * change - first - last;
                for (row, weights) in INTERPOLATION.iter().enumerate() {
                    self.polynomial[3 + row][i] = h * self.weighted(weights, i);
                }
            }
            self.interpolates = true;
        }
        let x = (time - start) / h;
        state.fill(0.0);
        for (power, coefficients) in self.polynomial.iter().enumerate().rev() {
            let factor = if power % 2 == 0 { x } else { 1.0 - x };
            state.iter_mut().zip(coefficients).for_each(|(y, c)| *y = (*y + c) * factor);
        }
        state.iter_mut().zip(&self.before).for_each(|(y, before)| *y += before);
        system.settle(state);
        Ok(())
    }

    /// Computes `self.stage` of a step of length `h` from `self.before`.
    fn combine(&mut self, index: usize, h: f64) {
        self.stage.copy_from_slice(&self.before);
        for &(j, a) in A[index] {
            let weight = h * a;
            self.stage.iter_mut().zip(&self.rates[j]).for_each(|(y, rate)| *y += weight * rate);
        }
    }

    fn evaluate(&mut self, system: &mut dyn System, index: usize, start: f64, h: f64) -> Result<(), Failure> {
        self.work.rates += 1;
        system.rates(start + C[index] * h, &self.stage, &mut self.rates[index])
    }

    fn weighted(&self, weights: &[(usize, f64)], i: usize) -> f64 {
        weights.iter().map(|&(j, weight)| weight * self.rates[j][i]).sum()
    }

    /// Writes the state after a step to `self.stage`; returns its error relative to the tolerance.
    fn attempt(&mut self, system: &mut dyn System, time: f64, h: f64) -> Result<f64, Failure> {
        for index in 1..STAGES {
            self.combine(index, h);
            self.evaluate(system, index, time, h)?;
        }
        self.combine(STAGES, h);
        let (mut e5, mut e3) = (0.0, 0.0);
        for (i, scale) in self.scales.iter().enumerate() {
            e5 += (self.weighted(ERROR_5, i) / scale).powi(2);
            e3 += (self.weighted(ERROR_3, i) / scale).powi(2);
        }
        if e5 == 0.0 && e3 == 0.0 {
            return Ok(0.0);
        }
        Ok(h * e5 / ((e5 + 0.01 * e3) * self.scales.len() as f64).sqrt() / self.tolerance)
    }

    /// Returns a first step length from the rate of the state and the rate of change of that rate, in the
    /// time unit that both define.
    fn first_length(&mut self, system: &mut dyn System, time: f64, left: f64) -> Result<f64, Failure> {
        let scales = std::mem::take(&mut self.scales);
        let size = |of: &dyn Fn(usize) -> f64| {
            let sum: f64 = scales.iter().enumerate().map(|(i, scale)| (of(i) / scale).powi(2)).sum();
            (sum / scales.len() as f64).sqrt()
        };
        let longest = self.longest.min(left);
        let speed = size(&|i| self.rates[0][i]);
        let probe = if speed > 0.0 { (0.01 / speed).min(longest) } else { 1e-6 * longest };
        for (i, y) in self.stage.iter_mut().enumerate() {
            *y = self.before[i] + probe * self.rates[0][i];
        }
        let probed = self.evaluate(system, 1, time + probe, 0.0);
        let change = size(&|i| self.rates[1][i] - self.rates[0][i]) / probe;
        self.scales = scales;
        let pace = speed.max(change.sqrt());
        Ok(match probed {
            Ok(()) if pace > 0.0 && pace.is_finite() => (pow(self.tolerance, 1.0 / 8.0) / pace).min(longest),
            Ok(()) if pace == 0.0 => longest,
            _ => probe,
        })
    }
}

/// Returns the largest length unit 2^(k / per_octave) up to `length`. A length of the grid is itself, whatever its rounding.
pub(super) fn on_grid(unit: f64, length: f64, per_octave: f64) -> f64 {
    const ROUNDING: f64 = 1e-9;
    let octaves = log2(length / unit);
    unit * exp2((per_octave * octaves + ROUNDING).floor() / per_octave)
}

/// Returns length and end of a step of `length` from `time`, at most to `end`: a remainder too short for a step of its own is
/// split between two steps.
pub(super) fn within(time: f64, length: f64, end: f64) -> (f64, f64) {
    let left = end - time;
    match length {
        h if h >= left * (1.0 - SMALLEST) => (left, end),
        h if 2.0 * h > left => (0.5 * left, time + 0.5 * left),
        h => (h, time + h),
    }
}

// Coefficients of the method of Dormand and Prince of order 8 with estimates of order 5 and 3 and
// interpolation of order 7 (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, second
// edition, II.5 and II.6; DOP853).

/// Number of stages of a step. One more stage is the rate at its end, three more serve the interpolation.
const STAGES: usize = 12;

/// Number of stages including those of the interpolation.
const ALL_STAGES: usize = 16;

/// Time of every stage, relative to the step.
const C: [f64; ALL_STAGES] = [
    0.0,
    0.05260015195876773,
    0.0789002279381516,
    0.1183503419072274,
    0.2816496580927726,
    0.3333333333333333,
    0.25,
    0.3076923076923077,
    0.6512820512820513,
    0.6,
    0.8571428571428571,
    1.0,
    1.0,
    0.1,
    0.2,
    0.7777777777777778,
];

/// Index and weight of the rates in each stage; stage 12 is the solution of order 8.
const A: [&[(usize, f64)]; ALL_STAGES] = [
    &[],
    &[(0, 0.05260015195876773)],
    &[(0, 0.0197250569845379), (1, 0.0591751709536137)],
    &[(0, 0.02958758547680685), (2, 0.08876275643042054)],
    &[(0, 0.2413651341592667), (2, -0.8845494793282861), (3, 0.924834003261792)],
    &[(0, 0.037037037037037035), (3, 0.17082860872947386), (4, 0.12546768756682242)],
    &[(0, 0.037109375), (3, 0.17025221101954405), (4, 0.06021653898045596), (5, -0.017578125)],
    &[
        (0, 0.03709200011850479),
        (3, 0.17038392571223998),
        (4, 0.10726203044637328),
        (5, -0.015319437748624402),
        (6, 0.008273789163814023),
    ],
    &[
        (0, 0.6241109587160757),
        (3, -3.3608926294469414),
        (4, -0.868219346841726),
        (5, 27.59209969944671),
        (6, 20.154067550477894),
        (7, -43.48988418106996),
    ],
    &[
        (0, 0.47766253643826434),
        (3, -2.4881146199716677),
        (4, -0.590290826836843),
        (5, 21.230051448181193),
        (6, 15.279233632882423),
        (7, -33.28821096898486),
        (8, -0.020331201708508627),
    ],
    &[
        (0, -0.9371424300859873),
        (3, 5.186372428844064),
        (4, 1.0914373489967295),
        (5, -8.149787010746927),
        (6, -18.52006565999696),
        (7, 22.739487099350505),
        (8, 2.4936055526796523),
        (9, -3.0467644718982196),
    ],
    &[
        (0, 2.273310147516538),
        (3, -10.53449546673725),
        (4, -2.0008720582248625),
        (5, -17.9589318631188),
        (6, 27.94888452941996),
        (7, -2.8589982771350235),
        (8, -8.87285693353063),
        (9, 12.360567175794303),
        (10, 0.6433927460157636),
    ],
    &[
        (0, 0.054293734116568765),
        (5, 4.450312892752409),
        (6, 1.8915178993145003),
        (7, -5.801203960010585),
        (8, 0.3111643669578199),
        (9, -0.1521609496625161),
        (10, 0.20136540080403034),
        (11, 0.04471061572777259),
    ],
    &[
        (0, 0.056167502283047954),
        (6, 0.25350021021662483),
        (7, -0.2462390374708025),
        (8, -0.12419142326381637),
        (9, 0.15329179827876568),
        (10, 0.00820105229563469),
        (11, 0.007567897660545699),
        (12, -0.008298),
    ],
    &[
        (0, 0.03183464816350214),
        (5, 0.028300909672366776),
        (6, 0.053541988307438566),
        (7, -0.05492374857139099),
        (10, -0.00010834732869724932),
        (11, 0.0003825710908356584),
        (12, -0.00034046500868740456),
        (13, 0.1413124436746325),
    ],
    &[
        (0, -0.42889630158379194),
        (5, -4.697621415361164),
        (6, 7.683421196062599),
        (7, 4.06898981839711),
        (8, 0.3567271874552811),
        (12, -0.0013990241651590145),
        (13, 2.9475147891527724),
        (14, -9.15095847217987),
    ],
];

/// Weights of the error of the solution of order 5.
const ERROR_5: &[(usize, f64)] = &[
    (0, 0.01312004499419488),
    (5, -1.2251564463762044),
    (6, -0.4957589496572502),
    (7, 1.6643771824549864),
    (8, -0.35032884874997366),
    (9, 0.3341791187130175),
    (10, 0.08192320648511571),
    (11, -0.022355307863886294),
];

/// Weights of the error of the solution of order 3.
const ERROR_3: &[(usize, f64)] = &[
    (0, -0.18980075407240762),
    (5, 4.450312892752409),
    (6, 1.8915178993145003),
    (7, -5.801203960010585),
    (8, -0.4226823213237919),
    (9, -0.1521609496625161),
    (10, 0.20136540080403034),
    (11, 0.02265179219836082),
];

/// The upper four coefficients of the interpolation.
const INTERPOLATION: [&[(usize, f64)]; 4] = [
    &[
        (0, -8.428938276109013),
        (5, 0.5667149535193777),
        (6, -3.0689499459498917),
        (7, 2.38466765651207),
        (8, 2.117034582445028),
        (9, -0.871391583777973),
        (10, 2.2404374302607883),
        (11, 0.6315787787694688),
        (12, -0.08899033645133331),
        (13, 18.148505520854727),
        (14, -9.194632392478356),
        (15, -4.436036387594894),
    ],
    &[
        (0, 10.427508642579134),
        (5, 242.28349177525817),
        (6, 165.20045171727028),
        (7, -374.5467547226902),
        (8, -22.113666853125306),
        (9, 7.733432668472264),
        (10, -30.674084731089398),
        (11, -9.332130526430229),
        (12, 15.697238121770845),
        (13, -31.139403219565178),
        (14, -9.35292435884448),
        (15, 35.81684148639408),
    ],
    &[
        (0, 19.985053242002433),
        (5, -387.0373087493518),
        (6, -189.17813819516758),
        (7, 527.8081592054236),
        (8, -11.57390253995963),
        (9, 6.8812326946963),
        (10, -1.0006050966910838),
        (11, 0.7777137798053443),
        (12, -2.778205752353508),
        (13, -60.19669523126412),
        (14, 84.32040550667716),
        (15, 11.99229113618279),
    ],
    &[
        (0, -25.69393346270375),
        (5, -154.18974869023643),
        (6, -231.5293791760455),
        (7, 357.6391179106141),
        (8, 93.40532418362432),
        (9, -37.45832313645163),
        (10, 104.0996495089623),
        (11, 29.8402934266605),
        (12, -43.53345659001114),
        (13, 96.32455395918828),
        (14, -39.17726167561544),
        (15, -149.72683625798564),
    ],
];
