//! Systems of differential equations, and reasons for an integration to end early.

use super::stages::StageMode;
use flexbody_base::numbers::significant;
use libm::{exp, expm1, sincos};

/// System of ordinary differential equations y' = f(t, y).
pub trait System {
    /// Returns the number of entries of y.
    fn dimension(&self) -> usize;

    /// Computes f(t, y).
    ///
    /// # Errors
    /// [`Failure::Rates`] if the equations have no solution at this state; an integrator with error control
    /// then tries a shorter step.
    fn rates(&mut self, time: f64, state: &[f64], rates: &mut [f64]) -> Result<(), Failure>;

    /// Writes the scale of the error of each entry at this state: all positive, in the units of the entry.
    /// A tolerance is the largest root mean square of error / scale that a step may add.
    fn scales(&self, state: &[f64], scales: &mut [f64]);

    /// Returns the stiff part of the system that implicit steps solve without iteration; the default is
    /// empty.
    fn oscillators(&self) -> &[Oscillator] {
        &[]
    }

    /// Returns the entry of the work that the system takes up, including that of its oscillators; the default has none.
    fn work_entry(&self) -> Option<usize> {
        None
    }

    /// Writes the scales of entries that follow from the others, such as work and impulses, whose scales are infinite for steps
    /// that resolve every oscillation. The default has none.
    fn follower_scales(&self, _state: &[f64], _scales: &mut [f64]) {}

    /// Replaces a residual of the state by that in the coordinates of the [`Oscillator`]s. The default does nothing: the
    /// oscillators are entries of the state.
    fn enter_oscillators(&self, _residual: &mut [f64]) {}

    /// Replaces a residual in the coordinates of the oscillators by that of the state; the inverse of
    /// [`System::enter_oscillators`].
    fn leave_oscillators(&self, _residual: &mut [f64]) {}

    /// Filters the `residuals` of the stages of an implicit step of length h by a stiff linear part J
    /// of the system that is solved as a whole: replaces them by (I - h A kron J)^-1 `residuals`, with the
    /// matrix A of the method given by its eigenvalues. The default does nothing.
    ///
    /// Returns the root mean square of the corrections over the stages, relative to the motion, in a norm
    /// of the system. Such a norm is needed if entry-wise scales would weigh stiff and soft parts equally,
    /// although the stiff part is known less accurately. Returns `None` if the entry-wise scales are valid.
    ///
    /// # Errors
    /// Failures of the solution with the stiff part.
    fn correct_stages(
        &mut self,
        _h: f64,
        _modes: &[StageMode],
        _scales: &[f64],
        _residuals: &mut [Vec<f64>],
    ) -> Result<Option<f64>, Failure> {
        Ok(None)
    }

    /// Restores exact relations, such as the length of Euler parameters; called after every accepted step.
    fn settle(&self, _state: &mut [f64]) {}
}

/// Pair of entries with x' = p + ... and p' = -stiffness x - damping p + ..., where the other terms vary
/// slowly or little.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oscillator {
    /// Index of x.
    pub coordinate: usize,
    /// Index of p.
    pub momentum: usize,
    /// Square of the circular frequency.
    pub stiffness: f64,
    /// Decay rate of p.
    pub damping: f64,
}

/// Work of an integration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Work {
    /// Number of accepted steps.
    pub steps: u64,
    /// Number of rejected steps.
    pub rejected: u64,
    /// Number of evaluations of f(t, y).
    pub rates: u64,
}

/// Reason for an integration to fail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Failure {
    /// f(t, y) does not exist.
    Rates {
        /// Reason as a lowercase fragment of a sentence.
        reason: &'static str,
    },
    /// The state is no longer finite.
    NotFinite {
        /// End of the last good step.
        time: f64,
    },
    /// No step length that the time can resolve meets the tolerance.
    StepTooSmall {
        /// End of the last good step.
        time: f64,
    },
    /// The equations of an implicit step were not solved.
    NotConverged {
        /// Start of the step.
        time: f64,
        /// Length of the step.
        step: f64,
    },
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Rates { reason } => f.write_str(reason),
            Self::NotFinite { time } => {
                write!(f, "the state is no longer finite after t = {}", significant(*time, 6))
            }
            Self::StepTooSmall { time } => {
                write!(
                    f,
                    "the step that meets the tolerance at t = {} is too small for the resolution of time",
                    significant(*time, 6)
                )
            }
            Self::NotConverged { time, step } => {
                let [step, time] = [*step, *time].map(|value| significant(value, 6));
                write!(f, "the equations of the implicit step of {step} from t = {time} did not converge")
            }
        }
    }
}

impl std::error::Error for Failure {}

// Free motion of an oscillator with any damping.

/// Returns \[c, s\] of the free motion of x'' + 2 d x' + w^2 x = 0 over a time h, with which
///
/// ```text
/// x(h)  = c x + s (x' + d x)
/// x'(h) = c x' - s (w^2 x + d x')
/// ```
///
/// * `square`: w^2, not negative.
/// * `decay`: d; the motion oscillates for d < w, and is overdamped beyond.
/// * `step`: h, not negative.
pub fn free_oscillation(square: f64, decay: f64, step: f64) -> [f64; 2] {
    let difference = square - decay * decay;
    let root = difference.abs().sqrt();
    if difference > 0.0 {
        let (sin, cos) = sincos(root * step);
        let fades = exp(-decay * step);
        return [fades * cos, fades * sin / root];
    }
    // Slower decay rate, computed without the cancellation of d - root.
    let slow = square / (decay + root).max(f64::MIN_POSITIVE);
    let fades = exp(-slow * step);
    let faster = -expm1(-2.0 * root * step);
    [fades * (1.0 - 0.5 * faster), fades * if root > 0.0 { faster / (2.0 * root) } else { step }]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The motion from x = 1, x' = 0 and its rate fulfil the equation for any damping, and are continuous
    /// at critical damping.
    #[test]
    fn motion_with_any_damping_fulfils_its_equation() {
        for (square, decay) in
            [(4.0, 0.0), (4.0, 0.4), (4.0, 2.0), (4.0, 2.0 + 1e-9), (4.0, 20.0), (1e8, 3e7)]
        {
            for step in [1e-4, 0.3, 2.0] {
                let motion = |h: f64| {
                    let [c, s] = free_oscillation(square, decay, h);
                    [c + s * decay, -s * square]
                };
                let [x, v] = motion(step);
                // Two half steps equal one step.
                let [c, s] = free_oscillation(square, decay, 0.5 * step);
                let [half, rate] = motion(0.5 * step);
                let whole =
                    [c * half + s * (rate + decay * half), c * rate - s * (square * half + decay * rate)];
                assert!(
                    (whole[0] - x).abs() < 1e-12 && (whole[1] - v).abs() < 1e-11 * square.sqrt(),
                    "{decay} {step}"
                );
            }
        }
        // x(h) = e^(-2h) (1 + 2h) at critical damping; (e^-h 4 - e^-4h) / 3 with the rates 1 and 4.
        let [c, s] = free_oscillation(4.0, 2.0, 0.7);
        assert!((c + 2.0 * s - (-1.4f64).exp() * 2.4).abs() < 1e-15);
        let [c, s] = free_oscillation(4.0, 2.5, 0.7);
        assert!((c + 2.5 * s - (4.0 * (-0.7f64).exp() - (-2.8f64).exp()) / 3.0).abs() < 1e-15);
    }
}
