//! Bodies assembled by joints that hold directions of points together, with Lagrange multipliers and constraints of index 1; places and
//! velocities are projected back onto the constraints after every step. Dense and plain.

use super::equations::State;
use super::general::quasi_velocities;
use flexbody::motion::dynamics::{
    BodyPoint, EquationsOfMotion, EulerParameters, Evaluation, Orientation, Prescribed,
};
use flexbody::numerics::integration::{Explicit, Failure, System};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// What a joint holds on to.
pub enum End {
    /// A place in the world.
    Ground(Vector3<f64>),
    /// A point of a body, by the number of the body.
    Body(usize, BodyPoint),
}

/// Two ends at the same place along the given world axes.
pub struct Joint {
    pub ends: [End; 2],
    pub axes: [bool; 3],
}

/// Sizes that errors are measured against.
pub struct Scales {
    pub length: f64,
    pub rate: f64,
}

/// y = (R, Euler parameters, q, V, omega, qd) of every body.
pub struct Jointed<'a> {
    pub bodies: &'a [EquationsOfMotion],
    pub masses: Vec<f64>,
    pub joints: Vec<Joint>,
    pub gravity: Vector3<f64>,
    pub scales: Scales,
}

/// A row of the constraints.
struct Row {
    /// Body, J' and M^-1 J' of it.
    parts: Vec<(usize, DVector<f64>, DVector<f64>)>,
    /// Violation, and the rate of its rate without accelerations.
    gap: f64,
    drift: f64,
}

fn entries(equations: &EquationsOfMotion) -> usize {
    7 + equations.n_modes() + equations.n_velocities()
}

impl<'a> Jointed<'a> {
    fn first(&self, body: usize) -> usize {
        self.bodies[..body].iter().map(entries).sum()
    }

    /// The state of bodies at given places and velocities.
    pub fn state(&self, states: &[State]) -> Vec<f64> {
        let mut y = Vec::new();
        for state in states {
            let turn = nalgebra::UnitQuaternion::from_matrix(&state.axes);
            y.extend(state.origin.iter());
            y.extend([turn.w, turn.i, turn.j, turn.k]);
            y.extend(state.q.iter());
            y.extend(quasi_velocities(state).iter());
        }
        y
    }

    fn attitude(&self, y: &[f64], body: usize) -> EulerParameters {
        let first = self.first(body) + 3;
        let e = nalgebra::Vector4::from_column_slice(&y[first..first + 4]).normalize();
        EulerParameters(e.into())
    }

    /// World place of the origin of a body.
    pub fn origin(&self, y: &[f64], body: usize) -> Vector3<f64> {
        Vector3::from_column_slice(&y[self.first(body)..][..3])
    }

    fn velocities<'y>(&self, y: &'y [f64], body: usize) -> &'y [f64] {
        let equations = &self.bodies[body];
        &y[self.first(body) + 7 + equations.n_modes()..][..equations.n_velocities()]
    }

    fn evaluation(&self, y: &[f64], body: usize) -> Evaluation<'a> {
        let equations = &self.bodies[body];
        let mut evaluation = Evaluation::new(equations);
        let q = &y[self.first(body) + 7..][..equations.n_modes()];
        evaluation.set(q, self.velocities(y, body));
        evaluation
    }

    fn rows(&self, y: &[f64]) -> Result<Vec<Row>, Failure> {
        let at: Vec<Evaluation<'a>> = (0..self.bodies.len()).map(|body| self.evaluation(y, body)).collect();
        let axes: Vec<Matrix3<f64>> =
            (0..self.bodies.len()).map(|body| self.attitude(y, body).axes()).collect();
        let mut rows = Vec::new();
        for joint in &self.joints {
            for k in (0..3).filter(|&k| joint.axes[k]) {
                let mut row = Row { parts: Vec::new(), gap: 0.0, drift: 0.0 };
                for (end, sign) in joint.ends.iter().zip([1.0, -1.0]) {
                    let (body, point) = match end {
                        End::Ground(place) => {
                            row.gap += sign * place[k];
                            continue;
                        }
                        End::Body(body, point) => (*body, point),
                    };
                    let (turn, now) = (&axes[body], &at[body]);
                    row.gap += sign * (self.origin(y, body) + turn * point.place(now))[k];
                    row.drift += sign * (turn * point.velocity_drift(now))[k];
                    let n = self.bodies[body].n_velocities();
                    let mut force = DVector::zeros(n);
                    point.add_force(now, &(turn.row(k).transpose() * sign), force.as_mut_slice());
                    let mut solver = now.clone();
                    let q = &y[self.first(body) + 7..][..n - 6];
                    solver
                        .set_momenta(q, force.as_slice(), &Prescribed::NOTHING)
                        .map_err(|_| Failure::Rates { reason: "no mass" })?;
                    let (v, w) = solver.rigid_velocity();
                    let response = v.iter().chain(&w).chain(solver.modal_velocity()).copied();
                    row.parts.push((body, force, DVector::from_iterator(n, response)));
                }
                rows.push(row);
            }
        }
        Ok(rows)
    }

    /// What `amounts` of the rows do: M^-1 J'x of every body, with J M^-1 J'x = `amounts`.
    fn answer(&self, rows: &[Row], amounts: &DVector<f64>) -> Result<Vec<DVector<f64>>, Failure> {
        let shared = |a: &Row, b: &Row| -> f64 {
            let pairs = a.parts.iter().flat_map(|x| b.parts.iter().map(move |y| (x, y)));
            pairs.filter(|(x, y)| x.0 == y.0).map(|(x, y)| x.1.dot(&y.2)).sum()
        };
        let matrix = DMatrix::from_fn(rows.len(), rows.len(), |i, j| shared(&rows[i], &rows[j]));
        let multipliers =
            matrix.lu().solve(amounts).ok_or(Failure::Rates { reason: "joints repeat each other" })?;
        let mut answer: Vec<DVector<f64>> =
            self.bodies.iter().map(|body| DVector::zeros(body.n_velocities())).collect();
        for (row, multiplier) in rows.iter().zip(&multipliers) {
            row.parts.iter().for_each(|(body, _, response)| answer[*body].axpy(*multiplier, response, 1.0));
        }
        Ok(answer)
    }

    /// J nu of a row.
    fn speed(&self, row: &Row, y: &[f64]) -> f64 {
        let own = |body: usize| DVector::from_column_slice(self.velocities(y, body));
        row.parts.iter().map(|(body, force, _)| force.dot(&own(*body))).sum()
    }

    /// The largest violations of the joints: places and velocities.
    pub fn violation(&self, y: &[f64]) -> (f64, f64) {
        let rows = self.rows(y).expect("a body with mass");
        rows.iter().fold((0.0, 0.0), |(gap, rate): (f64, f64), row| {
            (gap.max(row.gap.abs()), rate.max(self.speed(row, y).abs()))
        })
    }

    /// Kinetic, elastic and potential energy.
    pub fn energy(&self, y: &[f64]) -> f64 {
        (0..self.bodies.len())
            .map(|body| {
                let at = self.evaluation(y, body);
                let own = self.attitude(y, body).axes().tr_mul(&self.gravity);
                let lift =
                    own.dot(&at.first_moment()) + self.masses[body] * self.gravity.dot(&self.origin(y, body));
                at.kinetic_energy() + at.elastic_energy() - lift
            })
            .sum()
    }

    /// World place of a point.
    pub fn place(&self, y: &[f64], body: usize, point: &BodyPoint) -> Vector3<f64> {
        self.origin(y, body) + self.attitude(y, body).axes() * point.place(&self.evaluation(y, body))
    }

    /// From 0 to `end`, with a look at the state after every step.
    pub fn run(
        &mut self,
        y: &mut [f64],
        instants: &[f64],
        tolerance: f64,
        mut look: impl FnMut(&Self, usize, &[f64]),
    ) {
        let longest = instants.last().copied().unwrap_or(0.0);
        let mut method = Explicit::new(y.len(), tolerance, longest);
        let mut time = 0.0;
        for (at, &instant) in instants.iter().enumerate() {
            while time < instant {
                time = method.step(self, time, y, instant).expect("a step");
            }
            look(self, at, y);
        }
    }
}

impl System for Jointed<'_> {
    fn dimension(&self) -> usize {
        self.bodies.iter().map(entries).sum()
    }

    fn rates(&mut self, _: f64, y: &[f64], rates: &mut [f64]) -> Result<(), Failure> {
        let rows = self.rows(y)?;
        let mut free = Vec::new();
        for (body, equations) in self.bodies.iter().enumerate() {
            let mut at = self.evaluation(y, body);
            let mut forces = vec![0.0; equations.n_velocities()];
            at.add_gravity(&self.attitude(y, body).axes().tr_mul(&self.gravity), &mut forces);
            let mut acceleration = DVector::zeros(forces.len());
            at.accelerations(&forces, acceleration.as_mut_slice())
                .map_err(|_| Failure::Rates { reason: "no mass" })?;
            free.push(acceleration);
        }
        let lacking = rows.iter().map(|row| {
            let own: f64 = row.parts.iter().map(|(body, force, _)| force.dot(&free[*body])).sum();
            -own - row.drift
        });
        let held = self.answer(&rows, &DVector::from_iterator(rows.len(), lacking))?;
        for (body, equations) in self.bodies.iter().enumerate() {
            let (first, nf, nu) = (self.first(body), equations.n_modes(), self.velocities(y, body));
            let attitude = self.attitude(y, body);
            let rate = &mut rates[first..first + entries(equations)];
            let velocity = attitude.axes() * Vector3::from_column_slice(&nu[..3]);
            rate[..3].copy_from_slice(velocity.as_slice());
            rate[3..7].copy_from_slice(&attitude.rate(&Vector3::from_column_slice(&nu[3..6])));
            rate[7..7 + nf].copy_from_slice(&nu[6..]);
            rate[7 + nf..].copy_from_slice((&free[body] + &held[body]).as_slice());
        }
        Ok(())
    }

    fn scales(&self, _: &[f64], scales: &mut [f64]) {
        let Scales { length, rate } = self.scales;
        for (body, equations) in self.bodies.iter().enumerate() {
            let (first, nf) = (self.first(body), equations.n_modes());
            let amplitude = length * self.masses[body].sqrt();
            let own = &mut scales[first..first + entries(equations)];
            own[..3].fill(length);
            own[3..7].fill(1.0);
            own[7..7 + nf].fill(amplitude);
            own[7 + nf..10 + nf].fill(length * rate);
            own[10 + nf..13 + nf].fill(rate);
            own[13 + nf..].fill(amplitude * rate);
        }
    }

    /// Back to the constraints, by the least changes in the measure of the mass.
    fn settle(&self, y: &mut [f64]) {
        for _ in 0..2 {
            let rows = self.rows(y).expect("a body with mass");
            let gaps = DVector::from_iterator(rows.len(), rows.iter().map(|row| -row.gap));
            let moved = self.answer(&rows, &gaps).expect("independent joints");
            for (body, change) in moved.iter().enumerate() {
                let (first, attitude) = (self.first(body), self.attitude(y, body));
                let shift = attitude.axes() * change.fixed_rows::<3>(0);
                let turn = attitude.rate(&change.fixed_rows::<3>(3).into_owned());
                (0..3).for_each(|k| y[first + k] += shift[k]);
                (0..4).for_each(|k| y[first + 3 + k] = attitude.0[k] + turn[k]);
                change.iter().skip(6).enumerate().for_each(|(j, q)| y[first + 7 + j] += q);
                let attitude = self.attitude(y, body);
                y[first + 3..first + 7].copy_from_slice(&attitude.0);
            }
        }
        let rows = self.rows(y).expect("a body with mass");
        let speeds = rows.iter().map(|row| -self.speed(row, y));
        let speeds = DVector::from_iterator(rows.len(), speeds);
        let changes = self.answer(&rows, &speeds).expect("independent joints");
        for (body, change) in changes.iter().enumerate() {
            let first = self.first(body) + 7 + self.bodies[body].n_modes();
            change.iter().enumerate().for_each(|(i, v)| y[first + i] += v);
        }
    }
}
