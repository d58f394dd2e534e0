//! Selection of the terms and modes that a body needs in a scene: norms of the terms, guaranteed bounds of the error of
//! dropping them, measured errors, and the decision.

mod bounds;
mod cases;
mod choice;
mod decisions;
mod demand;
mod dropped_terms;
mod mode_reasons;
mod norms;
mod ranking;
mod search;
mod select;
mod shapes;
mod significance;
mod situation;
mod trial;
mod variations;

pub use bounds::{
    Amplitude, Driven, ErrorBound, LoadSizes, ModalLoad, Rotation, Start, TorqueDefect, Variation,
};
pub(crate) use cases::{Case, sets_in};
pub use decisions::{DecisiveError, NOT_JUDGED};
pub use demand::{BEYOND_BAND, Participation, WantedResponses, largest_eigenvalue, participations};
pub use mode_reasons::{ErrorSource, Excitation, ModeReasons, ModeWorth};
pub use norms::Norms;
#[cfg(feature = "hdf5")]
pub(crate) use ranking::{fewest, first_of};
pub use search::most_excited_modes;
pub use select::{CaseSelection, Selection, rule_out, select, select_judged};
pub use shapes::{FixedInterfaceChoice, FixedInterfaceModes, Pool};
pub use significance::{Significance, significances};
pub use situation::{Input, Situation};
pub use trial::{ModeShare, Trial, TrialRuns};
#[cfg(feature = "hdf5")]
pub(crate) use variations::stops;
pub use variations::{EnoughParts, VariedSelection};
