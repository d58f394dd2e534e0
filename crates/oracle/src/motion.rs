//! Motions of bodies by the library's integrators.

use flexbody_motion::dynamics::{
    Balance, Configuration, EquationsOfMotion, EulerParameters, Evaluation, Motion, Orientation, Surroundings,
};
use flexbody_motion::integration::{Explicit, Failure, Gauss, Method, System, integrate};
use nalgebra::{DVector, Matrix3, Vector3};

/// Quantities that free motion conserves: energy, and momenta along world axes.
pub struct Kept {
    pub energy: f64,
    pub linear: Vector3<f64>,
    pub angular: Vector3<f64>,
}

/// Largest relative changes of the conserved quantities, and measures of the motion.
#[derive(Debug, Default)]
pub struct Drift {
    pub energy: f64,
    pub linear: f64,
    pub angular: f64,
    pub deformation: f64,
    pub turns: f64,
}

impl Drift {
    /// Adds a state: the changes of its conserved quantities since the first state, |q| relative to the size of the
    /// body, and the angle in radians turned since the last state.
    pub fn add(&mut self, first: &Kept, now: &Kept, deformation: f64, turned: f64) {
        self.energy = self.energy.max((now.energy / first.energy - 1.0).abs());
        self.linear = self.linear.max((now.linear - first.linear).norm() / first.linear.norm());
        self.angular = self.angular.max((now.angular - first.angular).norm() / first.angular.norm());
        self.deformation = self.deformation.max(deformation);
        self.turns += turned / std::f64::consts::TAU;
    }

    /// Returns the largest relative change of a conserved quantity.
    pub fn worst(&self) -> f64 {
        self.energy.max(self.linear).max(self.angular)
    }
}

/// Returns the states at the instants, the first of which is the start, with their balances.
pub fn run(
    equations: &EquationsOfMotion,
    surroundings: &dyn Surroundings,
    start: &Configuration,
    method: impl Fn(usize) -> Method,
    instants: &[f64],
    breaks: &[f64],
) -> (Vec<Configuration>, Vec<Balance>) {
    let (mut motion, mut state) = Motion::new(equations, surroundings, start);
    let mut observer = Motion::new(equations, surroundings, start).0;
    let (mut places, mut balances) = (Vec::new(), Vec::new());
    integrate(&mut method(motion.dimension()), &mut motion, &mut state, instants, breaks, |time, state| {
        let now = observer.evaluate(time, state)?;
        places.push(now.configuration());
        balances.push(now.balance());
        Ok::<(), Failure>(())
    })
    .expect("a body that moves");
    (places, balances)
}

/// Returns the method with error control.
pub fn adaptive(tolerance: f64) -> impl Fn(usize) -> Method {
    move |n| Method::Explicit(Explicit::new(n, tolerance, f64::MAX))
}

/// Returns the conserving method.
pub fn conserving(order: usize, step: f64) -> impl Fn(usize) -> Method {
    move |n| Method::Gauss { method: Gauss::new(n, order), step }
}

/// Returns y' of y = (R, Euler parameters, q, V, omega, qd), V in body axes. `load` adds the forces; it receives A.
pub fn velocity_rates(
    equations: &EquationsOfMotion,
    y: &DVector<f64>,
    load: &impl Fn(&Evaluation<'_>, &Matrix3<f64>, &DVector<f64>, &mut [f64]),
) -> DVector<f64> {
    let nf = equations.n_modes();
    let euler = orientation(y);
    let (q, nu) = (y.rows(7, nf).into_owned(), y.rows(7 + nf, 6 + nf).into_owned());
    let mut evaluation = Evaluation::new(equations);
    evaluation.set(q.as_slice(), nu.as_slice());
    let (mut forces, mut found) = (vec![0.0; 6 + nf], DVector::zeros(6 + nf));
    load(&evaluation, &euler.axes(), y, &mut forces);
    evaluation.accelerations(&forces, found.as_mut_slice()).expect("a body");
    let velocity = euler.axes() * nu.fixed_rows::<3>(0);
    let turn = euler.rate(&nu.fixed_rows::<3>(3).into_owned());
    let modal = nu.rows(6, nf).into_owned();
    let parts = velocity.iter().chain(&turn).chain(&modal).chain(&found).copied();
    DVector::from_iterator(y.len(), parts)
}

/// Returns the Euler parameters, normalised to remove the error of the integration.
pub fn orientation(y: &DVector<f64>) -> EulerParameters {
    EulerParameters(y.fixed_rows::<4>(3).normalize().into())
}
