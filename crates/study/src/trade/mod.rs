//! Trade study of accuracy and cost: candidate bodies for a scene or its load cases are measured against a reference,
//! and the best is recommended.

mod candidate;
mod case;
mod conversions;
mod front;
mod nodal_reference;
mod nodal_trace;
mod progress;
mod request;
mod row;
mod study;
mod timing;

pub use candidate::{Candidate, CandidateKind, LumpedMass, Source};
pub use case::{TradeVariation, Varied, reserved};
pub use conversions::{Conversions, WantedBodies, conversions};
pub use front::{Recommendation, front};
pub use nodal_reference::{NodalIntegration, NodalReference};
pub use request::{TradeRequest, TradeStudy};
pub use row::{Failed, InCase, InVariations, Measured, Timed, TimedRun, TradeRow};
pub use study::{ReferenceChoice, ReferenceKind, Trade, TradeCase, TradeSettings, trade};
