//! Reader of a scene from `scene.toml`. Its machine-readable contract is `schemas/scene.schema.json`.

use super::read_columns::{HistoryFiles, columns_history, finite, place_of, positive};
use super::read_requirements::{self, flag, requirements};
use super::read_values::{
    EVERY, axes, direction, history, list, loaded_place, mode_number, place, transposed, turning, vector,
};
use super::{
    Axes, Carried, CarriedSpin, Drive, History, Initial, Interpolation, Load, ModeStart, Point, Run, Scene,
    Scheme, Spin, VectorHistory,
};
use crate::dynamics::Terms;
use flexbody_base::diagnostic::Code;
use flexbody_base::provenance::SourceFile;
use flexbody_base::text::walk::{TomlTable, Value, Walk, integer};
use nalgebra::Vector3;
use std::ops::Range;
use toml::de::DeValue;

pub(super) const TOP: &[&str] =
    &["name", "run", "initial", "gravity", "load", "spin", "carried", "watch", "case", "variation", "robust"];
const RUN: &[&str] = &[
    "duration",
    "outputs",
    "most_steps",
    "method",
    "tolerance",
    "order",
    "step",
    "terms",
    "geometric_stiffness",
];
const INITIAL: &[&str] =
    &["origin", "velocity", "rotation", "angular_velocity", "axes", "mode", "deformation"];
const MODE: &[&str] = &["number", "amplitude", "rate"];
const LOAD: &[&str] =
    &["node", "interface", "named_load", "force", "torque", "force_from", "torque_from", "axes", "history"];
const SPIN: &[&str] = &["axis", "axes", "rate", "angular_velocity_from", "attitude_from", "hold"];
const WATCH: &[&str] = &["node", "interface"];
/// Default number of output times.
const OUTPUTS: i64 = 500;

/// Largest number of output times: more than a plot can show, and small enough for the memory.
const MOST_OUTPUTS: i64 = 1_000_000;

/// Default tolerance of the adaptive method: paths over some ten turns are accurate to 1e-7.
const TOLERANCE: f64 = 1e-9;

/// Range of tolerances that are meaningful in double precision.
const TOLERANCES: Range<f64> = 1e-14..0.1;

/// Reads a scene without cases; `stem` is its name if the file has none. As in this whole module, a result
/// `None` comes with a diagnostic in `found`.
pub(super) fn scene(walk: &mut Walk<'_>, top: &TomlTable, stem: String) -> Option<Scene> {
    let required = read_requirements::TABLES.map(|(name, _)| name);
    walk.known_keys(top, "the scene", &[TOP, &required].concat());
    let name = if top.contains_key("name") { walk.string(top, "name") } else { Some(stem) };
    let run = match walk.table(top, "run") {
        Some((table, span)) => run(walk, table, span),
        None => run(walk, &TomlTable::new(), 0..0),
    };
    let initial = match walk.table(top, "initial") {
        Some((table, _)) => initial(walk, table),
        None => Some(Initial::default()),
    };
    let files = HistoryFiles::new(run.as_ref());
    let gravity = top.get("gravity").map(|value| vector(walk, "gravity", value));
    let loads = list(walk, top, "load", |walk, table, span| load(walk, &files, table, span));
    let spin = walk.table(top, "spin").map(|(table, span)| spin(walk, &files, table, span));
    let carried = walk.table(top, "carried").map(|(table, span)| carried(walk, &files, table, span));
    let watched = list(walk, top, "watch", |walk, table, span| {
        walk.known_keys(table, "[[watch]]", WATCH);
        place(walk, table, span)
    });
    let requirements = requirements(walk, top);
    contradictions(walk, top);
    Some(Scene {
        name: name?,
        run: run?,
        initial: initial?,
        gravity: transposed(gravity)?,
        loads: loads?,
        spin: transposed(spin)?,
        carried: transposed(carried)?,
        watched: watched?,
        requirements: requirements?,
        source: Some(SourceFile::new("scene", walk.path, walk.fingerprint())),
        series: files.into_files(),
        resolved: false,
        case: None,
    })
}

fn run(walk: &mut Walk<'_>, table: &TomlTable, span: Range<usize>) -> Option<Run> {
    walk.known_keys(table, "[run]", RUN);
    let duration = if table.contains_key("duration") {
        positive(walk, table, "duration", &span).map(Some)
    } else {
        Some(None)
    };
    let mut count = |key: &str, default: i64, most: i64| match table.get(key) {
        None => Some(default),
        Some(value) => {
            let count = integer(value).filter(|count| (1..=most).contains(count));
            if count.is_none() {
                walk.wrong(value.span(), format!("`{key}` is not a number from 1 to {most}"));
            }
            count
        }
    };
    let outputs = count("outputs", OUTPUTS, MOST_OUTPUTS);
    let most_steps = count("most_steps", Run::MOST_STEPS as i64, i64::MAX);
    let terms = match table.get("terms") {
        None => Some(Terms::ALL),
        Some(value) => terms(walk, value),
    };
    let geometric_stiffness = flag(walk, table, "geometric_stiffness", true);
    let scheme = scheme(walk, table, &span);
    let outputs = usize::try_from(outputs?).ok()?;
    let most_steps = most_steps? as u64;
    let terms = Terms { geometric_stiffness: geometric_stiffness?, ..terms? };
    Some(Run { duration: duration?, outputs, most_steps, scheme: scheme?, terms })
}

fn scheme(walk: &mut Walk<'_>, table: &TomlTable, span: &Range<usize>) -> Option<Scheme> {
    let method =
        if table.contains_key("method") { walk.string(table, "method")? } else { "adaptive".to_owned() };
    let mut refuse = |keys: &[&str]| {
        for key in keys.iter().filter_map(|key| table.get(*key)) {
            walk.wrong(key.span(), format!("method `{method}` does not have this setting"));
        }
    };
    match method.as_str() {
        "adaptive" => {
            refuse(&["order", "step"]);
            adaptive(walk, table, span)
        }
        "conserving" => {
            refuse(&["tolerance"]);
            conserving(walk, table, span)
        }
        other => {
            let message = format!("`method` is `{other}`, expected `adaptive` or `conserving`");
            walk.wrong(place_of(table, "method", span), message);
            None
        }
    }
}

fn adaptive(walk: &mut Walk<'_>, table: &TomlTable, span: &Range<usize>) -> Option<Scheme> {
    let tolerance =
        if table.contains_key("tolerance") { positive(walk, table, "tolerance", span)? } else { TOLERANCE };
    if !TOLERANCES.contains(&tolerance) {
        let message =
            format!("`tolerance` is {tolerance}, expected {} to {}", TOLERANCES.start, TOLERANCES.end);
        walk.wrong(place_of(table, "tolerance", span), message);
        return None;
    }
    Some(Scheme::Adaptive { tolerance })
}

fn conserving(walk: &mut Walk<'_>, table: &TomlTable, span: &Range<usize>) -> Option<Scheme> {
    let order = match table.get("order") {
        None => 4,
        Some(value) => match integer(value) {
            Some(order @ (2 | 4 | 6)) => order as usize,
            _ => {
                walk.mistyped("order", value, "2, 4 or 6");
                return None;
            }
        },
    };
    let step = if table.contains_key("step") { Some(positive(walk, table, "step", span)?) } else { None };
    Some(Scheme::Conserving { order, step })
}

fn terms(walk: &mut Walk<'_>, value: &Value) -> Option<Terms> {
    let DeValue::Array(names) = value.get_ref() else {
        walk.mistyped("terms", value, "a list of \"W1\", \"W2\", \"W3\"");
        return None;
    };
    let mut terms = Terms { geometric_stiffness: true, ..Terms::NONE };
    for name in names.iter() {
        match name.get_ref() {
            DeValue::String(text) if text == "W1" => terms.w1 = true,
            DeValue::String(text) if text == "W2" => terms.w2 = true,
            DeValue::String(text) if text == "W3" => terms.w3 = true,
            _ => {
                walk.mistyped("terms", name, "\"W1\", \"W2\" or \"W3\"");
                return None;
            }
        }
    }
    Some(terms)
}

fn initial(walk: &mut Walk<'_>, table: &TomlTable) -> Option<Initial> {
    walk.known_keys(table, "[initial]", INITIAL);
    let mut or_zero = |key: &str| match table.get(key) {
        Some(value) => vector(walk, key, value),
        None => Some(Vector3::zeros()),
    };
    let [origin, velocity, rotation, angular_velocity] =
        ["origin", "velocity", "rotation", "angular_velocity"].map(&mut or_zero);
    let axes = axes(walk, table, &EVERY, Axes::Model);
    let modes = list(walk, table, "mode", |walk, table, span| {
        walk.known_keys(table, "[[initial.mode]]", MODE);
        let number = mode_number(walk, table, &span, "[[initial.mode]]");
        let mut or_zero = |key: &str| {
            if table.contains_key(key) { finite(walk, table, key, &span) } else { Some(0.0) }
        };
        let (amplitude, rate) = (or_zero("amplitude"), or_zero("rate"));
        Some(ModeStart { mode: number?, amplitude: amplitude?, rate: rate? })
    });
    let settled = match table.get("deformation") {
        None => Some(false),
        Some(value) => settled(walk, value),
    };
    Some(Initial {
        origin: origin?,
        velocity: velocity?,
        rotation: rotation?,
        angular_velocity: angular_velocity?,
        axes: axes?,
        modes: modes?,
        settled: settled?,
    })
}

/// Reads `deformation`; returns true if it is static.
fn settled(walk: &mut Walk<'_>, value: &Value) -> Option<bool> {
    let settled = match value.get_ref() {
        DeValue::String(text) if text == "static" => Some(true),
        DeValue::String(text) if text == "none" => Some(false),
        _ => None,
    };
    if settled.is_none() {
        walk.mistyped("deformation", value, "\"none\" or \"static\"");
    }
    settled
}

fn load(walk: &mut Walk<'_>, files: &HistoryFiles, table: &TomlTable, span: Range<usize>) -> Option<Load> {
    walk.known_keys(table, "[[load]]", LOAD);
    let at = loaded_place(walk, table, span.clone());
    let factor = match table.get("history") {
        Some(value) => history(walk, files, "history", value),
        None => Some(History::Constant(1.0)),
    };
    let has = |key: &str| table.contains_key(key);
    if has("named_load") {
        let of_places = ["force", "torque", "force_from", "torque_from", "axes"];
        for key in of_places.into_iter().filter(|key| has(key)) {
            let message = format!("a named load has no `{key}`: `history` is its amplitude");
            walk.wrong(span.clone(), message);
        }
        let Some(Point::NamedLoad(name)) = at else { return None };
        return Some(Load::named(name, factor?));
    }
    if !["force", "torque", "force_from", "torque_from"].into_iter().any(has) {
        walk.wrong(span.clone(), "load has neither `force` nor `torque`".to_owned());
    }
    if has("history") && !has("force") && !has("torque") && (has("force_from") || has("torque_from")) {
        let message = "`history` has no effect: it is a factor of `force` or `torque`, and the load has only columns of a file";
        walk.complain(Code::SceneContradicts, span.clone(), message.to_owned());
    }
    let mut part = |key: &str, key_of_columns: &str| match (table.get(key), table.get(key_of_columns)) {
        (None, None) => Some(VectorHistory::nothing()),
        (Some(value), None) => {
            let direction = vector(walk, key, value)?;
            Some(VectorHistory::Along { direction, factor: factor.clone()? })
        }
        (None, Some(value)) => columns_history(walk, files, key_of_columns, value, Interpolation::Linear),
        (Some(_), Some(value)) => {
            let message = format!("load has both `{key}` and `{key_of_columns}`");
            walk.complain(Code::SceneContradicts, value.span(), message);
            None
        }
    };
    let (force, torque) = (part("force", "force_from"), part("torque", "torque_from"));
    let axes = axes(walk, table, &EVERY, Axes::World);
    Some(Load { at: at?, force: force?, torque: torque?, axes: axes? })
}

fn spin(walk: &mut Walk<'_>, files: &HistoryFiles, table: &TomlTable, span: Range<usize>) -> Option<Spin> {
    walk.known_keys(table, "[spin]", SPIN);
    let hold = flag(walk, table, "hold", false);
    let turning = turning(walk, files, table, span, "[spin]")?;
    Some(Spin { velocity: turning.velocity, axes: turning.axes, start: turning.start, hold: hold? })
}

// Reader of the table of a scene about the carrier of the body.

const CARRIED: &[&str] = &["node", "interface", "spin", "translation"];
const CARRIED_SPIN: &[&str] = &["axis", "axes", "through", "rate", "angular_velocity_from", "attitude_from"];
const TRANSLATION: &[&str] = &[
    "direction",
    "displacement",
    "velocity",
    "acceleration",
    "displacement_from",
    "velocity_from",
    "acceleration_from",
];

/// Reads the carrier. As in this whole module, a result `None` comes with a diagnostic in `found`.
fn carried(
    walk: &mut Walk<'_>,
    files: &HistoryFiles,
    table: &TomlTable,
    span: Range<usize>,
) -> Option<Carried> {
    walk.known_keys(table, "[carried]", CARRIED);
    let by = place(walk, table, span);
    let mut part = |key: &str| {
        let found = walk.table(table, key);
        // The key exists but is no table; a diagnostic reports it.
        if found.is_none() && table.contains_key(key) { Err(()) } else { Ok(found) }
    };
    let (spin_table, translation_table) = (part("spin"), part("translation"));
    let spin = spin_table.map(|found| found.map(|(table, span)| carried_spin(walk, files, table, span)));
    let translation =
        translation_table.map(|found| found.map(|(table, span)| translation(walk, files, table, span)));
    Some(Carried { by: by?, spin: transposed(spin.ok()?)?, translation: transposed(translation.ok()?)? })
}

fn carried_spin(
    walk: &mut Walk<'_>,
    files: &HistoryFiles,
    table: &TomlTable,
    span: Range<usize>,
) -> Option<CarriedSpin> {
    walk.known_keys(table, "[carried.spin]", CARRIED_SPIN);
    let through = table.get("through").map(|value| vector(walk, "through", value));
    let turning = turning(walk, files, table, span, "[carried.spin]")?;
    Some(CarriedSpin {
        velocity: turning.velocity,
        axes: turning.axes,
        start: turning.start,
        through: transposed(through)?,
    })
}

/// Function that makes a drive of a history.
type Driven = fn(VectorHistory) -> Drive;

/// Derivatives that can define a translation: the key of a history along a direction, the key of three
/// columns, and the constructor of the drive.
const DERIVATIVES: [(&str, &str, Driven); 3] = [
    ("displacement", "displacement_from", Drive::Displacement),
    ("velocity", "velocity_from", Drive::Velocity),
    ("acceleration", "acceleration_from", Drive::Acceleration),
];

fn translation(
    walk: &mut Walk<'_>,
    files: &HistoryFiles,
    table: &TomlTable,
    span: Range<usize>,
) -> Option<Drive> {
    walk.known_keys(table, "[carried.translation]", TRANSLATION);
    let all = DERIVATIVES
        .into_iter()
        .flat_map(|(along, columns, drive)| [(along, false, drive), (columns, true, drive)]);
    let given: Vec<_> = all.filter(|(key, ..)| table.contains_key(*key)).collect();
    let [(key, has_columns, drive)] = given[..] else {
        let message = if given.is_empty() {
            "[carried.translation] has none of `displacement`, `velocity` and `acceleration`"
        } else {
            "[carried.translation] has more than one of `displacement`, `velocity` and `acceleration`"
        };
        walk.wrong(span, message.to_owned());
        return None;
    };
    let value = table.get(key)?;
    let mut has_direction = true;
    let history = if has_columns {
        if let Some(direction) = table.get("direction") {
            let message = format!(
                "`direction` of [carried.translation] has no effect: `{key}` has all three components"
            );
            walk.complain(Code::SceneContradicts, direction.span(), message);
            return None;
        }
        columns_history(walk, files, key, value, Interpolation::Cubic)?
    } else {
        if !table.contains_key("direction") {
            walk.wrong(span, "key `direction` is missing in [carried.translation]".to_owned());
        }
        let direction = direction(walk, table, "direction");
        let factor = history(walk, files, key, value)?;
        // Check the history even if the direction is invalid.
        has_direction = direction.is_some();
        VectorHistory::Along { direction: direction.unwrap_or_default(), factor }
    };
    if matches!(drive(VectorHistory::nothing()), Drive::Displacement(_)) && !history.is_smooth() {
        let message = format!(
            "`{key}` is linear between its points, so that the velocity jumps there: give `interpolation` = \"cubic\", a sine or a ramp, or prescribe a velocity or an acceleration"
        );
        walk.wrong(value.span(), message);
        return None;
    }
    has_direction.then(|| drive(history))
}

// Contradictions and repetitions within a scene.

/// Adds a diagnostic for every entry that another part of the scene would silently override.
fn contradictions(walk: &mut Walk<'_>, top: &TomlTable) {
    let spin = table_of(top, "spin");
    let holds = spin
        .and_then(|spin| spin.get("hold"))
        .is_some_and(|value| matches!(value.get_ref(), DeValue::Boolean(true)));
    let carried = top.contains_key("carried");
    let by = match (carried, spin) {
        (true, _) => Some("[carried] prescribes the motion of the body"),
        (_, Some(_)) => Some("[spin] prescribes the rotation"),
        _ => None,
    };
    if let (true, Some(value)) = (carried, top.get("spin")) {
        let message = "[spin] contradicts [carried], which prescribes the motion of the body: give [carried.spin] instead";
        walk.complain(Code::SceneContradicts, value.span(), message.to_owned());
    }
    if let Some(initial) = table_of(top, "initial") {
        let mut refuse = |key: &str, by: Option<&str>| {
            if let (Some(value), Some(by)) = (initial.get(key), by) {
                let message = format!("`{key}` of [initial] has no effect: {by}");
                walk.complain(Code::SceneContradicts, value.span(), message);
            }
        };
        refuse("angular_velocity", by);
        let carried_spin = table_of(top, "carried").and_then(|carried| table_of(carried, "spin"));
        let has_attitude =
            |table: Option<&TomlTable>| table.is_some_and(|table| table.contains_key("attitude_from"));
        let by_attitude = (has_attitude(spin) || has_attitude(carried_spin))
            .then_some("`attitude_from` prescribes the attitude at the start");
        refuse("rotation", by_attitude);
        refuse("velocity", by.filter(|_| carried).or(holds.then_some("`hold` of [spin] holds the body")));
        if !initial.contains_key("angular_velocity") {
            refuse("axes", Some("[initial] has no `angular_velocity` in these axes"));
        }
        if initial.contains_key("mode") {
            refuse("deformation", Some("[[initial.mode]] prescribes the deformation at the start"));
        }
        twice(walk, initial.get("mode"), "mode", numbered);
    }
    let is_list = |table: &TomlTable, key: &str| {
        table.get(key).is_some_and(|value| matches!(value.get_ref(), DeValue::Array(_)))
    };
    for (name, keys) in
        [("motion", &["angular_velocity", "angular_acceleration"][..]), ("attachment", &["inertia"])]
    {
        let Some(table) = table_of(top, name) else { continue };
        if let (Some(value), false) = (table.get("axes"), keys.iter().any(|key| is_list(table, key))) {
            let message = format!("`axes` of [{name}] has no effect: no value in [{name}] has components");
            walk.complain(Code::SceneContradicts, value.span(), message);
        }
    }
    let limits = table_of(top, "limits");
    twice(walk, limits.and_then(|limits| limits.get("mode")), "mode", numbered);
    twice(walk, top.get("watch"), "watched", placed);
    let terms = table_of(top, "run").and_then(|run| run.get("terms"));
    twice(walk, terms, "term", |value| match value.get_ref() {
        DeValue::String(text) => Some(text.to_string()),
        _ => None,
    });
}

fn table_of<'t>(top: &'t TomlTable<'_>, key: &str) -> Option<&'t TomlTable<'t>> {
    match top.get(key)?.get_ref() {
        DeValue::Table(table) => Some(table),
        _ => None,
    }
}

/// Adds a diagnostic for items of a list with equal `name`.
fn twice(
    walk: &mut Walk<'_>,
    list: Option<&Value<'_>>,
    what: &str,
    name: impl Fn(&Value<'_>) -> Option<String>,
) {
    let Some(DeValue::Array(items)) = list.map(|list| list.get_ref()) else { return };
    let mut seen = Vec::new();
    for item in items.iter() {
        let Some(name) = name(item) else { continue };
        if seen.contains(&name) {
            walk.complain(Code::SceneContradicts, item.span(), format!("{what} {name} is listed twice"));
        }
        seen.push(name);
    }
}

fn numbered(value: &Value<'_>) -> Option<String> {
    let DeValue::Table(table) = value.get_ref() else { return None };
    Some(integer(table.get("number")?)?.to_string())
}

fn placed(value: &Value<'_>) -> Option<String> {
    let DeValue::Table(table) = value.get_ref() else { return None };
    match (table.get("node"), table.get("interface")) {
        (Some(node), None) => Some(format!("node {}", integer(node)?)),
        (None, Some(value)) => match value.get_ref() {
            DeValue::String(text) => Some(format!("interface {text}")),
            _ => None,
        },
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::read_columns::{COLUMN, COLUMNS};
    use super::super::read_values::{ATTITUDE, HISTORIES};
    use super::*;

    /// The schema and the reader name the same keys.
    #[test]
    fn schema_lists_the_keys_of_the_reader() {
        let schema: serde_json::Value =
            serde_json::from_str(include_str!("../../../../schemas/scene.schema.json")).expect("JSON");
        let lists = [
            ("/properties/run/properties", RUN),
            ("/properties/initial/properties", INITIAL),
            ("/properties/initial/properties/mode/items/properties", MODE),
            ("/properties/load/items/properties", LOAD),
            ("/properties/spin/properties", SPIN),
            ("/properties/carried/properties", CARRIED),
            ("/properties/carried/properties/spin/properties", CARRIED_SPIN),
            ("/properties/carried/properties/translation/properties", TRANSLATION),
            ("/properties/watch/items/properties", WATCH),
            ("/$defs/history/anyOf/1/properties", HISTORIES[1].1),
            ("/$defs/history/anyOf/2/properties", HISTORIES[2].1),
            ("/$defs/history/anyOf/3/properties", HISTORIES[3].1),
            ("/$defs/history/anyOf/4/properties", COLUMN),
            ("/$defs/columns/properties", COLUMNS),
            ("/$defs/attitude/properties", ATTITUDE),
        ];
        let required = read_requirements::TABLES;
        let required = required.iter().map(|(name, keys)| (format!("/properties/{name}/properties"), *keys));
        let top = [TOP, &read_requirements::TABLES.map(|(name, _)| name)].concat();
        let of_case = super::super::read_cases::known_keys();
        let of_variation = super::super::read_cases::variation_keys();
        let lists = lists.into_iter().map(|(pointer, keys)| (pointer.to_owned(), keys));
        let whole = [
            ("/properties", &top[..]),
            ("/properties/case/items/properties", &of_case),
            ("/properties/variation/items/properties", &of_variation),
        ]
        .map(|(at, keys)| (at.to_owned(), keys));
        for (pointer, known) in lists.chain(required).chain(whole) {
            let pointer = &pointer;
            let object = schema.pointer(pointer).and_then(|v| v.as_object()).expect(pointer);
            let (mut listed, mut known): (Vec<&str>, Vec<&str>) =
                (object.keys().map(String::as_str).collect(), known.to_vec());
            listed.sort_unstable();
            known.sort_unstable();
            assert_eq!(listed, known, "{pointer}");
        }
    }
}
