//! From a checked model to a flexible body: bases, the condensation into invariants, lumped comparators, the
//! validated body, and its verification against the model. No files and no motion.

pub mod basis;
pub mod convert;
pub mod flex_body;
pub mod invariants;
pub(crate) mod problems;
pub mod verification;
