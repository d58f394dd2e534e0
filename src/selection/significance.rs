//! Significance of every term of the equations of motion for a body and a scene: unit-free ([WP19] eq. 28 and 36 to 40, as corrected in the
//! theory, section 11), and with the invariants of the body.

use super::norms::Norms;
use super::situation::Situation;
use crate::flex_body::Group;
use nalgebra::Vector3;

/// How large a term is beside what it stands next to.
#[derive(Debug, Clone, PartialEq)]
pub struct Significance {
    /// The term.
    pub term: &'static str,
    /// Beside what.
    pub beside: &'static str,
    /// The unit-free bound as a formula.
    pub formula: &'static str,
    /// Group of the kinetic energy that it belongs to.
    pub group: Group,
    /// Guideline of [WP19] section 8 that asks for it.
    pub guideline: &'static str,
    /// Bound from I0 and the frequencies (tier 0).
    pub bound: f64,
    /// Bound with the norms of the invariants (tier 1), where the body holds them.
    pub of_body: Option<f64>,
}

/// The sizes of all terms at the largest amplitudes and rates of a situation.
///
/// With eta = |q| / sqrt(I_min), I_min the least principal inertia, Omega_1 the first circular frequency of the body (of the
/// assembly for Coriolis forces), w and alpha the largest angular velocity and acceleration.
pub fn significances(situation: &Situation, rigid: &Norms, own: Option<&Norms>) -> Vec<Significance> {
    let least = situation.inertia.symmetric_eigenvalues().min();
    let (q, w, alpha) = (situation.amplitude.value, situation.spin.value, situation.acceleration.value);
    let first = rigid.first;
    let eta = q / least.sqrt();
    let most = situation.inertia.symmetric_eigenvalues().max();
    let trace = (0.5 * situation.inertia.trace()).sqrt();
    let of = |norms: &Norms| {
        [
            norms.inertia * q / least,
            norms.spin * q * q / least,
            (norms.coupling * q).powi(2) / least,
            norms.centrifugal_energy * w * w / (first * q),
            norms.softening * w * w,
            2.0 * norms.coupling * w / situation.first_rate.value,
            norms.coupling * alpha / (first * first),
            2.0 * first * q * (norms.inertia / 2.0 + norms.spin * q) / most,
        ]
    };
    let mut bound = of(rigid);
    // Along its own axis linear inertia is at most 2 eta.
    bound[0] = bound[0].min(2.0 * eta);
    bound[7] = bound[7].min(2.0 * first * q * (trace + q) / most);
    let rows: [(&str, &str, &str, Group, &str); 8] = [
        ("linear inertia W1 Q", "I0", "2 eta", Group::W1, "III"),
        ("quadratic inertia Q'W2 Q", "I0", "eta^2", Group::W2, "III, free slender bodies"),
        ("inertia coupling Q'W3", "I0 (Schur complement)", "eta^2", Group::W3, "III, free slender bodies"),
        (
            "constant centrifugal load W1'w w / 2",
            "elastic forces at the largest amplitude",
            "w^2 sqrt(I0) / (Omega_1^2 |q|)",
            Group::W1,
            "II",
        ),
        (
            "centrifugal load that grows with q, W2 Q w w",
            "elastic forces",
            "(w / Omega_1)^2",
            Group::W2,
            "III",
        ),
        (
            "Coriolis force on modes 2 W3' Qd w",
            "inertia forces of the modes",
            "2 w / Omega_1",
            Group::W3,
            "IV",
        ),
        ("Euler force on modes Q'W3 alpha", "elastic forces", "alpha / Omega_1^2", Group::W3, "IV"),
        (
            "Coriolis torque 2 w (sqrt(tr J) + |q|) |qd|",
            "I0 w per unit of time",
            "2 Omega_1 |q| (sqrt(tr J) + |q|) / I0",
            Group::W1,
            "III",
        ),
    ];
    let own = own.map(of);
    rows.into_iter()
        .enumerate()
        .map(|(i, (term, beside, formula, group, guideline))| Significance {
            term,
            beside,
            formula,
            group,
            guideline,
            bound: bound[i],
            of_body: own.map(|own| own[i].min(bound[i])),
        })
        .collect()
}

/// The centrifugal static response of every mode to spin of unit rate about the body axes, f_p / lambda_p ([WP19] section 5): rows x, y, z.
pub fn centrifugal_responses(body: &crate::flex_body::FlexBody) -> Option<Vec<[f64; 3]>> {
    let (w1, nf) = (body.invariants().w1()?, body.n_modes());
    let response = |j: usize, axis: usize| 0.5 * w1[(axis, axis * nf + j)] / body.modes().eigenvalue[j];
    Some((0..nf).map(|j| Vector3::from_fn(|axis, _| response(j, axis)).into()).collect())
}
