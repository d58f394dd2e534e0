#![doc = include_str!("../README.md")]
#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

mod attempt;
mod bounds;
mod canonical;
mod completeness;
mod correction;
mod cycles;
mod dense;
mod double;
mod failure;
mod krylov;
mod lanczos;
mod needs;
mod plan;
mod problem;
mod refine;
mod responses;
mod settings;
mod shift;
mod single;
mod solution;
mod solve;
mod span;
mod zero_energy;

pub use canonical::{CLUSTER_GAP, canonical_basis, canonical_sign, clusters};
pub use completeness::{Completeness, Proof};
pub use failure::EigenFailure;
pub use needs::Needs;
pub use plan::{Plan, PlannedAttempt, Way};
pub use problem::EigenProblem;
pub use refine::{relative_residual, residual_scale};
pub use responses::{ResponseAccuracy, static_responses, static_responses_twice};
pub use responses::{dynamic_responses, dynamic_responses_twice};
pub use settings::{Accuracy, EigenSettings, FactorChoice, Method, Precision, Wanted};
pub use shift::{FIRST_SHIFT, SAME_EIGENVALUE};
pub use solution::{EigenSolution, EigenvalueBounds};
pub use solve::{plan, solve};
pub use span::modes_of_span;
pub use zero_energy::{Unresisted, unresisted_motions};
pub use zero_energy::{energy_noise, rounding_residual};
