//! What the table of the flex-body file is made of: entries, their shapes, and where their values come from.

use super::draft::Draft;
use super::value::{ReadValue, Units, Value, View, text};
#[cfg(feature = "hdf5")]
use flexbody_body::flex_body::Storage;
use flexbody_body::flex_body::{Interface, LumpedBody, Parts, TermGroup};

/// One extent of a dataset's shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Extent {
    Fixed(usize),
    /// n, the nodes of the body.
    Nodes,
    /// nf, the modes.
    Modes,
    /// 3 nf.
    ThreeModes,
    /// Nodes of the group's interface.
    InterfaceNodes,
    /// Rows of the modes without a place.
    InternalRows,
    /// nc, the interface coordinates.
    Coordinates,
    /// nt, the triangles of the surface.
    Triangles,
    /// ne, the edges of the surface.
    Edges,
}
use Extent::{Coordinates, Edges, Fixed, InterfaceNodes, InternalRows, Modes, Nodes, ThreeModes, Triangles};

/// How an entry is stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum ItemKind {
    /// Dataset of 64-bit floats.
    Floats(&'static [Extent]),
    /// Dataset of 64-bit signed integers.
    Ints(&'static [Extent]),
    /// Dataset of 32-bit signed integers: indices of nodes.
    Indices(&'static [Extent]),
    /// Attribute: UTF-8 text of variable length.
    Text,
    /// Attribute: 64-bit signed integer.
    Int,
    /// Attribute: 64-bit float.
    Float,
    /// Attributes, 64-bit floats, whose names are data.
    Named,
}
use ItemKind::{Float, Floats, Indices, Int, Ints, Named, Text};

/// Takes the value of an entry from a body; `None` only for entries that are not required.
pub(super) type Get = fn(&View<'_>) -> Option<Value>;

/// Puts the value that a file has for an entry into the body that is read. The error says what was expected and what
/// was found.
pub(super) type Put = fn(&mut Draft, ReadValue) -> Result<(), String>;

/// Both directions of an entry: from a body into a file, and back where the reader takes the entry from the file.
pub(super) struct Access {
    pub get: Get,
    pub put: Option<Put>,
}

/// An entry that is written and read.
pub(super) const fn both(get: Get, put: Put) -> Access {
    Access { get, put: Some(put) }
}

/// An entry that is written: the reader checks or ignores it, or reads it before all others.
pub(super) const fn written(get: Get) -> Access {
    Access { get, put: None }
}

/// The reading direction of an entry, as an assignment.
macro_rules! put {
    (|$draft:ident, $read:ident| $assignment:expr) => {
        |$draft, $read| {
            $assignment;
            Ok(())
        }
    };
}
pub(super) use put;

/// Both directions of a field: `field!(certificate.shift)` of the body, `field!(guarantee: shift_below)` of a part that
/// a view and a draft have under this name.
macro_rules! field {
    ($part:ident: $($field:tt)+) => {
        $crate::item::both(
            |view| $crate::value::Stored::value(&view.$part()?.$($field)+),
            |draft, read| {
                draft.$part().$($field)+ = $crate::value::Stored::take(read)?;
                Ok(())
            },
        )
    };
    ($($field:tt)+) => {
        $crate::item::both(
            |view| $crate::value::Stored::value(&view.body.$($field)+),
            |draft, read| {
                draft.body.$($field)+ = $crate::value::Stored::take(read)?;
                Ok(())
            },
        )
    };
}
pub(super) use field;

/// Entries that a file has all or none of. The message about a file with some of them is made of their keys in the order
/// of the table, each with whether it is there.
pub(super) struct Together {
    #[cfg_attr(not(feature = "hdf5"), allow(dead_code))] // said where files are read
    pub problem: fn(&[(String, bool)]) -> String,
}

/// Membership of an entry in a set of entries that belong together.
#[derive(Clone, Copy)]
#[cfg_attr(not(feature = "hdf5"), allow(dead_code))] // checked where files are read
pub(super) struct Membership {
    pub set: &'static Together,
    /// True if the set needs the entry; false if the entry needs the set alone.
    pub required: bool,
}

/// Where the value of an entry comes from.
#[derive(Clone, Copy)]
pub(super) enum Origin {
    /// The same text in every file; a reader refuses others.
    ConstantText(&'static str),
    /// The same integer in every file; a reader refuses others.
    ConstantInt(i64),
    /// Information of its own.
    Primary(Get),
    /// Follows from the primary entries; the reader recomputes it. Floats agree to [`DERIVED_TOLERANCE`] of
    /// the largest magnitude in the named dataset of the same group, everything else exactly.
    #[cfg_attr(not(feature = "hdf5"), allow(dead_code))] // compared where files are read
    Derived(Get, &'static str),
}
use Origin::{ConstantInt, ConstantText, Derived, Primary};

/// This program's files agree to the last bit; other writers may evaluate W1, W2, W3 by themselves, and 1e-12
/// is what independent evaluations of the invariants reach.
pub(super) const DERIVED_TOLERANCE: f64 = 1e-12;

/// The same of an array of 32-bit floats, which is rounded by itself.
#[cfg(feature = "hdf5")]
pub(super) const SHORT_TOLERANCE: f64 = f32::EPSILON as f64;

/// How often a group occurs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Per {
    Body,
    LumpingScheme,
    Interface,
    UnitLoad,
    InertiaLoad,
}

/// A dataset or attribute.
pub(super) struct Item {
    pub name: &'static str,
    pub kind: ItemKind,
    pub units: Units,
    pub symbol: &'static str,
    pub description: &'static str,
    pub required: bool,
    /// Minor version of the format that brought it.
    pub since: i64,
    pub origin: Origin,
    /// `None` for entries that the reader does not take from the file, or takes before all others.
    #[cfg_attr(not(feature = "hdf5"), allow(dead_code))] // called where files are read
    pub put: Option<Put>,
    /// The entries without which this one means nothing.
    #[cfg_attr(not(feature = "hdf5"), allow(dead_code))] // checked where files are read
    pub together: Option<Membership>,
    /// The group of the kinetic energy that the entry belongs to: there where the body holds it, required or
    /// not there at all.
    pub of: Option<TermGroup>,
    /// A large array, of 32-bit floats where the body is stored so.
    pub large: bool,
}

/// A group with its entries. `<scheme>` and `<name>` stand for names that are data.
pub(super) struct SchemaGroup {
    pub path: &'static str,
    pub per: Per,
    pub description: &'static str,
    pub items: &'static [&'static [Item]],
}

impl Item {
    pub(crate) const fn derived(mut self, from: &'static str) -> Self {
        if let Primary(get) = self.origin {
            self.origin = Derived(get, from);
        }
        self
    }

    /// One of several entries that a file has all or none of.
    pub(crate) const fn with(mut self, set: &'static Together) -> Self {
        self.together = Some(Membership { set, required: true });
        self
    }

    /// An optional entry beside several that a file has all or none of.
    pub(crate) const fn beside(mut self, set: &'static Together) -> Self {
        self.together = Some(Membership { set, required: false });
        self
    }

    /// Of a group of the kinetic energy.
    pub(crate) const fn of(mut self, group: TermGroup) -> Self {
        self.of = Some(group);
        self
    }

    /// A large array, that may be stored in 32-bit floats.
    pub(crate) const fn large(mut self) -> Self {
        self.large = true;
        self
    }

    /// Whether a body keeps this array in 32-bit floats.
    #[cfg(feature = "hdf5")]
    pub(crate) fn is_short(&self, storage: Storage) -> bool {
        self.large && storage == Storage::F32
    }

    pub(crate) const fn optional(mut self) -> Self {
        self.required = false;
        self
    }

    /// Optional, and an addition of a minor version.
    pub(crate) const fn added(mut self, minor: i64) -> Self {
        self.since = minor;
        self.optional()
    }

    /// Required in a group that a minor version brought.
    pub(crate) const fn within(mut self, minor: i64) -> Self {
        self.since = minor;
        self
    }

    /// The entry's value for a body.
    pub(crate) fn value(&self, view: &View<'_>) -> Option<Value> {
        match self.origin {
            ConstantText(value) => text(value),
            ConstantInt(value) => Some(Value::Int(value)),
            Primary(get) | Derived(get, _) => get(view),
        }
    }

    /// Shape of a dataset; `None` for attributes.
    pub(crate) fn shape(&self) -> Option<&'static [Extent]> {
        match self.kind {
            Floats(shape) | Ints(shape) | Indices(shape) => Some(shape),
            Text | Int | Float | Named => None,
        }
    }

    /// Extents of a dataset for a body.
    pub(crate) fn dims(&self, view: &View<'_>) -> Vec<usize> {
        let nf = view.body.modes.eigenvalue.len();
        let size = |extent: &Extent| match *extent {
            Fixed(size) => size,
            Nodes => view.body.nodes.len(),
            Modes => nf,
            ThreeModes => 3 * nf,
            InterfaceNodes => view.interface_nodes().len(),
            Coordinates => view.body.coordinates.as_ref().map_or(0, |c| c.names.len()),
            Triangles => view.body.mesh.as_ref().map_or(0, |mesh| mesh.triangles().len()),
            Edges => view.body.mesh.as_ref().map_or(0, |mesh| mesh.edges().len()),
            InternalRows => view.body.modes.internal.as_ref().map_or(0, |internal| internal.dofs.len()),
        };
        self.shape().unwrap_or(&[]).iter().map(size).collect()
    }
}

impl SchemaGroup {
    /// All entries, in the order of the table.
    pub(crate) fn entries(&self) -> impl Iterator<Item = &'static Item> + use<> {
        self.items.iter().flat_map(|part| part.iter())
    }

    /// The minor version that brought the group with all its entries.
    pub(crate) fn since(&self) -> i64 {
        self.entries().map(|item| item.since).min().unwrap_or(0)
    }

    /// Path without the last name.
    pub(crate) fn parent(&self) -> &'static str {
        self.path.rfind('/').map_or(self.path, |i| &self.path[..i])
    }

    /// The groups of a body that this one stands for, with their names where these are data.
    pub(crate) fn instances<'a>(&self, body: &'a Parts) -> Vec<(Option<String>, View<'a>)> {
        let view = View { body, lumped: None, interface: None, geometric_stiffness: None };
        match self.per {
            Per::Body => vec![(None, view)],
            Per::LumpingScheme => {
                let one = |l: &'a LumpedBody| (Some(l.scheme.clone()), View { lumped: Some(l), ..view });
                body.lumped.iter().map(one).collect()
            }
            Per::Interface => {
                let one = |i: &'a Interface| (Some(i.name.clone()), View { interface: Some(i), ..view });
                body.interfaces.iter().map(one).collect()
            }
            Per::UnitLoad => {
                let view = |g| View { geometric_stiffness: Some(g), ..view };
                body.geometric_stiffness.iter().map(|g| (Some(g.load.label()), view(g))).collect()
            }
            Per::InertiaLoad => {
                let view = |g| View { geometric_stiffness: Some(g), ..view };
                let all = body.inertia_stiffness.iter().flat_map(|own| &own.stiffness);
                all.map(|g| (Some(g.load.label()), view(g))).collect()
            }
        }
    }
}
