//! Norms of the terms of the equations of motion, before and after the invariants are known (theory section 7).

use faer::Mat;
use flexbody_body::invariants::{Invariants, relative_norm};
use flexbody_linalg::symmetric_eigen;
use nalgebra::{DMatrix, Matrix3, Vector3};

/// Norms of the terms for mass-normalised free-surface modes about the centre of mass, per unit of angular velocity and
/// of q. Tier 0 uses I0 and the eigenvalues with the Cauchy-Schwarz inequality in the inner product of M; tier 1 uses
/// the norms of the actual W1, W2 and W3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Norms {
    /// Tier, 0 or 1.
    pub tier: u8,
    /// Smallest circular frequency Omega_1.
    pub first: f64,
    /// Largest circular frequency.
    pub last: f64,
    /// |W1'w w / 2| over |w|^2: the centrifugal load on the modes. Tier 0: sqrt(e'I0 e).
    pub centrifugal: f64,
    /// |Lambda^(-1/2) W1'w w / 2| over |w|^2: the root of twice the elastic energy of the static response.
    pub centrifugal_energy: f64,
    /// |W1 Q| over |q|. Tier 0: 2 sqrt(largest principal inertia).
    pub inertia: f64,
    /// |E(w, w)| over |w|^2, with E the symmetric part of W2. Tier 0: 1.
    pub spin: f64,
    /// |Lambda^(-1/2) E Lambda^(-1/2)| over |w|^2. Tier 0: 1 / lambda_1.
    pub softening: f64,
    /// |W3(w)| over |w|, for the axis of rotation if it is known. Tier 0: 1.
    pub coupling: f64,
    /// |Q'W3| over |q|, for all axes, since the torque has all components. Tier 0: 1.
    pub turning: f64,
}

impl Norms {
    /// Returns the norms of tier 0 from I0 (body axes, about the centre of mass) and the eigenvalues, for rotation
    /// about `axis`; about any axis if it is `None`.
    pub fn of_rigid(inertia: &Matrix3<f64>, eigenvalues: &[f64], axis: Option<&Vector3<f64>>) -> Self {
        let largest = inertia.symmetric_eigenvalues().max();
        let along = axis.map_or(largest, |e| e.dot(&(inertia * e))).max(0.0).sqrt();
        let (first, last) = ends(eigenvalues);
        Self {
            tier: 0,
            first,
            last,
            centrifugal: along,
            centrifugal_energy: along / first,
            inertia: 2.0 * largest.max(0.0).sqrt(),
            spin: 1.0,
            softening: 1.0 / (first * first),
            coupling: 1.0,
            turning: 1.0,
        }
    }

    /// Returns the norms of tier 1 from the invariants. They never exceed the norms of [`Norms::of_rigid`]. Returns
    /// `None` if a group is not held or K_ff is not positive definite.
    pub fn of_invariants(
        invariants: &Invariants,
        eigenvalues: &[f64],
        axis: Option<&Vector3<f64>>,
    ) -> Option<Self> {
        let nf = eigenvalues.len();
        let rigid = Self::of_rigid(&invariants.inertia(), eigenvalues, axis);
        let root: Vec<f64> = eigenvalues.iter().map(|l| l.sqrt()).collect();
        // Centrifugal load: along the axis, or the largest over all axes.
        let load = CentrifugalLoad::new(invariants)?;
        let (centrifugal, centrifugal_energy) = match axis {
            Some(e) => {
                let force = load.at(e);
                let energy = force.iter().zip(&root).map(|(f, root)| (f / root).powi(2)).sum::<f64>().sqrt();
                (force.iter().map(|f| f * f).sum::<f64>().sqrt(), energy)
            }
            None => (load.norm(|_| 1.0), load.norm(|j| 1.0 / root[j])),
        };
        let w2 = invariants.w2()?;
        let block = |a: usize, b: usize| {
            Mat::from_fn(nf, nf, |i, j| 0.5 * (w2[(a * nf + i, b * nf + j)] + w2[(a * nf + j, b * nf + i)]))
        };
        // About any axis, E(e, e) is at most E_xx + E_yy + E_zz, since all three are positive semidefinite.
        let weights = axis.map_or(Matrix3::identity(), |e| e * e.transpose());
        let spin = (0..9).filter(|at| weights[*at] != 0.0).fold(Mat::zeros(nf, nf), |sum: Mat<f64>, at| {
            let part = block(at % 3, at / 3);
            Mat::from_fn(nf, nf, |i, j| sum[(i, j)] + weights[at] * part[(i, j)])
        });
        let softening = relative_norm(spin.as_ref(), invariants.modal_stiffness().as_ref())?;
        // Coupling W3: spectral norms along the axis and over all axes.
        let w3 = invariants.w3()?;
        let coupling = |e: &Vector3<f64>| {
            let part = |i: usize, j: usize| (0..3).map(|a| e[a] * w3[(a * nf + i, j)]).sum::<f64>();
            spectral_norm(&Mat::from_fn(nf, nf, part))
        };
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let squares = axes.iter().map(|e| coupling(e).map(|norm| norm * norm));
        let turning = squares.sum::<Option<f64>>()?.sqrt().min(rigid.turning);
        let coupling = axis.map_or(Some(turning), coupling)?;
        Some(Self {
            tier: 1,
            centrifugal: centrifugal.min(rigid.centrifugal),
            centrifugal_energy: centrifugal_energy.min(rigid.centrifugal_energy),
            inertia: (2.0 * load.norm(|_| 1.0)).min(rigid.inertia),
            spin: spectral_norm(&spin)?.min(rigid.spin),
            softening: softening.min(rigid.softening),
            coupling: coupling.min(turning),
            turning,
            ..rigid
        })
    }
}

/// Returns |e'W1 Q f| over |q|, by which modes change the moment of inertia about e (e = f) or a product of inertia;
/// `None` if W1 is not held.
///
/// The load l(w) = W1'w w / 2 is a quadratic form in w, so that e'W1 Q f = (l(e + f) - l(e) - l(f))'q.
pub(super) fn change_of_inertia(invariants: &Invariants, e: &Vector3<f64>, f: &Vector3<f64>) -> Option<f64> {
    let load = CentrifugalLoad::new(invariants)?;
    let (both, first, second) = (load.at(&(e + f)), load.at(e), load.at(f));
    let squares = both.iter().zip(first.iter().zip(&second)).map(|(b, (e, f))| (b - e - f).powi(2));
    Some(squares.sum::<f64>().sqrt())
}

/// Returns the smallest and the largest circular frequency.
fn ends(eigenvalues: &[f64]) -> (f64, f64) {
    let root = |value: f64| value.max(0.0).sqrt();
    let first = eigenvalues.iter().copied().fold(f64::INFINITY, f64::min);
    (root(first), root(eigenvalues.iter().copied().fold(0.0, f64::max)))
}

/// Returns the largest singular value.
fn spectral_norm(a: &Mat<f64>) -> Option<f64> {
    let eigen = symmetric_eigen((a.transpose() * a).as_ref())?;
    Some(eigen.values.last().copied().unwrap_or(0.0).max(0.0).sqrt())
}

/// Constant centrifugal load on the modes, W1'w w / 2, as a function of w.
struct CentrifugalLoad {
    /// Coefficients (nf x 6) of w_x^2, w_y^2, w_z^2, sqrt(2) w_y w_z, sqrt(2) w_x w_z and sqrt(2) w_x w_y. The
    /// Euclidean length of these six products is |w|^2.
    rows: DMatrix<f64>,
}

impl CentrifugalLoad {
    const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)];

    fn new(invariants: &Invariants) -> Option<Self> {
        let (w1, nf) = (invariants.w1()?, invariants.n_modes());
        let rows = DMatrix::from_fn(nf, 6, |j, at| {
            let (a, b) = Self::PAIRS[at];
            let both = w1[(a, b * nf + j)] + w1[(b, a * nf + j)];
            if a == b { 0.25 * both } else { 0.5 * both / 2f64.sqrt() }
        });
        Some(Self { rows })
    }

    fn at(&self, w: &Vector3<f64>) -> Vec<f64> {
        let squares = Self::PAIRS.map(|(a, b)| w[a] * w[b] * if a == b { 1.0 } else { 2f64.sqrt() });
        (&self.rows * nalgebra::Vector6::from(squares)).as_slice().to_vec()
    }

    /// Returns the largest length of the load over |w|^2, with row j multiplied by `weight(j)`.
    fn norm(&self, weight: impl Fn(usize) -> f64) -> f64 {
        let weighted = DMatrix::from_fn(self.rows.nrows(), 6, |j, at| weight(j) * self.rows[(j, at)]);
        (weighted.transpose() * weighted).symmetric_eigenvalues().max().max(0.0).sqrt()
    }
}
