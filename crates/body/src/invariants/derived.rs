//! Invariants of the equations of motion, linear in the primary data (theory section 2).

use super::Invariants;
use faer::Mat;
use nalgebra::Matrix3;

/// Cyclic triples of axes: (k, l, m) is right-handed.
pub(super) const CYCLIC: [(usize, usize, usize); 3] = [(0, 1, 2), (1, 2, 0), (2, 0, 1)];

/// All invariants that follow from the primary data, as stored in files and exports.
///
/// Arrays are blocked by component: column (or row) b nf + j belongs to axis b and mode j.
#[derive(Debug, Clone, PartialEq)]
pub struct Derived {
    /// I0 (3 x 3). Unit: mass length^2.
    pub inertia: Matrix3<f64>,
    /// C2 (3 x nf).
    pub c2: Mat<f64>,
    /// W1 (3 x 3nf); `None` if the body does not hold W1.
    pub w1: Option<Mat<f64>>,
    /// W2 (3nf x 3nf); `None` if the body does not hold W2.
    pub w2: Option<Mat<f64>>,
    /// W3 (3nf x nf); `None` if the body does not hold W3.
    pub w3: Option<Mat<f64>>,
    /// m_ff (nf x nf).
    pub modal_mass: Mat<f64>,
}

/// Returns I0 = tr(J) I - J.
pub(super) fn inertia_of(second_moment: &Matrix3<f64>) -> Matrix3<f64> {
    // Add two diagonal entries: the trace minus the third would cancel for needles.
    Matrix3::from_fn(|k, l| {
        let (_, a, b) = CYCLIC[k];
        if k == l { second_moment[(a, a)] + second_moment[(b, b)] } else { -second_moment[(k, l)] }
    })
}

impl Invariants {
    /// Returns the number of modes nf.
    pub fn n_modes(&self) -> usize {
        self.0.c1.ncols()
    }

    /// Returns I0 = tr(J) I - J, the inertia of the undeformed body about the frame origin, frame axes.
    /// Unit: mass length^2.
    pub fn inertia(&self) -> Matrix3<f64> {
        inertia_of(&self.0.second_moment)
    }

    /// Returns C2 (3 x nf) = Phi_r' M Psi: rows Ibar23 - Ibar32, Ibar31 - Ibar13, Ibar12 - Ibar21.
    pub fn c2(&self) -> Mat<f64> {
        Mat::from_fn(3, self.n_modes(), |k, p| {
            let (_, l, m) = CYCLIC[k];
            self.0.ibar[l][m][p] - self.0.ibar[m][l][p]
        })
    }

    /// Returns W1 (3 x 3nf): diagonal blocks 2 (Ibar_ll + Ibar_mm), block (k, l) = -(Ibar_kl + Ibar_lk).
    /// Returns `None` if the body does not hold W1: a dropped group is not zero.
    pub fn w1(&self) -> Option<Mat<f64>> {
        let nf = self.n_modes();
        let w1 = |k: usize, column: usize| {
            let (l, p) = (column / nf, column % nf);
            if k == l {
                let (_, a, b) = CYCLIC[k];
                2.0 * (self.0.ibar[a][a][p] + self.0.ibar[b][b][p])
            } else {
                -(self.0.ibar[k][l][p] + self.0.ibar[l][k][p])
            }
        };
        self.0.groups.w1.then(|| Mat::from_fn(3, 3 * nf, w1))
    }

    /// Returns W2 (3nf x 3nf): diagonal blocks S_ll + S_mm, block (k, l) = -S_lk. Returns `None` if the
    /// body does not hold W2.
    pub fn w2(&self) -> Option<Mat<f64>> {
        let nf = self.n_modes();
        let w2 = |row: usize, column: usize| {
            let (k, p, l, q) = (row / nf, row % nf, column / nf, column % nf);
            if k == l {
                let (_, a, b) = CYCLIC[k];
                self.0.s[a][a][(p, q)] + self.0.s[b][b][(p, q)]
            } else {
                -self.0.s[l][k][(p, q)]
            }
        };
        self.0.groups.w2.then(|| Mat::from_fn(3 * nf, 3 * nf, w2))
    }

    /// Returns W0 (3 x 3nf), the change of the coupling of translation and rotation with the modal
    /// amplitudes: block b, column j is -C1_j~ e_b or, for a mass that does not commute with rotations,
    /// Phi_t' M B_j e_b. s~ = c~ - W0 Q.
    pub fn w0(&self) -> Mat<f64> {
        if let Some(general) = &self.0.general {
            return general.w0.clone();
        }
        let nf = self.n_modes();
        Mat::from_fn(3, 3 * nf, |k, column| {
            let (b, p) = (column / nf, column % nf);
            // (e_b x C1_p)_k
            let (_, l, m) = CYCLIC[k];
            match b {
                _ if b == l => self.0.c1[(m, p)],
                _ if b == m => -self.0.c1[(l, p)],
                _ => 0.0,
            }
        })
    }

    /// Returns W3 (3nf x nf): blocks S23 - S32, S31 - S13, S12 - S21, each skew; B_i' M Psi for a mass that
    /// does not commute with rotations. Returns `None` if the body does not hold W3.
    pub fn w3(&self) -> Option<Mat<f64>> {
        let nf = self.n_modes();
        let difference = |row: usize, q: usize| {
            let ((_, l, m), p) = (CYCLIC[row / nf], row % nf);
            self.0.s[l][m][(p, q)] - self.0.s[m][l][(p, q)]
        };
        self.0.groups.w3.then(|| match &self.0.general {
            Some(general) => general.w3.clone(),
            None => Mat::from_fn(3 * nf, nf, difference),
        })
    }

    /// Returns m_ff (nf x nf) = S11 + S22 + S33 = Psi' M Psi, the identity for mass-normalised modes.
    pub fn modal_mass(&self) -> Mat<f64> {
        if let Some(general) = &self.0.general {
            return general.modal_mass.clone();
        }
        let nf = self.n_modes();
        Mat::from_fn(nf, nf, |p, q| (0..3).map(|k| self.0.s[k][k][(p, q)]).sum())
    }

    /// Returns all derived invariants.
    pub fn derived(&self) -> Derived {
        Derived {
            inertia: self.inertia(),
            c2: self.c2(),
            w1: self.w1(),
            w2: self.w2(),
            w3: self.w3(),
            modal_mass: self.modal_mass(),
        }
    }
}
