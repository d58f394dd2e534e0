//! Kinetic energy of turned nodes at one state: momenta, their rates, and the forces on displacements.

use super::conditions::{add_motion, halves, joined};
use super::directors::{Directors, Rest};
use super::equations::NodalEquations;
use crate::dynamics::{Orientation, RotationVector};
use flexbody_linalg::multiply_vector;
use nalgebra::{Matrix3, Vector3, Vector6};

/// Velocities of points, directors and rows, or their rates, and the products of the mass with them.
#[derive(Debug, Clone)]
struct Flow {
    /// Yd and E Yd.
    velocities: Vec<f64>,
    momenta: Vec<f64>,
    /// y and M_R y, on extended rows.
    rest_velocities: Vec<f64>,
    rest_momenta: Vec<f64>,
    /// sum_a d_a x (E Yd)_a of every node.
    moments: Vec<Vector3<f64>>,
}

impl Flow {
    fn new(directors: &Directors<'_>) -> Self {
        let zeros = || vec![0.0; directors.mass.turning_rows()];
        let rest = || vec![0.0; if directors.rest.is_some() { directors.mass.rows() } else { 0 }];
        Self {
            velocities: zeros(),
            momenta: zeros(),
            rest_velocities: rest(),
            rest_momenta: rest(),
            moments: vec![Vector3::zeros(); directors.rotations.len()],
        }
    }
}

/// Nodes turned by the displacements u.
#[derive(Debug, Clone)]
struct TurnedNodes<'e> {
    body: &'e NodalEquations<'e>,
    directors: &'e Directors<'e>,
    nodes: Vec<TurnedNode>,
    u: Vec<f64>,
    /// s_R(u).
    rest_first_moment: Vector3<f64>,
}

impl TurnedNodes<'_> {
    fn turn(&mut self, u: &[f64]) {
        self.u.copy_from_slice(u);
        for (place, node) in self.nodes.iter_mut().enumerate() {
            *node = TurnedNode::new(self.directors.turn_of(place, u));
        }
        if let Some(rest) = &self.directors.rest {
            self.rest_first_moment = rest.first_moment + self.rest_shift(rest, u);
        }
    }

    /// Returns C1_R u.
    fn rest_shift(&self, rest: &Rest, u: &[f64]) -> Vector3<f64> {
        let of_points = u.iter().zip(&rest.translated[..self.directors.points]);
        let mut sum: Vector3<f64> = of_points.map(|(u, row)| row * *u).sum();
        for place in 0..self.nodes.len() {
            let (first, axes) = self.directors.rest_rotations(place);
            let turn = self.directors.turn_of(place, u);
            let start = axes.start;
            sum += axes.map(|axis| rest.translated[first + axis - start] * turn[axis]).sum::<Vector3<f64>>();
        }
        sum
    }

    /// Returns first row and vector of every director of the node at `place`.
    fn directors_of(&self, place: usize) -> impl Iterator<Item = (usize, Vector3<f64>)> + '_ {
        let node = &self.nodes[place];
        (0..self.directors.dimension).map(move |a| (self.directors.director(place, a), node.director(a)))
    }

    /// Returns the vector of the point or director that begins at `row`.
    fn vector(&self, x: &[f64], row: usize) -> Vector3<f64> {
        let d = self.directors.dimension;
        Vector3::from_fn(|k, _| if k < d { x[row + k] } else { 0.0 })
    }

    fn put(&self, x: &mut [f64], row: usize, vector: &Vector3<f64>) {
        x[row..row + self.directors.dimension].iter_mut().zip(vector).for_each(|(x, value)| *x = *value);
    }

    /// Computes Yd and y of the motion nu = (V, omega) and u'.
    fn velocities(&self, nu: &Vector6<f64>, ud: &[f64], flow: &mut Flow) {
        let points = self.directors.points;
        let (linear, omega) = halves(nu);
        // Velocities of the points.
        let of_points = &mut flow.velocities[..points];
        of_points.copy_from_slice(&ud[..points]);
        self.body.add_frame(1.0, nu, &self.u, of_points);
        for place in 0..self.nodes.len() {
            // Directors turn with the angular velocity of their node.
            let spin = omega + self.nodes[place].spin(&self.directors.turn_of(place, ud));
            for (row, director) in self.directors_of(place) {
                self.put(&mut flow.velocities, row, &spin.cross(&director));
            }
        }
        // Rest mass: velocities relative to the translation of its centre.
        let Some(rest) = &self.directors.rest else { return };
        let (of_points, of_rows) = (&flow.velocities[..points], &mut flow.rest_velocities);
        of_rows[..points].copy_from_slice(of_points);
        let flight = joined(&(linear + omega.cross(&rest.centre)), &Vector3::zeros());
        add_motion(&self.body.rigid[..points], -1.0, &flight, &mut of_rows[..points]);
        for place in 0..self.nodes.len() {
            let (first, axes) = self.directors.rest_rotations(place);
            let turning = omega + self.directors.turn_of(place, ud);
            let start = axes.start;
            axes.for_each(|axis| of_rows[first + axis - start] = turning[axis]);
        }
    }

    /// Computes the rates of Yd and y at constant (V, omega) and u', while u changes with u'.
    fn velocity_drifts(&self, omega: &Vector3<f64>, ud: &[f64], flow: &mut Flow) {
        let points = self.directors.points;
        let of_points = &mut flow.velocities[..points];
        of_points.fill(0.0);
        self.body.add_turned(1.0, omega, ud, of_points);
        for (place, node) in self.nodes.iter().enumerate() {
            let rate = self.directors.turn_of(place, ud);
            let spin = node.spin(&rate);
            let drift = node.spin_derivative(&rate) * rate;
            for (row, director) in self.directors_of(place) {
                let value = drift.cross(&director) + (omega + spin).cross(&spin.cross(&director));
                self.put(&mut flow.velocities, row, &value);
            }
        }
        if self.directors.rest.is_some() {
            flow.rest_velocities.fill(0.0);
            flow.rest_velocities[..points].copy_from_slice(&flow.velocities[..points]);
        }
    }

    /// Computes E Yd, M_R y and the moments of the directors.
    fn multiply(&self, flow: &mut Flow) {
        self.directors.weigh(&flow.velocities, &mut flow.momenta);
        if let Some(rest) = self.directors.mass.rest() {
            multiply_vector(rest, 1, &flow.rest_velocities, &mut flow.rest_momenta);
        }
        for place in 0..self.nodes.len() {
            let moments = self.directors_of(place).map(|(row, d)| d.cross(&self.vector(&flow.momenta, row)));
            flow.moments[place] = moments.sum();
        }
    }

    /// Computes w and returns (p, h) from the products in `flow`, without the momentum of M_R due to V.
    fn gather(&self, flow: &Flow, w: &mut [f64]) -> Vector6<f64> {
        let points = self.directors.points;
        w.fill(0.0);
        // Momenta of the points, and moments of the directors on the rotation rows.
        w[..points].copy_from_slice(&flow.momenta[..points]);
        for (place, rows) in self.directors.rotations.iter().enumerate() {
            let moment = self.nodes[place].onto_rotations(&flow.moments[place]);
            rows.iter().zip(&moment).for_each(|(row, moment)| row.iter().for_each(|&row| w[row] = *moment));
        }
        // Momentum and angular momentum of the frame.
        let both = self.body.onto_frame(&self.u, &flow.momenta[..points]);
        let (linear, mut angular) = halves(&both);
        angular += flow.moments.iter().sum::<Vector3<f64>>();
        // Contributions of the rest mass.
        let Some(rest) = &self.directors.rest else { return joined(&linear, &angular) };
        w[..points].iter_mut().zip(&flow.rest_momenta).for_each(|(w, value)| *w += value);
        let (rest_linear, rest_angular) =
            halves(&self.body.onto_frame(&self.u, &flow.rest_momenta[..points]));
        angular += rest_angular - rest.centre.cross(&rest_linear);
        for (place, rows) in self.directors.rotations.iter().enumerate() {
            let (first, axes) = self.directors.rest_rotations(place);
            let start = axes.start;
            for axis in axes {
                let moment = flow.rest_momenta[first + axis - start];
                angular[axis] += moment;
                rows[axis].iter().for_each(|&row| w[row] += moment);
            }
        }
        joined(&linear, &angular)
    }

    /// Computes x += M_R Phi_t v on the rows of the model.
    fn add_rest_translation(&self, rest: &Rest, v: &Vector3<f64>, x: &mut [f64]) {
        let of_points = x.iter_mut().zip(&rest.translated[..self.directors.points]);
        of_points.for_each(|(x, row)| *x += row.dot(v));
        for (place, rows) in self.directors.rotations.iter().enumerate() {
            let (first, axes) = self.directors.rest_rotations(place);
            let start = axes.start;
            for axis in axes {
                rows[axis].iter().for_each(|&row| x[row] += rest.translated[first + axis - start].dot(v));
            }
        }
    }

    /// Computes w = dT/du' and returns (p, h) = dT/d(V, omega).
    fn momenta(&self, nu: &Vector6<f64>, ud: &[f64], flow: &mut Flow, w: &mut [f64]) -> Vector6<f64> {
        self.velocities(nu, ud, flow);
        self.multiply(flow);
        let both = self.gather(flow, w);
        let Some(rest) = &self.directors.rest else { return both };
        let (linear, omega) = halves(nu);
        let flight = linear + omega.cross(&rest.centre);
        let relative = omega.cross(&self.rest_first_moment) + self.rest_shift(rest, ud);
        self.add_rest_translation(rest, &flight, w);
        both + joined(&relative, &(self.rest_first_moment.cross(&flight) + rest.centre.cross(&relative)))
    }

    /// Computes the rates of w and (p, h) at constant (V, omega) and u', while u changes with u'; `state`
    /// holds the products of the present velocities.
    fn drifts(
        &self,
        nu: &Vector6<f64>,
        ud: &[f64],
        state: &Flow,
        flow: &mut Flow,
        w: &mut [f64],
    ) -> Vector6<f64> {
        let (linear, omega) = halves(nu);
        self.velocity_drifts(&omega, ud, flow);
        self.multiply(flow);
        // Add the rotation of the directors themselves.
        for (place, node) in self.nodes.iter().enumerate() {
            let spin = node.spin(&self.directors.turn_of(place, ud));
            let turned = self
                .directors_of(place)
                .map(|(row, d)| spin.cross(&d).cross(&self.vector(&state.momenta, row)));
            flow.moments[place] += turned.sum::<Vector3<f64>>();
        }
        let mut both = self.gather(flow, w);
        for (place, rows) in self.directors.rotations.iter().enumerate() {
            let rate = self.directors.turn_of(place, ud);
            let drift = self.nodes[place].moment_drift(&state.moments[place], &rate);
            rows.iter().zip(&drift).for_each(|(row, drift)| row.iter().for_each(|&row| w[row] += drift));
        }
        let points = self.directors.points;
        let mut moment = self.body.moment(ud, &state.momenta[..points]);
        if let Some(rest) = &self.directors.rest {
            let shift = self.rest_shift(rest, ud);
            let relative = omega.cross(&shift);
            let flight = linear + omega.cross(&rest.centre);
            moment += self.body.moment(ud, &state.rest_momenta[..points])
                + shift.cross(&flight)
                + rest.centre.cross(&relative);
            both += joined(&relative, &Vector3::zeros());
        }
        both + joined(&Vector3::zeros(), &moment)
    }

    /// Computes forces += dT/du at constant (V, omega) and u'; `state` holds the products of the present
    /// velocities.
    fn add_slope(&self, nu: &Vector6<f64>, ud: &[f64], state: &Flow, forces: &mut [f64]) {
        let (linear, omega) = halves(nu);
        self.body.add_turned(-1.0, &omega, &state.momenta, forces);
        for (place, rows) in self.directors.rotations.iter().enumerate() {
            let (node, rate) = (&self.nodes[place], self.directors.turn_of(place, ud));
            let spin = omega + node.spin(&rate);
            let turned = self
                .directors_of(place)
                .map(|(row, d)| d.cross(&self.vector(&state.momenta, row).cross(&spin)));
            let slope = node.spin_derivative(&rate).tr_mul(&state.moments[place])
                + node.onto_rotations(&turned.sum());
            rows.iter().zip(&slope).for_each(|(row, slope)| row.iter().for_each(|&row| forces[row] += slope));
        }
        if let Some(rest) = &self.directors.rest {
            self.body.add_turned(-1.0, &omega, &state.rest_momenta, forces);
            let flight = linear + omega.cross(&rest.centre);
            self.add_rest_translation(rest, &flight.cross(&omega), forces);
        }
    }
}

/// Kinetic energy T(V, omega, u, u') of [`Directors`] at a state: the momenta w = dT/du' and (p, h) =
/// dT/d(V, omega), which are linear in the velocities, their rates while u changes, and dT/du.
#[derive(Debug, Clone)]
pub(super) struct Kinetics<'e> {
    at: TurnedNodes<'e>,
    nu: Vector6<f64>,
    state: Flow,
    trial: Flow,
    energy: f64,
}

impl<'e> Kinetics<'e> {
    /// Creates the kinetics for `directors` of `body`, at rest without deformation.
    pub(super) fn new(body: &'e NodalEquations<'e>, directors: &'e Directors<'e>) -> Self {
        let at = TurnedNodes {
            body,
            directors,
            nodes: vec![TurnedNode::new(Vector3::zeros()); directors.rotations.len()],
            u: vec![0.0; body.n_rows()],
            rest_first_moment: directors.rest.as_ref().map_or_else(Vector3::zeros, |rest| rest.first_moment),
        };
        let (state, trial) = (Flow::new(directors), Flow::new(directors));
        Self { at, nu: Vector6::zeros(), state, trial, energy: 0.0 }
    }

    /// Sets the displacements `u` (N).
    pub(super) fn turn(&mut self, u: &[f64]) {
        self.at.turn(u);
    }

    /// Sets the velocities nu = (V, omega) and u'. Returns (p, h) and computes w = dT/du'.
    pub(super) fn go(&mut self, nu: &Vector6<f64>, ud: &[f64], w: &mut [f64]) -> Vector6<f64> {
        let both = self.at.momenta(nu, ud, &mut self.state, w);
        self.nu = *nu;
        self.energy = 0.5 * (nu.dot(&both) + ud.iter().zip(&*w).map(|(ud, w)| ud * w).sum::<f64>());
        both
    }

    /// Returns T.
    pub(super) fn energy(&self) -> f64 {
        self.energy
    }

    /// Computes w and returns (p, h) of other velocities at the present displacements.
    pub(super) fn momenta(&mut self, nu: &Vector6<f64>, ud: &[f64], w: &mut [f64]) -> Vector6<f64> {
        self.at.momenta(nu, ud, &mut self.trial, w)
    }

    /// Computes the rates of w and returns those of (p, h) at constant velocities of the state, whose u' is
    /// `ud`.
    pub(super) fn drifts(&mut self, ud: &[f64], w: &mut [f64]) -> Vector6<f64> {
        self.at.drifts(&self.nu, ud, &self.state, &mut self.trial, w)
    }

    /// Computes forces += dT/du at constant velocities of the state, whose u' is `ud`.
    pub(super) fn add_slope(&self, ud: &[f64], forces: &mut [f64]) {
        self.at.add_slope(&self.nu, ud, &self.state, forces);
    }

    /// Returns the contribution of nodal rotations to the first moment s(u), in addition to that of
    /// displaced points.
    pub(super) fn first_moment_of_turns(&self) -> Vector3<f64> {
        let (at, directors) = (&self.at, self.at.directors);
        let mut sum = Vector3::zeros();
        for place in 0..at.nodes.len() {
            for (a, (row, director)) in at.directors_of(place).enumerate() {
                let moved = director - Vector3::ith(a, 1.0);
                (0..directors.dimension).for_each(|k| sum += directors.translated[row + k] * moved[k]);
            }
            if let Some(rest) = &directors.rest {
                let (first, axes) = directors.rest_rotations(place);
                let turn = at.nodes[place].theta();
                axes.clone().for_each(|axis| sum += rest.translated[first + axis - axes.start] * turn[axis]);
            }
        }
        sum
    }

    /// Adds d(b's)/du of the first moment s(u) to the rows of rotations.
    pub(super) fn add_weight_of_turns(&self, b: &Vector3<f64>, forces: &mut [f64]) {
        let (at, directors) = (&self.at, self.at.directors);
        for (place, rows) in directors.rotations.iter().enumerate() {
            let of_director = |(row, director): (usize, Vector3<f64>)| {
                let weight = |k: usize| directors.translated[row + k].dot(b);
                director
                    .cross(&Vector3::from_fn(|k, _| if k < directors.dimension { weight(k) } else { 0.0 }))
            };
            let mut moment = at.nodes[place].onto_rotations(&at.directors_of(place).map(of_director).sum());
            if let Some(rest) = &directors.rest {
                let (first, axes) = directors.rest_rotations(place);
                axes.clone()
                    .for_each(|axis| moment[axis] += rest.translated[first + axis - axes.start].dot(b));
            }
            rows.iter()
                .zip(&moment)
                .for_each(|(row, moment)| row.iter().for_each(|&row| forces[row] += moment));
        }
    }
}

// Kinematics of one node with directors.

/// Node with rotation vector theta: R = exp(theta~) with the directors d_a = R e_a as columns, and J with
/// the angular velocity J theta' of the directors relative to the frame, along the axes of the frame.
#[derive(Debug, Clone, Copy)]
struct TurnedNode {
    theta: Vector3<f64>,
    directors: Matrix3<f64>,
    /// J' = G(theta).
    map: Matrix3<f64>,
}

impl TurnedNode {
    /// Creates the node at `theta`.
    pub(super) fn new(theta: Vector3<f64>) -> Self {
        let rotation = RotationVector(theta);
        Self { theta, directors: rotation.axes(), map: rotation.map() }
    }

    /// Returns the rotation vector theta.
    pub(super) fn theta(&self) -> Vector3<f64> {
        self.theta
    }

    /// Returns the director d_a = R e_a.
    pub(super) fn director(&self, a: usize) -> Vector3<f64> {
        self.directors.column(a).into_owned()
    }

    /// Returns J theta', the angular velocity relative to the frame.
    pub(super) fn spin(&self, rate: &Vector3<f64>) -> Vector3<f64> {
        self.map.tr_mul(rate)
    }

    /// Returns J'm: its power on theta' is that of the moment m on the directors.
    fn onto_rotations(&self, moment: &Vector3<f64>) -> Vector3<f64> {
        self.map * moment
    }

    /// Returns D with D dtheta = d(J(theta) x) for a constant x.
    fn spin_derivative(&self, x: &Vector3<f64>) -> Matrix3<f64> {
        // J(theta) = G(-theta).
        -RotationVector(-self.theta).map_derivative(x)
    }

    /// Returns d/dt (J') m for a constant m, where theta changes with `rate`.
    fn moment_drift(&self, moment: &Vector3<f64>, rate: &Vector3<f64>) -> Vector3<f64> {
        RotationVector(self.theta).map_derivative(moment) * rate
    }
}
