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
mod dense;
mod krylov;
mod lanczos;
mod plan;
mod problem;
mod refine;
mod responses;
mod solve;

pub use attempts::{FIRST_SHIFT, SAME_EIGENVALUE};
pub use canonical::{CLUSTER_GAP, canonical_basis, canonical_sign, clusters, modes_of_span};
pub use plan::{Needs, Plan, PlannedAttempt, Way};
pub use problem::{
    Accuracy, EigenFailure, EigenProblem, EigenSettings, EigenSolution, EigenvalueBounds, FactorChoice,
    Method, Precision, Wanted,
};
pub use refine::{
    Unresisted, energy_noise, relative_residual, residual_scale, rounding_residual, unresisted_motions,
};
pub use responses::{
    ResponseAccuracy, dynamic_responses, dynamic_responses_twice, static_responses, static_responses_twice,
};
pub use solve::{Completeness, Proof, plan, solve};
