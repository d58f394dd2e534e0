//! States of the nodal equations.

use super::NodalError;
use super::equations::NodalEquations;
use super::inversion::{Conditions, TurnedMass};
use crate::dynamics::{EulerParameters, Orientation};
use flexbody_linalg::quadratic_form;
use nalgebra::Vector3;

/// Rigid motion in displacements, relative to the largest displacement, that counts as rounding.
const ROUNDING: f64 = 1e-8;

/// Rigid motion in displacements, relative to the extent of the body, that counts as rounding of positions.
const ROUNDING_OF_POSITIONS: f64 = 1e-12;

/// First index of each part but the first in a state y = (G, D, e, P, L, u, w).
pub(super) const OFFSET: usize = 3;
pub(super) const ATTITUDE: usize = 6;
pub(super) const LINEAR: usize = 10;
pub(super) const ANGULAR: usize = 13;
pub(super) const DISPLACEMENTS: usize = 16;

/// State in velocities: a [`Configuration`](crate::dynamics::Configuration) with nodal displacements.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalConfiguration {
    /// Origin of the body frame, world axes.
    pub origin: Vector3<f64>,
    /// Attitude of the frame, of unit length.
    pub attitude: EulerParameters,
    /// Velocity of the origin, world axes.
    pub velocity: Vector3<f64>,
    /// Angular velocity of the frame, in its axes.
    pub omega: Vector3<f64>,
    /// Displacements relative to the frame (N), in the rows and axes of the model.
    pub u: Vec<f64>,
    /// Rates of the displacements (N).
    pub ud: Vec<f64>,
}

impl NodalEquations<'_> {
    /// Returns the number of entries of a state y = (G, D, e, P, L, u, w): 16 + 2 N. The frame has its
    /// origin at R = G + D and the Euler parameters e. P is the linear momentum, L the angular momentum
    /// about G, which starts at R and moves with P / m; all in world axes. P and L of a free body are
    /// constant entries, which every method conserves to rounding.
    pub fn dimension(&self) -> usize {
        DISPLACEMENTS + 2 * self.n_rows()
    }

    /// Returns the state y of a configuration.
    ///
    /// Massless motions are set to static equilibrium. Rigid motion in u' is attributed to the frame: the
    /// velocities in a state fulfil C u' = 0.
    ///
    /// # Errors
    /// [`NodalError::ConditionsViolated`] if C u is not zero to rounding.
    ///
    /// # Panics
    /// When a length is not N.
    pub fn state(&self, configuration: &NodalConfiguration) -> Result<Vec<f64>, NodalError> {
        let NodalConfiguration { origin, attitude, velocity, omega, u, ud } = configuration;
        let n = self.n_rows();
        assert!(u.len() == n && ud.len() == n, "one entry per row");
        let (mut u, mut vbar) = (u.clone(), ud.clone());
        let mut workspace = self.massless.workspace();
        self.massless.project(self.stiffness(), &mut u, &mut workspace);
        self.massless.project(self.stiffness(), &mut vbar, &mut workspace);
        let taken = self.take_rigid(&mut u);
        let largest = u.iter().fold(0.0f64, |m, u| m.max(u.abs()));
        let moved = taken.fixed_rows::<3>(0).amax().max(taken.fixed_rows::<3>(3).amax() * self.length);
        let allowed = (ROUNDING * largest).max(ROUNDING_OF_POSITIONS * self.length);
        // The maxima ignore NaN, so that it must be checked separately.
        if taken.iter().any(|part| part.is_nan()) || moved > allowed {
            return Err(NodalError::ConditionsViolated { part: moved / largest });
        }
        let attitude = attitude.normalised();
        let nu = self.in_model(&attitude.axes().tr_mul(velocity), omega);
        self.add_frame(1.0, &nu, &u, &mut vbar);
        let mut w = vec![0.0; n];
        let momenta = match TurnedMass::new(self) {
            Some(mut turned) => {
                turned.turn(&u, &Conditions::new(&self.conditions_at(&u)));
                turned.momenta(&vbar, &mut w).map_err(|_| NodalError::ConditionsDependent)?
            }
            None => {
                self.weigh(&vbar, &mut w);
                self.onto_frame(&u, &w)
            }
        };

        let to_world = attitude.axes() * self.frame.axes.transpose();
        let linear = to_world * momenta.fixed_rows::<3>(0);
        let angular = to_world * momenta.fixed_rows::<3>(3);
        let mut state = Vec::with_capacity(self.dimension());
        state.extend(origin.iter().chain(&[0.0; 3]).chain(&attitude.0).chain(&linear).chain(&angular));
        state.extend(u);
        state.extend(w);
        Ok(state)
    }

    /// Returns the parts of a state: frame, u and w.
    pub(super) fn parts<'s>(&self, state: &'s [f64]) -> (&'s [f64], &'s [f64], &'s [f64]) {
        assert_eq!(state.len(), self.dimension(), "a state of these equations");
        let (frame, nodes) = state.split_at(DISPLACEMENTS);
        let (u, w) = nodes.split_at(self.n_rows());
        (frame, u, w)
    }

    /// Returns u'K u / 2 for displacements u (N), model axes.
    ///
    /// # Panics
    /// When the length of `u` is not N.
    pub fn elastic_energy(&self, u: &[f64]) -> f64 {
        0.5 * quadratic_form(self.stiffness(), u)
    }
}

/// Returns the Euler parameters of a state.
pub(super) fn attitude(frame: &[f64]) -> EulerParameters {
    EulerParameters([frame[ATTITUDE], frame[ATTITUDE + 1], frame[ATTITUDE + 2], frame[ATTITUDE + 3]])
}
