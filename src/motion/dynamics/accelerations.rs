//! Accelerations from forces, and velocities from momenta: what Mc(q) solves.

use super::Evaluation;
use super::kernels::{add_scaled, dot};
use nalgebra::{Vector3, Vector6};

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

/// Rigid motion that is given instead of following from forces, in body axes: velocities of the frame or, where accelerations are asked
/// for, their rates of change. What is `None` is free.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Prescribed {
    /// V or V'.
    pub linear: Option<Vector3<f64>>,
    /// omega or omega'.
    pub angular: Option<Vector3<f64>>,
}

impl Prescribed {
    /// Nothing: a free body.
    pub const NOTHING: Self = Self { linear: None, angular: None };

    /// What is given of entry `axis` of (V, omega).
    fn of(&self, axis: usize) -> Option<f64> {
        if axis < 3 { self.linear.map(|v| v[axis]) } else { self.angular.map(|w| w[axis - 3]) }
    }
}

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
        self.prescribed_accelerations(applied, &Prescribed::NOTHING, acceleration)
    }

    /// [`Evaluation::accelerations`] where V' or omega' are given: the forces of `applied` that belong to them are not read.
    /// [`Evaluation::balance`] of the result has the forces that such motion takes.
    ///
    /// # Errors
    /// As there.
    ///
    /// # Panics
    /// As there.
    pub fn prescribed_accelerations(
        &mut self,
        applied: &[f64],
        prescribed: &Prescribed,
        acceleration: &mut [f64],
    ) -> Result<(), NotPositiveDefinite> {
        let body = self.equations;
        let (n, r) = (body.n_velocities(), body.rigid.len());
        assert!(applied.len() == n && acceleration.len() == n, "one entry per rigid motion and mode");
        let (force, torque, modal) = body.split(applied);
        let (force_h, torque_h, modal_h) = body.split(&self.velocity_forces);
        for ((entry, applied), h) in self.modal.iter_mut().zip(modal).zip(modal_h) {
            *entry = applied - h;
        }
        let (linear, angular) = self
            .arch()
            .dispatch(|| {
                body.add_internal(-1.0, &self.q, &self.qd, &mut self.modal);
                self.solve(&(force - force_h), &(torque - torque_h), prescribed)
            })
            .ok_or(NotPositiveDefinite)?;
        body.put_rigid(linear, angular, &mut acceleration[..r]);
        acceleration[r..].copy_from_slice(&self.modal);
        Ok(())
    }

    /// Solves Mc(q) x = (linear, angular, `self.modal`): x of V and omega, that of the modes to `self.modal`.
    #[inline(always)] // compiled once per instruction set
    pub(super) fn solve(
        &mut self,
        linear: &Vector3<f64>,
        angular: &Vector3<f64>,
        prescribed: &Prescribed,
    ) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let body = self.equations;
        let nf = body.nf;
        body.modal_mass.solve_lower(&mut self.modal)?;
        let mut matrix = self.rigid_mass();
        let mut sides = Vector6::zeros();
        for (at, &i) in body.rigid.iter().enumerate() {
            let row = &mut self.whitened[i * nf..][..nf];
            row.copy_from_slice(body.coupling_row(&self.coupling, i));
            body.modal_mass.solve_lower(row)?;
            let row = &self.whitened[i * nf..][..nf];
            let side = if i < 3 { linear[i] } else { angular[i - 3] };
            sides[i] = side - dot(row, &self.modal);
            for &j in &body.rigid[..=at] {
                matrix[(i, j)] -= dot(row, &self.whitened[j * nf..][..nf]);
                matrix[(j, i)] = matrix[(i, j)];
            }
        }
        // Motions that are given, or that a plane body does not have.
        for i in 0..6 {
            let given = if body.rigid.contains(&i) { prescribed.of(i) } else { Some(0.0) };
            let Some(value) = given else { continue };
            for j in 0..6 {
                sides[j] -= matrix[(j, i)] * value;
                (matrix[(i, j)], matrix[(j, i)]) = (0.0, 0.0);
            }
            (matrix[(i, i)], sides[i]) = (1.0, value);
        }
        let rigid = matrix.cholesky()?.solve(&sides);
        for &i in body.rigid {
            add_scaled(-rigid[i], &self.whitened[i * nf..][..nf], &mut self.modal);
        }
        body.modal_mass.solve_upper(&mut self.modal)?;
        Some((Vector3::from_fn(|k, _| rigid[k]), Vector3::from_fn(|k, _| rigid[3 + k])))
    }
}
