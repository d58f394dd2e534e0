//! Sets of a scope as their file defines them: by numbers, by ranges and by other sets, found by their names.

use super::names::comparable;
use flexbody_base::diagnostic::Diagnostic;
use std::collections::HashMap;
use std::sync::Arc;

/// Part of a set.
#[derive(Debug, Clone)]
pub(crate) struct Item {
    /// Index of the instance to which numbers, sets and elements belong; `None` for the scope that defines the set.
    pub instance: Option<usize>,
    pub members: Members,
}

/// Members of a part of a set.
#[derive(Debug, Clone)]
pub(crate) enum Members {
    /// Numbers in their order.
    Numbers(Vec<i64>),
    /// Existing numbers from `first` to `last` in steps of `step`, which is positive.
    Range { first: i64, last: i64, step: i64 },
    /// Members of another set.
    Set(SoFar),
    /// Nodes of the elements of an element set, ascending.
    NodesOfElements(SoFar),
    /// Nodes whose bit is set, in the order of the nodes in the file.
    Marked(Arc<[u64]>),
    /// Existing numbers that remain after additions and removals, ascending.
    Edited(Vec<Edit>),
}

/// Step by which members of [`Members::Edited`] are selected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Edit {
    /// Adds the existing numbers of a range.
    Add { first: i64, last: i64 },
    /// Removes a number.
    Remove(i64),
}

/// Set as far as it was defined when another set named it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SoFar {
    pub(super) set: usize,
    /// Number of its first items that count.
    pub(super) items: usize,
}

impl Item {
    /// Returns a part of the scope that defines the set.
    pub(crate) fn own(members: Members) -> Self {
        Self { instance: None, members }
    }
}

/// Set with its parts.
#[derive(Debug, Clone)]
pub(super) struct NamedSet {
    /// Name as written; `None` for a set that only other sets name.
    pub name: Option<String>,
    pub items: Vec<Item>,
    /// Reason why the set cannot be resolved.
    pub refused: Option<Diagnostic>,
    /// True if members are in ascending order.
    pub is_sorted: bool,
}

/// Sets of a scope in the order of the file, found by their names.
#[derive(Debug, Clone, Default)]
pub(crate) struct SetList {
    pub(super) all: Vec<NamedSet>,
    /// Index of the first set of each name in lower case.
    by_name: HashMap<String, usize>,
    /// Index of the first set of each name in the form of comparison.
    by_form: HashMap<String, usize>,
}

impl SetList {
    /// Returns the set of a name, without regard to case, or else without regard to blanks as well.
    pub(crate) fn find(&self, name: &str) -> Option<usize> {
        let by_form = || self.by_form.get(&comparable(name));
        self.by_name.get(&name.to_ascii_lowercase()).or_else(by_form).copied()
    }

    /// Returns a set as far as it is defined; `None` if there is no such set or it cannot be resolved.
    pub(crate) fn so_far(&self, name: &str) -> Option<SoFar> {
        let set = self.find(name)?;
        self.all[set].refused.is_none().then(|| self.all_of(set))
    }

    /// Returns all of a set.
    pub(crate) fn all_of(&self, set: usize) -> SoFar {
        SoFar { set, items: self.all[set].items.len() }
    }

    /// Adds parts to the set of this name, which is created if necessary. A set with a part that cannot be resolved is an
    /// error as a whole.
    pub(crate) fn extend(&mut self, name: &str, items: Result<Vec<Item>, Diagnostic>) {
        let known = self.by_form.get(&comparable(name)).copied();
        let set = known.unwrap_or_else(|| self.add(name, Vec::new()));
        let set = &mut self.all[set];
        match items {
            Ok(items) if set.refused.is_none() => set.items.extend(items),
            Ok(_) => {}
            Err(refused) => {
                set.refused.get_or_insert(refused);
            }
        }
    }

    /// Adds a set. Of several sets of one name the first is found.
    pub(crate) fn add(&mut self, name: &str, items: Vec<Item>) -> usize {
        let set = self.all.len();
        self.by_name.entry(name.to_ascii_lowercase()).or_insert(set);
        self.by_form.entry(comparable(name)).or_insert(set);
        self.all.push(NamedSet { name: Some(name.to_owned()), items, refused: None, is_sorted: false });
        set
    }

    /// Adds a set whose members are in ascending order.
    pub(crate) fn add_sorted(&mut self, name: &str, items: Vec<Item>) {
        let set = self.add(name, items);
        self.all[set].is_sorted = true;
    }

    /// Adds a set that only other sets name.
    pub(crate) fn add_nameless(&mut self, items: Vec<Item>) -> SoFar {
        self.all.push(NamedSet { name: None, items, refused: None, is_sorted: false });
        self.all_of(self.all.len() - 1)
    }

    /// Removes the name of a set, whose members other sets may still name.
    pub(crate) fn forget(&mut self, name: &str) {
        if let Some(set) = self.by_form.remove(&comparable(name)) {
            let written = self.all[set].name.take().unwrap_or_default().to_ascii_lowercase();
            if self.by_name.get(&written) == Some(&set) {
                self.by_name.remove(&written);
            }
        }
    }

    /// Returns the names of the sets that can be resolved.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.all.iter().filter(|set| set.refused.is_none()).filter_map(|set| set.name.as_deref())
    }

    pub(super) fn has_ranges(&self) -> bool {
        let is_range = |item: &Item| matches!(item.members, Members::Range { .. });
        self.all.iter().flat_map(|set| &set.items).any(is_range)
    }

    pub(super) fn name_elements(&self) -> bool {
        let of_elements = |item: &Item| matches!(item.members, Members::NodesOfElements(_));
        self.all.iter().flat_map(|set| &set.items).any(of_elements)
    }
}
