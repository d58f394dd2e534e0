//! The building blocks of the table of the flex-body file: entries, their shapes, and the sources of their values.

use super::draft::Draft;
use super::names;
use super::per::Per;
use super::units::Units;
use super::value::{ReadValue, Value, View, text};
#[cfg(feature = "hdf5")]
use flexbody_body::flex_body::Storage;
use flexbody_body::flex_body::{Interface, LumpedBody, NamedLoad, Parts, Recovery, TermGroup};

/// One extent of a dataset's shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Extent {
    Fixed(usize),
    /// Number n of nodes of the body.
    Nodes,
    /// Number nf of modes.
    Modes,
    /// Three times the number of modes, 3 nf.
    ThreeModes,
    /// Six times the number of modes, 6 nf.
    SixModes,
    /// Number of nodes of the group's interface.
    InterfaceNodes,
    /// Number of rows of the modes without a position.
    InternalRows,
    /// Number nc of interface coordinates.
    Coordinates,
    /// Number nt of triangles of the surface.
    Triangles,
    /// Number ne of edges of the surface.
    Edges,
    /// Number r of rows of the group's recovery.
    RecoveryRows,
    /// Number ni of interfaces with loads in the group's recovery.
    LoadedInterfaces,
    /// Number nl of named loads in the group's recovery.
    NamedLoads,
    /// Number ny of fixed-interface modes of a Craig-Bampton basis.
    FixedInterfaceModes,
}
use Extent::{
    Coordinates, Edges, Fixed, FixedInterfaceModes, InterfaceNodes, InternalRows, LoadedInterfaces, Modes,
    NamedLoads, Nodes, RecoveryRows, SixModes, ThreeModes, Triangles,
};

/// Storage of an entry in the file.
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

/// Function that takes the value of an entry from a body; returns `None` only for entries that are not required.
pub(super) type Get = fn(&View<'_>) -> Option<Value>;

/// Function that puts the value of an entry of a file into the draft of a body. The error names the expected value and
/// the value found.
pub(super) type Put = fn(&mut Draft, ReadValue) -> Result<(), String>;

/// Both directions of an entry: from a body into a file, and back if the reader takes the entry from the file.
pub(super) struct Access {
    pub get: Get,
    pub put: Option<Put>,
}

/// Returns the access of an entry that is written and read.
pub(super) const fn both(get: Get, put: Put) -> Access {
    Access { get, put: Some(put) }
}

/// Returns the access of an entry that is only written. The reader checks it, ignores it, or reads it before all
/// others.
pub(super) const fn written(get: Get) -> Access {
    Access { get, put: None }
}

/// Makes the reading direction of an entry from an assignment.
macro_rules! put {
    (|$draft:ident, $read:ident| $assignment:expr) => {
        |$draft, $read| {
            $assignment;
            Ok(())
        }
    };
}
pub(super) use put;

/// Makes both directions of a field: `field!(certificate.shift)` for a field of the body, `field!(guarantee:
/// shift_below)` for a field of a part that the methods of this name of [`View`] and [`Draft`] return.
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

/// A set of entries that a file holds completely or not at all. `problem` makes the message for a file with some of
/// them from their keys, in the order of the table, each with true if the file holds the entry.
pub(super) struct EntrySet {
    #[cfg_attr(not(feature = "hdf5"), allow(dead_code))] // called by the reader only
    pub problem: fn(&[(String, bool)]) -> String,
}

/// Membership of an entry in a set of entries that belong together.
#[derive(Clone, Copy)]
pub(super) struct Membership {
    pub set: &'static EntrySet,
    pub need: Need,
}

/// Condition under which a set of entries requires a member.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Need {
    /// The set requires the entry.
    Always,
    /// The set requires the entry for readers before this minor version.
    Before(i64),
    /// The entry requires the set, but not the reverse.
    Never,
}

/// Source of the value of an entry.
#[derive(Clone, Copy)]
pub(super) enum Origin {
    /// Constant text of every file; a reader refuses others.
    ConstantText(&'static str),
    /// Constant integer of every file; a reader refuses others.
    ConstantInt(i64),
    /// Primary entry, which does not follow from other entries.
    Primary(Get),
    /// Derived entry, which follows from the primary entries; the reader recomputes it. Floats agree to
    /// [`DERIVED_TOLERANCE`] of the largest magnitude in the named dataset of the same group, everything else exactly.
    #[cfg_attr(not(feature = "hdf5"), allow(dead_code))] // compared by the reader only
    Derived(Get, &'static str),
}
use Origin::{ConstantInt, ConstantText, Derived, Primary};

/// Relative tolerance of derived entries. Files of this program agree to the last bit. Other writers may evaluate W1,
/// W2, W3 themselves, and independent evaluations of the invariants agree to 1e-12.
pub(super) const DERIVED_TOLERANCE: f64 = 1e-12;

/// Relative tolerance of derived entries in arrays of 32-bit floats, which are rounded separately.
#[cfg(feature = "hdf5")]
pub(super) const SHORT_TOLERANCE: f64 = f32::EPSILON as f64;

/// A row of the table: a dataset or attribute.
pub(super) struct Item {
    pub name: &'static str,
    pub kind: ItemKind,
    pub units: Units,
    pub symbol: &'static str,
    pub description: &'static str,
    pub required: bool,
    /// Minor version of the format that introduced the entry.
    pub since: i64,
    pub origin: Origin,
    /// Direction into a body; `None` for entries that the reader does not take from the file, or reads before all others.
    pub put: Option<Put>,
    /// Set of entries that the entry belongs to.
    pub together: Option<Membership>,
    /// Group of the kinetic energy that the entry belongs to. The entry is required if the body holds the group, and
    /// must be absent otherwise.
    pub of: Option<TermGroup>,
    /// True for a large array, which has 32-bit floats if the body is stored with them.
    pub large: bool,
}

/// A group with its entries. `<scheme>` and `<name>` are placeholders for names that are data.
pub(super) struct SchemaGroup {
    pub path: &'static str,
    pub per: Per,
    pub description: &'static str,
    pub items: &'static [&'static [Item]],
}

impl Item {
    /// Marks the entry as derived, compared relative to the dataset `from`.
    pub(crate) const fn derived(mut self, from: &'static str) -> Self {
        if let Primary(get) = self.origin {
            self.origin = Derived(get, from);
        }
        self
    }

    /// Makes the entry a required member of a set of entries that belong together.
    pub(crate) const fn with(mut self, set: &'static EntrySet) -> Self {
        self.together = Some(Membership { set, need: Need::Always });
        self
    }

    /// Makes the entry an optional companion of a set of entries that belong together.
    pub(crate) const fn beside(mut self, set: &'static EntrySet) -> Self {
        self.together = Some(Membership { set, need: Need::Never });
        self
    }

    /// Makes the entry a member of a set of entries that belong together, which readers before a minor version require
    /// with the set.
    pub(crate) const fn needed_before(mut self, minor: i64, set: &'static EntrySet) -> Self {
        self.together = Some(Membership { set, need: Need::Before(minor) });
        self
    }

    /// Returns true if `set` requires the entry.
    pub(crate) fn is_required_by(&self, set: &'static EntrySet) -> bool {
        self.together.is_some_and(|own| own.need == Need::Always && std::ptr::eq(own.set, set))
    }

    /// Returns the set that does not require the entry since the version `minor`, and did before.
    pub(crate) fn optional_member(&self, minor: i64) -> Option<&'static EntrySet> {
        self.together.filter(|own| own.need == Need::Before(minor)).map(|own| own.set)
    }

    /// Assigns the entry to a group of the kinetic energy.
    pub(crate) const fn of(mut self, group: TermGroup) -> Self {
        self.of = Some(group);
        self
    }

    /// Marks a large array, which may be stored in 32-bit floats.
    pub(crate) const fn large(mut self) -> Self {
        self.large = true;
        self
    }

    /// Returns true when a body with this storage has this array in 32-bit floats.
    #[cfg(feature = "hdf5")]
    pub(crate) fn is_short(&self, storage: Storage) -> bool {
        self.large && storage == Storage::F32
    }

    /// Marks the entry as optional.
    pub(crate) const fn optional(mut self) -> Self {
        self.required = false;
        self
    }

    /// Marks the entry as optional, and introduced by a minor version.
    pub(crate) const fn added(mut self, minor: i64) -> Self {
        self.since = minor;
        self.optional()
    }

    /// Marks the entry as required in a group that a minor version introduced.
    pub(crate) const fn within(mut self, minor: i64) -> Self {
        self.since = minor;
        self
    }

    /// Returns the value of the entry for a body.
    pub(crate) fn value(&self, view: &View<'_>) -> Option<Value> {
        match self.origin {
            ConstantText(value) => text(value),
            ConstantInt(value) => Some(Value::Int(value)),
            Primary(get) | Derived(get, _) => get(view),
        }
    }

    /// Returns the shape of a dataset; `None` for attributes.
    pub(crate) fn shape(&self) -> Option<&'static [Extent]> {
        match self.kind {
            Floats(shape) | Ints(shape) | Indices(shape) => Some(shape),
            Text | Int | Float | Named => None,
        }
    }

    /// Returns the extents of a dataset for a body.
    pub(crate) fn dims(&self, view: &View<'_>) -> Vec<usize> {
        let nf = view.body.modes.eigenvalue.len();
        let size = |extent: &Extent| match *extent {
            Fixed(size) => size,
            Nodes => view.body.nodes.len(),
            Modes => nf,
            ThreeModes => 3 * nf,
            SixModes => 6 * nf,
            InterfaceNodes => view.interface_nodes().len(),
            Coordinates => view.body.coordinates.as_ref().map_or(0, |c| c.names.len()),
            Triangles => view.body.mesh.as_ref().map_or(0, |mesh| mesh.triangles().len()),
            Edges => view.body.mesh.as_ref().map_or(0, |mesh| mesh.edges().len()),
            RecoveryRows => view.recovery.map_or(0, |recovery| recovery.rows.len()),
            LoadedInterfaces => view.recovery.map_or(0, |recovery| recovery.loads.len()),
            NamedLoads => view.recovery.map_or(0, |one| one.named.ncols()),
            FixedInterfaceModes => view.fixed_interface().map_or(0, |fixed| fixed.eigenvalues.len()),
            InternalRows => view.body.modes.internal.as_ref().map_or(0, |internal| internal.dofs.len()),
        };
        self.shape().unwrap_or(&[]).iter().map(size).collect()
    }
}

impl SchemaGroup {
    /// Returns all entries, in the order of the table.
    pub(crate) fn entries(&self) -> impl Iterator<Item = &'static Item> + use<> {
        self.items.iter().flat_map(|part| part.iter())
    }

    /// Returns the minor version that introduced the group with all its entries.
    pub(crate) fn since(&self) -> i64 {
        self.entries().map(|item| item.since).min().unwrap_or(0)
    }

    /// Returns the path without the last name.
    pub(crate) fn parent(&self) -> &'static str {
        self.path.rfind('/').map_or(self.path, |i| &self.path[..i])
    }

    /// Returns the path of an instance, with the placeholder replaced by a link name.
    pub(crate) fn place(&self, link: Option<&str>) -> String {
        match link {
            Some(link) => format!("{}/{link}", self.parent()),
            None => self.path.to_owned(),
        }
    }

    /// Returns the link names of `instances` as a JSON array, if there are several and their order is data.
    pub(crate) fn order(&self, instances: &[(Option<String>, View<'_>)]) -> Option<String> {
        let links: Vec<String> =
            instances.iter().filter_map(|(name, _)| name.as_deref().map(names::encode)).collect();
        let is_data = self.per.is_ordered() && links.len() > 1;
        is_data.then(|| serde_json::to_string(&links).expect("strings are valid JSON"))
    }

    /// Returns the instances of this group in a body, with their names if these are data.
    pub(crate) fn instances<'a>(&self, body: &'a Parts) -> Vec<(Option<String>, View<'a>)> {
        let view = View {
            body,
            lumped: None,
            interface: None,
            geometric_stiffness: None,
            rotated: None,
            recovery: None,
            named_load: None,
        };
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
            Per::RotatedLoad => {
                let view = |r| View { rotated: Some(r), ..view };
                body.rotated_stiffness.iter().map(|r| (Some(r.load.label()), view(r))).collect()
            }
            Per::Recovery => {
                let one = |r: &'a Recovery| (Some(r.name.clone()), View { recovery: Some(r), ..view });
                body.recoveries.iter().map(one).collect()
            }
            Per::NamedLoad => {
                let one = |l: &'a NamedLoad| (Some(l.name.clone()), View { named_load: Some(l), ..view });
                body.named_loads.iter().map(one).collect()
            }
            Per::EstimatedLoad => {
                let view = |g| View { geometric_stiffness: Some(g), ..view };
                body.estimated_stiffness.iter().map(|g| (Some(g.load.label()), view(g))).collect()
            }
            Per::InertiaLoad => {
                let view = |g| View { geometric_stiffness: Some(g), ..view };
                let all = body.inertia_stiffness.iter().flat_map(|own| &own.stiffness);
                all.map(|g| (Some(g.load.label()), view(g))).collect()
            }
        }
    }
}
