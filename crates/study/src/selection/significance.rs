//! Significance of every term of the equations of motion for a body and a scene: dimensionless (\[WP19\] eq. 28 and 36 to
//! 40, as corrected in the theory, section 11), and with the invariants of the body.

use super::norms::{Norms, change_of_inertia};
use super::situation::Situation;
use flexbody_body::flex_body::{FlexBody, TermGroup};
use nalgebra::{Matrix3, Vector3};

/// Size of a term relative to the term that it is compared with.
#[derive(Debug, Clone, PartialEq)]
pub struct Significance {
    /// Name of the term.
    pub term: &'static str,
    /// Name of the term that it is compared with.
    pub beside: &'static str,
    /// Formula of the dimensionless bound.
    pub formula: &'static str,
    /// Group of the kinetic energy that the term belongs to.
    pub group: TermGroup,
    /// Guideline of \[WP19\] section 8 that requires the term.
    pub guideline: &'static str,
    /// Bound from I0 and the frequencies (tier 0).
    pub bound: f64,
    /// Bound with the norms of the invariants (tier 1); `None` if the body does not hold them, or if they do not bound
    /// the term.
    pub of_body: Option<f64>,
}

/// Description of a term.
struct Term {
    name: &'static str,
    beside: &'static str,
    formula: &'static str,
    group: TermGroup,
    guideline: &'static str,
}

const fn term(
    name: &'static str,
    beside: &'static str,
    formula: &'static str,
    group: TermGroup,
    guideline: &'static str,
) -> Term {
    Term { name, beside, formula, group, guideline }
}

/// Descriptions of all terms, in the order of [`sizes`].
const TERMS: [Term; 8] = [
    term("linear inertia W1 Q", "I0", "2 eta", TermGroup::W1, "III"),
    term("quadratic inertia Q'W2 Q", "I0", "eta^2", TermGroup::W2, "III, free slender bodies"),
    term(
        "inertia coupling Q'W3",
        "I0 (Schur complement)",
        "eta^2",
        TermGroup::W3,
        "III, free slender bodies",
    ),
    term(
        "constant centrifugal load W1'w w / 2",
        "elastic forces at the largest amplitude",
        "w^2 sqrt(e'I0 e) / (Omega_1^2 |q|)",
        TermGroup::W1,
        "II",
    ),
    term(
        "centrifugal load that grows with q, W2 Q w w",
        "elastic forces",
        "(w / Omega_1)^2",
        TermGroup::W2,
        "III",
    ),
    term(
        "Coriolis force on modes 2 W3' Qd w",
        "inertia forces of the modes",
        "2 w / Omega_1",
        TermGroup::W3,
        "IV",
    ),
    term("Euler force on modes Q'W3 alpha", "elastic forces", "alpha / Omega_1^2", TermGroup::W3, "III"),
    term(
        "Coriolis torque 2 w (sqrt(tr J) + |q|) |qd|",
        "I0 w Omega_1",
        "2 |q| (sqrt(tr J) + |q|) / I0",
        TermGroup::W1,
        "IV",
    ),
];

/// Index of the first of [`TERMS`] that the norms of the invariants do not bound: the Coriolis torque has components
/// perpendicular to the axis.
const WITHOUT_NORM: usize = TERMS.len() - 1;

/// Returns the relative sizes of the terms for rotation about `axis`, in the order of [`TERMS`]. `own` is the inertia of
/// the body without attached parts, which bounds the terms of its deformation.
fn sizes(situation: &Situation, own: &Matrix3<f64>, norms: &Norms, axis: &Vector3<f64>) -> [f64; 8] {
    let inertia = &situation.inertia;
    let (q, w, alpha) = (situation.amplitude.value, situation.spin.value, situation.acceleration.value);
    let trace = (0.5 * own.trace()).sqrt();
    let about = axis.dot(&(inertia * axis));
    [
        2.0 * norms.centrifugal * q / about,
        norms.spin * q * q / about,
        (norms.coupling * q).powi(2) / about,
        norms.centrifugal_energy * w * w / (norms.first * q),
        norms.softening * w * w,
        2.0 * norms.coupling * w / situation.first_rate.value,
        norms.coupling * alpha / (norms.first * norms.first),
        2.0 * q * (trace + q) / about,
    ]
}

/// Returns the largest significance of every term over all load cases.
pub(super) fn largest_significances(cases: impl Iterator<Item = Vec<Significance>>) -> Vec<Significance> {
    let larger = |mut all: Vec<Significance>, other: Vec<Significance>| {
        for (one, other) in all.iter_mut().zip(other) {
            one.bound = one.bound.max(other.bound);
            one.of_body = one.of_body.zip(other.of_body).map(|(a, b)| a.max(b));
        }
        all
    };
    cases.reduce(larger).unwrap_or_default()
}

/// Returns the significance of all terms at the largest amplitudes and rates of a situation, for rotation about its
/// axis or, if it has none, about the principal axis of inertia with the largest value. The change W1 Q of the inertia of
/// a body without such an axis includes the products of inertia, relative to the geometric mean of both moments.
///
/// Symbols: eta = |q| / sqrt(e'I0 e); Omega_1 is the first circular frequency of the body (of the assembly for Coriolis
/// forces); w and alpha are the largest angular velocity and acceleration.
pub fn significances(situation: &Situation, body: &FlexBody) -> Vec<Significance> {
    let (invariants, eigenvalues) = (body.invariants(), &body.modes().eigenvalue);
    let driven = situation.driven.as_ref().ok().and_then(|driven| driven.rotation.axis);
    let rigid = invariants.inertia();
    // Axis of rotation, or the principal axes.
    let axes = match driven {
        Some(axis) => vec![axis],
        None if body.dimension() == 2 => vec![Vector3::z()],
        None => {
            let principal = situation.inertia.symmetric_eigen().eigenvectors;
            principal.column_iter().map(|axis| axis.into_owned()).collect()
        }
    };
    let largest = |norms: &dyn Fn(&Vector3<f64>) -> Option<Norms>| -> Option<[f64; 8]> {
        axes.iter().try_fold([0.0; 8], |most: [f64; 8], axis| {
            let own = sizes(situation, &rigid, &norms(axis)?, axis);
            Some(std::array::from_fn(|i| most[i].max(own[i])))
        })
    };
    // Largest value over the axes, at tier 0 and tier 1.
    let bound = largest(&|axis| Some(Norms::of_rigid(&rigid, eigenvalues, Some(axis))));
    let mut bound = bound.unwrap_or([f64::INFINITY; 8]);
    let mut of_body = largest(&|axis| Norms::of_invariants(invariants, eigenvalues, Some(axis)));
    // Modes may change products of inertia and no moment of inertia.
    let about = |inertia: &Matrix3<f64>, axis: &Vector3<f64>| axis.dot(&(inertia * axis));
    for (at, e) in axes.iter().enumerate() {
        for f in &axes[at + 1..] {
            let relative = situation.amplitude.value
                / (about(&situation.inertia, e) * about(&situation.inertia, f)).sqrt();
            bound[0] = bound[0].max((about(&rigid, e).sqrt() + about(&rigid, f).sqrt()) * relative);
            if let Some((own, change)) = of_body.as_mut().zip(change_of_inertia(invariants, e, f)) {
                own[0] = own[0].max(change * relative);
            }
        }
    }
    let significance = |(i, term): (usize, Term)| Significance {
        term: term.name,
        beside: term.beside,
        formula: term.formula,
        group: term.group,
        guideline: term.guideline,
        bound: bound[i],
        of_body: of_body.filter(|_| i < WITHOUT_NORM).map(|own| own[i]),
    };
    TERMS.into_iter().enumerate().map(significance).collect()
}
