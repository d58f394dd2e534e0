//! The members of a group, and the names under which it holds a sparse matrix.

use hdf5_metno::{Group, LinkType};
use std::collections::BTreeMap;

const INDICES: &[&str] = &["indices", "ir"];
pub(super) const POINTERS: &[&str] = &["indptr", "jc"];
const VALUES: &[&str] = &["data", "values", "val"];
const ROWS: &[&str] = &["row", "rows", "i"];
const COLUMNS: &[&str] = &["col", "cols", "j"];

/// Links of a group by name.
pub(super) struct Members(BTreeMap<String, LinkType>);

impl Members {
    /// Returns the links of `group`; none if they cannot be listed.
    pub(super) fn of(group: &Group) -> Self {
        let mut links = BTreeMap::new();
        // A group that cannot be listed is reported as a group without a matrix.
        let _ = group.iter_visit_default(|name, info| {
            links.insert(name.to_owned(), info.link_type);
            Ok(())
        });
        Self(links)
    }

    pub(super) fn link(&self, name: &str) -> Option<LinkType> {
        self.0.get(name).copied()
    }

    /// Returns true when `name` is a hard link. A soft link may lead to another file.
    pub(super) fn is_here(&self, name: &str) -> bool {
        self.link(name) == Some(LinkType::Hard)
    }

    /// Returns true when `name` is a soft or external link. Such links are not followed.
    pub(super) fn is_elsewhere(&self, name: &str) -> bool {
        self.link(name).is_some_and(|link| link != LinkType::Hard)
    }

    pub(super) fn hard_links(&self) -> impl Iterator<Item = &str> {
        self.0.iter().filter(|(_, link)| **link == LinkType::Hard).map(|(name, _)| name.as_str())
    }

    pub(super) fn first(&self, names: &[&'static str]) -> Option<&'static str> {
        names.iter().copied().find(|name| self.0.contains_key(*name))
    }

    /// Returns the names of values, indices and pointers; `None` if one is missing.
    pub(super) fn compressed(&self) -> Option<(&'static str, &'static str, &'static str)> {
        Some((self.first(VALUES)?, self.first(INDICES)?, self.first(POINTERS)?))
    }

    /// Returns the names of values, rows and columns; `None` if one is missing.
    pub(super) fn coordinates(&self) -> Option<(&'static str, &'static str, &'static str)> {
        Some((self.first(VALUES)?, self.first(ROWS)?, self.first(COLUMNS)?))
    }

    pub(super) fn look_like_a_matrix(&self) -> bool {
        self.compressed().is_some() || self.coordinates().is_some()
    }
}
