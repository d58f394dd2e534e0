//! Errors that lumped masses would have caused.

use crate::mass_properties::{centre_of_mass, inertia_about_com, principal_moments};
use crate::notation::numbers::{percent, significant};
use crate::run_data::LumpedModes;
use flexbody_body::flex_body::LumpedBody;
use flexbody_body::invariants::{ERROR_NORMS, Invariants, LumpedScheme};
use flexbody_linalg::larger;
use flexbody_linalg::ties::{TIE_MARGIN, first_smallest};
use serde::{Serialize, Serializer};
use std::collections::{HashMap, HashSet};

/// An error norm and its meaning.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct ErrorNorm {
    /// Name of the norm: `W2_spectral`, ...
    pub name: String,
    /// Name of the invariant: `W2`, ...
    pub invariant: String,
    pub value: f64,
    /// Formula of the norm; empty for a name that this version does not know.
    pub meaning: &'static str,
}

impl ErrorNorm {
    fn new((name, value): &(String, f64)) -> Self {
        let meaning = ERROR_NORMS.iter().find(|(known, _)| known == name).map_or("", |(_, meaning)| meaning);
        Self { name: name.clone(), invariant: invariant_of(name).to_owned(), value: *value, meaning }
    }

    /// Returns the kind of norm in a word.
    pub(crate) fn kind(&self) -> &'static str {
        match self.name.rsplit('_').next() {
            Some("frobenius") => "Frobenius",
            Some("spectral") => "spectral",
            Some("max") => "entry",
            _ => "relative",
        }
    }
}

/// Returns the name of the invariant of a norm: `I0` of `I0_frobenius`. A name without a kind of norm is
/// returned unchanged.
fn invariant_of(name: &str) -> &str {
    ["_frobenius", "_spectral", "_max"].iter().find_map(|kind| name.strip_suffix(kind)).unwrap_or(name)
}

/// Returns the distinct names in the order of their first appearance.
pub(super) fn distinct<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut seen = HashSet::new();
    names.filter(|name| seen.insert(*name)).collect()
}

/// Errors by name: a JSON object in the order of the table.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Norms(pub Vec<(String, f64)>);

impl Serialize for Norms {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

/// Error norms of one scheme, with the worst of all and of each invariant.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Errors {
    pub worst: Option<ErrorNorm>,
    pub worst_by_invariant: Vec<ErrorNorm>,
    pub error_norms: Norms,
}

impl Errors {
    fn new(comparison: &[(String, f64)]) -> Self {
        let mut by_invariant: Vec<ErrorNorm> = Vec::new();
        let mut places: HashMap<String, usize> = HashMap::new();
        for norm in comparison.iter().map(ErrorNorm::new) {
            match places.get(&norm.invariant) {
                Some(&place) if exceeds(norm.value, by_invariant[place].value) => by_invariant[place] = norm,
                Some(_) => {}
                None => {
                    places.insert(norm.invariant.clone(), by_invariant.len());
                    by_invariant.push(norm);
                }
            }
        }
        let worse = |a: ErrorNorm, b: &ErrorNorm| if exceeds(b.value, a.value) { b.clone() } else { a };
        let worst = by_invariant.split_first().map(|(first, rest)| rest.iter().fold(first.clone(), worse));
        Self { worst, worst_by_invariant: by_invariant, error_norms: Norms(comparison.to_vec()) }
    }
}

/// Returns true if error `a` exceeds error `b` by more than rounding. NaN, an unknown error, exceeds every number.
fn exceeds(a: f64, b: f64) -> bool {
    (a.is_nan() && !b.is_nan()) || (is_error(a) && a > b * (1.0 + TIE_MARGIN))
}

/// Facts for question (a) of theory section 9: the exact modes with the invariants from lumped masses.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct LumpedFacts {
    pub scheme: String,
    pub mass: f64,
    pub negative_masses: usize,
    #[serde(skip)]
    pub effect: LumpedEffect,
    #[serde(flatten)]
    pub errors: Errors,
}

impl LumpedFacts {
    pub(crate) fn of(lumped: &LumpedBody, exact: &Invariants) -> Self {
        Self {
            scheme: lumped.scheme.clone(),
            mass: lumped.invariants.mass(),
            negative_masses: lumped.negative_masses,
            effect: LumpedEffect::of(exact, &lumped.invariants),
            errors: Errors::new(&lumped.comparison),
        }
    }

    /// Returns the invariant of the modes with the largest error; `None` if no error exceeds rounding.
    fn worst_of_modes(&self) -> Option<(&str, f64)> {
        let norms = self.errors.worst_by_invariant.iter().map(|norm| (norm.invariant.as_str(), norm.value));
        let modal = norms.filter(|(invariant, _)| !meaning(invariant).is_empty());
        modal.reduce(worse).filter(|(_, error)| is_error(*error))
    }

    /// Returns the errors of the lumped mass in words; if `explained`, each invariant of the modes carries
    /// its meaning.
    pub(crate) fn in_words(&self, explained: bool) -> String {
        let norms = &self.errors.worst_by_invariant;
        let norms: Vec<(&str, f64)> = norms.iter().map(|n| (n.invariant.as_str(), n.value)).collect();
        if norms.is_empty() && self.negative_masses == 0 {
            "not compared".to_owned()
        } else {
            in_words(self.negative_masses, &self.effect, &norms, explained)
        }
    }
}

/// Facts for question (b) of theory section 9: modes computed from the lumped masses as well.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct LumpedModesFacts {
    pub scheme: String,
    pub done: bool,
    pub remark: String,
    pub caution: String,
    pub frequency_hz: Vec<f64>,
    /// Largest relative change of a frequency, with both lists in ascending order; `None` without modes.
    pub worst_frequency_change: Option<f64>,
    /// Number (from 1) of the mode with that change.
    pub worst_frequency_mode: Option<usize>,
    pub subspace_cosine: f64,
    #[serde(flatten)]
    pub errors: Errors,
}

impl LumpedModesFacts {
    pub(crate) fn of(lumped: &LumpedModes, exact_hz: &[f64]) -> Self {
        let changes = lumped.frequencies_hz.iter().zip(exact_hz).map(|(lumped, exact)| lumped / exact - 1.0);
        let worst = changes.enumerate().reduce(|a, b| if exceeds(b.1.abs(), a.1.abs()) { b } else { a });
        Self {
            scheme: lumped.scheme.clone(),
            done: lumped.remark.is_empty(),
            remark: lumped.remark.clone(),
            caution: lumped.caution.clone(),
            frequency_hz: lumped.frequencies_hz.clone(),
            worst_frequency_change: worst.map(|(_, change)| change),
            worst_frequency_mode: worst.map(|(mode, _)| mode + 1),
            subspace_cosine: lumped.subspace_cosine,
            errors: Errors::new(&lumped.comparison),
        }
    }

    /// Returns the largest change and the cosine: `frequency 4 off by -10 %, subspace cosine 0.97`.
    pub(crate) fn in_words(&self) -> String {
        if !self.done {
            return format!("not done: {}", self.remark);
        }
        let (Some(change), Some(mode)) = (self.worst_frequency_change, self.worst_frequency_mode) else {
            return "no modes".to_owned();
        };
        let cosine = significant(self.subspace_cosine, 4);
        let caution = if self.caution.is_empty() { String::new() } else { format!("; {}", self.caution) };
        format!("frequency {mode} off by {}, subspace cosine {cosine}{caution}", percent(change))
    }
}

// Effect of lumped masses on a body in the terms of an engineer: moments of inertia, and the worst error in
// the invariants of the modes.

/// Largest error that counts as rounding and is not shown.
pub(super) const NEGLIGIBLE: f64 = 1e-9;

/// Changes caused by the lumped masses; NaN if unknown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LumpedEffect {
    /// Relative change of the mass.
    pub mass: f64,
    /// Relative changes of the principal moments about the centre of mass, ascending.
    pub moments: [f64; 3],
    /// Distance between the centres of mass, relative to the largest radius of gyration.
    pub centre: f64,
}

impl LumpedEffect {
    pub(crate) fn of(exact: &Invariants, lumped: &Invariants) -> Self {
        let moments = |invariants: &Invariants| principal_moments(&inertia_about_com(invariants));
        let (own, others) = (moments(exact), moments(lumped));
        let radius = (own[2] / exact.mass()).sqrt();
        Self {
            mass: lumped.mass() / exact.mass() - 1.0,
            moments: std::array::from_fn(|k| others[k] / own[k] - 1.0),
            centre: (centre_of_mass(lumped) - centre_of_mass(exact)).norm() / radius,
        }
    }

    /// Returns the largest relative change of mass, centre or a principal moment; NaN if one is not known.
    fn largest_inertia(&self) -> f64 {
        let [a, b, c] = self.moments;
        [self.mass, self.centre, a, b, c].into_iter().fold(0.0, |most, change| larger(most, change.abs()))
    }

    /// Returns the largest change in words if it exceeds rounding: `smallest inertia +1.4 %` or, if
    /// `explained`, `smallest principal moment of inertia 1.4 % too large`.
    fn in_words(&self, explained: bool) -> Option<String> {
        let all = [
            ("mass", self.mass),
            ("centre", self.centre),
            ("smallest", self.moments[0]),
            ("middle", self.moments[1]),
            ("largest", self.moments[2]),
        ];
        let (what, change) = all.into_iter().reduce(worse).filter(|(_, change)| is_error(*change))?;
        Some(match what {
            "mass" => format!("mass {}", off(change)),
            "centre" => format!("centre of mass off by {} of the radius of gyration", rough(change)),
            which if explained => format!("{which} principal moment of inertia {}", off(change)),
            which if change.is_nan() => format!("{which} inertia not known"),
            which => {
                format!("{which} inertia {}{}", if change > 0.0 { "+" } else { "-" }, rough(change.abs()))
            }
        })
    }
}

/// Returns the larger of two errors; an unknown error counts as the largest.
fn worse<'a>(a: (&'a str, f64), b: (&'a str, f64)) -> (&'a str, f64) {
    if !a.1.is_nan() && (b.1.is_nan() || b.1.abs() > a.1.abs() * (1.0 + TIE_MARGIN)) { b } else { a }
}

fn is_error(change: f64) -> bool {
    change.is_nan() || change.abs() > NEGLIGIBLE
}

/// Returns a change in words: `1.4 % too large`.
fn off(change: f64) -> String {
    match change {
        change if change.is_nan() => "not known".to_owned(),
        change if change > 0.0 => format!("{} too large", rough(change)),
        change => format!("{} too small", rough(-change)),
    }
}

/// Returns a ratio in percent with two digits.
fn rough(part: f64) -> String {
    if part.is_nan() { "an unknown part".to_owned() } else { format!("{} %", significant(100.0 * part, 2)) }
}

/// Returns the name of a lumping scheme in common usage.
pub(super) fn scheme_in_words(scheme: &str) -> &str {
    match LumpedScheme::from_name(scheme) {
        Some(LumpedScheme::RowSum) => "row sums",
        Some(LumpedScheme::DiagonalScaling) => "scaled diagonal",
        Some(LumpedScheme::User) => "user masses",
        None => scheme,
    }
}

/// Returns the physical meaning of an invariant of the modes.
fn meaning(invariant: &str) -> &'static str {
    match invariant {
        "modal_mass" => "the mass of the modes",
        "W1" => "how the inertia follows the deflection",
        "W2" => "the centrifugal forces on the modes",
        "W3" => "the Coriolis and Euler forces on the modes",
        "C1" => "the coupling of the modes with the translation",
        "C2" => "the coupling of the modes with the rotation",
        _ => "",
    }
}

/// Returns the readable name of an invariant beside its bars.
pub(super) fn invariant_in_words(invariant: &str) -> String {
    match invariant {
        "com_shift" => "centre of mass".to_owned(),
        "I0" => "I0: inertia".to_owned(),
        "W1" => "W1: inertia, deflected".to_owned(),
        "W2" => "W2: centrifugal forces".to_owned(),
        "W3" => "W3: Coriolis forces".to_owned(),
        "C1" => "C1: translation".to_owned(),
        "C2" => "C2: rotation".to_owned(),
        other => other.replace('_', " "),
    }
}

/// Error above which the choice between exact and lumped invariants matters.
const MATTERS: f64 = 1e-3;

/// Returns a sentence that judges whether the exact mass matrix matters for this body: by the scheme whose errors are
/// smallest. Returns `None` if nothing was compared.
pub(super) fn judgement(lumped: &[LumpedFacts]) -> Option<String> {
    let compared = lumped.iter().filter(|own| own.errors.worst.is_some());
    let largest = |own: &LumpedFacts| {
        larger(own.effect.largest_inertia(), own.worst_of_modes().map_or(0.0, |(_, e)| e))
    };
    let best = first_smallest(compared, |own| largest(own))?;
    let which = if lumped.len() > 1 { "the better of these lumped masses" } else { "these lumped masses" };
    let scheme = scheme_in_words(&best.scheme);
    let negative = match best.negative_masses {
        0 => String::new(),
        1 => ", and 1 node would have a negative mass".to_owned(),
        count => format!(", and {count} nodes would have negative masses"),
    };
    if largest(best) <= MATTERS && best.negative_masses == 0 {
        return Some(format!(
            "With {which} ({scheme}) no inertia and no invariant of the modes of the body would be off by more than 0.1 %: for this body the exact mass matrix makes no difference above that."
        ));
    }
    let inertia = match best.effect.largest_inertia() {
        change if is_error(change) => format!("off by up to {}", rough(change)),
        _ => "right".to_owned(),
    };
    let of_modes = best.worst_of_modes().map_or_else(String::new, |(invariant, error)| {
        let name = invariant.replace('_', " ");
        format!(
            ", the largest invariant of the modes off by {} ({name}: {})",
            rough(error),
            meaning(invariant)
        )
    });
    Some(format!(
        "With {which} ({scheme}) the inertia of the body would be {inertia}{of_modes}{negative}: for this body the exact mass matrix matters."
    ))
}

/// Returns all defects of lumped masses in words, unphysical ones first: `NEGATIVE masses at 410 nodes, smallest
/// inertia +1.4 %, W2 8 % off`. If `explained`, the invariant carries its meaning.
///
/// `norms` are the worst norm of each invariant, by the name of the invariant.
fn in_words(negative_masses: usize, effect: &LumpedEffect, norms: &[(&str, f64)], explained: bool) -> String {
    let mut found = Vec::new();
    let whose = if explained { " (made by this scheme; the model has no such masses)" } else { "" };
    match negative_masses {
        0 => {}
        1 => found.push(format!("NEGATIVE masses at 1 node{whose}")),
        count => found.push(format!("NEGATIVE masses at {count} nodes{whose}")),
    }
    found.extend(effect.in_words(explained));
    let modal = norms.iter().copied().filter(|(invariant, _)| !meaning(invariant).is_empty());
    if let Some((invariant, error)) = modal.reduce(worse).filter(|(_, error)| is_error(*error)) {
        let name = invariant.replace('_', " ");
        let name = if explained { format!("{} ({name})", meaning(invariant)) } else { name };
        found.push(format!("{name} {} off", rough(error)));
    }
    if found.is_empty() { "no error above 1e-9".to_owned() } else { found.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_name_the_worst_and_pass_over_rounding() {
        let effect = LumpedEffect { mass: 1e-15, moments: [0.0141, -0.002, 0.0], centre: 1e-12 };
        let norms = [("I0", 0.9), ("W1", 0.02), ("W2", 0.0823)];
        assert_eq!(
            in_words(410, &effect, &norms, false),
            "NEGATIVE masses at 410 nodes, smallest inertia +1.4 %, W2 8.2 % off"
        );
        let told = in_words(1, &effect, &norms, true);
        assert!(told.starts_with("NEGATIVE masses at 1 node (made by this scheme; "), "{told}");
        let none = LumpedEffect { mass: 0.0, moments: [0.0; 3], centre: 0.0 };
        assert_eq!(in_words(0, &none, &[("W2", 1e-15)], true), "no error above 1e-9");
    }

    #[test]
    fn the_judgement_is_that_of_the_better_scheme() {
        let scheme = |name: &str, error: f64, negative_masses: usize| LumpedFacts {
            scheme: name.to_owned(),
            mass: 1.0,
            negative_masses,
            effect: LumpedEffect { mass: 0.0, moments: [0.1 * error; 3], centre: 0.0 },
            errors: Errors::new(&[("W2_max".to_owned(), error)]),
        };
        let told = |all: &[LumpedFacts]| judgement(all).expect("a judgement");
        let matters = told(&[scheme("row-sum", 0.08, 410), scheme("diagonal-scaling", 0.2, 0)]);
        assert_eq!(
            matters,
            "With the better of these lumped masses (row sums) the inertia of the body would be off by up to 0.8 %, the largest invariant of the modes off by 8 % (W2: the centrifugal forces on the modes), and 410 nodes would have negative masses: for this body the exact mass matrix matters."
        );
        let none = told(&[scheme("row-sum", 9e-4, 0), scheme("diagonal-scaling", 0.2, 0)]);
        assert!(none.contains("makes no difference"), "{none}");
        assert!(told(&[scheme("row-sum", 9e-4, 3)]).contains("matters"));
        assert_eq!(judgement(&[]), None);
    }

    #[test]
    fn what_is_not_known_is_not_passed_over() {
        let effect = LumpedEffect { mass: f64::NAN, moments: [0.5, f64::NAN, 0.7], centre: 0.0 };
        assert_eq!(
            in_words(0, &effect, &[("W2", 0.5), ("W1", f64::NAN)], false),
            "mass not known, W1 an unknown part off"
        );
    }
}
