//! The tables `[[recovery]]`.

use super::{ManifestWalk, MatrixLocation, TomlTable};
use crate::fe_results::files_listed_by;
use crate::model_files::{
    InterfaceNodes, NodalStressSource, OperatorSource, RecoverySource, StressNodesSource,
};
use flexbody_base::diagnostic::Code;
use std::collections::HashSet;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::de::DeValue;

pub(super) const RECOVERY: &[&str] = &[
    "name",
    "operator",
    "rows",
    "offset",
    "shapes",
    "displacements",
    "cut",
    "set",
    "box",
    "cylinder",
    "plane",
    "about",
    "deformed_inertia",
    "stress",
];

/// Keys of [`RECOVERY`] that define the rows.
const SOURCES: &[&str] = &["operator", "shapes", "cut", "set", "box", "cylinder", "plane", "stress"];

impl ManifestWalk<'_, '_> {
    /// Reads the rows to read off the body, and the stresses at nodes. Entries with errors are left out; the errors are in
    /// `found`.
    pub(super) fn recoveries(
        &mut self,
        top: &TomlTable,
        dimension: usize,
    ) -> (Vec<RecoverySource>, Vec<NodalStressSource>) {
        let (mut names, mut rows, mut stresses) = (HashSet::new(), Vec::new(), Vec::new());
        for (table, span) in self.tables(top, "recovery").unwrap_or_default() {
            let name = if table.contains_key("stress") {
                let read = self.nodal_stress(table, span.clone());
                read.map(|one| {
                    let name = one.name.clone();
                    stresses.push(one);
                    name
                })
            } else {
                let read = self.recovery(table, span.clone(), dimension);
                read.map(|one| {
                    let name = one.name.clone();
                    rows.push(one);
                    name
                })
            };
            if let Some(name) = name
                && !names.insert(name.clone())
            {
                let message = format!("recovery `{name}` is given twice");
                self.complain(Code::ManifestSyntax, span, message);
            }
        }
        (rows, stresses)
    }

    /// Reads stresses at nodes: the key `stress` with the name of the nodes.
    fn nodal_stress(&mut self, table: &TomlTable, span: Range<usize>) -> Option<NodalStressSource> {
        self.known_keys(table, "[[recovery]] with `stress`", &["name", "stress"]);
        if !table.contains_key("name") {
            self.complain(Code::ManifestSyntax, span, "recovery has no name".into());
        }
        let name = self.string(table, "name")?;
        let nodes = StressNodesSource::parse(&self.string(table, "stress")?);
        Some(NodalStressSource { name, nodes })
    }

    fn recovery(
        &mut self,
        table: &TomlTable,
        span: Range<usize>,
        dimension: usize,
    ) -> Option<RecoverySource> {
        self.known_keys(table, "[[recovery]]", RECOVERY);
        if !table.contains_key("name") {
            self.complain(Code::ManifestSyntax, span.clone(), "recovery has no name".into());
        }
        let name = self.string(table, "name")?;
        let given: Vec<&str> = SOURCES.iter().copied().filter(|key| table.contains_key(*key)).collect();
        let &[key] = given.as_slice() else {
            let found = if given.is_empty() { "no source".to_owned() } else { given.join(", ") };
            let message = format!("recovery `{name}` has {found}, expected one of {}", SOURCES.join(", "));
            self.complain(Code::ManifestSyntax, span, message);
            return None;
        };
        let foreign: &[&str] = match key {
            "operator" => &["about", "displacements"],
            "shapes" => &["about", "rows", "offset"],
            _ => &["rows", "offset", "displacements"],
        };
        if let Some(other) = foreign.iter().find(|other| table.contains_key(**other)) {
            let message = format!("recovery `{name}` has `{other}`, which does not belong to `{key}`");
            self.complain(Code::ManifestSyntax, span, message);
            return None;
        }
        let folder = self.path.parent().unwrap_or(Path::new("")).to_path_buf();
        let operator = if key == "operator" {
            self.require_rows(table, span, &name);
            let operator = MatrixLocation::parse(self.string(table, "operator")?).relative_to(&folder);
            let rows = folder.join(self.string(table, "rows")?);
            let offset = if table.contains_key("offset") {
                Some(MatrixLocation::parse(self.string(table, "offset")?).relative_to(&folder))
            } else {
                None
            };
            OperatorSource::Rows { operator, rows, offset }
        } else if key == "shapes" {
            let answers = folder.join(self.string(table, "shapes")?);
            let displacements = if table.contains_key("displacements") {
                folder.join(self.string(table, "displacements")?)
            } else {
                answers.with_extension("npz")
            };
            // CalculiX prints the strain energies into a file beside its results.
            let is_frd = answers.extension().is_some_and(|extension| extension == "frd");
            let printed = Some(answers.with_extension("dat"));
            let has_tables = |path: &PathBuf| path.metadata().is_ok_and(|file| file.len() > 0);
            let energies = printed.filter(|path| is_frd && has_tables(path));
            let mut listed = files_listed_by(&answers);
            if displacements != answers {
                listed.extend(files_listed_by(&displacements));
            }
            OperatorSource::Shapes { answers, displacements, energies, listed }
        } else {
            let nodes = match key {
                "cut" => InterfaceNodes::File(folder.join(self.string(table, key)?)),
                "set" => InterfaceNodes::Set(self.string(table, key)?),
                _ => InterfaceNodes::Region(self.region(key, table.get(key)?, dimension)?),
            };
            let about = match table.get("about") {
                Some(value) => Some(self.point("about", value, dimension)?),
                None => None,
            };
            OperatorSource::Cut { nodes, about }
        };
        Some(RecoverySource { name, operator, deformed_inertia: self.switch(table, "deformed_inertia")? })
    }

    /// Complains about an operator without the table of its rows.
    fn require_rows(&mut self, table: &TomlTable, span: Range<usize>, name: &str) {
        if !table.contains_key("rows") {
            let message = format!("key `rows` is missing in recovery `{name}`");
            self.complain(Code::ManifestSyntax, span, message);
        }
    }

    /// Returns a key that is true or false; false if it is absent.
    pub(super) fn switch(&mut self, table: &TomlTable, key: &str) -> Option<bool> {
        match table.get(key).map(|value| (value, value.get_ref())) {
            None => Some(false),
            Some((_, DeValue::Boolean(given))) => Some(*given),
            Some((value, _)) => {
                self.mistyped(key, value, "true or false");
                None
            }
        }
    }
}
