//! Equations of motion in positions of all nodes: M x'' = f, with multipliers for prescribed motion.

use super::corotation::{Fit, Solid, Weights, node};
use super::integration::{State, step};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix3, Vector3};

/// A force at a node.
#[derive(Debug, Clone, Copy)]
pub struct Force {
    /// Index of the node, from 0.
    pub node: usize,
    /// Amplitude along axes of the world or of the frame of the body.
    pub amplitude: Vector3<f64>,
    /// True if the force rotates with the frame of the body.
    pub follows: bool,
    /// Circular frequency: the force is amplitude sin(frequency t).
    pub frequency: f64,
}

/// A frame with prescribed motion: uniform rotation about an axis fixed in the frame, and an oscillating
/// origin.
#[derive(Debug, Clone, Copy)]
pub struct Driven {
    /// Attitude at time zero.
    pub start: Matrix3<f64>,
    /// Angular velocity along axes of the frame.
    pub omega: Vector3<f64>,
    /// Origin of the frame in the model.
    pub origin: Vector3<f64>,
    /// A point on the axis of rotation, in the model.
    pub through: Vector3<f64>,
    /// Position of the origin of the model at time zero.
    pub place: Vector3<f64>,
    /// Amplitude of the velocity of the axis: amplitude sin(frequency t).
    pub velocity: Vector3<f64>,
    /// Circular frequency of the velocity.
    pub frequency: f64,
}

/// Linear conditions G u = 0 on the displacements relative to a driven frame.
#[derive(Debug, Clone)]
pub struct Conditions {
    /// Condition matrix G.
    pub rows: DMatrix<f64>,
    /// Frame that the displacements refer to.
    pub frame: Driven,
    /// True if the driven frame carries K; false if the best fit does.
    pub carries: bool,
}

/// A body in a scene.
pub struct Absolute {
    solid: Solid,
    fit: Fit,
    inverse_mass: Cholesky<f64, Dyn>,
    forces: Vec<Force>,
    gravity: Vector3<f64>,
    conditions: Option<Conditions>,
}

/// Attitude and motion of the frame at a time.
struct Frame {
    axes: Matrix3<f64>,
    origin: Vector3<f64>,
    velocity: Vector3<f64>,
    acceleration: Vector3<f64>,
}

/// Returns the rotation by an angle about a unit vector (Rodrigues).
pub fn rodrigues(axis: &Vector3<f64>, angle: f64) -> Matrix3<f64> {
    let cross = axis.cross_matrix();
    Matrix3::identity() + cross * angle.sin() + cross * cross * (1.0 - angle.cos())
}

impl Driven {
    fn at(&self, time: f64) -> Frame {
        let speed = self.omega.norm();
        let axes = match self.omega.try_normalize(0.0) {
            Some(axis) => self.start * rodrigues(&axis, speed * time),
            None => self.start,
        };
        // The point on the axis oscillates; the origin rotates about it.
        let first = self.place + self.start * self.through;
        let (sin, cos) = (self.frequency * time).sin_cos();
        let (way, rate) = if self.frequency > 0.0 {
            ((1.0 - cos) / self.frequency, self.frequency * cos)
        } else {
            (0.0, 0.0)
        };
        let arm = axes * (self.origin - self.through);
        let omega = axes * self.omega;
        Frame {
            origin: first + self.velocity * way + arm,
            velocity: self.velocity * sin + omega.cross(&arm),
            acceleration: self.velocity * rate + omega.cross(&omega.cross(&arm)),
            axes,
        }
    }
}

impl Absolute {
    /// Returns a free body without loads.
    pub fn new(solid: Solid, weights: Weights) -> Self {
        let fit = Fit::new(&solid, weights);
        let inverse_mass = solid.mass.clone().cholesky().expect("mass");
        Self { solid, fit, inverse_mass, forces: Vec::new(), gravity: Vector3::zeros(), conditions: None }
    }

    /// Returns the body under forces and gravity.
    pub fn under(self, forces: &[Force], gravity: Vector3<f64>) -> Self {
        Self { forces: forces.to_vec(), gravity, ..self }
    }

    /// Returns the body with conditions.
    pub fn held(self, conditions: Conditions) -> Self {
        Self { conditions: Some(conditions), ..self }
    }

    /// Returns M^-1 times forces of the nodes.
    fn over_mass(&self, force: &DVector<f64>) -> DVector<f64> {
        let by_node = DMatrix::from_fn(self.solid.places.len(), 3, |i, k| force[3 * i + k]);
        let solved = self.inverse_mass.solve(&by_node);
        DVector::from_fn(force.len(), |row, _| solved[(row / 3, row % 3)])
    }

    /// Returns all forces except those of the conditions.
    fn force(&self, time: f64, state: &State) -> DVector<f64> {
        let frame = self.conditions.as_ref().map(|held| (held.frame.at(time).axes, held.carries));
        let (mut force, turn) = match frame {
            Some((axes, true)) => (self.solid.carried_force(&state.x, &axes), axes),
            Some((axes, false)) => (self.solid.fitted_force(&state.x, &self.fit).0, axes),
            None => self.solid.fitted_force(&state.x, &self.fit),
        };
        for (i, mass) in self.solid.row_masses().into_iter().enumerate() {
            let mut own = force.fixed_rows_mut::<3>(3 * i);
            own += self.gravity * mass;
        }
        for load in &self.forces {
            let size = (load.frequency * time).sin();
            let along = if load.follows { turn * load.amplitude } else { load.amplitude };
            let mut own = force.fixed_rows_mut::<3>(3 * load.node);
            own += along * size;
        }
        force
    }

    /// Returns vectors of the nodes along the axes of a frame.
    fn seen(&self, axes: &Matrix3<f64>, x: impl Fn(usize) -> Vector3<f64>) -> DVector<f64> {
        let mut seen = DVector::zeros(3 * self.solid.places.len());
        for i in 0..self.solid.places.len() {
            seen.fixed_rows_mut::<3>(3 * i).copy_from(&axes.tr_mul(&x(i)));
        }
        seen
    }

    /// Returns the accelerations, and the constraint forces of the conditions at the nodes along the axes of
    /// the frame.
    pub fn accelerations(&self, time: f64, state: &State) -> (DVector<f64>, Option<DVector<f64>>) {
        let free = self.over_mass(&self.force(time, state));
        let Some(held) = &self.conditions else { return (free, None) };
        let Frame { axes, velocity, acceleration, .. } = held.frame.at(time);
        let omega = held.frame.omega;
        // G w'' = 0 with w = A'(x - o): w'' = A'(x'' - o'') - 2 omega x A'(x' - o') + omega x (omega x w).
        let origin = held.frame.at(time).origin;
        let relative = self.seen(&axes, |i| {
            let w = axes.tr_mul(&(node(&state.x, i) - origin));
            let rate = axes.tr_mul(&(node(&state.v, i) - velocity));
            let seen = axes.tr_mul(&(node(&free, i) - acceleration));
            axes * (seen - omega.cross(&rate) * 2.0 + omega.cross(&omega.cross(&w)))
        });
        let columns: Vec<DVector<f64>> =
            held.rows.row_iter().map(|row| self.over_mass(&row.transpose())).collect();
        let compliance = &held.rows * DMatrix::from_columns(&columns);
        let multipliers = compliance.lu().solve(&(&held.rows * relative)).expect("independent conditions");
        let reaction = -(held.rows.transpose() * multipliers);
        let pushed = self.over_mass(&reaction);
        let mut all = free;
        for i in 0..self.solid.places.len() {
            let mut own = all.fixed_rows_mut::<3>(3 * i);
            own += axes * node(&pushed, i);
        }
        (all, Some(reaction))
    }

    /// Returns force and torque of the prescribed motion about the origin of the frame, along its axes, and
    /// the moment of the elastic forces alone. The torque is that of the conditions plus the moment of the
    /// elastic forces, which does not vanish if the frame carries K.
    pub fn reaction(&self, time: f64, state: &State) -> Option<(Vector3<f64>, Vector3<f64>, Vector3<f64>)> {
        let forces = self.accelerations(time, state).1?;
        let held = self.conditions.as_ref()?;
        let frame = held.frame.at(time);
        let elastic = if held.carries {
            self.solid.carried_force(&state.x, &frame.axes)
        } else {
            self.solid.fitted_force(&state.x, &self.fit).0
        };
        let arm = |i: usize| frame.axes.tr_mul(&(node(&state.x, i) - frame.origin));
        let nodes = 0..self.solid.places.len();
        let moment: Vector3<f64> =
            nodes.clone().map(|i| arm(i).cross(&frame.axes.tr_mul(&node(&elastic, i)))).sum();
        let force = nodes.clone().map(|i| node(&forces, i)).sum();
        let torque = nodes.map(|i| arm(i).cross(&node(&forces, i))).sum::<Vector3<f64>>();
        Some((force, torque + moment, moment))
    }

    /// Returns the undeformed body: the model at `origin` + A x, with the velocity `velocity` of the centre
    /// of mass and the angular velocity `omega` along axes of the model. With conditions the body has the
    /// motion of the frame.
    pub fn start(
        &self,
        axes: &Matrix3<f64>,
        origin: Vector3<f64>,
        velocity: Vector3<f64>,
        omega: Vector3<f64>,
    ) -> State {
        let centre = self.solid.centre();
        let n = self.solid.places.len();
        let (mut x, mut v) = (DVector::zeros(3 * n), DVector::zeros(3 * n));
        for (i, place) in self.solid.places.iter().enumerate() {
            let (own, rate) = match &self.conditions {
                None => (origin + axes * place, velocity + axes * omega.cross(&(place - centre))),
                Some(held) => {
                    let frame = held.frame.at(0.0);
                    let arm = place - held.frame.origin;
                    (
                        frame.origin + frame.axes * arm,
                        frame.velocity + frame.axes * held.frame.omega.cross(&arm),
                    )
                }
            };
            x.fixed_rows_mut::<3>(3 * i).copy_from(&own);
            v.fixed_rows_mut::<3>(3 * i).copy_from(&rate);
        }
        State { x, v }
    }

    /// Returns states at evenly spaced times, the initial state first, with `steps` steps between two of
    /// them.
    pub fn motion(&self, start: State, duration: f64, outputs: usize, steps: usize) -> Vec<State> {
        let h = duration / (outputs * steps) as f64;
        let acceleration = |time: f64, state: &State| self.accelerations(time, state).0;
        let mut states = vec![start];
        for output in 0..outputs {
            let mut state = states[output].clone();
            for i in 0..steps {
                state = step(&state, h * (output * steps + i) as f64, h, &acceleration);
            }
            states.push(state);
        }
        states
    }
}
