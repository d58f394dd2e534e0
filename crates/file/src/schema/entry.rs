//! Entries of version 1.0, of which the table is written.

use super::super::item::Origin::{self, Primary};
use super::super::item::{Access, EntrySet, Item, ItemKind};
use super::super::units::{ONE, Units};

/// Returns a required dataset of version 1.0.
pub(super) const fn dataset(
    name: &'static str,
    kind: ItemKind,
    units: Units,
    symbol: &'static str,
    description: &'static str,
    access: Access,
) -> Item {
    Item {
        name,
        kind,
        units,
        symbol,
        description,
        required: true,
        since: 0,
        origin: Primary(access.get),
        put: access.put,
        together: None,
        of: None,
        large: false,
    }
}

/// Returns a required attribute of version 1.0.
pub(super) const fn attribute(
    name: &'static str,
    kind: ItemKind,
    units: Units,
    description: &'static str,
    access: Access,
) -> Item {
    dataset(name, kind, units, "", description, access)
}

/// Returns a required attribute of version 1.0 with one value for every file.
pub(super) const fn constant(
    name: &'static str,
    kind: ItemKind,
    origin: Origin,
    description: &'static str,
) -> Item {
    Item {
        name,
        kind,
        units: ONE,
        symbol: "",
        description,
        required: true,
        since: 0,
        origin,
        put: None,
        together: None,
        of: None,
        large: false,
    }
}

/// Returns the element of `all` with the name `found`. The error lists the known names.
pub(super) fn named<T: Copy>(found: String, all: &[T], name: fn(T) -> &'static str) -> Result<T, String> {
    all.iter().copied().find(|one| name(*one) == found).ok_or_else(|| {
        let known: Vec<String> = all.iter().map(|one| format!("`{}`", name(*one))).collect();
        format!("expected one of {}, found {found:?}", known.join(", "))
    })
}

/// Entries of the inertia of the modes, all of which a body has, or none.
pub(super) static INERTIA: EntrySet = EntrySet {
    problem: |entries| {
        let names: Vec<&str> = entries.iter().map(|(name, _)| name.as_str()).collect();
        format!("{}: expected all or none, found some", names.join(", "))
    },
};
