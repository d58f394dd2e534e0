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

#[cfg(feature = "import")]
mod audit;
mod batch;
mod body;
mod chart;
mod checks;
mod comparison;
mod document;
mod mass_properties;
mod motion;
mod notation;
mod output;
mod picture;
mod run_data;
mod study;
#[cfg(feature = "hdf5")]
mod view;

#[cfg(feature = "import")]
pub use audit::{audit_json, audit_text};
pub use batch::{BatchFacts, BatchRow};
pub use body::{Facts, dropped_text, render, summary, summary_html};
pub use checks::{checks_json, checks_text, diagnostics_json, identities_json, identities_text};
pub use comparison::{
    BodyComparison, ComparisonFormat, ComparisonReport, ComparisonRow, ModePair, Pairing, Tolerances,
    compare, compare_common,
};
pub use document::Format;
pub use document::text::Screen;
pub use motion::{
    EnvelopeFacts, EnvelopeKind, RecoveredFacts, SimulationFacts, channels_csv, read_envelope, recovered_csv,
    simulation_csv,
};
#[cfg(feature = "response")]
pub use motion::{ResponseFacts, response_csv};
pub use output::output_json;
pub use run_data::{LumpedModes, Phase, RunData, SearchAttempt};
pub use study::{AdviceFacts, MeasuredRunFacts, SelectionFacts};
#[cfg(feature = "hdf5")]
pub use study::{TradeFacts, trade_csv};
#[cfg(feature = "hdf5")]
pub use view::{Colouring, View};
