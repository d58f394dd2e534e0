//! Errors that lumped masses would have caused.

use super::lumped_effect::{LumpedEffect, in_words};
use super::numbers::{percent, significant};
use super::run_data::LumpedModes;
use flexbody_body::flex_body::LumpedBody;
use flexbody_body::invariants::{ERROR_NORMS, Invariants};
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

/// Returns true if error `a` exceeds error `b`. NaN, an unknown error, exceeds every number.
fn exceeds(a: f64, b: f64) -> bool {
    (a.is_nan() && !b.is_nan()) || a > b
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
