//! Evaluation of the nodal equations at one state.

use super::NodalPoint;
use super::conditions::{NamedForces, Weights, add_motion, halves, joined, sums};
use super::directors::Workspace;
use super::drive::{Drive, LOST};
use super::equations::{Amplitudes, ModalDamping, NodalEquations};
use super::inversion::{Conditions, Given, TurnedMass};
use super::state_layout::{ANGULAR, LINEAR, OFFSET, attitude};
use crate::dynamics::kernels::add_scaled;
use crate::dynamics::{EulerParameters, LoadAxes, Orientation, RotationVector};
use crate::integration::Failure;
use flexbody_linalg::multiply_vector;
use flexbody_model::Damping;
use nalgebra::{Matrix3, Vector3, Vector6};

/// Nodal equations at one state, with all memory for their evaluation: nothing is allocated after
/// [`NodalEvaluation::new`].
///
/// [`NodalEvaluation::set`] sets the state and removes all loads. Loads are added afterwards; rates and
/// accelerations are computed under these loads.
#[derive(Debug, Clone)]
pub struct NodalEvaluation<'e> {
    pub(super) equations: &'e NodalEquations<'e>,
    pub(super) origin: Vector3<f64>,
    /// Attitude as in the state, of unit length except for the integration error.
    pub(super) attitude: EulerParameters,
    /// D, and P / m.
    offset: Vector3<f64>,
    flight: Vector3<f64>,
    /// Rotation from model axes to world axes.
    pub(super) axes: Matrix3<f64>,
    /// V, omega, p, h in model axes.
    pub(super) velocity: Vector3<f64>,
    pub(super) omega: Vector3<f64>,
    pub(super) p: Vector3<f64>,
    pub(super) h: Vector3<f64>,
    pub(super) u: Vec<f64>,
    pub(super) ud: Vec<f64>,
    pub(super) vbar: Vec<f64>,
    pub(super) w: Vec<f64>,
    pub(super) conditions: Conditions,
    /// Mass of turned nodes, if rotations carry mass.
    pub(super) turned: Option<TurnedMass<'e>>,
    /// Loads: force, torque about the origin, and forces on rows; model axes.
    pub(super) force: Vector3<f64>,
    pub(super) torque: Vector3<f64>,
    row_forces: Vec<f64>,
    pub(super) w_rate: Vec<f64>,
    pub(super) multipliers: Vector6<f64>,
    /// Prescribed motion of the frame, if any.
    pub(super) drive: Option<Drive>,
    pub(super) first: Vec<f64>,
    pub(super) second: Vec<f64>,
    pub(super) workspace: Workspace,
    amplitudes: Amplitudes,
}

impl<'e> NodalEvaluation<'e> {
    /// Creates an evaluation of `equations` at rest without deformation.
    pub fn new(equations: &'e NodalEquations<'e>) -> Self {
        let zeros = || vec![0.0; equations.n_rows()];
        let zero = Vector3::zeros();
        Self {
            equations,
            origin: zero,
            attitude: EulerParameters([1.0, 0.0, 0.0, 0.0]),
            offset: zero,
            flight: zero,
            axes: equations.frame.axes.transpose(),
            velocity: zero,
            omega: zero,
            p: zero,
            h: zero,
            u: zeros(),
            ud: zeros(),
            vbar: zeros(),
            w: zeros(),
            conditions: Conditions::new(&equations.conditions_rigid),
            turned: TurnedMass::new(equations),
            force: zero,
            torque: zero,
            row_forces: zeros(),
            w_rate: zeros(),
            multipliers: Vector6::zeros(),
            drive: None,
            first: zeros(),
            second: zeros(),
            workspace: equations.massless.workspace(),
            amplitudes: equations
                .modal_damping
                .as_ref()
                .map_or_else(Amplitudes::default, ModalDamping::workspace),
        }
    }

    /// Returns the equations.
    pub fn equations(&self) -> &'e NodalEquations<'e> {
        self.equations
    }

    /// Sets a state without loads.
    ///
    /// w of the state is defined up to C'mu, with mu from B'w = (p, h): P and L determine the motion of the
    /// body as a whole. Then M(u) vbar = w, C B (V, omega) = C vbar and u' = vbar - B (V, omega), where
    /// M(u) = M unless rotations carry mass.
    ///
    /// # Errors
    /// [`Failure::Rates`] if the body is deformed so far that C B is singular, or nodes are turned so far
    /// that their mass is not positive definite.
    ///
    /// # Panics
    /// When the length of `state` is not [`NodalEquations::dimension`].
    pub fn set(&mut self, state: &[f64]) -> Result<(), Failure> {
        let body = self.equations;
        let momenta = self.go_to(state);
        self.conditions = Conditions::new(&body.conditions_at(&self.u));
        let missing = momenta - body.onto_frame(&self.u, &self.w);
        let mu = self.conditions.plain.solve(&missing).ok_or(LOST)?;
        add_motion(&body.conditions, 1.0, &mu, &mut self.w);

        self.vbar.copy_from_slice(&self.w);
        match &mut self.turned {
            None => body.solve(&mut self.vbar, &mut self.first),
            Some(turned) => {
                turned.turn(&self.u, &self.conditions);
                turned.solve(&mut self.vbar)?;
            }
        }
        let nu = sums(&body.conditions, &self.vbar);
        let nu = self.conditions.transposed.solve(&nu).ok_or(LOST)?;
        self.move_frame(&nu);
        if let Some(turned) = &mut self.turned {
            turned.kinetics.go(&nu, &self.ud, &mut self.first);
        }
        Ok(())
    }

    /// Copies the state without loads and returns (p, h) from its momenta.
    pub(super) fn go_to(&mut self, state: &[f64]) -> Vector6<f64> {
        let body = self.equations;
        let (frame, u, w) = body.parts(state);
        let vector = |at: usize| Vector3::from_column_slice(&frame[at..at + 3]);
        self.offset = vector(OFFSET);
        self.origin = vector(0) + self.offset;
        self.flight = vector(LINEAR) / body.rigid_mass[(0, 0)];
        self.attitude = attitude(frame);
        // The axes follow the reduced equations between the ends of steps, where e is not of unit length.
        self.axes = self.attitude.axes() * body.frame.axes.transpose();
        self.u.copy_from_slice(u);
        self.w.copy_from_slice(w);
        (self.force, self.torque) = (Vector3::zeros(), Vector3::zeros());
        self.row_forces.fill(0.0);
        self.drive = None;
        let (linear, angular) = (vector(LINEAR), vector(ANGULAR) - self.offset.cross(&vector(LINEAR)));
        (self.p, self.h) = (self.axes.tr_mul(&linear), self.axes.tr_mul(&angular));
        joined(&self.p, &self.h)
    }

    /// Sets the frame motion nu = (V, omega); u' is the remainder of vbar.
    pub(super) fn move_frame(&mut self, nu: &Vector6<f64>) {
        let body = self.equations;
        (self.velocity, self.omega) = halves(nu);
        self.ud.copy_from_slice(&self.vbar);
        body.add_frame(-1.0, nu, &self.u, &mut self.ud);
        if !body.massless.is_empty() {
            body.massless.project(body.stiffness(), &mut self.ud, &mut self.workspace);
            self.vbar.copy_from_slice(&self.ud);
            body.add_frame(1.0, nu, &self.u, &mut self.vbar);
        }
    }

    /// Computes y' (see [`NodalEquations::dimension`]) under the loads.
    ///
    /// # Errors
    /// The error [`Failure::Rates`] of [`NodalEvaluation::set`].
    ///
    /// # Panics
    /// When `rates` does not have the length of a state.
    pub fn rates(&mut self, rates: &mut [f64]) -> Result<(), Failure> {
        assert_eq!(rates.len(), self.equations.dimension(), "rates of these equations");
        self.find_rates()?;
        let (flight, offset) = match self.drive {
            None => {
                let relative = self.velocity - self.p / self.equations.rigid_mass[(0, 0)];
                (self.flight, self.axes * relative)
            }
            // The momentum does not determine the motion of a driven frame: G moves with the frame.
            Some(_) => (self.axes * self.velocity, Vector3::zeros()),
        };
        let linear = self.axes * self.force;
        let angular = self.axes * self.torque + self.offset.cross(&linear);
        let turning = self.attitude.rate(&self.equations.frame.axes.tr_mul(&self.omega));
        let frame = flight.iter().chain(&offset).chain(&turning).chain(&linear).chain(&angular);
        let nodes = self.ud.iter().chain(&self.w_rate);
        rates.iter_mut().zip(frame.chain(nodes)).for_each(|(rate, value)| *rate = *value);
        Ok(())
    }

    /// Computes w' and lambda.
    ///
    /// With g = f - omega x w - K u - D u' and the projection T of massless motions, w' = T'g + C'lambda,
    /// where B'w' is known from the momenta.
    ///
    /// If motion of the frame is prescribed, w is defined up to C'mu: lambda then makes R'w' = 0.
    fn find_rates(&mut self) -> Result<(), Failure> {
        let body = self.equations;
        let wanted = self.find_forces();
        if self.drive.is_some() {
            body.take_conditions(&mut self.w_rate);
            return Ok(());
        }
        let missing = wanted - body.onto_frame(&self.u, &self.w_rate);
        self.multipliers = self.conditions.plain.solve(&missing).ok_or(LOST)?;
        add_motion(&body.conditions, 1.0, &self.multipliers, &mut self.w_rate);
        Ok(())
    }

    /// Computes w' without C'lambda; returns B'w' of a body without prescribed motion.
    pub(super) fn find_forces(&mut self) -> Vector6<f64> {
        self.first.copy_from_slice(&self.row_forces);
        match &self.turned {
            None => self.equations.add_turned(-1.0, &self.omega, &self.w, &mut self.first),
            Some(turned) => turned.kinetics.add_slope(&self.ud, &mut self.first),
        }
        self.take_internal_forces();
        self.wanted()
    }

    /// Computes `w_rate` = T'(f - D u') - K u for the forces f in `first`.
    fn take_internal_forces(&mut self) {
        let body = self.equations;
        self.second.copy_from_slice(&self.u);
        match body.damping {
            None => {}
            Some(Damping::Rayleigh { alpha, beta }) => {
                body.weigh(&self.ud, &mut self.w_rate);
                add_scaled(-alpha, &self.w_rate, &mut self.first);
                add_scaled(*beta, &self.ud, &mut self.second);
            }
            Some(Damping::Matrix(damping)) => {
                multiply_vector(damping, 1, &self.ud, &mut self.w_rate);
                add_scaled(-1.0, &self.w_rate, &mut self.first);
            }
            // Damping by modal ratios follows below.
            Some(Damping::Ratio(_) | Damping::Bands(_)) => {}
        }
        if let Some(damping) = &body.modal_damping {
            damping.add(-1.0, &self.ud, &mut self.first, &mut self.amplitudes);
        }
        // K T = T'K: adding the static response of the massless rows to u transfers their forces to the
        // other rows with one product with K.
        body.massless.add_static(&self.first, &mut self.second, &mut self.workspace);
        multiply_vector(body.stiffness(), 1, &self.second, &mut self.w_rate);
        self.w_rate.iter_mut().zip(&self.first).for_each(|(rate, force)| *rate = force - *rate);
    }

    /// Computes V' and omega' in the axes of the frame, and u'' (N), under the loads. V' is the rate of the
    /// components in these axes.
    ///
    /// # Errors
    /// The error [`Failure::Rates`] of [`NodalEvaluation::set`].
    ///
    /// # Panics
    /// When the length of `udd` is not N.
    pub fn accelerations(&mut self, udd: &mut [f64]) -> Result<(Vector3<f64>, Vector3<f64>), Failure> {
        assert_eq!(udd.len(), self.u.len(), "one entry per row");
        if self.turned.is_some() {
            return self.turned_accelerations(&Given::nothing(), udd);
        }
        self.find_rates()?;
        let body = self.equations;
        udd.copy_from_slice(&self.w_rate);
        body.solve(udd, &mut self.first);
        body.add_turned(-1.0, &self.omega, &self.ud, udd);
        let nu = sums(&body.conditions, udd);
        let nu = self.conditions.transposed.solve(&nu).ok_or(LOST)?;
        let (linear, angular) = halves(&nu);
        body.add_frame(-1.0, &nu, &self.u, udd);
        body.massless.project(body.stiffness(), udd, &mut self.workspace);
        let to_frame = body.frame.axes.transpose();
        Ok((to_frame * linear, to_frame * angular))
    }

    /// Returns force and torque about the origin of the constraint forces C'lambda, which hold C u = 0,
    /// from the last rates or accelerations, axes of the frame. If rotations carry mass, lambda is that of
    /// the last accelerations, since in rates it is only defined up to the part that leaves (p, h) = B'w.
    /// For a solid the force is zero and the torque is sum_i u_i x (K u)_i, the moment of linear elastic
    /// forces about the deformed body.
    pub fn reaction(&self) -> (Vector3<f64>, Vector3<f64>) {
        let (force, torque) = halves(&(self.equations.conditions_at(&self.u) * self.multipliers));
        let to_frame = self.equations.frame.axes.transpose();
        (to_frame * force, to_frame * torque)
    }

    /// Computes the forces that cause the accelerations V', omega' (axes of the frame) and u'' (N): returns
    /// F and tau in the axes of the frame, and writes f (N) in model axes, with lambda = 0 and no forces on
    /// massless motions.
    ///
    /// # Panics
    /// When a length is not N.
    pub fn balance(
        &mut self,
        linear: &Vector3<f64>,
        angular: &Vector3<f64>,
        udd: &[f64],
        forces: &mut [f64],
    ) -> (Vector3<f64>, Vector3<f64>) {
        let body = self.equations;
        assert!(udd.len() == self.u.len() && forces.len() == self.u.len(), "one entry per row");
        let nu = body.in_model(linear, angular);
        if self.turned.is_some() {
            return self.turned_balance(&nu, udd, forces);
        }
        let change = &mut self.first;
        change.copy_from_slice(udd);
        body.add_frame(1.0, &nu, &self.u, change);
        body.add_turned(1.0, &self.omega, &self.ud, change);
        body.weigh(change, forces);
        let (force, torque) = halves(&body.onto_frame(&self.u, forces));
        let force = force + self.omega.cross(&self.p);
        let torque = torque
            + body.moment(&self.ud, &self.w)
            + self.omega.cross(&self.h)
            + self.velocity.cross(&self.p);
        body.add_turned(1.0, &self.omega, &self.w, forces);
        self.take_inertia_forces(forces);
        let to_frame = body.frame.axes.transpose();
        (to_frame * force, to_frame * torque)
    }

    /// Adds the elastic and damping forces to the inertia `forces`.
    pub(super) fn take_inertia_forces(&mut self, forces: &mut [f64]) {
        self.first.copy_from_slice(forces);
        self.first.iter_mut().for_each(|force| *force = -*force);
        self.take_internal_forces();
        forces.iter_mut().zip(&self.w_rate).for_each(|(force, rate)| *force = -rate);
    }
}

// Loads on the nodes.

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
        if let Some(kind) = point.named {
            return self.add_named(&point.translation, kind, force.x);
        }
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

    /// Adds the nodal forces of a named load.
    fn add_named(&mut self, forces: &Weights, kind: NamedForces, amplitude: f64) {
        if kind == NamedForces::Applied {
            let mut rows = std::mem::take(&mut self.first);
            rows.fill(0.0);
            forces.iter().for_each(|(row, weights)| rows[*row] = amplitude * weights[0]);
            let (force, torque) = halves(&self.equations.onto_frame(&self.u, &rows));
            self.force += force;
            self.torque += torque;
            self.first = rows;
        }
        self.add_weighted(forces, &Vector3::new(amplitude, 0.0, 0.0));
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
