//! Report on recoveries over time: the largest value of each.

use super::Format;
use super::csv;
use super::document::{Block, Document, Term};
use super::numbers::{counted, significant};
use super::run_data::RunData;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::provenance::generator;
use flexbody_body::flex_body::FlexBody;
use flexbody_motion::scene::{LoadedHistory, RecoveredRows};
use serde::Serialize;

/// Facts of recoveries over time.
#[derive(Debug, Clone, Serialize)]
pub struct RecoveredFacts<'a> {
    format: &'static str,
    format_major: u8,
    format_minor: u8,
    generator: String,
    body: &'a str,
    /// File of the run.
    history: String,
    instants: usize,
    /// Unit of the times.
    time_unit: String,
    /// Interfaces that the run has loads of.
    loaded: Vec<&'a str>,
    /// Interfaces without columns of loads in the run, which count as unloaded.
    unloaded: Vec<&'a str>,
    recoveries: Vec<RecoveryFacts<'a>>,
    diagnostics: &'a [Diagnostic],
}

/// Largest value of a recovery.
#[derive(Debug, Clone, Serialize)]
struct RecoveryFacts<'a> {
    name: &'a str,
    rows: usize,
    /// Row of the largest magnitude.
    row: &'a str,
    quantity: &'static str,
    component: &'a str,
    node: Option<i64>,
    element: Option<i64>,
    value: f64,
    unit: &'a str,
    /// Instant of the largest magnitude.
    time: f64,
    /// Largest equivalent stress; `None` without points that have all six stresses.
    von_mises: Option<VonMisesFacts<'a>>,
}

/// Largest equivalent stress of von Mises of a recovery.
#[derive(Debug, Clone, Serialize)]
struct VonMisesFacts<'a> {
    points: usize,
    /// Point of the largest value.
    point: &'a str,
    value: f64,
    unit: &'a str,
    time: f64,
}

impl<'a> RecoveredFacts<'a> {
    /// Collects the facts of `recovered` rows of `body` for `history`.
    pub fn new(
        body: &'a FlexBody,
        history: &'a LoadedHistory,
        recovered: &'a [RecoveredRows<'a>],
        run: &'a RunData,
    ) -> Self {
        let facts = |one: &'a RecoveredRows<'a>| {
            let (row, at, value) = one.largest()?;
            let label = &one.recovery.rows[row];
            let von_mises = one.largest_von_mises().map(|(point, at, value)| VonMisesFacts {
                points: one.points.len(),
                point: &one.points[point].name,
                value,
                unit: &one.points[point].unit,
                time: history.time[at],
            });
            Some(RecoveryFacts {
                name: &one.recovery.name,
                rows: one.recovery.rows.len(),
                row: &label.name,
                quantity: label.quantity.name(),
                component: &label.component,
                node: label.node,
                element: label.element,
                value,
                unit: &label.unit,
                time: history.time[at],
                von_mises,
            })
        };
        Self {
            format: "flexbody-recovered",
            format_major: 1,
            format_minor: 0,
            generator: generator(),
            body: &body.source().name,
            history: history.path.display().to_string(),
            instants: history.time.len(),
            time_unit: body.units().time.name().to_owned(),
            loaded: history.loads.iter().map(|load| load.interface.as_str()).collect(),
            unloaded: history.unloaded(body),
            recoveries: recovered.iter().filter_map(facts).collect(),
            diagnostics: &run.diagnostics,
        }
    }

    /// Renders the facts in a format, ending with a line break.
    pub fn render(&self, format: Format) -> String {
        Document::render(self, format, || self.document())
    }

    fn document(&self) -> Document<'_> {
        let run = format!("{}, {}", self.history, counted(self.instants, "instant"));
        let names = |names: &[&str]| if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        let mut terms = vec![Term::text("Body", self.body), Term::new("Run", run)];
        if !(self.loaded.is_empty() && self.unloaded.is_empty()) {
            terms.push(Term::new("Loads at", names(&self.loaded)));
        }
        if !self.unloaded.is_empty() {
            let words = format!("{}: the table has no columns of their loads", names(&self.unloaded));
            terms.push(Term::new("Unloaded", words));
        }
        let recovery = |one: &RecoveryFacts<'_>| {
            Term::new("Recovery", format!("{}: {}", one.name, self.largest_in_words(one)))
        };
        terms.extend(self.recoveries.iter().map(recovery));
        let blocks = vec![Block::Terms(terms), Block::Diagnostics(self.diagnostics)];
        Document { name: self.body, kind: "Recovery", generator: &self.generator, blocks }
    }

    /// Returns the largest value in words: `90 rows, largest: 12.3 MPa, row s7 (stress xx), at 0.2 s`.
    fn largest_in_words(&self, one: &RecoveryFacts<'_>) -> String {
        let largest = |value: f64, unit: &str, place: &str, time: f64| {
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            let (value, time) = (significant(value, 5), significant(time, 6));
            format!("largest: {value}{unit}, {place}, at {time} {}", self.time_unit)
        };
        let row = format!("row {} ({} {})", one.row, one.quantity, one.component);
        let rows = format!("{}, {}", counted(one.rows, "row"), largest(one.value, one.unit, &row, one.time));
        let von_mises = one.von_mises.as_ref().map_or_else(String::new, |own| {
            let words = largest(own.value, own.unit, own.point, own.time);
            format!("; von Mises of {}, {words}", counted(own.points, "point"))
        });
        rows + &von_mises
    }
}

/// Returns recoveries over time as comma-separated values: the time, then for every recovery a column `RECOVERY ROW` for
/// every row and a column `RECOVERY POINT von Mises` for every point with all six stresses; numbers round-trip.
pub fn recovered_csv(history: &LoadedHistory, recovered: &[RecoveredRows<'_>]) -> String {
    let name = |one: &RecoveredRows<'_>| -> Vec<String> {
        let rows = one.recovery.rows.iter().map(|row| row.name.clone());
        let points = one.points.iter().map(|point| format!("{} von Mises", point.name));
        rows.chain(points).map(|own| csv::text(&format!("{} {own}", one.recovery.name))).collect()
    };
    let mut table = String::new();
    csv::push_row(&mut table, std::iter::once("time".to_owned()).chain(recovered.iter().flat_map(name)));
    for (i, time) in history.time.iter().enumerate() {
        let values = recovered.iter().flat_map(|one| one.values[i].iter().copied().chain(one.von_mises(i)));
        csv::push_row(&mut table, std::iter::once(*time).chain(values).map(csv::number));
    }
    table
}
