//! An attempt to find modes: whether it can be used for the problem at hand, what it takes, and its search.

use super::failure::EigenFailure;
use super::needs::{Needs, Unusable};
use super::problem::Task;
use super::refine::FoundModes;

/// The aim of a search.
#[derive(Debug, Clone, Copy)]
pub(super) struct Goal {
    /// Number of modes, extended to the end of the cluster of the last one.
    pub wanted: usize,
    /// K-residual.
    pub tolerance: f64,
    /// Distance of eigenvalues, relative to the size of the matrix along their modes, that the count needs above the
    /// last mode: corrections go on to the next such gap where it is near.
    pub separation: f64,
    /// Number of the search for the same modes: a search repeated after a count that found more modes starts from
    /// other random vectors.
    pub round: usize,
}

/// The algorithm of a [`Way`](super::plan::Way).
pub(super) trait Attempt: Sync {
    /// Returns what a search for so many modes takes.
    ///
    /// # Errors
    /// [`Unusable`] where it cannot be used, or another one takes less time.
    fn needs(&self, task: &Task<'_>, wanted: usize) -> Result<Needs, Unusable>;

    /// Searches.
    ///
    /// # Errors
    /// [`EigenFailure`] says why there are no modes that keep the tolerance.
    fn search(&self, task: &Task<'_>, goal: &Goal) -> Result<FoundModes, EigenFailure>;

    /// Returns true when a failure says something about the model: no other attempt would succeed.
    fn is_conclusive(&self, failure: &EigenFailure) -> bool;

    /// Returns true when the attempt is made again in a search that repeats one in which modes were missed.
    fn is_repeated(&self) -> bool {
        true
    }
}
