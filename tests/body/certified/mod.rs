//! The guarantees of accuracy `certified`, tested against exact rational arithmetic.

mod arithmetic;
mod bodies;
mod eigenvalues;
mod exact;
mod invariants;
