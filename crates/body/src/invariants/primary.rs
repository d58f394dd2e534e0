//! The primary inertia data of a flexible body and the invariants that are linear in them.

use super::TermGroups;
use faer::Mat;
use nalgebra::{DMatrix, Matrix3, Vector3};

/// Constant inertia data of a body about its frame origin, in frame axes (theory section 2).
///
/// `nf` modes; coordinates x (n x 3) and modes Psi_k (n x nf, component k) are in the same frame. Only the
/// primary data are stored; [`Invariants::inertia`], [`Invariants::w1`] and the others follow from them.
///
/// The arrays have shapes that belong together, and nothing can be read that the body does not hold: what a
/// dropped group would give answers `None`, and [`kind`](Invariants::kind) says whether S and Ibar tell all
/// there is.
#[derive(Debug, Clone, PartialEq)]
pub struct Invariants(pub(super) PrimaryData);

/// What sort of mass the invariants were condensed from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MassKind<'a> {
    /// M = Ms kron I3: it commutes with rotations, and J, C1, Ibar and S tell everything.
    Solid,
    /// A mass that does not commute with rotations: nodal rotations, constraints, directional masses.
    General(&'a GeneralTerms),
    /// A body that moves in its plane z = 0 only; nothing but its rotation about z is known.
    Plane(&'a GeneralTerms),
}

/// The arrays of [`Invariants`] as files hold them, not yet checked.
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
    /// `Ibar[k][l]` (nf) = x_k' Ms Psi_l. Antisymmetric, no more than what gives C2, where W1 is not held.
    pub ibar: [[Vec<f64>; 3]; 3],
    /// `S[k][l]` (nf x nf) = Psi_k' Ms Psi_l. No more than what gives m_ff and, where it is held, W3, where
    /// W2 is not held.
    pub s: [[Mat<f64>; 3]; 3],
    /// K_ff (nf x nf) = Psi' K Psi.
    pub modal_stiffness: Mat<f64>,
    /// What S and C1 do not determine when M does not commute with rotations.
    pub general: Option<GeneralTerms>,
    /// The groups of the kinetic energy that are held; the arrays know nothing of others
    /// ([`Invariants::with_groups`]).
    pub groups: TermGroups,
}

impl Invariants {
    /// The invariants with these arrays. Their numbers are checked by
    /// [`FlexBody::new`](crate::flex_body::FlexBody::new), which tells all that is wrong with a body at
    /// once.
    ///
    /// # Panics
    /// When the arrays have other shapes than [`PrimaryData`] says.
    pub fn new(data: PrimaryData) -> Self {
        let invariants = Self(data);
        assert!(invariants.has_its_shapes(), "arrays of shapes that do not belong together");
        invariants
    }

    /// m = 1' Ms 1. Unit: mass.
    pub fn mass(&self) -> f64 {
        self.0.mass
    }

    /// First moment c_k = 1' Ms x_k. Unit: mass length.
    pub fn first_moment(&self) -> Vector3<f64> {
        self.0.first_moment
    }

    /// Second moment J_kl = x_k' Ms x_l, or tr(I0)/2 I - I0. Unit: mass length^2.
    pub fn second_moment(&self) -> Matrix3<f64> {
        self.0.second_moment
    }

    /// C1 (3 x nf) = 1' Ms Psi_k.
    pub fn c1(&self) -> &Mat<f64> {
        &self.0.c1
    }

    /// `Ibar[k][l]` (nf) = x_k' Ms Psi_l; `None` where the body does not hold W1. Of a mass that is not
    /// [solid](MassKind::Solid), what gives W1 and C2 by their formulas, and nothing else.
    pub fn ibar(&self) -> Option<&[[Vec<f64>; 3]; 3]> {
        self.0.groups.w1.then_some(&self.0.ibar)
    }

    /// `S[k][l]` (nf x nf) = Psi_k' Ms Psi_l; `None` where the body does not hold W2. Of a mass that is not
    /// [solid](MassKind::Solid), what gives W2 by its formula, and nothing else.
    pub fn s(&self) -> Option<&[[Mat<f64>; 3]; 3]> {
        self.0.groups.w2.then_some(&self.0.s)
    }

    /// What C2 is the difference of: Ibar or, where the body does not hold W1, the antisymmetric arrays that
    /// give the same C2.
    pub fn ibar_or_half_c2(&self) -> &[[Vec<f64>; 3]; 3] {
        &self.0.ibar
    }

    /// K_ff (nf x nf) = Psi' K Psi.
    pub fn modal_stiffness(&self) -> &Mat<f64> {
        &self.0.modal_stiffness
    }

    /// The symmetric part of K_ff, which is what rounding leaves of it.
    pub fn symmetric_stiffness(&self) -> DMatrix<f64> {
        let k = &self.0.modal_stiffness;
        DMatrix::from_fn(k.nrows(), k.ncols(), |i, j| 0.5 * (k[(i, j)] + k[(j, i)]))
    }

    /// Whether the mass commutes with rotations, and what else is known of one that does not.
    pub fn kind(&self) -> MassKind<'_> {
        match &self.0.general {
            None => MassKind::Solid,
            Some(terms) if terms.plane => MassKind::Plane(terms),
            Some(terms) => MassKind::General(terms),
        }
    }

    /// What a mass that does not commute with rotations adds; `None` of a [solid](MassKind::Solid).
    pub fn general(&self) -> Option<&GeneralTerms> {
        self.0.general.as_ref()
    }

    /// The groups of the kinetic energy that the body holds.
    pub fn groups(&self) -> TermGroups {
        self.0.groups
    }

    /// The arrays themselves, to break them: what they hold is checked again by whoever makes a body of them.
    pub fn primary_mut(&mut self) -> &mut PrimaryData {
        &mut self.0
    }
}

/// Terms of a mass matrix that does not commute with rotations (theory section 6), with Phi_t the unit
/// translations and the rows of B_j those of -psi_j~ at displacements and zero at rotations.
///
/// J, Ibar and S of such a body are those that give its I0, W1, C2 and W2 by the formulas of theory section
/// 2; no other formula may use them: W3, m_ff and the coupling of translation and rotation stand here.
#[derive(Debug, Clone, PartialEq)]
pub struct GeneralTerms {
    /// W0 (3 x 3nf): Phi_t' M B_j, column b nf + j for axis b. -C1_j~ when M commutes with rotations.
    pub w0: Mat<f64>,
    /// W3 (3nf x nf): B_i' M Psi, row b nf + i for axis b; zero where it is not held.
    pub w3: Mat<f64>,
    /// m_ff (nf x nf) = Psi' M Psi.
    pub modal_mass: Mat<f64>,
    /// Of a plane body: nothing but its rotation about z is known, the entries of J, Ibar and S about the
    /// other axes are those of a lamina that is the same in all directions about its centre of mass.
    pub plane: bool,
}
