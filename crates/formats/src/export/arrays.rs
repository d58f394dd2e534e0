//! Named arrays with descriptions: the entries of the flex-body file in the form of `json` and `npz`.

use super::ExportChecklist;
use super::Holding::Held;
use flexbody_file::{NamedArray, NamedAttributes, Numbers};
use serde::{Serialize, Serializer};

/// Holdings of a format with every entry of the flex-body file.
pub(crate) const ALL_ENTRIES: ExportChecklist = ExportChecklist {
    rigid_coupling: Held,
    plane: Held,
    deformed_inertia: Held,
    general_w0: Held,
    coriolis_force: Held,
    general_w3: Held,
    separate_w2: Held,
    geometric_stiffness: Held,
    inertia_stiffness: Held,
    damping: Held,
    shapes: Held,
    rotations: Held,
    internal_rows: Held,
    gravity: Held,
    interfaces: Held,
    surface: Held,
    origins_of_modes: Held,
    units: Held,
    storage: Held,
    named_loads: Held,
    recoveries: Held,
};

/// Groups with their attributes, and arrays, by their paths in the flex-body file.
#[derive(Serialize)]
pub(crate) struct Document<'a> {
    attributes: Ordered<'a, Ordered<'a, &'a serde_json::Value>>,
    arrays: Ordered<'a, Entry<'a>>,
}

#[derive(Serialize)]
struct Entry<'a> {
    symbol: &'a str,
    units: &'a str,
    description: &'a str,
    shape: &'a [usize],
    #[serde(skip_serializing_if = "Option::is_none")]
    values: Option<Values<'a>>,
}

impl<'a> Document<'a> {
    /// Builds the document with the numbers of the arrays if `values` is true.
    pub(crate) fn new(attributes: &'a [NamedAttributes], arrays: &'a [NamedArray], values: bool) -> Self {
        let group = |group: &'a NamedAttributes| {
            (
                group.path.as_str(),
                Ordered(group.values.iter().map(|(name, value)| (name.as_str(), value)).collect()),
            )
        };
        let entry = |array: &'a NamedArray| Entry {
            symbol: array.symbol,
            units: &array.units,
            description: array.description,
            shape: &array.shape,
            values: values.then_some(Values(array)),
        };
        Self {
            attributes: Ordered(attributes.iter().map(group).collect()),
            arrays: Ordered(arrays.iter().map(|array| (array.path.as_str(), entry(array))).collect()),
        }
    }
}

/// A map that keeps the order of the file, because the order of the interfaces matters.
struct Ordered<'a, T>(Vec<(&'a str, T)>);

impl<T: Serialize> Serialize for Ordered<'_, T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

/// Numbers of an array, nested row by row.
struct Values<'a>(&'a NamedArray);

impl Serialize for Values<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let shape = &self.0.shape;
        match &self.0.values {
            Numbers::Floats(values) => Nested(shape, values).serialize(serializer),
            Numbers::Ints(values) => Nested(shape, values).serialize(serializer),
        }
    }
}

/// Numbers nested row by row according to their extents.
pub(crate) struct Nested<'a, T>(pub &'a [usize], pub &'a [T]);

impl<T: Serialize> Serialize for Nested<'_, T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        match self.0 {
            [] | [_] => self.1.serialize(serializer),
            [_, inner @ ..] => {
                let row = inner.iter().product::<usize>().max(1);
                serializer.collect_seq(self.1.chunks(row).map(|row| Nested(inner, row)))
            }
        }
    }
}
