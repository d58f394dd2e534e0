//! Change of the frame of a nodal motion to the frame defined by the conditions.

use super::equations::NodalEquations;
use super::{NodalConfiguration, NodalError};
use crate::dynamics::{EulerParameters, Orientation};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// Limit of the corrections of the frame. Each correction reduces the remaining rigid motion by a factor of
/// the size of the deformation.
const MAX_CORRECTIONS: usize = 100;

/// Remaining rigid motion, relative to the size of the body, that counts as rounding.
const RIGID_MOTION_TOLERANCE: f64 = 1e-14;

impl NodalEquations<'_> {
    /// Returns the configuration with equal positions and velocities of all nodes whose displacements
    /// fulfil C u = 0. Use it to convert a state with mean axes, as given by modes, to a state with held
    /// degrees of freedom.
    ///
    /// The frame moves by d and turns by S; u becomes S'(x + u - d) - x. For models of displacements only:
    /// K and M treat nodal rotations and rows without a position as small.
    ///
    /// # Errors
    /// [`NodalError::FrameTied`] if the model has other rows, [`NodalError::ConditionsViolated`] if no
    /// frame was found because the deformation is too large.
    ///
    /// # Panics
    /// When a length is not N.
    pub fn reframed(&self, configuration: &NodalConfiguration) -> Result<NodalConfiguration, NodalError> {
        if !self.model.rows().are_plain() {
            return Err(NodalError::FrameTied);
        }
        let NodalConfiguration { origin, attitude, velocity, omega, u, ud } = configuration;
        assert!(u.len() == self.n_rows() && ud.len() == self.n_rows(), "one entry per row");
        let (mut shift, mut turn) = (Vector3::zeros(), Rotation3::identity());
        let mut moved = vec![0.0; u.len()];
        let mut left = f64::INFINITY;
        for _ in 0..MAX_CORRECTIONS {
            let places = |i: usize, u| turn.inverse() * (self.positions[i] + u - shift) - self.positions[i];
            self.seen(u, places, &mut moved);
            let part = self.rigid_motion(&moved);
            let (by, about) = (part.fixed_rows::<3>(0).into_owned(), part.fixed_rows::<3>(3).into_owned());
            left = by.amax() / self.length + about.amax();
            if left <= RIGID_MOTION_TOLERANCE {
                break;
            }
            shift += turn * by;
            turn *= Rotation3::new(about);
        }
        if left.is_nan() || left > RIGID_MOTION_TOLERANCE {
            return Err(NodalError::ConditionsViolated { part: left });
        }
        let mut rates = vec![0.0; ud.len()];
        self.seen(ud, |_, ud| turn.inverse() * ud, &mut rates);

        // Convert to the axes of the frame.
        let to_frame = |v: Vector3<f64>| self.frame.axes.tr_mul(&v);
        let (shift, turn): (_, Matrix3<f64>) =
            (to_frame(shift), self.frame.axes.transpose() * turn.matrix() * self.frame.axes);
        let axes = attitude.normalised().axes();
        let quaternion =
            |m: &Matrix3<f64>| UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*m));
        let EulerParameters([w, i, j, k]) = attitude.normalised();
        let whole = UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, i, j, k)) * quaternion(&turn);
        Ok(NodalConfiguration {
            origin: origin + axes * shift,
            attitude: EulerParameters([whole.w, whole.i, whole.j, whole.k]),
            velocity: velocity + axes * omega.cross(&shift),
            omega: turn.transpose() * omega,
            u: moved,
            ud: rates,
        })
    }

    /// Applies `rule` to the displacement of each node.
    fn seen(&self, from: &[f64], rule: impl Fn(usize, Vector3<f64>) -> Vector3<f64>, to: &mut [f64]) {
        let d = self.model.dimension();
        for (i, (from, to)) in from.chunks_exact(d).zip(to.chunks_exact_mut(d)).enumerate() {
            let own = Vector3::from_fn(|k, _| if k < d { from[k] } else { 0.0 });
            to.copy_from_slice(&rule(i, own).as_slice()[..d]);
        }
    }
}
