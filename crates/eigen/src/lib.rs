#![doc = include_str!("../README.md")]
#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

mod bounds;
mod canonical;
mod complement;
mod completeness;
mod corrector;
mod counters;
mod dense;
mod dynamic_response;
mod factorise;
mod failure;
mod krylov;
mod lanczos;
mod noise;
mod plan;
mod problem;
mod refine;
mod resume;
mod search_space;
mod second_shift;
mod settings;
mod single;
mod solution;
mod solve;
mod span;
mod start;
mod static_response;
mod unresisted;
mod without_factor;
mod zero_energy;

pub use canonical::{CLUSTER_GAP, canonical_basis, canonical_sign, clusters};
pub use completeness::{Completeness, Proof};
pub use counters::Counters;
pub use dynamic_response::{dynamic_responses, dynamic_responses_twice};
pub use failure::EigenFailure;
pub use noise::{energy_noise, rounding_residual};
pub use plan::{Multigrid, Plan};
pub use problem::EigenProblem;
pub use refine::{relative_residual, residual_scale};
pub use resume::{Resume, Save, Snapshot};
pub use settings::{Accuracy, EigenSettings, FactorChoice, Method, Precision, Wanted};
pub use solution::{EigenSolution, EigenvalueBounds};
pub use solve::{planned_bytes, solve};
pub use span::modes_of_span;
pub use start::{FIRST_SHIFT, SAME_EIGENVALUE};
pub use static_response::{ResponseAccuracy, static_responses, static_responses_twice};
pub use unresisted::{Unresisted, unresisted_motions};
