//! Number of multiplications in an evaluation of the equations of motion.

use super::EquationsOfMotion;
use super::equations::PAIRS;
use super::kernels::Panels;
use super::modal_matrix::{ModalMass, ModalMatrix};

impl EquationsOfMotion {
    /// Returns the number of multiplications of one evaluation with
    /// [`Evaluation::set`](super::Evaluation::set) and
    /// [`Evaluation::accelerations`](super::Evaluation::accelerations): one call of an explicit integrator,
    /// here or in the momenta of a motion.
    ///
    /// Counted from the arrays in memory, including the rows that pad a panel. With nf modes, r rigid
    /// motions, a axes and p pairs of axes to turn about, and t axes to move along:
    ///
    /// | what | multiplications |
    /// |---|---|
    /// | terms linear in q | 2 rows nf, and (3 + 9) nf and, with W1, 6 nf in momenta and forces |
    /// | W2 | rows nf + 3 p nf |
    /// | W3 | 2 rows nf + 2 a nf; skew blocks of their own: rows nf more |
    /// | geometric stiffness for acceleration | 2 rows nf + 5 t nf |
    /// | elimination of the modes | (r (r + 1) / 2 + 2 r) nf, and r + 2 solutions with the factor of a full m_ff |
    /// | K_ff and D | 2 nf each, or nf (nf + 1) where they are full |
    ///
    /// Some hundred operations with 3-vectors and 6 x 6 matrices, independent of nf, and the forces of the
    /// surroundings are not counted.
    pub fn multiplications(&self) -> usize {
        let (nf, r, a, t) = (self.nf, self.rigid.len(), self.axes.len(), self.translations());
        let panels = |panels: &Option<Panels>| panels.as_ref().map_or(0, |panels| panels.padded_rows() * nf);
        let there = |panels: &Option<Panels>, count: usize| if panels.is_some() { count * nf } else { 0 };
        let w1 = if self.terms().w1 { PAIRS.len() * nf } else { 0 };
        let linear = 2 * self.linear_panels.padded_rows() * nf + (3 + 9) * nf + w1;
        let w2 = panels(&self.w2) + there(&self.w2, 3 * self.pairs.len());
        let w3 = 2 * panels(&self.w3) + there(&self.w3, 2 * a) + panels(&self.w3_skew);
        let accelerated = 2 * panels(&self.accelerated) + there(&self.accelerated, 5 * t);
        let triangles = match &self.modal_mass {
            ModalMass::Identity => 0,
            ModalMass::Full { .. } => (r + 2) * nf * (nf + 1) / 2,
        };
        let elimination = (r * (r + 1) / 2 + 2 * r) * nf + triangles;
        let internal = [&self.stiffness, &self.damping].map(|matrix| match matrix {
            ModalMatrix::Diagonal(_) => 2 * nf,
            ModalMatrix::Full { .. } => nf * (nf + 1),
        });
        linear + w2 + w3 + accelerated + elimination + internal[0] + internal[1]
    }
}
