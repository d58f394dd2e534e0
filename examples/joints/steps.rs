//! Steps of the Runge-Kutta method, and what the examples read of a motion.

use super::{Assembly, End, Result};
use nalgebra::Vector3;

/// One step of the classical Runge-Kutta method. Answers the mean of the multipliers over the step, to the
/// order of the method.
pub fn step(assembly: &Assembly<'_>, y: &mut [f64], width: f64) -> Result<Vec<f64>> {
    let shifted =
        |by: f64, rates: &[f64]| -> Vec<f64> { y.iter().zip(rates).map(|(y, r)| y + by * r).collect() };
    let a = assembly.rates(y)?;
    let b = assembly.rates(&shifted(0.5 * width, &a.state))?;
    let c = assembly.rates(&shifted(0.5 * width, &b.state))?;
    let d = assembly.rates(&shifted(width, &c.state))?;
    let mean = |of: [&[f64]; 4], i: usize| (of[0][i] + 2.0 * of[1][i] + 2.0 * of[2][i] + of[3][i]) / 6.0;
    for (i, y) in y.iter_mut().enumerate() {
        *y += width * mean([&a.state, &b.state, &c.state, &d.state], i);
    }
    assembly.settle(y)?;
    let multipliers = [&a, &b, &c, &d].map(|rates| rates.multipliers.as_slice());
    Ok((0..a.multipliers.len()).map(|i| mean(multipliers, i)).collect())
}

/// Linear momentum of all bodies.
pub fn momentum(assembly: &Assembly<'_>, y: &[f64]) -> Vector3<f64> {
    (0..assembly.bodies.len())
        .map(|body| assembly.axes(y, body) * assembly.evaluation(y, body).linear_momentum())
        .sum()
}

/// The force that the ground exerts through all joints that have it as their second end.
pub fn ground_force(assembly: &Assembly<'_>, multipliers: &[f64]) -> Vector3<f64> {
    let (mut force, mut row) = (Vector3::zeros(), 0);
    for joint in &assembly.joints {
        for axis in (0..3).filter(|&axis| joint.axes[axis]) {
            if matches!(joint.ends[1], End::Ground(_)) {
                force[axis] += multipliers[row];
            }
            row += 1;
        }
    }
    force
}
