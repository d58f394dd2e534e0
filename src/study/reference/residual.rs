//! The forces that the equations of all nodes leave unbalanced in the motion of a body.

use crate::body::flex_body::FlexBody;
use crate::model::FeModel;
use crate::motion::dynamics::add_turned;
use crate::motion::scene::Instant;
use crate::numerics::linalg::{combine, gram, subtract_combination};
use faer::Mat;
use nalgebra::{Matrix3, Vector3};

/// Instants that are computed together.
const BLOCK: usize = 32;

/// A body in its frame, seen from the rows of its model.
pub(super) struct NodalView<'m> {
    pub model: &'m FeModel,
    /// Psi (N x nf) and M Psi, rows and axes of the model.
    pub vectors: Mat<f64>,
    weighted: Mat<f64>,
    /// Rigid motions about the origin of the frame (N x 6, in the plane N x 3), axes of the model.
    pub rigid: Mat<f64>,
    /// Axes of the frame in the model.
    pub axes: Matrix3<f64>,
    /// Nodal forces of unit forces and torques where each load of the scene acts (N x 6, in the plane N x 3).
    pub loads: Vec<Mat<f64>>,
}

impl<'m> NodalView<'m> {
    /// `body`, which was made of `model`; `None` when it has other rows.
    pub fn new(model: &'m FeModel, body: &FlexBody, loads: Vec<Mat<f64>>) -> Option<Self> {
        let vectors = body.vectors_of(model)?;
        let weighted = model.pencil().apply_mass(vectors.as_ref());
        let rigid = model.rigid_fields(body.frame().origin.into(), 1.0);
        Some(Self { model, vectors, weighted, rigid, axes: body.frame().axes, loads })
    }

    /// r = f - K u - omega x w - M (R (V', omega') + omega' x u + omega x u' + u'') with
    /// w = M (R (V, omega) + omega x u + u') and u = Psi q (theory 6.9 to 6.13), a column for every
    /// instant, without what it does to the modes: that is zero, but for damping and geometric stiffness,
    /// which nodes do not have.
    pub fn residual(&self, motion: &[Instant]) -> Mat<f64> {
        let mut residual = Mat::zeros(self.vectors.nrows(), motion.len());
        for first in (0..motion.len()).step_by(BLOCK) {
            let block = &motion[first..motion.len().min(first + BLOCK)];
            residual.as_mut().subcols_mut(first, block.len()).copy_from(self.block(block));
        }
        residual
    }

    fn block(&self, motion: &[Instant]) -> Mat<f64> {
        let u = self.displacements(motion, |now| &now.q);
        let ud = self.displacements(motion, |now| &now.qd);
        let udd = self.displacements(motion, |now| &now.qdd);
        let omega = |now: &Instant| self.axes * now.omega;
        let mut velocity = self.rigid_part(motion, |now| (now.velocity, now.omega)) + &ud;
        self.add_turned(motion, omega, &u, &mut velocity);
        let momentum = self.model.pencil().apply_mass(velocity.as_ref());

        // Gravity is an acceleration that is not there.
        let free = |now: &Instant| (now.velocity_rate - now.gravity, now.omega_rate);
        let mut acceleration = self.rigid_part(motion, free) + udd;
        self.add_turned(motion, |now| self.axes * now.omega_rate, &u, &mut acceleration);
        self.add_turned(motion, omega, &ud, &mut acceleration);
        let mut residual = self.model.pencil().apply_mass(acceleration.as_ref());
        self.add_turned(motion, omega, &momentum, &mut residual);
        residual += self.model.pencil().apply_stiffness(u.as_ref());
        let mut residual = self.loads_of(motion) - residual;
        let in_modes = gram(self.vectors.as_ref(), residual.as_ref());
        subtract_combination(residual.as_mut(), self.weighted.as_ref(), in_modes.as_ref());
        residual
    }

    fn displacements<'i>(&self, motion: &'i [Instant], of: impl Fn(&'i Instant) -> &'i Vec<f64>) -> Mat<f64> {
        let q = Mat::from_fn(self.vectors.ncols(), motion.len(), |j, i| of(&motion[i])[j]);
        combine(self.vectors.as_ref(), q.as_ref())
    }

    /// R (linear, angular), given along the axes of the frame.
    fn rigid_part(
        &self,
        motion: &[Instant],
        of: impl Fn(&Instant) -> (Vector3<f64>, Vector3<f64>),
    ) -> Mat<f64> {
        let amplitudes = self.along_model(motion, of);
        combine(self.rigid.as_ref(), amplitudes.as_ref())
    }

    /// A linear and an angular vector in the coordinates of the model, a column for every instant.
    fn along_model(
        &self,
        motion: &[Instant],
        of: impl Fn(&Instant) -> (Vector3<f64>, Vector3<f64>),
    ) -> Mat<f64> {
        let plane = self.model.dimension() == 2;
        let mut both = Mat::zeros(self.rigid.ncols(), motion.len());
        for (i, now) in motion.iter().enumerate() {
            let (linear, angular) = of(now);
            let (linear, angular) = (self.axes * linear, self.axes * angular);
            let entries = match plane {
                true => vec![linear.x, linear.y, angular.z],
                false => linear.iter().chain(&angular).copied().collect(),
            };
            entries.iter().enumerate().for_each(|(k, value)| both[(k, i)] = *value);
        }
        both
    }

    /// y += omega x x at displacements.
    fn add_turned(
        &self,
        motion: &[Instant],
        omega: impl Fn(&Instant) -> Vector3<f64>,
        x: &Mat<f64>,
        y: &mut Mat<f64>,
    ) {
        for (i, now) in motion.iter().enumerate() {
            add_turned(self.model, 1.0, &omega(now), x.col_as_slice(i), y.col_as_slice_mut(i));
        }
    }

    /// Nodal forces of the loads of the scene.
    fn loads_of(&self, motion: &[Instant]) -> Mat<f64> {
        let mut forces = Mat::zeros(self.vectors.nrows(), motion.len());
        for (at, columns) in self.loads.iter().enumerate() {
            let amplitudes = self.along_model(motion, |now| now.loads[at]);
            let known = amplitudes.as_ref().subrows(0, columns.ncols());
            forces += combine(columns.as_ref(), known.to_owned().as_ref());
        }
        forces
    }
}
