//! What is linear in the primary data: I0, W1, W2, W3, C2 and the modal mass (theory section 2).

use super::Invariants;
use faer::Mat;
use nalgebra::Matrix3;

/// The two other components of component k, in cyclic order: W3's first block is S23 - S32.
const CYCLIC: [(usize, usize); 3] = [(1, 2), (2, 0), (0, 1)];

impl Invariants {
    /// Number of modes nf.
    pub fn n_modes(&self) -> usize {
        self.c1.ncols()
    }

    /// I0 = tr(J) I - J about the frame origin, frame axes. Unit: mass length^2.
    pub fn inertia(&self) -> Matrix3<f64> {
        Matrix3::identity() * self.second_moment.trace() - self.second_moment
    }

    /// C2 (3 x nf) = [Ibar23 - Ibar32; Ibar31 - Ibar13; Ibar12 - Ibar21].
    pub fn c2(&self) -> Mat<f64> {
        Mat::from_fn(3, self.n_modes(), |k, j| {
            let (a, b) = CYCLIC[k];
            self.ibar[a][b][j] - self.ibar[b][a][j]
        })
    }

    /// W1 (3 x 3 nf): diagonal blocks 2 (Ibar_ll + Ibar_mm), block (k, l) = -(Ibar_kl + Ibar_lk).
    pub fn w1(&self) -> Mat<f64> {
        let nf = self.n_modes();
        Mat::from_fn(3, 3 * nf, |k, column| {
            let (l, j) = (column / nf, column % nf);
            if k == l {
                let (a, b) = CYCLIC[k];
                2.0 * (self.ibar[a][a][j] + self.ibar[b][b][j])
            } else {
                -(self.ibar[k][l][j] + self.ibar[l][k][j])
            }
        })
    }

    /// W2 (3 nf x 3 nf): diagonal blocks S_ll + S_mm, block (k, l) = -S_lk.
    pub fn w2(&self) -> Mat<f64> {
        let nf = self.n_modes();
        Mat::from_fn(3 * nf, 3 * nf, |row, column| {
            let (k, i, l, j) = (row / nf, row % nf, column / nf, column % nf);
            if k == l {
                let (a, b) = CYCLIC[k];
                self.s[a][a][(i, j)] + self.s[b][b][(i, j)]
            } else {
                -self.s[l][k][(i, j)]
            }
        })
    }

    /// W3 (3 nf x nf) = [S23 - S32; S31 - S13; S12 - S21].
    pub fn w3(&self) -> Mat<f64> {
        let nf = self.n_modes();
        Mat::from_fn(3 * nf, nf, |row, j| {
            let ((a, b), i) = (CYCLIC[row / nf], row % nf);
            self.s[a][b][(i, j)] - self.s[b][a][(i, j)]
        })
    }

    /// m_ff (nf x nf) = S11 + S22 + S33.
    pub fn modal_mass(&self) -> Mat<f64> {
        let nf = self.n_modes();
        Mat::from_fn(nf, nf, |i, j| self.s[0][0][(i, j)] + self.s[1][1][(i, j)] + self.s[2][2][(i, j)])
    }
}
