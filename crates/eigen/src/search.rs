//! The interface of an attempt: the goal of a search, and the algorithm that searches.

use super::failure::EigenFailure;
use super::needs::{Needs, Unusable};
use super::problem::Task;
use super::refine::FoundModes;

/// Goal of a search for modes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Goal {
    /// Number of modes, extended to the end of the cluster of the last one.
    pub wanted: usize,
    /// Largest K-residual allowed for the modes.
    pub tolerance: f64,
    /// Smallest gap above the last mode that the later count needs, relative to the size of the matrix along the modes;
    /// 0 if any gap will do. If the gap is smaller, corrections also search the modes up to the next gap that is wide
    /// enough, provided that it is near.
    pub separation: f64,
    /// Number of this search among the searches for the same modes. A search repeated after a count that found more
    /// modes starts from other random vectors.
    pub round: usize,
}

/// Algorithm behind a [`Way`](super::Way).
pub(super) trait Attempt: Sync {
    /// Returns the memory and time that a search for `wanted` modes takes.
    ///
    /// # Errors
    /// [`Unusable`] if the attempt cannot be used, or another attempt takes less time.
    fn needs(&self, task: &Task<'_>, wanted: usize) -> Result<Needs, Unusable>;

    /// Searches for the modes.
    ///
    /// # Errors
    /// [`EigenFailure`] with the reason why no modes keep the tolerance.
    fn search(&self, task: &Task<'_>, goal: &Goal) -> Result<FoundModes, EigenFailure>;

    /// Returns true when the failure reveals a property of the model, so that no other attempt would succeed.
    fn is_conclusive(&self, failure: &EigenFailure) -> bool;

    /// Returns true when the attempt is also made in a repeated search, after a count that found missing modes.
    fn is_repeated(&self) -> bool {
        true
    }
}
