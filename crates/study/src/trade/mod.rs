//! Trade study of accuracy and cost: candidate bodies for a scene or its load cases are measured against a reference,
//! and the best is recommended.

mod candidate;
mod case;
mod conversions;
mod front;
mod nodal;
mod row;
mod settings;
mod source;
mod study;
mod timing;
mod varied;

pub use candidate::{Candidate, CandidateKind, LumpedMass};
pub use conversions::{Conversions, WantedBodies, conversions};
pub use front::{Recommendation, front};
pub use nodal::{NodalIntegration, NodalReference};
pub use row::{Failed, InCase, Measured, Timed, TradeRow};
pub use settings::{TradeSettings, reserved};
pub use source::Source;
pub use study::{ReferenceChoice, ReferenceKind, Trade, TradeCase, trade};
pub use timing::TimedRun;
pub use varied::{InVariations, TradeVariation, Varied};
