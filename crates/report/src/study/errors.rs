//! Errors of a recommended body: in words, relative to the model that it was made from, and in variations of its scene.

use crate::notation::numbers::{counted, significant};
use flexbody_base::numbers::joined_runs;
use flexbody_body::flex_body::{TermGroup, TermGroups};
use flexbody_motion::scene::{OutputErrors, PerQuantity};
use flexbody_study::reference::{MAX_REFERENCE_ERROR, ReferenceError};
use flexbody_study::selection::{EnoughParts, VariedSelection};
#[cfg(feature = "hdf5")]
use flexbody_study::trade::{InCase, Trade, TradeVariation};
use serde::Serialize;

/// Error whose digits are those of rounding: they differ between processors.
const ROUNDING: f64 = 1e-12;

/// Estimated error relative to an FE model whose digits hang on rounding: the estimate magnifies it.
const ROUNDING_OF_ESTIMATE: f64 = 1e-5;

/// Returns the error of a quantity in words: `0.001 rad` for the attitude, `60 % of its limit` for recoveries, `1 %` for
/// other quantities.
pub(super) fn error_in_words(quantity: &str, error: f64, digits: usize) -> String {
    above_in_words(quantity, error, ROUNDING, digits)
}

/// Returns the error of a quantity in words; `below 0.001 %` where it is not above `least`, but for zero.
fn above_in_words(quantity: &str, error: f64, least: f64, digits: usize) -> String {
    let number = |factor: f64| match error {
        error if 0.0 < error && error <= least => format!("below {}", significant(factor * least, 1)),
        error => significant(factor * error, digits),
    };
    match quantity {
        "attitude" => format!("{} rad", number(1.0)),
        "recovery" => format!("{} % of its limit", number(100.0)),
        _ => format!("{} %", number(100.0)),
    }
}

/// Returns errors with three digits: `attitude 1e-4 rad, deflection 0.2 %, stress 0.4 %`.
pub(super) fn errors_in_words(errors: &OutputErrors) -> String {
    errors_above(errors, ROUNDING, 3)
}

/// Returns the tolerances of a scene in words; a recovery has a limit of its own.
pub(super) fn tolerances_in_words(tolerances: &PerQuantity<f64>) -> String {
    let stated =
        OutputErrors { recovery: None, ..tolerances.map(|limit| limit.is_finite().then_some(limit)) };
    let words = errors_in_words(&stated);
    if tolerances.recovery.is_finite() { format!("{words}, recoveries within their limits") } else { words }
}

/// Returns the known errors in words with the given number of significant digits, those up to `least` as `below 0.001 %`.
fn errors_above(errors: &OutputErrors, least: f64, digits: usize) -> String {
    let part = |(name, error): (&str, Option<f64>)| {
        Some(format!("{name} {}", above_in_words(name, error?, least, digits)))
    };
    errors.named().into_iter().filter_map(part).collect::<Vec<_>>().join(", ")
}

/// Returns ascending numbers with runs joined: 1-4, 7, 9-10.
pub(super) fn ranges(numbers: &[usize]) -> String {
    joined_runs(numbers, ", ")
}

/// Returns the inertia terms of a model: `W1, W2 and W3`.
pub(super) fn groups_in_words(names: &[&str]) -> String {
    match names {
        [] => "the inertia of the undeformed body only".to_owned(),
        [only] => (*only).to_owned(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// Returns a ratio as `60 %`, or `not known`.
pub(super) fn part_in_words(part: Option<f64>) -> String {
    part.map_or_else(|| "not known".to_owned(), |part| format!("{} %", significant(100.0 * part, 2)))
}

// Errors of a body relative to the model that it was made from.

/// Errors of a body relative to its model.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct ReferenceErrorFacts {
    modes: usize,
    /// Errors by quantity. The attitude error is zero if the rotation is prescribed; the reaction error is
    /// `None` without prescribed motion.
    #[serde(flatten)]
    errors: OutputErrors,
    /// Largest ratio of error to tolerance; `None` if unknown.
    worst: Option<f64>,
    time: f64,
    /// Reason why the errors are unknown.
    unknown: Option<&'static str>,
}

impl ReferenceErrorFacts {
    pub(crate) fn new(reference: &ReferenceError) -> Self {
        let (modes, time, unknown) = (reference.modes, reference.time, reference.unknown);
        let known = |value: f64| unknown.is_none().then_some(value);
        Self {
            modes,
            errors: reference.errors.map(|error| error.and_then(known)),
            worst: known(reference.worst),
            time,
            unknown,
        }
    }

    /// Returns the errors in words: `attitude 0.0012 rad, deflection 0.5 %, stress 8.6 %`; with prescribed
    /// motion also `reaction 1.2 %`.
    pub(crate) fn parts(&self) -> String {
        if let Some(reason) = self.unknown {
            return format!("an unknown amount ({reason})");
        }
        let attitude = self.errors.attitude.filter(|angle| *angle > 0.0);
        errors_above(&OutputErrors { attitude, ..self.errors }, ROUNDING_OF_ESTIMATE, 2)
    }

    fn in_words(&self) -> String {
        let (parts, time) = (self.parts(), significant(self.time, 3));
        match self.unknown {
            Some(_) => format!("a body of {} modes differs from the FE model by {parts}", self.modes),
            None => format!(
                "a body of {} modes differs from the FE model by {parts}, most at t = {time}",
                self.modes
            ),
        }
    }
}

/// Returns the error of the reference of all measured errors in words: the last of `rounds`. The first entry
/// is the error before enrichment.
pub(super) fn reference_in_words(rounds: &[ReferenceErrorFacts]) -> String {
    match rounds {
        [] => "the body with all its modes; its difference from an FE model is not known".to_owned(),
        [own] => format!("{} (estimated)", own.in_words()),
        [first, .., own] => format!("{} (estimated; before enrichment {})", own.in_words(), first.in_words()),
    }
}

// Errors of a recommended body in variations of its scene.

/// Errors in a variation.
#[derive(Debug, Clone, Serialize)]
pub(super) struct VariationFacts<'a> {
    name: &'a str,
    /// Load case that is varied, if there are several.
    #[serde(skip_serializing_if = "Option::is_none")]
    case: Option<&'a str>,
    /// True if the scene file states the variation; false for a standard one.
    stated: bool,
    /// True if the recommended body must hold in it.
    required: bool,
    holds: bool,
    errors: Option<OutputErrors>,
    /// Largest ratio of error to tolerance; `None` if the simulation stopped.
    worst: Option<f64>,
    /// Part of the tolerances that the truncation error of the reference takes.
    reference: Option<f64>,
    /// Fewest parts found with which the body would hold; of a selection that need not hold and does not.
    #[serde(skip_serializing_if = "Option::is_none")]
    enough: Option<EnoughFacts>,
}

/// Parts of a body that hold in a variation.
#[derive(Debug, Clone, Serialize)]
struct EnoughFacts {
    /// Number of modes.
    modes: usize,
    /// Groups of terms.
    terms: Vec<&'static str>,
    /// True if these are more groups than the recommended ones.
    #[serde(skip)]
    has_more_terms: bool,
}

impl EnoughFacts {
    fn new(own: &EnoughParts, chosen: TermGroups) -> Self {
        Self {
            modes: own.modes,
            terms: own.groups.kept().map(TermGroup::name).collect(),
            has_more_terms: own.groups != chosen,
        }
    }

    fn in_words(&self) -> String {
        let modes = counted(self.modes, "mode");
        if self.has_more_terms { format!("{modes} with {}", groups_in_words(&self.terms)) } else { modes }
    }
}

impl<'a> VariationFacts<'a> {
    pub(super) fn of_selection(own: &'a VariedSelection) -> Self {
        Self {
            name: &own.name,
            case: own.case.as_deref(),
            stated: own.is_stated,
            required: own.is_required,
            holds: own.holds(),
            errors: own.chosen.errors,
            worst: Some(own.chosen.worst).filter(|worst| worst.is_finite()),
            reference: own.reference_errors.last().map(|reference_errors| reference_errors.worst),
            enough: own.enough.as_ref().map(|enough| EnoughFacts::new(enough, own.chosen.kept)),
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
            required: one.is_required,
            holds: one.accepts(own.as_ref()),
            errors: own.map(|own| own.errors),
            worst: own.map(|own| own.worst),
            reference: one.reference.as_ref().map(|own| own.worst),
            enough: None,
        };
        trade.variations.iter().zip(&varied.by_variation).map(facts).collect()
    }

    /// Returns the error of the body in a motion that it need not hold in, and what would hold there.
    fn if_it_happens(&self) -> String {
        let Self { name, worst, enough, .. } = self;
        if !self.is_judged() {
            return format!(
                "{name}: not known, since the body with all its modes differs from the FE model by {} of the tolerances there",
                part_in_words(self.reference.filter(|part| part.is_finite()))
            );
        }
        let Some(worst) = worst else { return format!("{name}: the simulation stops") };
        let part = format!("{name}: {} % of the tolerances", significant(100.0 * worst, 2));
        match enough {
            Some(enough) => format!("{part} ({} would hold)", enough.in_words()),
            None => part,
        }
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
    if variations.iter().all(|variation| !variation.required) {
        let all: Vec<String> = variations.iter().map(VariationFacts::if_it_happens).collect();
        return Some(format!("if the motion differs: {}", all.join("; ")));
    }
    let kind = if variations[0].stated { "stated" } else { "standard" };
    let of = |which: &dyn Fn(&&VariationFacts<'_>) -> bool| -> Vec<&VariationFacts<'_>> {
        variations.iter().filter(|variation| which(variation)).collect()
    };
    let failing = of(&|variation| !variation.holds && variation.is_judged());
    let unjudged = of(&|variation| !variation.is_judged());
    let size = |one: &VariationFacts<'_>| {
        let part =
            one.worst.map_or("stops".to_owned(), |worst| format!("{} %", significant(100.0 * worst, 2)));
        format!("{}: {part}", one.name)
    };
    let list = |some: &[&VariationFacts<'_>]| some.iter().map(|one| size(one)).collect::<Vec<_>>().join(", ");
    let mut words = format!("{} of the scene ({kind})", counted(count, "variation"));
    let worst = variations
        .iter()
        .filter(|variation| variation.holds)
        .filter_map(|variation| variation.worst)
        .fold(0.0, f64::max);
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

#[cfg(test)]
mod tests {

    #[test]
    fn runs_of_numbers_are_drawn_together() {
        assert_eq!(super::ranges(&[1, 2, 3, 5, 7, 8]), "1-3, 5, 7-8");
        assert_eq!(super::ranges(&[]), "");
    }

    #[test]
    fn groups_are_listed_with_an_and() {
        let none: &[&str] = &[];
        let lists = [none, &["W1"][..], &["W1", "W3"][..], &["W1", "W2", "W3"][..]];
        let expected = ["the inertia of the undeformed body only", "W1", "W1 and W3", "W1, W2 and W3"];
        assert_eq!(lists.map(super::groups_in_words), expected);
    }
}
