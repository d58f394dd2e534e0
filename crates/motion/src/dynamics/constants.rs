//! Constants of the equations as plain matrices, for files that other programs evaluate.

use super::EquationsOfMotion;
use super::equations::{C1, C2, W0, W1};
use super::kernels::Panels;
use super::modal_matrix::{ModalMass, ModalMatrix};
use faer::Mat;

/// Constants of [`EquationsOfMotion`] for the rigid motions that the body has: T translations (3, in the
/// plane 2) and A axes that it turns about (3, in the plane 1), with P pairs of axes xx, yy, zz, yz, xz, xy
/// (in the plane zz). Stacked matrices are nf x nf each.
pub struct Constants {
    /// (m, c, I0): 1 + T + P entries.
    pub rigid: Vec<f64>,
    /// Arrays linear in q, one row each: W0 (translation by translation, T A rows), W1 (P rows, if held),
    /// C1 (T), C2 (A).
    pub linear: Mat<f64>,
    /// E of each pair (6.7), minus geometric stiffness for spin (7.4).
    pub w2: Option<Mat<f64>>,
    /// W3' of each axis, with geometric stiffness for angular acceleration.
    pub w3: Option<Mat<f64>>,
    /// W3' - W3 of each axis; `None` if it is twice `w3` because the blocks are skew.
    pub w3_skew: Option<Mat<f64>>,
    /// Geometric stiffness for acceleration along each translation.
    pub acceleration: Option<Mat<f64>>,
    /// m_ff and L of m_ff = L L'; `None` for the identity.
    pub modal_mass: Option<(Mat<f64>, Option<Mat<f64>>)>,
    /// K_ff: full (nf x nf), or its diagonal (nf x 1).
    pub stiffness: Mat<f64>,
    /// D: full (nf x nf), or its diagonal (nf x 1); `None` without damping.
    pub damping: Option<Mat<f64>>,
}

impl EquationsOfMotion {
    /// Returns the constants.
    pub fn constants(&self) -> Constants {
        let (nf, translations) = (self.nf, self.translations());
        let has_w1 = self.terms().w1;
        let pair_rows = |first: usize| {
            let own = |at: usize| self.axes.len() == 3 || at == 2;
            (0..6).filter(move |&at| own(at)).map(move |at| first + at)
        };
        let w0 = (0..translations).flat_map(|k| self.axes.iter().map(move |b| W0 + 3 * k + b));
        let w1 = pair_rows(W1).filter(|_| has_w1);
        let c2 = self.axes.iter().map(|a| C2 + a);
        let rows: Vec<usize> = w0.chain(w1).chain((0..translations).map(|k| C1 + k)).chain(c2).collect();

        let moment = self.first_moment.iter().take(translations).copied();
        let inertia = self.pairs.iter().map(|&pair| self.inertia[pair]);
        let stacked = |panels: &Option<Panels>, count: usize| {
            let panels = panels.as_ref()?;
            let rows: Vec<Vec<f64>> = (0..count * nf).map(|row| panels.row(row).collect()).collect();
            Some(Mat::from_fn(count * nf, nf, |row, j| rows[row][j]))
        };
        Constants {
            rigid: [self.mass].into_iter().chain(moment).chain(inertia).collect(),
            linear: Mat::from_fn(rows.len(), nf, |row, j| self.row(rows[row])[j]),
            w2: stacked(&self.w2, self.pairs.len()),
            w3: stacked(&self.w3, self.axes.len()),
            w3_skew: stacked(&self.w3_skew, self.axes.len()),
            acceleration: stacked(&self.accelerated, translations),
            modal_mass: match &self.modal_mass {
                ModalMass::Identity => None,
                ModalMass::Full { matrix, factor } => {
                    let lower = |at: &Vec<f64>| {
                        Mat::from_fn(nf, nf, |i, j| if j <= i { at[i * nf + j] } else { 0.0 })
                    };
                    let matrix = Mat::from_fn(nf, nf, |i, j| matrix.get(i, j));
                    Some((matrix, factor.as_ref().map(lower)))
                }
            },
            stiffness: cheapest(&self.stiffness, nf),
            damping: Some(cheapest(&self.damping, nf))
                .filter(|d| d.col_iter().any(|column| column.iter().any(|value| *value != 0.0))),
        }
    }
}

fn cheapest(matrix: &ModalMatrix, nf: usize) -> Mat<f64> {
    match matrix {
        ModalMatrix::Diagonal(diagonal) => Mat::from_fn(nf, 1, |i, _| diagonal[i]),
        ModalMatrix::Full { .. } => Mat::from_fn(nf, nf, |i, j| matrix.get(i, j)),
    }
}
