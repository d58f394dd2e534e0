//! Time integration of ordinary differential equations; knows no bodies.

mod system;

pub use system::{Failure, System};
