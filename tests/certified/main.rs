//! The guarantees of accuracy `certified`, tested against exact rational arithmetic.

#[path = "../support/mod.rs"]
mod support;

use support::random;

mod arithmetic;
mod bodies;
mod eigenvalues;
mod exact;
mod invariants;
