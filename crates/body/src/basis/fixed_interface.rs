//! Composition of a Craig-Bampton body, its proof of completeness, and its range of frequency.

use super::InterfaceCoordinates;
use faer::{Mat, MatRef};
use flexbody_linalg::{combine, gram, symmetric_eigen};
use nalgebra::DMatrix;

/// Fixed-interface modes of a Craig-Bampton basis, and estimates of the free body.
#[derive(Debug, Clone, PartialEq)]
pub struct FixedInterface {
    /// Number of fixed-interface modes in the basis; 0: static condensation.
    pub modes: usize,
    /// Number of motions of the interfaces (constraint modes).
    pub interface_motions: usize,
    /// Number of fixed-interface modes below `shift` by the inertia count of T'(K - sigma M)T; `None`: not
    /// counted.
    pub counted: Option<usize>,
    /// Shift sigma of the count. Unit: 1/time^2.
    pub shift: f64,
    /// Eigenvalue of the first truncated mode, if it was computed. Unit: 1/time^2.
    pub next: Option<f64>,
    /// Largest relative residual of a fixed-interface mode; 0 without any.
    pub residual: f64,
    /// Eigenvalues of the fixed-interface modes, ascending, for a body without interface coordinates. Empty
    /// if the stiffness in interface coordinates holds the eigenvalues, and for files up to 1.10. Unit:
    /// 1/time^2.
    pub eigenvalues: Vec<f64>,
    /// Estimated eigenvalues of the free body; the field is `None` if the modes are held at an interface or
    /// combined anew, and are no modes of the free body.
    pub free: Option<FreeEstimate>,
}

/// Estimates and bounds of the eigenvalues of the free body, one for each mode of the reduced body.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FreeEstimate {
    /// Estimated eigenvalues of the free body (nf), upper bounds of the exact ones. Unit: 1/time^2.
    pub estimate: Vec<f64>,
    /// Lower bounds of the eigenvalues of the free body (nf), up to rounding; 0 above the cut, or if the
    /// truncated modes have no proved lower bound. Unit: 1/time^2.
    pub lower: Vec<f64>,
}

impl FixedInterface {
    /// Returns true if the inertia count proves that no fixed-interface mode is missing below the highest
    /// one in the basis.
    pub fn is_proved(&self) -> bool {
        self.counted.is_some_and(|counted| counted >= self.modes)
    }

    /// Returns the facts for other modes of the same span, of a body without interface coordinates: the
    /// composition of the basis with its proof, the eigenvalues of the fixed-interface modes from the former
    /// `coordinates`, and no estimates of the free body.
    #[must_use]
    pub fn with_other_modes(&self, coordinates: Option<&InterfaceCoordinates>) -> Self {
        let eigenvalues = coordinates
            .map_or_else(|| self.eigenvalues.clone(), InterfaceCoordinates::fixed_interface_eigenvalues);
        Self { eigenvalues, free: None, ..*self }
    }
}

impl FreeEstimate {
    /// Returns the estimated relative error by which the frequency of mode `j`, with eigenvalue `theta` in
    /// the reduced body, is too high.
    ///
    /// # Panics
    /// When `j` is not below the number of modes.
    pub fn excess(&self, j: usize, theta: f64) -> f64 {
        ((theta / self.estimate[j]).sqrt() - 1.0).max(0.0)
    }

    /// Returns the upper bound of the relative error by which the frequency of mode `j`, with eigenvalue
    /// `theta` in the reduced body, is too high; `None` without a bound.
    ///
    /// # Panics
    /// When `j` is not below the number of modes.
    pub fn largest_excess(&self, j: usize, theta: f64) -> Option<f64> {
        let lower = self.lower[j];
        (lower > 0.0).then(|| ((theta / lower).sqrt() - 1.0).max(0.0))
    }

    /// Returns the number of lowest modes, with eigenvalues `theta` in the reduced body, whose frequencies
    /// are too high by at most the part `within`: by the bound, or by the estimate if there is no bound.
    pub fn holding(&self, theta: &[f64], within: f64) -> usize {
        let excess = |j: usize| self.largest_excess(j, theta[j]).unwrap_or_else(|| self.excess(j, theta[j]));
        (0..theta.len()).take_while(|&j| excess(j) <= within).count()
    }
}

// Distance of the frequencies of a Craig-Bampton body from those of the free body (theory section 5).
//
// The constraint modes and the kept fixed-interface modes span V, the truncated fixed-interface modes span
// W. K does not couple V and W, M does: b = T'M Psi, without its part along the kept modes. The
// corrections y = (T'KT)^-1 b lie in W and give the coupling G = y'K y = b'y and the mass H = y'M y. With
// the cut mu, a lower bound of every eigenvalue of W, the eigenvalues below mu obey by Sylvester's law
//
// eigenvalues of (K_V, M_V + c G) <= lambda_j <= eigenvalues of ([K_V, 0; 0, G], [M_V, G; G, H]), c =
// theta_j mu / (mu - theta_j),
//
// where theta_j >= lambda_j are the eigenvalues of the reduced body. The right side adds the corrections
// to V and is the estimate: on the bracket of the fixtures it finds 99.7 % of theta_j - lambda_j or more
// for theta_j < mu / 4, and 94 % below mu.

/// Relative energy below which a response outside the basis is rounding.
const ROUNDING_ENERGY: f64 = 1e-14;

/// Largest number of dense eigenproblems solved for the lower bounds; with more modes, several modes share
/// one problem.
const MAX_EIGENPROBLEMS: usize = 64;

/// Static responses to the inertia of the interface motions (c of them), without their part in the basis.
#[derive(Debug, Clone)]
pub(super) struct MissingResponses {
    /// Energies y'K y of the whole responses, before their part in the basis was removed (c).
    pub whole: Vec<f64>,
    /// G = y'K y (c x c).
    pub stiffness: Mat<f64>,
    /// H = y'M y (c x c).
    pub mass: Mat<f64>,
}

/// Computes estimates and bounds for the eigenvalues `theta` (nf, ascending) of a reduced body whose modes
/// have the interface coordinates `q` (c x nf), and the M-orthonormal rigid motions the coordinates `rigid`
/// (c x r). `cut` is a lower bound of the eigenvalues of the truncated fixed-interface modes.
///
/// Returns `None` if a number is not finite.
pub(super) fn free_estimate(
    theta: &[f64],
    rigid: MatRef<'_, f64>,
    q: MatRef<'_, f64>,
    missing: &MissingResponses,
    cut: Option<f64>,
) -> Option<FreeEstimate> {
    let mut estimate = corrected(theta, rigid, q, missing)?;
    let coupling =
        |a: MatRef<'_, f64>, b: MatRef<'_, f64>| gram(a, combine(missing.stiffness.as_ref(), b).as_ref());
    let blocks = [coupling(rigid, rigid), coupling(rigid, q), coupling(q, q)];
    let mut lower = vec![0.0; theta.len()];
    if let Some(cut) = cut {
        // Relative distance 1e-5 from the cut: closer to the cut the bound has no meaning.
        let below = theta.partition_point(|t| *t < cut * (1.0 - 1e-5));
        for chunk in (0..below).collect::<Vec<_>>().chunks(below.div_ceil(MAX_EIGENPROBLEMS).max(1)) {
            let highest = theta[chunk[chunk.len() - 1]];
            let bounds = weighed_down(theta, &blocks, highest * cut / (cut - highest))?;
            for &j in chunk {
                lower[j] = bounds[j].min(theta[j]);
                // If the basis is nearly complete, both differ by rounding.
                estimate[j] = estimate[j].max(lower[j]);
            }
        }
    }
    Some(FreeEstimate { estimate, lower })
}

/// Returns the Rayleigh-Ritz values with the corrections: the right side of the module documentation
/// without the rigid motions, whose eigenvalues stay zero.
fn corrected(
    theta: &[f64],
    rigid: MatRef<'_, f64>,
    q: MatRef<'_, f64>,
    missing: &MissingResponses,
) -> Option<Vec<f64>> {
    let (nf, c) = (theta.len(), missing.stiffness.nrows());
    // Scale the responses to one size, then make the corrections K-orthonormal.
    let size: Vec<f64> = missing.whole.iter().map(|energy| energy.max(0.0).sqrt()).collect();
    let unit = |i: usize| if size[i] > 0.0 { 1.0 / size[i] } else { 0.0 };
    let scaled = Mat::from_fn(c, c, |i, j| unit(i) * missing.stiffness[(i, j)] * unit(j));
    let eigen = symmetric_eigen(scaled.as_ref())?;
    let kept: Vec<usize> = (0..c).filter(|&i| eigen.values[i] > ROUNDING_ENERGY).collect();
    let k = kept.len();
    let corrections =
        Mat::from_fn(c, k, |i, j| unit(i) * eigen.vectors[(i, kept[j])] / eigen.values[kept[j]].sqrt());
    let along = combine(missing.stiffness.as_ref(), corrections.as_ref());
    let (of_rigid, of_modes) = (gram(rigid, along.as_ref()), gram(q, along.as_ref()));
    let mass = gram(corrections.as_ref(), combine(missing.mass.as_ref(), corrections.as_ref()).as_ref());
    let held = gram(of_rigid.as_ref(), of_rigid.as_ref());
    let root = |i: usize| if i < nf { theta[i].sqrt() } else { 1.0 };
    let pencil = Mat::from_fn(nf + k, nf + k, |i, j| {
        let entry = match (i < nf, j < nf) {
            (true, true) => f64::from(i == j),
            (true, false) => of_modes[(i, j - nf)],
            (false, true) => of_modes[(j, i - nf)],
            (false, false) => mass[(i - nf, j - nf)] - held[(i - nf, j - nf)],
        };
        entry / (root(i) * root(j))
    });
    let flexibility = symmetric_eigen(pencil.as_ref())?;
    Some((0..nf).map(|j| (1.0 / flexibility.values[nf + k - 1 - j]).min(theta[j])).collect())
}

/// Returns the nonzero eigenvalues of (diag(0, theta), I + c G), with G given by its blocks rigid-rigid,
/// rigid-modes and modes-modes.
fn weighed_down(theta: &[f64], blocks: &[Mat<f64>; 3], c: f64) -> Option<Vec<f64>> {
    let [rigid, mixed, modes] = blocks;
    let (r, nf) = (rigid.nrows(), theta.len());
    let heavy = DMatrix::from_fn(r, r, |i, j| f64::from(i == j) + 0.5 * c * (rigid[(i, j)] + rigid[(j, i)]));
    let coupled = DMatrix::from_fn(r, nf, |i, j| c * mixed[(i, j)]);
    let carried = heavy.cholesky()?.solve(&coupled);
    let carried = coupled.transpose() * carried;
    let pencil = Mat::from_fn(nf, nf, |i, j| {
        let mass = f64::from(i == j) + 0.5 * c * (modes[(i, j)] + modes[(j, i)]) - carried[(i, j)];
        mass / (theta[i] * theta[j]).sqrt()
    });
    let flexibility = symmetric_eigen(pencil.as_ref())?;
    Some((0..nf).map(|j| 1.0 / flexibility.values[nf - 1 - j]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Masses m, n, m joined by springs k, held at the first: the interface motion is rigid, and the
    /// fixed-interface modes are those of two masses.
    #[test]
    fn the_estimate_of_a_chain_is_exact_where_one_mode_is_left_out_and_the_bound_encloses() {
        // Free: masses 1, 2, 1, springs 1, 1: lambda = 1, 2. V: rigid motion and first fixed mode; W:
        // second fixed mode.
        let a = (4.0f64 - 2.0 * 2.0f64.sqrt()) / 4.0;
        let fixed = |lambda: f64| {
            // Masses 2 and 1, springs 1 (to the wall), 1: (2 - 2 lambda) x = y with x = 1.
            let y: f64 = 2.0 - 2.0 * lambda;
            let norm = (2.0 + y * y).sqrt();
            [1.0 / norm, y / norm]
        };
        let b = (4.0 + 2.0 * 2.0f64.sqrt()) / 4.0;
        let (phi, left) = (fixed(a), fixed(b));
        // Rigid motion (1, 1, 1) / 2 and phi without its rigid part.
        let along = |u: [f64; 2]| (2.0 * u[0] + u[1]) / 2.0;
        let s = along(phi);
        let norm = (1.0 - s * s).sqrt();
        let theta = a / (norm * norm);
        // The interface (first mass) moves by 1/2 in the rigid mode, and by -s/2 / norm in psi.
        let rigid = Mat::from_fn(1, 1, |_, _| 0.5);
        let q = Mat::from_fn(1, 1, |_, _| -0.5 * s / norm);
        // b of the unit interface motion (1, 1, 1) along the truncated mode.
        let coupled = 2.0 * left[0] + left[1];
        let missing = MissingResponses {
            whole: vec![coupled * coupled / b],
            stiffness: Mat::from_fn(1, 1, |_, _| coupled * coupled / b),
            mass: Mat::from_fn(1, 1, |_, _| coupled * coupled / (b * b)),
        };
        let found = free_estimate(&[theta], rigid.as_ref(), q.as_ref(), &missing, Some(b)).expect("finite");
        assert!((found.estimate[0] - 1.0).abs() < 1e-14, "{found:?}, theta {theta}");
        assert!(theta > 1.0 && found.lower[0] <= 1.0 && found.lower[0] > 0.9, "{found:?}, theta {theta}");
        let unknown = free_estimate(&[theta], rigid.as_ref(), q.as_ref(), &missing, None).expect("finite");
        assert_eq!(unknown.lower, [0.0]);
        // A response inside the basis leaves rounding, which is no correction.
        let noise = |size: f64| Mat::from_fn(1, 1, |_, _| 1e-30 * size);
        let nothing = MissingResponses { whole: vec![1.0], stiffness: noise(1.0), mass: noise(1.0 / a) };
        let found = free_estimate(&[theta], rigid.as_ref(), q.as_ref(), &nothing, Some(b)).expect("finite");
        assert_eq!((found.estimate, found.lower), (vec![theta], vec![theta]));
    }
}
