//! Named sets of nodes and of elements. Sets are kept as their files define them: by numbers, by ranges and by other sets.
//! The members of a set are found when the set is requested, each of them once, so that a short file cannot define sets of
//! more members than there are nodes, and sets that nobody requests take no more memory than their text.

mod walk;

use super::jobs::comparable;
use flexbody_base::diagnostic::{Code, Diagnostic};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::{Arc, OnceLock};
use walk::Walk;

/// Number of instances that a message names.
const MAX_NAMED: usize = 5;

/// Largest number of dots of a name `INSTANCE.SET` at which the name of the instance may end.
const MAX_DOTS: usize = 20;

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
    set: usize,
    /// Number of its first items that count.
    items: usize,
}

impl Item {
    /// Returns a part of the scope that defines the set.
    pub(crate) fn own(members: Members) -> Self {
        Self { instance: None, members }
    }
}

/// Set with its parts.
#[derive(Debug, Clone)]
struct NamedSet {
    /// Name as written; `None` for a set that only other sets name.
    name: Option<String>,
    items: Vec<Item>,
    /// Reason why the set cannot be resolved.
    refused: Option<Diagnostic>,
    /// True if members are in ascending order.
    is_sorted: bool,
}

/// Sets of a scope in the order of the file, found by their names.
#[derive(Debug, Clone, Default)]
pub(crate) struct SetList {
    all: Vec<NamedSet>,
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
    fn names(&self) -> impl Iterator<Item = &str> {
        self.all.iter().filter(|set| set.refused.is_none()).filter_map(|set| set.name.as_deref())
    }

    fn has_ranges(&self) -> bool {
        let is_range = |item: &Item| matches!(item.members, Members::Range { .. });
        self.all.iter().flat_map(|set| &set.items).any(is_range)
    }

    fn name_elements(&self) -> bool {
        let of_elements = |item: &Item| matches!(item.members, Members::NodesOfElements(_));
        self.all.iter().flat_map(|set| &set.items).any(of_elements)
    }
}

/// Elements with their nodes.
pub(crate) type ElementNodes = Arc<Vec<(i64, Vec<i64>)>>;

/// Sets of a part, of the assembly, or of a file without either, with the nodes and elements that they select.
#[derive(Debug, Default)]
pub(crate) struct SetScope {
    pub nodes: Arc<SetList>,
    pub elements: Arc<SetList>,
    /// Node numbers in the order of the file.
    pub ids: Arc<Vec<i64>>,
    pub element_nodes: Vec<ElementNodes>,
    /// Difference of the node numbers of the model from those of the scope.
    pub shift: i64,
    pub index: SetIndex,
}

/// Nodes and elements of a scope by their numbers, made when a set is requested.
#[derive(Debug, Default)]
pub(crate) struct SetIndex {
    ids: OnceLock<Arc<Vec<i64>>>,
    elements: OnceLock<ElementIndex>,
}

/// Elements by their numbers.
#[derive(Debug, Default)]
struct ElementIndex {
    /// Numbers, ascending, each once.
    ids: Arc<Vec<i64>>,
    /// Number, block and place in the block of every element, ascending.
    places: Vec<(i64, u32, u32)>,
}

impl SetScope {
    fn sorted_ids(&self) -> Arc<Vec<i64>> {
        let sorted = || {
            if self.ids.is_sorted_by(|a, b| a < b) {
                return Arc::clone(&self.ids);
            }
            let mut ids = self.ids.to_vec();
            ids.sort_unstable();
            ids.dedup();
            Arc::new(ids)
        };
        Arc::clone(self.index.ids.get_or_init(sorted))
    }

    fn element_index(&self) -> &ElementIndex {
        self.index.elements.get_or_init(|| {
            let of_block = |(block, elements): (usize, &ElementNodes)| {
                let places = elements.iter().enumerate();
                places.map(|(at, (id, _))| (*id, block as u32, at as u32)).collect::<Vec<_>>()
            };
            let mut places: Vec<_> = self.element_nodes.iter().enumerate().flat_map(of_block).collect();
            places.sort_unstable();
            let mut ids: Vec<i64> = places.iter().map(|(id, ..)| *id).collect();
            ids.dedup();
            ElementIndex { ids: Arc::new(ids), places }
        })
    }

    /// Returns the nodes of elements, ascending.
    fn nodes_of(&self, elements: &[i64]) -> Vec<i64> {
        let places = &self.element_index().places;
        let of_element = |id: &i64| {
            let id = *id;
            let first = places.partition_point(|(other, ..)| *other < id);
            places[first..].iter().take_while(move |(other, ..)| *other == id)
        };
        let found = elements.iter().flat_map(of_element);
        let mut nodes: Vec<i64> = found
            .flat_map(|(_, block, at)| self.element_nodes[*block as usize][*at as usize].1.iter().copied())
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }
}

/// Instance of a part with its sets.
#[derive(Debug)]
pub(crate) struct SetInstance {
    pub name: String,
    pub scope: SetScope,
}

/// Named node sets of a model.
#[derive(Debug, Default)]
pub(crate) struct NodeSets {
    top: SetScope,
    instances: Vec<SetInstance>,
    /// Index of the first instance of each name in the form of comparison.
    by_form: HashMap<String, usize>,
    copies: Option<NodeCopies>,
}

/// Place of a node set.
struct SetPlace<'s> {
    /// Index of its instance; `None` for the assembly, or a file without instances.
    instance: Option<usize>,
    scope: &'s SetScope,
    /// Index in the list of the scope.
    set: usize,
}

impl<'s> SetPlace<'s> {
    fn named_set(&self) -> &'s NamedSet {
        &self.scope.nodes.all[self.set]
    }

    fn name(&self) -> Option<&'s str> {
        self.named_set().name.as_deref()
    }

    fn all(&self) -> SoFar {
        self.scope.nodes.all_of(self.set)
    }
}

/// Members of a set, or the reason why it cannot be resolved.
pub(crate) type Resolved = Result<Vec<i64>, Diagnostic>;

impl NodeSets {
    /// Returns the sets of a file without instances; `ids` are the numbers of its nodes in their order.
    pub(crate) fn of_nodes(ids: &[i64], nodes: SetList) -> Self {
        // Files without sets need no copy of the numbers.
        let ids = if nodes.all.is_empty() { Vec::new() } else { ids.to_vec() };
        let top = SetScope { nodes: Arc::new(nodes), ids: Arc::new(ids), ..SetScope::default() };
        Self { top, ..Self::default() }
    }

    /// Returns the sets of an assembly and of its instances.
    pub(crate) fn of_instances(mut top: SetScope, mut instances: Vec<SetInstance>) -> Self {
        let name_elements = |scope: &SetScope| scope.nodes.name_elements();
        let are_used = name_elements(&top) || instances.iter().any(|one| name_elements(&one.scope));
        if !are_used && !top.elements.has_ranges() {
            top.element_nodes.clear();
            instances.iter_mut().for_each(|one| one.scope.element_nodes.clear());
        }
        let mut by_form = HashMap::new();
        for (at, instance) in instances.iter().enumerate() {
            by_form.entry(comparable(&instance.name)).or_insert(at);
        }
        Self { top, instances, by_form, copies: None }
    }

    /// Returns the sets with copies of their nodes.
    pub(crate) fn with_copies(self, copies: Option<NodeCopies>) -> Self {
        Self { copies, ..self }
    }

    /// Returns the members of a set, each once, in the order of the file; `None` if there is no such set. Sets of
    /// instances are `INSTANCE.SET` and, if a single instance has the set, `SET`.
    pub(crate) fn find(&self, name: &str) -> Option<Resolved> {
        let place = match self.place(name)? {
            Ok(found) => found,
            Err(ambiguous) => return Some(Err(ambiguous)),
        };
        let set = place.named_set();
        if let Some(refused) = &set.refused {
            return Some(Err(refused.clone()));
        }
        let mut members = Walk::new(self).members(place.instance, place.all());
        if set.is_sorted {
            members.sort_unstable();
        }
        let members = self.copies.as_ref().map(|copies| copies.of_set(&members)).unwrap_or(members);
        Some(Ok(members))
    }

    /// Returns for each set the members that no set named before it has; `None` for a set that cannot be resolved.
    pub(crate) fn union<'n>(&self, names: impl Iterator<Item = &'n str>) -> Vec<Option<Vec<i64>>> {
        let mut walk = Walk::new(self);
        let members = |name: &'n str| match self.place(name)? {
            Ok(place) if place.named_set().refused.is_none() => {
                Some(walk.members(place.instance, place.all()))
            }
            _ => None,
        };
        names.map(members).collect()
    }

    /// Returns the members of an element set outside of parts and instances.
    pub(crate) fn elements(&self, name: &str) -> Option<Vec<i64>> {
        let set = self.top.elements.so_far(name)?;
        Some(Walk::new(self).elements(None, set))
    }

    /// Returns the index of an instance.
    pub(crate) fn instance(&self, name: &str) -> Option<usize> {
        self.by_form.get(&comparable(name)).copied()
    }

    /// Returns the names of sets, those of instances as `INSTANCE.SET` and `SET`.
    pub(crate) fn names(&self) -> impl Iterator<Item = String> {
        let of_instance = |one: &'_ SetInstance| {
            let list = one.scope.nodes.names().map(str::to_owned).collect::<Vec<_>>();
            let instance = one.name.clone();
            list.into_iter().flat_map(move |name| [format!("{instance}.{name}"), name])
        };
        let top = self.top.nodes.names().map(str::to_owned);
        let is_own = |name: &String| self.top.nodes.find(name).is_some();
        let inner = self.instances.iter().flat_map(of_instance).filter(move |name| !is_own(name));
        top.chain(inner.filter(|name| matches!(self.place(name), Some(Ok(_)))))
    }

    /// Returns the place of a set; an error for a name that several instances have.
    fn place(&self, name: &str) -> Option<Result<SetPlace<'_>, Diagnostic>> {
        let within = |instance: Option<usize>, name: &str| {
            let scope = self.scope(instance);
            Some(SetPlace { instance, scope, set: scope.nodes.find(name)? })
        };
        let of_instance =
            || dotted(name).find_map(|(instance, rest)| within(Some(self.instance(instance)?), rest));
        if let Some(place) = within(None, name).or_else(of_instance) {
            return Some(Ok(place));
        }
        let mut holders = (0..self.instances.len()).filter_map(|at| within(Some(at), name));
        let first = holders.next()?;
        let Some(second) = holders.next() else { return Some(Ok(first)) };
        let own = first.name().unwrap_or(name).to_owned();
        let all = [first, second].into_iter().chain(holders).take(MAX_NAMED);
        let named =
            |place: SetPlace<'_>| Some(format!("{}.{}", self.instances[place.instance?].name, place.name()?));
        let names: Vec<String> = all.filter_map(named).collect();
        let message = format!("several instances have a set `{own}`");
        let help = format!("name one of them: {}", names.join(", "));
        Some(Err(Diagnostic::new(Code::NodeSetUnknown, message).with_help(help)))
    }

    /// Returns the scope of an instance, or that of the assembly.
    fn scope(&self, instance: Option<usize>) -> &SetScope {
        instance.map_or(&self.top, |at| &self.instances[at].scope)
    }
}

/// Returns the ways to divide `INSTANCE.REST`. Names may contain dots.
pub(crate) fn dotted(name: &str) -> impl Iterator<Item = (&str, &str)> {
    name.match_indices('.').take(MAX_DOTS).map(|(dot, _)| (&name[..dot], &name[dot + 1..]))
}

/// New nodes that stand for nodes of sets.
#[derive(Debug)]
pub(crate) struct NodeCopies {
    /// Numbers of the copies of each node.
    pub copies: HashMap<i64, Vec<i64>>,
    /// Positions of all nodes.
    pub places: BTreeMap<i64, [f64; 3]>,
    /// Nodes with rows.
    pub with_rows: HashSet<i64>,
    /// True if a set with these points gets all copies of its nodes.
    pub needs_copies: fn(&[[f64; 3]]) -> bool,
}

impl NodeCopies {
    /// Returns the nodes of a set with the copies that stand for them. A set gets all copies of its nodes if one of them
    /// has a single copy, since the other one has the number of the deck, or if its points need copies.
    fn of_set(&self, nodes: &[i64]) -> Vec<i64> {
        let moves = |node: &&i64| self.with_rows.contains(node);
        let points: Vec<[f64; 3]> =
            nodes.iter().filter(moves).filter_map(|node| self.places.get(node).copied()).collect();
        let on_face = |node: &i64| {
            self.with_rows.contains(node) && self.copies.get(node).is_some_and(|own| own.len() == 1)
        };
        if !nodes.iter().any(on_face) && !(self.needs_copies)(&points) {
            return nodes.to_vec();
        }
        let more = nodes.iter().flat_map(|node| self.copies.get(node).into_iter().flatten());
        nodes.iter().chain(more).copied().collect()
    }
}

#[cfg(test)]
mod tests;
