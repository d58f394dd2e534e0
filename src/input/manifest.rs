//! The manifest `model.toml`. Its machine-readable contract is `schemas/manifest.schema.json`.

use super::bytes::InputFile;
use super::model_files::{MatrixLocation, ModelFiles, stem};
use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use crate::units::UnitSystem;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

mod basis;
mod damping;
mod geometric_stiffness;
mod interface;

const TOP: &[&str] = &["model", "files", "interface", "damping", "geometric_stiffness", "basis"];
const MODEL: &[&str] = &["name", "dimension", "units"];
const UNITS: &[&str] = &["length", "mass", "time"];
const FILES: &[&str] = &["stiffness", "mass", "nodes", "dofs"];

/// Reads a manifest. Relative paths in it are taken from its folder. The files themselves are not touched.
///
/// # Errors
/// FB101, FB106 when it cannot be read; FB201 for syntax, unknown, missing or mistyped keys; FB202 for units;
/// FB205 for nodes listed twice in an interface. All of them, in the order of lines.
pub fn read_manifest(path: impl AsRef<Path>) -> Result<ModelFiles> {
    let path = path.as_ref();
    let file = InputFile::open(path)?;
    let text = std::str::from_utf8(file.bytes()).map_err(|e| {
        let line = line_at(file.bytes(), e.valid_up_to());
        Diagnostic::new(Code::ManifestSyntax, "manifest is not UTF-8 text").in_file(path).at_line(line)
    })?;
    let mut walk = Walk { path, text, found: Vec::new() };
    let (document, errors) = DeTable::parse_recoverable(text);
    for error in &errors {
        let message = error.message().to_owned();
        walk.complain(Code::ManifestSyntax, error.span().unwrap_or(0..0), message);
    }
    // After a syntax error the rest of the document is guesswork.
    let files = if errors.is_empty() { walk.model(document.get_ref()) } else { None };
    match files {
        Some(files) if walk.found.is_empty() => Ok(files),
        _ => {
            walk.found.sort_by_key(Diagnostic::line);
            Err(Error::new(walk.found))
        }
    }
}

type Table<'t> = DeTable<'t>;
type Value<'t> = Spanned<DeValue<'t>>;

/// The line (from 1) of the byte at `offset`.
fn line_at(text: &[u8], offset: usize) -> usize {
    1 + text[..offset.min(text.len())].iter().filter(|&&b| b == b'\n').count()
}

/// Reads tables and collects what is wrong with them.
struct Walk<'a> {
    path: &'a Path,
    text: &'a str,
    found: Vec<Diagnostic>,
}

impl Walk<'_> {
    fn at(&self, code: Code, span: Range<usize>, message: String) -> Diagnostic {
        let line = line_at(self.text.as_bytes(), span.start);
        Diagnostic::new(code, message).in_file(self.path).at_line(line)
    }

    fn complain(&mut self, code: Code, span: Range<usize>, message: String) {
        self.found.push(self.at(code, span, message));
    }

    /// `None` only with something in `found`.
    fn model(&mut self, top: &Table) -> Option<ModelFiles> {
        self.known_keys(top, "the manifest", TOP);
        let model = self.table(top, "model");
        let model_keys = model.map(|(table, _)| table);
        let name = model_keys.and_then(|table| {
            self.known_keys(table, "[model]", MODEL);
            self.string(table, "name")
        });
        let dimension = model_keys.and_then(|table| self.dimension(table)).unwrap_or(3);
        let units = match model_keys.and_then(|table| self.table(table, "units")) {
            Some((table, span)) => self.units(table, span)?,
            None => UnitSystem::default(),
        };
        let interfaces = self.interfaces(top, usize::from(dimension));
        let damping = self.damping(top);
        let geometric_stiffness = self.geometric_stiffness(top);
        let residual_vectors = self.residual_vectors(top);
        let Some((files, span)) = self.table(top, "files") else {
            if !top.contains_key("files") {
                let message = "table [files] is missing".to_owned();
                self.found.push(Diagnostic::new(Code::ManifestSyntax, message).in_file(self.path));
            }
            return None;
        };
        self.known_keys(files, "[files]", FILES);
        let mut required = |key: &str| {
            if !files.contains_key(key) {
                self.complain(
                    Code::ManifestSyntax,
                    span.clone(),
                    format!("key `{key}` is missing in [files]"),
                );
            }
            self.string(files, key)
        };
        let (stiffness, mass, nodes) = (required("stiffness"), required("mass"), required("nodes"));
        let dofs = self.string(files, "dofs");
        let folder = self.path.parent().unwrap_or(Path::new(""));
        Some(ModelFiles {
            name: name.unwrap_or_else(|| stem(self.path)),
            dimension,
            units,
            stiffness: MatrixLocation::parse(stiffness?).relative_to(folder),
            mass: MatrixLocation::parse(mass?).relative_to(folder),
            nodes: folder.join(nodes?),
            dofs: dofs.map(|dofs| folder.join(dofs)),
            interfaces: interfaces?,
            damping,
            geometric_stiffness,
            residual_vectors,
            manifest: Some(self.path.to_path_buf()),
        })
    }

    /// Complains about every key that is not in `known`, naming the nearest that is.
    fn known_keys(&mut self, table: &Table, place: &str, known: &[&str]) {
        for key in table.keys() {
            let name = key.get_ref().as_ref();
            if known.contains(&name) {
                continue;
            }
            let nearest = known
                .iter()
                .map(|candidate| (strsim::damerau_levenshtein(name, candidate), candidate))
                .min()
                .filter(|&(distance, candidate)| distance <= 2 && distance < candidate.len());
            let unknown = format!("key `{name}` is not known in {place}");
            let unknown = self.at(Code::ManifestSyntax, key.span(), unknown);
            let help = match nearest {
                Some((_, candidate)) => format!("did you mean `{candidate}`?"),
                None => format!("known keys: {}", known.join(", ")),
            };
            self.found.push(unknown.with_help(help));
        }
    }

    fn mistyped(&mut self, key: &str, value: &Value, expected: &str) {
        let message = format!("`{key}` is {}, expected {expected}", with_article(value.get_ref().type_str()));
        self.complain(Code::ManifestSyntax, value.span(), message);
    }

    /// A table and where it stands.
    fn table<'t, 'i>(&mut self, table: &'t Table<'i>, key: &str) -> Option<(&'t Table<'i>, Range<usize>)> {
        let value = table.get(key)?;
        match value.get_ref() {
            DeValue::Table(inner) => Some((inner, value.span())),
            _ => {
                self.mistyped(key, value, "a table");
                None
            }
        }
    }

    /// A string that is not empty.
    fn string(&mut self, table: &Table, key: &str) -> Option<String> {
        let value = table.get(key)?;
        match value.get_ref() {
            DeValue::String(text) if text.is_empty() => {
                self.complain(Code::ManifestSyntax, value.span(), format!("`{key}` is empty"));
                None
            }
            DeValue::String(text) => Some(text.to_string()),
            _ => {
                self.mistyped(key, value, "a string");
                None
            }
        }
    }

    fn dimension(&mut self, table: &Table) -> Option<u8> {
        let value = table.get("dimension")?;
        match integer(value) {
            Some(2) => Some(2),
            Some(3) => Some(3),
            Some(other) => {
                let message = format!("`dimension` is {other}, expected 2 or 3");
                self.complain(Code::ManifestSyntax, value.span(), message);
                None
            }
            None => {
                self.mistyped("dimension", value, "2 or 3");
                None
            }
        }
    }

    fn units(&mut self, table: &Table, span: Range<usize>) -> Option<UnitSystem> {
        self.known_keys(table, "[model.units]", UNITS);
        let names: Vec<Option<String>> =
            UNITS.iter().map(|key| self.unit(table, key, span.clone())).collect();
        let [Some(length), Some(mass), Some(time)] = names.as_slice() else {
            return None;
        };
        UnitSystem::parse(length, mass, time).ok()
    }

    /// The name of one unit, or its factor to SI as it is written.
    fn unit(&mut self, table: &Table, key: &str, span: Range<usize>) -> Option<String> {
        let Some(value) = table.get(key) else {
            let message = format!("key `{key}` is missing in [model.units]");
            let diagnostic = self.at(Code::ManifestSyntax, span, message);
            self.found.push(diagnostic.with_help("[model.units] states all three: length, mass, time"));
            return None;
        };
        let name = match value.get_ref() {
            DeValue::String(name) => name.to_string(),
            DeValue::Float(number) => number.as_str().to_owned(),
            DeValue::Integer(number) => number.to_string(),
            _ => {
                self.mistyped(key, value, "a unit or a number");
                return None;
            }
        };
        let of = |which: &str, default: &str| if which == key { name.clone() } else { default.to_owned() };
        if UnitSystem::parse(&of("length", "m"), &of("mass", "kg"), &of("time", "s")).is_err() {
            self.complain(Code::ManifestUnit, value.span(), format!("unit of {key} `{name}` is not known"));
            return None;
        }
        Some(name)
    }
}

fn integer(value: &Value) -> Option<i64> {
    let number = value.get_ref().as_integer()?;
    i64::from_str_radix(number.as_str(), number.radix()).ok()
}

fn real(value: &Value) -> Option<f64> {
    match value.get_ref() {
        DeValue::Float(number) => number.as_str().parse().ok(),
        DeValue::Integer(_) => integer(value).map(|number| number as f64),
        _ => None,
    }
}

fn with_article(kind: &str) -> String {
    let article = if kind.starts_with(['a', 'i']) { "an" } else { "a" };
    format!("{article} {kind}")
}

#[cfg(test)]
mod tests {
    use super::basis::BASIS;
    use super::damping::{BAND, DAMPING, RAYLEIGH};
    use super::geometric_stiffness::GEOMETRIC_STIFFNESS;
    use super::interface::INTERFACE;
    use super::*;

    /// The schema and the reader name the same keys.
    #[test]
    fn schema_lists_the_keys_of_the_reader() {
        let schema: serde_json::Value =
            serde_json::from_str(include_str!("../../schemas/manifest.schema.json")).unwrap();
        let keys = |pointer: &str| -> Vec<String> {
            let object = schema.pointer(pointer).and_then(|v| v.as_object()).expect(pointer);
            object.keys().cloned().collect()
        };
        for (pointer, known) in [
            ("/properties", TOP),
            ("/properties/model/properties", MODEL),
            ("/properties/model/properties/units/properties", UNITS),
            ("/properties/files/properties", FILES),
            ("/properties/interface/items/properties", INTERFACE),
            ("/properties/damping/properties", DAMPING),
            ("/properties/damping/properties/bands/items/properties", BAND),
            ("/properties/damping/properties/rayleigh/properties", RAYLEIGH),
            ("/properties/geometric_stiffness/items/properties", GEOMETRIC_STIFFNESS),
            ("/properties/basis/properties", BASIS),
        ] {
            let mut known: Vec<&str> = known.to_vec();
            known.sort_unstable();
            let mut listed = keys(pointer);
            listed.sort_unstable();
            assert_eq!(listed, known, "{pointer}");
        }
    }
}
