//! The manifest `model.toml`. Its machine-readable contract is `schemas/manifest.schema.json`.

mod elements;
mod interface;
mod named_load;
mod recovery;

use super::jobs::JobFile;
use super::model_files::{
    MatrixLocation, ModelFiles, ModelSource, StressStiffnessSource, TableFiles, WithStress, stem,
};
use crate::LoadSource;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::text::walk::{TomlTable, Value, Walk, integer, read_toml, real};
use flexbody_base::units::UnitSystem;
use flexbody_model::{Accepted, Damping, Description, GeometricStiffness, LoadKind, UnitLoad, damping_bands};
use std::ops::{Deref, DerefMut, Range};
use std::path::Path;
use toml::de::DeValue;

const TOP: &[&str] = &[
    "model",
    "files",
    "elements",
    "interface",
    "damping",
    "geometric_stiffness",
    "recovery",
    "named_load",
    "basis",
];
const MODEL: &[&str] = &["name", "dimension", "units", "allow_implausible", "keep_soft_rotations"];
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
        let allow_implausible = model_keys.map(|table| self.accepted(table)).unwrap_or_default();
        let keep_soft_rotations =
            model_keys.and_then(|table| self.flag(table, "keep_soft_rotations")).unwrap_or(false);
        let units = match model_keys.and_then(|table| self.table(table, "units")) {
            Some((table, span)) => self.units(table, span)?,
            None => UnitSystem::default(),
        };
        let elements = self.elements(top);
        let interfaces = self.interfaces(top, usize::from(dimension));
        let damping = self.damping(top);
        let geometric_stiffness = self.geometric_stiffness(top);
        let (recoveries, nodal_stresses) = self.recoveries(top, usize::from(dimension));
        let named_loads = self.named_loads(top);
        let residual_vectors = self.residual_vectors(top);
        let Some((files, span)) = self.table(top, "files") else {
            if !top.contains_key("files") {
                let message = "table [files] is missing".to_owned();
                let nowhere = Diagnostic::new(Code::ManifestSyntax, message).in_file(self.path);
                self.diagnostics.push(nowhere);
            }
            return None;
        };
        let source = self.source(files, span);
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let mesh = self.string(files, "mesh").map(|mesh| folder.join(mesh));
        Some(ModelFiles {
            description: Description::new(name.unwrap_or_else(|| stem(self.path)), units),
            dimension,
            allow_implausible,
            keep_soft_rotations,
            source: source?,
            mesh,
            describe_elements: false,
            elements,
            interfaces: interfaces?,
            damping,
            geometric_stiffness,
            recoveries,
            nodal_stresses,
            named_loads,
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

    fn flag(&mut self, table: &TomlTable, key: &str) -> Option<bool> {
        let value = table.get(key)?;
        match value.get_ref() {
            DeValue::Boolean(allowed) => Some(*allowed),
            _ => {
                self.mistyped(key, value, "true or false");
                None
            }
        }
    }

    /// Reads the checks whose findings are accepted: a list of their codes, or `true` for those of former versions.
    fn accepted(&mut self, table: &TomlTable) -> Accepted {
        const KEY: &str = "allow_implausible";
        let Some(value) = table.get(KEY) else { return Accepted::default() };
        let expected = || format!("true, false, or a list of {}", Accepted::possible());
        let DeValue::Array(list) = value.get_ref() else {
            if let DeValue::Boolean(all) = value.get_ref() {
                return Accepted::from(*all);
            }
            self.mistyped(KEY, value, &expected());
            return Accepted::default();
        };
        let mut accepted = Accepted::default();
        for item in list.iter() {
            match item.get_ref() {
                DeValue::String(code) => match Accepted::from_codes(code) {
                    Ok(check) => accepted = accepted.and(check),
                    Err(code) => {
                        let message = format!("`{KEY}` has `{code}`, expected {}", expected());
                        self.complain(Code::ManifestSyntax, item.span(), message);
                    }
                },
                _ => self.mistyped(KEY, item, &expected()),
            }
        }
        accepted
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
            self.diagnostics
                .push(diagnostic.with_help("state all three in [model.units]: length, mass, time"));
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

// The table `[basis]`: settings of the basis that are stored with the model. Settings on the command line replace
// them.

const BASIS: &[&str] = &["residual_vectors", "loads"];

impl ManifestWalk<'_, '_> {
    /// Reads the loads of residual vectors. The list is empty without the table; errors are in `found`.
    fn residual_vectors(&mut self, top: &TomlTable) -> Vec<LoadSource> {
        let Some((table, _)) = self.table(top, "basis") else { return Vec::new() };
        self.known_keys(table, "[basis]", BASIS);
        let mut loads = self.load_sets(table);
        loads.extend(self.load_file(table));
        loads
    }

    /// Reads the file of nodal forces of the user.
    fn load_file(&mut self, table: &TomlTable) -> Option<LoadSource> {
        let file = self.string(table, "loads")?;
        let folder = self.path.parent().unwrap_or(Path::new(""));
        Some(LoadSource::File(MatrixLocation::parse(file).relative_to(folder)))
    }

    fn load_sets(&mut self, table: &TomlTable) -> Vec<LoadSource> {
        const EXPECTED: &str = "a list of \"centrifugal\" and \"interfaces\", each also with a frequency as in \"interfaces@500\"";
        let Some(value) = table.get("residual_vectors") else { return Vec::new() };
        let DeValue::Array(list) = value.get_ref() else {
            self.mistyped("residual_vectors", value, EXPECTED);
            return Vec::new();
        };
        let mut sets = Vec::new();
        for item in list.iter() {
            let DeValue::String(text) = item.get_ref() else {
                self.mistyped("residual_vectors", item, EXPECTED);
                continue;
            };
            let (name, hertz) = LoadSource::with_frequency(text);
            let known = match name {
                "centrifugal" => Some(LoadSource::Centrifugal),
                "interfaces" => Some(LoadSource::Interfaces),
                "loads" if hertz > 0.0 => self.load_file(table),
                _ => None,
            };
            let Some(loads) = known else {
                let message =
                    format!("`{text}` is not a set of loads for residual vectors, expected {EXPECTED}");
                let complaint = self.at(Code::ManifestSyntax, item.span(), message);
                self.diagnostics.push(complaint.with_help(
                    "give other nodal forces in the file `loads`; \"loads@500\" names its responses at a frequency",
                ));
                continue;
            };
            let set = loads.at(hertz);
            if sets.contains(&set) {
                let message = "`residual_vectors` names loads twice".to_owned();
                self.complain(Code::ManifestSyntax, item.span(), message);
            } else {
                sets.push(set);
            }
        }
        sets
    }
}

const DAMPING: &[&str] = &["ratio", "bands", "rayleigh", "matrix"];
const RAYLEIGH: &[&str] = &["alpha", "beta"];

impl ManifestWalk<'_, '_> {
    /// Reads the damping. `None` means that there is no table, or that `found` has errors.
    fn damping(&mut self, top: &TomlTable) -> Option<Damping<MatrixLocation>> {
        let (table, span) = self.table(top, "damping")?;
        self.known_keys(table, "[damping]", DAMPING);
        let given: Vec<&str> = DAMPING.iter().copied().filter(|key| table.contains_key(*key)).collect();
        let &[key] = given.as_slice() else {
            let found = if given.is_empty() { "nothing".to_owned() } else { given.join(", ") };
            let message = format!("[damping] has {found}, expected one of {}", DAMPING.join(", "));
            self.complain(Code::ManifestSyntax, span, message);
            return None;
        };
        let damping = match key {
            "ratio" => Damping::Ratio(self.number(table, key, &span)?),
            "bands" => Damping::Bands(damping_bands(self, table.get(key)?)?),
            "rayleigh" => {
                let (table, span) = self.table(table, key)?;
                self.known_keys(table, "`rayleigh`", RAYLEIGH);
                let (alpha, beta) = (self.number(table, "alpha", &span), self.number(table, "beta", &span));
                Damping::Rayleigh { alpha: alpha?, beta: beta? }
            }
            _ => {
                let folder = self.path.parent().unwrap_or(Path::new(""));
                Damping::Matrix(MatrixLocation::parse(self.string(table, key)?).relative_to(folder))
            }
        };
        if let Some(problem) = damping.problem() {
            self.complain(Code::ManifestSyntax, span, problem);
            return None;
        }
        Some(damping)
    }
}

/// Keys of the matrix, `interface`, and the kinds of loads.
const GEOMETRIC_STIFFNESS: &[&str] = &[
    "file",
    "with_stress",
    "load_size",
    "interface",
    LoadKind::NAMES[0],
    LoadKind::NAMES[1],
    LoadKind::NAMES[2],
    LoadKind::NAMES[3],
    LoadKind::NAMES[4],
    LoadKind::NAMES[5],
];

impl ManifestWalk<'_, '_> {
    /// Reads the geometric stiffness of unit loads. Entries with errors are left out; the errors are in `found`.
    fn geometric_stiffness(&mut self, top: &TomlTable) -> Vec<GeometricStiffness<StressStiffnessSource>> {
        let tables = self.tables(top, "geometric_stiffness").unwrap_or_default();
        tables.into_iter().filter_map(|(table, span)| self.one_geometric_stiffness(table, span)).collect()
    }

    fn one_geometric_stiffness(
        &mut self,
        table: &TomlTable,
        span: Range<usize>,
    ) -> Option<GeometricStiffness<StressStiffnessSource>> {
        self.known_keys(table, "[[geometric_stiffness]]", GEOMETRIC_STIFFNESS);
        let matrix = self.stress_stiffness(table, &span);
        let load = self.unit_load(table, span)?;
        Some(GeometricStiffness { load, matrix: matrix? })
    }

    /// Reads the file of the matrix: K_geo in `file`, or K with the stress in `with_stress`.
    fn stress_stiffness(&mut self, table: &TomlTable, span: &Range<usize>) -> Option<StressStiffnessSource> {
        let message = match (table.contains_key("file"), table.contains_key("with_stress")) {
            (false, false) => "key `file` is missing in [[geometric_stiffness]]",
            (true, true) => {
                "[[geometric_stiffness]] has `file` and `with_stress`: give the geometric stiffness, or the stiffness with the stress"
            }
            (true, false) if table.contains_key("load_size") => {
                "`load_size` belongs to `with_stress`: the matrix in `file` is that of a unit load"
            }
            _ => "",
        };
        if !message.is_empty() {
            self.complain(Code::ManifestSyntax, span.clone(), message.to_owned());
            return None;
        }
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let located = |file: String| MatrixLocation::parse(file).relative_to(folder);
        if let Some(file) = self.string(table, "file") {
            return Some(StressStiffnessSource { location: located(file), with_stress: None });
        }
        let location = located(self.string(table, "with_stress")?);
        let load_size =
            if table.contains_key("load_size") { self.number(table, "load_size", span)? } else { 1.0 };
        if !(load_size > 0.0 && load_size.is_finite()) {
            let message = format!("`load_size` is {load_size}, expected a positive number");
            self.complain(Code::ManifestSyntax, span.clone(), message);
            return None;
        }
        let with_stress = Some(WithStress::new(&location.path, load_size));
        Some(StressStiffnessSource { location, with_stress })
    }

    /// Reads the load that causes the stress: one key with the axis (or the name of the load) as its value.
    fn unit_load(&mut self, table: &TomlTable, span: Range<usize>) -> Option<UnitLoad> {
        let given: Vec<&str> =
            LoadKind::NAMES.iter().copied().filter(|name| table.contains_key(*name)).collect();
        let &[key] = given.as_slice() else {
            let found = if given.is_empty() { "no load".to_owned() } else { given.join(", ") };
            let message = format!(
                "[[geometric_stiffness]] has {found}, expected one of {}",
                LoadKind::NAMES.join(", ")
            );
            self.complain(Code::ManifestSyntax, span, message);
            return None;
        };
        let value = self.string(table, key)?;
        let needs = matches!(key, "force" | "moment");
        if needs != table.contains_key("interface") {
            let message = if needs {
                format!("`{key}` acts at an interface: key `interface` is missing in [[geometric_stiffness]]")
            } else {
                format!("`{key}` acts at no interface, but `interface` is given in [[geometric_stiffness]]")
            };
            self.complain(Code::ManifestSyntax, span, message);
            return None;
        }
        let kind = match key {
            "acceleration" => LoadKind::Acceleration,
            "angular_acceleration" => LoadKind::AngularAcceleration,
            "spin" => LoadKind::Spin,
            "force" => LoadKind::Force(self.string(table, "interface")?),
            "moment" => LoadKind::Moment(self.string(table, "interface")?),
            _ => return Some(UnitLoad { kind: LoadKind::Named(value), component: 0 }),
        };
        let component = kind.components().iter().position(|axis| *axis == value);
        if component.is_none() {
            let message = format!("`{key}` is `{value}`, expected one of {}", kind.components().join(", "));
            self.complain(Code::ManifestSyntax, span, message);
        }
        Some(UnitLoad { component: component?, kind })
    }
}

#[cfg(test)]
mod tests {
    use super::elements::ELEMENTS;
    use super::interface::{BOX, CYLINDER, INTERFACE, NEAREST, PLANE};
    use super::named_load::NAMED_LOAD;
    use super::recovery::RECOVERY;
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
            ("/properties/elements/items/properties", ELEMENTS),
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
            ("/properties/named_load/items/properties", NAMED_LOAD),
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
