//! The primary inertia data of a flexible body and the invariants that are linear in them.

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
    /// Second moment J_kl = x_k' Ms x_l. Unit: mass length^2.
    pub second_moment: Matrix3<f64>,
    /// C1 (3 x nf) = 1' Ms Psi_k.
    pub c1: Mat<f64>,
    /// `Ibar[k][l]` (nf) = x_k' Ms Psi_l.
    pub ibar: [[Vec<f64>; 3]; 3],
    /// `S[k][l]` (nf x nf) = Psi_k' Ms Psi_l.
    pub s: [[Mat<f64>; 3]; 3],
    /// K_ff (nf x nf) = Psi' K Psi.
    pub modal_stiffness: Mat<f64>,
}
