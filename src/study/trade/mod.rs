//! What accuracy costs: candidate bodies for a scene, measured against a reference, and the best of them.

mod candidate;
mod conversions;
mod front;
mod nodal;
mod row;
mod source;
mod study;
mod timing;

pub use candidate::{Candidate, Kind, LumpedMass};
pub use conversions::{Conversions, conversions};
pub use front::{Recommendation, front};
pub use nodal::{Allowed, NodalIntegration, NodalReference};
pub use row::{Failed, Measured, Row, Timed};
pub use source::Source;
pub use study::{ReferenceKind, Settings, Trade, trade};
