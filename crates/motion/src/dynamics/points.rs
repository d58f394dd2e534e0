//! Points of a body, where forces and torques act and motion is measured.

use super::equations::{Stiffening, stiffness_under};
use super::kernels::{ModalMatrix, add_scaled, dot};
use super::{Evaluation, LoadAxes, LoadJacobian, Orientation, RotationVector, Terms};
use faer::Mat;
use flexbody_body::flex_body::{FlexBody, Interface, NamedLoad};
use flexbody_model::LoadKind;
use nalgebra::{Matrix3, Vector3};

/// Vector that depends linearly on q and, if the body has geometric stiffness for the load that does work
/// on it, also quadratically (theory 7.5).
#[derive(Debug, Clone)]
struct PointMotion {
    nf: usize,
    /// Linear part Psi (3 x nf), row-major.
    rows: Vec<f64>,
    /// Components with a quadratic part, each with its matrix K.
    second: Vec<(usize, ModalMatrix)>,
}

impl PointMotion {
    fn new(nf: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        let rows = (0..3 * nf).map(|at| entry(at / nf, at % nf)).collect();
        Self { nf, rows, second: Vec::new() }
    }

    fn with_geometric_stiffness(mut self, body: &FlexBody, kind: &LoadKind) -> Self {
        if let Some(entry) = stiffness_under(body, kind, Stiffening::All) {
            let matrix = |k: usize| Mat::from_fn(self.nf, self.nf, |i, j| entry(k, i, j));
            let stiffness = |&k: &usize| (k, ModalMatrix::new(matrix(k).as_ref(), 0.0));
            self.second = kind.of_dimension(body.dimension()).iter().map(stiffness).collect();
        }
        self
    }

    fn row(&self, k: usize) -> &[f64] {
        &self.rows[k * self.nf..][..self.nf]
    }

    /// Returns Psi q - q'K q / 2.
    fn at(&self, q: &[f64]) -> Vector3<f64> {
        let mut value = self.product(q);
        self.second.iter().for_each(|(k, matrix)| value[*k] -= 0.5 * matrix.quadratic(q));
        value
    }

    /// Returns Psi qd - q'K qd.
    fn rate(&self, q: &[f64], qd: &[f64]) -> Vector3<f64> {
        let mut value = self.product(qd);
        let bilinear =
            |matrix: &ModalMatrix| (0..self.nf).map(|j| qd[j] * matrix.row_product(j, q)).sum::<f64>();
        self.second.iter().for_each(|(k, matrix)| value[*k] -= bilinear(matrix));
        value
    }

    /// Returns -qd'K qd.
    fn bend(&self, qd: &[f64]) -> Vector3<f64> {
        let mut value = Vector3::zeros();
        self.second.iter().for_each(|(k, matrix)| value[*k] -= matrix.quadratic(qd));
        value
    }

    fn product(&self, x: &[f64]) -> Vector3<f64> {
        assert_eq!(x.len(), self.nf, "modes of the same body");
        Vector3::from_fn(|k, _| dot(self.row(k), x))
    }

    /// Returns column j of Psi - q'K.
    fn column(&self, j: usize, q: &[f64]) -> Vector3<f64> {
        let mut column = Vector3::from_fn(|k, _| self.rows[k * self.nf + j]);
        self.second.iter().for_each(|(k, matrix)| column[*k] -= matrix.row_product(j, q));
        column
    }

    /// Computes modal += (Psi - q'K)' load.
    fn add_work(&self, load: &Vector3<f64>, q: &[f64], modal: &mut [f64]) {
        (0..3).for_each(|k| add_scaled(load[k], self.row(k), modal));
        self.second.iter().for_each(|(k, matrix)| matrix.add_product(-load[*k], q, modal));
    }

    /// Returns -sum_k load_k (K_k)_ij.
    fn second(&self, load: &Vector3<f64>, i: usize, j: usize) -> f64 {
        -self.second.iter().map(|(k, matrix)| load[*k] * matrix.get(i, j)).sum::<f64>()
    }
}

/// Point of a flexible body and its motion in the modes: a node, or the reference point of an interface.
///
/// All vectors are in body axes; the caller turns forces and torques given along other axes. Forces are
/// consistent: the power of the generalised forces is that of the force on the velocity of the point and of
/// the torque on its angular velocity, for any deformation.
#[derive(Debug, Clone)]
pub struct BodyPoint {
    position: Vector3<f64>,
    translation: PointMotion,
    rotation: Option<PointMotion>,
    /// Resultants of a named load, whose amplitude is the component x of its force.
    named: Option<Box<Resultants>>,
}

/// Force, and torque T + L q about the origin of the frame, of a load with the amplitude 1.
#[derive(Debug, Clone)]
struct Resultants {
    force: Vector3<f64>,
    torque: Vector3<f64>,
    /// L (3 x nf).
    turning: PointMotion,
}

impl Resultants {
    fn torque_at(&self, q: &[f64]) -> Vector3<f64> {
        self.torque + self.turning.product(q)
    }
}

impl BodyPoint {
    /// Creates a point at node `node` of `body`, given by its index; users of the library call
    /// `FlexBody::node_point`. The point has an orientation if the node has rotations.
    ///
    /// # Panics
    /// When the index is not below the number of nodes.
    #[doc(hidden)] // Its argument is no part of the interface of the library.
    pub fn node(body: &FlexBody, node: usize) -> Self {
        let (modes, nf) = (body.modes(), body.n_modes());
        let motion = |shape: &Mat<f64>| PointMotion::new(nf, |k, j| shape[(3 * node + k, j)]);
        // Nodes without rotations have zero rows.
        let rotation = modes.rotation.as_ref().map(motion).filter(|rows| rows.rows.iter().any(|v| *v != 0.0));
        Self {
            position: Vector3::from(body.nodes().positions[node]),
            translation: motion(&modes.shape),
            rotation,
            named: None,
        }
    }

    /// Creates a point at the reference point of `interface` of `body`, which follows the mean motion of
    /// its nodes (theory 5.3). The point has an orientation if the nodes determine one. Geometric stiffness
    /// for forces and moments at the interface is included if `terms` contain it. Returns `None` for an
    /// interface without a reference point.
    #[doc(hidden)] // Its arguments are no part of the interface of the library.
    pub fn interface(body: &FlexBody, interface: &Interface, terms: Terms) -> Option<Self> {
        let (modes, nf) = (body.modes(), body.n_modes());
        let rotation = modes.rotation.as_ref().map(|rotation| rotation.as_ref());
        let rows = interface.rows(body.nodes(), modes.shape.as_ref(), rotation, body.dimension())?;
        let motion = |rows: &Mat<f64>, kind: LoadKind| {
            let linear = PointMotion::new(nf, |k, j| rows[(k, j)]);
            if terms.geometric_stiffness { linear.with_geometric_stiffness(body, &kind) } else { linear }
        };
        Some(Self {
            position: Vector3::from(interface.reference?),
            translation: motion(&rows.translation, LoadKind::Force(interface.name.clone())),
            rotation: rows
                .rotation
                .as_ref()
                .map(|rows| motion(rows, LoadKind::Moment(interface.name.clone()))),
            named: None,
        })
    }

    /// Creates the place of `load`, a named load of a body: a force (a, 0, 0) at it is the load with the amplitude a, along
    /// any axes. Its displacement along x is f'u of the forces f and the displacements u of the nodes, with geometric
    /// stiffness for the load -q'K q / 2 more (theory 7.5), if `terms` contain it. It has no orientation.
    #[doc(hidden)] // Its arguments are no part of the interface of the library.
    pub fn named_load(body: &FlexBody, load: &NamedLoad, terms: Terms) -> Self {
        let nf = load.modal.len();
        let torque = load.torque_at(&vec![0.0; nf]);
        let turning = |k: usize, j: usize| if load.preload { 0.0 } else { load.turning[(k, j)] };
        let linear = PointMotion::new(nf, |k, j| if k == 0 { load.modal[j] } else { 0.0 });
        let translation = if terms.geometric_stiffness {
            linear.with_geometric_stiffness(body, &LoadKind::Named(load.name.clone()))
        } else {
            linear
        };
        Self {
            position: Vector3::zeros(),
            translation,
            rotation: None,
            named: Some(Box::new(Resultants {
                force: load.resultant_force(),
                torque,
                turning: PointMotion::new(nf, turning),
            })),
        }
    }

    /// Returns the largest torque about the origin of the frame of a unit force at the undeformed body.
    pub fn lever(&self) -> f64 {
        self.named.as_ref().map_or_else(|| self.position.norm(), |named| named.torque.norm())
    }

    /// Returns rows (3 x nf) whose product with the modal coordinates, times a force, bounds the torque that the force gains
    /// by the deformation.
    pub fn lever_rows(&self) -> Mat<f64> {
        let motion = self.named.as_ref().map_or(&self.translation, |named| &named.turning);
        Mat::from_fn(3, motion.nf, |k, j| motion.row(k)[j])
    }

    /// Returns true if the point has an orientation.
    pub fn turns(&self) -> bool {
        self.rotation.is_some()
    }

    /// Returns the position in the deformed body, r(q) = x + Psi_t q (theory 6.8 and, with geometric
    /// stiffness, 7.5).
    ///
    /// # Panics
    /// When the evaluation belongs to another body; this holds for all methods with an evaluation.
    pub fn place(&self, evaluation: &Evaluation<'_>) -> Vector3<f64> {
        self.position + self.translation.at(&evaluation.q)
    }

    /// Returns the deflection r(q) - r(0) from the undeformed body, body axes.
    pub fn deflection(&self, q: &[f64]) -> Vector3<f64> {
        self.translation.at(q)
    }

    /// Returns the velocity V + omega x r(q) + dr/dt.
    pub fn velocity(&self, evaluation: &Evaluation<'_>) -> Vector3<f64> {
        let turned = evaluation.omega.cross(&self.place(evaluation));
        evaluation.velocity + turned + self.translation.rate(&evaluation.q, &evaluation.qd)
    }

    /// Returns the axes of the point in columns: the rotation by the vector theta(q) = Psi_r q, the
    /// identity without deformation. Returns `None` without an orientation.
    pub fn axes(&self, evaluation: &Evaluation<'_>) -> Option<Matrix3<f64>> {
        self.turn(evaluation).map(|turn| turn.axes())
    }

    /// Returns the angular velocity omega + G(theta)' dtheta/dt of the axes of the point. Returns `None`
    /// without an orientation.
    pub fn angular_velocity(&self, evaluation: &Evaluation<'_>) -> Option<Vector3<f64>> {
        let rate = self.rotation.as_ref()?.rate(&evaluation.q, &evaluation.qd);
        // G gives components in the turned axes, and A G = G'.
        Some(evaluation.omega + self.turn(evaluation)?.map().tr_mul(&rate))
    }

    /// Returns the acceleration of the point for nu' = 0: omega x v + omega x dr/dt + (d2r/dq dq) qd qd.
    /// With the velocity v = J nu the acceleration is J nu' plus this drift. Used for constraints between
    /// bodies.
    pub fn velocity_drift(&self, evaluation: &Evaluation<'_>) -> Vector3<f64> {
        let rate = self.translation.rate(&evaluation.q, &evaluation.qd);
        evaluation.omega.cross(&(self.velocity(evaluation) + rate)) + self.translation.bend(&evaluation.qd)
    }

    /// Returns the acceleration J nu' + drift of the point for the accelerations nu' in the order of
    /// [`EquationsOfMotion`](super::EquationsOfMotion), relative to the world and along body axes (\[RD\]
    /// (10.9)):
    ///
    /// ```text
    /// a = V' + omega' x r + dr/dq qdd + omega x (V + omega x r + 2 dr/dq qd) + (d2r/dq dq) qd qd
    /// ```
    ///
    /// # Panics
    /// When `acceleration` does not have the length of the equations.
    pub fn acceleration(&self, evaluation: &Evaluation<'_>, acceleration: &[f64]) -> Vector3<f64> {
        let (linear, angular, modal) = evaluation.equations().split(acceleration);
        let turned = angular.cross(&self.place(evaluation));
        let bent = self.translation.rate(&evaluation.q, modal);
        linear + turned + bent + self.velocity_drift(evaluation)
    }

    /// Returns the angular acceleration of the point for nu' = 0, d(omega_p)/dt without accelerations.
    /// Returns `None` without an orientation.
    pub fn angular_drift(&self, evaluation: &Evaluation<'_>) -> Option<Vector3<f64>> {
        let rotation = self.rotation.as_ref()?;
        let (turn, rate) = (self.turn(evaluation)?, rotation.rate(&evaluation.q, &evaluation.qd));
        let relative = turn.map().tr_mul(&rate);
        // G(theta)' = G(-theta).
        let bend = turn.map().tr_mul(&rotation.bend(&evaluation.qd)) - RotationVector(-turn.0).drift(&-rate);
        Some(evaluation.omega.cross(&relative) + bend)
    }

    /// Adds the generalised forces of a force b at the point: (b, r x b, (dr/dq)'b).
    ///
    /// * `forces`: 6 + nf entries, for a plane body 3 + nf.
    ///
    /// # Panics
    /// When `forces` has another length.
    pub fn add_force(&self, evaluation: &Evaluation<'_>, force: &Vector3<f64>, forces: &mut [f64]) {
        let (resultant, torque) = match &self.named {
            Some(named) => (named.force * force.x, named.torque_at(&evaluation.q) * force.x),
            None => (*force, self.place(evaluation).cross(force)),
        };
        let modal = evaluation.equations().add_rigid(resultant, torque, forces);
        self.translation.add_work(force, &evaluation.q, modal);
    }

    /// Adds the generalised forces of a torque t at the point: (0, t, (dtheta/dq)'G(theta) t).
    ///
    /// * `forces`: 6 + nf entries, for a plane body 3 + nf.
    ///
    /// # Panics
    /// When `forces` has another length, or the point has no orientation.
    pub fn add_torque(&self, evaluation: &Evaluation<'_>, torque: &Vector3<f64>, forces: &mut [f64]) {
        let (rotation, _) = self.orientation(evaluation);
        let modal = evaluation.equations().add_rigid(Vector3::zeros(), *torque, forces);
        rotation.add_work(&self.turned_torque(evaluation, torque), &evaluation.q, modal);
    }

    /// Returns G(theta) t, the generalised force of a torque t on the rotation vector of the point.
    ///
    /// # Panics
    /// When the point has no orientation.
    pub fn turned_torque(&self, evaluation: &Evaluation<'_>, torque: &Vector3<f64>) -> Vector3<f64> {
        self.orientation(evaluation).1.map() * torque
    }

    /// Adds the derivatives of [`BodyPoint::add_force`]: with r_j = dr/dq_j
    ///
    /// ```text
    /// dtau/dq_j = r_j x b,    dQ_i/dq_j = d2r/dq_i dq_j . b
    /// d/dphi    = (b~, r~ b~, (dr/dq)'b~) of a force in world axes
    /// ```
    ///
    /// # Panics
    /// When a length of `jacobian` is not that of the equations.
    pub fn add_force_jacobian(
        &self,
        evaluation: &Evaluation<'_>,
        force: &Vector3<f64>,
        axes: LoadAxes,
        jacobian: &mut LoadJacobian<'_>,
    ) {
        let (body, q) = (evaluation.equations(), &evaluation.q[..]);
        jacobian.check(body);
        for j in 0..body.nf {
            let torque = match &self.named {
                Some(named) => named.turning.column(j, q) * force.x,
                None => self.translation.column(j, q).cross(force),
            };
            jacobian.add_by_q(body, j, &torque);
        }
        self.add_second(evaluation, &self.translation, force, jacobian);
        if axes == LoadAxes::World && self.named.is_none() {
            let place = self.place(evaluation);
            for (at, &axis) in body.axes.iter().enumerate() {
                let turned = force.cross(&Vector3::ith(axis, 1.0));
                let modal = |j: usize| self.translation.column(j, q).dot(&turned);
                jacobian.add_by_turn(body, at, &turned, &place.cross(&turned), modal);
            }
        }
    }

    /// Adds the derivatives of [`BodyPoint::add_torque`]: with theta_j = dtheta/dq_j
    ///
    /// ```text
    /// dQ_i/dq_j = theta_i . d(G t)/dtheta theta_j + d2theta/dq_i dq_j . G t
    /// d/dphi    = (0, t~, (dtheta/dq)'G t~) of a torque in world axes
    /// ```
    ///
    /// # Panics
    /// When a length of `jacobian` is not that of the equations, or the point has no orientation.
    pub fn add_torque_jacobian(
        &self,
        evaluation: &Evaluation<'_>,
        torque: &Vector3<f64>,
        axes: LoadAxes,
        jacobian: &mut LoadJacobian<'_>,
    ) {
        let (body, q) = (evaluation.equations(), &evaluation.q[..]);
        let (rotation, turn) = self.orientation(evaluation);
        jacobian.check(body);
        let (map, slope) = (turn.map(), turn.map_derivative(torque));
        for i in 0..body.nf {
            let slope_of_mode = slope.tr_mul(&rotation.column(i, q));
            for (j, entry) in jacobian.modal_row(body, i).iter_mut().enumerate() {
                *entry += slope_of_mode.dot(&rotation.column(j, q));
            }
        }
        self.add_second(evaluation, rotation, &(map * torque), jacobian);
        if axes == LoadAxes::World {
            for (at, &axis) in body.axes.iter().enumerate() {
                let turned = torque.cross(&Vector3::ith(axis, 1.0));
                let load = map * turned;
                let modal = |j: usize| rotation.column(j, q).dot(&load);
                jacobian.add_by_turn(body, at, &Vector3::zeros(), &turned, modal);
            }
        }
    }

    fn add_second(
        &self,
        evaluation: &Evaluation<'_>,
        motion: &PointMotion,
        load: &Vector3<f64>,
        jacobian: &mut LoadJacobian<'_>,
    ) {
        let body = evaluation.equations();
        if motion.second.is_empty() {
            return;
        }
        for i in 0..body.nf {
            for (j, entry) in jacobian.modal_row(body, i).iter_mut().enumerate() {
                *entry += motion.second(load, i, j);
            }
        }
    }

    fn turn(&self, evaluation: &Evaluation<'_>) -> Option<RotationVector> {
        Some(RotationVector(self.rotation.as_ref()?.at(&evaluation.q)))
    }

    fn orientation(&self, evaluation: &Evaluation<'_>) -> (&PointMotion, RotationVector) {
        let rotation = self.rotation.as_ref().zip(self.turn(evaluation));
        rotation.expect("a point with an orientation")
    }
}
