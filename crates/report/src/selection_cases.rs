//! Facts of a selection for each of several load cases.

use super::document::{Table, cells};
use super::errors_in_words::{errors_in_words, part_in_words};
use super::reference_error::ReferenceErrorFacts;
use flexbody_body::flex_body::TermGroup;
use flexbody_motion::scene::{OutputErrors, PerQuantity};
use flexbody_study::selection::CaseSelection;
use serde::Serialize;

/// Facts of a load case.
#[derive(Debug, Clone, Serialize)]
pub(super) struct CaseFacts<'a> {
    name: &'a str,
    tolerance: PerQuantity<f64>,
    /// Errors of the selected model.
    errors: Option<OutputErrors>,
    /// Largest error of the selected model over its tolerance.
    worst: Option<f64>,
    /// Output with that largest error.
    output: Option<&'static str>,
    /// Fraction of the tolerances left by the reference.
    budget: Option<f64>,
    passed: bool,
    /// Parts of the selection that this case decides, because it needs them most: groups, and `modes`.
    binds: Vec<&'static str>,
    /// Errors of the body, and of its versions before enrichment, relative to the model in this case.
    reference: Vec<ReferenceErrorFacts>,
}

impl<'a> CaseFacts<'a> {
    pub(crate) fn new(case: &'a CaseSelection) -> Self {
        let tolerance = &case.tolerance;
        let chosen = case.chosen.as_ref();
        let errors = chosen.and_then(|trial| trial.errors);
        let groups = case.binds_groups.iter().copied().map(TermGroup::name);
        Self {
            name: &case.name,
            tolerance: tolerance.errors,
            errors,
            worst: chosen.map(|trial| trial.worst).filter(|worst| worst.is_finite()),
            output: errors.map(|errors| errors.decisive(tolerance).0),
            budget: chosen.map(|trial| trial.budget),
            passed: chosen.is_none_or(|trial| trial.passed()),
            binds: groups.chain(case.binds_modes.then_some("modes")).collect(),
            reference: case.reference_errors.iter().map(ReferenceErrorFacts::new).collect(),
        }
    }

    fn binds_in_words(&self) -> String {
        if self.binds.is_empty() { "nothing".to_owned() } else { self.binds.join(", ") }
    }

    fn reference_error_in_words(&self) -> String {
        self.reference.last().map_or_else(|| "not known".to_owned(), ReferenceErrorFacts::parts)
    }

    /// Returns the case in words: `braking: stress 1.2 %, 60 % of what is allowed; decides W1, modes`.
    pub(crate) fn in_words(&self) -> String {
        let binds = if self.binds.is_empty() {
            "decides nothing".to_owned()
        } else {
            format!("decides {}", self.binds_in_words())
        };
        match &self.errors {
            Some(errors) => {
                let beyond = if self.passed { "" } else { ", exceeded" };
                let errors = errors_in_words(errors);
                format!(
                    "{}: {errors}: {} of the tolerance{beyond}; {binds}",
                    self.name,
                    part_in_words(self.worst)
                )
            }
            None => format!("{}: {binds}", self.name),
        }
    }
}

/// Returns the table of the errors of the selected model in every load case, and of the effect of each case
/// on the selection.
pub(super) fn cases_table(cases: &[CaseFacts<'_>]) -> Table {
    let heads = ["Load case", "Errors", "Error / tolerance", "Decides", "Error of the body (estimated)"];
    let row = |case: &CaseFacts<'_>| {
        let errors = case.errors.as_ref().map_or_else(|| "not measured".to_owned(), errors_in_words);
        cells([
            case.name.to_owned(),
            errors,
            part_in_words(case.worst),
            case.binds_in_words(),
            case.reference_error_in_words(),
        ])
    };
    let caption = "The selected model in each load case, compared with the body with all its terms and modes. A case decides a group or the number of modes if it is the case in which the model without them exceeds the tolerances most.";
    Table::new(caption, heads, &[1, 3, 4], cases.iter().map(row).collect())
}
