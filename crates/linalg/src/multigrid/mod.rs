//! Approximate solution with K + tau M without a factor, by cycles of smoothed aggregation (Vanek, Mandel and Brezina,
//! Computing 56 (1996) 179). The coarser levels hold the rigid motions of groups of nodes. All numbers are in single
//! precision; the bits do not depend on the number of threads.

mod aggregates;
mod blocks;
mod coarsening;
mod corrections;
mod deflation;
mod hierarchy;
mod level;
mod smoother;

pub use corrections::CorrectionTarget;
pub use deflation::DeflationSpace;
pub use hierarchy::{Levels, can_have_levels, levels};
