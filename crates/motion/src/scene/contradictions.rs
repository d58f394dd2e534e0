//! Contradictions and repetitions within a scene.

use flexbody_base::diagnostic::Code;
use flexbody_base::text::walk::{TomlTable, Value, Walk, integer};
use toml::de::DeValue;

/// Adds a diagnostic for every entry that another part of the scene would silently override.
pub(super) fn contradictions(walk: &mut Walk<'_>, top: &TomlTable) {
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
