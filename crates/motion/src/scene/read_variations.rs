//! Reader of the variations of a scene file, `[[variation]]`.

use super::read::scene;
use super::read_cases::{known_keys, merged};
use super::read_numbers::{finite, positive};
use super::read_values::{direction, place};
use super::{Change, Scene, SceneVariation, Variations};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::walk::{TomlTable, Value, Walk, integer, real};
use nalgebra::Unit;
use std::ops::Range;
use toml::de::DeValue;

/// Keys of a variation, beside those of a `[[case]]`.
const OWN: [&str; 5] = ["of", "turn", "scale", "move", "speed"];
const TURN: &[&str] = &["axis", "degrees", "load"];
const SCALE: &[&str] = &["factor", "load"];
const MOVE: &[&str] = &["load", "node", "interface"];

/// Returns the keys that are allowed in a variation.
pub(super) fn known() -> Vec<&'static str> {
    let of_case = known_keys();
    of_case.into_iter().chain(OWN).collect()
}

/// Reads the variations of load cases that were read from `tables`, one table for each case.
pub(super) fn variations(
    walk: &mut Walk<'_>,
    top: &TomlTable<'_>,
    tables: &[TomlTable<'_>],
    cases: &[Scene],
) -> Option<Variations> {
    let Some(list) = top.get("variation") else { return Some(Variations::Standard) };
    let items = match list.get_ref() {
        DeValue::Array(items) => items.iter().map(as_table).collect::<Option<Vec<_>>>(),
        _ => None,
    };
    let Some(items) = items else {
        walk.mistyped("variation", list, "a list of [[variation]] tables");
        return None;
    };
    let mut all = Vec::new();
    let mut names: Vec<String> = Vec::new();
    for (table, span) in items {
        walk.known_keys(table, "[[variation]]", &known());
        let name = name(walk, table, &span, &mut names);
        for at in cases_of(walk, table, cases)? {
            let scene = varied(walk, &tables[at], table, &span, &cases[at])?;
            all.push(SceneVariation { name: name.clone()?, case: at, scene });
        }
    }
    Some(Variations::Stated(all))
}

fn as_table<'t, 'i>(value: &'t Value<'i>) -> Option<(&'t TomlTable<'i>, Range<usize>)> {
    match value.get_ref() {
        DeValue::Table(table) => Some((table, value.span())),
        _ => None,
    }
}

/// Returns the name of a variation, which must be its own.
fn name(
    walk: &mut Walk<'_>,
    table: &TomlTable<'_>,
    span: &Range<usize>,
    names: &mut Vec<String>,
) -> Option<String> {
    if !table.contains_key("name") {
        walk.wrong(span.clone(), "key `name` is missing in [[variation]]".to_owned());
        return None;
    }
    let name = walk.string(table, "name")?;
    if names.contains(&name) {
        walk.complain(Code::SceneContradicts, span.clone(), format!("two variations are named `{name}`"));
        return None;
    }
    names.push(name.clone());
    Some(name)
}

/// Returns the indices of the load cases that a variation varies: the one that `of` names, or all.
fn cases_of(walk: &mut Walk<'_>, table: &TomlTable<'_>, cases: &[Scene]) -> Option<Vec<usize>> {
    let Some(value) = table.get("of") else { return Some((0..cases.len()).collect()) };
    let name = walk.string(table, "of")?;
    let at = cases.iter().position(|scene| scene.case_name() == Some(name.as_str()));
    if at.is_none() {
        let names: Vec<&str> = cases.iter().filter_map(Scene::case_name).collect();
        let known =
            if names.is_empty() { "no cases".to_owned() } else { format!("the cases {}", names.join(", ")) };
        walk.wrong(value.span(), format!("`of` names the case `{name}`, and the scene has {known}"));
    }
    at.map(|at| vec![at])
}

/// Reads the scene of a variation: keys of the case are merged as for `[[case]]`, then the changes are made.
fn varied(
    walk: &mut Walk<'_>,
    case: &TomlTable<'_>,
    table: &TomlTable<'_>,
    span: &Range<usize>,
    unchanged: &Scene,
) -> Option<Scene> {
    let mut varied_scene = scene(walk, &merged(case, table), unchanged.name.clone())?;
    varied_scene.name.clone_from(&unchanged.name);
    varied_scene.case.clone_from(&unchanged.case);
    for change in changes(walk, table, span, varied_scene.loads.len())? {
        varied_scene = varied_scene.changed(&change);
    }
    if varied_scene == *unchanged {
        walk.wrong(span.clone(), "the variation changes nothing of the scene".to_owned());
        return None;
    }
    if varied_scene.run.duration.is_none() && unchanged.run.duration.is_some() {
        walk.wrong(span.clone(), "the variation has no duration, and the scene has one".to_owned());
        return None;
    }
    Some(varied_scene)
}

/// Reads `turn`, `scale`, `move` and `speed`.
fn changes(
    walk: &mut Walk<'_>,
    table: &TomlTable<'_>,
    span: &Range<usize>,
    loads: usize,
) -> Option<Vec<Change>> {
    let mut all = Vec::new();
    if let Some((keys, span)) = walk.table(table, "turn") {
        walk.known_keys(keys, "`turn`", TURN);
        if !keys.contains_key("axis") {
            walk.wrong(span.clone(), "key `axis` is missing in `turn`".to_owned());
        }
        let axis = direction(walk, keys, "axis");
        let degrees = finite(walk, keys, "degrees", &span);
        let load = load(walk, keys, loads)?;
        all.push(Change::Turn { axis: Unit::new_normalize(axis?), angle: degrees?.to_radians(), load });
    }
    if let Some(value) = table.get("scale") {
        all.push(scale(walk, value, loads)?);
    }
    if let Some((keys, span)) = walk.table(table, "move") {
        walk.known_keys(keys, "`move`", MOVE);
        let load = load(walk, keys, loads)?;
        let to = place(walk, keys, span.clone())?;
        match (load, loads) {
            (Some(load), _) => all.push(Change::Move { load, to }),
            (None, 1) => all.push(Change::Move { load: 0, to }),
            _ => {
                let message = format!("`move` does not say which of {loads} loads: give `load`, its number");
                walk.wrong(span, message);
                return None;
            }
        }
    }
    if table.contains_key("speed") {
        all.push(Change::Speed(positive(walk, table, "speed", span)?));
    }
    Some(all)
}

/// Reads `scale`: a factor, or a table with the number of the load.
fn scale(walk: &mut Walk<'_>, value: &Value<'_>, loads: usize) -> Option<Change> {
    if let Some((own, span)) = as_table(value) {
        walk.known_keys(own, "`scale`", SCALE);
        let factor = finite(walk, own, "factor", &span);
        let load = load(walk, own, loads)?;
        return Some(Change::Scale { factor: factor?, load });
    }
    let factor = real(value).filter(|factor| factor.is_finite());
    if factor.is_none() {
        walk.mistyped("scale", value, "a number or a table { factor, load }");
    }
    Some(Change::Scale { factor: factor?, load: None })
}

/// Reads the number of a load, returned from 0; `Some(None)` if none is given.
fn load(walk: &mut Walk<'_>, table: &TomlTable<'_>, loads: usize) -> Option<Option<usize>> {
    let Some(value) = table.get("load") else { return Some(None) };
    let number = integer(value).and_then(|number| usize::try_from(number).ok());
    let number = number.filter(|number| (1..=loads).contains(number));
    if number.is_none() {
        walk.wrong(
            value.span(),
            format!("`load` is not the number of one of the {loads} loads of the scene"),
        );
    }
    Some(Some(number? - 1))
}

/// Returns the diagnostic for variations of a scene without a run.
pub(super) fn without_run(walk: &Walk<'_>, span: Range<usize>) -> Diagnostic {
    let message = "variations are given, but the scene has no run that they vary".to_owned();
    walk.at(Code::SceneContradicts, span, message).with_help("give `duration` in [run]")
}
