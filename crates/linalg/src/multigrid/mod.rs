//! Approximate solution with K + tau M without a factor, by cycles of smoothed aggregation (Vanek, Mandel and Brezina,
//! Computing 56 (1996) 179). The coarser levels hold the rigid motions of groups of nodes. All numbers are in single
//! precision; the bits do not depend on the number of threads.

mod blocks;
mod coarsening;
mod corrections;
mod hierarchy;
mod level;

pub use corrections::{CorrectionTarget, DeflationSpace};
pub use hierarchy::{Levels, can_have_levels, levels};
