//! Times, measured one after the other on one thread.

use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_motion::dynamics::{EquationsOfMotion, Evaluation, NotPositiveDefinite, Terms};
use flexbody_motion::integration::Work;
use flexbody_motion::scene::{Scene, Scheme, simulate};
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Shortest batch of evaluations that is timed. A longer batch reduces the effect of the clock's resolution.
const MIN_BATCH_TIME: Duration = Duration::from_micros(400);
/// Number of batches, of which the median counts.
const BATCH_COUNT: usize = 15;

/// Total time of integrations after which they are not repeated: the clock is accurate enough for that.
const MAX_REPEATED_TIME: Duration = Duration::from_secs(2);

/// Loosest error tolerance of a step of the adaptive method that is tried. Beyond it the estimate of a step's error means
/// little.
const LOOSEST_TOLERANCE: f64 = 1e-2;
/// Smallest number of steps of constant length that a run is tried with.
const MIN_STEPS: f64 = 10.0;
/// Share of a candidate's error that the integration may add where the candidate exceeds the tolerances anyway.
const SHARE_OF_ERROR: f64 = 0.1;

/// Returns the accuracies of the time integration that a candidate is tried with, the cheapest first. The last is
/// `finest`, the one of the reference, with its actual step.
///
/// The tolerances of the adaptive method descend from 1e-2 in half decades; steps of constant length are halved, with
/// three digits so that a scene can state them.
pub(super) fn schemes(finest: Scheme, duration: f64) -> Vec<Scheme> {
    let mut all = match finest {
        Scheme::Adaptive { tolerance: finest } => half_decades()
            .take_while(|&tolerance| tolerance > finest)
            .map(|tolerance| Scheme::Adaptive { tolerance })
            .collect(),
        Scheme::Conserving { order, step: Some(finest) } => {
            let doubled = std::iter::successors(Some(2.0 * finest), |step| Some(2.0 * step));
            let wide = doubled.take_while(|step| step * MIN_STEPS <= duration);
            let rounded = wide.filter_map(|step| format!("{step:.2e}").parse().ok());
            let mut all: Vec<_> =
                rounded.map(|step| Scheme::Conserving { order, step: Some(step) }).collect();
            all.reverse();
            all
        }
        Scheme::Conserving { step: None, .. } => Vec::new(),
    };
    all.push(finest);
    all
}

/// Returns 1e-2, 3e-3, 1e-3, 3e-4 and so on, with the rounding of decimal numbers.
fn half_decades() -> impl Iterator<Item = f64> {
    let decade = |exponent: i32| [format!("1e-{exponent}"), format!("3e-{}", exponent + 1)];
    let numbers = (2..16).flat_map(decade).filter_map(|text| text.parse().ok());
    numbers.skip_while(|&tolerance: &f64| tolerance > LOOSEST_TOLERANCE)
}

/// Returns the largest ratio of error to tolerance that a run may have, for a candidate with the ratio `worst` in an
/// accurate run, of which `most` is left for candidates.
pub(super) fn allowed(worst: f64, most: f64) -> f64 {
    if worst <= most { most } else { worst * (1.0 + SHARE_OF_ERROR) }
}

/// Returns the seconds of one evaluation of the equations of `body` with `terms`: state, inertia forces and
/// accelerations.
pub(super) fn evaluation(body: &FlexBody, terms: Terms) -> std::result::Result<f64, NotPositiveDefinite> {
    let equations = EquationsOfMotion::new(body, terms);
    let mut evaluation = Evaluation::new(&equations);
    let (q, nu) = (vec![0.0; equations.n_modes()], vec![1.0; equations.n_velocities()]);
    let (applied, mut acceleration) = (vec![0.0; nu.len()], vec![0.0; nu.len()]);
    let mut batch = |count: u32| {
        let start = Instant::now();
        for _ in 0..count {
            evaluation.set(black_box(&q), black_box(&nu));
            evaluation.accelerations(black_box(&applied), black_box(&mut acceleration))?;
        }
        Ok(start.elapsed())
    };
    let mut count = 1;
    while batch(count)? < MIN_BATCH_TIME && count < u32::MAX / 2 {
        count *= 2;
    }
    let mut times = (0..BATCH_COUNT).map(|_| batch(count)).collect::<std::result::Result<Vec<_>, _>>()?;
    Ok(median(&mut times).as_secs_f64() / f64::from(count))
}

/// Returns the seconds of the simulation of `scene`, and its work. The time is the median of `repeat` simulations, or
/// of fewer if these take long.
pub(super) fn integration(body: &FlexBody, scene: &Scene, repeat: usize) -> Result<(f64, Work)> {
    let (mut times, mut work) = (Vec::new(), Work::default());
    while times.len() < repeat.max(1) && times.iter().sum::<Duration>() < MAX_REPEATED_TIME {
        let start = Instant::now();
        work = simulate(body, scene, &Context::QUIET)?.0.work;
        times.push(start.elapsed());
    }
    Ok((median(&mut times).as_secs_f64(), work))
}

/// Returns the median; of an even number, the larger of the middle two.
fn median(times: &mut [Duration]) -> Duration {
    times.sort_unstable();
    times[times.len() / 2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerances_descend_to_the_one_of_the_reference() {
        let of = |finest| -> Vec<f64> {
            let tolerance = |scheme: &Scheme| match scheme {
                Scheme::Adaptive { tolerance } => *tolerance,
                Scheme::Conserving { .. } => f64::NAN,
            };
            schemes(Scheme::Adaptive { tolerance: finest }, 1.0).iter().map(tolerance).collect()
        };
        assert_eq!(of(2e-5), [1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 2e-5]);
        assert_eq!(of(1e-3), [1e-2, 3e-3, 1e-3]);
        assert_eq!(of(0.05), [0.05]);
    }

    #[test]
    fn steps_are_halved_to_the_one_of_the_reference() {
        let finest = Scheme::Conserving { order: 4, step: Some(0.01) };
        let steps = [0.08, 0.04, 0.02, 0.01].map(|step| Scheme::Conserving { order: 4, step: Some(step) });
        assert_eq!(schemes(finest, 1.0), steps);
    }

    #[test]
    fn a_candidate_beyond_the_tolerances_may_get_a_little_worse() {
        assert_eq!(allowed(0.3, 0.95), 0.95);
        assert_eq!(allowed(2.0, 0.95), 2.2);
    }
}
