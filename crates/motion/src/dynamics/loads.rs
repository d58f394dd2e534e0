//! Generalised forces of gravity, and their derivatives.

use super::kernels::add_scaled;
use super::{EquationsOfMotion, Evaluation, LoadJacobian};
use nalgebra::Vector3;

impl Evaluation<'_> {
    /// Adds the forces of uniform gravity: (m g, s x g, C1(q)'g), the gradient of -g'(m R + A s).
    ///
    /// * `gravity`: A'g, in body axes. Unit: length/time^2.
    /// * `forces`: 6 + nf entries, for a plane body 3 + nf.
    ///
    /// # Panics
    /// When `forces` has another length.
    pub fn add_gravity(&self, gravity: &Vector3<f64>, forces: &mut [f64]) {
        let body = self.equations();
        let modal = body.add_rigid(body.mass * gravity, self.first_moment().cross(gravity), forces);
        for k in 0..3 {
            add_scaled(gravity[k], body.coupling_row(&self.coupling, k), modal);
        }
    }

    /// Adds the derivatives of the forces of gravity, b = A'g:
    ///
    /// ```text
    /// dtau/dq_j = C1(q)_j x b,    dQ_i/dq_j = K^a_ij . b,    d/dphi = (m b~, s~ b~, C1(q)' b~)
    /// ```
    ///
    /// # Panics
    /// When a length of `jacobian` is not that of the equations.
    pub fn add_gravity_jacobian(&self, gravity: &Vector3<f64>, jacobian: &mut LoadJacobian<'_>) {
        let body = self.equations();
        let row = |k: usize| body.coupling_row(&self.coupling, k);
        jacobian.check(body);
        for j in 0..body.nf {
            let moved = Vector3::from_fn(|k, _| row(k)[j]);
            jacobian.add_by_q(body, j, &moved.cross(gravity));
        }
        if let Some(accelerated) = &body.accelerated {
            for k in 0..body.translations() {
                for i in 0..body.nf {
                    for (entry, value) in
                        jacobian.modal_row(body, i).iter_mut().zip(accelerated.row(k * body.nf + i))
                    {
                        *entry += gravity[k] * value;
                    }
                }
            }
        }
        for (at, &axis) in body.axes.iter().enumerate() {
            let turned = gravity.cross(&Vector3::ith(axis, 1.0));
            let torque = self.first_moment().cross(&turned);
            jacobian.add_by_turn(body, at, &(body.mass * turned), &torque, |j| {
                (0..3).map(|k| turned[k] * row(k)[j]).sum()
            });
        }
    }
}

impl EquationsOfMotion {
    /// Adds a force and a torque about the origin; returns the modal forces.
    pub(super) fn add_rigid<'f>(
        &self,
        force: Vector3<f64>,
        torque: Vector3<f64>,
        forces: &'f mut [f64],
    ) -> &'f mut [f64] {
        assert_eq!(forces.len(), self.n_velocities(), "one entry per rigid motion and mode");
        let (rigid, modal) = forces.split_at_mut(self.rigid.len());
        let mut values = [0.0; 6];
        self.put_rigid(force, torque, &mut values[..rigid.len()]);
        rigid.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        modal
    }
}
