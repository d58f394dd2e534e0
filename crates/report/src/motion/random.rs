//! Root mean squares of random vibration: facts, tables and the file of all of them.

use super::envelope::EnvelopeKind;
use crate::document::{Block, Inline, Table, Term, heading};
use crate::notation::csv;
use crate::notation::numbers::{counted, frequency_range, percent, significant};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, RecoveryRow};
use flexbody_formats::{PointValues, stresses_vtu};
use flexbody_linalg::ties::first_largest;
use flexbody_motion::scene::StressPoint;
use flexbody_study::response::{RandomErrors, RandomRecovery, RandomResponse};
use serde::Serialize;

/// Facts of a random vibration.
#[derive(Debug, Clone, Serialize)]
pub(super) struct RandomFacts {
    inputs: Vec<ValueFacts>,
    band_hz: [f64; 2],
    evaluations: usize,
    displacements: Vec<ValueFacts>,
    recoveries: Vec<RecoveryFacts>,
}

/// Root mean square of a quantity.
#[derive(Debug, Clone, Serialize)]
struct ValueFacts {
    name: String,
    rms: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    unit: Option<String>,
}

/// Largest root mean squares of a recovery.
#[derive(Debug, Clone, Serialize)]
struct RecoveryFacts {
    name: String,
    rows: usize,
    points: usize,
    /// Largest row of the quantity and unit of the first row.
    largest_row: Option<ValueFacts>,
    /// Largest row of every further quantity and unit.
    other_largest_rows: Vec<ValueFacts>,
    largest_von_mises: Option<ValueFacts>,
    /// Estimated errors; `None` if they are not known.
    errors: Option<ErrorFacts>,
}

#[derive(Debug, Clone, Copy, Serialize)]
struct ErrorFacts {
    rows: f64,
    von_mises: Option<f64>,
}

impl RandomFacts {
    pub(super) fn new(random: &RandomResponse) -> Self {
        let plain = |(name, rms): (&String, f64)| ValueFacts { name: name.clone(), rms, unit: None };
        Self {
            inputs: random.inputs.iter().map(|(name, rms)| plain((name, *rms))).collect(),
            band_hz: random.band,
            evaluations: random.evaluations,
            displacements: random
                .displacements
                .iter()
                .map(|displacement| plain((&displacement.name, displacement.rms)))
                .collect(),
            recoveries: random.recoveries.iter().map(RecoveryFacts::new).collect(),
        }
    }

    /// Returns the blocks of the report.
    pub(super) fn blocks<'b>(&self) -> Vec<Block<'b>> {
        let values = |all: &[ValueFacts]| {
            let one = |value: &ValueFacts| format!("{} {}", value.name, significant(value.rms, 4));
            all.iter().map(one).collect::<Vec<_>>().join(", ")
        };
        let mut terms = vec![
            Term::new("Inputs", format!("root mean square over the band: {}", values(&self.inputs))),
            Term::new(
                "Integral",
                format!("{}, {}", frequency_range(self.band_hz, 5), counted(self.evaluations, "evaluation")),
            ),
        ];
        if !self.displacements.is_empty() {
            terms.push(Term::new("Motion", format!("root mean square: {}", values(&self.displacements))));
        }
        let mut blocks = vec![heading("Random vibration"), Block::Terms(terms)];
        if !self.recoveries.is_empty() {
            blocks.push(Block::Table(self.table()));
        }
        blocks
    }

    fn table(&self) -> Table {
        let heads = ["Recovery", "Largest", "RMS", "3 sigma", "Unit", "Error"];
        let mut rows: Vec<Vec<Inline>> = Vec::new();
        for recovery in &self.recoveries {
            let point = recovery.largest_von_mises.iter();
            let point =
                point.map(|own| (own, "von Mises", recovery.errors.and_then(|errors| errors.von_mises)));
            let of_units = recovery.largest_row.iter().chain(&recovery.other_largest_rows);
            let of_units = of_units.map(|own| (own, "row", recovery.errors.map(|errors| errors.rows)));
            for (value, kind, error) in point.chain(of_units) {
                rows.push(vec![
                    recovery.name.clone().into(),
                    format!("{kind} {}", value.name).into(),
                    significant(value.rms, 4).into(),
                    significant(3.0 * value.rms, 4).into(),
                    value.unit.clone().unwrap_or_default().into(),
                    error.map_or_else(|| "not known".to_owned(), percent).into(),
                ]);
            }
        }
        let caption = "Largest root mean squares of each recovery, about the values at rest. Error: estimated difference from the model, relative to the largest value";
        Table::new(caption, heads, &[0, 1, 4], rows).in_text(|_| true)
    }
}

impl RecoveryFacts {
    fn new(one: &RandomRecovery) -> Self {
        let most = |values: &[f64], places: &[usize]| first_largest(places.iter().copied(), |&at| values[at]);
        let of_unit = |alike: &Vec<usize>| {
            most(&one.rms, alike).map(|at| ValueFacts {
                name: one.rows[at].name.clone(),
                rms: one.rms[at],
                unit: Some(one.rows[at].unit.clone()),
            })
        };
        let groups = RecoveryRow::by_unit(&one.rows);
        let mut of_units = groups.iter().filter_map(of_unit);
        let points: Vec<usize> = (0..one.points.len()).collect();
        let point = most(&one.von_mises, &points).map(|at| ValueFacts {
            name: one.points[at].name.clone(),
            rms: one.von_mises[at],
            unit: Some(one.points[at].unit.clone()),
        });
        Self {
            name: one.name.clone(),
            rows: one.rows.len(),
            points: one.points.len(),
            largest_row: of_units.next(),
            other_largest_rows: of_units.collect(),
            largest_von_mises: point,
            errors: one.errors.map(|RandomErrors { rows, von_mises }| ErrorFacts { rows, von_mises }),
        }
    }
}

impl EnvelopeKind {
    /// Returns the file of the root mean squares of `random`.
    ///
    /// # Errors
    /// [`RecoveryUnknown`](Code::RecoveryUnknown) for a mesh if no point of the recoveries is a node.
    pub fn random_bytes(self, body: &FlexBody, random: &RandomResponse) -> Result<Vec<u8>> {
        match self {
            Self::Csv => Ok(random_csv(random).into_bytes()),
            Self::Vtu => {
                let values = |recovery: &RandomRecovery| PointValues {
                    name: format!("{} von Mises RMS", recovery.name),
                    nodes: recovery
                        .points
                        .iter()
                        .map(|point| recovery.rows[point.first_row()].node)
                        .collect(),
                    values: recovery.von_mises.clone(),
                    is_smallest: false,
                    cases: Vec::new(),
                };
                let all: Vec<PointValues> = random.recoveries.iter().map(values).collect();
                stresses_vtu(body, &all).ok_or_else(|| {
                    let message =
                        "no point of the recoveries is a node of the body, so there is nothing to draw";
                    let missing = Diagnostic::new(Code::RecoveryUnknown, message);
                    missing.with_help("write a table instead: --rms FILE.csv").into()
                })
            }
        }
    }
}

/// Returns all root mean squares as comma-separated values: displacements, rows and points of each recovery.
fn random_csv(random: &RandomResponse) -> String {
    let mut table = String::new();
    let head = ["recovery", "kind", "name", "node", "element", "unit", "rms", "three_sigma"];
    csv::push_row(&mut table, head.map(str::to_owned));
    let mut push = |recovery: &str, kind: &str, name: &str, row: Option<&RecoveryRow>, rms: f64| {
        let number = |id: Option<i64>| id.map_or_else(String::new, |id| id.to_string());
        let cells = [
            csv::text(recovery),
            kind.to_owned(),
            csv::text(name),
            number(row.and_then(|row| row.node)),
            number(row.and_then(|row| row.element)),
            csv::text(row.map_or("", |row| &row.unit)),
            csv::number(rms),
            csv::number(3.0 * rms),
        ];
        csv::push_row(&mut table, cells);
    };
    for displacement in &random.displacements {
        push("", "displacement", &displacement.name, None, displacement.rms);
    }
    for recovery in &random.recoveries {
        for (row, rms) in recovery.rows.iter().zip(&recovery.rms) {
            push(&recovery.name, "row", &row.name, Some(row), *rms);
        }
        let of_point = |point: &StressPoint| &recovery.rows[point.first_row()];
        for (point, rms) in recovery.points.iter().zip(&recovery.von_mises) {
            push(&recovery.name, "von Mises", &point.name, Some(of_point(point)), *rms);
        }
    }
    table
}
