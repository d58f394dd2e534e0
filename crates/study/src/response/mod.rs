//! Frequency response of a free body: the displacement that a harmonic force causes, of the reduced body and
//! of all nodes of the model that it was made of, and how far the two are apart. No files.

mod band;
mod direct;
mod enriched;
mod errors;
mod modal_sum;
mod place;
mod study;

pub use band::{Band, Resonance, Spacing};
pub use errors::{At, Effectivity, PairErrors};
pub use place::{Direction, Place};
pub use study::{CouplingEffect, Function, Pair, Response, ResponseSettings, Solved, respond};

/// The complex numbers of a response: real part in phase with the force.
pub use nalgebra::Complex;
