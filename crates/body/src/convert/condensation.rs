//! Condensation of the mass into invariants, in one or two steps.

use super::ModalModel;
use crate::flex_body::{Guarantee, TermDecision, TermGroup, TermGroups};
use crate::invariants::{Invariants, condense_certified};

/// Mass of a model condensed on its modes: the invariants, their guaranteed digits, and the dropped groups.
///
/// Without W2 and W3, M is multiplied by rigid motion only, and for solids no nf x nf arrays except K_ff
/// and m_ff are formed (theory section 4).
#[derive(Debug, Clone)]
pub struct Condensation {
    pub(super) invariants: Invariants,
    /// Guaranteed bounds of accuracy `certified`.
    pub(super) guarantee: Option<Guarantee>,
    /// Reason for keeping or dropping each group; empty if no selection was made.
    pub(super) terms: Vec<TermDecision>,
    /// Number of columns multiplied by M.
    pub(super) columns: u64,
}

impl ModalModel<'_> {
    /// Condenses I0 and W1, enough for a scene to decide about the groups W2 and W3.
    pub fn condense_linear(&self) -> Condensation {
        let stiffness = self.modal_stiffness.clone();
        let invariants = self.modes.condensed_linear(self.model, &self.place, stiffness);
        Condensation {
            terms: invariants.groups().dropped().map(not_computed).collect(),
            invariants,
            guarantee: None,
            columns: self.modes.condensed_columns(self.model, true),
        }
    }

    /// Condenses all groups.
    pub fn condense(&self) -> Condensation {
        let columns = self.modes.condensed_columns(self.model, false);
        let (invariants, guarantee) = match self.certified() {
            Some((invariants, guarantee)) => (invariants, Some(guarantee)),
            None => {
                let stiffness = self.modal_stiffness.clone();
                (self.modes.condensed(self.model, &self.place, stiffness), None)
            }
        };
        Condensation { invariants, guarantee, terms: Vec::new(), columns }
    }

    /// Condenses the groups that `terms` keep; `linear` holds the data already known. Accuracy `certified`
    /// condenses everything first, since its digits refer to all data.
    pub fn condense_selected(&self, linear: Condensation, terms: Vec<TermDecision>) -> Condensation {
        let dropped = terms.iter().filter(|term| !term.kept);
        let groups =
            dropped.fold(TermGroups::ALL, |groups, term| groups.and(TermGroups::without(term.group)));
        let is_enough = !groups.w2 && !groups.w3 && self.found.solution.bounds.is_none();
        let condensed = if is_enough {
            linear
        } else {
            let whole = self.condense();
            Condensation { columns: linear.columns + whole.columns, ..whole }
        };
        Condensation { invariants: condensed.invariants.with_groups(groups), terms, ..condensed }
    }

    /// Returns the invariants in double-double arithmetic with guaranteed digits, if the modes have
    /// guaranteed bounds.
    fn certified(&self) -> Option<(Invariants, Guarantee)> {
        let (bounds, mass) = (self.found.solution.bounds.as_ref()?, self.model.scalar_mass()?);
        let shapes = self.modes.displacements.as_ref();
        let (positions, axes) = (&self.place.positions, &self.place.frame.axes);
        let certified = condense_certified(mass, positions, shapes, self.model.stiffness(), axes);
        let guarantee = Guarantee {
            shift_below: bounds.shift_below,
            pivots_below: bounds.pivots_below,
            eigenvalue_lower: bounds.lower.clone(),
            eigenvalue_upper: bounds.upper.clone(),
            shape_error: bounds.shape_error.clone(),
            digits: certified.digits,
        };
        Some((certified.invariants, guarantee))
    }
}

/// Returns the placeholder decision about a group that is not computed yet.
fn not_computed(group: TermGroup) -> TermDecision {
    let reason = "not computed yet".to_owned();
    TermDecision { group, kept: false, tier: 0, bound: 0.0, limit: 0.0, reason }
}
