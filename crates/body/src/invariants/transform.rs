//! Changes of the primary data: with the frame and with the basis (theory section 5), by the rigid motion contained in
//! the modes, and restriction to fewer groups, modes or digits.

use super::derived::CYCLIC;
use super::general::{ibar_of, plane_ibar, plane_w0, symmetrise};
use super::{GeneralTerms, Invariants, PrimaryData, TermGroups};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{ComputeEigenvectors, self_adjoint_evd, self_adjoint_evd_scratch};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use flexbody_linalg::largest_entry;
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
            general.w0 = if general.plane { plane_w0(&w0) } else { w0 };
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

impl Invariants {
    /// Returns \[m I, -c~, C1; ., I0, C2; ., ., m_ff\], the matrix M in the six rigid motions and the
    /// modes.
    pub fn mass_matrix(&self) -> Mat<f64> {
        let (c1, c2, modal) = (&self.0.c1, self.c2(), self.modal_mass());
        let (lever, inertia) = (self.0.first_moment.cross_matrix(), self.inertia());
        let nf = self.n_modes();
        Mat::from_fn(6 + nf, 6 + nf, |i, j| match (i.min(j), i.max(j)) {
            (a, b) if b < 3 => self.0.mass * f64::from(a == b),
            (a, b) if a < 3 && b < 6 => -lever[(a, b - 3)],
            (a, b) if b < 6 => inertia[(a - 3, b - 3)],
            (a, b) if a < 3 => c1[(a, b - 6)],
            (a, b) if a < 6 => c2[(a - 3, b - 6)],
            _ => modal[(i - 6, j - 6)],
        })
    }

    /// Returns the invariants of a body with M = Ms kron I3 with its rigid motions, e_c and e_c x x, as six
    /// modes before the others.
    fn with_rigid_modes(&self) -> Self {
        let old = self;
        let nf = old.n_modes();
        let (m, c, j) = (old.0.mass, &old.0.first_moment, &old.0.second_moment);
        let axes = || 0..3;
        let delta = |a: usize, b: usize| f64::from(a == b);
        // (e_d x c)_l.
        let turned = |l: usize, d: usize| axes().map(|i| permutation(l, d, i) * c[i]).sum::<f64>();
        let c1 = Mat::from_fn(3, 6 + nf, |k, p| match p {
            0..3 => m * delta(k, p),
            3..6 => turned(k, p - 3),
            _ => old.0.c1[(k, p - 6)],
        });
        let ibar = |k: usize, l: usize, p: usize| match p {
            0..3 => delta(l, p) * c[k],
            3..6 => axes().map(|i| permutation(l, p - 3, i) * j[(k, i)]).sum(),
            _ => old.0.ibar[k][l][p - 6],
        };
        // u_k' Ms v_l of motions in the order translations, rotations, modes.
        let product = |k: usize, l: usize, p: usize, q: usize| match (p, q) {
            (0..3, 0..3) => delta(k, p) * delta(l, q) * m,
            (0..3, 3..6) => delta(k, p) * turned(l, q - 3),
            (0..3, _) => delta(k, p) * old.0.c1[(l, q - 6)],
            (3..6, 3..6) => {
                let entry =
                    |a: usize, b: usize| permutation(k, p - 3, a) * permutation(l, q - 3, b) * j[(a, b)];
                axes().flat_map(|a| axes().map(move |b| (a, b))).map(|(a, b)| entry(a, b)).sum()
            }
            (3..6, _) => axes().map(|i| permutation(k, p - 3, i) * old.0.ibar[i][l][q - 6]).sum(),
            _ => old.0.s[k][l][(p - 6, q - 6)],
        };
        let rank = |p: usize| (p / 3).min(2);
        let s = |k: usize, l: usize| {
            Mat::from_fn(6 + nf, 6 + nf, |p, q| {
                if rank(p) <= rank(q) { product(k, l, p, q) } else { product(l, k, q, p) }
            })
        };
        Self(PrimaryData {
            mass: m,
            first_moment: *c,
            second_moment: *j,
            c1,
            ibar: [0, 1, 2].map(|k| [0, 1, 2].map(|l| (0..6 + nf).map(|p| ibar(k, l, p)).collect())),
            s: [0, 1, 2].map(|k| [0, 1, 2].map(|l| s(k, l))),
            modal_stiffness: Mat::from_fn(6 + nf, 6 + nf, |p, q| {
                if p < 6 || q < 6 { 0.0 } else { old.0.modal_stiffness[(p - 6, q - 6)] }
            }),
            general: None,
            groups: TermGroups::ALL,
        })
    }

    /// Returns W3 by its formula from S.
    fn w3_of_s(&self) -> Mat<f64> {
        let solid = Self(PrimaryData { general: None, groups: TermGroups::ALL, ..self.0.clone() });
        solid.w3().expect("held")
    }

    /// Returns the body with the modes psi_j - t_j - theta_j x x: `taken` holds the translation t_j and the
    /// rotation theta_j of every mode (6 x nf). Rigid motion has no strain energy, so K_ff does not change.
    ///
    /// The quantities linear in the modes, C1 and C2, and m_ff are exact for every mass matrix, and all
    /// quantities are exact if M commutes with rotations. Otherwise W0 to W3 of the removed rigid motion
    /// are those of a body with equal J whose mass commutes with rotations.
    ///
    /// The new W1 is that of the old modes and of I0. The new W2 and W3 are those of the old modes, of the symmetric part of
    /// Ibar, which W1 holds, and of I0: of a body without W1 the result has none of them.
    ///
    /// # Panics
    /// When the sizes disagree.
    pub fn without_rigid_motion(&self, taken: MatRef<'_, f64>) -> Self {
        let nf = self.n_modes();
        assert!((taken.nrows(), taken.ncols()) == (6, nf), "six rigid motions of every mode");
        let change = Mat::from_fn(6 + nf, nf, |i, j| match i.checked_sub(6) {
            None => -taken[(i, j)],
            Some(mode) => f64::from(mode == j),
        });
        let mut new = self.with_rigid_modes().with_basis(change.as_ref());
        new.0.modal_stiffness = self.0.modal_stiffness.clone();
        let groups = self.0.groups.in_carried_modes();
        let Some(general) = &self.0.general else { return new.with_groups(groups) };
        let solid = |body: &Self| {
            let solid = body.as_solid();
            (solid.w0(), solid.w3_of_s())
        };
        let ((old_w0, old_w3), (new_w0, new_w3)) = (solid(self), solid(&new));
        let modal_mass = change.transpose() * self.mass_matrix() * &change;
        let w0 = new_w0 + (&general.w0 - old_w0);
        new.0.general = Some(GeneralTerms {
            w0: if general.plane { plane_w0(&w0) } else { w0 },
            w3: new_w3 + (&general.w3 - old_w3),
            modal_mass: Mat::from_fn(nf, nf, |i, j| 0.5 * (modal_mass[(i, j)] + modal_mass[(j, i)])),
            plane: general.plane,
        });
        (if general.plane { new.about_z() } else { new }).with_groups(groups)
    }
}

/// Returns the sign of the permutation (a, b, c) of (0, 1, 2); 0 if an index repeats.
fn permutation(a: usize, b: usize, c: usize) -> f64 {
    match (3 + b - a) % 3 {
        0 => 0.0,
        1 if c == 3 - a - b => 1.0,
        2 if c == 3 - a - b => -1.0,
        _ => 0.0,
    }
}

impl Invariants {
    /// Drops all groups that are not in `groups`. The result is a consistent kinetic energy of its own,
    /// which conserves energy and both momenta. m, c, J, C1, C2, W0, m_ff and K_ff do not change.
    pub fn with_groups(mut self, groups: TermGroups) -> Self {
        let groups = self.0.groups.and(groups);
        let nf = self.n_modes();
        if !groups.w1 {
            self.0.ibar = ibar_of_c2(&self.c2());
        }
        if !groups.w2 {
            let (modal_mass, w3) = (self.modal_mass(), self.w3().filter(|_| groups.w3));
            let solid = self.0.general.is_none();
            self.0.s = s_of_modal_mass(nf, solid.then_some(&modal_mass), w3.filter(|_| solid).as_ref());
        }
        if let Some(general) = self.0.general.as_mut().filter(|_| !groups.w3) {
            general.w3.fill(0.0);
        }
        self.0.groups = groups;
        self
    }

    /// Returns the invariants of a subset of the modes, in the order of `modes`.
    ///
    /// # Panics
    /// When an index is not below the number of modes.
    pub fn with_modes(&self, modes: &[usize]) -> Self {
        let (nf, kept) = (self.n_modes(), modes.len());
        let square = |a: &Mat<f64>| Mat::from_fn(kept, kept, |i, j| a[(modes[i], modes[j])]);
        // Maps an index in blocks of kept modes to the index in blocks of all modes.
        let at = |index: usize| index / kept * nf + modes[index % kept];
        Self(PrimaryData {
            mass: self.0.mass,
            first_moment: self.0.first_moment,
            second_moment: self.0.second_moment,
            c1: Mat::from_fn(3, kept, |k, j| self.0.c1[(k, modes[j])]),
            ibar: self
                .0
                .ibar
                .each_ref()
                .map(|row| row.each_ref().map(|entries| modes.iter().map(|&j| entries[j]).collect())),
            s: self.0.s.each_ref().map(|row| row.each_ref().map(square)),
            modal_stiffness: square(&self.0.modal_stiffness),
            general: self.0.general.as_ref().map(|general| GeneralTerms {
                w0: Mat::from_fn(3, 3 * kept, |k, column| general.w0[(k, at(column))]),
                w3: Mat::from_fn(3 * kept, kept, |row, j| general.w3[(at(row), modes[j])]),
                modal_mass: square(&general.modal_mass),
                plane: general.plane,
            }),
            groups: self.0.groups,
        })
    }

    /// Returns the invariants with `round` applied to every entry of Ibar, S, W0 and W3 of held groups. The
    /// arrays that give C2 and m_ff in place of W1 and W2 are not rounded.
    pub(crate) fn rounded(&self, round: impl Fn(f64) -> f64) -> Self {
        let matrix = |a: &Mat<f64>| Mat::from_fn(a.nrows(), a.ncols(), |i, j| round(a[(i, j)]));
        let mut rounded = self.clone();
        if self.0.groups.w1 {
            rounded.0.ibar.iter_mut().flatten().flatten().for_each(|v| *v = round(*v));
        }
        for (k, row) in rounded.0.s.iter_mut().enumerate() {
            for (l, s) in row.iter_mut().enumerate().filter(|(l, _)| self.0.groups.w2 || *l != k) {
                *s = matrix(&self.0.s[k][l]);
            }
        }
        if let Some(general) = &mut rounded.0.general {
            (general.w0, general.w3) = (matrix(&general.w0), matrix(&general.w3));
        }
        rounded
    }

    /// Returns the invariants given by J, C1, Ibar and S alone, as if the mass commuted with rotations.
    pub fn as_solid(&self) -> Self {
        Self(PrimaryData { general: None, ..self.0.clone() })
    }

    /// Returns the invariants with `terms` added, for a mass that does not commute with rotations.
    pub(crate) fn with_general(self, terms: GeneralTerms) -> Self {
        Self(PrimaryData { general: Some(terms), ..self.0 })
    }

    /// Returns the invariants with exactly symmetric J, S_kk and m_ff and with S_lk = S_kl'. Every body has
    /// these symmetries; files with few digits do not.
    pub fn with_symmetries(mut self) -> Self {
        let data = &mut self.0;
        data.second_moment = (data.second_moment + data.second_moment.transpose()) * 0.5;
        symmetrise(&mut data.s);
        if let Some(general) = &mut data.general {
            general.modal_mass = symmetric_part(&general.modal_mass);
        }
        self
    }

    /// Returns true if the arrays contain no data of groups that are not held.
    pub(crate) fn holds_its_groups_only(&self) -> bool {
        *self == self.clone().with_groups(self.0.groups)
    }
}

/// Returns (A + A') / 2.
pub fn symmetric_part(a: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| 0.5 * (a[(i, j)] + a[(j, i)]))
}

/// Returns Ibar of a body without W1: antisymmetric arrays that give C2 (3 x nf) exactly.
pub fn ibar_of_c2(c2: &Mat<f64>) -> [[Vec<f64>; 3]; 3] {
    let half = |k: usize, sign: f64| (0..c2.ncols()).map(|p| sign * 0.5 * c2[(k, p)]).collect();
    let mut ibar = [(); 3].map(|()| [(); 3].map(|()| vec![0.0; c2.ncols()]));
    for (k, l, m) in CYCLIC {
        (ibar[l][m], ibar[m][l]) = (half(k, 1.0), half(k, -1.0));
    }
    ibar
}

/// Returns S of a body without W2: arrays that give m_ff and W3 by their formulas, stored as halves so that
/// sums restore them exactly. Zero where m_ff and W3 are stored separately or not held.
pub fn s_of_modal_mass(
    nf: usize,
    modal_mass: Option<&Mat<f64>>,
    w3: Option<&Mat<f64>>,
) -> [[Mat<f64>; 3]; 3] {
    let mut s = [(); 3].map(|()| [(); 3].map(|()| Mat::zeros(nf, nf)));
    if let Some(m) = modal_mass {
        // Without the sign of a zero, which their sum with the zeros of the third array loses.
        s[0][0] = Mat::from_fn(nf, nf, |i, j| 0.5 * m[(i, j)] + 0.0);
        s[1][1] = s[0][0].clone();
    }
    if let Some(w3) = w3 {
        for (k, l, m) in CYCLIC {
            s[l][m] = Mat::from_fn(nf, nf, |i, j| 0.5 * w3[(k * nf + i, j)]);
            s[m][l] = Mat::from_fn(nf, nf, |i, j| -0.5 * w3[(k * nf + i, j)]);
        }
    }
    s
}

// Small dense kernels on one thread, so that no result depends on the number of threads.

/// Returns A B.
fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut c = Mat::zeros(a.nrows(), b.ncols());
    matmul(&mut c, Accum::Replace, a, b, 1.0, Par::Seq);
    c
}

/// Returns A' B.
fn transpose_product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    product(a.transpose(), b)
}

/// Returns all entries, column by column.
pub(super) fn entries<'a>(a: MatRef<'a, f64>) -> impl Iterator<Item = f64> + 'a {
    (0..a.ncols()).flat_map(move |q| (0..a.nrows()).map(move |p| a[(p, q)]))
}

/// Returns the Frobenius norm, safe against overflow.
pub(super) fn frobenius_norm(a: MatRef<'_, f64>) -> f64 {
    let scale = largest_entry(a);
    if scale == 0.0 || !scale.is_finite() {
        return scale;
    }
    scale * entries(a).map(|v| (v / scale) * (v / scale)).sum::<f64>().sqrt()
}

/// Returns the spectral norm: the square root of the largest eigenvalue of the smaller Gram matrix. NaN if
/// an entry is not finite.
pub(super) fn spectral_norm(a: MatRef<'_, f64>) -> f64 {
    let scale = largest_entry(a);
    if scale == 0.0 {
        return 0.0;
    }
    let scaled = Mat::from_fn(a.nrows(), a.ncols(), |p, q| a[(p, q)] / scale);
    let tall = if a.nrows() < a.ncols() { scaled.as_ref().transpose() } else { scaled.as_ref() };
    let largest = symmetric_eigenvalues(transpose_product(tall, tall).as_ref())
        .and_then(|values| values.last().copied());
    largest.map_or(f64::NAN, |value| scale * value.max(0.0).sqrt())
}

/// Returns the eigenvalues of a symmetric matrix (its lower triangle), ascending; `None` if an entry is not
/// finite or the iteration fails.
pub(super) fn symmetric_eigenvalues(a: MatRef<'_, f64>) -> Option<Vec<f64>> {
    let n = a.nrows();
    if !largest_entry(a).is_finite() {
        return None;
    }
    let mut values = faer::diag::Diag::<f64>::zeros(n);
    let scratch = self_adjoint_evd_scratch::<f64>(n, ComputeEigenvectors::No, Par::Seq, Default::default());
    let mut buffer = MemBuffer::new(scratch);
    self_adjoint_evd(a, values.as_mut(), None, Par::Seq, MemStack::new(&mut buffer), Default::default())
        .ok()?;
    Some((0..n).map(|i| values[i]).collect())
}
