//! Readers of values that occur in several tables of a scene: numbers, vectors, axes, points, histories,
//! lists.
//!
//! A function that returns `None` has added a diagnostic to `found`.

use super::read_columns::{COLUMN, HistoryFiles, column_history, interpolation};
use super::read_numbers::{finite, positive};
use super::{Axes, History, Interpolation, Point};
use flexbody_base::text::series::closer_than_rounding;
use flexbody_base::text::walk::{TomlTable, Value, Walk, integer, real};
use nalgebra::Vector3;
use std::ops::Range;
use toml::de::DeValue;

/// All axes that a vector can be along.
pub(super) const EVERY: [Axes; 3] = [Axes::Model, Axes::Body, Axes::World];

/// Kinds of histories, and the keys of their tables.
pub(super) const HISTORIES: [(&str, &[&str]); 4] = [
    ("a column of a file", COLUMN),
    ("a table of points", &["times", "values", "interpolation"]),
    ("a sine", &["amplitude", "frequency", "phase"]),
    ("a ramp", &["from", "to", "start", "duration"]),
];

/// Swaps the options: a missing key is allowed, an invalid value is an error.
pub(super) fn transposed<T>(value: Option<Option<T>>) -> Option<Option<T>> {
    match value {
        Some(read) => read.map(Some),
        None => Some(None),
    }
}

/// Reads the number of a mode, returned from 0.
pub(super) fn mode_number(
    walk: &mut Walk<'_>,
    table: &TomlTable,
    span: &Range<usize>,
    place: &str,
) -> Option<usize> {
    let Some(value) = table.get("number") else {
        walk.wrong(span.clone(), format!("key `number` is missing in {place}"));
        return None;
    };
    let number = integer(value).and_then(|number| usize::try_from(number).ok()).filter(|&n| n > 0);
    if number.is_none() {
        walk.mistyped("number", value, "the number of a mode, from 1");
    }
    Some(number? - 1)
}

/// Reads the key `axes`, which must be one of `known`.
pub(super) fn axes(walk: &mut Walk<'_>, table: &TomlTable, known: &[Axes], default: Axes) -> Option<Axes> {
    let Some(value) = table.get("axes") else { return Some(default) };
    let given = match value.get_ref() {
        DeValue::String(text) => known.iter().copied().find(|axes| axes.name() == text.as_ref()),
        _ => None,
    };
    if given.is_none() {
        let names: Vec<String> = known.iter().map(|axes| format!("\"{}\"", axes.name())).collect();
        walk.mistyped("axes", value, &names.join(" or "));
    }
    given
}

/// Reads the required vector under `key` and returns it with length one.
pub(super) fn direction(walk: &mut Walk<'_>, table: &TomlTable, key: &str) -> Option<Vector3<f64>> {
    let value = table.get(key)?;
    let unit = vector(walk, key, value)?.try_normalize(0.0);
    if unit.is_none() {
        walk.wrong(value.span(), format!("`{key}` has no direction"));
    }
    unit
}

/// Reads a node or an interface.
pub(super) fn place(walk: &mut Walk<'_>, table: &TomlTable, span: Range<usize>) -> Option<Point> {
    match (table.get("node"), table.contains_key("interface")) {
        (Some(value), false) => {
            let node = integer(value);
            if node.is_none() {
                walk.mistyped("node", value, "a node number");
            }
            Some(Point::Node(node?))
        }
        (None, true) => Some(Point::Interface(walk.string(table, "interface")?)),
        (Some(_), true) => {
            walk.wrong(span, "table has both `node` and `interface`".to_owned());
            None
        }
        (None, false) => {
            walk.wrong(span, "table has neither `node` nor `interface`".to_owned());
            None
        }
    }
}

/// Reads a number, or a table of one of the kinds of histories.
pub(super) fn history(
    walk: &mut Walk<'_>,
    files: &HistoryFiles,
    key: &str,
    value: &Value,
) -> Option<History> {
    const EXPECTED: &str = "a number or a table { times, values }, { amplitude, frequency, phase }, { from, to, start, duration } or { file, time, value }";
    let table = match value.get_ref() {
        DeValue::Table(table) => table,
        _ => {
            let number = real(value).filter(|number| number.is_finite());
            if number.is_none() {
                walk.mistyped(key, value, EXPECTED);
            }
            return number.map(History::Constant);
        }
    };
    // Choose the kind that most of the keys belong to, the first of several.
    let fitting = |kind: usize| HISTORIES[kind].1.iter().filter(|key| table.contains_key(**key)).count();
    let kind = (0..HISTORIES.len()).rev().max_by_key(|&kind| fitting(kind)).filter(|&kind| fitting(kind) > 0);
    let Some(kind) = kind else {
        walk.wrong(value.span(), format!("`{key}` is empty, expected {EXPECTED}"));
        return None;
    };
    let (place, keys) = HISTORIES[kind];
    walk.known_keys(table, place, keys);
    let span = value.span();
    let mut or_zero =
        |key: &str| if table.contains_key(key) { finite(walk, table, key, &span) } else { Some(0.0) };
    match kind {
        0 => column_history(walk, files, table, &span),
        1 => points(walk, table, span),
        2 => {
            let phase = or_zero("phase");
            let (amplitude, frequency) =
                (finite(walk, table, "amplitude", &span), positive(walk, table, "frequency", &span));
            Some(History::Sine { amplitude: amplitude?, frequency: frequency?, phase: phase? })
        }
        _ => {
            let (from, start) = (or_zero("from"), or_zero("start"));
            let (to, duration) = (finite(walk, table, "to", &span), positive(walk, table, "duration", &span));
            Some(History::Ramp { from: from?, to: to?, start: start?, duration: duration? })
        }
    }
}

/// Reads a table of points.
fn points(walk: &mut Walk<'_>, table: &TomlTable, span: Range<usize>) -> Option<History> {
    let mut numbers = |key: &str| {
        let list: Option<Vec<f64>> = table.get(key).and_then(|value| match value.get_ref() {
            DeValue::Array(list) => list.iter().map(|item| real(item).filter(|v| v.is_finite())).collect(),
            _ => None,
        });
        if list.is_none() {
            walk.wrong(span.clone(), format!("`{key}` is not a list of numbers"));
        }
        list
    };
    let (times, values) = (numbers("times"), numbers("values"));
    let interpolation = interpolation(walk, table, Interpolation::Linear);
    let (times, values, interpolation) = (times?, values?, interpolation?);
    let problem = if times.len() != values.len() {
        format!("{} times and {} values", times.len(), values.len())
    } else if times.is_empty() {
        "no points".to_owned()
    } else if times.windows(2).any(|pair| pair[0] >= pair[1]) {
        "times are not ascending".to_owned()
    } else if let Some(row) = closer_than_rounding(&times) {
        let [before, time] = [times[row - 1], times[row]];
        format!("times {before:?} and {time:?} differ only by rounding: remove one of the two points")
    } else if interpolation == Interpolation::Cubic && times.len() > 1 {
        return Some(History::samples(times, &values, Interpolation::Cubic, true));
    } else {
        return Some(History::Table { times, values });
    };
    walk.wrong(span, problem);
    None
}

/// Reads the tables `[[key]]`.
pub(super) fn list<T>(
    walk: &mut Walk<'_>,
    table: &TomlTable,
    key: &str,
    mut read: impl FnMut(&mut Walk<'_>, &TomlTable, Range<usize>) -> Option<T>,
) -> Option<Vec<T>> {
    let Some(value) = table.get(key) else { return Some(Vec::new()) };
    let DeValue::Array(items) = value.get_ref() else {
        walk.mistyped(key, value, &format!("a list of tables: write [[{key}]]"));
        return None;
    };
    let mut all = Some(Vec::new());
    for item in items.iter() {
        let read = match item.get_ref() {
            DeValue::Table(table) => read(walk, table, item.span()),
            _ => {
                walk.mistyped(key, item, &format!("a list of tables: write [[{key}]]"));
                None
            }
        };
        all = all.zip(read).map(|(mut all, one)| {
            all.push(one);
            all
        });
    }
    all
}

/// Reads three finite numbers.
pub(super) fn vector(walk: &mut Walk<'_>, key: &str, value: &Value) -> Option<Vector3<f64>> {
    let components: Option<Vec<f64>> = match value.get_ref() {
        DeValue::Array(list) => list.iter().map(|item| real(item).filter(|v| v.is_finite())).collect(),
        _ => None,
    };
    match components.as_deref() {
        Some(&[x, y, z]) => Some(Vector3::new(x, y, z)),
        _ => {
            walk.wrong(value.span(), format!("`{key}` is not a list of three numbers"));
            None
        }
    }
}
