//! Static equilibrium of the nodal deformation with the loads and the motion at a given time.

use super::equations::products;
use super::motions::{Motions, add_motion, sums};
use super::{NodalConfiguration, NodalEquations, NodalEvaluation, NodalMotion};
use crate::integration::Failure;
use flexbody_linalg::{MatrixSum, SparseLdl, larger};
use nalgebra::Matrix6;

/// Limit of the number of steps.
const MAX_STEPS: usize = 300;
/// Size of a step, relative to the largest displacement, at which the iteration ends.
const STEP_TOLERANCE: f64 = 1e-12;

/// Relative size below which steps that no longer shrink are rounding of K u.
const NEAR_ROUNDING: f64 = 1e-6;

/// Step size that counts as rounding without loads, relative to the extent of the body plus the distance
/// that it travels while it oscillates by one radian.
const STEP_ROUNDING: f64 = 1e-14;

/// Shift of K relative to the square of the first circular frequency. A step of a free body leaves one
/// tenth of the remaining distance or less.
const SHIFT: f64 = 0.1;

/// Shift for a held body, whose first frequency may be far below that of the free body: K with the
/// conditions is definite by itself.
const SHIFT_HELD: f64 = 1e-3;

/// Solver of steps x with (K + sigma M) x = M u'' + C'mu, C x = 0.
struct Steps {
    factor: SparseLdl,
    /// A = (K + sigma M)^-1 C', and (C A)^-1.
    answered: Motions,
    inverse: Matrix6<f64>,
}

impl Steps {
    /// Creates the solver with sigma = `shift`. Returns `None` if the factorisation fails, or if the
    /// conditions depend on each other.
    fn new(body: &NodalEquations<'_>, shift: f64) -> Option<Self> {
        let pencil = body.model.pencil();
        let terms = vec![(1.0, pencil.stiffness(), 1), (shift, pencil.mass(), pencil.block())];
        let factor = SparseLdl::of_sum(&MatrixSum::new(terms), &pencil)?;
        let n = body.n_rows();
        let (mut answered, mut scratch) = (vec![[0.0; 6]; n], vec![0.0; n]);
        for &motion in body.moving {
            let mut column: Vec<f64> = body.conditions.iter().map(|row| row[motion]).collect();
            factor.solve_in_place(1, &mut column, &mut scratch);
            answered.iter_mut().zip(column).for_each(|(row, value)| row[motion] = value);
        }
        let inverse = products(&body.conditions, &answered, body.moving).try_inverse()?;
        Some(Self { factor, answered, inverse })
    }

    /// Replaces the forces by the step.
    fn solve(&self, body: &NodalEquations<'_>, forces: &mut [f64], scratch: &mut [f64]) {
        self.factor.solve_in_place(1, forces, scratch);
        let mu = self.inverse * sums(&body.conditions, forces);
        add_motion(&self.answered, -1.0, &mu, forces);
    }
}

impl<'e, L: FnMut(f64, &mut NodalEvaluation<'e>)> NodalMotion<'e, L> {
    /// Returns `start` with the deformation in equilibrium at `time`: u'' = 0 with u' = 0, by steps u += x
    /// with (K + sigma M) x = M u'' + C'mu and C x = 0.
    ///
    /// * `softest`: square of the first circular frequency.
    ///
    /// # Errors
    /// [`Failure::Rates`] if there is no equilibrium: the spin removes the stiffness of some motion, or K
    /// is not positive semidefinite.
    pub fn settled(
        &mut self,
        time: f64,
        start: &NodalConfiguration,
        softest: f64,
    ) -> Result<NodalConfiguration, Failure> {
        let lost = |reason: &'static str| Failure::Rates { reason };
        let body = self.evaluation.equations;
        let shift = if body.is_held { SHIFT_HELD } else { SHIFT };
        let steps = Steps::new(body, shift * softest);
        let steps = steps.ok_or_else(|| lost("the stiffness of the nodes cannot be factored"))?;
        let n = body.n_rows();
        let (mut step, mut acceleration, mut scratch) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let mut settled = start.clone();
        settled.ud.fill(0.0);
        let least = STEP_ROUNDING * (body.length + start.velocity.norm() / softest.sqrt());
        let mut before = f64::INFINITY;
        for _ in 0..MAX_STEPS {
            let state = body
                .state(&settled)
                .map_err(|_| lost("the deformation does not fulfil the reference conditions"))?;
            // Residual M u'' with u' = 0, and the step (K + sigma M) x = M u'' + C'mu.
            self.accelerations(time, &state, &mut acceleration)?;
            body.weigh(&acceleration, &mut step);
            steps.solve(body, &mut step, &mut scratch);
            let size = |x: &[f64]| x.iter().fold(0.0, |largest: f64, x| larger(largest, x.abs()));
            if size(&step) <= least {
                return Ok(settled);
            }
            settled.u.iter_mut().zip(&step).for_each(|(u, step)| *u += step);
            // Accept a small step, or one at rounding level that no longer shrinks.
            let (size, largest) = (size(&step), size(&settled.u));
            if size <= STEP_TOLERANCE * largest || (size <= NEAR_ROUNDING * largest && size > 0.5 * before) {
                return Ok(settled);
            }
            before = size;
        }
        Err(lost("the iteration diverges under the forces on the deformed body"))
    }
}
