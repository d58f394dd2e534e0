//! Work that tests count.

use flexbody_linalg::context::{Context, Work, WorkCounter};

/// Does `work` in a context without limits, and counts it.
pub fn counted<T>(work: impl FnOnce(&Context<'_>) -> T) -> (T, Work) {
    let counter = WorkCounter::default();
    let done = work(&Context::QUIET.counted_by(&counter));
    (done, counter.total())
}
