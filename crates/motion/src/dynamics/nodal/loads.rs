//! Loads on the nodes.

use super::motions::{add_motion, sums};
use super::points::Weights;
use super::{NodalEvaluation, NodalPoint};
use crate::dynamics::{LoadAxes, Orientation, RotationVector};
use nalgebra::{Vector3, Vector6};

impl NodalEvaluation<'_> {
    /// Adds uniform gravity: the gradient of -g'(m R + A s) with the first moment s(u), which is c +
    /// Phi_t'M u if no rotation carries mass.
    ///
    /// * `gravity`: g, world axes; for a plane body the component along z is ignored. Unit: length/time^2.
    pub fn add_gravity(&mut self, gravity: &Vector3<f64>) {
        let body = self.equations;
        let gravity_model = self.in_body(gravity);
        let mass = &body.rigid_mass;
        // R'M R = [m I, -c~; c~, I0]; for a plane body only the last column of c~ exists.
        let mut moment = Vector3::new(mass[(1, 5)], -mass[(0, 5)], mass[(0, 4)]);
        // Rows whose contribution to s is linear in u.
        let linear = body.directors.as_ref().map_or(body.n_rows(), |directors| directors.points);
        let displaced = sums(&body.mass_rigid, &self.u[..linear]);
        moment += displaced.fixed_rows::<3>(0);
        if let Some(turned) = &self.turned {
            moment += turned.kinetics.first_moment_of_turns();
        }
        self.force += gravity_model * mass[(0, 0)];
        self.torque += moment.cross(&gravity_model);
        let mut translation = Vector6::zeros();
        translation.fixed_rows_mut::<3>(0).copy_from(&gravity_model);
        add_motion(&body.mass_rigid, 1.0, &translation, &mut self.row_forces[..linear]);
        if let Some(turned) = &self.turned {
            turned.kinetics.add_weight_of_turns(&gravity_model, &mut self.row_forces);
        }
    }

    /// Adds a force at node `i`.
    ///
    /// * `force`: world axes; for a plane body the component along z is ignored.
    ///
    /// # Panics
    /// When `i` is not below the number of nodes.
    pub fn add_force(&mut self, i: usize, force: &Vector3<f64>) {
        let d = self.equations.model.dimension();
        let force_model = self.in_body(force);
        let place = self.equations.positions[i] + self.node_vector(&self.u, i);
        self.force += force_model;
        self.torque += place.cross(&force_model);
        self.row_forces[d * i..d * (i + 1)]
            .iter_mut()
            .zip(&force_model)
            .for_each(|(sum, value)| *sum += value);
    }

    /// Adds a torque at node `i`, along the axes turned by the rotation vector theta of the node: G(theta)
    /// t on its rotations (theory 6.8).
    ///
    /// * `torque`: world axes; for a plane body only the component along z is used.
    ///
    /// # Panics
    /// When `i` is not below the number of nodes, or the node has no rotations.
    pub fn add_torque(&mut self, i: usize, torque: &Vector3<f64>) {
        let rows = self.equations.model.rows();
        let rotations = rows.rotations();
        let first = rotations.partition_point(|&(node, _)| (node as usize) < i);
        let of_node = rotations[first..].iter().take_while(|&&(node, _)| node as usize == i);
        let of_node: &[(u32, u8)] = &rotations[first..first + of_node.count()];
        assert!(!of_node.is_empty(), "a node with rotations");
        let at = rows.displacements() + first;
        let mut turn = Vector3::zeros();
        of_node.iter().zip(&self.u[at..]).for_each(|(&(_, axis), u)| turn[usize::from(axis)] = *u);
        let mut torque = self.axes.tr_mul(torque);
        if self.equations.model.dimension() == 2 {
            (torque.x, torque.y) = (0.0, 0.0);
        }
        self.torque += torque;
        let moment = RotationVector(turn).map() * torque;
        for (&(_, axis), sum) in of_node.iter().zip(&mut self.row_forces[at..]) {
            *sum += moment[usize::from(axis)];
        }
    }

    /// Adds forces on all rows (N) that turn with the frame, model axes: forces on displacements, moments
    /// on rotations.
    ///
    /// # Panics
    /// When the number of forces is not N.
    pub fn add_row_forces(&mut self, forces: &[f64]) {
        assert_eq!(forces.len(), self.row_forces.len(), "one force per row");
        let both = self.equations.onto_frame(&self.u, forces);
        self.force += both.fixed_rows::<3>(0);
        self.torque += both.fixed_rows::<3>(3);
        self.row_forces.iter_mut().zip(forces).for_each(|(sum, value)| *sum += value);
    }

    /// Adds a force at a point; its moment refers to the displaced position of the point.
    ///
    /// * `force`: along `axes` of the world or of the frame; for a plane body the component along z is
    ///   ignored.
    pub fn add_force_at(&mut self, point: &NodalPoint, force: &Vector3<f64>, axes: LoadAxes) {
        let mut force_model = self.along_model(force, axes);
        if self.equations.model.dimension() == 2 {
            force_model.z = 0.0;
        }
        let place = point.place() - self.equations.frame.origin + point.displacement(&self.u);
        self.force += force_model;
        self.torque += place.cross(&force_model);
        self.add_weighted(&point.translation, &force_model);
    }

    /// Adds a torque at a point, along the axes turned by the rotation vector theta of the point:
    /// C_r'G(theta) t (theory 6.8).
    ///
    /// * `torque`: along `axes` of the world or of the frame; for a plane body only the component along z
    ///   is used.
    pub fn add_torque_at(&mut self, point: &NodalPoint, torque: &Vector3<f64>, axes: LoadAxes) {
        let mut torque_model = self.along_model(torque, axes);
        if self.equations.model.dimension() == 2 {
            (torque_model.x, torque_model.y) = (0.0, 0.0);
        }
        self.torque += torque_model;
        let moment = RotationVector(point.rotation(&self.u)).map() * torque_model;
        self.add_weighted(&point.rotation, &moment);
    }

    fn along_model(&self, load: &Vector3<f64>, axes: LoadAxes) -> Vector3<f64> {
        match axes {
            LoadAxes::World => self.axes.tr_mul(load),
            LoadAxes::Body => self.equations.frame.axes * load,
        }
    }

    fn add_weighted(&mut self, weights: &Weights, load: &Vector3<f64>) {
        for (row, weights) in weights {
            self.row_forces[*row] += Vector3::from(*weights).dot(load);
        }
    }

    /// Returns a world vector in model axes, for a plane body in its plane.
    fn in_body(&self, world: &Vector3<f64>) -> Vector3<f64> {
        let vector_model = self.axes.tr_mul(world);
        let d = self.equations.model.dimension();
        Vector3::from_fn(|k, _| if k < d { vector_model[k] } else { 0.0 })
    }
}
