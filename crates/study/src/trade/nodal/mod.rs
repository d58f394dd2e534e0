//! Motion of all nodes as the reference of a study.

mod effort;
mod reference;
mod seen;
mod staged;

pub use reference::{NodalIntegration, NodalReference};
