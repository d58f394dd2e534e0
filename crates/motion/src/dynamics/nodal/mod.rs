//! Unreduced equations of motion of a body in its floating frame with all nodes (theory 6.9 to 6.13): the
//! reference for every reduced equation.

mod conditions;
mod damping;
mod directors;
mod drive;
mod driven;
mod equations;
mod error;
mod evaluation;
mod inversion;
mod kinetics;
mod loads;
mod massless;
mod modes;
mod motion;
mod motions;
mod observed;
mod points;
mod reframe;
mod settled;
mod state;
mod stiff;
mod turned;
mod turned_motion;

pub use conditions::ReferenceConditions;
pub use equations::NodalEquations;
pub use error::NodalError;
pub use evaluation::NodalEvaluation;
pub use modes::NodalModes;
pub use motion::NodalMotion;
pub use points::NodalPoint;
pub use state::NodalConfiguration;
