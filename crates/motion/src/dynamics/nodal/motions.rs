//! Motions of the frame, on the rows of a model.

use nalgebra::{Vector3, Vector6};

/// Six numbers per row, one for each rigid motion; zero for motions that a plane body does not have.
pub(super) type Motions = Vec<[f64; 6]>;

/// Returns the sums over all rows of `motions` times x.
pub(super) fn sums(motions: &Motions, x: &[f64]) -> Vector6<f64> {
    let mut sum = [0.0; 6];
    for (motion, x) in motions.iter().zip(x) {
        sum.iter_mut().zip(motion).for_each(|(sum, motion)| *sum += motion * x);
    }
    sum.into()
}

/// Computes x += factor (motions) nu.
pub(super) fn add_motion(motions: &[[f64; 6]], factor: f64, nu: &Vector6<f64>, x: &mut [f64]) {
    let nu: [f64; 6] = (nu * factor).into();
    for (x, motion) in x.iter_mut().zip(motions) {
        *x += motion.iter().zip(&nu).map(|(motion, nu)| motion * nu).sum::<f64>();
    }
}

/// Returns a linear and an angular part as one vector.
pub(super) fn joined(linear: &Vector3<f64>, angular: &Vector3<f64>) -> Vector6<f64> {
    Vector6::from_iterator(linear.iter().chain(angular).copied())
}

/// Returns the linear and the angular part.
pub(super) fn halves(both: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (both.fixed_rows::<3>(0).into_owned(), both.fixed_rows::<3>(3).into_owned())
}
