//! Time integration of ordinary differential equations, independent of bodies.

mod adaptive;
mod explicit;
mod exponential;
mod gauss;
mod schedule;
mod stages;
mod system;

pub use adaptive::Adaptive;
pub use explicit::Explicit;
pub use gauss::Gauss;
pub use schedule::{Method, ObserverEvent, integrate, integrate_closely};
pub use stages::{STAGES, StageMode};
pub use system::{Failure, Oscillator, System, Work, free_oscillation};
