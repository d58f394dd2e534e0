//! All bodies of a batch in one report: text, JSON and HTML.

use super::markup::{escape, page, section, table};
use super::numbers::significant;
use super::render::{Format, json};
use flexbody_base::provenance::generator;
use serde::Serialize;
use serde_json::Value;
use std::fmt::Write;

/// One body of a batch.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BatchRow {
    /// File that was written, or was to be.
    pub output: String,
    /// `done`, `unchanged` (made by an earlier run) or `failed`.
    pub state: &'static str,
    /// Exit code of its conversion.
    pub exit_code: i32,
    /// First error, where there is one.
    pub error: Option<String>,
    /// Number of warnings.
    pub warnings: u64,
    /// Bytes that were set aside for it.
    pub memory_estimate_bytes: u64,
    /// Largest resident memory of its conversion.
    pub peak_memory_bytes: Option<u64>,
    /// Seconds of its conversion.
    pub seconds: f64,
    /// Degrees of freedom.
    pub n_dofs: Option<u64>,
    /// Number of modes.
    pub modes: Option<u64>,
    /// First and last frequency in hertz.
    pub frequencies_hz: Option<[f64; 2]>,
    /// The sentence about completeness.
    pub complete: Option<String>,
}

impl BatchRow {
    /// What the JSON of a conversion says of its body.
    pub fn read(&mut self, told: &Value) {
        let results = &told["results"];
        let frequencies: Vec<f64> = results["modes"]["frequency_hz"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(Value::as_f64)
            .collect();
        self.warnings = told["warnings"].as_u64().unwrap_or(0);
        self.n_dofs = results["model"]["n_dofs"].as_u64();
        self.modes = results["modes"]["count"].as_u64();
        self.frequencies_hz =
            frequencies.first().zip(frequencies.last()).map(|(first, last)| [*first, *last]);
        self.complete = results["completeness"]["sentence"].as_str().map(str::to_owned);
        self.peak_memory_bytes = results["run"]["peak_memory_bytes"].as_u64();
        let first = told["diagnostics"].as_array().into_iter().flatten().find(|d| d["severity"] == "error");
        self.error = first.map(|d| {
            let word = |key: &str| d[key].as_str().unwrap_or_default().to_owned();
            format!("{} {}", word("code"), word("message"))
        });
    }
}

/// A batch.
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
    /// Of the bodies of a list, in its order.
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

    /// How many bodies failed.
    pub fn failed(&self) -> usize {
        self.failed
    }

    /// In a format.
    pub fn render(&self, format: Format) -> String {
        match format {
            Format::Json => json(self),
            Format::Text => self.text(),
            Format::Html => self.html(),
        }
    }

    fn cells(row: &BatchRow) -> [String; 8] {
        let number = |n: Option<u64>| n.map_or_else(|| "-".to_owned(), |n| n.to_string());
        let gigabytes =
            |bytes: Option<u64>| bytes.map_or("-".to_owned(), |b| format!("{:.2}", b as f64 * 1e-9));
        let hertz = row.frequencies_hz.map_or_else(
            || "-".to_owned(),
            |[first, last]| format!("{} to {}", significant(first, 5), significant(last, 5)),
        );
        [
            row.output.clone(),
            row.state.to_owned(),
            number(row.n_dofs),
            number(row.modes),
            hertz,
            format!("{:.1}", row.seconds),
            gigabytes(Some(row.memory_estimate_bytes)),
            gigabytes(row.peak_memory_bytes),
        ]
    }

    fn text(&self) -> String {
        let mut text = format!(
            "{:32} {:9} {:>9} {:>5} {:>22} {:>8} {:>7} {:>7}\n",
            "body", "state", "dofs", "modes", "Hz", "s", "set GB", "peak GB"
        );
        for row in &self.bodies {
            let [output, state, dofs, modes, hertz, seconds, set, peak] = Self::cells(row);
            let _ = writeln!(
                text,
                "{output:32} {state:9} {dofs:>9} {modes:>5} {hertz:>22} {seconds:>8} {set:>7} {peak:>7}"
            );
            let told = row.error.as_ref().or(row.complete.as_ref());
            let _ = told.map(|told| writeln!(text, "    {told}"));
        }
        let _ = match self.failed {
            0 => writeln!(text, "all {} bodies are there", self.bodies.len()),
            failed => writeln!(text, "{failed} of {} bodies FAILED", self.bodies.len()),
        };
        text
    }

    fn html(&self) -> String {
        let mut html = String::new();
        section(&mut html, "Bodies");
        let head = [
            "Body",
            "State",
            "DOF",
            "Modes",
            "Hz",
            "Seconds",
            "GB set aside",
            "GB used",
            "Modes complete, or why not there",
        ];
        let head = head.map(str::to_owned);
        let rows: Vec<Vec<String>> = self
            .bodies
            .iter()
            .map(|row| {
                let told = row.error.clone().or_else(|| row.complete.clone()).unwrap_or_default();
                Self::cells(row).iter().chain([&told]).map(|cell| escape(cell)).collect()
            })
            .collect();
        let caption = match self.failed {
            0 => format!("All {} bodies are there", self.bodies.len()),
            failed => format!("{failed} of {} bodies failed", self.bodies.len()),
        };
        table(&mut html, &caption, &head, &[1, 8], &rows);
        page(&self.list, "Batch report", &self.generator, &html)
    }
}
