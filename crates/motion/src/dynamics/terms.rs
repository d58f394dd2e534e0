//! Terms of the kinetic energy in an equation of motion.

use flexbody_body::flex_body::TermGroups;

/// Included terms, by group of the kinetic energy (theory section 7).
///
/// A group is included or dropped in all places: mass matrix, inertia forces, momenta and energy. The
/// result is the equations of motion of a truncated kinetic energy, which conserve that energy and both
/// momenta for any choice. m, c, I0, C1, C2, W0 and m_ff are always included. Without W2, W3 and geometric
/// stiffness the cost of an evaluation is proportional to nf instead of nf^2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Terms {
    /// W1: inertia linear in q, and the constant centrifugal load of the modes.
    pub w1: bool,
    /// W2: inertia quadratic in q, and the centrifugal load that grows with q.
    pub w2: bool,
    /// W3: coupling of rotation and modes through q, and the Coriolis force among modes.
    pub w3: bool,
    /// Geometric stiffness for the motion of the frame and for forces at interfaces (theory 7.4), if the
    /// body has it. With W2 the stiffness for spin has no additional cost.
    pub geometric_stiffness: bool,
}

impl Terms {
    /// All terms that the body has: the exact equations.
    pub const ALL: Self = Self { w1: true, w2: true, w3: true, geometric_stiffness: true };
    /// No term that depends on the deformation except the first moment c + C1 q.
    pub const NONE: Self = Self { w1: false, w2: false, w3: false, geometric_stiffness: false };

    /// Returns the terms that a body with `groups` can provide.
    pub fn held(self, groups: TermGroups) -> Self {
        Self { w1: self.w1 && groups.w1, w2: self.w2 && groups.w2, w3: self.w3 && groups.w3, ..self }
    }
}

impl Default for Terms {
    /// Returns [`Terms::ALL`]: terms are dropped only on request.
    fn default() -> Self {
        Self::ALL
    }
}
