//! Identities that hold for every exact body (theory section 10), evaluated from the invariants.

use super::comparison::scaled;
use super::general::plane_w0;
use super::{BodyFrame, CauchySchwarz, Derived, Invariants, MassKind, identity_terms as terms};
use faer::Mat;
use nalgebra::Vector3;

/// Limit of identities that hold for the Gram matrix of any vectors: rounding of its sums, 1e-15 relative
/// to the Cauchy-Schwarz bounds, with a margin for data that were rotated or shifted after condensation.
const GRAM_LIMIT: f64 = 1e-12;
/// Limit of these identities if M does not commute with rotations. Such matrices often come condensed:
/// their entries are larger than the mass they add up to, and the sums for different directions agree to
/// fewer digits (6.5e-12 of the mass in an external superelement of NX Nastran with entries of 1e4 times
/// the mass; its body missed this identity by 1.3e-12 to 3.5e-12).
const GENERAL_MASS_LIMIT: f64 = 1e-10;
/// Limit of identities that hold for modes. The solver separates modes from each other and from rigid
/// motion to 1e-13; a residual of 1e-10 leaves 1e-10 in close pairs. Larger deviations mean that the
/// columns are not modes.
const MODE_LIMIT: f64 = 1e-9;
/// Limit of the products of inertia about principal axes: moments within 1e-9 of each other count as equal
/// and keep the model axes.
const PRINCIPAL_AXES_LIMIT: f64 = 2e-9;

/// One identity with its formula, the deviation of the body from it, and the result.
#[derive(Debug, Clone, PartialEq)]
pub struct IdentityCheck {
    /// Stable name.
    pub name: &'static str,
    /// Formula of the identity.
    pub formula: &'static str,
    /// Deviation, dimensionless, scaled by the Cauchy-Schwarz bound of its terms; 0 is perfect.
    pub value: f64,
    /// Largest value that passes.
    pub limit: f64,
    /// True if `value <= limit`; a NaN never passes.
    pub passed: bool,
}

impl IdentityCheck {
    /// Creates a check that passes if `value` is at most `limit`.
    pub fn new(name: &'static str, formula: &'static str, value: f64, limit: f64) -> Self {
        Self { name, formula, value, limit, passed: value <= limit }
    }

    /// Returns the check that comes closer to its limit, or exceeds it more.
    pub(crate) fn or_worse(self, other: Self) -> Self {
        let is_worse = other.value.is_nan() || other.value / other.limit > self.value / self.limit;
        if is_worse { other } else { self }
    }
}

/// Claims of a body, which decide the identities that apply.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expected<'a> {
    /// True if Psi' M Psi = I is claimed.
    pub mass_normalised: bool,
    /// True if the modes are claimed to be M-orthogonal to rigid motion.
    pub free_surface: bool,
    /// Body frame.
    pub frame: BodyFrame,
    /// Origin of the body frame in model coordinates. About a distant origin the centre of mass is known
    /// only to the spacing of floating-point numbers there.
    pub origin: Vector3<f64>,
    /// Eigenvalues lambda, if Psi' K Psi = diag(lambda) is claimed.
    pub eigenvalues: Option<&'a [f64]>,
    /// Relative noise of the lowest eigenvalue due to the digits of the input (`rigid_noise` of the
    /// certificate); 0 if unknown.
    pub eigenvalue_noise: f64,
    /// Part of the mass that turns with its nodes.
    pub turning: Turning,
    /// Bound of the rounding errors of products with K in any entry of Psi' K Psi, relative to
    /// sqrt(lambda_p lambda_q); 0 if unknown.
    pub eigenvalue_rounding: f64,
}

/// Part of the mass of a body that turns with its nodes, as far as it decides identities.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Turning {
    /// No rotation carries mass, or the mass keeps its directions along the axes of the body (files before
    /// format 1.6).
    #[default]
    None,
    /// Points and directors, and a part of the mass that does not turn: W0 = -C1~.
    Partial,
    /// Points and directors only: every formula of M = Ms kron I3 holds, except for signs of products,
    /// since the mass of directors may belong to no position.
    Whole,
}

/// Evaluates every identity that the primary data of a body must fulfil, in a fixed order.
///
/// No identity depends on the units, the origin or the axes, and none on the basis unless [`Expected`]
/// claims more. Identities about groups of the kinetic energy that the body does not hold are omitted.
pub fn identities(body: &Invariants, expected: &Expected<'_>) -> Vec<IdentityCheck> {
    let bound = CauchySchwarz::of(body);
    let check = IdentityCheck::new;
    let mut checks = vec![
        check("finite", "no NaN, no infinity", terms::not_finite(body), 0.0),
        check("mass_positive", "m > 0", if body.0.mass > 0.0 { 0.0 } else { 1.0 }, 0.0),
        check("second_moment_symmetric", "J = J'", terms::second_moment_asymmetry(body, &bound), GRAM_LIMIT),
    ];
    checks.extend(rigid_identities(body));
    checks.extend(gram_identities(body, &bound, expected.turning));
    checks.extend(mode_identities(body, expected, &bound));
    checks.extend(frame_identities(body, expected));
    checks
}

/// Returns the identities of products of rigid motion and modes that hold for any modes.
fn gram_identities(body: &Invariants, bound: &CauchySchwarz, turning: Turning) -> Vec<IdentityCheck> {
    let (check, groups) = (IdentityCheck::new, body.0.groups);
    let mut checks = Vec::new();
    if groups.w2 || groups.w3 {
        checks.push(check("s_transposed", "S_lk = S_kl'", terms::s_asymmetry(body, bound), GRAM_LIMIT));
    }
    checks.extend([
        check("c1_bounded", "|C1_kp| <= sqrt(m) |psi_p|", terms::c1_ratio(body, bound) - 1.0, GRAM_LIMIT),
        check(
            "motion_gram_psd",
            "[rigid Psi]' M [rigid Psi] positive semidefinite",
            terms::motion_gram_negative(body, bound),
            GRAM_LIMIT,
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
            GENERAL_MASS_LIMIT,
        )),
        None if body.0.general.is_some() => {}
        None => checks.extend(scalar_identities(body, bound)),
    }
    checks
}

/// Returns the identities of a mass of points and directors. Of a plane body only the rotation about z is known, and its
/// S is that of a lamina: W0 has the translations in the plane and the rotation about z, and S12 does not give W3, which
/// is skew since every block of the mass is a multiple of the unit matrix.
fn turning_identities(body: &Invariants, bound: &CauchySchwarz, turning: Turning) -> Vec<IdentityCheck> {
    let (check, nf, solid) = (IdentityCheck::new, body.n_modes(), body.as_solid());
    let is_plane = matches!(body.kind(), MassKind::Plane(_));
    let existing = |w0: Mat<f64>| if is_plane { plane_w0(&w0) } else { w0 };
    let by_column = |_: usize, column: usize| bound.c1(column % nf);
    let value = terms::difference(&existing(solid.w0()), &existing(body.w0()), &by_column);
    let mut checks = vec![check("w0_of_c1", "W0 = -C1~", value, GRAM_LIMIT)];
    if turning == Turning::Partial {
        return checks;
    }
    let by_modes = |row: usize, column: usize| bound.s(row % nf, column % nf);
    if let (Some(w3), Some(of_s), true) = (body.w3(), solid.w3(), body.0.groups.w2) {
        checks.push(if is_plane {
            let value = terms::w3_symmetric_part(&w3, bound);
            check("w3_skew", "every block of W3 skew", value, GENERAL_MASS_LIMIT)
        } else {
            let value = terms::difference(&of_s, &w3, &by_modes);
            check("w3_of_s", "W3_k = S_lm - S_ml", value, GENERAL_MASS_LIMIT)
        });
        let value = terms::difference(&solid.modal_mass(), &body.modal_mass(), &by_modes);
        checks.push(check("modal_mass_of_s", "m_ff = S11 + S22 + S33", value, GENERAL_MASS_LIMIT));
    }
    checks
}

/// Returns the identities of modes that are mass-normalised, orthogonal to rigid motion, or eigenvectors.
fn mode_identities(body: &Invariants, expected: &Expected<'_>, bound: &CauchySchwarz) -> Vec<IdentityCheck> {
    let check = IdentityCheck::new;
    let mut checks = Vec::new();
    if expected.mass_normalised {
        let value = terms::modal_mass_deviation(body);
        checks.push(check("modal_mass_identity", "S11 + S22 + S33 = I", value, MODE_LIMIT));
    }
    if expected.free_surface {
        checks.push(check("c1_zero", "C1 = 0", terms::c1_ratio(body, bound), MODE_LIMIT));
        checks.push(check("c2_zero", "C2 = 0", terms::c2_ratio(body, bound), MODE_LIMIT));
        if body.0.groups.w1 {
            let value = terms::ibar_asymmetry(body, bound);
            checks.push(check("ibar_symmetric", "Ibar_kl = Ibar_lk", value, MODE_LIMIT));
        }
    }
    if let Some(eigenvalues) = expected.eigenvalues {
        let value = terms::stiffness_deviation(body, eigenvalues);
        // `eigenvalue_noise` was measured on rigid motion; the noise of the modes is of similar size.
        let limit = MODE_LIMIT + 10.0 * expected.eigenvalue_noise + expected.eigenvalue_rounding;
        checks.push(check("modal_stiffness_diagonal", "Psi' K Psi = diag(lambda)", value, limit));
    }
    checks
}

/// Returns the identities that follow from the choice of the body frame.
fn frame_identities(body: &Invariants, expected: &Expected<'_>) -> Vec<IdentityCheck> {
    let check = IdentityCheck::new;
    let mut checks = Vec::new();
    if expected.frame != BodyFrame::Model {
        let radius = (body.0.second_moment.trace() / body.0.mass).sqrt();
        let value = scaled(body.0.first_moment.norm(), body.0.mass * radius);
        let limit = GRAM_LIMIT + 4.0 * f64::EPSILON * scaled(expected.origin.norm(), radius);
        checks.push(check("first_moment_zero", "c = 0: origin at the centre of mass", value, limit));
    }
    if expected.frame == BodyFrame::Principal {
        let value = terms::products_of_inertia(body);
        checks.push(check("inertia_diagonal", "I0 diagonal: principal axes", value, PRINCIPAL_AXES_LIMIT));
    }
    checks
}

/// Returns the identities of the rigid-body inertia. For M = Ms kron I3, J is a sum of products of
/// positions. Masses with inertia of their own, such as a wheel on a beam, have a positive semidefinite I0
/// but no such J.
fn rigid_identities(body: &Invariants) -> Vec<IdentityCheck> {
    let check = IdentityCheck::new;
    if body.0.general.is_some() {
        let value = terms::inertia_negative(body);
        let formula = "I0 about the centre of mass positive semidefinite";
        return vec![check("inertia_psd", formula, value, GRAM_LIMIT)];
    }
    vec![
        check(
            "second_moment_psd",
            "J - c c'/m positive semidefinite",
            terms::second_moment_negative(body),
            GRAM_LIMIT,
        ),
        check(
            "inertia_triangle",
            "I_3 <= I_1 + I_2 about the centre of mass",
            terms::triangle_excess(body),
            GRAM_LIMIT,
        ),
    ]
}

/// Returns the identities for M = Ms kron I3: Ibar and S are then products of one set of vectors in all
/// directions.
fn scalar_identities(body: &Invariants, bound: &CauchySchwarz) -> Vec<IdentityCheck> {
    let (check, groups) = (IdentityCheck::new, body.0.groups);
    let mut checks = Vec::new();
    if groups.w2 {
        checks.push(check("s_psd", "S_kk positive semidefinite", terms::s_negative(body), GRAM_LIMIT));
        checks.push(check(
            "s_bounded",
            "|S_kl,pq| <= |psi_p| |psi_q|",
            terms::s_excess(body, bound),
            GRAM_LIMIT,
        ));
    }
    if groups.w1 {
        let value = terms::ibar_excess(body, bound);
        checks.push(check("ibar_bounded", "|Ibar_kl,p| <= sqrt(J_kk) |psi_p|", value, GRAM_LIMIT));
    }
    if let Some(w3) = body.w3() {
        let value = terms::w3_symmetric_part(&w3, bound);
        checks.push(check("w3_skew", "every block of W3 skew", value, GRAM_LIMIT));
        let value = terms::w3_excess(&w3, &body.modal_mass());
        checks.push(check("w3_bounded", "|block of W3|_2 <= |m_ff|_2", value, GRAM_LIMIT));
    }
    if groups.w1 && groups.w2 {
        checks.push(check(
            "scalar_gram_psd",
            "[1 x Psi_1 Psi_2 Psi_3]' Ms [...] positive semidefinite",
            terms::scalar_gram_negative(body, bound),
            GRAM_LIMIT,
        ));
    }
    checks
}

/// Excess of a body over the bounds of points of mass, relative to |m_ff|_2; zero for groups it does not hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundsBroken {
    /// Magnitude of the smallest eigenvalue of the blocks S_kk if it is negative.
    pub s_negative: f64,
    /// Largest |block of W3|_2 less 1, at least 0.
    pub w3_excess: f64,
}

/// Returns the excess of `body` over the bounds S_kk >= 0 and |block of W3|_2 <= |m_ff|_2. They are
/// identities of points of mass; masses that turn with nodes fulfil them if every node and its neighbours
/// have a positive semidefinite second moment.
pub fn bounds_broken(body: &Invariants) -> BoundsBroken {
    let s_negative = if body.0.groups.w2 { terms::s_negative(body) } else { 0.0 };
    let w3_excess = body.w3().map_or(0.0, |w3| terms::w3_excess(&w3, &body.modal_mass()));
    BoundsBroken { s_negative, w3_excess: w3_excess.max(0.0) }
}

/// Checks that stored invariants follow from the primary data, and W3 from the stored W2.
///
/// The blocks of W3 are W2(2,3) - W2(3,2), W2(3,1) - W2(1,3), W2(1,2) - W2(2,1) (theory section 2), unless
/// M does not commute with rotations. A missing array, an array of wrong shape, and an array of a group
/// that the body does not hold have an infinite deviation.
pub fn derived_identities(body: &Invariants, stored: &Derived) -> Vec<IdentityCheck> {
    let nf = body.n_modes();
    let bound = CauchySchwarz::of(body);
    let computed = body.derived();
    let by_modes = |row: usize, column: usize| bound.s(row % nf, column % nf);
    let check = |name, formula, a: &Mat<f64>, b: &Mat<f64>, bound: &dyn Fn(usize, usize) -> f64| {
        IdentityCheck::new(name, formula, terms::difference(a, b, bound), GRAM_LIMIT)
    };
    let (i0, stored_i0) = (terms::matrix(&computed.inertia), terms::matrix(&stored.inertia));
    let w1 = |k: usize, column: usize| bound.w1(k, column / nf, column % nf);
    let mut checks = vec![
        check("i0_of_j", "I0 = tr(J) I - J", &i0, &stored_i0, &|k, l| bound.inertia(k, l)),
        check("c2_of_ibar", "C2_k = Ibar_lm - Ibar_ml", &computed.c2, &stored.c2, &|k, p| bound.c2(k, p)),
        check(
            "modal_mass_of_s",
            "m_ff = S11 + S22 + S33",
            &computed.modal_mass,
            &stored.modal_mass,
            &by_modes,
        ),
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
        &computed.w1,
        &stored.w1,
        &w1,
    );
    group("w2_of_s", "W2_kl = -S_lk, W2_kk = S_ll + S_mm", &computed.w2, &stored.w2, &by_modes);
    group("w3_of_s", "W3_k = S_lm - S_ml", &computed.w3, &stored.w3, &by_modes);
    if let Some((w2, w3)) = stored.w2.as_ref().zip(stored.w3.as_ref()).filter(|_| body.0.general.is_none()) {
        let expected = terms::w3_of_w2(w2, nf);
        checks.push(check("w3_of_w2", "W3_k = W2_lm - W2_ml", &expected, w3, &by_modes));
    }
    checks
}
