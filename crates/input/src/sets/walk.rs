//! Members of sets, found part by part. The time is proportional to the text of the sets and the number of their members:
//! numbers that were found are passed over by later ranges, and a set that was walked is not walked again.

use super::list::{Edit, Item, Members, SetList, SoFar};
use super::scope::SetScopes;
use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Kind of the members of sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Kind {
    Nodes,
    Elements,
}

/// Numbers of one kind in one scope.
type Space = (Option<usize>, Kind);

/// State of finding the members of one or several sets.
pub(super) struct Walk<'s> {
    scopes: &'s SetScopes,
    found: HashMap<Space, Found>,
    /// Number of items of each set that have been walked.
    walked: HashMap<(Space, usize), usize>,
}

/// Set that is being walked.
struct Frame {
    space: Space,
    set: usize,
    /// Number of its items that count.
    items: usize,
}

impl<'s> Walk<'s> {
    pub(super) fn new(scopes: &'s SetScopes) -> Self {
        Self { scopes, found: HashMap::new(), walked: HashMap::new() }
    }

    /// Returns the members of a node set that were not found yet, in the numbering of the model.
    pub(super) fn members(&mut self, instance: Option<usize>, set: SoFar) -> Vec<i64> {
        let mut members = Vec::new();
        self.walk((instance, Kind::Nodes), set, &mut members);
        members
    }

    /// Returns the members of an element set that were not found yet.
    pub(super) fn elements(&mut self, instance: Option<usize>, set: SoFar) -> Vec<i64> {
        let mut members = Vec::new();
        self.walk((instance, Kind::Elements), set, &mut members);
        members
    }

    /// Adds the members of a set. Sets that name sets are on a list instead of the stack, which a long chain of them would
    /// exceed.
    fn walk(&mut self, space: Space, SoFar { set, items }: SoFar, members: &mut Vec<i64>) {
        let mut open = vec![Frame { space, set, items }];
        while let Some(&Frame { space, set, items }) = open.last() {
            let next = self.walked.entry((space, set)).or_default();
            if *next >= items {
                open.pop();
                continue;
            }
            let at = *next;
            *next += 1;
            let list = self.list(space);
            let Item { instance, members: part } = &list.all[set].items[at];
            let space = (instance.or(space.0), space.1);
            match part {
                Members::Set(SoFar { set, items }) => open.push(Frame { space, set: *set, items: *items }),
                Members::NodesOfElements(set) => {
                    let elements = self.elements(space.0, *set);
                    let nodes = self.scopes.of(space.0).nodes_of(&elements);
                    self.take(space, &nodes, members);
                }
                Members::Numbers(numbers) => self.take(space, numbers, members),
                Members::Marked(bits) => {
                    let is_marked = |at: &usize| bits[at / 64] >> (at % 64) & 1 == 1;
                    let ids = &self.scopes.of(space.0).ids;
                    let marked = (0..ids.len().min(64 * bits.len())).filter(is_marked);
                    self.take(space, &marked.map(|at| ids[at]).collect::<Vec<_>>(), members);
                }
                Members::Edited(edits) => {
                    let numbers = edited(&self.ids(space), edits);
                    self.take(space, &numbers, members);
                }
                Members::Range { first, last, step } => {
                    let ids = self.ids(space);
                    let shift = self.shift(space);
                    let found = self.found.entry(space).or_default();
                    found.range(&ids, [*first, *last, *step], |id| members.push(id + shift));
                }
            }
        }
    }

    /// Adds the numbers that were not found yet.
    fn take(&mut self, space: Space, numbers: &[i64], members: &mut Vec<i64>) {
        let (ids, shift) = (self.ids(space), self.shift(space));
        let found = self.found.entry(space).or_default();
        members.extend(numbers.iter().filter(|id| found.take(&ids, **id)).map(|id| id + shift));
    }

    fn list(&self, (instance, kind): Space) -> &'s SetList {
        let scope = self.scopes.of(instance);
        match kind {
            Kind::Nodes => &scope.nodes,
            Kind::Elements => &scope.elements,
        }
    }

    fn ids(&self, (instance, kind): Space) -> Arc<Vec<i64>> {
        let scope = self.scopes.of(instance);
        match kind {
            Kind::Nodes => scope.sorted_ids(),
            Kind::Elements => Arc::clone(&scope.element_index().ids),
        }
    }

    fn shift(&self, (instance, kind): Space) -> i64 {
        match kind {
            Kind::Nodes => self.scopes.of(instance).shift,
            Kind::Elements => 0,
        }
    }
}

/// Numbers that were found.
#[derive(Debug, Default)]
pub(super) struct Found {
    /// For each number of the list that was found, the index from which to search for the next one that was not.
    next: HashMap<usize, usize>,
    /// Numbers that were found and are not in the list.
    others: HashSet<i64>,
    /// Ranges that were searched, by first, last and step.
    ranges: HashSet<[i64; 3]>,
}

impl Found {
    /// Notes a number. Returns true if it was not found before.
    fn take(&mut self, ids: &[i64], id: i64) -> bool {
        match ids.binary_search(&id) {
            Ok(at) => match self.next.entry(at) {
                Entry::Vacant(open) => {
                    open.insert(at + 1);
                    true
                }
                Entry::Occupied(_) => false,
            },
            Err(_) => self.others.insert(id),
        }
    }

    /// Returns the first index from `at` on whose number was not found yet.
    fn open_from(&mut self, at: usize) -> usize {
        let mut end = at;
        while let Some(next) = self.next.get(&end) {
            end = *next;
        }
        // The next search from any of these indices takes one step.
        let mut passed = at;
        while passed != end {
            passed = self.next.insert(passed, end).unwrap_or(end);
        }
        end
    }

    /// Gives the numbers of `ids` from `first` to `last` in steps of `step` that were not found yet to `add`.
    pub(super) fn range(&mut self, ids: &[i64], [first, last, step]: [i64; 3], mut add: impl FnMut(i64)) {
        if first > last || step <= 0 || !self.ranges.insert([first, last, step]) {
            return;
        }
        let begin = ids.partition_point(|id| *id < first);
        let end = ids.partition_point(|id| *id <= last);
        let values = (last.abs_diff(first) / step.unsigned_abs()).saturating_add(1);
        // Few numbers of a wide range are searched one by one.
        if step > 1 && values < (end - begin) as u64 {
            let numbers = (first..=last).step_by(step as usize);
            numbers.filter(|id| ids.binary_search(id).is_ok()).for_each(|id| {
                if self.take(ids, id) {
                    add(id);
                }
            });
            return;
        }
        let mut at = self.open_from(begin);
        while at < end {
            if ids[at].abs_diff(first).is_multiple_of(step.unsigned_abs()) {
                self.next.insert(at, at + 1);
                add(ids[at]);
            }
            at = self.open_from(at + 1);
        }
    }
}

/// Returns the numbers of `ids` that remain after all edits, ascending. The last edit that concerns a number decides, so
/// the edits are taken from the last one back.
fn edited(ids: &[i64], edits: &[Edit]) -> Vec<i64> {
    let (mut decided, mut members) = (Found::default(), Vec::new());
    for edit in edits.iter().rev() {
        match *edit {
            Edit::Add { first, last } => decided.range(ids, [first, last, 1], |id| members.push(id)),
            Edit::Remove(id) => {
                decided.take(ids, id);
            }
        }
    }
    members.sort_unstable();
    members
}
