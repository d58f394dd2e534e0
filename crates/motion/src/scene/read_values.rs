//! Readers of values that occur in several tables of a scene: numbers, vectors, axes, points, histories,
//! lists.
//!
//! A function that returns `None` has added a diagnostic to `found`.

use super::read_columns::{
    COLUMN, FromFile, HistoryFiles, column_history, columns_history, finite, four_columns, interpolation,
    positive, tell,
};
use super::{Axes, History, Interpolation, Point, Samples, VectorHistory};
use crate::dynamics::{EulerParameters, Orientation, RotationVector};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::series::closer_than_rounding;
use flexbody_base::text::walk::{TomlTable, Value, Walk, integer, real};
use libm::acos;
use nalgebra::{Vector3, Vector4};
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

/// Reads a node, an interface or a named load.
pub(super) fn loaded_place(walk: &mut Walk<'_>, table: &TomlTable, span: Range<usize>) -> Option<Point> {
    if !table.contains_key("named_load") {
        return place(walk, table, span);
    }
    if table.contains_key("node") || table.contains_key("interface") {
        walk.wrong(span, "a load is at one place: `node`, `interface` or `named_load`".to_owned());
        return None;
    }
    Some(Point::NamedLoad(walk.string(table, "named_load")?))
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

// Reader of rotations: a rate about one axis, three components of an angular velocity, or attitudes over
// time.

/// Keys of attitudes in a file. Their values are not continued outside the rows, and they have no unit.
pub(super) const ATTITUDE: &[&str] = &["file", "time", "columns", "time_scale", "time_zero"];

/// Keys of the three ways to give a rotation.
const ROTATION_KEYS: [&str; 3] = ["rate", "angular_velocity_from", "attitude_from"];

/// Largest deviation of the length of Euler parameters from one: the rounding of two decimals.
const LENGTH: f64 = 0.01;

/// Largest angle between two rows in radians; larger rotations between rows are ambiguous.
const LARGEST_TURN: f64 = std::f64::consts::FRAC_PI_2;

/// Largest angle in radians between the integrated angular velocity and the attitudes in the file: the
/// default tolerance of the attitude in scenes.
const LARGEST_LOSS: f64 = 1e-3;

/// A rotation as read from a scene.
pub(super) struct Turning {
    pub velocity: VectorHistory,
    pub axes: Axes,
    /// Attitude at time zero, if the file contains it.
    pub start: Option<RotationVector>,
}

/// Reads the rotation in `table`, called `place`. A result `None` comes with a diagnostic in `found`.
pub(super) fn turning(
    walk: &mut Walk<'_>,
    files: &HistoryFiles,
    table: &TomlTable,
    span: Range<usize>,
    place: &str,
) -> Option<Turning> {
    let given: Vec<&str> = ROTATION_KEYS.into_iter().filter(|key| table.contains_key(*key)).collect();
    let ways = "`rate`, `angular_velocity_from` and `attitude_from`";
    let &[way] = &given[..] else {
        let message = if given.is_empty() {
            format!("key `rate` is missing in {place}")
        } else {
            format!("{place} has more than one of {ways}")
        };
        let wrong = walk.at(Code::SceneSyntax, span, message);
        walk.diagnostics.push(wrong.with_help(format!("give one of {ways}")));
        axis_of(walk, table);
        axes(walk, table, &EVERY, Axes::Model);
        return None;
    };
    let value = table.get(way)?;
    if way != "rate" && table.contains_key("axis") {
        let message = format!("`axis` of {place} has no effect: `{way}` has all three components");
        walk.complain(Code::SceneContradicts, span, message);
        return None;
    }
    match way {
        "rate" => {
            let axis = axis_of(walk, table);
            let axes = axes(walk, table, &EVERY, Axes::Model);
            let factor = history(walk, files, "rate", value);
            let velocity = VectorHistory::Along { direction: axis?, factor: factor? };
            Some(Turning { velocity, axes: axes?, start: None })
        }
        "angular_velocity_from" => {
            let axes = axes(walk, table, &EVERY, Axes::Model);
            let velocity = columns_history(walk, files, way, value, Interpolation::Cubic)?;
            Some(Turning { velocity, axes: axes?, start: None })
        }
        _ => {
            // The attitudes are those of the model or of the body frame.
            let axes = axes(walk, table, &[Axes::Model, Axes::Body], Axes::Model);
            let read = four_columns(walk, files, way, value, ATTITUDE)?;
            match Attitudes::new(&read).and_then(|attitudes| attitudes.followed(&read, files.end())) {
                Ok((velocity, start)) => Some(Turning {
                    velocity: VectorHistory::Columns(velocity),
                    axes: axes?,
                    start: Some(start),
                }),
                Err(diagnostic) => {
                    tell(walk, vec![*diagnostic]);
                    None
                }
            }
        }
    }
}

/// Reads the axis of a rotation.
fn axis_of(walk: &mut Walk<'_>, table: &TomlTable) -> Option<Vector3<f64>> {
    if table.contains_key("axis") { direction(walk, table, "axis") } else { Some(Vector3::z()) }
}

type Result<T> = std::result::Result<T, Box<Diagnostic>>;

/// Euler parameters at the rows of a file, of unit length and without jumps from p to -p.
struct Attitudes {
    parameters: Vec<Vector4<f64>>,
}

impl Attitudes {
    fn new(read: &FromFile) -> Result<Self> {
        let mut parameters: Vec<Vector4<f64>> = Vec::with_capacity(read.times.len());
        for (row, &line) in read.lines.iter().enumerate() {
            let row_parameters = Vector4::from_fn(|k, _| read.columns[k][row]);
            let length = row_parameters.norm();
            if (length - 1.0).abs() > LENGTH {
                let message = format!("the Euler parameters have the norm {length:.4}, expected 1");
                let help = "give as `columns` the cosine of half the angle, then the three components of the axis times the sine of half the angle";
                return Err(wrong(read, line, message, help));
            }
            let mut unit = row_parameters / length;
            if let Some(before) = parameters.last() {
                if before.dot(&unit) < 0.0 {
                    unit = -unit;
                }
                let angle = 2.0 * acos(before.dot(&unit).min(1.0));
                if angle > LARGEST_TURN {
                    let message = format!(
                        "the attitude turns by {:.0} degrees from the row before",
                        angle.to_degrees()
                    );
                    return Err(wrong(read, line, message, "write more rows per turn"));
                }
            }
            parameters.push(unit);
        }
        Ok(Self { parameters })
    }

    /// Returns the angular velocity that follows the attitudes, along their axes, and the attitude at time
    /// zero.
    ///
    /// The cubic spline s through the Euler parameters deviates slightly from unit length between the rows.
    /// p = s / |s| turns with omega = G(p) p' = G(s) s' / |s|^2, since G(s) s = 0. At the rows s' is
    /// accurate to one order more than elsewhere; the cubic spline through omega at the rows has a
    /// continuous second derivative.
    fn followed(&self, read: &FromFile, end: Option<f64>) -> Result<(Samples<3>, RotationVector)> {
        let splined = Samples::new(read.times.clone(), &self.parameters, Interpolation::Cubic, false);
        let omega = |time: f64| {
            let sample = splined.at(time);
            EulerParameters(sample.value.into()).map() * sample.rate / sample.value.norm_squared()
        };
        let rows: Vec<Vector3<f64>> = read.times.iter().map(|&time| omega(time)).collect();
        let velocity = Samples::new(read.times.clone(), &rows, Interpolation::Cubic, false);
        self.refuse_loss(read, &velocity, end.unwrap_or(f64::INFINITY))?;
        let start = EulerParameters(splined.at(0.0).value.into()).normalised();
        Ok((velocity, start.into()))
    }

    /// Returns an error if the rows are so far apart that the angular velocity through them leads to other
    /// attitudes until `end`. The angular velocity is integrated from row to row by the Magnus method of
    /// order four, Omega = h (w_1 + w_2) / 2 + sqrt(3) h^2 / 12 w_1 x w_2 at the two Gauss points, along
    /// turning axes.
    fn refuse_loss(&self, read: &FromFile, velocity: &Samples<3>, end: f64) -> Result<()> {
        let axes = |row: usize| EulerParameters(self.parameters[row].into()).axes();
        let mut integrated_axes = axes(0);
        for (row, ends) in read.times.windows(2).enumerate().take_while(|(_, ends)| ends[0] < end) {
            let (middle, h) = (0.5 * (ends[0] + ends[1]), ends[1] - ends[0]);
            let aside = h / 12f64.sqrt();
            let [a, b] = [middle - aside, middle + aside].map(|time| velocity.at(time).value);
            let turn = (a + b) * (0.5 * h) + a.cross(&b) * (3f64.sqrt() * h * h / 12.0);
            integrated_axes *= RotationVector(turn).axes();
            let apart = RotationVector::of_axes(&axes(row + 1).tr_mul(&integrated_axes)).0.norm();
            if apart > LARGEST_LOSS {
                let message = format!(
                    "the rows up to this line are too far apart: the interpolated angular velocity misses the attitude by {apart:.1e} radians"
                );
                return Err(wrong(
                    read,
                    read.lines[row + 1],
                    message,
                    "write more rows, or `angular_velocity_from`",
                ));
            }
        }
        Ok(())
    }
}

fn wrong(read: &FromFile, line: usize, message: String, help: &str) -> Box<Diagnostic> {
    let diagnostic = Diagnostic::new(Code::SeriesRow, message).in_file(read.file.path()).at_line(line);
    Box::new(diagnostic.with_help(help))
}
