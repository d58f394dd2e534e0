//! Unreduced equations of motion of a body in its floating frame with all nodes (theory 6.9 to 6.13): the
//! reference for every reduced equation.

mod conditions;
mod directors;
mod drive;
mod driven;
mod equations;
mod error;
mod evaluation;
mod inversion;
mod kinetics;
mod motion;
mod state;
mod state_layout;
mod turned_evaluation;

pub use conditions::{NodalPoint, ReferenceConditions};
pub use equations::NodalEquations;
pub use error::NodalError;
pub use evaluation::NodalEvaluation;
pub use motion::NodalMotion;
pub use state::{NodalConfiguration, NodalModes};
