//! Reports: facts computed once and rendered as text, JSON and HTML. Covers bodies, the comparison of two
//! bodies, simulations, selections, trade studies, frequency responses, audits, and the page that shows a
//! body in motion.

#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

mod advice;
mod batch;
mod body;
mod chart;
mod checks;
mod comparison;
mod document;
mod envelope;
mod errors;
mod mass_properties;
mod measured_run;
mod notation;
mod output;
mod picture;
mod random;
mod recovered;
mod response;
mod run_data;
mod selection;
mod selection_verdict;
mod simulation;
#[cfg(feature = "hdf5")]
mod trade;
#[cfg(feature = "hdf5")]
mod trade_verdict;
#[cfg(feature = "hdf5")]
mod view;

pub use advice::AdviceFacts;
pub use batch::{BatchFacts, BatchRow};
pub use body::{Facts, dropped_text, render, summary, summary_html};
pub use checks::{
    audit_json, audit_text, checks_json, checks_text, diagnostics_json, identities_json, identities_text,
};
pub use comparison::{
    BodyComparison, ComparisonFormat, ComparisonReport, ComparisonRow, ModePair, Pairing, Tolerances,
    compare, compare_common,
};
pub use document::Format;
pub use document::text::Screen;
pub use envelope::{EnvelopeFacts, EnvelopeKind, read_envelope};
pub use measured_run::MeasuredRunFacts;
pub use output::output_json;
pub use recovered::{RecoveredFacts, channels_csv, recovered_csv};
pub use response::{ResponseFacts, response_csv};
pub use run_data::{LumpedModes, Phase, RunData, SearchAttempt};
pub use selection::SelectionFacts;
pub use simulation::{SimulationFacts, simulation_csv};
#[cfg(feature = "hdf5")]
pub use trade::{TradeFacts, trade_csv};
#[cfg(feature = "hdf5")]
pub use view::{Colouring, View};
