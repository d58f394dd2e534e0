//! What a Craig-Bampton basis is made of, what is proved of it, and how far it goes.

/// The fixed-interface modes of a Craig-Bampton basis, and the free body beside the reduced one.
#[derive(Debug, Clone, PartialEq)]
pub struct FixedInterface {
    /// Fixed-interface modes that the basis has; none: static condensation.
    pub modes: usize,
    /// Motions of the interfaces: constraint modes.
    pub interface_motions: usize,
    /// Fixed-interface modes below `shift` by the inertia count of T'(K - sigma M)T; `None`: not counted.
    pub counted: Option<usize>,
    /// Shift sigma of that count. Unit: 1/time^2.
    pub shift: f64,
    /// Eigenvalue of the first mode that the basis leaves out, where it was computed. Unit: 1/time^2.
    pub next: Option<f64>,
    /// Largest residual of a fixed-interface mode, relative as those of modes; 0 without any.
    pub residual: f64,
    /// For each mode of the reduced body the eigenvalue of the free body as estimated, which is an upper
    /// bound of it. Unit: 1/time^2.
    pub free_estimate: Vec<f64>,
    /// Lower bounds of these, to rounding; 0: none. Unit: 1/time^2.
    pub free_lower: Vec<f64>,
}
