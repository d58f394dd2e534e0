//! Fit of inertia relief to forces at nodes, robust against arbitrary forces at a few supported nodes.

use nalgebra::{Matrix6, Vector3, Vector6};

/// Number of reweightings. Each reduces the share of the supported nodes in the fit; forty leave 1e-6 of
/// it.
const REWEIGHTINGS: usize = 40;

/// Force relative to the mean below which all forces have equal weight.
const EQUAL_WEIGHT_FORCE: f64 = 1e-7;

/// Forces of the six unit rigid accelerations at one node; those out of the plane are zero.
pub(super) type Relief = [Vector3<f64>; 6];

/// Returns the sum of the forces of the accelerations `by`.
pub(super) fn force(relief: &Relief, by: &Vector6<f64>) -> Vector3<f64> {
    relief.iter().zip(by.iter()).fold(Vector3::zeros(), |sum, (unit, &c)| sum + unit * c)
}

/// Returns the rigid accelerations that minimise the sum of the lengths of `forces` - relief. In a sum of
/// lengths a few nodes with arbitrary forces do not change the result (iteratively reweighted least
/// squares).
pub(super) fn least_lengths(forces: &[Vector3<f64>], relief: &[Relief]) -> Vector6<f64> {
    let mean = forces.iter().map(Vector3::norm).sum::<f64>() / forces.len().max(1) as f64;
    let mut by = Vector6::zeros();
    if mean == 0.0 {
        return by;
    }
    for _ in 0..REWEIGHTINGS {
        let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
        for (f, unit) in forces.iter().zip(relief) {
            let weight = 1.0 / (f - force(unit, &by)).norm().max(EQUAL_WEIGHT_FORCE * mean);
            for a in 0..6 {
                right[a] += weight * unit[a].dot(f);
                (0..6).for_each(|b| normal[(a, b)] += weight * unit[a].dot(&unit[b]));
            }
        }
        by = solve(normal, &right);
    }
    by
}

/// Returns the least-squares solution of normal equations; motions without effect get no acceleration.
pub(super) fn solve(normal: Matrix6<f64>, right: &Vector6<f64>) -> Vector6<f64> {
    /// Squared size of a motion, relative to the largest, below which it has no effect.
    const MIN_SQUARED_MOTION: f64 = 1e-12;
    // Scale to a unit diagonal: rotations and translations have different units.
    let scale =
        Vector6::from_fn(|k, _| if normal[(k, k)] > 0.0 { normal[(k, k)].sqrt().recip() } else { 0.0 });
    let scaled = Matrix6::from_fn(|a, b| scale[a] * normal[(a, b)] * scale[b]);
    let eigen = scaled.symmetric_eigen();
    let right = scale.component_mul(right);
    let largest = eigen.eigenvalues.amax();
    let mut solution = Vector6::zeros();
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > MIN_SQUARED_MOTION * largest {
            solution += vector * (vector.dot(&right) / value);
        }
    }
    scale.component_mul(&solution)
}
