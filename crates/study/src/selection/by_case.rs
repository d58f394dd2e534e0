//! Selection for several load cases, listed by case.

use super::decisions::DecisiveError;
use super::demand::Demand;
use super::search::Choice;
use super::trial::Trial;
use crate::reference::ReferenceError;
use flexbody_body::flex_body::TermGroup;
use flexbody_motion::scene::Tolerance;

/// Result of a selection for one of several load cases.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseSelection {
    /// Name of the load case.
    pub name: String,
    /// Tolerances of the load case.
    pub tolerance: Tolerance,
    /// Selected model, measured against the whole body; `None` if no motion was integrated.
    pub chosen: Option<Trial>,
    /// Groups whose decision rests on this load case.
    pub binds_groups: Vec<TermGroup>,
    /// True if one mode fewer would exceed the tolerances most in this load case.
    pub binds_modes: bool,
    /// Truncation errors in this case, of the body and of its versions before enrichment.
    pub reference_errors: Vec<ReferenceError>,
}

/// Returns the results for each of several load cases; empty for a single scene.
pub(super) fn by_case(
    demands: &[Demand<'_>],
    choice: &Choice,
    trials: &[Trial],
    decisive_errors: &[Option<DecisiveError>],
    chosen: Vec<Trial>,
) -> Vec<CaseSelection> {
    if demands.len() == 1 {
        return Vec::new();
    }
    // Failed trial with one mode fewer than the choice: its worst load case binds the number of modes.
    let one_fewer = trials
        .iter()
        .rfind(|trial| !trial.by_case.is_empty() && !trial.passed() && trial.modes + 1 == choice.modes.len());
    let of_case = |(at, demand): (usize, &Demand<'_>)| {
        let is_bound_here = |group: &TermGroup, decisive_error: &Option<DecisiveError>| {
            choice.groups.has(*group)
                && decisive_error.is_some_and(|decisive_error| decisive_error.case == Some(at))
        };
        let decisive_errors = TermGroup::ALL.into_iter().zip(decisive_errors);
        CaseSelection {
            name: demand.name.unwrap_or_default().to_owned(),
            tolerance: *demand.tolerance(),
            chosen: chosen.get(at).cloned(),
            binds_groups: decisive_errors
                .filter(|(group, decisive_error)| is_bound_here(group, decisive_error))
                .map(|(group, _)| group)
                .collect(),
            binds_modes: one_fewer.is_some_and(|trial| trial.case == Some(at)),
            reference_errors: demand.reference_errors.to_vec(),
        }
    };
    demands.iter().enumerate().map(of_case).collect()
}

/// Returns the truncation errors in the load case whose last error is largest.
pub(super) fn worst_reference_errors(demands: &[Demand<'_>]) -> Vec<ReferenceError> {
    let last = |demand: &&Demand<'_>| demand.reference_errors.last().map_or(-1.0, |own| own.worst);
    // The reversed order returns the first of equal cases.
    let worst = demands.iter().rev().max_by(|a, b| last(a).total_cmp(&last(b)));
    worst.map_or_else(Vec::new, |demand| demand.reference_errors.to_vec())
}
