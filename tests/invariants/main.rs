//! Properties of the invariants: closed forms, an independent evaluation, the nodal equations of motion, covariance,
//! frames, lumped comparators, error norms, identities.

#[path = "../support/cuboid.rs"]
mod cuboid;
#[path = "../support/equations.rs"]
#[allow(dead_code)] // shared with other tests
mod equations;
#[path = "../support/models.rs"]
mod models;
#[path = "../support/nodal.rs"]
mod nodal;
#[path = "../support/random.rs"]
#[allow(dead_code)] // shared with other tests
mod random;

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
