//! The deformation that stays as it is under what acts at time zero.

use super::{NodalConfiguration, NodalEvaluation, NodalMotion};
use crate::numerics::integration::Failure;
use crate::numerics::linalg::{MatrixSum, SparseLdl, larger};

/// Steps at the most, and what is near enough.
const MOST_STEPS: usize = 300;
const SETTLED: f64 = 1e-12;

/// Steps below this part that no longer shrink are rounding of K u.
const NEAR_ROUNDING: f64 = 1e-6;

/// The shift of K, relative to the square of the first circular frequency: steps leave a tenth of the way to
/// go, or less.
const SHIFT: f64 = 0.1;

impl<'e, L: FnMut(f64, &mut NodalEvaluation<'e>)> NodalMotion<'e, L> {
    /// `start` with the deformation that stays as it is under what acts at `time`: u'' = 0 with u' = 0, by
    /// u += (K + sigma M)^-1 M u''.
    ///
    /// * `softest`: square of the first circular frequency.
    ///
    /// # Errors
    /// [`Failure::Rates`] where there is none: the spin takes the stiffness of some motion, or K is not
    /// positive semidefinite.
    pub fn settled(
        &mut self,
        time: f64,
        start: &NodalConfiguration,
        softest: f64,
    ) -> Result<NodalConfiguration, Failure> {
        let lost = |reason: &'static str| Failure::Rates { reason };
        let body = self.evaluation.equations;
        let pencil = body.model.pencil();
        let terms = vec![(1.0, pencil.stiffness(), 1), (SHIFT * softest, pencil.mass(), pencil.block())];
        let factor = SparseLdl::of_sum(&MatrixSum::new(terms), &pencil);
        let factor = factor.ok_or_else(|| lost("the stiffness of the nodes cannot be factored"))?;
        let n = body.n_rows();
        let (mut step, mut acceleration, mut scratch) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let mut settled = start.clone();
        settled.ud.fill(0.0);
        let mut before = f64::INFINITY;
        for _ in 0..MOST_STEPS {
            let state = body
                .state(&settled)
                .map_err(|_| lost("the deformation does not fulfil the reference conditions"))?;
            self.accelerations(time, &state, &mut acceleration)?;
            body.weigh(&acceleration, &mut step);
            factor.solve_in_place(1, &mut step, &mut scratch);
            body.take_rigid(&mut step);
            settled.u.iter_mut().zip(&step).for_each(|(u, step)| *u += step);
            let size = |x: &[f64]| x.iter().fold(0.0, |largest: f64, x| larger(largest, x.abs()));
            let (size, largest) = (size(&step), size(&settled.u));
            if size <= SETTLED * largest || (size <= NEAR_ROUNDING * largest && size > 0.5 * before) {
                return Ok(settled);
            }
            before = size;
        }
        Err(lost("what acts on the deformed body leads away from it"))
    }
}
