//! Verdict of a selection in a few lines: request, recommendation, reason, modes, error, savings.

use super::errors::{ReferenceErrorFacts, error_in_words, errors_in_words, groups_in_words, ranges};
use crate::notation::numbers::{counted, frequency, significant};
use flexbody_body::flex_body::TermGroup;
use flexbody_study::reference::ReferenceError;
use flexbody_study::selection::{
    DecisiveError, ErrorSource, Excitation, ModeReasons, ModeWorth, NOT_JUDGED, Selection,
};
use serde::Serialize;

/// Ratio of the multiplications below which the saving is stated in percent.
const NEARLY_AS_MANY: f64 = 1.5;

/// The lines of the verdict.
#[derive(Debug, Clone, Serialize)]
pub(super) struct SelectionVerdict {
    /// True if the requirements are met.
    pub holds: bool,
    pub asked: String,
    pub take: String,
    pub why: String,
    /// Reasons for the modes; empty unless the fewest modes were looked for.
    pub modes: String,
    pub error: String,
    pub saves: String,
}

impl SelectionVerdict {
    pub(crate) fn new(selection: &Selection) -> Self {
        Self {
            holds: selection.holds(),
            asked: asked(selection),
            take: take(selection),
            why: why(selection),
            modes: selection.mode_reasons.as_ref().map_or_else(String::new, |own| of_modes(own, selection)),
            error: error(selection),
            saves: saves(selection),
        }
    }

    /// Returns the lines with their labels.
    pub(crate) fn lines(&self) -> [(&'static str, &str); 6] {
        let found = if self.holds { "Recommended" } else { "Best found" };
        [
            ("Asked", self.asked.as_str()),
            (found, self.take.as_str()),
            ("Why", self.why.as_str()),
            ("Its modes", self.modes.as_str()),
            ("Error", self.error.as_str()),
            ("Saves", self.saves.as_str()),
        ]
    }
}

/// Returns the physical meaning of a group of terms.
fn meaning(group: TermGroup) -> &'static str {
    match group {
        TermGroup::W1 => "centrifugal load, and inertia linear in the deflection",
        TermGroup::W2 => "centrifugal softening, and inertia quadratic in the deflection",
        TermGroup::W3 => "Coriolis and Euler forces on the modes",
    }
}

fn asked(selection: &Selection) -> String {
    if let Some(most) = selection.most_multiplications {
        return format!(
            "{}{}: the smallest error with at most {most} multiplications per evaluation",
            selection.scene,
            cases_in_words(selection)
        );
    }
    let stated = selection.tolerance.named().into_iter().filter(|(_, most)| most.is_finite());
    let part = |(name, most): (&str, f64)| match name {
        "recovery" => "the limits of the recoveries".to_owned(),
        "reaction" => format!("{} in reactions", error_in_words(name, most, 2)),
        _ => format!("{} in {name}", error_in_words(name, most, 2)),
    };
    let parts: Vec<String> = stated.map(part).collect();
    format!("{}{}: errors of at most {}", selection.scene, cases_in_words(selection), parts.join(", "))
}

/// Returns the load cases in words, with a remark if the stated tolerances are the smallest of several.
fn cases_in_words(selection: &Selection) -> String {
    let Some(first) = selection.cases.first() else { return String::new() };
    let names: Vec<&str> = selection.cases.iter().map(|case| case.name.as_str()).collect();
    let least = if selection.cases.iter().all(|case| case.tolerance == first.tolerance) {
        ""
    } else {
        "; the smallest tolerances of all cases"
    };
    format!(" in each of {} load cases ({}){least}", names.len(), names.join(", "))
}

/// Returns ` in case ...` for a fact of one of several load cases; empty for a single scene.
fn in_case(case: Option<usize>, selection: &Selection) -> String {
    let case = case.and_then(|at| selection.cases.get(at));
    case.map_or_else(String::new, |case| format!(" in case {}", case.name))
}

fn take(selection: &Selection) -> String {
    let numbers: Vec<usize> = selection.modes.iter().map(|j| j + 1).collect();
    let hertz = |j: Option<&usize>| j.map_or(0.0, |&j| selection.frequencies_hz[j]);
    let last = frequency(hertz(selection.modes.last()), 3);
    let held: Vec<&str> = selection.groups.kept().map(TermGroup::name).collect();
    let groups = groups_in_words(&held);
    if let Some(choice) = &selection.fixed_interface {
        let kept: Vec<usize> = choice.kept.iter().map(|j| j + 1).collect();
        let kept = match kept.as_slice() {
            [] => "none".to_owned(),
            kept => format!("{} ({})", kept.len(), ranges(kept)),
        };
        return format!(
            "{} (up to {last}): all motions of the interfaces and {kept} of {} fixed-interface modes, with {groups}",
            counted(numbers.len(), "mode"),
            choice.of
        );
    }
    if numbers.len() == selection.n_modes {
        return format!("all {} (up to {last}) with {groups}", counted(numbers.len(), "mode"));
    }
    format!(
        "{} of {} ({}; up to {last}) with {groups}",
        numbers.len(),
        counted(selection.n_modes, "mode"),
        ranges(&numbers)
    )
}

/// Decision about groups with the same reason.
struct CommonDecision<'a> {
    kept: bool,
    error: Option<DecisiveError>,
    /// Reason of the decision, for one that no error decided.
    reason: &'a str,
    groups: Vec<TermGroup>,
}

/// Returns the reasons of the decisions; groups with the same reason and error share a sentence.
fn why(selection: &Selection) -> String {
    let mut decisions: Vec<CommonDecision<'_>> = Vec::new();
    for (term, error) in selection.terms.iter().zip(&selection.decisive_errors) {
        let reason = if error.is_none() { term.reason.as_str() } else { "" };
        let is_common = |one: &&mut CommonDecision<'_>| {
            one.kept == term.kept && one.error == *error && one.reason == reason
        };
        match decisions.iter_mut().find(is_common) {
            Some(known) => known.groups.push(term.group),
            None => {
                let groups = vec![term.group];
                decisions.push(CommonDecision { kept: term.kept, error: *error, reason, groups });
            }
        }
    }
    decisions.sort_by_key(|decision| !decision.kept);
    let parts = decisions.iter().map(|decision| {
        let case = decision.error.and_then(|error| error.case);
        reason(decision) + &in_case(case, selection)
    });
    parts.collect::<Vec<_>>().join("; ")
}

/// Returns the reasons for the modes in words: what excites them, what the modes at the edge of the selection are worth, and where
/// most of the remaining error comes from.
fn of_modes(reasons: &ModeReasons, selection: &Selection) -> String {
    let noun = if selection.fixed_interface.is_some() { "fixed-interface mode" } else { "mode" };
    let excited = |own: &Excitation| {
        let numbers: Vec<usize> = own.modes.iter().map(|mode| mode + 1).collect();
        let (plural, verb) = if numbers.len() == 1 { ("", "is") } else { ("s", "are") };
        format!("{noun}{plural} {} {verb} excited by {}", ranges(&numbers), own.by)
    };
    let mode =
        |worth: &ModeWorth| format!("{noun} {} ({})", worth.mode + 1, frequency(worth.frequency_hz, 3));
    let error = |worth: &ModeWorth| {
        format!("the error in {} is {}", worth.output, error_in_words(worth.output, worth.error, 2))
    };
    let edge: Vec<String> = [
        reasons.without_last.as_ref().map(|last| format!("without {} {}", mode(last), error(last))),
        reasons.with_next.as_ref().map(|next| format!("with {} as well {}", mode(next), error(next))),
    ]
    .into_iter()
    .flatten()
    .collect();
    let rest = reasons.rest.map(|source| {
        let source = match source {
            ErrorSource::Modes => "the dropped modes",
            ErrorSource::Groups => "the dropped terms",
            ErrorSource::Body => "what the body with all its modes lacks",
        };
        format!("most of the error that is left comes from {source}")
    });
    let edge = (!edge.is_empty()).then(|| edge.join(", "));
    reasons.excited.iter().map(excited).chain(edge).chain(rest).collect::<Vec<_>>().join("; ")
}

fn reason(decision: &CommonDecision<'_>) -> String {
    let CommonDecision { kept, error: decisive_error, reason, groups } = decision;
    let names: Vec<String> =
        groups.iter().map(|group| format!("{} ({})", group.name(), meaning(*group))).collect();
    let names = names.join(" and ");
    let Some(DecisiveError { output, error, tier, .. }) = decisive_error else {
        return if reason.starts_with(NOT_JUDGED) {
            format!("{names}: {reason}")
        } else if *kept {
            format!("keep {names}: {reason}")
        } else {
            let are = if groups.len() == 1 { "is" } else { "are" };
            format!("{names} {are} not in the body")
        };
    };
    let error = error_in_words(output, *error, 2);
    match (*kept, tier) {
        (true, 2) => format!("without {names} the error in {output} is {error}"),
        (true, _) => format!("without {names} the error in {output} may reach {error}"),
        (false, 2) => format!("dropping {names} makes an error of {error} in {output}"),
        (false, _) => {
            format!(
                "dropping {names} makes an error of at most {error} in {output} (a bound, without simulation)"
            )
        }
    }
}

fn error(selection: &Selection) -> String {
    let last_error = selection.reference_errors.last();
    let reference_errors = match last_error {
        Some(last_error) => {
            let much =
                if ReferenceError::is_reference(last_error) { "" } else { ", too much for a reference" };
            format!(
                "; the body with all its modes differs from the FE model by {} (estimated){much}",
                ReferenceErrorFacts::new(last_error).parts()
            )
        }
        None => "; beside the body with all its modes, whose error relative to the FE model is not known"
            .to_owned(),
    };
    let unstressed = selection.stress_error.as_ref().filter(|own| !own.is_small());
    let unstressed = unstressed.map_or_else(String::new, |own| {
        format!("; the stress of the spin, which the body does not have, makes {}, estimated", own.in_words())
    });
    let reference_errors = reference_errors + &unstressed;
    match selection.chosen.as_ref().and_then(|chosen| chosen.errors.as_ref()) {
        Some(errors) => {
            let case = in_case(selection.chosen.as_ref().and_then(|chosen| chosen.case), selection);
            let worst = if case.is_empty() { "" } else { ", the worst case" };
            format!("{}, measured over the run{case}{worst}{reference_errors}", errors_in_words(errors))
        }
        None => format!("nothing was simulated{reference_errors}"),
    }
}

fn saves(selection: &Selection) -> String {
    let Some(chosen) = &selection.chosen else { return "not measured".to_owned() };
    let ratio = selection.multiplications as f64 / chosen.multiplications as f64;
    let (own, all) = (chosen.multiplications, selection.multiplications);
    if own == all {
        return "nothing: the scene needs the whole body".to_owned();
    }
    let fewer = match ratio {
        ratio if ratio < NEARLY_AS_MANY => {
            format!("{} % fewer", significant(100.0 * (1.0 - ratio.recip()), 2))
        }
        ratio => format!("{} times fewer", significant(ratio, 2)),
    };
    format!("{own} multiplications per evaluation instead of {all}: {fewer}")
}
