//! Generalised forces of gravity and of forces at nodes.

use super::kernels::{add_scaled, dot};
use super::{EquationsOfMotion, Evaluation};
use crate::flex_body::FlexBody;
use nalgebra::Vector3;

impl Evaluation<'_> {
    /// Adds the forces of uniform gravity: (m g, s x g, C1(q)'g), the gradient of -g'(m R + A s).
    ///
    /// * `gravity`: A'g, in body axes. Unit: length/time^2.
    /// * `forces`: 6 + nf, of a plane body 3 + nf.
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
}

impl EquationsOfMotion {
    /// Adds a force and a torque about the origin; the modal forces.
    fn add_rigid<'f>(
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

/// Positions and modes of some nodes: where forces act and motion is read.
#[derive(Debug, Clone)]
pub struct NodeShapes {
    positions: Vec<Vector3<f64>>,
    /// Row 3 i + k: component k of node i in every mode (3n x nf, row-major).
    shapes: Vec<f64>,
    nf: usize,
}

impl NodeShapes {
    /// The given nodes of `body`, as indices.
    ///
    /// # Panics
    /// When an index is not below the number of nodes.
    pub fn new(body: &FlexBody, nodes: &[usize]) -> Self {
        let (shape, nf) = (&body.modes().shape, body.n_modes());
        let rows = nodes.iter().flat_map(|&node| [0, 1, 2].map(|k| 3 * node + k));
        Self {
            positions: nodes.iter().map(|&node| Vector3::from(body.nodes().positions[node])).collect(),
            shapes: rows.flat_map(|row| (0..nf).map(move |j| shape[(row, j)])).collect(),
            nf,
        }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Place of node `i` of these in the deformed body, x_i + Psi_i q, body axes.
    ///
    /// # Panics
    /// When `i` is not below [`NodeShapes::len`] or the body is another.
    pub fn place(&self, evaluation: &Evaluation<'_>, i: usize) -> Vector3<f64> {
        self.positions[i] + self.combined(i, &evaluation.q)
    }

    /// Velocity of node `i` of these, V + omega x (x_i + Psi_i q) + Psi_i qd, body axes.
    ///
    /// # Panics
    /// As [`NodeShapes::place`].
    pub fn velocity(&self, evaluation: &Evaluation<'_>, i: usize) -> Vector3<f64> {
        let turned = evaluation.omega.cross(&self.place(evaluation, i));
        evaluation.velocity + turned + self.combined(i, &evaluation.qd)
    }

    /// Adds a force b = A'f at node `i` of these: (b, (x_i + Psi_i q) x b, Psi_i'b).
    ///
    /// * `force`: in body axes.
    /// * `forces`: 6 + nf, of a plane body 3 + nf.
    ///
    /// # Panics
    /// As [`NodeShapes::place`], and when `forces` has another length.
    pub fn add_force(&self, evaluation: &Evaluation<'_>, i: usize, force: &Vector3<f64>, forces: &mut [f64]) {
        let torque = self.place(evaluation, i).cross(force);
        let modal = evaluation.equations().add_rigid(*force, torque, forces);
        for k in 0..3 {
            add_scaled(force[k], self.row(i, k), modal);
        }
    }

    fn row(&self, i: usize, k: usize) -> &[f64] {
        &self.shapes[(3 * i + k) * self.nf..][..self.nf]
    }

    fn combined(&self, i: usize, coordinates: &[f64]) -> Vector3<f64> {
        assert_eq!(coordinates.len(), self.nf, "modes of the same body");
        Vector3::from_fn(|k, _| dot(self.row(i, k), coordinates))
    }
}
