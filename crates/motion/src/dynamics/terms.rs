//! Which terms of the kinetic energy an equation of motion has.

use flexbody_body::flex_body::TermGroups;

/// Terms by group of the kinetic energy (theory section 7).
///
/// A group is there or not in every place where it acts: mass matrix, inertia forces, momenta and energy.
/// What is left are the equations of motion of the truncated kinetic energy, which keep that energy and both
/// momenta whatever is dropped. m, c, I0, C1, C2, W0 and m_ff are always there. Without W2, W3 and geometric
/// stiffness an evaluation costs a multiple of nf, not of nf^2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Terms {
    /// W1: inertia linear in q, and the constant centrifugal load of the modes.
    pub w1: bool,
    /// W2: inertia quadratic in q, and the centrifugal load that grows with q.
    pub w2: bool,
    /// W3: coupling of rotation and modes through q, and the Coriolis force among modes.
    pub w3: bool,
    /// Geometric stiffness for the motion of the frame and for forces at interfaces (theory 7.4), of a body
    /// that has it. That for spin is free of cost where W2 is kept.
    pub geometric_stiffness: bool,
}

impl Terms {
    /// Everything that the body has: the exact equations.
    pub const ALL: Self = Self { w1: true, w2: true, w3: true, geometric_stiffness: true };
    /// Nothing that depends on the deformation but the first moment c + C1 q.
    pub const NONE: Self = Self { w1: false, w2: false, w3: false, geometric_stiffness: false };

    /// Those of a body that holds `groups`.
    pub fn held(self, groups: TermGroups) -> Self {
        Self { w1: self.w1 && groups.w1, w2: self.w2 && groups.w2, w3: self.w3 && groups.w3, ..self }
    }
}

impl Default for Terms {
    /// [`Terms::ALL`]: nothing is dropped unless asked for.
    fn default() -> Self {
        Self::ALL
    }
}
