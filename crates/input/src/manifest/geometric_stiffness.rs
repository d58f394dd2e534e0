//! The tables `[[geometric_stiffness]]`.

use super::{ManifestWalk, MatrixLocation, TomlTable};
use flexbody_base::diagnostic::Code;
use flexbody_model::{GeometricStiffness, LoadKind, UnitLoad};
use std::ops::Range;
use std::path::Path;

/// Keys `file`, `interface`, and the kinds of loads.
pub(super) const GEOMETRIC_STIFFNESS: &[&str] = &[
    "file",
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
    pub(super) fn geometric_stiffness(&mut self, top: &TomlTable) -> Vec<GeometricStiffness<MatrixLocation>> {
        let tables = self.tables(top, "geometric_stiffness").unwrap_or_default();
        tables.into_iter().filter_map(|(table, span)| self.one_geometric_stiffness(table, span)).collect()
    }

    fn one_geometric_stiffness(
        &mut self,
        table: &TomlTable,
        span: Range<usize>,
    ) -> Option<GeometricStiffness<MatrixLocation>> {
        self.known_keys(table, "[[geometric_stiffness]]", GEOMETRIC_STIFFNESS);
        if !table.contains_key("file") {
            let message = "key `file` is missing in [[geometric_stiffness]]".to_owned();
            self.complain(Code::ManifestSyntax, span.clone(), message);
        }
        let file = self.string(table, "file");
        let load = self.unit_load(table, span)?;
        let folder = self.path.parent().unwrap_or(Path::new(""));
        Some(GeometricStiffness { load, matrix: MatrixLocation::parse(file?).relative_to(folder) })
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
