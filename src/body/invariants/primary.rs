//! The primary inertia data of a flexible body and the invariants that are linear in them.

use super::Groups;
use faer::Mat;
use nalgebra::{Matrix3, Vector3};

/// Constant inertia data of a body about its frame origin, in frame axes (theory section 2).
///
/// `nf` modes; coordinates x (n x 3) and modes Psi_k (n x nf, component k) are in the same frame. Only the primary
/// data are stored; [`Invariants::inertia`], [`Invariants::w1`] and the others follow from them.
#[derive(Debug, Clone, PartialEq)]
pub struct Invariants {
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
    /// `S[k][l]` (nf x nf) = Psi_k' Ms Psi_l. No more than what gives m_ff and, where it is held, W3, where W2 is not held.
    pub s: [[Mat<f64>; 3]; 3],
    /// K_ff (nf x nf) = Psi' K Psi.
    pub modal_stiffness: Mat<f64>,
    /// What S and C1 do not determine when M does not commute with rotations.
    pub general: Option<GeneralTerms>,
    /// The groups of the kinetic energy that are held; the arrays know nothing of others ([`Invariants::with_groups`]).
    pub groups: Groups,
}

/// Terms of a mass matrix that does not commute with rotations (theory section 6), with Phi_t the unit translations and the
/// rows of B_j those of -psi_j~ at displacements and zero at rotations.
///
/// J, Ibar and S of such a body are those that give its I0, W1, C2 and W2 by the formulas of theory section 2; no other
/// formula may use them: W3, m_ff and the coupling of translation and rotation stand here.
#[derive(Debug, Clone, PartialEq)]
pub struct GeneralTerms {
    /// W0 (3 x 3nf): Phi_t' M B_j, column b nf + j for axis b. -C1_j~ when M commutes with rotations.
    pub w0: Mat<f64>,
    /// W3 (3nf x nf): B_i' M Psi, row b nf + i for axis b; zero where it is not held.
    pub w3: Mat<f64>,
    /// m_ff (nf x nf) = Psi' M Psi.
    pub modal_mass: Mat<f64>,
    /// Of a plane body: nothing but its rotation about z is known, the entries of J, Ibar and S about the other axes are those of a
    /// lamina that is the same in all directions about its centre of mass.
    pub plane: bool,
}
