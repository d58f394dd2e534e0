//! Rigid motion as modes: M in rigid motions and modes, and a change of the rigid motion contained in the
//! modes.

use super::{GeneralTerms, Invariants, PrimaryData, TermGroups};
use faer::{Mat, MatRef};

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
    /// # Panics
    /// When the sizes disagree, or when a group is not held.
    pub fn without_rigid_motion(&self, taken: MatRef<'_, f64>) -> Self {
        let nf = self.n_modes();
        assert!((taken.nrows(), taken.ncols()) == (6, nf), "six rigid motions of every mode");
        assert!(self.0.groups == TermGroups::ALL, "a body that holds all groups");
        let change = Mat::from_fn(6 + nf, nf, |i, j| match i.checked_sub(6) {
            None => -taken[(i, j)],
            Some(mode) => f64::from(mode == j),
        });
        let mut new = self.with_rigid_modes().with_basis(change.as_ref());
        new.0.modal_stiffness = self.0.modal_stiffness.clone();
        let Some(general) = &self.0.general else { return new };
        let solid = |body: &Self| {
            let solid = body.as_solid();
            (solid.w0(), solid.w3_of_s())
        };
        let ((old_w0, old_w3), (new_w0, new_w3)) = (solid(self), solid(&new));
        let modal_mass = change.transpose() * self.mass_matrix() * &change;
        new.0.general = Some(GeneralTerms {
            w0: new_w0 + (&general.w0 - old_w0),
            w3: new_w3 + (&general.w3 - old_w3),
            modal_mass: Mat::from_fn(nf, nf, |i, j| 0.5 * (modal_mass[(i, j)] + modal_mass[(j, i)])),
            plane: general.plane,
        });
        if general.plane { new.about_z() } else { new }
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
