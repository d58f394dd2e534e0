//! Largest stresses of every point over a run, or over several load cases: files, and the summary of several load cases.

use crate::document::json;
use crate::notation::csv;
use crate::notation::numbers::{counted, significant};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::text::table::{Column, Table};
use flexbody_base::text::{InputFile, scanner};
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::FlexBody;
use flexbody_formats::envelope_vtu;
use flexbody_motion::scene::{CasePeak, Envelope, PointPeaks, RecoveryEnvelope};
use serde::Serialize;
use std::path::Path;

/// Kind of a file of the largest stresses of every point.
#[derive(Debug, Clone, Copy)]
pub enum EnvelopeKind {
    /// Table, one row for each point.
    Csv,
    /// Mesh of the body with the stresses at its nodes, for ParaView.
    Vtu,
}

impl EnvelopeKind {
    /// Returns the kind of a file by its extension.
    ///
    /// # Errors
    /// [`Usage`](Code::Usage) for other extensions.
    pub fn of(path: &Path) -> Result<Self> {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("csv") => Ok(Self::Csv),
            Some("vtu") => Ok(Self::Vtu),
            _ => {
                let message = format!("envelope {} has no known extension", path.display());
                let help = "give it the extension .csv or .vtu";
                Err(Diagnostic::new(Code::Usage, message).with_help(help).into())
            }
        }
    }

    /// Returns the file of the largest stresses of a motion of `body`.
    ///
    /// # Errors
    /// [`RecoveryUnknown`](Code::RecoveryUnknown) if no recovery has all six stresses of a point, or for a mesh if none
    /// of its points is a node.
    pub fn bytes(self, body: &FlexBody, envelope: &Envelope) -> Result<Vec<u8>> {
        let none = |what: &str| Diagnostic::new(Code::RecoveryUnknown, what.to_owned());
        if envelope.recoveries.iter().all(|recovery| recovery.points.is_empty()) {
            let help =
                "give the rows of six stresses of a point one name that ends with xx, yy, zz, xy, yz, xz";
            return Err(none("no recovery has all six stresses of a point").with_help(help).into());
        }
        match self {
            Self::Csv => Ok(envelope_csv(envelope).into_bytes()),
            Self::Vtu => envelope_vtu(body, envelope).ok_or_else(|| {
                none("no point of the recoveries is a node of the body, so there is nothing to draw")
                    .with_help("write a table instead: --envelope FILE.csv")
                    .into()
            }),
        }
    }
}

/// Columns of the table, without those of load cases.
const COLUMNS: [&str; 11] = [
    "recovery",
    "point",
    "node",
    "element",
    "unit",
    "von_mises",
    "von_mises_time",
    "largest_principal",
    "largest_principal_time",
    "smallest_principal",
    "smallest_principal_time",
];

/// Columns of the load case of each extreme.
const CASE_COLUMNS: [&str; 3] = ["von_mises_case", "largest_principal_case", "smallest_principal_case"];

/// Returns the largest stresses as comma-separated values, one row for each point of each recovery: its name, node and
/// element, and the largest equivalent stress of von Mises, the largest and the smallest principal stress, each with its
/// time and, with load cases, the name of its load case.
fn envelope_csv(envelope: &Envelope) -> String {
    let mut table = String::new();
    let cases = CASE_COLUMNS.iter().filter(|_| !envelope.cases.is_empty());
    csv::push_row(&mut table, COLUMNS.iter().chain(cases).map(|name| (*name).to_owned()));
    for recovery in &envelope.recoveries {
        for point in &recovery.points {
            let number = |id: Option<i64>| id.map_or_else(String::new, |id| id.to_string());
            let texts = [csv::text(&recovery.name), csv::text(&point.name)];
            let ids = [number(point.node), number(point.element), csv::text(&point.unit)];
            let peaks = [point.von_mises, point.largest_principal, point.smallest_principal];
            let numbers = peaks.iter().flat_map(|peak| [csv::number(peak.value), csv::number(peak.time)]);
            let cases = peaks.iter().filter_map(|peak| envelope.case_of(peak)).map(csv::text);
            csv::push_row(&mut table, texts.into_iter().chain(ids).chain(numbers).chain(cases));
        }
    }
    table
}

/// Reads a table that `simulate --envelope` or `recover --envelope` has written, or another program with the same
/// columns.
///
/// # Errors
/// FB101 and FB106 for a file that cannot be read, FB203 and FB204 for another table or invalid rows.
pub fn read_envelope(path: &Path) -> Result<Envelope> {
    let file = InputFile::open(path).map_err(|diagnostic| Error::new(vec![diagnostic]))?;
    let required = ["recovery", "point", "node", "unit", "von_mises"];
    let columns: Vec<Column> = COLUMNS
        .iter()
        .chain(&CASE_COLUMNS)
        .map(|name| Column { name, required: required.contains(name) })
        .collect();
    let table = Table::open(&file, &columns).map_err(|diagnostic| Error::new(vec![diagnostic]))?;
    let mut envelope = Envelope { cases: Vec::new(), recoveries: Vec::new() };
    let has_cases = table.has(COLUMNS.len());
    let text = |field: &[u8]| String::from_utf8_lossy(field).replace("\"\"", "\"");
    let rows = table.rows(|_, fields| {
        let id = |at: usize| match fields[at] {
            b"" => Ok(None),
            field => scanner::whole(field)
                .map(Some)
                .ok_or_else(|| scanner::expected(Code::TableRow, "a number of a node or element", field)),
        };
        let real = |at: usize| match fields[at] {
            b"" => Ok(0.0),
            field => {
                scanner::number(field).ok_or_else(|| scanner::expected(Code::TableRow, "a number", field))
            }
        };
        let mut peak = |value: usize, case: usize| {
            let name = text(fields[COLUMNS.len() + case]);
            let case = if has_cases { place_of(&mut envelope.cases, name) } else { 0 };
            Ok::<_, Diagnostic>(CasePeak { value: real(value)?, time: real(value + 1)?, case })
        };
        let point = PointPeaks {
            von_mises: peak(5, 0)?,
            largest_principal: peak(7, 1)?,
            smallest_principal: peak(9, 2)?,
            name: text(fields[1]),
            node: id(2)?,
            element: id(3)?,
            unit: text(fields[4]),
        };
        if point.von_mises.value.is_nan() || point.von_mises.value < 0.0 {
            return Err(scanner::expected(Code::TableRow, "an equivalent stress from 0", fields[5]));
        }
        Ok((text(fields[0]), point))
    });
    for (name, point) in rows.map_err(Error::new)? {
        match envelope.recoveries.iter_mut().find(|known| known.name == name) {
            Some(known) => known.points.push(point),
            None => envelope.recoveries.push(RecoveryEnvelope { name, points: vec![point] }),
        }
    }
    refuse_several_units(&envelope).map_err(|diagnostic| diagnostic.in_file(path))?;
    Ok(envelope)
}

/// Returns the place of a name in a list, to which a new one is added.
fn place_of(names: &mut Vec<String>, name: String) -> usize {
    names.iter().position(|known| *known == name).unwrap_or_else(|| {
        names.push(name);
        names.len() - 1
    })
}

/// Refuses a recovery whose points have different units, which have no largest value.
fn refuse_several_units(envelope: &Envelope) -> std::result::Result<(), Diagnostic> {
    for recovery in &envelope.recoveries {
        let first = &recovery.points[0].unit;
        if let Some(other) = recovery.points.iter().find(|point| point.unit != *first) {
            let message =
                format!("recovery `{}` has stresses in {first} and in {}", recovery.name, other.unit);
            return Err(Diagnostic::new(Code::TableRow, message).with_help("give all stresses in one unit"));
        }
    }
    Ok(())
}

/// Largest equivalent stresses of several load cases.
#[derive(Debug, Clone, Serialize)]
pub struct EnvelopeFacts<'a> {
    cases: &'a [String],
    recoveries: Vec<RecoveryPeak<'a>>,
    #[serde(skip)]
    time_unit: &'a str,
}

/// Largest equivalent stress of a recovery.
#[derive(Debug, Clone, Serialize)]
struct RecoveryPeak<'a> {
    name: &'a str,
    points: usize,
    point: &'a str,
    node: Option<i64>,
    element: Option<i64>,
    von_mises: f64,
    unit: &'a str,
    time: f64,
    case: &'a str,
}

impl<'a> EnvelopeFacts<'a> {
    /// Collects the largest values of the load cases of `envelope`.
    pub fn new(envelope: &'a Envelope, units: &'a UnitSystem) -> Self {
        let peak = |recovery: &'a RecoveryEnvelope| {
            let point = recovery.largest()?;
            Some(RecoveryPeak {
                name: &recovery.name,
                points: recovery.points.len(),
                point: &point.name,
                node: point.node,
                element: point.element,
                von_mises: point.von_mises.value,
                unit: &point.unit,
                time: point.von_mises.time,
                case: envelope.case_of(&point.von_mises).unwrap_or_default(),
            })
        };
        Self {
            cases: &envelope.cases,
            recoveries: envelope.recoveries.iter().filter_map(peak).collect(),
            time_unit: units.time.name(),
        }
    }

    /// Returns the facts as lines of a text.
    pub fn text(&self) -> String {
        let count = counted(self.cases.len(), "load case");
        let line = |own: &RecoveryPeak<'_>| {
            format!(
                "Largest von Mises of {count}, {}: {} {}, {}, at {} {} of load case `{}`\n",
                own.name,
                significant(own.von_mises, 5),
                own.unit,
                own.point,
                significant(own.time, 6),
                self.time_unit,
                own.case
            )
        };
        self.recoveries.iter().map(line).collect()
    }

    /// Returns the facts as JSON.
    pub fn json(&self) -> String {
        json(self)
    }
}
