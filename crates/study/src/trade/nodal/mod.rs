//! Motion of all nodes as the reference of a study.

mod effort;
mod nodal_trace;
mod reference;
mod setup;

pub use reference::{NodalIntegration, NodalReference};
