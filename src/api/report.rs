//! Reports in the formats of the commands.

use super::{FlexBody, Motion, Selection};
use flexbody_report::{Facts, RunData, SelectionFacts, SimulationFacts, simulation_csv};

/// Format of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ReportFormat {
    /// JSON for programs; the schemas are in `schemas/`. Floats round-trip.
    Json,
    /// Text for a terminal, at most 80 columns wide.
    Text,
    /// HTML page with plots, which loads nothing from elsewhere.
    Html,
}

impl ReportFormat {
    pub(super) fn inner(self) -> flexbody_report::Format {
        match self {
            Self::Json => flexbody_report::Format::Json,
            Self::Text => flexbody_report::Format::Text,
            Self::Html => flexbody_report::Format::Html,
        }
    }
}

/// Returns the run data of a report: the `diagnostics`, without times and memory.
pub(super) fn run(diagnostics: &[flexbody_base::diagnostic::Diagnostic]) -> RunData {
    RunData { diagnostics: diagnostics.to_vec(), ..RunData::default() }
}

impl FlexBody {
    /// Returns the report of `flexbody inspect`.
    pub fn report(&self, format: ReportFormat) -> String {
        flexbody_report::render(&Facts::new(&self.0, &RunData::default()), format.inner())
    }

    /// Returns the summary of `flexbody inspect` as a fragment of an HTML page, without scripts and styles.
    pub fn summary_html(&self) -> String {
        flexbody_report::summary_html(&Facts::new(&self.0, &RunData::default()))
    }
}

impl Selection {
    /// Returns the report of `flexbody select`.
    pub fn report(&self, format: ReportFormat) -> String {
        SelectionFacts::new(&self.inner, &run(self.diagnostics())).render(format.inner())
    }
}

impl Motion {
    /// Returns the report of `flexbody simulate`.
    pub fn report(&self, format: ReportFormat) -> String {
        let run = run(self.diagnostics());
        SimulationFacts::new(&self.recording, &self.units, &run).render(format.inner())
    }

    /// Returns the table of `flexbody simulate --csv`: one line per instant.
    pub fn csv(&self) -> String {
        simulation_csv(&self.recording)
    }
}
