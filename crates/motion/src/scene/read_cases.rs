//! Reader of the load cases of a scene file: keys outside `[[case]]` are common, and a case adds to them or
//! replaces them.

use super::read::{TOP, scene};
use super::read_variations::{variations, without_run};
use super::{CaseName, Scene, Variations, read_requirements};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::text::walk::{TomlTable, Value, Walk, parse_toml, read_toml};
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
const ONLY_COMMON: &[&str] = &["case", "cost", "variation"];

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
    let before = std::mem::take(&mut walk.found);
    for ((table, _), name) in tables.iter().zip(&names) {
        let full = format!("{}: {name}", whole.as_deref().unwrap_or_default());
        walk.known_keys(table, "[[case]]", &known_keys());
        let read = scene(walk, &merged(top, table), full);
        scenes.extend(read);
        found_by_case.push(std::mem::take(&mut walk.found));
    }
    walk.found = before;
    walk.found.extend(each_once(found_by_case, &names));
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
pub(super) fn merged<'t>(common: &TomlTable<'t>, case: &TomlTable<'t>) -> TomlTable<'t> {
    let mut merged = common.clone();
    merged.remove("case");
    merged.remove("variation");
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
    let is_common = |one: &Diagnostic| found.iter().all(|own| own.contains(one));
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
        walk.found.push(refused);
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
            walk.found.push(diagnostic.with_help("give `duration` in [run] of the scene or of every case"));
        }
    }
}
