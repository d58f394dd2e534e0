//! Times, measured one after the other on one thread.

use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_motion::dynamics::{EquationsOfMotion, Evaluation, NotPositiveDefinite, Terms};
use flexbody_motion::integration::Work;
use flexbody_motion::scene::{Scene, simulate};
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Shortest batch of evaluations that is timed. A longer batch reduces the effect of the clock's resolution.
const MIN_BATCH_TIME: Duration = Duration::from_micros(400);
/// Number of batches, of which the median counts.
const BATCH_COUNT: usize = 15;

/// Total time of integrations after which they are not repeated: the clock is accurate enough for that.
const MAX_REPEATED_TIME: Duration = Duration::from_secs(2);

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
