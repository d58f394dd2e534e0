//! Invariants of the equations of motion, linear in the primary data (theory section 2).

use super::general::{s_of, second_moment_of};
use super::{CauchySchwarz, GeneralTerms, Invariants, PrimaryData, TermGroups, s_of_modal_mass};
use faer::Mat;
use flexbody_linalg::larger;
use nalgebra::{Matrix3, Vector3};

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

// Invariants in the numbering of other programs: I1 to I9 of Adams and MBDyn, from which all other sets of
// names follow.

/// Nine inertia invariants (MBDyn manual, technical appendix; Adams/Flex), with the signs of the MBDyn
/// code.
///
/// With S_j the shape of mode j: I1 = m, I2 = c, I3_j = int S_j, I4_j = int x~ S_j, I5_jk = int S_j x S_k,
/// I6_jk = int S_j . S_k, I7 = I0, I8_j = int x~ S_j~', I9_jk = int S_j~ S_k~. Inertia about the origin: I7 +
/// sum_j (I8_j + I8_j') q_j - sum_jk I9_jk q_j q_k. Adams has I8 with the other sign.
#[derive(Debug, Clone, PartialEq)]
pub struct Numbered {
    /// m. Unit: mass.
    pub i1: f64,
    /// c. Unit: mass length.
    pub i2: Vector3<f64>,
    /// C1 (3 x nf).
    pub i3: Mat<f64>,
    /// C2 (3 x nf).
    pub i4: Mat<f64>,
    /// I5_jk in row a nf + j, column k (3nf x nf), component a: W3. `None` if the body does not hold W3.
    pub i5: Option<Mat<f64>>,
    /// m_ff (nf x nf).
    pub i6: Mat<f64>,
    /// I0, about the origin. Unit: mass length^2.
    pub i7: Matrix3<f64>,
    /// I8_j (nf of 3 x 3): `I8_j(a,b) = d_ab sum_c Ibar_cc,j - Ibar_ba,j`. The symmetric part is W1 / 2,
    /// the skew part C2; antisymmetric if the body does not hold W1.
    pub i8: Vec<Matrix3<f64>>,
    /// I9_jk(a,b) in row a nf + j, column b nf + k (3nf x 3nf): -W2. `None` if the body does not hold W2.
    pub i9: Option<Mat<f64>>,
    /// Groups of the kinetic energy that are held.
    pub groups: TermGroups,
}

impl Invariants {
    /// Returns the nine invariants.
    pub fn numbered(&self) -> Numbered {
        let i8 = |j: usize| {
            let ibar = Matrix3::from_fn(|k, l| self.0.ibar[k][l][j]);
            Matrix3::identity() * ibar.trace() - ibar.transpose()
        };
        Numbered {
            i1: self.0.mass,
            i2: self.0.first_moment,
            i3: self.0.c1.clone(),
            i4: self.c2(),
            i5: self.w3(),
            i6: self.modal_mass(),
            i7: self.inertia(),
            i8: (0..self.n_modes()).map(i8).collect(),
            i9: self.w2().map(|w2| Mat::from_fn(w2.nrows(), w2.ncols(), |i, j| -w2[(i, j)])),
            groups: self.0.groups,
        }
    }

    /// Returns the body with these invariants: the inverse of [`Invariants::numbered`], up to rounding. C2
    /// is taken from I8. If I5 or I6 differ from the values that follow from I9 by more than `rounding`,
    /// relative to their Cauchy-Schwarz bounds, the mass does not commute with rotations. W0, which none of
    /// the nine invariants determines, is then set to -C1~.
    ///
    /// # Panics
    /// When the sizes disagree.
    pub fn from_numbered(numbered: &Numbered, modal_stiffness: Mat<f64>, rounding: f64) -> Self {
        let nf = numbered.i8.len();
        let Numbered { i5, i6, i8, i9, .. } = numbered;
        let groups = TermGroups { w2: i9.is_some(), w3: i5.is_some(), ..numbered.groups };
        // Invert the formulas of I8 (Ibar) and I9 (S).
        let ibar = |k: usize, l: usize| {
            let entry = |i8: &Matrix3<f64>| if k == l { 0.5 * i8.trace() } else { 0.0 } - i8[(l, k)];
            i8.iter().map(entry).collect()
        };
        let s = match i9 {
            None => s_of_modal_mass(nf, Some(i6), i5.as_ref()),
            Some(i9) => {
                let pair = |i: usize, j: usize| s_of(&Matrix3::from_fn(|a, b| -i9[(a * nf + i, b * nf + j)]));
                [0, 1, 2].map(|k| [0, 1, 2].map(|l| Mat::from_fn(nf, nf, |i, j| pair(i, j)[(k, l)])))
            }
        };
        let mut body = Self(PrimaryData {
            mass: numbered.i1,
            first_moment: numbered.i2,
            second_moment: second_moment_of(&numbered.i7),
            c1: numbered.i3.clone(),
            ibar: [0, 1, 2].map(|k| [0, 1, 2].map(|l| ibar(k, l))),
            s,
            modal_stiffness,
            general: None,
            groups,
        });
        // Compare I6 and I5 with the values that follow from S.
        let solid = (body.modal_mass(), body.w3());
        let bound = CauchySchwarz::of(&body);
        let apart = |computed: &Mat<f64>, stated: &Mat<f64>| {
            let scale = |i: usize, j: usize| bound.s(i % nf, j).max(stated[(i % nf, j)].abs() * f64::EPSILON);
            let places = (0..stated.nrows()).flat_map(|i| (0..nf).map(move |j| (i, j)));
            let worst = places
                .map(|(i, j)| super::comparison::scaled(computed[(i, j)] - stated[(i, j)], scale(i, j)))
                .fold(0.0, larger);
            worst.is_nan() || worst > rounding
        };
        let differs = apart(&solid.0, i6)
            || solid.1.zip(i5.as_ref()).is_some_and(|(computed, stated)| apart(&computed, stated));
        // The mass does not commute with rotations: store I5 and I6 themselves.
        if differs {
            body.0.general = Some(GeneralTerms {
                w0: body.w0(),
                w3: i5.clone().unwrap_or_else(|| Mat::zeros(3 * nf, nf)),
                modal_mass: i6.clone(),
                plane: false,
            });
        }
        body.with_groups(groups)
    }
}
