//! The attempt with a single-precision factor: Lanczos on the operator that it makes, then corrections against the
//! true K and M in double precision until the true residuals keep the tolerance.
//!
//! The factor T of K + tau M is good to about 1e-7 times its condition, so that Lanczos finds the modes to
//! 1e-2 or 1e-4. A correction T r of the residual r = K x - lambda M x, with Rayleigh-Ritz on all that is
//! there, gains as many digits again for one solved column, where refining every solve of Lanczos would cost
//! several.

use super::attempt::{Attempt, Goal};
use super::correction::{Correction, Corrector};
use super::double::is_double_in_reach;
use super::failure::EigenFailure;
use super::lanczos::{Iteration, Outcome};
use super::needs::{Needs, Unusable, factor_needs};
use super::problem::Task;
use super::refine::FoundModes;
use super::settings::{Accuracy, FactorChoice, Precision};
use super::shift::with_suited_shift;
use flexbody_linalg::{Cholesky, Solve};

/// Columns per step of Lanczos: as many as the solves take together, since with single precision four cost
/// the same.
const BLOCK: usize = 8;

/// Ritz residual at which Lanczos hands over: more steps find no modes that the factor's error does not hide.
const HANDED_OVER: f64 = 1e-4;

/// Lanczos with a factor in single precision, and corrections.
pub(super) struct SinglePrecision;

impl Attempt for SinglePrecision {
    fn needs(&self, task: &Task<'_>, wanted: usize) -> Result<Needs, Unusable> {
        let settings = task.settings;
        let pays = match settings.factor {
            _ if settings.accuracy == Accuracy::Certified => false,
            FactorChoice::Always(precision) => precision == Precision::Single,
            FactorChoice::Auto => {
                task.analysis.flops() > settings.single_pays || !is_double_in_reach(task, wanted)
            }
        };
        if pays { factor_needs(task, wanted, Precision::Single) } else { Err(Unusable::Unsuited) }
    }

    fn search(&self, task: &Task<'_>, goal: &Goal) -> Result<FoundModes, EigenFailure> {
        let rough = Goal { tolerance: HANDED_OVER, ..*goal };
        with_suited_shift(task, |factor: Cholesky<'_, f32>| {
            let mut iteration = Iteration::begin(task.problem, &factor, (&rough, BLOCK), task.context);
            let ritz = match iteration.estimate(&factor)? {
                Outcome::Reached(ritz) => ritz,
                Outcome::ShiftTooLarge(shift) => return Ok(Outcome::ShiftTooLarge(shift)),
            };
            if iteration.is_complete() {
                return iteration.find_from(ritz, &factor);
            }
            let (vectors, wanted) = (iteration.rough_modes(&ritz), ritz.last());
            drop(iteration);
            let factor: &dyn Solve = &factor;
            Correction::begin(task, Corrector::Factor(factor), goal, (vectors, wanted))?
                .modes()
                .map(Outcome::Reached)
        })
    }

    /// A search that fails with this factor often says nothing about the model.
    fn is_conclusive(&self, _: &EigenFailure) -> bool {
        false
    }
}
