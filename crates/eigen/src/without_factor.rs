//! Modes without a factor: rough ones of a coarse level, corrected by cycles over levels of groups of nodes
//! until their true residuals keep the tolerance. For compact bodies, whose factor is what takes the time and
//! the memory.

use super::corrector::Corrector;
use super::counters::Counters;
use super::failure::EigenFailure;
use super::lanczos::Goal;
use super::problem::EigenProblem;
use super::refine::FoundModes;
use super::single::Correction;
use super::start::first_shift;
use flexbody_linalg::multigrid::levels;
use flexbody_linalg::progress::{Event, Watch};

/// Vectors beside the wanted modes. Hexahedral cubes of 100,000 and 300,000 rows take 285 solved columns for
/// 20 modes with 8 of them, 258 with 16, 233 with 24, and the least time with 16.
pub(super) fn guards(wanted: usize) -> usize {
    8 + 2 * wanted / 5
}

/// Searches the lowest modes, or returns the reason why cycles do not find them.
pub(super) fn search(
    problem: &EigenProblem<'_>,
    goal: &Goal,
    watch: Watch<'_>,
    counters: &mut Counters,
) -> Result<FoundModes, EigenFailure> {
    watch(Event::Phase("multigrid"));
    let pencil = &problem.pencil;
    let tau = first_shift(problem, None);
    let unsuited = || EigenFailure::NotConverged { converged: 0, wanted: goal.wanted };
    let levels = levels(pencil, problem.rigid, tau).ok_or_else(unsuited)?;
    watch(Event::Phase("modes"));
    let count = goal.wanted + guards(goal.wanted);
    let rough = levels.rough_modes(count).ok_or_else(unsuited)?;
    if rough.ncols() <= goal.wanted {
        return Err(unsuited());
    }
    let corrector = Corrector::Levels(&*levels);
    let correction = Correction::begin(problem, corrector, goal, rough, goal.wanted, watch, counters)?;
    let (refined, next) = correction.run(counters)?;
    Ok(FoundModes { refined, next, tau })
}
