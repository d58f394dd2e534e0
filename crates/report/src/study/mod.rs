//! Reports of studies: advice, selections, trade studies, runs measured against a reference.

mod advice;
mod errors;
#[cfg(feature = "hdf5")]
mod integration;
mod measured_run;
mod selection;
mod selection_verdict;
#[cfg(feature = "hdf5")]
mod trade;
#[cfg(feature = "hdf5")]
mod trade_cases;
#[cfg(feature = "hdf5")]
mod trade_verdict;

pub use advice::AdviceFacts;
pub use measured_run::MeasuredRunFacts;
pub use selection::SelectionFacts;
#[cfg(feature = "hdf5")]
pub use trade::{TradeFacts, trade_csv};
