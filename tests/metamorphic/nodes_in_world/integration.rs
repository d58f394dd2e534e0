//! Classical Runge-Kutta method of order four with a fixed step.

use nalgebra::DVector;

/// Positions and velocities.
#[derive(Debug, Clone)]
pub struct State {
    /// Positions of all nodes in the world.
    pub x: DVector<f64>,
    /// Velocities of all nodes in the world.
    pub v: DVector<f64>,
}

/// Returns the state after one step.
pub fn step(state: &State, time: f64, h: f64, acceleration: &impl Fn(f64, &State) -> DVector<f64>) -> State {
    let along = |slope: &State, h: f64| State { x: &state.x + &slope.x * h, v: &state.v + &slope.v * h };
    let slope = |time: f64, at: &State| State { x: at.v.clone(), v: acceleration(time, at) };
    let a = slope(time, state);
    let b = slope(time + 0.5 * h, &along(&a, 0.5 * h));
    let c = slope(time + 0.5 * h, &along(&b, 0.5 * h));
    let d = slope(time + h, &along(&c, h));
    let mean = |a: &DVector<f64>, b: &DVector<f64>, c: &DVector<f64>, d: &DVector<f64>| {
        (a + (b + c) * 2.0 + d) / 6.0
    };
    let slope = State { x: mean(&a.x, &b.x, &c.x, &d.x), v: mean(&a.v, &b.v, &c.v, &d.v) };
    along(&slope, h)
}
