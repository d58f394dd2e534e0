//! Equations for the frame of a body whose motion is prescribed in part.

use crate::integration::Failure;
use nalgebra::{Const, LU, Matrix6, SMatrix, SVector, Vector6};

/// Failure for a deformation that is too large for the reference conditions to determine the frame.
pub(super) const LOST: Failure = Failure::Rates {
    reason: "the deformation is so large that the reference conditions no longer determine the frame",
};

/// Matrix for the multipliers and the motion of the frame together.
type Both = SMatrix<f64, 12, 12>;

/// Prescribed components of the frame motion, and the equations for the free ones.
#[derive(Debug, Clone)]
pub(super) struct Drive {
    /// True for each prescribed component of (V, omega).
    pub given: [bool; 6],
    /// Factor of \[E, -(B'C')'; B'C', 0\] with the rows of prescribed components replaced; `None` if
    /// rotations carry mass.
    matrix: Option<LU<f64, Const<12>, Const<12>>>,
    /// Force and torque of the prescribed motion, model axes.
    pub reaction: Vector6<f64>,
}

impl Drive {
    /// Creates the equations with E = C M^-1 C' and B'C' at a deformation.
    pub(super) fn new(answer: &Matrix6<f64>, conditions: &Matrix6<f64>, given: [bool; 6]) -> Self {
        let matrix = Some(matrix(answer, conditions, given).lu());
        Self { given, matrix, reaction: Vector6::zeros() }
    }

    /// Creates the equations of a body whose rotations carry mass.
    pub(super) fn of_turned(given: [bool; 6]) -> Self {
        Self { given, matrix: None, reaction: Vector6::zeros() }
    }

    /// Solves (6.16) for the right-hand sides of the conditions and of the momenta or, for prescribed
    /// components, of the motion.
    pub(super) fn solve(
        &self,
        conditions: &Vector6<f64>,
        frame: &Vector6<f64>,
    ) -> Result<(Vector6<f64>, Vector6<f64>), Failure> {
        let mut right = SVector::<f64, 12>::zeros();
        right.fixed_rows_mut::<6>(0).copy_from(conditions);
        right.fixed_rows_mut::<6>(6).copy_from(frame);
        let both = self.matrix.as_ref().and_then(|matrix| matrix.solve(&right)).ok_or(LOST)?;
        Ok((both.fixed_rows::<6>(0).into_owned(), both.fixed_rows::<6>(6).into_owned()))
    }
}

/// Returns \[E, -(B'C')'; B'C', 0\] with the rows of prescribed components replaced.
fn matrix(answer: &Matrix6<f64>, conditions: &Matrix6<f64>, given: [bool; 6]) -> Both {
    let mut both = Both::zeros();
    both.fixed_view_mut::<6, 6>(0, 0).copy_from(answer);
    both.fixed_view_mut::<6, 6>(0, 6).copy_from(&-conditions.transpose());
    for (k, given) in given.into_iter().enumerate() {
        if given {
            both[(6 + k, 6 + k)] = 1.0
        } else {
            both.fixed_view_mut::<1, 6>(6 + k, 0).copy_from(&conditions.row(k))
        }
    }
    both
}
