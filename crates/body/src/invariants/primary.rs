//! Primary inertia data of a flexible body and the invariants that depend linearly on them, the groups of the kinetic
//! energy that a body holds (theory section 7), and the conditions on the arrays.

use crate::problems::Problems;
use faer::Mat;
use flexbody_base::diagnostic::Diagnostic;
use nalgebra::{DMatrix, Matrix3, Vector3};

/// Constant inertia data of a body about its frame origin, in frame axes (theory section 2).
///
/// `nf` modes; coordinates x (n x 3) and modes Psi_k (n x nf, component k) are in the same frame. Only the
/// primary data are stored; [`Invariants::inertia`], [`Invariants::w1`] and the others follow from them.
///
/// The shapes of the arrays are consistent. Data of a dropped group are not readable: their methods return
/// `None`. [`kind`](Invariants::kind) tells if S and Ibar determine all inertia terms.
#[derive(Debug, Clone, PartialEq)]
pub struct Invariants(pub(super) PrimaryData);

/// Kind of mass matrix that the invariants were condensed from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MassKind<'a> {
    /// M = Ms kron I3: the mass commutes with rotations, and J, C1, Ibar and S determine all inertia terms.
    Solid,
    /// The mass does not commute with rotations: nodal rotations, constraints, directional masses.
    General(&'a GeneralTerms),
    /// The body moves in its plane z = 0 only; only its rotation about z is known.
    Plane(&'a GeneralTerms),
}

/// Arrays of [`Invariants`] in the form that files hold, not yet checked.
#[derive(Debug, Clone, PartialEq)]
pub struct PrimaryData {
    /// m = 1' Ms 1. Unit: mass.
    pub mass: f64,
    /// First moment c_k = 1' Ms x_k. Unit: mass length.
    pub first_moment: Vector3<f64>,
    /// Second moment J_kl = x_k' Ms x_l, or tr(I0)/2 I - I0. Unit: mass length^2.
    pub second_moment: Matrix3<f64>,
    /// C1 (3 x nf) = 1' Ms Psi_k.
    pub c1: Mat<f64>,
    /// `Ibar[k][l]` (nf) = x_k' Ms Psi_l. If W1 is not held: the antisymmetric arrays that give C2.
    pub ibar: [[Vec<f64>; 3]; 3],
    /// `S[k][l]` (nf x nf) = Psi_k' Ms Psi_l. If W2 is not held: arrays that give m_ff and, where W3 is
    /// held, W3.
    pub s: [[Mat<f64>; 3]; 3],
    /// K_ff (nf x nf) = Psi' K Psi.
    pub modal_stiffness: Mat<f64>,
    /// Terms that S and C1 do not determine if M does not commute with rotations.
    pub general: Option<GeneralTerms>,
    /// Groups of the kinetic energy that are held; the arrays contain no data of other groups
    /// ([`Invariants::with_groups`]).
    pub groups: TermGroups,
}

impl Invariants {
    /// Creates invariants from these arrays. [`FlexBody::new`](crate::flex_body::FlexBody::new) checks
    /// their values and reports all errors of a body at once.
    ///
    /// # Panics
    /// When the shapes of the arrays differ from the shapes stated by [`PrimaryData`].
    pub fn new(data: PrimaryData) -> Self {
        let invariants = Self(data);
        assert!(invariants.has_its_shapes(), "arrays of shapes of different sizes");
        invariants
    }

    /// Returns m = 1' Ms 1. Unit: mass.
    pub fn mass(&self) -> f64 {
        self.0.mass
    }

    /// Returns the first moment c_k = 1' Ms x_k. Unit: mass length.
    pub fn first_moment(&self) -> Vector3<f64> {
        self.0.first_moment
    }

    /// Returns the second moment J_kl = x_k' Ms x_l, or tr(I0)/2 I - I0. Unit: mass length^2.
    pub fn second_moment(&self) -> Matrix3<f64> {
        self.0.second_moment
    }

    /// Returns C1 (3 x nf) = 1' Ms Psi_k.
    pub fn c1(&self) -> &Mat<f64> {
        &self.0.c1
    }

    /// Returns `Ibar[k][l]` (nf) = x_k' Ms Psi_l, or `None` if the body does not hold W1. For a mass that
    /// is not [solid](MassKind::Solid) the arrays only serve the formulas of W1 and C2.
    pub fn ibar(&self) -> Option<&[[Vec<f64>; 3]; 3]> {
        self.0.groups.w1.then_some(&self.0.ibar)
    }

    /// Returns `S[k][l]` (nf x nf) = Psi_k' Ms Psi_l, or `None` if the body does not hold W2. For a mass
    /// that is not [solid](MassKind::Solid) the arrays only serve the formula of W2.
    pub fn s(&self) -> Option<&[[Mat<f64>; 3]; 3]> {
        self.0.groups.w2.then_some(&self.0.s)
    }

    /// Returns the arrays whose antisymmetric part gives C2: Ibar or, if the body does not hold W1,
    /// antisymmetric arrays with equal C2.
    pub fn ibar_or_half_c2(&self) -> &[[Vec<f64>; 3]; 3] {
        &self.0.ibar
    }

    /// Returns K_ff (nf x nf) = Psi' K Psi.
    pub fn modal_stiffness(&self) -> &Mat<f64> {
        &self.0.modal_stiffness
    }

    /// Returns the symmetric part of K_ff; the antisymmetric part is rounding.
    pub fn symmetric_stiffness(&self) -> DMatrix<f64> {
        let k = &self.0.modal_stiffness;
        DMatrix::from_fn(k.nrows(), k.ncols(), |i, j| 0.5 * (k[(i, j)] + k[(j, i)]))
    }

    /// Returns the kind of mass matrix, with the additional terms of a mass that does not commute with
    /// rotations.
    pub fn kind(&self) -> MassKind<'_> {
        match &self.0.general {
            None => MassKind::Solid,
            Some(terms) if terms.plane => MassKind::Plane(terms),
            Some(terms) => MassKind::General(terms),
        }
    }

    /// Returns the additional terms of a mass that does not commute with rotations; `None` for a
    /// [solid](MassKind::Solid) mass.
    pub fn general(&self) -> Option<&GeneralTerms> {
        self.0.general.as_ref()
    }

    /// Returns the groups of the kinetic energy that the body holds.
    pub fn groups(&self) -> TermGroups {
        self.0.groups
    }

    /// Returns the arrays for changes. The next body made of them is checked as a whole.
    pub fn primary_mut(&mut self) -> &mut PrimaryData {
        &mut self.0
    }
}

/// Terms of a mass matrix that does not commute with rotations (theory section 6). Phi_t are the unit
/// translations; the rows of B_j are those of -psi_j~ at displacements and zero at rotations.
///
/// J, Ibar and S of such a body give its I0, W1, C2 and W2 by the formulas of theory section 2. No other
/// formula may use them: W3, m_ff and the coupling of translation and rotation are stored here.
#[derive(Debug, Clone, PartialEq)]
pub struct GeneralTerms {
    /// W0 (3 x 3nf): Phi_t' M B_j, column b nf + j for axis b. -C1_j~ when M commutes with rotations.
    pub w0: Mat<f64>,
    /// W3 (3nf x nf): B_i' M Psi, row b nf + i for axis b; zero if not held.
    pub w3: Mat<f64>,
    /// m_ff (nf x nf) = Psi' M Psi.
    pub modal_mass: Mat<f64>,
    /// True for a plane body: only its rotation about z is known, and the entries of J, Ibar and S about
    /// the other axes are those of a lamina that is isotropic about its centre of mass.
    pub plane: bool,
}

// Groups of the kinetic energy that a body holds (theory section 7).

/// Group of the kinetic energy: all terms that one invariant causes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, strum::IntoStaticStr)]
pub enum TermGroup {
    /// Inertia linear in q, and the constant centrifugal load of the modes.
    W1,
    /// Inertia quadratic in q, and the centrifugal load that grows with q.
    W2,
    /// Coupling of rotation and modes through q, and the Coriolis force among modes.
    W3,
}

impl TermGroup {
    /// All groups, in the order of the documentation.
    pub const ALL: [TermGroup; 3] = [Self::W1, Self::W2, Self::W3];

    /// Returns the name in files and reports.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// Set of groups of the kinetic energy. Terms independent of q, and W0, always belong to the kinetic
/// energy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct TermGroups {
    /// [`TermGroup::W1`].
    pub w1: bool,
    /// [`TermGroup::W2`].
    pub w2: bool,
    /// [`TermGroup::W3`].
    pub w3: bool,
}

impl TermGroups {
    /// All groups: the exact kinetic energy.
    pub const ALL: Self = Self { w1: true, w2: true, w3: true };
    /// No group: the kinetic energy of a body whose inertia does not depend on its deformation.
    pub const NONE: Self = Self { w1: false, w2: false, w3: false };

    /// Returns true if `group` is in the set.
    pub fn has(self, group: TermGroup) -> bool {
        match group {
            TermGroup::W1 => self.w1,
            TermGroup::W2 => self.w2,
            TermGroup::W3 => self.w3,
        }
    }

    /// Returns the set with `group` added.
    pub fn with(mut self, group: TermGroup) -> Self {
        match group {
            TermGroup::W1 => self.w1 = true,
            TermGroup::W2 => self.w2 = true,
            TermGroup::W3 => self.w3 = true,
        }
        self
    }

    /// Returns the groups that are not in this set.
    pub fn complement(self) -> Self {
        Self { w1: !self.w1, w2: !self.w2, w3: !self.w3 }
    }

    /// Returns all groups but one.
    pub fn without(group: TermGroup) -> Self {
        Self { w1: group != TermGroup::W1, w2: group != TermGroup::W2, w3: group != TermGroup::W3 }
    }

    /// Returns the groups that are in both sets.
    pub fn and(self, other: Self) -> Self {
        Self { w1: self.w1 && other.w1, w2: self.w2 && other.w2, w3: self.w3 && other.w3 }
    }

    /// Returns the groups that are in at least one of the sets.
    pub fn or(self, other: Self) -> Self {
        Self { w1: self.w1 || other.w1, w2: self.w2 || other.w2, w3: self.w3 || other.w3 }
    }

    /// Returns the groups of this set that are known in modes without their rigid motion: W2 and W3 of these depend on W1 of
    /// the modes with it ([`Invariants::without_rigid_motion`]).
    pub fn in_carried_modes(self) -> Self {
        Self { w1: self.w1, w2: self.w1 && self.w2, w3: self.w1 && self.w3 }
    }

    /// Returns the groups of this set.
    pub fn kept(self) -> impl Iterator<Item = TermGroup> {
        TermGroup::ALL.into_iter().filter(move |group| self.has(*group))
    }

    /// Returns the groups that are missing from this set.
    pub fn dropped(self) -> impl Iterator<Item = TermGroup> {
        TermGroup::ALL.into_iter().filter(move |group| !self.has(*group))
    }
}

impl Default for TermGroups {
    /// Returns [`TermGroups::ALL`]: groups are dropped only on request.
    fn default() -> Self {
        Self::ALL
    }
}

impl Invariants {
    /// Returns true if every array has the shape that follows from nf, the number of columns of C1.
    fn has_its_shapes(&self) -> bool {
        let (data, nf) = (&self.0, self.n_modes());
        let is = |m: &Mat<f64>, rows: usize, columns: usize| (m.nrows(), m.ncols()) == (rows, columns);
        data.c1.nrows() == 3
            && data.ibar.as_flattened().iter().all(|entries| entries.len() == nf)
            && data.s.as_flattened().iter().all(|s| is(s, nf, nf))
            && is(&data.modal_stiffness, nf, nf)
            && data.general.as_ref().is_none_or(|general| {
                is(&general.w0, 3, 3 * nf) && is(&general.w3, 3 * nf, nf) && is(&general.modal_mass, nf, nf)
            })
    }

    /// Returns the errors in the arrays of the invariants called `name`, of a body with `nf` modes.
    pub(crate) fn problems(&self, name: &str, nf: usize) -> Vec<Diagnostic> {
        let data = &self.0;
        let mut problems = Problems::default();
        problems.finite(&format!("{name}.mass"), [data.mass]);
        problems.finite(&format!("{name}.first_moment"), data.first_moment.iter().copied());
        problems.finite(&format!("{name}.second_moment"), data.second_moment.iter().copied());
        problems.matrix(&format!("{name}.c1"), &data.c1, 3, nf);
        for k in 0..3 {
            for l in 0..3 {
                let block = &data.ibar[k][l];
                problems.length(&format!("{name}.ibar[{k}][{l}]"), block.len(), nf, "mode");
                problems.finite(&format!("{name}.ibar[{k}][{l}]"), block.iter().copied());
                problems.matrix(&format!("{name}.s[{k}][{l}]"), &data.s[k][l], nf, nf);
            }
        }
        problems.matrix(&format!("{name}.modal_stiffness"), &data.modal_stiffness, nf, nf);
        if let Some(general) = &data.general {
            problems.matrix(&format!("{name}.w0"), &general.w0, 3, 3 * nf);
            problems.matrix(&format!("{name}.w3"), &general.w3, 3 * nf, nf);
            problems.matrix(&format!("{name}.modal_mass"), &general.modal_mass, nf, nf);
        }
        // The next check assumes that all arrays have valid shapes.
        if problems.is_empty() && data.groups != TermGroups::ALL && !self.holds_its_groups_only() {
            problems.add(format!("`{name}` has entries of groups that it does not hold"));
        }
        problems.found()
    }
}
