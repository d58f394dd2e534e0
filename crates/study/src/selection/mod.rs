//! Selection of the terms and modes that a body needs in a scene: norms of the terms, guaranteed bounds of the error of
//! dropping them, measured errors, and the decision.

mod bounds;
mod cases;
mod demand;
mod dropped_terms;
mod norms;
mod search;
mod select;
mod situation;
mod trial;

pub use bounds::{
    Amplitude, Driven, ErrorBound, LoadSizes, ModalLoad, Rotation, Start, TorqueDefect, Variation,
};
#[cfg(feature = "hdf5")]
pub(crate) use cases::stops;
pub use cases::{CaseSelection, VariedSelection};
pub use demand::{BEYOND_BAND, Participation, WantedResponses, largest_eigenvalue, participations};
pub use norms::{Norms, Significance, significances};
pub use search::most_excited_modes;
pub use select::{DecisiveError, Selection, rule_out, select, select_judged};
pub use situation::{Input, Situation};
pub use trial::{ModeShare, Trial, TrialRuns};
