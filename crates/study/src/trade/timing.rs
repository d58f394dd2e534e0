//! Times, one after the other on one thread.

use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_motion::dynamics::{EquationsOfMotion, Evaluation, NotPositiveDefinite, Terms};
use flexbody_motion::integration::Work;
use flexbody_motion::scene::{Scene, simulate};
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Evaluations are timed in batches of at least this long, whose median counts.
const BATCH: Duration = Duration::from_micros(400);
const BATCHES: usize = 15;

/// Integrations that take this long together are not repeated: the clock is sharper than that.
const LONG: Duration = Duration::from_secs(2);

/// Seconds that one evaluation of the equations of `body` with `terms` takes: state, forces of inertia and
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
    while batch(count)? < BATCH && count < u32::MAX / 2 {
        count *= 2;
    }
    let mut times = (0..BATCHES).map(|_| batch(count)).collect::<std::result::Result<Vec<_>, _>>()?;
    Ok(median(&mut times).as_secs_f64() / f64::from(count))
}

/// Seconds that the simulation of `scene` takes, the median of `repeat` where that is not long, and its work.
pub(super) fn integration(body: &FlexBody, scene: &Scene, repeat: usize) -> Result<(f64, Work)> {
    let (mut times, mut work) = (Vec::new(), Work::default());
    while times.len() < repeat.max(1) && times.iter().sum::<Duration>() < LONG {
        let start = Instant::now();
        work = simulate(body, scene, &Context::QUIET)?.0.work;
        times.push(start.elapsed());
    }
    Ok((median(&mut times).as_secs_f64(), work))
}

/// The middle one, of an even number the later.
fn median(times: &mut [Duration]) -> Duration {
    times.sort_unstable();
    times[times.len() / 2]
}
