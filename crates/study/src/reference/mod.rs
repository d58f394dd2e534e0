//! Reference body of a study: estimate of its truncation error along its motion, enrichment until this error is small,
//! and bases made of the shapes of its motion. No files.

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

pub use enrich::{Enriched, Enrichment, enrich, enrich_from, varied_errors};
pub use estimate::{CouplingEffect, MOST_LACKING, PART_OF_FINE, PART_OF_REFERENCE, ReferenceError};
pub use motion_bodies::{Fewest, MotionBodies};
