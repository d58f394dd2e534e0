//! Frequency response of a free body: the displacement caused by a harmonic force, of the reduced body and of all nodes
//! of its model, and the difference of the two. No files.

mod band;
mod densities;
mod direct;
mod ends;
mod errors;
mod framed_body;
mod modal_sum;
mod model_response;
mod place;
mod random;
mod request;
mod settings;
mod study;

pub use band::{Band, Resonance, Spacing};
pub use ends::{Excitation, Output, ResponseEnds, Target};
pub use errors::{At, Effectivity, PairErrors};
/// Complex number of a response; the real part is in phase with the force.
pub use nalgebra::Complex;
pub use place::{Direction, Place};
pub use random::{RandomErrors, RandomRecovery, RandomResponse, RandomValue};
pub use request::{Responded, ResponseRequest};
pub use settings::ResponseSettings;
pub use study::{CouplingEffect, Function, Pair, Response, Solved, respond};
