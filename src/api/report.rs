//! Reports in the formats of the commands.

use super::report_format::ReportFormat;
use super::{FlexBody, Motion, Selection};
use flexbody_report::{Facts, RunData, SelectionFacts, SimulationFacts, simulation_csv};

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
