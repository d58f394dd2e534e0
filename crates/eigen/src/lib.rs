#![doc = include_str!("../README.md")]
#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

mod attempts;
mod bounds;
mod canonical;
mod correction;
mod count;
mod dense;
mod failure;
mod krylov;
mod lanczos;
mod needs;
mod plan;
mod problem;
mod refine;
mod responses;
mod search;
mod settings;
mod solution;
mod solve;
mod span;

pub use attempts::{FIRST_SHIFT, SAME_EIGENVALUE};
pub use bounds::EigenvalueBounds;
pub use canonical::{CLUSTER_GAP, canonical_basis, canonical_sign, clusters};
pub use count::{Completeness, Proof};
pub use failure::EigenFailure;
pub use needs::Needs;
pub use plan::{Plan, PlannedAttempt, Way};
pub use problem::EigenProblem;
pub use refine::{
    Unresisted, energy_noise, relative_residual, residual_scale, rounding_residual, unresisted_motions,
};
pub use responses::{
    ResponseAccuracy, dynamic_responses, dynamic_responses_twice, static_responses, static_responses_twice,
};
pub use settings::{Accuracy, EigenSettings, FactorChoice, Method, Precision, Wanted};
pub use solution::EigenSolution;
pub use solve::{plan, solve};
pub use span::modes_of_span;
