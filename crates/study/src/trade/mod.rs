//! What accuracy costs: candidate bodies for a scene or its load cases, measured against a reference, and the best of them.

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

pub use candidate::{Candidate, CandidateKind, LumpedMass};
pub use conversions::{Conversions, WantedBodies, conversions};
pub use front::{Recommendation, front};
pub use nodal::{NodalIntegration, NodalReference};
pub use row::{Failed, InCase, Measured, Timed, TradeRow};
pub use settings::{TradeSettings, reserved};
pub use source::Source;
pub use study::{ReferenceChoice, ReferenceKind, Trade, TradeCase, trade};
