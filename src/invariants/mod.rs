//! Exact condensation of the nodal equations of motion: primary data, invariants, frames, lumped comparators,
//! identities. No I/O, no eigen-solver.

mod derived;
mod frame;
mod primary;

pub use frame::Frame;
pub use primary::Invariants;
