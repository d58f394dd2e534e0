//! Choice of terms and modes during a selection.

use super::trial::{ModeShare, Trial};
use flexbody_body::flex_body::TermGroups;

/// Current choice of terms and modes.
pub(super) struct Choice {
    pub groups: TermGroups,
    pub modes: Vec<usize>,
    pub shares: Vec<ModeShare>,
    pub chosen: Option<Trial>,
}

impl Choice {
    /// Keeps the first `count` modes of the order `ranked`.
    pub(super) fn keep_most(&mut self, ranked: &[usize], count: usize) {
        let mut modes = ranked[..count].to_vec();
        modes.sort_unstable();
        self.keep(modes);
    }

    /// Sets the kept modes.
    pub(super) fn keep(&mut self, modes: Vec<usize>) {
        for (j, share) in self.shares.iter_mut().enumerate() {
            share.kept = modes.binary_search(&j).is_ok();
        }
        self.modes = modes;
    }
}
