//! The table `[basis]`: settings of the basis that are stored with the model. Settings on the command line replace
//! them.

use super::{ManifestWalk, MatrixLocation, TomlTable};
use crate::LoadSource;
use flexbody_base::diagnostic::Code;
use std::path::Path;
use toml::de::DeValue;

pub(super) const BASIS: &[&str] = &["residual_vectors", "loads"];

impl ManifestWalk<'_, '_> {
    /// Reads the loads of residual vectors. The list is empty without the table; errors are in `found`.
    pub(super) fn residual_vectors(&mut self, top: &TomlTable) -> Vec<LoadSource> {
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
                self.found.push(complaint.with_help(
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
