//! Effect of lumped masses on a body in the terms of an engineer: moments of inertia, and the worst error in
//! the invariants of the modes.

use super::mass_properties::{centre_of_mass, inertia_about_com, principal_moments};
use super::numbers::significant;
use flexbody_body::invariants::{Invariants, LumpedScheme};

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
    if !a.1.is_nan() && (b.1.is_nan() || b.1.abs() > a.1.abs()) { b } else { a }
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
pub(super) fn meaning(invariant: &str) -> &'static str {
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

/// Returns all defects of lumped masses in words, unphysical ones first: `NEGATIVE masses at 410 nodes, smallest
/// inertia +1.4 %, W2 8 % off`. If `explained`, the invariant carries its meaning.
///
/// `norms` are the worst norm of each invariant, by the name of the invariant.
pub(super) fn in_words(
    negative_masses: usize,
    effect: &LumpedEffect,
    norms: &[(&str, f64)],
    explained: bool,
) -> String {
    let mut found = Vec::new();
    match negative_masses {
        0 => {}
        1 => found.push("NEGATIVE masses at 1 node".to_owned()),
        count => found.push(format!("NEGATIVE masses at {count} nodes")),
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
        assert!(in_words(1, &effect, &norms, true).starts_with("NEGATIVE masses at 1 node, "));
        let none = LumpedEffect { mass: 0.0, moments: [0.0; 3], centre: 0.0 };
        assert_eq!(in_words(0, &none, &[("W2", 1e-15)], true), "no error above 1e-9");
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
