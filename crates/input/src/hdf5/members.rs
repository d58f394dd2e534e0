//! What a group holds, and under which names a sparse matrix is kept in it.

use hdf5_metno::{Group, LinkType};
use std::collections::BTreeMap;

const INDICES: &[&str] = &["indices", "ir"];
pub(super) const POINTERS: &[&str] = &["indptr", "jc"];
const VALUES: &[&str] = &["data", "values", "val"];
const ROWS: &[&str] = &["row", "rows", "i"];
const COLUMNS: &[&str] = &["col", "cols", "j"];

/// The links of a group by name.
pub(super) struct Members(BTreeMap<String, LinkType>);

impl Members {
    /// Those of `group`; none when they cannot be listed.
    pub(super) fn of(group: &Group) -> Self {
        let mut links = BTreeMap::new();
        // A group that cannot be listed is reported as holding no matrix.
        let _ = group.iter_visit_default(|name, info| {
            links.insert(name.to_owned(), info.link_type);
            Ok(())
        });
        Self(links)
    }

    pub(super) fn link(&self, name: &str) -> Option<LinkType> {
        self.0.get(name).copied()
    }

    /// True if `name` is there by a hard link: a soft link may lead through another file.
    pub(super) fn is_here(&self, name: &str) -> bool {
        self.link(name) == Some(LinkType::Hard)
    }

    /// True if `name` is a soft or an external link, which are not followed.
    pub(super) fn is_elsewhere(&self, name: &str) -> bool {
        self.link(name).is_some_and(|link| link != LinkType::Hard)
    }

    pub(super) fn hard_links(&self) -> impl Iterator<Item = &str> {
        self.0.iter().filter(|(_, link)| **link == LinkType::Hard).map(|(name, _)| name.as_str())
    }

    pub(super) fn first(&self, names: &[&'static str]) -> Option<&'static str> {
        names.iter().copied().find(|name| self.0.contains_key(*name))
    }

    /// The names of values, indices and pointers.
    pub(super) fn compressed(&self) -> Option<(&'static str, &'static str, &'static str)> {
        Some((self.first(VALUES)?, self.first(INDICES)?, self.first(POINTERS)?))
    }

    /// The names of values, rows and columns.
    pub(super) fn coordinates(&self) -> Option<(&'static str, &'static str, &'static str)> {
        Some((self.first(VALUES)?, self.first(ROWS)?, self.first(COLUMNS)?))
    }

    pub(super) fn look_like_a_matrix(&self) -> bool {
        self.compressed().is_some() || self.coordinates().is_some()
    }
}
