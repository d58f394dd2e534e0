//! Tolerances of a comparison.

/// Largest relative differences that pass.
///
/// The defaults suit two computations of one model on different machines. Bodies from matrices that were
/// written with few digits, or from another mesh, need larger tolerances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerances {
    /// Tolerance of each frequency, relative. Default 1e-9: a residual of 1e-10 bounds eigenvalues far below
    /// 1e-9.
    pub frequency: f64,
    /// Tolerance of the mass, relative. Default 1e-9: three orders above rounding; detects a single missing
    /// element of a large model.
    pub mass: f64,
    /// Tolerance of the inertia about the centre of mass, each entry relative to sqrt(I_kk I_ll). Default
    /// 1e-9.
    pub inertia: f64,
    /// Tolerance of invariants and shapes, relative to the Cauchy-Schwarz bounds, and of damping and of the
    /// stiffness of unit loads, relative to their largest entries. Default 1e-8: the error of a mode shape is
    /// residual / gap, larger than that of its eigenvalue.
    pub invariants: f64,
    /// Tolerance of the centre of mass, of node positions and of the reference points of interfaces, relative
    /// to the radius of gyration. Default 1e-9.
    pub centre_of_mass: f64,
}

impl Default for Tolerances {
    fn default() -> Self {
        Self { frequency: 1e-9, mass: 1e-9, inertia: 1e-9, invariants: 1e-8, centre_of_mass: 1e-9 }
    }
}
