//! Report on recoveries over time: the largest value of each.

use crate::document::{Block, Document, Format, Term};
use crate::notation::csv;
use crate::notation::numbers::{counted, significant};
use crate::run_data::RunData;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::provenance::generator;
use flexbody_body::flex_body::{FlexBody, Quantity, RecoveryRow};
use flexbody_motion::scene::{
    Channels, LoadedHistory, RecoveredMotion, RowExtreme, RowExtremes, RowMap, StressPoint,
};
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

/// Largest values of a recovery.
#[derive(Debug, Clone, Serialize)]
pub(super) struct RecoveryFacts<'a> {
    name: &'a str,
    /// Number of all rows.
    rows: usize,
    /// Largest row of the quantity and unit of the first row.
    #[serde(flatten)]
    first: LargestRow<'a>,
    /// Largest row of every further quantity and unit.
    others: Vec<LargestRow<'a>>,
    /// Largest equivalent stress; `None` without points that have all six stresses.
    von_mises: Option<PointFacts<'a>>,
    /// Largest principal stress; `None` if none is positive.
    tension: Option<PointFacts<'a>>,
    /// Smallest principal stress; `None` if none is negative.
    compression: Option<PointFacts<'a>>,
}

/// Row of the largest magnitude among the rows of one quantity and unit.
#[derive(Debug, Clone, Serialize)]
struct LargestRow<'a> {
    row: &'a str,
    quantity: &'static str,
    component: &'a str,
    node: Option<i64>,
    element: Option<i64>,
    value: f64,
    unit: &'a str,
    /// Instant of the largest magnitude.
    time: f64,
    /// Number of rows of this quantity and unit.
    #[serde(skip)]
    among: usize,
}

/// Largest stress measure of a recovery.
#[derive(Debug, Clone, Serialize)]
struct PointFacts<'a> {
    points: usize,
    /// Point of the largest value.
    point: &'a str,
    value: f64,
    unit: &'a str,
    time: f64,
}

impl<'a> RecoveryFacts<'a> {
    /// Collects the facts of the recoveries of a motion.
    pub(super) fn of_motion(motion: &'a RecoveredMotion) -> Vec<Self> {
        let pairs = motion.recoveries.iter().zip(&motion.extremes);
        pairs.filter_map(|(map, extremes)| Self::new(map, extremes)).collect()
    }

    fn new(map: &'a RowMap, extremes: &RowExtremes) -> Option<Self> {
        let largest = |(RowExtreme { place, time, value }, alike): (&RowExtreme, Vec<usize>)| {
            let label = &map.rows[*place];
            LargestRow {
                row: &label.name,
                quantity: label.quantity.name(),
                component: &label.component,
                node: label.node,
                element: label.element,
                value: *value,
                unit: &label.unit,
                time: *time,
                among: alike.len(),
            }
        };
        let mut of_units = extremes.rows.iter().zip(RecoveryRow::by_unit(&map.rows)).map(largest);
        let at_point = |extreme: RowExtreme| PointFacts {
            points: map.points.len(),
            point: &map.points[extreme.place].name,
            value: extreme.value,
            unit: &map.points[extreme.place].unit,
            time: extreme.time,
        };
        Some(Self {
            name: &map.name,
            rows: map.rows.len(),
            first: of_units.next()?,
            others: of_units.collect(),
            von_mises: extremes.von_mises.map(at_point),
            tension: extremes.tension.map(at_point),
            compression: extremes.compression.map(at_point),
        })
    }

    /// Returns the lines of this recovery in a report: rows, then stress measures of points.
    pub(super) fn terms(&self, time_unit: &str) -> Vec<Term> {
        let largest = |value: f64, unit: &str, place: &str, time: f64| {
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            let (value, time) = (significant(value, 5), significant(time, 6));
            format!("{value}{unit}, {place}, at {time} {time_unit}")
        };
        let of_unit = |own: &LargestRow<'_>| {
            let row = format!("row {} (component {})", own.row, own.component);
            let quantity = if own.quantity == Quantity::Other.name() { "value" } else { own.quantity };
            let words = largest(own.value, own.unit, &row, own.time);
            let of = counted(own.among, "row");
            Term::new("Recovery", format!("{}: largest {quantity} of {of}: {words}", self.name))
        };
        let mut terms: Vec<Term> = std::iter::once(&self.first).chain(&self.others).map(of_unit).collect();
        let measures = [
            ("von Mises largest", &self.von_mises),
            ("principal stress largest", &self.tension),
            ("principal stress smallest", &self.compression),
        ];
        for (measure, found) in measures {
            if let Some(own) = found {
                let words = largest(own.value, own.unit, own.point, own.time);
                let of = counted(own.points, "point");
                terms.push(Term::new("Recovery", format!("{}: {measure} of {of}: {words}", self.name)));
            }
        }
        terms
    }
}

impl<'a> RecoveredFacts<'a> {
    /// Collects the facts of `recovered` rows of `body` for `history`.
    pub fn new(
        body: &'a FlexBody,
        history: &'a LoadedHistory,
        recovered: &'a RecoveredMotion,
        run: &'a RunData,
    ) -> Self {
        Self {
            format: "flexbody-recovered",
            format_major: 1,
            format_minor: 2,
            generator: generator(),
            body: &body.description().name,
            history: history.path.display().to_string(),
            instants: history.time.len(),
            time_unit: body.units().time.name().to_owned(),
            loaded: history.loads.iter().map(|load| load.interface.as_str()).collect(),
            unloaded: history.unloaded(body),
            recoveries: RecoveryFacts::of_motion(recovered),
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
        terms.extend(self.recoveries.iter().flat_map(|recovery| recovery.terms(&self.time_unit)));
        let blocks = vec![Block::Terms(terms), Block::Diagnostics(self.diagnostics)];
        Document { name: self.body, kind: "Recovery", generator: &self.generator, blocks }
    }
}

/// Returns recoveries over time as comma-separated values: the time, then for every recovery a column `RECOVERY ROW` for
/// every row and, for every point with all six stresses, `RECOVERY POINT von Mises`, `RECOVERY POINT signed von Mises` and
/// `RECOVERY POINT principal 1` to `3`; numbers round-trip.
pub fn recovered_csv(motion: &RecoveredMotion) -> String {
    const MEASURES: [&str; 5] =
        ["von Mises", "signed von Mises", "principal 1", "principal 2", "principal 3"];
    let name = |map: &RowMap| -> Vec<String> {
        let rows = map.rows.iter().map(|row| row.name.clone());
        let measures = |point: &StressPoint| MEASURES.map(|measure| format!("{} {measure}", point.name));
        let points = map.points.iter().flat_map(measures);
        rows.chain(points).map(|own| csv::text(&format!("{} {own}", map.name))).collect()
    };
    let mut table = String::new();
    csv::push_row(
        &mut table,
        std::iter::once("time".to_owned()).chain(motion.recoveries.iter().flat_map(name)),
    );
    for (time, z) in motion.states.times.iter().zip(motion.states.iter()) {
        let values = |map: &RowMap| {
            let rows = map.values(z);
            let measures = |point: &StressPoint| {
                let [a, b, c] = point.principal(&rows);
                [point.von_mises(&rows), point.signed_von_mises(&rows), a, b, c]
            };
            let measures: Vec<f64> = map.points.iter().flat_map(measures).collect();
            rows.into_iter().chain(measures)
        };
        let values = motion.recoveries.iter().flat_map(values);
        csv::push_row(&mut table, std::iter::once(*time).chain(values).map(csv::number));
    }
    table
}

/// Returns channels over time as comma-separated values: the time and one column for each step; numbers round-trip.
pub fn channels_csv(channels: &Channels) -> String {
    let mut table = String::new();
    let names = channels.names.iter().map(|name| csv::text(name));
    csv::push_row(&mut table, std::iter::once("time".to_owned()).chain(names));
    for (time, values) in channels.times.iter().zip(&channels.values) {
        csv::push_row(&mut table, std::iter::once(time).chain(values).map(|value| csv::number(*value)));
    }
    table
}
