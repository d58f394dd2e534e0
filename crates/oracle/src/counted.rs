//! Work counts for tests.

use flexbody_linalg::context::{Context, Work, WorkCounter};

/// Runs `work` in a context without limits, and returns its result with the work counts.
pub fn counted<T>(work: impl FnOnce(&Context<'_>) -> T) -> (T, Work) {
    let counter = WorkCounter::default();
    let done = work(&Context::QUIET.with_counter(&counter));
    (done, counter.total())
}
