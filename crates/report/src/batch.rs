//! Report on all bodies of a batch: text, JSON and HTML.

use crate::document::{Block, Document, Format, Inline, Table, cells, heading};
use crate::notation::numbers::frequency_range;
use flexbody_base::provenance::generator;
use serde::Serialize;
use serde_json::Value;

/// One body of a batch.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BatchRow {
    /// Output file of the conversion, written or not.
    pub output: String,
    /// State of the body: `done`, `unchanged` (made by an earlier run) or `failed`.
    pub state: &'static str,
    /// Exit code of the conversion.
    pub exit_code: i32,
    /// First error of the conversion; `None` without errors.
    pub error: Option<String>,
    /// Number of warnings.
    pub warnings: u64,
    /// Memory reserved for the conversion. Unit: bytes.
    pub memory_estimate_bytes: u64,
    /// Largest resident memory of the conversion. Unit: bytes.
    pub peak_memory_bytes: Option<u64>,
    /// Wall time of the conversion. Unit: s.
    pub seconds: f64,
    /// Number of degrees of freedom.
    pub n_dofs: Option<u64>,
    /// Number of modes.
    pub modes: Option<u64>,
    /// First and last frequency in hertz.
    pub frequencies_hz: Option<[f64; 2]>,
    /// Sentence about the completeness of the modes.
    pub complete: Option<String>,
}

impl BatchRow {
    /// Fills the row from the JSON output of a conversion.
    pub fn read(&mut self, json: &Value) {
        let results = &json["results"];
        let frequencies: Vec<f64> = results["modes"]["frequency_hz"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(Value::as_f64)
            .collect();
        self.warnings = json["warnings"].as_u64().unwrap_or(0);
        self.n_dofs = results["model"]["n_dofs"].as_u64();
        self.modes = results["modes"]["count"].as_u64();
        self.frequencies_hz =
            frequencies.first().zip(frequencies.last()).map(|(first, last)| [*first, *last]);
        self.complete = results["completeness"]["sentence"].as_str().map(str::to_owned);
        self.peak_memory_bytes = results["run"]["peak_memory_bytes"].as_u64();
        let first = json["diagnostics"].as_array().into_iter().flatten().find(|d| d["severity"] == "error");
        self.error = first.map(|d| {
            let word = |key: &str| d[key].as_str().unwrap_or_default().to_owned();
            format!("{} {}", word("code"), word("message"))
        });
    }
}

/// Facts of a batch.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BatchFacts {
    format: &'static str,
    format_major: u32,
    format_minor: u32,
    generator: String,
    list: String,
    memory_bytes: u64,
    parallel: usize,
    failed: usize,
    bodies: Vec<BatchRow>,
}

impl BatchFacts {
    /// Collects the facts of the bodies of a list, in the order of the list.
    pub fn new(list: String, memory_bytes: u64, parallel: usize, bodies: Vec<BatchRow>) -> Self {
        let failed = bodies.iter().filter(|row| row.state == "failed").count();
        let (format, generator) = ("flexbody-batch", generator());
        Self {
            format,
            format_major: 1,
            format_minor: 0,
            generator,
            list,
            memory_bytes,
            parallel,
            failed,
            bodies,
        }
    }

    /// Returns the number of bodies that failed.
    pub fn failed(&self) -> usize {
        self.failed
    }

    /// Returns the bodies, in the order of the list.
    pub fn bodies(&self) -> &[BatchRow] {
        &self.bodies
    }

    /// Renders the facts in a format, ending with a line break.
    pub fn render(&self, format: Format) -> String {
        Document::render(self, format, || self.document())
    }

    fn document(&self) -> Document<'_> {
        let all = self.bodies.len();
        let (caption, end) = match self.failed {
            0 => (format!("All {all} bodies were converted"), format!("all {all} bodies were converted")),
            failed => {
                (format!("{failed} of {all} bodies failed"), format!("{failed} of {all} bodies FAILED"))
            }
        };
        let heads = [
            "Body",
            "State",
            "DOF",
            "Modes",
            "Frequencies",
            "Seconds",
            "GB reserved",
            "GB used",
            "Completeness of the modes, or reason of the failure",
        ];
        let rows = self.bodies.iter().map(BatchRow::cells).collect();
        let last = heads.len() - 1;
        let table = Table::new(caption, heads, &[0, 1, last], rows).in_text(|head| head != heads[last]);
        let table = Table { below: Some(last), ..table };
        let blocks = vec![heading("Bodies"), Block::Table(table), Block::Line(end)];
        Document { name: &self.list, kind: "Batch report", generator: &self.generator, blocks }
    }
}

impl BatchRow {
    fn cells(&self) -> Vec<Inline> {
        let none = || "-".to_owned();
        let number = |n: Option<u64>| n.map_or_else(none, |n| n.to_string());
        let gigabytes = |bytes: Option<u64>| bytes.map_or_else(none, |b| format!("{:.2}", b as f64 * 1e-9));
        cells([
            self.output.clone(),
            self.state.to_owned(),
            number(self.n_dofs),
            number(self.modes),
            self.frequencies_hz.map_or_else(none, |ends| frequency_range(ends, 5)),
            format!("{:.1}", self.seconds),
            gigabytes(Some(self.memory_estimate_bytes)),
            gigabytes(self.peak_memory_bytes),
            self.error.clone().or_else(|| self.complete.clone()).unwrap_or_default(),
        ])
    }
}
