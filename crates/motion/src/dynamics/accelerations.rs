//! Accelerations from forces, and velocities from momenta: solutions with Mc(q).

use super::Evaluation;
use super::kernels::{add_scaled, dot};
use super::motion::{NotPositiveDefinite, Prescribed};
use nalgebra::{Vector3, Vector6};

impl Evaluation<'_> {
    /// Computes nu' from Mc(q) nu' = applied - h_nu - (0, 0, K_ff q + D qd).
    ///
    /// `applied` are the generalised forces (F, tau, Q) without elastic and damping forces. V' is the rate
    /// of the components in body axes, so that R'' = A (V' + omega x V). Block elimination: with m_ff = L
    /// L' and Y = L^-1 \[C1' C(q)'\] the rigid motions remain with Mc_rr - Y'Y, 6 x 6 (for a plane body 3 x
    /// 3).
    ///
    /// # Errors
    /// [`NotPositiveDefinite`]; `acceleration` then has no meaning.
    ///
    /// # Panics
    /// When a length is not 6 + nf (for a plane body 3 + nf).
    pub fn accelerations(
        &mut self,
        applied: &[f64],
        acceleration: &mut [f64],
    ) -> Result<(), NotPositiveDefinite> {
        self.prescribed_accelerations(applied, &Prescribed::NOTHING, acceleration)
    }

    /// Computes nu' as [`Evaluation::accelerations`] does, with prescribed components of V' or omega'. The
    /// forces of `applied` along these components are not read. [`Evaluation::balance`] of the result
    /// contains the forces of the prescribed motion.
    ///
    /// # Errors
    /// The errors of [`Evaluation::accelerations`].
    ///
    /// # Panics
    /// The panics of [`Evaluation::accelerations`].
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

    /// Sets the state to modal coordinates `q` (nf) and momenta (p, h, pi) = Mc(q) nu, in the order of nu.
    /// The cost is that of [`Evaluation::set`] and one solution with Mc.
    ///
    /// * `prescribed`: components of V or omega given instead of their momenta. The momenta along them
    ///   follow, and those in `momenta` are not read.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`]; the state then has no meaning.
    ///
    /// # Panics
    /// When the lengths are not those of the equations.
    pub fn set_momenta(
        &mut self,
        q: &[f64],
        momenta: &[f64],
        prescribed: &Prescribed,
    ) -> Result<(), NotPositiveDefinite> {
        let body = self.equations;
        assert_eq!(q.len(), body.nf, "one coordinate per mode");
        let (p, h, pi) = body.split(momenta);
        self.q.copy_from_slice(q);
        self.modal.copy_from_slice(pi);
        self.arch()
            .dispatch(|| {
                self.deform();
                let (velocity, omega) = self.solve(&p, &h, prescribed)?;
                (self.velocity, self.omega) = (velocity, omega);
                self.qd.copy_from_slice(&self.modal);
                self.move_on();
                Some(())
            })
            .ok_or(NotPositiveDefinite)
    }

    /// Solves Mc(q) x = (linear, angular, `self.modal`): returns x of V and omega, and writes that of the
    /// modes to `self.modal`.
    #[inline(always)] // compiled once per instruction set
    fn solve(
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
        // Replace the equations of motions that are prescribed, or that a plane body does not have.
        for i in 0..6 {
            let given = if body.rigid.contains(&i) { prescribed.entry(i) } else { Some(0.0) };
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
