//! Change of the primary data with the frame and with the basis (theory section 5).

use super::dense::{product, transpose_product};
use super::general::{ibar_of, plane_ibar, symmetrise};
use super::{GeneralTerms, Invariants, PrimaryData};
use faer::{Mat, MatRef};
use nalgebra::{Matrix3, Vector3};

impl Invariants {
    /// Returns the body about the origin `d` (frame coordinates): x' = x - d.
    ///
    /// c' = c - m d; J' = J - c d' - d c' + m d d'; Ibar'_kl = Ibar_kl - d_k C1_l; S unchanged. For a mass
    /// that does not commute with rotations, B_x' = B_x + Phi_t d~ gives W1' = W1 - d~ W0 - (d~ W0)' block
    /// by block and C2' = C2 - d~ C1. Digits cancel if d is large compared with the body: for data about
    /// the centre of mass, shift the coordinates and condense.
    pub fn shifted(&self, d: Vector3<f64>) -> Self {
        let c = &self.0.first_moment;
        let mixed = c * d.transpose();
        let mut shifted = self.clone();
        shifted.0.first_moment = c - self.0.mass * d;
        shifted.0.second_moment =
            self.0.second_moment - (mixed + mixed.transpose()) + d * d.transpose() * self.0.mass;
        let w0 = self.w0();
        for p in 0..self.n_modes() {
            let w0 = Matrix3::from_fn(|k, b| w0[(k, b * self.n_modes() + p)]);
            let c1 = Vector3::from_fn(|k, _| self.0.c1[(k, p)]);
            let change = match self.0.general {
                None => d * c1.transpose(),
                Some(GeneralTerms { plane: true, .. }) => {
                    plane_ibar((d.cross_matrix() * w0)[(2, 2)], d.cross(&c1)[2])
                }
                Some(_) => ibar_of(&(d.cross_matrix() * w0), &(d.cross(&c1))),
            };
            for (k, row) in shifted.0.ibar.iter_mut().enumerate() {
                for (l, entry) in row.iter_mut().enumerate() {
                    entry[p] -= change[(k, l)];
                }
            }
        }
        // The shift would create a W1 from C1: drop groups that are not held.
        shifted.with_groups(self.0.groups)
    }

    /// Returns the invariants with W0 = -C1~, so that a constant translational velocity does not influence
    /// the motion of the body. For a mass of points and directors W0 has this value already. A mass that
    /// does not turn with the nodes has other products Phi_t' M B_j, which are errors of the order of its
    /// approximation (theory section 6).
    pub(crate) fn with_w0_of_c1(mut self) -> Self {
        let w0 = self.as_solid().w0();
        if let Some(general) = &mut self.0.general {
            let nf = w0.ncols() / 3;
            let exists = |k: usize, column: usize| !general.plane || (k < 2 && column >= 2 * nf);
            general.w0 =
                Mat::from_fn(3, 3 * nf, |k, column| if exists(k, column) { w0[(k, column)] } else { 0.0 });
        }
        self
    }

    /// Returns the body in other axes, the columns of `axes` in the present ones: x' = axes' x, about the
    /// same origin.
    pub fn rotated(&self, axes: &Matrix3<f64>) -> Self {
        let nf = self.n_modes();
        let second_moment = axes.transpose() * self.0.second_moment * axes;
        let terms = |k: usize, l: usize| {
            (0..9).map(move |ab| (ab / 3, ab % 3, axes[(ab / 3, k)] * axes[(ab % 3, l)]))
        };
        let s = |k: usize, l: usize| {
            Mat::from_fn(nf, nf, |p, q| terms(k, l).map(|(a, b, r)| r * self.0.s[a][b][(p, q)]).sum::<f64>())
        };
        let mut rotated = Self(PrimaryData {
            mass: self.0.mass,
            first_moment: axes.transpose() * self.0.first_moment,
            second_moment: (second_moment + second_moment.transpose()) * 0.5,
            c1: Mat::from_fn(3, nf, |k, p| (0..3).map(|a| axes[(a, k)] * self.0.c1[(a, p)]).sum()),
            ibar: std::array::from_fn(|k| {
                std::array::from_fn(|l| {
                    (0..nf).map(|p| terms(k, l).map(|(a, b, r)| r * self.0.ibar[a][b][p]).sum()).collect()
                })
            }),
            s: std::array::from_fn(|k| std::array::from_fn(|l| s(k, l))),
            modal_stiffness: self.0.modal_stiffness.clone(),
            general: self.0.general.as_ref().map(|general| GeneralTerms {
                w0: Mat::from_fn(3, 3 * nf, |k, column| {
                    let (l, p) = (column / nf, column % nf);
                    terms(k, l).map(|(a, b, r)| r * general.w0[(a, b * nf + p)]).sum()
                }),
                w3: Mat::from_fn(3 * nf, nf, |row, q| {
                    let (k, p) = (row / nf, row % nf);
                    (0..3).map(|a| axes[(a, k)] * general.w3[(a * nf + p, q)]).sum()
                }),
                modal_mass: general.modal_mass.clone(),
                plane: general.plane,
            }),
            groups: self.0.groups,
        });
        symmetrise(&mut rotated.0.s);
        rotated.with_groups(self.0.groups)
    }

    /// Returns the body in the basis Psi' = Psi T, with `t` (nf x nf'): S' = T' S T, Ibar' = Ibar T, C1' =
    /// C1 T, K' = T' K T.
    ///
    /// # Panics
    /// When `t` does not have one row per mode.
    pub fn with_basis(&self, t: MatRef<'_, f64>) -> Self {
        let nf = self.n_modes();
        assert_eq!(t.nrows(), nf, "one row per mode");
        let congruent = |a: &Mat<f64>| transpose_product(t, product(a.as_ref(), t).as_ref());
        let stiffness = congruent(&self.0.modal_stiffness);
        let mut changed = Self(PrimaryData {
            mass: self.0.mass,
            first_moment: self.0.first_moment,
            second_moment: self.0.second_moment,
            c1: product(self.0.c1.as_ref(), t),
            ibar: self.0.ibar.each_ref().map(|row| {
                row.each_ref()
                    .map(|a| (0..t.ncols()).map(|q| (0..nf).map(|p| a[p] * t[(p, q)]).sum()).collect())
            }),
            s: self.0.s.each_ref().map(|row| row.each_ref().map(congruent)),
            modal_stiffness: Mat::from_fn(t.ncols(), t.ncols(), |p, q| {
                0.5 * (stiffness[(p, q)] + stiffness[(q, p)])
            }),
            general: self.0.general.as_ref().map(|general| {
                let block = |a: &Mat<f64>, row: usize| a.as_ref().subrows(row, nf).to_owned();
                let w0 = [0, 1, 2].map(|b| product(general.w0.as_ref().subcols(b * nf, nf), t));
                let w3 = [0, 1, 2].map(|b| congruent(&block(&general.w3, b * nf)));
                let (nt, mass) = (t.ncols(), congruent(&general.modal_mass));
                GeneralTerms {
                    w0: Mat::from_fn(3, 3 * nt, |k, column| w0[column / nt][(k, column % nt)]),
                    w3: Mat::from_fn(3 * nt, nt, |row, q| w3[row / nt][(row % nt, q)]),
                    modal_mass: Mat::from_fn(nt, nt, |p, q| 0.5 * (mass[(p, q)] + mass[(q, p)])),
                    plane: general.plane,
                }
            }),
            groups: self.0.groups,
        });
        symmetrise(&mut changed.0.s);
        changed.with_groups(self.0.groups)
    }
}
