//! Deviations of a body from each identity: dimensionless numbers, NaN if a number of the body is NaN.

use super::comparison::scaled;
use super::derived::{CYCLIC, inertia_of};
use super::transform::{entries, spectral_norm, symmetric_eigenvalues};
use super::{CauchySchwarz, Invariants};
use faer::Mat;
use flexbody_linalg::{dense_cholesky, larger};
use libm::hypot;
use nalgebra::Matrix3;

/// Returns the largest f over a rectangle of indices, at least 0.
fn over(rows: usize, columns: usize, f: impl Fn(usize, usize) -> f64) -> f64 {
    let mut largest = 0.0;
    for q in 0..columns {
        for p in 0..rows {
            largest = larger(largest, f(p, q));
        }
    }
    largest
}

/// Returns the number of entries that are not finite.
pub(super) fn not_finite(body: &Invariants) -> f64 {
    let rigid = [body.0.mass]
        .into_iter()
        .chain(body.0.first_moment.iter().copied())
        .chain(body.0.second_moment.iter().copied());
    let modal = entries(body.0.c1.as_ref()).chain(entries(body.0.modal_stiffness.as_ref()));
    let ibar = body.0.ibar.iter().flatten().flatten().copied();
    let s = body.0.s.iter().flatten().flat_map(|s| entries(s.as_ref()));
    let general = body.0.general.iter().flat_map(|g| [&g.w0, &g.w3, &g.modal_mass]);
    let general = general.flat_map(|a| entries(a.as_ref()));
    rigid.chain(modal).chain(ibar).chain(s).chain(general).filter(|v| !v.is_finite()).count() as f64
}

pub(super) fn second_moment_asymmetry(body: &Invariants, bound: &CauchySchwarz) -> f64 {
    let j = &body.0.second_moment;
    over(3, 3, |k, l| scaled(j[(k, l)] - j[(l, k)], bound.second_moment(k, l)))
}

/// Returns J about the centre of mass.
fn central(body: &Invariants) -> Matrix3<f64> {
    body.0.second_moment - body.0.first_moment * body.0.first_moment.transpose() / body.0.mass
}

pub(super) fn second_moment_negative(body: &Invariants) -> f64 {
    // The scale is not the trace, which may be negative too.
    negative(&matrix(&central(body)), body.0.second_moment.diagonal().abs().sum())
}

/// Returns the magnitude of a negative smallest principal moment about the centre of mass, relative to the
/// sum of all moments.
pub(super) fn inertia_negative(body: &Invariants) -> f64 {
    negative(&matrix(&inertia_of(&central(body))), body.inertia().diagonal().abs().sum())
}

/// Returns the excess of the largest principal moment about the centre of mass over the sum of the other
/// two.
pub(super) fn triangle_excess(body: &Invariants) -> f64 {
    let moments = symmetric_eigenvalues(matrix(&inertia_of(&central(body))).as_ref());
    moments.map_or(f64::NAN, |i| {
        scaled((i[2] - i[1] - i[0]).max(0.0), body.0.second_moment.diagonal().abs().sum())
    })
}

pub(super) fn s_asymmetry(body: &Invariants, bound: &CauchySchwarz) -> f64 {
    let nf = body.n_modes();
    over(3, 3, |k, l| {
        over(nf, nf, |p, q| scaled(body.0.s[k][l][(p, q)] - body.0.s[l][k][(q, p)], bound.s(p, q)))
    })
}

pub(super) fn s_negative(body: &Invariants) -> f64 {
    let scale = spectral_norm(body.modal_mass().as_ref());
    over(3, 1, |k, _| negative(&body.0.s[k][k], scale))
}

pub(super) fn s_excess(body: &Invariants, bound: &CauchySchwarz) -> f64 {
    let nf = body.n_modes();
    over(3, 3, |k, l| over(nf, nf, |p, q| scaled(body.0.s[k][l][(p, q)], bound.s(p, q)) - 1.0))
}

pub(super) fn ibar_excess(body: &Invariants, bound: &CauchySchwarz) -> f64 {
    over(3, 3, |k, l| over(body.n_modes(), 1, |p, _| scaled(body.0.ibar[k][l][p], bound.ibar(k, p)) - 1.0))
}

pub(super) fn ibar_asymmetry(body: &Invariants, bound: &CauchySchwarz) -> f64 {
    over(3, 3, |k, l| {
        let size = |p| match body.0.general {
            // Ibar represents W1 and C2: the difference is C2 about the third axis.
            Some(_) if k != l => bound.c2(3 - k - l, p),
            _ => hypot(bound.ibar(k, p), bound.ibar(l, p)),
        };
        over(body.n_modes(), 1, |p, _| scaled(body.0.ibar[k][l][p] - body.0.ibar[l][k][p], size(p)))
    })
}

pub(super) fn c1_ratio(body: &Invariants, bound: &CauchySchwarz) -> f64 {
    over(3, body.n_modes(), |k, p| scaled(body.0.c1[(k, p)], bound.c1(p)))
}

pub(super) fn c2_ratio(body: &Invariants, bound: &CauchySchwarz) -> f64 {
    let c2 = body.c2();
    over(3, body.n_modes(), |k, p| scaled(c2[(k, p)], bound.c2(k, p)))
}

pub(super) fn w3_symmetric_part(w3: &Mat<f64>, bound: &CauchySchwarz) -> f64 {
    let nf = w3.ncols();
    over(3, 1, |k, _| over(nf, nf, |p, q| scaled(w3[(k * nf + p, q)] + w3[(k * nf + q, p)], bound.s(p, q))))
}

pub(super) fn w3_excess(w3: &Mat<f64>, modal_mass: &Mat<f64>) -> f64 {
    let nf = w3.ncols();
    let scale = spectral_norm(modal_mass.as_ref());
    over(3, 1, |k, _| scaled(spectral_norm(w3.as_ref().subrows(k * nf, nf)), scale) - 1.0)
}

/// Returns the negative part of the Gram matrix of [1, x, y, z, Psi_1, Psi_2, Psi_3] with columns of unit
/// size.
pub(super) fn scalar_gram_negative(body: &Invariants, bound: &CauchySchwarz) -> f64 {
    let nf = body.n_modes();
    let size = |i: usize| match i {
        0 => body.0.mass.sqrt(),
        1..4 => bound.second_moment(i - 1, i - 1).sqrt(),
        _ => bound.mode((i - 4) % nf),
    };
    unit_gram_negative(4 + 3 * nf, size, |i, j| match (i, j) {
        (0, 0) => body.0.mass,
        (0, 1..4) => body.0.first_moment[j - 1],
        (0, _) => body.0.c1[((j - 4) / nf, (j - 4) % nf)],
        (1..4, 1..4) => body.0.second_moment[(i - 1, j - 1)],
        (1..4, _) => body.0.ibar[i - 1][(j - 4) / nf][(j - 4) % nf],
        _ => body.0.s[(i - 4) / nf][(j - 4) / nf][((i - 4) % nf, (j - 4) % nf)],
    })
}

/// Returns the negative part of the Gram matrix of rigid motions and modes, [Phi_t, Phi_r, Psi]' M [...],
/// with columns of unit size.
pub(super) fn motion_gram_negative(body: &Invariants, bound: &CauchySchwarz) -> f64 {
    let (i0, c2, modal_mass) = (body.inertia(), body.c2(), body.modal_mass());
    let coupling = -body.0.first_moment.cross_matrix();
    let size = |i: usize| match i {
        0..3 => body.0.mass.sqrt(),
        3..6 => bound.inertia(i - 3, i - 3).sqrt(),
        _ => bound.mode(i - 6),
    };
    unit_gram_negative(6 + body.n_modes(), size, |i, j| match (i, j) {
        (0..3, 0..3) => body.0.mass * f64::from(u8::from(i == j)),
        (0..3, 3..6) => coupling[(i, j - 3)],
        (0..3, _) => body.0.c1[(i, j - 6)],
        (3..6, 3..6) => i0[(i - 3, j - 3)],
        (3..6, _) => c2[(i - 3, j - 6)],
        _ => modal_mass[(i - 6, j - 6)],
    })
}

/// Returns the negative part of the Gram matrix of [Phi_t, B, Psi], with columns in units of their modes:
/// kinetic energy is never negative for any modes.
pub(super) fn velocity_gram_negative(
    body: &Invariants,
    w2: &Mat<f64>,
    w3: &Mat<f64>,
    bound: &CauchySchwarz,
) -> f64 {
    let nf = body.n_modes();
    let (w0, modal_mass) = (body.w0(), body.modal_mass());
    // The size is that of the mode: a rotation about the direction in which a mode moves all nodes has size
    // zero.
    let size = |i: usize| match i {
        0..3 => body.0.mass.sqrt(),
        _ => bound.mode((i - 3) % nf),
    };
    unit_gram_negative(3 + 4 * nf, size, |i, j| match (i, j) {
        (0..3, 0..3) => body.0.mass * f64::from(u8::from(i == j)),
        (0..3, _) if j < 3 + 3 * nf => w0[(i, j - 3)],
        (0..3, _) => body.0.c1[(i, j - 3 - 3 * nf)],
        _ if j < 3 + 3 * nf => w2[(i - 3, j - 3)],
        _ if i < 3 + 3 * nf => w3[(i - 3, j - 3 - 3 * nf)],
        _ => modal_mass[(i - 3 - 3 * nf, j - 3 - 3 * nf)],
    })
}

/// Returns the negative part of a Gram matrix given by its upper triangle, with its vectors divided by
/// their size.
fn unit_gram_negative(n: usize, size: impl Fn(usize) -> f64, upper: impl Fn(usize, usize) -> f64) -> f64 {
    let sizes: Vec<f64> = (0..n).map(size).collect();
    let unit = Mat::from_fn(n, n, |i, j| {
        let value = upper(i.min(j), i.max(j));
        // A mode of size zero has no mass: its row must vanish.
        if value == 0.0 { 0.0 } else { value / sizes[i] / sizes[j] }
    });
    negative(&unit, 1.0)
}

pub(super) fn modal_mass_deviation(body: &Invariants) -> f64 {
    let modal_mass = body.modal_mass();
    over(body.n_modes(), body.n_modes(), |p, q| (modal_mass[(p, q)] - f64::from(u8::from(p == q))).abs())
}

/// Returns the deviation of Psi' K Psi from diag(lambda), entries relative to sqrt(lambda_p lambda_q).
pub(super) fn stiffness_deviation(body: &Invariants, eigenvalues: &[f64]) -> f64 {
    let nf = body.n_modes();
    if eigenvalues.len() != nf {
        return f64::INFINITY;
    }
    let floor = f64::EPSILON * eigenvalues.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let size = |p: usize| eigenvalues[p].abs().max(floor).sqrt();
    over(nf, nf, |p, q| {
        let expected = if p == q { eigenvalues[p] } else { 0.0 };
        scaled(body.0.modal_stiffness[(p, q)] - expected, size(p) * size(q))
    })
}

/// Returns the largest product of inertia about the frame origin, relative to the largest moment.
pub(super) fn products_of_inertia(body: &Invariants) -> f64 {
    let i0 = body.inertia();
    over(3, 3, |k, l| if k == l { 0.0 } else { scaled(i0[(k, l)], i0.amax()) })
}

/// Returns W3 by its identity with W2; empty if W2 has the wrong shape.
pub(super) fn w3_of_w2(w2: &Mat<f64>, nf: usize) -> Mat<f64> {
    if (w2.nrows(), w2.ncols()) != (3 * nf, 3 * nf) {
        return Mat::new();
    }
    Mat::from_fn(3 * nf, nf, |row, q| {
        let ((_, l, m), p) = (CYCLIC[row / nf], row % nf);
        w2[(l * nf + p, m * nf + q)] - w2[(m * nf + p, l * nf + q)]
    })
}

/// Returns the largest difference of two matrices, entry by entry relative to a bound; infinite if the
/// shapes differ.
pub(super) fn difference(a: &Mat<f64>, b: &Mat<f64>, bound: &dyn Fn(usize, usize) -> f64) -> f64 {
    if (a.nrows(), a.ncols()) != (b.nrows(), b.ncols()) {
        return f64::INFINITY;
    }
    over(a.nrows(), a.ncols(), |p, q| scaled(a[(p, q)] - b[(p, q)], bound(p, q)))
}

pub(super) fn matrix(a: &Matrix3<f64>) -> Mat<f64> {
    Mat::from_fn(3, 3, |k, l| a[(k, l)])
}

/// Number of rows above which definiteness is tested by a Cholesky factorisation: eigenvalues take a
/// hundred times as long.
const MIN_CHOLESKY_ROWS: usize = 400;

/// Diagonal shift of a large matrix before its factorisation, relative to its scale: a part of the rounding
/// error that is allowed.
const RELATIVE_SHIFT: f64 = 2e-13;

/// Returns the magnitude of a negative smallest eigenvalue of a symmetric matrix, relative to `scale`; for
/// a large matrix an upper bound.
fn negative(a: &Mat<f64>, scale: f64) -> f64 {
    let shifted = || {
        let entry = |i: usize, j: usize| a[(i, j)] + if i == j { RELATIVE_SHIFT * scale } else { 0.0 };
        Mat::from_fn(a.nrows(), a.ncols(), entry)
    };
    if a.nrows() > MIN_CHOLESKY_ROWS && scale.is_finite() && dense_cholesky(shifted()).is_some() {
        return RELATIVE_SHIFT;
    }
    let smallest = symmetric_eigenvalues(a.as_ref()).map(|values| values.first().copied().unwrap_or(0.0));
    smallest.map_or(f64::NAN, |value| scaled(value.min(0.0), scale))
}
