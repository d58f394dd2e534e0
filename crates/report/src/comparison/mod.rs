//! Comparison of two bodies that does not depend on the signs of modes, the basis inside repeated
//! eigenvalues, the order of the nodes or the body frame.

mod body_comparison;
mod common_modes;
mod comparable;
mod compare;
mod entries;
mod groups;
mod invariants;
mod mass;
mod modal_rows;
mod mode_pair;
mod modes;
mod named_loads;
mod pair;
mod recoveries;
mod relative_difference;
mod report;
mod shapes;
mod tolerances;

pub use body_comparison::{BodyComparison, ComparisonRow};
pub use compare::{compare, compare_common};
pub use mode_pair::{ModePair, Pairing};
pub use report::{ComparisonFormat, ComparisonReport};
pub use tolerances::Tolerances;
