//! Properties of the invariants: closed forms, an independent evaluation, the nodal equations of motion,
//! covariance, frames, lumped comparators, error norms, identities.

mod acceptance;
mod alignment;
mod bodies;
mod closed_forms;
mod comparison;
mod covariance;
mod evaluation;
mod frames;
mod identities;
mod lumped;
mod modes;
