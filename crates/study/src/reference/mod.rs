//! Reference body of a study: estimate of its truncation error along its motion, enrichment until this error is small,
//! and bases made of the shapes of its motion. No files.

mod compressed;
mod enrich;
mod estimate;
mod grid;
mod motion_bodies;
mod principal;
mod residual;
mod resonances;
mod truncated_equations;
mod truncated_motion;
mod truncated_responses;
mod turning_products;

pub use enrich::{Enriched, Enrichment, enrich, enrich_from, varied_errors};
pub use estimate::{CouplingEffect, MAX_REFERENCE_ERROR, PART_OF_FINE, PART_OF_REFERENCE, ReferenceError};
pub use motion_bodies::{FewestShapes, MotionBodies};
