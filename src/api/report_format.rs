//! Formats of reports.

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
