//! The links of a group of an HDF5 file.

use hdf5_metno::{Group, LinkType};
use std::collections::BTreeMap;

/// Links of a group by name.
pub(crate) struct Members(BTreeMap<String, LinkType>);

impl Members {
    /// Returns the links of `group`; none if they cannot be listed.
    pub(crate) fn of(group: &Group) -> Self {
        let mut links = BTreeMap::new();
        // A group that cannot be listed is reported as a group without a matrix.
        let _ = group.iter_visit_default(|name, info| {
            links.insert(name.to_owned(), info.link_type);
            Ok(())
        });
        Self(links)
    }

    /// Returns the type of the link `name`; `None` if the group has none of this name.
    pub(crate) fn link(&self, name: &str) -> Option<LinkType> {
        self.0.get(name).copied()
    }

    /// Returns true when `name` is a hard link. A soft link may lead to another file.
    pub(super) fn is_here(&self, name: &str) -> bool {
        self.link(name) == Some(LinkType::Hard)
    }

    /// Returns true when `name` is a soft or external link. Such links are not followed.
    pub(crate) fn is_elsewhere(&self, name: &str) -> bool {
        self.link(name).is_some_and(|link| link != LinkType::Hard)
    }

    /// Returns the names of the hard links.
    pub(crate) fn hard_links(&self) -> impl Iterator<Item = &str> {
        self.0.iter().filter(|(_, link)| **link == LinkType::Hard).map(|(name, _)| name.as_str())
    }

    /// Returns the first of `names` that is a link.
    pub(crate) fn first(&self, names: &[&'static str]) -> Option<&'static str> {
        names.iter().copied().find(|name| self.0.contains_key(*name))
    }
}
