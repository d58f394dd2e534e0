//! Selection of the terms and modes that a body needs in a scene: norms of the terms, guaranteed bounds of the error of
//! dropping them, measured errors, and the decision.

mod basis;
mod bounds;
mod by_case;
mod cases;
mod decisions;
mod demand;
mod dropped_terms;
mod first_order;
mod norms;
mod participation;
mod rows;
mod search;
mod select;
mod selection_state;
mod significance;
mod situation;
mod trial;
mod variation;
mod varied;
mod warnings;

pub use basis::{BEYOND_BAND, WantedResponses, largest_eigenvalue};
pub use bounds::{Amplitude, Driven, ErrorBound, LoadSizes, ModalLoad, Start, TorqueDefect};
pub use by_case::CaseSelection;
pub use decisions::DecisiveError;
pub use norms::Norms;
pub use participation::{Participation, participations};
pub use search::most_excited_modes;
pub use select::{Selection, rule_out, select, select_judged};
pub use significance::{Significance, significances};
pub use situation::{Input, Situation};
pub use trial::{ModeShare, Trial, TrialRuns};
pub use variation::{Rotation, Variation};
pub use varied::VariedSelection;
#[cfg(feature = "hdf5")]
pub(crate) use varied::stops;
