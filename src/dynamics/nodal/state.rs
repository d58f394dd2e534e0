//! States of the nodal equations.

use super::equations::NodalEquations;
use super::{NodalError, NodalEvaluation};
use crate::dynamics::{EulerParameters, Orientation};
use nalgebra::{Vector3, Vector6};

/// Largest rigid motion in displacements that is rounding, relative to the largest of them.
const ROUNDING: f64 = 1e-8;

/// Where in a state y = (R, Euler parameters, P, L, u, w) each part begins.
pub(super) const LINEAR: usize = 7;
pub(super) const ANGULAR: usize = 10;
pub(super) const DISPLACEMENTS: usize = 13;

/// Position and velocity of a body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameMotion {
    /// R, world axes. Unit: length.
    pub origin: Vector3<f64>,
    /// Rotation from the axes of the frame to those of the world.
    pub orientation: EulerParameters,
    /// V, velocity of the origin in the axes of the frame. Unit: length/time.
    pub velocity: Vector3<f64>,
    /// Angular velocity in the axes of the frame. Unit: 1/time.
    pub omega: Vector3<f64>,
}

impl Default for FrameMotion {
    /// At rest at the origin of the world, along its axes.
    fn default() -> Self {
        let zero = Vector3::zeros();
        let orientation = EulerParameters([1.0, 0.0, 0.0, 0.0]);
        Self { origin: zero, orientation, velocity: zero, omega: zero }
    }
}

impl NodalEquations<'_> {
    /// Number of entries of a state y = (R, Euler parameters, P, L, u, w): 13 + 2 N. P and L are the linear momentum and the angular
    /// momentum about the origin of the frame, in world axes; what is linear in y any Runge-Kutta method keeps, so that P and L + R x P
    /// of a free body stay what they are.
    pub fn dimension(&self) -> usize {
        DISPLACEMENTS + 2 * self.n_rows()
    }

    /// The state with given motion of the frame, displacements `u` and their rates `ud` (N each).
    ///
    /// What carries no mass is set to where the rest takes it. Rigid motion in `ud` is taken as that of the body: the motion of the
    /// frame that a state has is the one that leaves C u' = 0.
    ///
    /// # Errors
    /// [`NodalError::ConditionsViolated`] when C u is not zero to rounding.
    ///
    /// # Panics
    /// When a length is not N.
    pub fn state(&self, motion: &FrameMotion, u: &[f64], ud: &[f64]) -> Result<Vec<f64>, NodalError> {
        let n = self.n_rows();
        assert!(u.len() == n && ud.len() == n, "one entry per row");
        let [mut own, mut velocity] = [u.to_vec(), ud.to_vec()];
        if !self.massless.is_empty() {
            let mut room = self.massless.room();
            self.massless.project(self.stiffness(), &mut own, &mut room);
            self.massless.project(self.stiffness(), &mut velocity, &mut room);
        }
        let taken = self.take_rigid(&mut own);
        let largest = own.iter().fold(0.0f64, |m, u| m.max(u.abs()));
        let moved = taken.fixed_rows::<3>(0).amax().max(taken.fixed_rows::<3>(3).amax() * self.length);
        if moved > ROUNDING * largest {
            return Err(NodalError::ConditionsViolated { part: moved / largest });
        }
        let nu = self.in_model(&motion.velocity, &motion.omega);
        Self::add_motion(&self.rigid, 1.0, &nu, &mut velocity);
        self.add_turned(1.0, &nu.fixed_rows::<3>(3).into_owned(), &own, &mut velocity);
        let mut w = vec![0.0; n];
        self.weigh(&velocity, &mut w);

        let orientation = normalised(&motion.orientation);
        let to_world = orientation.axes() * self.frame_axes.transpose();
        let momenta = Self::sums(&self.rigid, &w);
        let linear = to_world * momenta.fixed_rows::<3>(0);
        let angular = to_world * (momenta.fixed_rows::<3>(3) + self.moment(&own, &w));
        let mut state = Vec::with_capacity(self.dimension());
        state.extend(motion.origin.iter().chain(&orientation.0).chain(&linear).chain(&angular));
        state.extend(own);
        state.extend(w);
        Ok(state)
    }

    /// Parts of a state: the first 13 numbers, u and w.
    pub(super) fn parts<'s>(&self, state: &'s [f64]) -> (&'s [f64], &'s [f64], &'s [f64]) {
        assert_eq!(state.len(), self.dimension(), "a state of these equations");
        let (frame, nodes) = state.split_at(DISPLACEMENTS);
        let (u, w) = nodes.split_at(self.n_rows());
        (frame, u, w)
    }
}

/// Euler parameters of unit length: a state has them but for the error of its integration.
pub(super) fn normalised(EulerParameters(p): &EulerParameters) -> EulerParameters {
    let length = p.iter().map(|p| p * p).sum::<f64>().sqrt();
    EulerParameters(p.map(|p| p / length))
}

impl NodalEvaluation<'_> {
    /// Position and velocity of the frame.
    pub fn frame_motion(&self) -> FrameMotion {
        let to_frame = self.equations.frame_axes.transpose();
        FrameMotion {
            origin: self.origin,
            orientation: normalised(&self.orientation),
            velocity: to_frame * self.velocity,
            omega: to_frame * self.omega,
        }
    }

    /// u (N), model axes.
    pub fn displacements(&self) -> &[f64] {
        &self.u
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
        self.origin + self.axes * (self.equations.positions[i] + self.of_node(&self.u, i))
    }

    /// Velocity of node `i`, world axes.
    ///
    /// # Panics
    /// As [`NodalEvaluation::place`].
    pub fn node_velocity(&self, i: usize) -> Vector3<f64> {
        self.axes * self.of_node(&self.vbar, i)
    }

    pub(super) fn of_node(&self, x: &[f64], i: usize) -> Vector3<f64> {
        let d = self.equations.model.dimension();
        Vector3::from_fn(|k, _| if k < d { x[d * i + k] } else { 0.0 })
    }

    /// The linear momentum P and the angular momentum L about the origin of the frame, world axes.
    pub fn momenta(&self) -> (Vector3<f64>, Vector3<f64>) {
        (self.axes * self.p, self.axes * self.h)
    }

    /// T = vbar'M vbar / 2.
    pub fn kinetic_energy(&self) -> f64 {
        0.5 * self.vbar.iter().zip(&self.w).map(|(v, w)| v * w).sum::<f64>()
    }

    /// U = u'K u / 2.
    pub fn elastic_energy(&self) -> f64 {
        self.equations.elastic_energy(&self.u)
    }

    /// V and omega in model axes.
    pub(super) fn nu(&self) -> Vector6<f64> {
        Vector6::from_iterator(self.velocity.iter().chain(&self.omega).copied())
    }
}

impl NodalEquations<'_> {
    /// u'K u / 2.
    pub(super) fn elastic_energy(&self, u: &[f64]) -> f64 {
        let row = |(i, ui): (usize, &f64)| {
            let (columns, values) = self.stiffness().row(i);
            ui * columns.iter().zip(values).map(|(&j, k)| k * u[j as usize]).sum::<f64>()
        };
        0.5 * u.iter().enumerate().map(row).sum::<f64>()
    }
}
