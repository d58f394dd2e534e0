//! Reader of histories in the columns of other files.
//!
//! A function that returns `None` has added a diagnostic to `found`.

use super::{History, Interpolation, Run, Samples, SeriesFile, VectorHistory};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::provenance::SourceFile;
use flexbody_base::text::InputFile;
use flexbody_base::text::series::{ColumnKey, Series, read_series};
use flexbody_base::text::walk::{TomlTable, Value, Walk, integer};
use nalgebra::Vector3;
use std::cell::RefCell;
use std::ops::Range;
use toml::de::DeValue;

/// Keys of the table of one column, and of a table of several columns.
pub(super) const COLUMN: &[&str] =
    &["file", "time", "value", "scale", "time_scale", "time_zero", "interpolation", "outside"];
pub(super) const COLUMNS: &[&str] =
    &["file", "time", "columns", "scale", "time_scale", "time_zero", "interpolation", "outside"];

/// Time by which a file may end before the run, relative to the duration: times are often written with
/// about six digits.
const ROUNDING: f64 = 1e-6;

/// Time span that the histories of a scene must cover, and the files read so far.
pub(super) struct HistoryFiles {
    /// Time span that a history must cover.
    needed: Needed,
    read: RefCell<Vec<SeriesFile>>,
}

#[derive(Clone, Copy)]
enum Needed {
    Until(f64),
    /// The scene does not state its duration.
    NotSaid,
    /// The stated duration is wrong, and a diagnostic reports it.
    NotKnown,
}

impl HistoryFiles {
    /// Creates the reader for a scene with this `run`; `None` if the run is invalid.
    pub(super) fn new(run: Option<&Run>) -> Self {
        let needed = match run.map(|run| run.duration) {
            Some(Some(duration)) => Needed::Until(duration),
            Some(None) => Needed::NotSaid,
            None => Needed::NotKnown,
        };
        Self { needed, read: RefCell::default() }
    }

    /// Returns the files that were read.
    pub(super) fn into_files(self) -> Vec<SeriesFile> {
        self.read.into_inner()
    }

    /// Returns the end of the time span that a history must cover, if the scene states it.
    pub(super) fn end(&self) -> Option<f64> {
        match self.needed {
            Needed::Until(end) => Some(end),
            Needed::NotSaid | Needed::NotKnown => None,
        }
    }

    /// Opens a file in the folder of the scene.
    fn open(&self, walk: &mut Walk<'_>, table: &TomlTable, span: &Range<usize>) -> Option<InputFile> {
        if !table.contains_key("file") {
            walk.wrong(span.clone(), "key `file` is missing".to_owned());
        }
        let name = walk.string(table, "file")?;
        let path = walk.path.parent().map_or_else(|| name.clone().into(), |folder| folder.join(&name));
        let file = match InputFile::open(&path) {
            Ok(file) => file,
            Err(error) => {
                let place = table.get("file").map_or_else(|| span.clone(), |value| value.span());
                walk.complain(error.code(), place, format!("`file` {name}: {}", error.message()));
                return None;
            }
        };
        let mut read = self.read.borrow_mut();
        if read.iter().all(|other| other.path != path) {
            match file.sha256() {
                Ok(sha256) => {
                    let source = SourceFile::new("history", &path, sha256);
                    read.push(SeriesFile { path, source });
                }
                Err(changed) => {
                    walk.diagnostics.push(changed);
                    return None;
                }
            }
        }
        Some(file)
    }

    /// Adds a diagnostic if the file `name` with these first and last times does not cover the run.
    fn check_covered(
        &self,
        walk: &mut Walk<'_>,
        span: &Range<usize>,
        name: &str,
        (first, last): (f64, f64),
    ) -> Option<()> {
        let (what, help) = match self.needed {
            Needed::Until(end) if first > ROUNDING * end || last < end - ROUNDING * end => {
                (format!("the run goes from 0 to {end}"), Code::SeriesRange.help())
            }
            Needed::NotSaid => ("the scene has no `duration`".to_owned(), "give `duration` in [run]"),
            Needed::Until(_) | Needed::NotKnown => return Some(()),
        };
        let message = format!("{name} covers the times {first} to {last} of the scene, but {what}");
        let uncovered = walk.at(Code::SeriesRange, span.clone(), message);
        walk.diagnostics.push(uncovered.with_help(help));
        None
    }
}

/// Columns of a file in times of the scene.
pub(super) struct FromFile {
    pub times: Vec<f64>,
    /// Columns with the scale applied.
    pub columns: Vec<Vec<f64>>,
    /// Line number of each row.
    pub lines: Vec<usize>,
    pub file: InputFile,
}

/// Options in a table of columns.
struct ColumnOptions {
    scale: f64,
    time_scale: f64,
    time_zero: f64,
    interpolation: Interpolation,
    held: bool,
}

impl ColumnOptions {
    fn new(
        walk: &mut Walk<'_>,
        table: &TomlTable,
        span: &Range<usize>,
        default: Interpolation,
    ) -> Option<Self> {
        let mut or = |key: &str, default: f64| {
            if table.contains_key(key) { finite(walk, table, key, span) } else { Some(default) }
        };
        let (scale, time_zero) = (or("scale", 1.0), or("time_zero", 0.0));
        let time_scale = if table.contains_key("time_scale") {
            positive(walk, table, "time_scale", span)
        } else {
            Some(1.0)
        };
        let interpolation = interpolation(walk, table, default);
        let held = one_of(walk, table, "outside", &[("hold", true)], false);
        Some(Self {
            scale: scale?,
            time_scale: time_scale?,
            time_zero: time_zero?,
            interpolation: interpolation?,
            held: held?,
        })
    }
}

/// Reads the interpolation between rows.
pub(super) fn interpolation(
    walk: &mut Walk<'_>,
    table: &TomlTable,
    default: Interpolation,
) -> Option<Interpolation> {
    let known = [("linear", Interpolation::Linear), ("cubic", Interpolation::Cubic)];
    one_of(walk, table, "interpolation", &known, default)
}

/// Returns the meaning of the word under `key`.
fn one_of<T: Copy>(
    walk: &mut Walk<'_>,
    table: &TomlTable,
    key: &str,
    known: &[(&str, T)],
    default: T,
) -> Option<T> {
    let Some(value) = table.get(key) else { return Some(default) };
    let given = match value.get_ref() {
        DeValue::String(text) => known.iter().find(|(name, _)| name == text).map(|(_, meaning)| *meaning),
        _ => None,
    };
    if given.is_none() {
        let names: Vec<String> = known.iter().map(|(name, _)| format!("\"{name}\"")).collect();
        walk.wrong(value.span(), format!("`{key}` is not {}", names.join(" or ")));
    }
    given
}

/// Reads a column given by its name or number.
fn column(walk: &mut Walk<'_>, key: &str, value: &Value) -> Option<ColumnKey> {
    let column = match value.get_ref() {
        DeValue::String(name) if !name.trim().is_empty() => Some(ColumnKey::Name(name.trim().to_owned())),
        _ => {
            let number = integer(value).and_then(|number| usize::try_from(number).ok());
            number.filter(|number| *number > 0).map(ColumnKey::Number)
        }
    };
    if column.is_none() {
        walk.wrong(value.span(), format!("`{key}` is neither the name nor the number (from 1) of a column"));
    }
    column
}

/// Reads the columns `keys` of the file named by `table`, over the run.
fn series(
    walk: &mut Walk<'_>,
    files: &HistoryFiles,
    table: &TomlTable,
    span: &Range<usize>,
    keys: Option<Vec<ColumnKey>>,
    reading: &ColumnOptions,
) -> Option<FromFile> {
    let time = match table.get("time") {
        Some(value) => column(walk, "time", value),
        None => Some(ColumnKey::Number(1)),
    };
    let file = files.open(walk, table, span);
    let (time, file, keys) = (time?, file?, keys?);
    let Series { mut times, mut columns, lines } = match read_series(&file, &time, &keys) {
        Ok(series) => series,
        Err(found) => {
            tell(walk, found);
            return None;
        }
    };
    times.iter_mut().for_each(|time| *time = (*time - reading.time_zero) * reading.time_scale);
    columns.iter_mut().flatten().for_each(|value| *value *= reading.scale);
    let ascend = times.windows(2).all(|pair| pair[0] < pair[1]);
    if !ascend || !times.iter().chain(columns.iter().flatten()).all(|value| value.is_finite()) {
        let message = "times or values overflow after `scale`, `time_scale` and `time_zero` are applied";
        walk.wrong(span.clone(), message.to_owned());
        return None;
    }
    if !reading.held {
        let name = walk.string(table, "file")?;
        files.check_covered(walk, span, &name, (times[0], times[times.len() - 1]))?;
    }
    Some(FromFile { times, columns, lines, file })
}

/// Adds diagnostics that are not yet reported: several histories may come from one file.
pub(super) fn tell(walk: &mut Walk<'_>, diagnostics: Vec<Diagnostic>) {
    for diagnostic in diagnostics {
        if !walk.diagnostics.contains(&diagnostic) {
            walk.diagnostics.push(diagnostic);
        }
    }
}

/// Reads a history from one column.
pub(super) fn column_history(
    walk: &mut Walk<'_>,
    files: &HistoryFiles,
    table: &TomlTable,
    span: &Range<usize>,
) -> Option<History> {
    let value = match table.get("value") {
        Some(value) => column(walk, "value", value),
        None => {
            walk.wrong(span.clone(), "key `value` is missing".to_owned());
            None
        }
    };
    let reading = ColumnOptions::new(walk, table, span, Interpolation::Linear);
    let reading = reading?;
    let read = series(walk, files, table, span, value.map(|value| vec![value]), &reading)?;
    Some(History::samples(read.times, &read.columns[0], reading.interpolation, reading.held))
}

/// Reads the keys of a list of `count` columns.
fn column_list(
    walk: &mut Walk<'_>,
    table: &TomlTable,
    span: &Range<usize>,
    count: usize,
) -> Option<Vec<ColumnKey>> {
    let list = match table.get("columns").map(|value| value.get_ref()) {
        Some(DeValue::Array(list)) if list.len() == count => list,
        _ => {
            walk.wrong(span.clone(), format!("`columns` is not a list of {count} columns"));
            return None;
        }
    };
    list.iter().map(|value| column(walk, "columns", value)).collect()
}

/// Reads a vector from the three columns under `key`, with the interpolation `default` unless the table
/// states another.
pub(super) fn columns_history(
    walk: &mut Walk<'_>,
    files: &HistoryFiles,
    key: &str,
    value: &Value,
    default: Interpolation,
) -> Option<VectorHistory> {
    let table = table_of_columns(walk, key, value, COLUMNS)?;
    let span = value.span();
    let keys = column_list(walk, table, &span, 3);
    let reading = ColumnOptions::new(walk, table, &span, default)?;
    let read = series(walk, files, table, &span, keys, &reading)?;
    let [x, y, z] = &read.columns[..] else { return None };
    let rows: Vec<Vector3<f64>> = (0..x.len()).map(|row| Vector3::new(x[row], y[row], z[row])).collect();
    Some(VectorHistory::Columns(Samples::new(read.times, &rows, reading.interpolation, reading.held)))
}

/// Reads the four columns of Euler parameters under `key` without scaling.
pub(super) fn four_columns(
    walk: &mut Walk<'_>,
    files: &HistoryFiles,
    key: &str,
    value: &Value,
    known: &[&str],
) -> Option<FromFile> {
    let table = table_of_columns(walk, key, value, known)?;
    let span = value.span();
    let keys = column_list(walk, table, &span, 4);
    let reading = ColumnOptions::new(walk, table, &span, Interpolation::Cubic)?;
    series(walk, files, table, &span, keys, &reading)
}

/// Returns the table of columns under `key`.
fn table_of_columns<'t, 'i>(
    walk: &mut Walk<'_>,
    key: &str,
    value: &'t Value<'i>,
    known: &[&str],
) -> Option<&'t TomlTable<'i>> {
    let DeValue::Table(table) = value.get_ref() else {
        walk.mistyped(key, value, "a table { file, time, columns }");
        return None;
    };
    walk.known_keys(table, &format!("`{key}`"), known);
    Some(table)
}

// Readers of numbers in a scene.
//
// A function that returns `None` has added a diagnostic to `found`.

/// Reads a required finite number.
pub(super) fn finite(walk: &mut Walk<'_>, table: &TomlTable, key: &str, span: &Range<usize>) -> Option<f64> {
    let number = walk.number(table, key, span)?;
    if !number.is_finite() {
        walk.wrong(place_of(table, key, span), format!("`{key}` is {number}, expected a finite number"));
        return None;
    }
    Some(number)
}

/// Reads a required positive number.
pub(super) fn positive(
    walk: &mut Walk<'_>,
    table: &TomlTable,
    key: &str,
    span: &Range<usize>,
) -> Option<f64> {
    let number = finite(walk, table, key, span)?;
    if number <= 0.0 {
        walk.wrong(place_of(table, key, span), format!("`{key}` is {number}, expected a positive number"));
        return None;
    }
    Some(number)
}

/// Returns the position of the value of `key` in the file; `span` is that of its table.
pub(super) fn place_of(table: &TomlTable, key: &str, span: &Range<usize>) -> Range<usize> {
    table.get(key).map_or_else(|| span.clone(), |value| value.span())
}
