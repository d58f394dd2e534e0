//! The motion of all nodes as the reference.

mod effort;
mod reference;
mod seen;
mod staged;

pub use reference::{NodalIntegration, NodalReference};
