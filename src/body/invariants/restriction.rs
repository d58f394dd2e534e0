//! The same body with fewer groups, modes or digits.

use super::derived::CYCLIC;
use super::{GeneralTerms, Groups, Invariants};
use faer::Mat;

impl Invariants {
    /// The same body with those of its groups only that are in `groups`: a kinetic energy of its own, which keeps itself and both
    /// momenta. m, c, J, C1, C2, W0, m_ff and K_ff stay what they are.
    pub fn with_groups(mut self, groups: Groups) -> Self {
        let groups = self.groups.and(groups);
        let nf = self.n_modes();
        if !groups.w1 {
            self.ibar = ibar_of_c2(&self.c2());
        }
        if !groups.w2 {
            let (modal_mass, w3) = (self.modal_mass(), self.w3().filter(|_| groups.w3));
            let solid = self.general.is_none();
            self.s = s_of_modal_mass(nf, solid.then_some(&modal_mass), w3.filter(|_| solid).as_ref());
        }
        if let Some(general) = self.general.as_mut().filter(|_| !groups.w3) {
            general.w3.fill(0.0);
        }
        self.groups = groups;
        self
    }

    /// The same body with some of its modes, in the order of `modes`.
    ///
    /// # Panics
    /// When an index is not below the number of modes.
    pub fn with_modes(&self, modes: &[usize]) -> Self {
        let (nf, kept) = (self.n_modes(), modes.len());
        let square = |a: &Mat<f64>| Mat::from_fn(kept, kept, |i, j| a[(modes[i], modes[j])]);
        // Index among blocks of all modes of one among blocks of those that are kept.
        let at = |index: usize| index / kept * nf + modes[index % kept];
        Self {
            mass: self.mass,
            first_moment: self.first_moment,
            second_moment: self.second_moment,
            c1: Mat::from_fn(3, kept, |k, j| self.c1[(k, modes[j])]),
            ibar: self
                .ibar
                .each_ref()
                .map(|row| row.each_ref().map(|entries| modes.iter().map(|&j| entries[j]).collect())),
            s: self.s.each_ref().map(|row| row.each_ref().map(square)),
            modal_stiffness: square(&self.modal_stiffness),
            general: self.general.as_ref().map(|general| GeneralTerms {
                w0: Mat::from_fn(3, 3 * kept, |k, column| general.w0[(k, at(column))]),
                w3: Mat::from_fn(3 * kept, kept, |row, j| general.w3[(at(row), modes[j])]),
                modal_mass: square(&general.modal_mass),
                plane: general.plane,
            }),
            groups: self.groups,
        }
    }

    /// The same with `round` of every entry of Ibar, S, W0 and W3 that the body holds for its groups. What gives C2 and m_ff where W1 and
    /// W2 are not held stays.
    pub(crate) fn rounded(&self, round: impl Fn(f64) -> f64) -> Self {
        let matrix = |a: &Mat<f64>| Mat::from_fn(a.nrows(), a.ncols(), |i, j| round(a[(i, j)]));
        let mut rounded = self.clone();
        if self.groups.w1 {
            rounded.ibar.iter_mut().flatten().flatten().for_each(|v| *v = round(*v));
        }
        for (k, row) in rounded.s.iter_mut().enumerate() {
            for (l, s) in row.iter_mut().enumerate().filter(|(l, _)| self.groups.w2 || *l != k) {
                *s = matrix(&self.s[k][l]);
            }
        }
        if let Some(general) = &mut rounded.general {
            (general.w0, general.w3) = (matrix(&general.w0), matrix(&general.w3));
        }
        rounded
    }

    /// Whether nothing is there of the groups that are not held.
    pub(crate) fn holds_its_groups_only(&self) -> bool {
        *self == self.clone().with_groups(self.groups)
    }
}

/// Ibar of a body that lacks W1: what gives C2 (3 x nf), to the last bit.
pub(crate) fn ibar_of_c2(c2: &Mat<f64>) -> [[Vec<f64>; 3]; 3] {
    let half = |k: usize, sign: f64| (0..c2.ncols()).map(|p| sign * 0.5 * c2[(k, p)]).collect();
    let mut ibar = [(); 3].map(|()| [(); 3].map(|()| vec![0.0; c2.ncols()]));
    for (k, l, m) in CYCLIC {
        (ibar[l][m], ibar[m][l]) = (half(k, 1.0), half(k, -1.0));
    }
    ibar
}

/// S of a body that lacks W2: what gives m_ff and W3 by their formulas, halves so that sums restore them to the last bit; zero where
/// these are information of their own, or not held.
pub(crate) fn s_of_modal_mass(
    nf: usize,
    modal_mass: Option<&Mat<f64>>,
    w3: Option<&Mat<f64>>,
) -> [[Mat<f64>; 3]; 3] {
    let mut s = [(); 3].map(|()| [(); 3].map(|()| Mat::zeros(nf, nf)));
    if let Some(m) = modal_mass {
        s[0][0] = Mat::from_fn(nf, nf, |i, j| 0.5 * m[(i, j)]);
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
