//! Exact condensation of the nodal equations of motion: primary data, invariants, frames, lumped comparators,
//! identities. No I/O, no eigen-solver.

mod primary;

pub use primary::Invariants;
