//! The attempt with a single-precision factor: Lanczos on the operator of this factor, then corrections against the
//! true K and M in double precision until the true residuals keep the tolerance.
//!
//! The factor T of K + tau M is accurate to about 1e-7 times its condition number, so that Lanczos finds the modes to
//! 1e-2 or 1e-4. A correction T r of the residual r = K x - lambda M x, with Rayleigh-Ritz on all vectors, gains that
//! number of digits again for one solved column. Refining every solve of Lanczos would cost several columns.

use super::attempt::{Attempt, Goal};
use super::correction::{Correction, Corrector};
use super::double::DoublePrecision;
use super::failure::EigenFailure;
use super::lanczos::{Iteration, Outcome};
use super::needs::{Needs, Unusable, factor_needs};
use super::problem::Task;
use super::refine::FoundModes;
use super::settings::{Accuracy, FactorChoice, Precision};
use super::shift::with_suited_shift;
use flexbody_linalg::{Cholesky, Solve};

/// Columns per step of Lanczos: the number that the solves handle together. In single precision four columns cost as
/// much as eight.
const COLUMNS_PER_STEP: usize = 8;

/// Ritz residual at which the corrections take over: further steps find no modes that the error of the factor does not
/// hide.
const HANDOVER_RESIDUAL: f64 = 1e-4;

/// Lanczos with a factor in single precision, and corrections.
pub(super) struct SinglePrecision;

impl Attempt for SinglePrecision {
    fn needs(&self, task: &Task<'_>, wanted: usize) -> Result<Needs, Unusable> {
        let settings = task.settings;
        let pays = match settings.factor {
            _ if settings.accuracy == Accuracy::Certified => false,
            FactorChoice::Always(precision) => precision == Precision::Single,
            FactorChoice::Auto => {
                task.analysis.flops() > settings.single_pays || DoublePrecision.needs(task, wanted).is_err()
            }
        };
        if pays { factor_needs(task, wanted, Precision::Single) } else { Err(Unusable::Unsuited) }
    }

    fn search(&self, task: &Task<'_>, goal: &Goal) -> Result<FoundModes, EigenFailure> {
        let rough = Goal { tolerance: HANDOVER_RESIDUAL, ..*goal };
        with_suited_shift(task, |factor: Cholesky<'_, f32>| {
            let mut iteration =
                Iteration::begin(task.problem, &factor, &rough, COLUMNS_PER_STEP, task.context);
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
            Correction::begin(task, Corrector::Factor(factor), goal, vectors, wanted)?
                .modes()
                .map(Outcome::Reached)
        })
    }

    /// Returns false: a failure with this factor often comes from its precision, and does not concern the model.
    fn is_conclusive(&self, _: &EigenFailure) -> bool {
        false
    }
}
