//! Reader of the load cases of a scene file: keys outside `[[case]]` are common, and a case adds to them or
//! replaces them.

use super::read::{TOP, scene};
use super::read_columns::{finite, positive};
use super::read_values::{direction, place};
use super::{CaseName, Change, Scene, SceneVariation, Variations, read_requirements};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::text::walk::{TomlTable, Value, Walk, integer, parse_toml, read_toml, real};
use nalgebra::Unit;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::DeValue;

/// Tables of independent settings: a case replaces their keys one by one. Every other table is replaced as
/// a whole.
const BY_KEY: &[&str] = &["run", "initial", "motion", "attachment", "limits", "tolerance"];

/// Lists whose items a case adds to those of the scene.
const ADDED: &[&str] = &["load", "watch"];

/// Keys that may only appear at the top level, not in a `[[case]]`.
const ONLY_COMMON: &[&str] = &["case", "cost", "variation", "robust"];

/// Reads the load cases of a scene file in its order, one or more, and their variations; a file without `[[case]]` is a
/// single scene.
pub(super) fn read_cases(path: &Path) -> Result<(Vec<Scene>, Variations)> {
    read_toml(path, "scene", Code::SceneSyntax, whole_scene)
}

/// Reads the load cases of the text of a scene file, like [`read_cases`]; `path` is the file that it stands for.
pub(super) fn parse_cases(text: &str, path: &Path) -> Result<(Vec<Scene>, Variations)> {
    parse_toml(text, path, Code::SceneSyntax, whole_scene)
}

fn whole_scene(walk: &mut Walk<'_>, top: &TomlTable<'_>) -> Option<(Vec<Scene>, Variations)> {
    let stem = walk.path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let Some(list) = top.get("case") else {
        let only = vec![scene(walk, top, stem)?];
        let varied = variations(walk, top, std::slice::from_ref(top), &only)?;
        refuse_without_run(walk, top, &only);
        return Some((only, varied));
    };
    let all = cases(walk, top, list, stem)?;
    let tables: Vec<TomlTable<'_>> =
        tables(walk, list)?.iter().map(|(table, _)| merged(top, table)).collect();
    let varied = variations(walk, top, &tables, &all)?;
    refuse_without_run(walk, top, &all);
    Some((all, varied))
}

/// Reads the cases. As in this whole module, a result `None` comes with a diagnostic in `found`.
fn cases(walk: &mut Walk<'_>, top: &TomlTable<'_>, list: &Value<'_>, stem: String) -> Option<Vec<Scene>> {
    let whole = if top.contains_key("name") { walk.string(top, "name") } else { Some(stem) };
    let tables = tables(walk, list)?;
    let names = names(walk, &tables);
    let mut scenes = Vec::new();
    let mut found_by_case = Vec::new();
    let before = std::mem::take(&mut walk.diagnostics);
    for ((table, _), name) in tables.iter().zip(&names) {
        let full = format!("{}: {name}", whole.as_deref().unwrap_or_default());
        walk.known_keys(table, "[[case]]", &known_keys());
        let read = scene(walk, &merged(top, table), full);
        scenes.extend(read);
        found_by_case.push(std::mem::take(&mut walk.diagnostics));
    }
    walk.diagnostics = before;
    walk.diagnostics.extend(each_once(found_by_case, &names));
    if scenes.len() != tables.len() {
        return None;
    }
    let spans: Vec<_> = tables.iter().map(|(_, span)| span.clone()).collect();
    refuse_some_without_run(walk, &scenes, &names, &spans);
    let whole = whole?;
    for (scene, name) in scenes.iter_mut().zip(names) {
        scene.case = Some(CaseName { scene: whole.clone(), name });
    }
    Some(scenes)
}

/// Returns the tables of the list of cases, and their positions in the file.
fn tables<'t, 'i>(
    walk: &mut Walk<'_>,
    list: &'t Value<'i>,
) -> Option<Vec<(&'t TomlTable<'i>, Range<usize>)>> {
    let table = |value: &'t Value<'i>| match value.get_ref() {
        DeValue::Table(table) => Some((table, value.span())),
        _ => None,
    };
    let tables = match list.get_ref() {
        DeValue::Array(items) => items.iter().map(table).collect::<Option<Vec<_>>>(),
        _ => None,
    };
    let tables = tables.filter(|tables| !tables.is_empty());
    if tables.is_none() {
        walk.mistyped("case", list, "a list of [[case]] tables");
    }
    tables
}

/// Returns the names of the cases; adds a diagnostic for each invalid name.
fn names(walk: &mut Walk<'_>, tables: &[(&TomlTable<'_>, Range<usize>)]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for (table, span) in tables {
        let Some(value) = table.get("name") else {
            walk.wrong(span.clone(), "key `name` is missing in [[case]]".to_owned());
            names.push(String::new());
            continue;
        };
        let name = walk.string(table, "name").unwrap_or_default();
        let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        if !name.chars().all(is_plain) {
            let message = format!(
                "`name` of [[case]] is `{name}`, expected only letters, digits, `_` and `-` (file names contain it)"
            );
            walk.wrong(value.span(), message);
        }
        // Names become file names, and some file systems ignore case.
        if !name.is_empty() && names.iter().any(|other| other.eq_ignore_ascii_case(&name)) {
            walk.complain(Code::SceneContradicts, value.span(), format!("case `{name}` occurs twice"));
        }
        names.push(name);
    }
    names
}

/// Returns the keys that are allowed in a case.
pub(super) fn known_keys() -> Vec<&'static str> {
    let required = read_requirements::TABLES.map(|(name, _)| name);
    TOP.iter().chain(&required).copied().filter(|key| !ONLY_COMMON.contains(key)).collect()
}

/// Returns the table of a case: the `common` table, with the tables of [`BY_KEY`] merged key by key, the
/// lists of [`ADDED`] extended by the items of the case, and all other keys replaced by those of the case.
fn merged<'t>(common: &TomlTable<'t>, case: &TomlTable<'t>) -> TomlTable<'t> {
    let mut merged = common.clone();
    merged.remove("case");
    merged.remove("variation");
    merged.remove("robust");
    merged.remove("name");
    let known = known_keys();
    for (key, value) in case {
        let name = key.get_ref().as_ref();
        if name == "name" || !known.contains(&name) {
            continue;
        }
        let value = match common.get(name) {
            Some(ours) => joined(name, ours, value),
            None => value.clone(),
        };
        merged.insert(key.clone(), value);
    }
    merged
}

fn joined<'t>(name: &str, common: &Value<'t>, case: &Value<'t>) -> Value<'t> {
    let joined = match (common.get_ref(), case.get_ref()) {
        (DeValue::Table(ours), DeValue::Table(theirs)) if BY_KEY.contains(&name) => {
            let mut table = ours.clone();
            table.extend(theirs.iter().map(|(key, value)| (key.clone(), value.clone())));
            DeValue::Table(table)
        }
        (DeValue::Array(ours), DeValue::Array(theirs)) if ADDED.contains(&name) => {
            let mut list = ours.clone();
            theirs.iter().for_each(|item| list.push(item.clone()));
            DeValue::Array(list)
        }
        _ => return case.clone(),
    };
    Spanned::new(case.span(), joined)
}

/// Returns findings about common keys once, and all others with the name of their case.
fn each_once(found: Vec<Vec<Diagnostic>>, names: &[String]) -> Vec<Diagnostic> {
    let is_common = |diagnostic: &Diagnostic| found.iter().all(|own| own.contains(diagnostic));
    let mut distinct = Vec::new();
    for (at, (own, name)) in found.iter().zip(names).enumerate() {
        for one in own {
            match is_common(one) {
                true if at == 0 => distinct.push(one.clone()),
                true => {}
                false => distinct.push(one.clone().about(format!("case `{name}`"))),
            }
        }
    }
    distinct
}

/// Adds a diagnostic if variations are stated and nothing is simulated.
fn refuse_without_run(walk: &mut Walk<'_>, top: &TomlTable<'_>, cases: &[Scene]) {
    if let (Some(list), true) = (top.get("variation"), cases.iter().all(|scene| scene.run.duration.is_none()))
    {
        let refused = without_run(walk, list.span());
        walk.diagnostics.push(refused);
    }
}

/// Adds a diagnostic if only some cases have a duration: a body is chosen by motion or by ranges, not by
/// both.
fn refuse_some_without_run(walk: &mut Walk<'_>, scenes: &[Scene], names: &[String], spans: &[Range<usize>]) {
    if scenes.iter().all(|scene| scene.run.duration.is_none()) {
        return;
    }
    for ((scene, name), span) in scenes.iter().zip(names).zip(spans) {
        if scene.run.duration.is_none() {
            let message = format!("case `{name}` has no `duration`, but other cases have one");
            let diagnostic = walk.at(Code::SceneContradicts, span.clone(), message);
            walk.diagnostics
                .push(diagnostic.with_help("give `duration` in [run] of the scene or of every case"));
        }
    }
}

// Reader of the variations of a scene file, `[[variation]]`.

/// Keys of a variation, beside those of a `[[case]]`.
const OWN: [&str; 5] = ["of", "turn", "scale", "move", "speed"];
const TURN: &[&str] = &["axis", "degrees", "load"];
const SCALE: &[&str] = &["factor", "load"];
const MOVE: &[&str] = &["load", "node", "interface"];

/// Returns the keys that are allowed in a variation.
pub(super) fn variation_keys() -> Vec<&'static str> {
    let of_case = known_keys();
    of_case.into_iter().chain(OWN).collect()
}

/// Reads the variations of load cases that were read from `tables`, one table for each case.
fn variations(
    walk: &mut Walk<'_>,
    top: &TomlTable<'_>,
    tables: &[TomlTable<'_>],
    cases: &[Scene],
) -> Option<Variations> {
    let is_robust = top.contains_key("robust") && read_requirements::flag(walk, top, "robust", false)?;
    let Some(list) = top.get("variation") else {
        return Some(if is_robust { Variations::Robust } else { Variations::Standard });
    };
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
        walk.known_keys(table, "[[variation]]", &variation_keys());
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
    let all = changes(walk, table, span, varied_scene.loads.len())?;
    let is_named = |load: usize| varied_scene.loads[load].is_named();
    let misplaced = |change: &Change| match change {
        Change::Move { load, .. } | Change::Turn { load: Some(load), .. } => is_named(*load),
        _ => false,
    };
    if all.iter().any(misplaced) {
        let message =
            "a named load has neither a point nor a direction that a variation can change: give `scale`";
        walk.wrong(span.clone(), message.to_owned());
        return None;
    }
    for change in all {
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
fn without_run(walk: &Walk<'_>, span: Range<usize>) -> Diagnostic {
    let message = "variations are given, but the scene has no run that they vary".to_owned();
    walk.at(Code::SceneContradicts, span, message).with_help("give `duration` in [run]")
}
