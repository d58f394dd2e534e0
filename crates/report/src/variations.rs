//! Errors of a recommended body in variations of its scene.

use super::numbers::{counted, significant};
use flexbody_motion::scene::OutputErrors;
use flexbody_study::reference::MAX_REFERENCE_ERROR;
use flexbody_study::selection::VariedSelection;
#[cfg(feature = "hdf5")]
use flexbody_study::trade::{InCase, Trade, TradeVariation};
use serde::Serialize;

/// Errors in a variation.
#[derive(Debug, Clone, Serialize)]
pub(super) struct VariationFacts<'a> {
    name: &'a str,
    /// Load case that is varied, if there are several.
    #[serde(skip_serializing_if = "Option::is_none")]
    case: Option<&'a str>,
    /// True if the scene file states the variation; false for a standard one.
    stated: bool,
    holds: bool,
    errors: Option<OutputErrors>,
    /// Largest ratio of error to tolerance; `None` if the simulation stopped.
    worst: Option<f64>,
    /// Part of the tolerances that the truncation error of the reference takes.
    reference: Option<f64>,
}

impl<'a> VariationFacts<'a> {
    pub(super) fn of_selection(own: &'a VariedSelection) -> Self {
        Self {
            name: &own.name,
            case: own.case.as_deref(),
            stated: own.is_stated,
            holds: own.holds(),
            errors: own.chosen.errors,
            worst: Some(own.chosen.worst).filter(|worst| worst.is_finite()),
            reference: own.reference_errors.last().map(|reference_errors| reference_errors.worst),
        }
    }

    /// Returns the variations of a study with the errors of its recommended row; empty without such a row.
    #[cfg(feature = "hdf5")]
    pub(super) fn of_trade(trade: &'a Trade) -> Vec<Self> {
        let recommended = trade.recommended.row().and_then(|row| trade.rows[row].outcome.as_ref().ok());
        let Some(varied) = recommended.and_then(|measured| measured.varied.as_ref()) else {
            return Vec::new();
        };
        let facts = |(one, own): (&'a TradeVariation, &Option<InCase>)| Self {
            name: &one.name,
            case: one.case.as_deref(),
            stated: one.is_stated,
            holds: one.accepts(own.as_ref()),
            errors: own.map(|own| own.errors),
            worst: own.map(|own| own.worst),
            reference: one.reference.as_ref().map(|own| own.worst),
        };
        trade.variations.iter().zip(&varied.by_variation).map(facts).collect()
    }

    fn is_judged(&self) -> bool {
        self.holds || self.reference.is_none_or(|part| part <= MAX_REFERENCE_ERROR)
    }
}

/// Returns the errors in all variations in one sentence; `None` if there are none.
pub(super) fn in_words(variations: &[VariationFacts<'_>]) -> Option<String> {
    let count = variations.len();
    if count == 0 {
        return None;
    }
    let kind = if variations[0].stated { "stated" } else { "standard" };
    let of = |which: &dyn Fn(&&VariationFacts<'_>) -> bool| -> Vec<&VariationFacts<'_>> {
        variations.iter().filter(|one| which(one)).collect()
    };
    let failing = of(&|one| !one.holds && one.is_judged());
    let unjudged = of(&|one| !one.is_judged());
    let size = |one: &VariationFacts<'_>| {
        let part =
            one.worst.map_or("stops".to_owned(), |worst| format!("{} %", significant(100.0 * worst, 2)));
        format!("{}: {part}", one.name)
    };
    let list = |some: &[&VariationFacts<'_>]| some.iter().map(|one| size(one)).collect::<Vec<_>>().join(", ");
    let mut words = format!("{} ({kind}) that did not choose the body", counted(count, "variation"));
    let worst = variations.iter().filter(|one| one.holds).filter_map(|one| one.worst).fold(0.0, f64::max);
    if failing.is_empty() && unjudged.is_empty() {
        let worst = significant(100.0 * worst, 2);
        words.push_str(&format!(": within the tolerances, largest error {worst} % of its tolerance"));
    }
    if !failing.is_empty() {
        words.push_str(&format!(
            ": exceeds the tolerances (error in % of the tolerance) in {}; make such a variation a [[case]] of the scene if it can occur",
            list(&failing)
        ));
    }
    if !unjudged.is_empty() {
        let names: Vec<&str> = unjudged.iter().map(|one| one.name).collect();
        words.push_str(&format!(
            "; cannot be judged in {}: the reference differs too much from the FE model there",
            names.join(", ")
        ));
    }
    Some(words)
}
