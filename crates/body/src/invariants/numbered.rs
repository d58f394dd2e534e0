//! Invariants in the numbering of other programs: I1 to I9 of Adams and MBDyn, from which all other sets of names follow.

use super::comparison::scaled;
use super::general::{s_of, second_moment_of};
use super::{CauchySchwarz, GeneralTerms, Invariants, PrimaryData, TermGroups, s_of_modal_mass};
use faer::Mat;
use flexbody_linalg::larger;
use nalgebra::{Matrix3, Vector3};

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
            let worst =
                places.map(|(i, j)| scaled(computed[(i, j)] - stated[(i, j)], scale(i, j))).fold(0.0, larger);
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
