//! Time integration of ordinary differential equations, independent of bodies.

mod explicit;
mod gauss;
mod schedule;
mod system;

pub use explicit::Explicit;
pub use gauss::{Gauss, STAGES, StageMode};
pub use schedule::{Method, ObserverEvent, integrate, integrate_closely};
pub use system::{Failure, Oscillator, System, Work, free_oscillation};
