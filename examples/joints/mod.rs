//! Flexible bodies held together by joints: equations of motion of index 1 with Lagrange multipliers, dense
//! and plain. It is an example of what the library is for, and no multibody program.
//!
//! Every body has the velocities nu = (V, omega, qd) and the equations Mc(q) nu' = f of `flexbody::dynamics`.
//! A joint holds two points together along axes of the world: one row c(t) = 0 for each axis, with the rates
//!
//! ```text
//! c' = J nu = 0,        c'' = J nu' + drift = 0
//! ```
//!
//! where J nu is the difference of the velocities of the two points. The constraint forces are J'lambda
//! ([ZG19] (57) to (60): the Jacobian of the constraints on nodes, times that of the nodes by the coordinates
//! of the body, which is what `BodyPoint::add_force` applies), so that
//!
//! ```text
//! [Mc  -J'] [nu'   ]   [f     ]
//! [J    0 ] [lambda] = [-drift]        (J Mc^-1 J') lambda = -drift - J Mc^-1 f
//! ```
//!
//! lambda is the force along the axis that the joint exerts on its first end; the second end has the
//! opposite. A step is one of the classical Runge-Kutta method; places and velocities are then brought back
//! onto the constraints by the least change in the measure of the mass.
//!
//! Units are those of the bodies, all the same ones; vectors are along axes of the world unless said
//! otherwise.

mod steps;

pub use steps::{ground_force, momentum, step};

use flexbody::dynamics::{
    BodyPoint, EquationsOfMotion, EulerParameters, Evaluation, Orientation, Prescribed,
};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3, Vector4};

/// Or why the motion cannot go on.
pub type Result<T> = std::result::Result<T, &'static str>;

/// The mass matrix of a body that is deformed too far.
const NO_MASS: &str = "the mass matrix of a body is not positive definite";

/// End of a joint.
pub enum End {
    /// A place in the world.
    Ground(Vector3<f64>),
    /// A point of a body, by the number of the body.
    Body(usize, BodyPoint),
}

/// Two ends at the same place along those of the three axes of the world that are `true`.
pub struct Joint {
    pub ends: [End; 2],
    pub axes: [bool; 3],
}

/// A body at the start: the origin and the axes (as columns) of its frame, their velocity and the angular
/// velocity along the axes of the body; without deformation.
pub struct Start {
    pub origin: Vector3<f64>,
    pub axes: Matrix3<f64>,
    pub velocity: Vector3<f64>,
    pub omega: Vector3<f64>,
}

/// Bodies, the joints between them, and gravity. Its state y has for every body R, the Euler parameters, q
/// and nu = (V, omega, qd).
pub struct Assembly<'a> {
    pub bodies: &'a [EquationsOfMotion],
    pub masses: Vec<f64>,
    pub joints: Vec<Joint>,
    pub gravity: Vector3<f64>,
}

/// A row of the constraints.
struct Row {
    /// Body, J' and Mc^-1 J' of it.
    parts: Vec<(usize, DVector<f64>, DVector<f64>)>,
    /// c, and c'' without accelerations.
    gap: f64,
    drift: f64,
}

/// y', and the multipliers of all rows.
pub struct Rates {
    pub state: Vec<f64>,
    pub multipliers: Vec<f64>,
}

fn entries(equations: &EquationsOfMotion) -> usize {
    7 + equations.n_modes() + equations.n_velocities()
}

impl<'a> Assembly<'a> {
    /// Returns the index of the first entry of a body in the state.
    pub fn first(&self, body: usize) -> usize {
        self.bodies[..body].iter().map(entries).sum()
    }

    /// Length of the state.
    pub fn dimension(&self) -> usize {
        self.first(self.bodies.len())
    }

    /// The state of bodies without deformation.
    pub fn state(&self, starts: &[Start]) -> Vec<f64> {
        let mut y = Vec::new();
        for (equations, start) in self.bodies.iter().zip(starts) {
            let still = vec![0.0; equations.n_modes()];
            y.extend(start.origin.iter());
            y.extend(EulerParameters::of_axes(&start.axes).0);
            y.extend(&still);
            y.extend(start.axes.tr_mul(&start.velocity).iter().chain(&start.omega));
            y.extend(still);
        }
        y
    }

    fn attitude(&self, y: &[f64], body: usize) -> EulerParameters {
        let first = self.first(body) + 3;
        EulerParameters(Vector4::from_column_slice(&y[first..first + 4]).normalize().into())
    }

    /// Axes of a body as columns.
    pub fn axes(&self, y: &[f64], body: usize) -> Matrix3<f64> {
        self.attitude(y, body).axes()
    }

    /// Place of the origin of a body.
    pub fn origin(&self, y: &[f64], body: usize) -> Vector3<f64> {
        Vector3::from_column_slice(&y[self.first(body)..][..3])
    }

    fn coordinates<'y>(&self, y: &'y [f64], body: usize) -> &'y [f64] {
        &y[self.first(body) + 7..][..self.bodies[body].n_modes()]
    }

    fn velocities<'y>(&self, y: &'y [f64], body: usize) -> &'y [f64] {
        let equations = &self.bodies[body];
        &y[self.first(body) + 7 + equations.n_modes()..][..equations.n_velocities()]
    }

    /// The equations of motion of a body at a state.
    pub fn evaluation(&self, y: &[f64], body: usize) -> Evaluation<'a> {
        let mut evaluation = Evaluation::new(&self.bodies[body]);
        evaluation.set(self.coordinates(y, body), self.velocities(y, body));
        evaluation
    }

    /// The rows of all joints.
    fn rows(&self, y: &[f64]) -> Result<Vec<Row>> {
        let at: Vec<Evaluation<'a>> = (0..self.bodies.len()).map(|body| self.evaluation(y, body)).collect();
        let mut rows = Vec::new();
        for joint in &self.joints {
            for axis in (0..3).filter(|&axis| joint.axes[axis]) {
                rows.push(self.row(y, &at, joint, axis)?);
            }
        }
        Ok(rows)
    }

    fn row(&self, y: &[f64], at: &[Evaluation<'a>], joint: &Joint, axis: usize) -> Result<Row> {
        let mut row = Row { parts: Vec::new(), gap: 0.0, drift: 0.0 };
        for (end, sign) in joint.ends.iter().zip([1.0, -1.0]) {
            let (body, point) = match end {
                End::Ground(place) => {
                    row.gap += sign * place[axis];
                    continue;
                }
                End::Body(body, point) => (*body, point),
            };
            let (axes, now) = (self.attitude(y, body).axes(), &at[body]);
            row.gap += sign * (self.origin(y, body) + axes * point.place(now))[axis];
            row.drift += sign * (axes * point.velocity_drift(now))[axis];
            // A unit force along the axis is a row of J.
            let n = self.bodies[body].n_velocities();
            let mut force = DVector::zeros(n);
            point.add_force(now, &(axes.row(axis).transpose() * sign), force.as_mut_slice());
            // Velocities from momenta: Mc^-1 J'.
            let mut solver = now.clone();
            solver
                .set_momenta(self.coordinates(y, body), force.as_slice(), &Prescribed::NOTHING)
                .map_err(|_| NO_MASS)?;
            let (v, w) = solver.rigid_velocity();
            let response = v.iter().chain(&w).chain(solver.modal_velocity()).copied();
            row.parts.push((body, force, DVector::from_iterator(n, response)));
        }
        Ok(row)
    }

    /// The multipliers lambda with (J Mc^-1 J') lambda = `amounts`, and the answers Mc^-1 J'lambda of all
    /// bodies.
    fn answer(&self, rows: &[Row], amounts: DVector<f64>) -> Result<(DVector<f64>, Vec<DVector<f64>>)> {
        let shared = |a: &Row, b: &Row| -> f64 {
            let pairs = a.parts.iter().flat_map(|x| b.parts.iter().map(move |y| (x, y)));
            pairs.filter(|(x, y)| x.0 == y.0).map(|(x, y)| x.1.dot(&y.2)).sum()
        };
        let matrix = DMatrix::from_fn(rows.len(), rows.len(), |i, j| shared(&rows[i], &rows[j]));
        let multipliers = matrix.lu().solve(&amounts).ok_or("joints repeat each other")?;
        let mut answers: Vec<DVector<f64>> =
            self.bodies.iter().map(|body| DVector::zeros(body.n_velocities())).collect();
        for (row, multiplier) in rows.iter().zip(&multipliers) {
            row.parts.iter().for_each(|(body, _, response)| answers[*body].axpy(*multiplier, response, 1.0));
        }
        Ok((multipliers, answers))
    }

    /// J nu of a row.
    fn speed(&self, row: &Row, y: &[f64]) -> f64 {
        let own = |body: usize| DVector::from_column_slice(self.velocities(y, body));
        row.parts.iter().map(|(body, force, _)| force.dot(&own(*body))).sum()
    }

    /// y' and the constraint forces at a state.
    pub fn rates(&self, y: &[f64]) -> Result<Rates> {
        let rows = self.rows(y)?;
        // Accelerations without joints.
        let mut free = Vec::new();
        for (body, equations) in self.bodies.iter().enumerate() {
            let mut at = self.evaluation(y, body);
            let mut forces = vec![0.0; equations.n_velocities()];
            at.add_gravity(&self.attitude(y, body).axes().tr_mul(&self.gravity), &mut forces);
            let mut acceleration = DVector::zeros(forces.len());
            at.accelerations(&forces, acceleration.as_mut_slice()).map_err(|_| NO_MASS)?;
            free.push(acceleration);
        }
        let lacking = rows.iter().map(|row| {
            let own: f64 = row.parts.iter().map(|(body, force, _)| force.dot(&free[*body])).sum();
            -own - row.drift
        });
        let (multipliers, held) = self.answer(&rows, DVector::from_iterator(rows.len(), lacking))?;
        let mut state = Vec::with_capacity(y.len());
        for body in 0..self.bodies.len() {
            let (nu, attitude) = (self.velocities(y, body), self.attitude(y, body));
            let vector = |at: usize| Vector3::from_column_slice(&nu[at..at + 3]);
            state.extend((attitude.axes() * vector(0)).iter());
            state.extend(attitude.rate(&vector(3)));
            state.extend(&nu[6..]);
            state.extend((&free[body] + &held[body]).iter());
        }
        Ok(Rates { state, multipliers: multipliers.as_slice().to_vec() })
    }

    /// Brings places and velocities back onto the constraints, by the least changes in the measure of the
    /// mass.
    pub fn settle(&self, y: &mut [f64]) -> Result<()> {
        for _ in 0..2 {
            let rows = self.rows(y)?;
            let gaps = DVector::from_iterator(rows.len(), rows.iter().map(|row| -row.gap));
            let (_, moved) = self.answer(&rows, gaps)?;
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
        let rows = self.rows(y)?;
        let speeds = rows.iter().map(|row| -self.speed(row, y));
        let (_, changes) = self.answer(&rows, DVector::from_iterator(rows.len(), speeds))?;
        for (body, change) in changes.iter().enumerate() {
            let first = self.first(body) + 7 + self.bodies[body].n_modes();
            change.iter().enumerate().for_each(|(i, v)| y[first + i] += v);
        }
        Ok(())
    }

    /// The largest violations of the joints: places and velocities.
    pub fn violation(&self, y: &[f64]) -> Result<(f64, f64)> {
        let rows = self.rows(y)?;
        Ok(rows.iter().fold((0.0, 0.0), |(gap, rate): (f64, f64), row| {
            (gap.max(row.gap.abs()), rate.max(self.speed(row, y).abs()))
        }))
    }

    /// Kinetic, elastic and potential energy.
    pub fn energy(&self, y: &[f64]) -> f64 {
        let of_body = |body: usize| {
            let at = self.evaluation(y, body);
            let gravity = self.attitude(y, body).axes().tr_mul(&self.gravity);
            let lift =
                gravity.dot(&at.first_moment()) + self.masses[body] * self.gravity.dot(&self.origin(y, body));
            at.kinetic_energy() + at.elastic_energy() - lift
        };
        (0..self.bodies.len()).map(of_body).sum()
    }

    /// Place of a point.
    pub fn place(&self, y: &[f64], body: usize, point: &BodyPoint) -> Vector3<f64> {
        self.origin(y, body) + self.attitude(y, body).axes() * point.place(&self.evaluation(y, body))
    }
}
