//! The tables `[[interface]]`.

use super::{ManifestWalk, TomlTable, Value, integer, real};
use crate::model_files::{InterfaceNodes, InterfaceSource, Region};
use flexbody_base::diagnostic::Code;
use flexbody_model::{Coupling, Reference};
use std::collections::HashSet;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::de::DeValue;

pub(super) const INTERFACE: &[&str] = &[
    "name",
    "nodes",
    "nodes_file",
    "set",
    "box",
    "cylinder",
    "plane",
    "nearest",
    "coupling",
    "reference",
    "reference_node",
];

/// Largest number of interfaces of a body: each takes sixteen entries of its file, which has at most 100,000.
const MAX_INTERFACES: usize = 6000;

/// Keys of [`INTERFACE`] that select the nodes.
const NODES: &[&str] = &["nodes", "nodes_file", "set", "box", "cylinder", "plane", "nearest"];

impl ManifestWalk<'_, '_> {
    /// Reads the interfaces. `None` means that the list has errors.
    pub(super) fn interfaces(&mut self, top: &TomlTable, dimension: usize) -> Option<Vec<InterfaceSource>> {
        if let Some(value) = top.get("interface")
            && let DeValue::Array(list) = value.get_ref()
            && list.len() > MAX_INTERFACES
        {
            let message =
                format!("the manifest has {} interfaces, a body has at most {MAX_INTERFACES}", list.len());
            self.complain(Code::ManifestSyntax, value.span(), message);
            return None;
        }
        let mut names = HashSet::new();
        let mut interfaces = Vec::new();
        for (table, span) in self.tables(top, "interface")? {
            if let Some(interface) = self.interface(table, span.clone(), dimension) {
                if !names.insert(interface.name.clone()) {
                    let message = format!("interface `{}` is given twice", interface.name);
                    self.complain(Code::ManifestSyntax, span, message);
                }
                interfaces.push(interface);
            }
        }
        Some(interfaces)
    }

    fn interface(
        &mut self,
        table: &TomlTable,
        span: Range<usize>,
        dimension: usize,
    ) -> Option<InterfaceSource> {
        self.known_keys(table, "[[interface]]", INTERFACE);
        if !table.contains_key("name") {
            self.complain(Code::ManifestSyntax, span.clone(), "interface has no name".into());
        }
        let name = self.string(table, "name")?;
        // The name becomes a group of the flex-body file, where a slash is encoded, and a word in text files, which
        // cannot contain a line break.
        if name.is_empty() || name.chars().any(char::is_control) {
            let message =
                format!("interface name `{}` is empty or has control characters", name.escape_debug());
            self.complain(Code::ManifestSyntax, span, message);
            return None;
        }
        let nodes = self.interface_nodes(table, &name, span.clone(), dimension)?;
        let coupling = match table.get("coupling") {
            Some(value) => Some(self.coupling(value)?),
            None => None,
        };
        let reference = match (table.get("reference"), table.get("reference_node")) {
            (None, None) => nodes.usual_reference(),
            (Some(point), None) => Reference::Point(self.point("reference", point, dimension)?),
            (None, Some(node)) => match integer(node) {
                Some(node) => Reference::Node(node),
                None => {
                    self.mistyped("reference_node", node, "a node number");
                    return None;
                }
            },
            (Some(_), Some(_)) => {
                let message = format!("interface `{name}` has both `reference` and `reference_node`");
                self.complain(Code::ManifestSyntax, span, message);
                return None;
            }
        };
        Some(InterfaceSource { name, nodes, coupling, reference })
    }

    /// Reads the nodes of an interface, which exactly one key selects.
    fn interface_nodes(
        &mut self,
        table: &TomlTable,
        name: &str,
        span: Range<usize>,
        dimension: usize,
    ) -> Option<InterfaceNodes> {
        let given: Vec<&str> = NODES.iter().copied().filter(|key| table.contains_key(*key)).collect();
        let &[key] = given.as_slice() else {
            let message = match given.as_slice() {
                [] => format!("interface `{name}` has neither `nodes` nor `nodes_file`"),
                [one, other, ..] => format!("interface `{name}` has both `{one}` and `{other}`"),
                [_] => unreachable!("matched above"),
            };
            self.complain(Code::ManifestSyntax, span, message);
            return None;
        };
        let value = table.get(key)?;
        Some(match key {
            "nodes" => InterfaceNodes::Listed(self.node_list(name, value)?),
            "nodes_file" => {
                let folder = self.path.parent().unwrap_or(Path::new("")).to_path_buf();
                InterfaceNodes::File(folder.join(PathBuf::from(self.string(table, key)?)))
            }
            "set" => InterfaceNodes::Set(self.string(table, key)?),
            _ => InterfaceNodes::Region(self.region(key, value, dimension)?),
        })
    }

    fn coupling(&mut self, value: &Value) -> Option<Coupling> {
        let name = match value.get_ref() {
            DeValue::String(name) => name.as_ref(),
            _ => "",
        };
        let coupling = Coupling::from_name(name);
        if coupling.is_none() {
            let expected = format!("`{}`", Coupling::NAMES.join("`, `"));
            let message = match name {
                "" => format!("`coupling` is no text, expected one of {expected}"),
                name => format!("`coupling` is `{name}`, expected one of {expected}"),
            };
            self.complain(Code::ManifestSyntax, value.span(), message);
        }
        coupling
    }

    /// Reads a point in space, or its two coordinates in the plane.
    pub(super) fn point(&mut self, key: &str, value: &Value, dimension: usize) -> Option<[f64; 3]> {
        let coordinates: Option<Vec<f64>> = match value.get_ref() {
            DeValue::Array(list) => list.iter().map(real).collect(),
            _ => None,
        };
        let mut point = [0.0; 3];
        match coordinates {
            Some(coordinates) if coordinates.len() == dimension => {
                point[..dimension].copy_from_slice(&coordinates);
                Some(point)
            }
            _ => {
                let message = format!("`{key}` is not a list of {dimension} coordinates");
                self.complain(Code::ManifestSyntax, value.span(), message);
                None
            }
        }
    }

    fn node_list(&mut self, name: &str, value: &Value) -> Option<Vec<i64>> {
        let DeValue::Array(list) = value.get_ref() else {
            self.mistyped("nodes", value, "a list of node numbers");
            return None;
        };
        if list.is_empty() {
            self.complain(Code::ManifestSyntax, value.span(), format!("interface `{name}` has no nodes"));
        }
        let (mut nodes, mut seen) = (Vec::new(), HashSet::new());
        for item in list.iter() {
            match integer(item) {
                Some(node) if seen.insert(node) => nodes.push(node),
                Some(node) => {
                    let message = format!("interface `{name}` lists node {node} twice");
                    self.complain(Code::NodeDuplicate, item.span(), message);
                }
                None => self.mistyped("nodes", item, "a list of node numbers"),
            }
        }
        Some(nodes)
    }
}

// The regions that select the nodes of an interface: `box`, `cylinder`, `plane`, `nearest`.

pub(super) const BOX: &[&str] = &["min", "max"];
pub(super) const CYLINDER: &[&str] = &["from", "to", "radius"];
pub(super) const PLANE: &[&str] = &["point", "normal", "within"];
pub(super) const NEAREST: &[&str] = &["point", "count"];

impl ManifestWalk<'_, '_> {
    /// Reads the region of the key `key`.
    pub(super) fn region(&mut self, key: &str, value: &Value, dimension: usize) -> Option<Region> {
        let DeValue::Table(table) = value.get_ref() else {
            self.mistyped(key, value, "a table");
            return None;
        };
        let span = value.span();
        let known = match key {
            "box" => BOX,
            "cylinder" => CYLINDER,
            "plane" => PLANE,
            _ => NEAREST,
        };
        self.known_keys(table, &format!("`{key}`"), known);
        let region = match key {
            "box" => Region::Box {
                min: self.place(table, key, "min", &span, dimension)?,
                max: self.place(table, key, "max", &span, dimension)?,
            },
            "cylinder" => Region::Cylinder {
                from: self.place(table, key, "from", &span, dimension)?,
                to: self.place(table, key, "to", &span, dimension)?,
                radius: self.radius(table, &span)?,
            },
            "plane" => Region::Plane {
                point: self.place(table, key, "point", &span, dimension)?,
                normal: self.place(table, key, "normal", &span, dimension)?,
                within: self.length(table, key, "within", &span)?,
            },
            _ => Region::Nearest {
                point: self.place(table, key, "point", &span, dimension)?,
                count: self.count(table)?,
            },
        };
        self.sensible(key, &region, span)
    }

    fn place(
        &mut self,
        table: &TomlTable,
        region: &str,
        key: &str,
        span: &Range<usize>,
        dimension: usize,
    ) -> Option<[f64; 3]> {
        match table.get(key) {
            Some(value) => self.point(key, value, dimension),
            None => self.missing_key(region, key, span),
        }
    }

    fn missing_key<T>(&mut self, region: &str, key: &str, span: &Range<usize>) -> Option<T> {
        self.complain(Code::ManifestSyntax, span.clone(), format!("key `{key}` is missing in `{region}`"));
        None
    }

    fn length(&mut self, table: &TomlTable, region: &str, key: &str, span: &Range<usize>) -> Option<f64> {
        let Some(value) = table.get(key) else { return self.missing_key(region, key, span) };
        let length = real(value).filter(|length| length.is_finite() && *length >= 0.0);
        if length.is_none() {
            self.mistyped(key, value, "a length that is not negative");
        }
        length
    }

    /// Reads the largest distance, or a list of the smallest and the largest.
    fn radius(&mut self, table: &TomlTable, span: &Range<usize>) -> Option<[f64; 2]> {
        let Some(value) = table.get("radius") else { return self.missing_key("cylinder", "radius", span) };
        let given: Option<Vec<f64>> = match value.get_ref() {
            DeValue::Array(list) => list.iter().map(real).collect(),
            _ => real(value).map(|radius| vec![0.0, radius]),
        };
        match given.as_deref() {
            Some(&[least, largest]) if 0.0 <= least && least <= largest && largest.is_finite() => {
                Some([least, largest])
            }
            _ => {
                self.mistyped("radius", value, "a radius, or the least and the largest");
                None
            }
        }
    }

    fn count(&mut self, table: &TomlTable) -> Option<usize> {
        let Some(value) = table.get("count") else { return Some(1) };
        let count = integer(value).filter(|count| *count > 0);
        if count.is_none() {
            self.mistyped("count", value, "a number of nodes");
        }
        count.map(|count| count as usize)
    }

    /// Returns the region unless it is empty by definition.
    fn sensible(&mut self, key: &str, region: &Region, span: Range<usize>) -> Option<Region> {
        let Some(message) = region.problem() else { return Some(*region) };
        self.complain(Code::ManifestSyntax, span, format!("{message} in `{key}`"));
        None
    }
}
