//! Which body of a batch begins next: the first of the list that fits what is free, so that a large one at the
//! front does not hold up small ones; none passes it for ever, since only so many run beside it.

use flexbody_base::error::Result;
use flexbody_body::basis::{ModeSettings, search_plan};
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;

/// Bytes of a process before it has read anything.
const PROCESS: u64 = 60_000_000;

/// Bytes of an entry of a matrix while it is read: what is stored, and what it is made of.
const ENTRY: u64 = 40;

/// Bytes that a conversion of a model needs at the most: those of the search by its plan, and those of the
/// matrices.
///
/// # Errors
/// Those of the analysis of a model that has no factor.
pub fn conversion_bytes(model: &FeModel, settings: &ModeSettings) -> Result<u64> {
    let pencil = model.pencil();
    let entries = pencil.stiffness().as_csc().nnz() + pencil.mass().as_csc().nnz();
    Ok(PROCESS + ENTRY * entries as u64 + search_plan(model, settings, &Context::QUIET)?.bytes())
}

/// What may be given out at the same time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// Bytes.
    pub memory: u64,
    /// Conversions.
    pub parallel: usize,
}

impl Budget {
    /// The index of the body that begins next, of those that wait with these needs, beside those that run.
    /// One that needs more than there is runs alone: its conversion says itself what does not fit.
    pub fn next(&self, waiting: &[u64], running: &[u64]) -> Option<usize> {
        if running.len() >= self.parallel {
            return None;
        }
        let free = self.memory.saturating_sub(running.iter().sum());
        let fits = waiting.iter().position(|&need| need <= free);
        fits.or_else(|| (running.is_empty() && !waiting.is_empty()).then_some(0))
    }

    /// Bytes that a conversion with this need may use.
    pub fn limit(&self, need: u64) -> u64 {
        // A quarter more: estimates of a search are bounds, what reading leaves behind is not.
        (need + need / 4).min(self.memory)
    }
}
