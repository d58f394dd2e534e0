//! A selection for several load cases, seen from each of them.

use super::decisions::Ground;
use super::demand::Demand;
use super::search::Choice;
use super::trial::Trial;
use crate::reference::ReferenceError;
use flexbody_body::flex_body::TermGroup;
use flexbody_motion::scene::Tolerance;

/// What a selection for several load cases is for one of them.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseSelection {
    /// Name of the load case.
    pub name: String,
    /// Its tolerances.
    pub tolerance: Tolerance,
    /// The selected model, measured against all that the body holds; none where nothing was integrated.
    pub chosen: Option<Trial>,
    /// Groups that are kept because of this case more than of any other.
    pub binds_groups: Vec<TermGroup>,
    /// Whether one mode fewer is furthest beyond the tolerances in this case.
    pub binds_modes: bool,
    /// What the body, and those before it that were enriched, lack of the model in this case.
    pub lacks: Vec<ReferenceError>,
}

/// What belongs to each of several load cases; nothing of a scene alone.
pub(super) fn by_case(
    demands: &[Demand<'_>],
    choice: &Choice,
    trials: &[Trial],
    grounds: &[Option<Ground>],
    chosen: Vec<Trial>,
) -> Vec<CaseSelection> {
    if demands.len() == 1 {
        return Vec::new();
    }
    let one_fewer = trials
        .iter()
        .rfind(|trial| !trial.by_case.is_empty() && !trial.passed() && trial.modes + 1 == choice.modes.len());
    let of_case = |(at, demand): (usize, &Demand<'_>)| {
        let is_bound_here = |group: &TermGroup, ground: &Option<Ground>| {
            choice.groups.has(*group) && ground.is_some_and(|ground| ground.case == Some(at))
        };
        let grounds = TermGroup::ALL.into_iter().zip(grounds);
        CaseSelection {
            name: demand.name.unwrap_or_default().to_owned(),
            tolerance: *demand.tolerance(),
            chosen: chosen.get(at).cloned(),
            binds_groups: grounds
                .filter(|(group, ground)| is_bound_here(group, ground))
                .map(|(group, _)| group)
                .collect(),
            binds_modes: one_fewer.is_some_and(|trial| trial.case == Some(at)),
            lacks: demand.lacks.to_vec(),
        }
    };
    demands.iter().enumerate().map(of_case).collect()
}

/// What the body lacks in the load case where it lacks most at last.
pub(super) fn worst_lacks(demands: &[Demand<'_>]) -> Vec<ReferenceError> {
    let last = |demand: &&Demand<'_>| demand.lacks.last().map_or(-1.0, |own| own.worst);
    // The first of equals.
    let worst = demands.iter().rev().max_by(|a, b| last(a).total_cmp(&last(b)));
    worst.map_or_else(Vec::new, |demand| demand.lacks.to_vec())
}
