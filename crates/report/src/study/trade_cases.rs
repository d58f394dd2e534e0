//! Load cases of a trade study: errors of the candidates in each case, and the effect of each case on the
//! decision.

use super::errors::{ReferenceErrorFacts, errors_in_words, part_in_words};
use super::integration::NodalFacts;
use crate::document::{Table, cells};
use crate::notation::numbers::counted;
use flexbody_motion::scene::{OutputErrors, Tolerance};
use flexbody_study::reference::ReferenceError;
use flexbody_study::trade::{InCase, Trade};
use serde::Serialize;

/// Facts of a load case.
#[derive(Debug, Clone, Serialize)]
pub(super) struct TradeCaseFacts<'a> {
    name: &'a str,
    tolerance: Tolerance,
    /// Errors of the recommended candidate in this case.
    errors: Option<OutputErrors>,
    /// Largest error of the recommended candidate over its tolerance.
    worst: Option<f64>,
    /// Output with that largest error.
    output: Option<&'static str>,
    /// Fraction of the tolerances that the reference leaves to candidates.
    budget: f64,
    /// Number of the row to recommend if this case were the only one.
    alone: Option<usize>,
    /// Number of candidates cheaper than the recommended one that exceed the tolerances in this case;
    /// `ruled_out_alone` counts those that only this case rules out.
    ruled_out: usize,
    ruled_out_alone: usize,
    /// Integration of the equations of all nodes, if these are the reference.
    nodal: Option<NodalFacts>,
    /// Errors of the body of row 1, and of its versions before enrichment, relative to the model in this
    /// case.
    #[serde(rename = "reference_lacks")]
    reference_errors: Vec<ReferenceErrorFacts>,
}

/// Returns the load cases of a study; empty for a single scene.
pub(super) fn case_facts<'a>(
    trade: &'a Trade,
    reference_errors: &[Vec<ReferenceError>],
) -> Vec<TradeCaseFacts<'a>> {
    let taken = trade.recommended.row().and_then(|row| trade.rows[row].outcome.as_ref().ok());
    let of = |(at, case): (usize, &'a flexbody_study::trade::TradeCase)| {
        let own: Option<&InCase> = taken.map(|measured| &measured.by_case[at]);
        let rounds = reference_errors.get(at).map_or(&[][..], Vec::as_slice);
        Some(TradeCaseFacts {
            name: case.name.as_deref()?,
            tolerance: case.tolerance,
            errors: own.map(|own| own.errors),
            worst: own.map(|own| own.worst),
            output: own.map(|own| own.errors.decisive(&case.tolerance).0),
            budget: (1.0 - case.reserved).max(0.0),
            alone: case.alone.row().map(|row| row + 1),
            ruled_out: case.ruled_out,
            ruled_out_alone: case.ruled_out_alone,
            nodal: case.nodal.as_ref().map(NodalFacts::new),
            reference_errors: rounds.iter().map(ReferenceErrorFacts::new).collect(),
        })
    };
    trade.cases.iter().enumerate().filter_map(of).collect()
}

impl TradeCaseFacts<'_> {
    /// Returns the effect of the case on the decision: `rules out 12 cheaper candidates, 3 of them alone`.
    fn decides(&self) -> String {
        match self.ruled_out {
            0 => "rules out no cheaper candidate".to_owned(),
            count => {
                let count = counted(count, "cheaper candidate");
                format!("rules out {count}, {} of them by this case alone", self.ruled_out_alone)
            }
        }
    }

    fn alone(&self, names: &[String]) -> String {
        self.alone.map_or_else(|| "no candidate".to_owned(), |row| names[row - 1].clone())
    }

    /// Returns the case in words: `braking: stress 1.2 %: 60 % of what is allowed; rules out ...; alone it
    /// takes 6 modes, W1`.
    pub(crate) fn in_words(&self, names: &[String]) -> String {
        let errors = self.errors.as_ref().map_or_else(String::new, |errors| {
            format!("{}: {} of the tolerance; ", errors_in_words(errors), part_in_words(self.worst))
        });
        format!(
            "{}: {errors}{}; recommended for this case alone: {}",
            self.name,
            self.decides(),
            self.alone(names)
        )
    }
}

/// Returns the table of the errors of the recommended candidate in every load case, and of the effect of each
/// case on the decision.
pub(super) fn cases_table(cases: &[TradeCaseFacts<'_>], names: &[String]) -> Table {
    let heads = [
        "Load case",
        "Errors",
        "Error / tolerance",
        "Decides",
        "Recommended alone",
        "Error of the reference (estimated)",
    ];
    let row = |case: &TradeCaseFacts<'_>| {
        let errors = case.errors.as_ref().map_or_else(|| "not measured".to_owned(), errors_in_words);
        let reference_errors =
            case.reference_errors.last().map_or_else(|| "not known".to_owned(), ReferenceErrorFacts::parts);
        cells([
            case.name.to_owned(),
            errors,
            part_in_words(case.worst),
            case.decides(),
            case.alone(names),
            reference_errors,
        ])
    };
    let caption = "The recommended candidate in each load case. A case rules out the cheaper candidates whose errors exceed its tolerances; the candidate recommended for it alone is the cheapest one within them.";
    Table::new(caption, heads, &[1, 3, 4, 5], cases.iter().map(row).collect())
}
