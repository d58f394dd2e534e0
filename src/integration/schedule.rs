//! From instant to instant: what every integration does with its steps.

use super::{Explicit, Failure, Gauss, System, Work};

/// What lengths may differ by, relative, as rounding of times makes them.
const STEP_ROUNDING: f64 = 1e-9;

/// Where explicit steps to a break end, relative: a few roundings before it.
const BEFORE_BREAK: f64 = 4.0 * f64::EPSILON;

/// How a system is integrated.
#[derive(Debug, Clone)]
pub enum Method {
    /// Steps as long as the tolerance allows.
    Explicit(Explicit),
    /// Steps of one length between two instants, at most `step`.
    Gauss {
        /// The method.
        method: Gauss,
        /// Longest step.
        step: f64,
    },
}

impl Method {
    /// What was done so far.
    pub fn work(&self) -> Work {
        match self {
            Self::Explicit(method) => method.work(),
            Self::Gauss { method, .. } => method.work(),
        }
    }

    fn restart(&mut self) {
        match self {
            Self::Explicit(method) => method.restart(),
            Self::Gauss { method, .. } => method.restart(),
        }
    }
}

/// Integrates from the first to the last of `instants` and shows the state at every one to `observe`, which may end the integration
/// by returning an error.
///
/// * `state`: y at the first instant; afterwards, y at the last.
/// * `instants`: ascending.
/// * `breaks`: ascending; times at which f jumps or has a kink. No step passes over one.
///
/// # Errors
/// Of the system, of the method, or of `observe`. The state is then that of the last good step.
///
/// # Panics
/// When the state has another number of entries than the system.
pub fn integrate<E: From<Failure>>(
    method: &mut Method,
    system: &mut dyn System,
    state: &mut [f64],
    instants: &[f64],
    breaks: &[f64],
    mut observe: impl FnMut(f64, &[f64]) -> Result<(), E>,
) -> Result<(), E> {
    let (Some(&start), Some(&last)) = (instants.first(), instants.last()) else { return Ok(()) };
    observe(start, state)?;
    let mut wanted = instants[1..].iter().copied().peekable();
    let stops = breaks.iter().copied().filter(|&at| start < at && at < last).chain([last]);
    let (mut time, mut length) = (start, 0.0);
    let mut within = vec![0.0; state.len()];
    for stop in stops {
        method.restart();
        // f at a break is that after it, which is not what the last rate of an explicit step is about.
        let before = if breaks.contains(&stop) { stop - BEFORE_BREAK * stop.abs() } else { stop };
        while time < stop {
            match method {
                Method::Explicit(_) if time >= before => time = stop,
                Method::Explicit(method) => {
                    let end = method.step(system, time, state, before)?;
                    finite(state, time)?;
                    time = if end < before { end } else { stop };
                    while let Some(instant) = wanted.next_if(|&instant| instant < time) {
                        method.interpolate(system, instant, state, &mut within)?;
                        observe(instant, &within)?;
                    }
                }
                Method::Gauss { method, step } => {
                    let end = wanted.peek().map_or(stop, |&instant| instant.min(stop));
                    let from = time;
                    let steps = ((end - from) / *step * (1.0 - STEP_ROUNDING)).ceil().max(1.0);
                    // Lengths that differ by the rounding of times are one length.
                    let even = (end - from) / steps;
                    if (length - even).abs() > STEP_ROUNDING * even {
                        length = even;
                    }
                    let mut taken = 0.0;
                    while taken < steps {
                        method.step(system, time, state, length)?;
                        finite(state, time)?;
                        taken += 1.0;
                        time = if taken < steps { from + taken * length } else { end };
                    }
                }
            }
            while let Some(instant) = wanted.next_if(|&instant| instant <= time) {
                observe(instant, state)?;
            }
        }
    }
    Ok(())
}

/// `time` is that of the last good state.
fn finite(state: &[f64], time: f64) -> Result<(), Failure> {
    if state.iter().all(|y| y.is_finite()) { Ok(()) } else { Err(Failure::NotFinite { time }) }
}
