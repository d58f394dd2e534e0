//! Positions, velocities, momenta and energies of the nodal equations at one state.

use super::{NodalConfiguration, NodalEvaluation};
use nalgebra::{Matrix3, Vector3};

impl NodalEvaluation<'_> {
    /// Returns the state in positions and velocities.
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

    /// Returns the axes of the frame in the world, in columns.
    pub fn axes(&self) -> Matrix3<f64> {
        self.axes * self.equations.frame.axes
    }

    /// Returns u (N), model axes.
    pub fn displacements(&self) -> &[f64] {
        &self.u
    }

    /// Returns u (N), model axes, with the response of massless motions to the loads and inertia forces,
    /// which u of the state excludes (theory 6.13). Earlier rates and accelerations are overwritten.
    pub fn loaded_displacements(&mut self) -> &[f64] {
        let body = self.equations;
        if body.massless.is_empty() {
            return &self.u;
        }
        self.find_forces();
        self.second.copy_from_slice(&self.u);
        body.massless.add_static(&self.first, &mut self.second, &mut self.workspace);
        &self.second
    }

    /// Returns u' (N), model axes, with C u' = 0.
    pub fn displacement_rates(&self) -> &[f64] {
        &self.ud
    }

    /// Returns the position of node `i`, world axes.
    ///
    /// # Panics
    /// When `i` is not below the number of nodes.
    pub fn place(&self, i: usize) -> Vector3<f64> {
        self.origin + self.axes * (self.equations.positions[i] + self.node_vector(&self.u, i))
    }

    /// Returns the velocity of node `i`, world axes.
    ///
    /// # Panics
    /// The panics of [`NodalEvaluation::place`].
    pub fn node_velocity(&self, i: usize) -> Vector3<f64> {
        self.axes * self.node_vector(&self.vbar, i)
    }

    /// Returns the entries of node `i`, zero along an axis that a plane model does not have.
    pub(super) fn node_vector(&self, x: &[f64], i: usize) -> Vector3<f64> {
        let d = self.equations.model.dimension();
        Vector3::from_fn(|k, _| if k < d { x[d * i + k] } else { 0.0 })
    }

    /// Returns the linear momentum P and the angular momentum L about the origin of the frame, world axes.
    pub fn momenta(&self) -> (Vector3<f64>, Vector3<f64>) {
        (self.axes * self.p, self.axes * self.h)
    }

    /// Returns T, which is vbar'M vbar / 2 if no rotation carries mass.
    pub fn kinetic_energy(&self) -> f64 {
        if let Some(turned) = &self.turned {
            return turned.kinetics.energy();
        }
        0.5 * self.vbar.iter().zip(&self.w).map(|(v, w)| v * w).sum::<f64>()
    }

    /// Returns U = u'K u / 2.
    pub fn elastic_energy(&self) -> f64 {
        self.equations.elastic_energy(&self.u)
    }
}
