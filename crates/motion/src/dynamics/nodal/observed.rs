//! Positions, velocities, momenta and energies of the nodal equations at one state.

use super::{NodalConfiguration, NodalEvaluation};
use nalgebra::{Matrix3, Vector3};

impl NodalEvaluation<'_> {
    /// The state as positions and velocities.
    pub fn configuration(&self) -> NodalConfiguration {
        NodalConfiguration {
            origin: self.origin,
            attitude: self.attitude.normalised(),
            velocity: self.axes * self.velocity,
            omega: self.equations.frame.axes.tr_mul(&self.omega),
            u: self.u.clone(),
            ud: self.ud.clone(),
        }
    }

    /// Axes of the frame in the world, in columns.
    pub fn axes(&self) -> Matrix3<f64> {
        self.axes * self.equations.frame.axes
    }

    /// u (N), model axes.
    pub fn displacements(&self) -> &[f64] {
        &self.u
    }

    /// u (N), model axes, with what the forces of the loads and of inertia do to motions without mass, which
    /// u of the state leaves out (theory 6.13). The rates and accelerations of before are lost.
    pub fn loaded_displacements(&mut self) -> &[f64] {
        let body = self.equations;
        if body.massless.is_empty() {
            return &self.u;
        }
        self.find_forces();
        self.second.copy_from_slice(&self.u);
        body.massless.add_static(&self.first, &mut self.second, &mut self.room);
        &self.second
    }

    /// u' (N), model axes, C u' = 0.
    pub fn displacement_rates(&self) -> &[f64] {
        &self.ud
    }

    /// Place of node `i`, world axes.
    ///
    /// # Panics
    /// When `i` is not below the number of nodes.
    pub fn place(&self, i: usize) -> Vector3<f64> {
        self.origin + self.axes * (self.equations.positions[i] + self.node_vector(&self.u, i))
    }

    /// Velocity of node `i`, world axes.
    ///
    /// # Panics
    /// As [`NodalEvaluation::place`].
    pub fn node_velocity(&self, i: usize) -> Vector3<f64> {
        self.axes * self.node_vector(&self.vbar, i)
    }

    /// The entries of node `i`, zero along an axis that a plane model does not have.
    pub(super) fn node_vector(&self, x: &[f64], i: usize) -> Vector3<f64> {
        let d = self.equations.model.dimension();
        Vector3::from_fn(|k, _| if k < d { x[d * i + k] } else { 0.0 })
    }

    /// The linear momentum P and the angular momentum L about the origin of the frame, world axes.
    pub fn momenta(&self) -> (Vector3<f64>, Vector3<f64>) {
        (self.axes * self.p, self.axes * self.h)
    }

    /// T, which is vbar'M vbar / 2 where no rotation carries mass.
    pub fn kinetic_energy(&self) -> f64 {
        if let Some(turned) = &self.turned {
            return turned.kinetics.energy();
        }
        0.5 * self.vbar.iter().zip(&self.w).map(|(v, w)| v * w).sum::<f64>()
    }

    /// U = u'K u / 2.
    pub fn elastic_energy(&self) -> f64 {
        self.equations.elastic_energy(&self.u)
    }
}
