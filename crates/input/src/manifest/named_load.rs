//! The tables `[[named_load]]`.

use super::{ManifestWalk, MatrixLocation, TomlTable};
use crate::model_files::NamedLoadSource;
use flexbody_base::diagnostic::Code;
use std::collections::HashSet;
use std::ops::Range;
use std::path::Path;

pub(super) const NAMED_LOAD: &[&str] = &["name", "vector", "preload"];

impl ManifestWalk<'_, '_> {
    /// Reads the nodal forces with a name. Entries with errors are left out; the errors are in `found`.
    pub(super) fn named_loads(&mut self, top: &TomlTable) -> Vec<NamedLoadSource> {
        let (mut names, mut given) = (HashSet::new(), Vec::new());
        for (table, span) in self.tables(top, "named_load").unwrap_or_default() {
            if let Some(one) = self.named_load(table, span.clone()) {
                if !names.insert(one.name.clone()) {
                    let message = format!("named load `{}` is given twice", one.name);
                    self.complain(Code::ManifestSyntax, span, message);
                }
                given.push(one);
            }
        }
        given
    }

    fn named_load(&mut self, table: &TomlTable, span: Range<usize>) -> Option<NamedLoadSource> {
        self.known_keys(table, "[[named_load]]", NAMED_LOAD);
        for key in ["name", "vector"] {
            if !table.contains_key(key) {
                let message = format!("named load has no key `{key}`");
                self.complain(Code::ManifestSyntax, span.clone(), message);
            }
        }
        let (name, vector) = (self.string(table, "name"), self.string(table, "vector"));
        let preload = self.switch(table, "preload")?;
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let vector = MatrixLocation::parse(vector?).relative_to(folder);
        Some(NamedLoadSource { name: name?, vector, preload })
    }
}
