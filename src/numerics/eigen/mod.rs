//! Free modes of K psi = lambda M psi: shift-invert block Lanczos or a dense solve, both followed by the same
//! refinement, canonical form and completeness count. Sees operators, never nodes or files.

mod bounds;
mod canonical;
mod completeness;
mod dense;
mod krylov;
mod lanczos;
mod noise;
mod plan;
mod problem;
mod refine;
mod single;
mod solve;
mod span;
mod start;
mod static_response;

pub use canonical::{canonical_basis, clusters};
pub use completeness::{Completeness, Proof};
pub use noise::{energy_noise, rounding_residual};
pub use plan::{FactorChoice, Plan, Precision};
pub use problem::{
    Accuracy, Counters, EigenFailure, EigenProblem, EigenSettings, EigenSolution, EigenvalueBounds, Method,
    Wanted,
};
pub use refine::{relative_residual, residual_scale};
pub use solve::solve;
pub use span::modes_of_span;
pub use start::{Resume, Save, Snapshot};
pub use static_response::{static_responses, static_responses_twice};
