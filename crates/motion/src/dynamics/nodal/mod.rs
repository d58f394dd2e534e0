//! Unreduced equations of motion of a body in its floating frame with all nodes (theory 6.9 to 6.13): the
//! reference for every reduced equation.

mod conditions;
mod directors;
mod driven;
mod equations;
mod evaluation;
mod inversion;
mod kinetics;
mod motion;
mod state;

pub use conditions::{NodalPoint, ReferenceConditions};
pub use equations::{NodalEquations, NodalError};
pub use evaluation::NodalEvaluation;
pub use motion::NodalMotion;
pub use state::{NodalConfiguration, NodalModes};
