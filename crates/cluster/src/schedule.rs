//! Order of the bodies of a batch: the next one is the first of the list that fits into the free memory, so that a
//! large body at the front does not block small ones. No body is overtaken forever, since the number of parallel
//! conversions is limited.

use flexbody_base::error::Result;
use flexbody_body::basis::{ModeSettings, search_plan};
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;

/// Memory of a process before it has read anything, in bytes.
const PROCESS_BYTES: u64 = 60_000_000;

/// Bytes per entry of a matrix while it is read: the stored entry and its source.
const BYTES_PER_ENTRY: u64 = 40;

/// Returns the largest memory of a conversion of a model in bytes: that of the search by its plan, and that of the
/// matrices.
///
/// # Errors
/// The errors of the analysis of a model without a factor.
pub fn conversion_bytes(model: &FeModel, settings: &ModeSettings) -> Result<u64> {
    let pencil = model.pencil();
    let entries = pencil.stiffness().as_csc().nnz() + pencil.mass().as_csc().nnz();
    Ok(PROCESS_BYTES
        + BYTES_PER_ENTRY * entries as u64
        + search_plan(model, settings, &Context::QUIET)?.bytes())
}

/// Resources for parallel conversions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// Memory in bytes.
    pub memory: u64,
    /// Number of conversions.
    pub parallel: usize,
}

impl Budget {
    /// Returns the index of the next body to start, given the memory of the `waiting` and the `running` ones in bytes.
    /// A body that needs more than the whole memory runs alone: its conversion reports the shortage.
    pub fn next(&self, waiting: &[u64], running: &[u64]) -> Option<usize> {
        if running.len() >= self.parallel {
            return None;
        }
        let free = self.memory.saturating_sub(running.iter().sum());
        let fits = waiting.iter().position(|&need| need <= free);
        fits.or_else(|| (running.is_empty() && !waiting.is_empty()).then_some(0))
    }

    /// Returns the memory limit in bytes of a conversion with this need.
    pub fn limit(&self, need: u64) -> u64 {
        // A quarter more: the estimate bounds the search, but not the memory that reading retains.
        (need + need / 4).min(self.memory)
    }
}
