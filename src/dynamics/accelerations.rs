//! Accelerations from forces.

use super::Evaluation;
use super::kernels::{add_scaled, dot};
use nalgebra::Vector6;

/// The mass matrix at a state is not positive definite: terms were dropped and the deformation is too large for what is left, or
/// the invariants are not those of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotPositiveDefinite;

impl std::fmt::Display for NotPositiveDefinite {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the mass matrix of the deformed body is not positive definite")
    }
}

impl std::error::Error for NotPositiveDefinite {}

impl Evaluation<'_> {
    /// nu' from Mc(q) nu' = applied - h_nu - (0, 0, K_ff q + D qd).
    ///
    /// `applied` are the generalised forces (F, tau, Q) other than elastic and damping forces; V' is the rate of the components in
    /// body axes, so that R'' = A (V' + omega x V). Block elimination: with m_ff = L L' and Y = L^-1 \[C1' C(q)'\] the rigid
    /// motions are left with Mc_rr - Y'Y, 6 x 6 (of a plane body 3 x 3).
    ///
    /// # Errors
    /// [`NotPositiveDefinite`]; `acceleration` is then without meaning.
    ///
    /// # Panics
    /// When a length is not 6 + nf (of a plane body 3 + nf).
    pub fn accelerations(
        &mut self,
        applied: &[f64],
        acceleration: &mut [f64],
    ) -> Result<(), NotPositiveDefinite> {
        let n = self.equations.n_velocities();
        assert!(applied.len() == n && acceleration.len() == n, "one entry per rigid motion and mode");
        self.arch().dispatch(|| self.solve(applied, acceleration)).ok_or(NotPositiveDefinite)
    }

    #[inline(always)] // compiled once per instruction set
    fn solve(&mut self, applied: &[f64], acceleration: &mut [f64]) -> Option<()> {
        let body = self.equations;
        let (nf, r) = (body.nf, body.rigid.len());
        for ((modal, applied), h) in self.modal.iter_mut().zip(&applied[r..]).zip(&self.velocity_forces[r..])
        {
            *modal = applied - h;
        }
        body.add_internal(-1.0, &self.q, &self.qd, &mut self.modal);
        body.modal_mass.solve_lower(&mut self.modal)?;

        let mut matrix = self.rigid_mass();
        let mut force = Vector6::zeros();
        for (at, &i) in body.rigid.iter().enumerate() {
            let row = &mut self.whitened[i * nf..][..nf];
            row.copy_from_slice(body.coupling_row(&self.coupling, i));
            body.modal_mass.solve_lower(row)?;
            let row = &self.whitened[i * nf..][..nf];
            force[i] = applied[at] - self.velocity_forces[at] - dot(row, &self.modal);
            for &j in &body.rigid[..=at] {
                matrix[(i, j)] -= dot(row, &self.whitened[j * nf..][..nf]);
            }
        }
        // Motions that a plane body does not have: no force, unit mass.
        for i in (0..6).filter(|i| !body.rigid.contains(i)) {
            matrix[(i, i)] = 1.0;
        }
        // Only the lower triangle is read.
        let rigid = matrix.cholesky()?.solve(&force);
        for &i in body.rigid {
            add_scaled(-rigid[i], &self.whitened[i * nf..][..nf], &mut self.modal);
        }
        body.modal_mass.solve_upper(&mut self.modal)?;
        acceleration[r..].copy_from_slice(&self.modal);
        acceleration[..r].iter_mut().zip(body.rigid).for_each(|(entry, &axis)| *entry = rigid[axis]);
        Some(())
    }
}
