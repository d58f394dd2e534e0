//! The body that a study measures against: what it lacks of the model that it was made of, estimated along
//! its motion, and a body that is enriched until that no longer counts; shapes made of its motion. No files.

mod answered;
mod compressed;
mod enrich;
mod estimate;
mod grid;
mod held;
mod lack;
mod missed;
mod motion_bodies;
mod motion_shapes;
mod projected;
mod reaction;
mod residual;
mod resonance;
mod turning;

pub use enrich::{Enriched, Enrichment, enrich};
pub use estimate::{CouplingEffect, MOST_LACKING, PART_OF_FINE, PART_OF_REFERENCE, ReferenceError};
pub use motion_bodies::{Fewest, MotionBodies};
