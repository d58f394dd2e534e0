//! Restriction of a body to fewer groups, modes or digits.

use super::derived::CYCLIC;
use super::general::symmetrise;
use super::{GeneralTerms, Invariants, PrimaryData, TermGroups};
use faer::Mat;

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

    /// Returns the invariants with every array multiplied by its factor, for other units.
    pub(crate) fn scaled(&self, factors: &UnitFactors) -> Self {
        let given = &self.0;
        let times = |a: &Mat<f64>, factor: f64| Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] * factor);
        let vectors = |row: &[Vec<f64>; 3]| {
            row.each_ref().map(|entries| entries.iter().map(|v| v * factors.ibar).collect())
        };
        Self(PrimaryData {
            mass: given.mass * factors.mass,
            first_moment: given.first_moment * factors.first_moment,
            second_moment: given.second_moment * factors.second_moment,
            c1: times(&given.c1, factors.c1),
            ibar: given.ibar.each_ref().map(vectors),
            s: given.s.clone(),
            modal_stiffness: times(&given.modal_stiffness, factors.modal_stiffness),
            general: given
                .general
                .as_ref()
                .map(|general| GeneralTerms { w0: times(&general.w0, factors.c1), ..general.clone() }),
            groups: given.groups,
        })
    }

    /// Returns true if the arrays contain no data of groups that are not held.
    pub(crate) fn holds_its_groups_only(&self) -> bool {
        *self == self.clone().with_groups(self.0.groups)
    }
}

/// Factors of the arrays for a change of units; S needs none.
pub struct UnitFactors {
    /// Factor of the mass.
    pub mass: f64,
    /// Factor of the first moment c.
    pub first_moment: f64,
    /// Factor of the second moment J.
    pub second_moment: f64,
    /// Factor of C1 and W0.
    pub c1: f64,
    /// Factor of C2 and Ibar.
    pub ibar: f64,
    /// Factor of the modal stiffness.
    pub modal_stiffness: f64,
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
