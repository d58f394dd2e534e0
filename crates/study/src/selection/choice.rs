//! Choice of terms and shapes during a selection.

use super::ranking::first_of;
use super::shapes::Pool;
use super::trial::{ModeShare, Trial};
use flexbody_body::flex_body::TermGroups;

/// Current choice of terms and shapes.
pub(super) struct Choice {
    pub groups: TermGroups,
    /// Shapes from which the selection picks.
    pub pool: Pool,
    /// Kept shapes of the pool.
    pub modes: Vec<usize>,
    pub shares: Vec<ModeShare>,
    pub chosen: Option<Trial>,
    /// All shapes of the pool by descending contribution; empty unless the fewest modes were looked for.
    pub ranked: Vec<usize>,
    /// The chosen model with the next mode of this order as well.
    pub next: Option<Trial>,
}

impl Choice {
    /// Returns the choice of all `nf` modes with `groups`.
    pub(super) fn of_modes(groups: TermGroups, nf: usize) -> Self {
        Self {
            groups,
            pool: Pool::Modes,
            modes: (0..nf).collect(),
            shares: Vec::new(),
            chosen: None,
            ranked: Vec::new(),
            next: None,
        }
    }

    /// Keeps the first `count` modes of the order `ranked`.
    pub(super) fn keep_most(&mut self, ranked: &[usize], count: usize) {
        self.keep(first_of(ranked, count));
    }

    /// Sets the kept modes.
    pub(super) fn keep(&mut self, modes: Vec<usize>) {
        for (j, share) in self.shares.iter_mut().enumerate() {
            share.kept = modes.binary_search(&j).is_ok();
        }
        self.modes = modes;
    }
}
