//! The manifest `model.toml`. Its machine-readable contract is `schemas/manifest.schema.json`.

use super::jobs::JobFile;
use super::model_files::{MatrixLocation, ModelFiles, ModelSource, TableFiles, stem};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::text::walk::{TomlTable, Value, Walk, integer, read_toml, real};
use flexbody_base::units::UnitSystem;
use std::ops::Range;
use std::ops::{Deref, DerefMut};
use std::path::Path;
use toml::de::DeValue;

mod basis;
mod damping;
mod geometric_stiffness;
mod interface;
mod recovery;
mod region;

const TOP: &[&str] = &["model", "files", "interface", "damping", "geometric_stiffness", "recovery", "basis"];
const MODEL: &[&str] = &["name", "dimension", "units", "allow_implausible"];
const UNITS: &[&str] = &["length", "mass", "time"];
const FILES: &[&str] = &["stiffness", "mass", "nodes", "dofs", "job", "program", "matrices", "mesh"];

/// Reads a manifest. Relative paths in it are taken from its folder. The files that it names are not opened.
///
/// # Errors
/// FB101, FB106 if it cannot be read; FB201 for syntax, unknown, missing or mistyped keys; FB202 for units; FB205 for
/// nodes listed twice in an interface. All errors are reported, in the order of lines.
pub fn read_manifest(path: impl AsRef<Path>) -> Result<ModelFiles> {
    read_toml(path.as_ref(), "manifest", Code::ManifestSyntax, |walk, top| ManifestWalk(walk).model(top))
}

/// Walk through a manifest. The methods that read its tables are defined next to the types that they return.
struct ManifestWalk<'w, 'a>(&'w mut Walk<'a>);

impl<'a> Deref for ManifestWalk<'_, 'a> {
    type Target = Walk<'a>;

    fn deref(&self) -> &Walk<'a> {
        self.0
    }
}

impl DerefMut for ManifestWalk<'_, '_> {
    fn deref_mut(&mut self) -> &mut Self::Target {
        self.0
    }
}

impl ManifestWalk<'_, '_> {
    /// Returns the tables `[[key]]`; `None` if the value is not a list. Entries that are no tables are left out; the
    /// errors are in `found`.
    fn tables<'t>(
        &mut self,
        top: &'t TomlTable<'_>,
        key: &str,
    ) -> Option<Vec<(&'t TomlTable<'t>, Range<usize>)>> {
        let expected = format!("a list of tables: write [[{key}]]");
        let Some(value) = top.get(key) else { return Some(Vec::new()) };
        let DeValue::Array(list) = value.get_ref() else {
            self.mistyped(key, value, &expected);
            return None;
        };
        let mut tables = Vec::new();
        for item in list.iter() {
            match item.get_ref() {
                DeValue::Table(table) => tables.push((table, item.span())),
                _ => self.mistyped(key, item, &expected),
            }
        }
        Some(tables)
    }

    /// Reads the manifest. `None` means that `found` has errors.
    fn model(&mut self, top: &TomlTable) -> Option<ModelFiles> {
        self.known_keys(top, "the manifest", TOP);
        let model = self.table(top, "model");
        let model_keys = model.map(|(table, _)| table);
        let name = model_keys.and_then(|table| {
            self.known_keys(table, "[model]", MODEL);
            self.string(table, "name")
        });
        let dimension = model_keys.and_then(|table| self.dimension(table)).unwrap_or(3);
        let allow_implausible = model_keys.and_then(|table| self.allow_implausible(table)).unwrap_or(false);
        let units = match model_keys.and_then(|table| self.table(table, "units")) {
            Some((table, span)) => self.units(table, span)?,
            None => UnitSystem::default(),
        };
        let interfaces = self.interfaces(top, usize::from(dimension));
        let damping = self.damping(top);
        let geometric_stiffness = self.geometric_stiffness(top);
        let recoveries = self.recoveries(top, usize::from(dimension));
        let residual_vectors = self.residual_vectors(top);
        let Some((files, span)) = self.table(top, "files") else {
            if !top.contains_key("files") {
                let message = "table [files] is missing".to_owned();
                let nowhere = Diagnostic::new(Code::ManifestSyntax, message).in_file(self.path);
                self.found.push(nowhere);
            }
            return None;
        };
        let source = self.source(files, span);
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let mesh = self.string(files, "mesh").map(|mesh| folder.join(mesh));
        Some(ModelFiles {
            name: name.unwrap_or_else(|| stem(self.path)),
            dimension,
            units,
            allow_implausible,
            source: source?,
            mesh,
            interfaces: interfaces?,
            damping,
            geometric_stiffness,
            recoveries,
            residual_vectors,
            manifest: Some(self.path.to_path_buf()),
            manifest_sha256: Some(self.fingerprint()),
            keep_in: None,
        })
    }

    /// Reads the source of the matrices: one file each, or a job.
    fn source(&mut self, files: &TomlTable, span: Range<usize>) -> Option<ModelSource> {
        self.known_keys(files, "[files]", FILES);
        let folder = self.path.parent().unwrap_or(Path::new("")).to_path_buf();
        if files.contains_key("job") {
            let others = ["stiffness", "mass", "nodes", "dofs"].iter().find(|key| files.contains_key(**key));
            if let Some(key) = others {
                let message = format!("[files] has both `job` and `{key}`");
                self.complain(Code::ManifestSyntax, span, message);
                return None;
            }
            let (job, program) = (self.string(files, "job"), self.string(files, "program"));
            let matrices = self.matrix_names(files);
            return Some(ModelSource::Job(JobFile { path: folder.join(job?), program, matrices }));
        }
        let mut required = |key: &str| {
            if !files.contains_key(key) {
                let message = format!("key `{key}` is missing in [files]");
                self.complain(Code::ManifestSyntax, span.clone(), message);
            }
            self.string(files, key)
        };
        let (stiffness, mass, nodes) = (required("stiffness"), required("mass"), required("nodes"));
        let dofs = self.string(files, "dofs");
        if let Some(key) = ["program", "matrices"].iter().find(|key| files.contains_key(**key)) {
            self.complain(Code::ManifestSyntax, span, format!("`{key}` in [files] belongs to a `job`"));
        }
        Some(ModelSource::Tables(TableFiles {
            stiffness: MatrixLocation::parse(stiffness?).relative_to(&folder),
            mass: MatrixLocation::parse(mass?).relative_to(&folder),
            nodes: folder.join(nodes?),
            dofs: dofs.map(|dofs| folder.join(dofs)),
        }))
    }

    /// Reads the names of stiffness and mass matrix among those of a job.
    fn matrix_names(&mut self, files: &TomlTable) -> Option<[String; 2]> {
        let value = files.get("matrices")?;
        let names = value.get_ref().as_array().map(|all| {
            all.iter().filter_map(|name| name.get_ref().as_str().map(str::to_owned)).collect::<Vec<_>>()
        });
        let names = names.and_then(|names| <[String; 2]>::try_from(names).ok());
        if names.is_none() {
            let message = "`matrices` must be two names, as in [\"KGG\", \"MGG\"]".to_owned();
            self.complain(Code::ManifestSyntax, value.span(), message);
        }
        names
    }

    fn dimension(&mut self, table: &TomlTable) -> Option<u8> {
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

    fn allow_implausible(&mut self, table: &TomlTable) -> Option<bool> {
        let value = table.get("allow_implausible")?;
        match value.get_ref() {
            DeValue::Boolean(allowed) => Some(*allowed),
            _ => {
                self.mistyped("allow_implausible", value, "true or false");
                None
            }
        }
    }

    fn units(&mut self, table: &TomlTable, span: Range<usize>) -> Option<UnitSystem> {
        self.known_keys(table, "[model.units]", UNITS);
        let names: Vec<Option<String>> =
            UNITS.iter().map(|key| self.unit(table, key, span.clone())).collect();
        let [Some(length), Some(mass), Some(time)] = names.as_slice() else {
            return None;
        };
        UnitSystem::parse(length, mass, time).ok()
    }

    /// Reads the name of one unit, or its factor to SI as written.
    fn unit(&mut self, table: &TomlTable, key: &str, span: Range<usize>) -> Option<String> {
        let Some(value) = table.get(key) else {
            let message = format!("key `{key}` is missing in [model.units]");
            let diagnostic = self.at(Code::ManifestSyntax, span, message);
            self.found.push(diagnostic.with_help("state all three in [model.units]: length, mass, time"));
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
        let unit = |which: &str, default: &str| if which == key { name.clone() } else { default.to_owned() };
        if UnitSystem::parse(&unit("length", "m"), &unit("mass", "kg"), &unit("time", "s")).is_err() {
            self.complain(Code::ManifestUnit, value.span(), format!("unit of {key} `{name}` is not known"));
            return None;
        }
        Some(name)
    }
}

#[cfg(test)]
mod tests {
    use super::basis::BASIS;
    use super::damping::{DAMPING, RAYLEIGH};
    use super::geometric_stiffness::GEOMETRIC_STIFFNESS;
    use super::interface::INTERFACE;
    use super::recovery::RECOVERY;
    use super::region::{BOX, CYLINDER, NEAREST, PLANE};
    use super::*;
    use flexbody_model::DAMPING_BAND_KEYS;

    /// Schema and reader must name the same keys.
    #[test]
    fn schema_lists_the_keys_of_the_reader() {
        let schema: serde_json::Value =
            serde_json::from_str(include_str!("../../../schemas/manifest.schema.json")).unwrap();
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
            ("/$defs/box/properties", BOX),
            ("/$defs/cylinder/properties", CYLINDER),
            ("/$defs/plane/properties", PLANE),
            ("/$defs/nearest/properties", NEAREST),
            ("/properties/damping/properties", DAMPING),
            ("/properties/damping/properties/bands/items/properties", DAMPING_BAND_KEYS),
            ("/properties/damping/properties/rayleigh/properties", RAYLEIGH),
            ("/properties/geometric_stiffness/items/properties", GEOMETRIC_STIFFNESS),
            ("/properties/recovery/items/properties", RECOVERY),
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
