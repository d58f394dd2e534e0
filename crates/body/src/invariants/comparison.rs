//! Error norms of lumped invariants against the exact ones (theory section 9).

use super::cauchy_schwarz::scaled;
use super::dense::{frobenius_norm, spectral_norm};
use super::{CauchySchwarz, Invariants};
use faer::{Mat, MatRef};
use flexbody_linalg::larger;
use nalgebra::{Matrix3, Vector3};

/// Name and meaning of every number of [`error_norms`], in its order. X stands for the exact invariant, D
/// for the lumped one minus X. Every number is dimensionless, and zero without difference.
///
/// Each invariant has one scale. `I0`, `W2` and the modal mass never vanish: their norms are relative to
/// the norm of X. `W1` and `W3` vanish for symmetric bodies, `C1` and `C2` for free-surface modes: their
/// norms are relative to the norm of X or, if that is smaller, to the bound of theory section 7 for a unit
/// of modal coordinate, with mu^2 the largest eigenvalue of m_ff (1 for mass-normalised modes) and I_max
/// that of I0. The `max` numbers are relative to the Cauchy-Schwarz bound ([`CauchySchwarz`]) entry by
/// entry, which shows an error about a slender axis that a norm hides.
pub const ERROR_NORMS: [(&str, &str); 23] = [
    ("mass", "|m_l - m| / m"),
    ("com_shift", "distance of the centres of mass / radius of gyration sqrt(tr J_com / m)"),
    ("modal_mass_frobenius", "|D|_F / |X|_F of m_ff = Psi' M Psi: lost orthonormality of the modes"),
    ("modal_mass_spectral", "|D|_2 / |X|_2"),
    ("modal_mass_max", "largest |D_pq| / (|psi_p| |psi_q|)"),
    ("I0_frobenius", "|D|_F / |X|_F of I0"),
    ("I0_spectral", "|D|_2 / |X|_2"),
    ("I0_max", "largest |D_kl| / sqrt(I0_kk I0_ll)"),
    ("W1_frobenius", "|D|_F / max(|X|_F, 2 mu sqrt(I_max)) of W1"),
    ("W1_spectral", "|D|_2 / max(|X|_2, 2 mu sqrt(I_max))"),
    ("W1_max", "largest |D_kl,p| / (2 sqrt(I0_kk) |psi_p|), for l != k / (sqrt(I0_mm) |psi_p|)"),
    ("W2_frobenius", "|D|_F / |X|_F of W2"),
    ("W2_spectral", "|D|_2 / |X|_2"),
    ("W2_max", "largest |D_pq| / (|psi_p| |psi_q|)"),
    ("W3_frobenius", "|D|_F / max(|X|_F, mu^2) of W3"),
    ("W3_spectral", "|D|_2 / max(|X|_2, mu^2)"),
    ("W3_max", "largest |D_pq| / (|psi_p| |psi_q|)"),
    ("C1_frobenius", "|D|_F / max(|X|_F, mu sqrt(m)) of C1"),
    ("C1_spectral", "|D|_2 / max(|X|_2, mu sqrt(m))"),
    ("C1_max", "largest |D_kp| / (sqrt(m) |psi_p|)"),
    ("C2_frobenius", "|D|_F / max(|X|_F, mu sqrt(I_max)) of C2"),
    ("C2_spectral", "|D|_2 / max(|X|_2, mu sqrt(I_max))"),
    ("C2_max", "largest |D_kp| / (sqrt(I0_kk) |psi_p|)"),
];

/// Returns the error norms of `other` against `exact`, by name, in the order of [`ERROR_NORMS`]. Norms of
/// W1, W2 and W3 are omitted if one of the two does not hold them. Both must belong to the same modes and
/// frame; NaN in either gives NaN.
///
/// # Panics
/// When the numbers of modes differ.
pub fn error_norms(exact: &Invariants, other: &Invariants) -> Vec<(String, f64)> {
    assert_eq!(exact.n_modes(), other.n_modes(), "modes of the two bodies");
    let nf = exact.n_modes().max(1); // columns exist only with modes, so the divisions below never see a zero
    let bound = CauchySchwarz::of(exact);
    let (a, b) = (exact.derived(), other.derived());
    let mode_norm = spectral_norm(a.modal_mass.as_ref()).sqrt();
    let largest_moment = spectral_norm(matrix(&a.inertia).as_ref());
    let rotation = mode_norm * largest_moment.sqrt();
    let translation = mode_norm * exact.0.mass.sqrt();
    let by_modes = |row: usize, column: usize| bound.s(row % nf, column % nf);

    let mut values = vec![
        Some(scaled(other.0.mass - exact.0.mass, exact.0.mass.abs())),
        Some(scaled(com_shift(exact, other), gyration_radius(exact))),
    ];
    let mut group =
        |x: Option<&Mat<f64>>, y: Option<&Mat<f64>>, least: f64, bound: &dyn Fn(usize, usize) -> f64| {
            values.extend(match x.zip(y) {
                Some((x, y)) => norms(x, y, least, bound).map(Some),
                None => [None; 3],
            });
        };
    let (inertia, others) = (matrix(&a.inertia), matrix(&b.inertia));
    group(Some(&a.modal_mass), Some(&b.modal_mass), 0.0, &by_modes);
    group(Some(&inertia), Some(&others), 0.0, &|k, l| bound.inertia(k, l));
    let w1_bound = |k: usize, column: usize| bound.w1(k, column / nf, column % nf);
    group(a.w1.as_ref(), b.w1.as_ref(), 2.0 * rotation, &w1_bound);
    group(a.w2.as_ref(), b.w2.as_ref(), 0.0, &by_modes);
    group(a.w3.as_ref(), b.w3.as_ref(), mode_norm * mode_norm, &by_modes);
    group(Some(&exact.0.c1), Some(&other.0.c1), translation, &|_, p| bound.c1(p));
    group(Some(&a.c2), Some(&b.c2), rotation, &|k, p| bound.c2(k, p));
    let named = ERROR_NORMS.iter().zip(values);
    named.filter_map(|((name, _), value)| Some(((*name).to_owned(), value?))).collect()
}

/// Returns the Frobenius norm, the spectral norm and the largest scaled entry of b - a. The first two are
/// relative to the norm of a, but at least to `least`.
fn norms(a: &Mat<f64>, b: &Mat<f64>, least: f64, bound: impl Fn(usize, usize) -> f64) -> [f64; 3] {
    let difference = Mat::from_fn(a.nrows(), a.ncols(), |p, q| b[(p, q)] - a[(p, q)]);
    let relative =
        |norm: fn(MatRef<'_, f64>) -> f64| scaled(norm(difference.as_ref()), larger(norm(a.as_ref()), least));
    let mut largest = 0.0;
    for q in 0..a.ncols() {
        for p in 0..a.nrows() {
            largest = larger(largest, scaled(difference[(p, q)], bound(p, q)));
        }
    }
    [relative(frobenius_norm), relative(spectral_norm), largest]
}

fn matrix(a: &Matrix3<f64>) -> Mat<f64> {
    Mat::from_fn(3, 3, |k, l| a[(k, l)])
}

fn centre_of_mass(invariants: &Invariants) -> Vector3<f64> {
    invariants.0.first_moment / invariants.0.mass
}

fn com_shift(exact: &Invariants, other: &Invariants) -> f64 {
    (centre_of_mass(other) - centre_of_mass(exact)).norm()
}

/// Returns the radius of gyration sqrt(tr J_com / m).
fn gyration_radius(body: &Invariants) -> f64 {
    (body.0.second_moment.trace() / body.0.mass - centre_of_mass(body).norm_squared()).max(0.0).sqrt()
}
