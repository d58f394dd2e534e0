//! Explicit Runge-Kutta steps of order 8 with error control.

use super::dormand_prince::{A, ALL_STAGES, C, ERROR_3, ERROR_5, INTERPOLATION, STAGES};
use super::{Failure, System, Work};

/// Safety factor: the next step is chosen for an error of this part of the tolerance.
const STEP_SAFETY_FACTOR: f64 = 0.9;

/// Smallest factor of the step length from one attempt to the next.
const MIN_STEP_FACTOR: f64 = 1.0 / 3.0;
/// Largest factor of the step length from one step to the next.
const MAX_STEP_FACTOR: f64 = 6.0;

/// Step length, relative to the time, below which a step does not advance the time.
const SMALLEST: f64 = 16.0 * f64::EPSILON;

/// Method of Dormand and Prince of order 8 with step control, DOP853 of Hairer, Norsett and Wanner (Solving
/// Ordinary Differential Equations I, II.5 and II.10), with their interpolation of order 7.
///
/// A step is accepted if the root mean square over the entries of error / scale is at most the tolerance,
/// where the error is h e5^2 / sqrt(e5^2 + 0.01 e3^2) of the embedded solutions of order 5 and 3. Undamped
/// oscillations are stable up to about h omega = 6; the step control finds this limit.
#[derive(Debug, Clone)]
pub struct Explicit {
    tolerance: f64,
    longest: f64,
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
            None => self.first_length(system, time, end - time)?,
        };
        let mut grow = MAX_STEP_FACTOR;
        loop {
            // A remainder too short for a step of its own is split between two steps.
            let left = end - time;
            let (h, until) = match length.min(self.longest) {
                h if h >= left * (1.0 - SMALLEST) => (left, end),
                h if 2.0 * h > left => (0.5 * left, time + 0.5 * left),
                h => (h, time + h),
            };
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
            let factor = (STEP_SAFETY_FACTOR * error.powf(-1.0 / 8.0)).clamp(MIN_STEP_FACTOR, grow);
            if error <= 1.0 {
                self.proposed = Some(if h < length { length.max(h * factor) } else { h * factor });
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
            length = h * if factor < 1.0 { factor } else { MIN_STEP_FACTOR };
            grow = 1.0;
        }
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
            Ok(()) if pace > 0.0 && pace.is_finite() => (self.tolerance.powf(1.0 / 8.0) / pace).min(longest),
            Ok(()) if pace == 0.0 => longest,
            _ => probe,
        })
    }
}
