//! Identities that hold for every exact body (theory section 10), evaluated from the invariants.

use super::cauchy_schwarz::scaled;
use super::identity_terms as terms;
use super::{BodyFrame, CauchySchwarz, Derived, Invariants};
use faer::Mat;
use nalgebra::Vector3;

/// Limit of what holds for the Gram matrix of any vectors: rounding of its sums, 1e-15 relative to the
/// Cauchy-Schwarz bounds, with room for data that were rotated or shifted after they were condensed.
const ROUNDING: f64 = 1e-12;
/// Limit of the same where M does not commute with rotations. Such matrices often come condensed: their
/// entries are larger than the mass that they add up to, which directions then agree on to fewer digits
/// (6.5e-12 of the mass in an external superelement of NX Nastran with entries of 1e4 times the mass; its
/// body was 1.3e-12 to 3.5e-12 from this identity).
const CONDENSED: f64 = 1e-10;
/// Limit of what holds for modes: the solver separates them from each other and from rigid motion to 1e-13, a
/// residual of 1e-10 leaves 1e-10 in close pairs; worse modes are not modes.
const MODAL: f64 = 1e-9;
/// Limit of the products of inertia about principal axes: moments within 1e-9 of each other count as equal
/// and keep the model axes.
const PRINCIPAL: f64 = 2e-9;

/// One identity: what it says, how far the body is from it, and whether that is near enough.
#[derive(Debug, Clone, PartialEq)]
pub struct IdentityCheck {
    /// Name, stable.
    pub name: &'static str,
    /// What must hold.
    pub formula: &'static str,
    /// How far it is missed, dimensionless, scaled by the Cauchy-Schwarz bound of its terms; 0 is perfect.
    pub value: f64,
    /// Largest value that passes.
    pub limit: f64,
    /// Whether `value <= limit`; a NaN never passes.
    pub passed: bool,
}

impl IdentityCheck {
    /// Passed where `value` is at most `limit`.
    pub fn new(name: &'static str, formula: &'static str, value: f64, limit: f64) -> Self {
        Self { name, formula, value, limit, passed: value <= limit }
    }
}

/// What a body claims to be: decides which identities apply.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expected<'a> {
    /// Psi' M Psi = I.
    pub mass_normalised: bool,
    /// Modes are M-orthogonal to rigid motion.
    pub free_surface: bool,
    /// Body frame.
    pub frame: BodyFrame,
    /// Origin of the body frame in model coordinates: about a distant origin the centre of mass is known to
    /// the spacing of numbers there.
    pub origin: Vector3<f64>,
    /// lambda, when Psi' K Psi is to be diag(lambda).
    pub eigenvalues: Option<&'a [f64]>,
    /// Relative noise of the lowest eigenvalue that the digits of the input leave (the certificate's
    /// `rigid_noise`); 0 when unknown.
    pub eigenvalue_noise: f64,
    /// The part of the mass that turns with its nodes.
    pub turning: Turning,
    /// What rounding of the products with K may leave in any entry of Psi' K Psi, relative to sqrt(lambda_p
    /// lambda_q); 0 when unknown.
    pub eigenvalue_rounding: f64,
}

/// The part of the mass of a body that turns with its nodes, as far as identities know it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Turning {
    /// No rotation carries mass, or the mass is kept along the axes of the body (files before format 1.6).
    #[default]
    None,
    /// Points and directors, and a part that does not turn: W0 = -C1~.
    InPart,
    /// Points and directors alone: every formula of M = Ms kron I3 holds, but for signs of products, since the mass of
    /// directors may be one of no places.
    Whole,
}

/// Evaluates every identity that the primary data of a body must fulfil, in a fixed order.
///
/// None depends on the units, the origin or the axes, nor on the basis except where [`Expected`] says more of
/// it. What is about groups of the kinetic energy that the body does not hold is not among them.
pub fn identities(body: &Invariants, expected: &Expected<'_>) -> Vec<IdentityCheck> {
    let bound = CauchySchwarz::of(body);
    let check = IdentityCheck::new;
    let mut checks = vec![
        check("finite", "no NaN, no infinity", terms::not_finite(body), 0.0),
        check("mass_positive", "m > 0", if body.0.mass > 0.0 { 0.0 } else { 1.0 }, 0.0),
        check("second_moment_symmetric", "J = J'", terms::second_moment_asymmetry(body, &bound), ROUNDING),
    ];
    checks.extend(rigid_identities(body));
    checks.extend(gram_identities(body, &bound, expected.turning));
    checks.extend(mode_identities(body, expected, &bound));
    checks.extend(frame_identities(body, expected));
    checks
}

/// What products of rigid motion and modes must be, whatever the modes are.
fn gram_identities(body: &Invariants, bound: &CauchySchwarz, turning: Turning) -> Vec<IdentityCheck> {
    let (check, groups) = (IdentityCheck::new, body.0.groups);
    let mut checks = Vec::new();
    if groups.w2 || groups.w3 {
        checks.push(check("s_transposed", "S_lk = S_kl'", terms::s_asymmetry(body, bound), ROUNDING));
    }
    checks.extend([
        check("c1_bounded", "|C1_kp| <= sqrt(m) |psi_p|", terms::c1_ratio(body, bound) - 1.0, ROUNDING),
        check(
            "motion_gram_psd",
            "[rigid Psi]' M [rigid Psi] positive semidefinite",
            terms::motion_gram_negative(body, bound),
            ROUNDING,
        ),
    ]);
    if turning != Turning::None {
        checks.extend(turning_identities(body, bound, turning));
        return checks;
    }
    match body.w2().zip(body.w3()).filter(|_| body.0.general.is_some()) {
        Some((w2, w3)) => checks.push(check(
            "velocity_gram_psd",
            "[Phi_t B Psi]' M [Phi_t B Psi] positive semidefinite",
            terms::velocity_gram_negative(body, &w2, &w3, bound),
            CONDENSED,
        )),
        None if body.0.general.is_some() => {}
        None => checks.extend(scalar_identities(body, bound)),
    }
    checks
}

/// Identities of a mass of points and directors.
fn turning_identities(body: &Invariants, bound: &CauchySchwarz, turning: Turning) -> Vec<IdentityCheck> {
    let (check, nf, solid) = (IdentityCheck::new, body.n_modes(), body.as_solid());
    let difference = terms::difference(&solid.w0(), &body.w0(), &|_, column| bound.c1(column % nf));
    let mut checks = vec![check("w0_of_c1", "W0 = -C1~", difference, ROUNDING)];
    if turning == Turning::InPart {
        return checks;
    }
    let by_modes = |row: usize, column: usize| bound.s(row % nf, column % nf);
    if let (Some(own), Some(of_s), true) = (body.w3(), solid.w3(), body.0.groups.w2) {
        let value = terms::difference(&of_s, &own, &by_modes);
        checks.push(check("w3_of_s", "W3_k = S_lm - S_ml", value, CONDENSED));
        let value = terms::difference(&solid.modal_mass(), &body.modal_mass(), &by_modes);
        checks.push(check("modal_mass_of_s", "m_ff = S11 + S22 + S33", value, CONDENSED));
    }
    checks
}

/// What holds for modes that are mass-normalised, orthogonal to rigid motion, or eigenvectors.
fn mode_identities(body: &Invariants, expected: &Expected<'_>, bound: &CauchySchwarz) -> Vec<IdentityCheck> {
    let check = IdentityCheck::new;
    let mut checks = Vec::new();
    if expected.mass_normalised {
        let value = terms::modal_mass_deviation(body);
        checks.push(check("modal_mass_identity", "S11 + S22 + S33 = I", value, MODAL));
    }
    if expected.free_surface {
        checks.push(check("c1_zero", "C1 = 0", terms::c1_ratio(body, bound), MODAL));
        checks.push(check("c2_zero", "C2 = 0", terms::c2_ratio(body, bound), MODAL));
        if body.0.groups.w1 {
            let value = terms::ibar_asymmetry(body, bound);
            checks.push(check("ibar_symmetric", "Ibar_kl = Ibar_lk", value, MODAL));
        }
    }
    if let Some(eigenvalues) = expected.eigenvalues {
        let value = terms::stiffness_deviation(body, eigenvalues);
        // Of rigid motion: that of the modes is of its size, not the same.
        let limit = MODAL + 10.0 * expected.eigenvalue_noise + expected.eigenvalue_rounding;
        checks.push(check("modal_stiffness_diagonal", "Psi' K Psi = diag(lambda)", value, limit));
    }
    checks
}

/// What the choice of the body frame promises.
fn frame_identities(body: &Invariants, expected: &Expected<'_>) -> Vec<IdentityCheck> {
    let check = IdentityCheck::new;
    let mut checks = Vec::new();
    if expected.frame != BodyFrame::Model {
        let radius = (body.0.second_moment.trace() / body.0.mass).sqrt();
        let value = scaled(body.0.first_moment.norm(), body.0.mass * radius);
        let limit = ROUNDING + 4.0 * f64::EPSILON * scaled(expected.origin.norm(), radius);
        checks.push(check("first_moment_zero", "c = 0: origin at the centre of mass", value, limit));
    }
    if expected.frame == BodyFrame::Principal {
        let value = terms::products_of_inertia(body);
        checks.push(check("inertia_diagonal", "I0 diagonal: principal axes", value, PRINCIPAL));
    }
    checks
}

/// What the inertia of the rigid body must be. J is the sum of products of places where M = Ms kron I3;
/// masses with inertia of their own, as of a wheel on a beam, have I0 that is positive semidefinite, and no J
/// of any places.
fn rigid_identities(body: &Invariants) -> Vec<IdentityCheck> {
    let check = IdentityCheck::new;
    if body.0.general.is_some() {
        let value = terms::inertia_negative(body);
        let formula = "I0 about the centre of mass positive semidefinite";
        return vec![check("inertia_psd", formula, value, ROUNDING)];
    }
    vec![
        check(
            "second_moment_psd",
            "J - c c'/m positive semidefinite",
            terms::second_moment_negative(body),
            ROUNDING,
        ),
        check(
            "inertia_triangle",
            "I_3 <= I_1 + I_2 about the centre of mass",
            terms::triangle_excess(body),
            ROUNDING,
        ),
    ]
}

/// What holds where M = Ms kron I3: Ibar and S are products of the same vectors then, direction by direction.
fn scalar_identities(body: &Invariants, bound: &CauchySchwarz) -> Vec<IdentityCheck> {
    let (check, groups) = (IdentityCheck::new, body.0.groups);
    let mut checks = Vec::new();
    if groups.w2 {
        checks.push(check("s_psd", "S_kk positive semidefinite", terms::s_negative(body), ROUNDING));
        checks.push(check(
            "s_bounded",
            "|S_kl,pq| <= |psi_p| |psi_q|",
            terms::s_excess(body, bound),
            ROUNDING,
        ));
    }
    if groups.w1 {
        let value = terms::ibar_excess(body, bound);
        checks.push(check("ibar_bounded", "|Ibar_kl,p| <= sqrt(J_kk) |psi_p|", value, ROUNDING));
    }
    if let Some(w3) = body.w3() {
        let value = terms::w3_symmetric_part(&w3, bound);
        checks.push(check("w3_skew", "every block of W3 skew", value, ROUNDING));
        let value = terms::w3_excess(&w3, &body.modal_mass());
        checks.push(check("w3_bounded", "|block of W3|_2 <= |m_ff|_2", value, ROUNDING));
    }
    if groups.w1 && groups.w2 {
        checks.push(check(
            "scalar_gram_psd",
            "[1 x Psi_1 Psi_2 Psi_3]' Ms [...] positive semidefinite",
            terms::scalar_gram_negative(body, bound),
            ROUNDING,
        ));
    }
    checks
}

/// Evaluates that stored invariants follow from the primary data, and W3 from the stored W2.
///
/// The blocks of W3 are W2(2,3) - W2(3,2), W2(3,1) - W2(1,3), W2(1,2) - W2(2,1) (theory section 2), unless M
/// does not commute with rotations. A stored array of the wrong shape, one that is missing, and one that the
/// body does not hold miss their identity infinitely.
pub fn derived_identities(body: &Invariants, stored: &Derived) -> Vec<IdentityCheck> {
    let nf = body.n_modes();
    let bound = CauchySchwarz::of(body);
    let own = body.derived();
    let by_modes = |row: usize, column: usize| bound.s(row % nf, column % nf);
    let check = |name, formula, a: &Mat<f64>, b: &Mat<f64>, bound: &dyn Fn(usize, usize) -> f64| {
        IdentityCheck::new(name, formula, terms::difference(a, b, bound), ROUNDING)
    };
    let (i0, stored_i0) = (terms::matrix(&own.inertia), terms::matrix(&stored.inertia));
    let w1 = |k: usize, column: usize| bound.w1(k, column / nf, column % nf);
    let mut checks = vec![
        check("i0_of_j", "I0 = tr(J) I - J", &i0, &stored_i0, &|k, l| bound.inertia(k, l)),
        check("c2_of_ibar", "C2_k = Ibar_lm - Ibar_ml", &own.c2, &stored.c2, &|k, p| bound.c2(k, p)),
        check("modal_mass_of_s", "m_ff = S11 + S22 + S33", &own.modal_mass, &stored.modal_mass, &by_modes),
    ];
    let none = Mat::new();
    let mut group =
        |name, formula, a: &Option<Mat<f64>>, b: &Option<Mat<f64>>, bound: &dyn Fn(usize, usize) -> f64| {
            if a.is_some() || b.is_some() {
                checks.push(check(
                    name,
                    formula,
                    a.as_ref().unwrap_or(&none),
                    b.as_ref().unwrap_or(&none),
                    bound,
                ));
            }
        };
    group(
        "w1_of_ibar",
        "W1_kl = -(Ibar_kl + Ibar_lk), W1_kk = 2 (Ibar_ll + Ibar_mm)",
        &own.w1,
        &stored.w1,
        &w1,
    );
    group("w2_of_s", "W2_kl = -S_lk, W2_kk = S_ll + S_mm", &own.w2, &stored.w2, &by_modes);
    group("w3_of_s", "W3_k = S_lm - S_ml", &own.w3, &stored.w3, &by_modes);
    if let Some((w2, w3)) = stored.w2.as_ref().zip(stored.w3.as_ref()).filter(|_| body.0.general.is_none()) {
        let expected = terms::w3_of_w2(w2, nf);
        checks.push(check("w3_of_w2", "W3_k = W2_lm - W2_ml", &expected, w3, &by_modes));
    }
    checks
}
