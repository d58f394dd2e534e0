//! The attempt without a factor: rough modes of a coarse level, corrected by cycles over levels of groups of nodes
//! until their true residuals keep the tolerance. It suits compact bodies, whose factor would take most of the time and
//! of the memory.

use super::attempt::{Attempt, Goal};
use super::correction::{Correction, Corrector, capacity_with_levels};
use super::failure::EigenFailure;
use super::needs::{Needs, Unusable, made_of_modes, resident, search_seconds};
use super::problem::Task;
use super::refine::FoundModes;
use super::settings::{Accuracy, FactorChoice, Method, Wanted};
use super::shift::first_shift;
use flexbody_linalg::multigrid::{can_have_levels, levels};

/// Largest number of modes that are searched for without a factor. With more, the products of all pairs of vectors take
/// longer than the solutions.
const MAX_MULTIGRID_MODES: usize = 100;

/// Bytes of all levels and of their construction per stored entry of K. Together with [`LEVEL_BYTES_PER_ROW`], a larger
/// value refuses cycles for models that would fit the memory.
const LEVEL_BYTES_PER_ENTRY: u64 = 12;

/// Bytes of all levels and of their construction per row of K, in addition to those of the entries.
const LEVEL_BYTES_PER_ROW: u64 = 400;

/// Approximate number of entries in a row of K of linear hexahedra.
const LINEAR_HEXAHEDRON_ROW_ENTRIES: f64 = 64.0;

/// Largest factor by which the stronger coupling of second-order elements raises the threshold, beside the coupling
/// itself. Hexahedra of second order have not been measured beyond it.
const MAX_THRESHOLD_FACTOR: f64 = 2.1;

/// Number of modes up to which the threshold is that of the settings. More modes raise the threshold: corrections take
/// more time the more modes they must be orthogonal to, while a factor is computed once. (Measured: equal times with 35
/// modes of a bar of 100,000 rows, with 80 of a cube, whose factor takes three times the operations.)
const UNRAISED_MODES: f64 = 28.0;

/// Cycles over levels of groups of nodes, without a factor.
pub(super) struct Cycles;

impl Attempt for Cycles {
    fn needs(&self, task: &Task<'_>, wanted: usize) -> Result<Needs, Unusable> {
        if !saves_time(task, wanted) {
            return Err(Unusable::Unsuited);
        }
        let pencil = &task.problem.pencil;
        let (n, entries) = (pencil.n(), pencil.stiffness().as_csc().nnz() as u64);
        let levels = LEVEL_BYTES_PER_ENTRY * entries + LEVEL_BYTES_PER_ROW * n as u64;
        let needed = (levels + vector_bytes(n, wanted)).max(made_of_modes(n, wanted));
        if resident(needed) > task.context.available() {
            return Err(Unusable::Unsuited);
        }
        // Solutions are estimated like those with a factor of the size of K.
        let seconds = search_seconds(n, wanted, entries);
        Ok(Needs { bytes: resident(needed), factor_bytes: 0, seconds })
    }

    fn search(&self, task: &Task<'_>, goal: &Goal) -> Result<FoundModes, EigenFailure> {
        let Task { problem, context, .. } = task;
        context.phase("multigrid");
        let unsuited = || EigenFailure::NotConverged { converged: 0, wanted: goal.wanted };
        let levels = levels(&problem.pencil, problem.rigid, first_shift(problem)).ok_or_else(unsuited)?;
        context.phase("modes");
        let rough = levels.rough_modes(goal.wanted + guards(goal.wanted)).ok_or_else(unsuited)?;
        if rough.ncols() <= goal.wanted {
            return Err(unsuited());
        }
        Correction::begin(task, Corrector::Levels(&*levels), goal, rough, goal.wanted)?.modes()
    }

    /// Returns false: a failure of cycles does not concern the model, and another attempt may succeed.
    fn is_conclusive(&self, _: &EigenFailure) -> bool {
        false
    }
}

/// Returns the number of vectors beside the wanted modes. Hexahedral cubes of 100,000 and 300,000 rows take 285 solved
/// columns for 20 modes with 8 of them, 258 with 16, 233 with 24, and the least time with 16.
fn guards(wanted: usize) -> usize {
    8 + 2 * wanted / 5
}

/// Returns true when cycles take less time than a factor.
fn saves_time(task: &Task<'_>, wanted: usize) -> bool {
    let Task { problem, settings, analysis, .. } = task;
    let entries = problem.pencil.stiffness().as_csc().nnz() as f64;
    // Elements of the second order couple more rows, and take more cycles. (Measured: tetrahedra of 100,000 rows, which
    // couple a quarter more, take twice the time of a factor.)
    let coupled = (entries / (problem.pencil.n() as f64 * LINEAR_HEXAHEDRON_ROW_ENTRIES)).max(1.0);
    let many = (wanted as f64 / UNRAISED_MODES).max(1.0);
    let threshold = settings.multigrid_pays * many * coupled * coupled.powi(2).min(MAX_THRESHOLD_FACTOR);
    settings.accuracy != Accuracy::Certified
        && settings.factor == FactorChoice::Auto
        && settings.method == Method::Auto
        && matches!(settings.wanted, Wanted::Lowest(_))
        && can_have_levels(&problem.pencil, problem.rigid.ncols())
        && (1..=MAX_MULTIGRID_MODES).contains(&wanted)
        && analysis.flops() > threshold * entries
}

/// Returns the bytes of the vectors: the span with its products with K and M; and for each vector of the start a
/// product, a force, a correction, and the copies in single precision that cycles use. All other memory of cycles is
/// less than what was in use before and has been released.
fn vector_bytes(n: usize, wanted: usize) -> u64 {
    let base = wanted + guards(wanted);
    8 * (n * (3 * capacity_with_levels(base) + 4 * base)) as u64
}
