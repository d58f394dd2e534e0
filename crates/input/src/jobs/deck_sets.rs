//! Nodes, elements and node sets of a keyword deck, by the scope that defines them, and node sets of instances by the
//! names of the assembly (`INSTANCE.SET`, `INSTANCE.12`).

use super::deck::comparable;
use super::{NodeSets, Unresolved};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::scanner::integer;
use std::collections::{BTreeMap, HashMap};

/// Number of instances that a message names.
const MAX_NAMED: usize = 5;

/// Members of a set, or the reason why it cannot be resolved.
pub(super) type Found<T> = Result<Vec<T>, Diagnostic>;

/// Elements of one type.
#[derive(Debug, Clone)]
pub(super) struct Elements {
    /// Type in upper case.
    pub kind: String,
    /// Number and nodes of each element.
    pub members: Vec<(i64, Vec<i64>)>,
}

/// Nodes, elements and sets of a part, of the assembly, or of a deck without either.
#[derive(Debug, Clone, Default)]
pub(super) struct Scope {
    pub nodes: BTreeMap<i64, [f64; 3]>,
    pub elements: Vec<Elements>,
    pub sets: Sets,
    pub element_sets: HashMap<String, Vec<i64>>,
}

impl Scope {
    /// Returns the nodes of the elements of a set, ascending.
    pub(super) fn nodes_of_elements(&self, set: &str) -> Option<Vec<i64>> {
        let wanted = self.element_sets.get(&comparable(set))?;
        let wanted: std::collections::HashSet<i64> = wanted.iter().copied().collect();
        let members = self.elements.iter().flat_map(|elements| &elements.members);
        let mut nodes: Vec<i64> = members
            .filter(|(id, _)| wanted.contains(id))
            .flat_map(|(_, nodes)| nodes.iter().copied())
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        Some(nodes)
    }
}

/// Node of a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Member {
    /// Index of the instance of the node; `None` for a node of the scope that defines the set.
    instance: Option<usize>,
    id: i64,
}

impl Member {
    /// Returns a node of the scope that defines the set.
    pub(super) fn of_scope(id: i64) -> Self {
        Self { instance: None, id }
    }
}

/// Sets of a scope, in the order of the deck, with their names as written.
#[derive(Debug, Clone, Default)]
pub(super) struct Sets {
    all: Vec<(String, Found<Member>)>,
}

impl Sets {
    pub(super) fn find(&self, name: &str) -> Option<&Found<Member>> {
        let name = comparable(name);
        self.all.iter().find(|(key, _)| comparable(key) == name).map(|(_, members)| members)
    }

    /// Adds members to the set of this name, which is created if necessary. A set with members that cannot be resolved
    /// is an error as a whole.
    pub(super) fn extend(&mut self, name: &str, members: Found<Member>) {
        let wanted = comparable(name);
        let Some((_, set)) = self.all.iter_mut().find(|(key, _)| comparable(key) == wanted) else {
            return self.all.push((name.to_owned(), members));
        };
        match (set.as_mut(), members) {
            (Ok(set), Ok(members)) => set.extend(members),
            (Ok(_), Err(refused)) => *set = Err(refused),
            (Err(_), _) => {}
        }
    }

    /// Returns the sets of the whole model: those of the assembly (or of a deck without one), and those of the
    /// instances, each with its shift of node numbers, as `INSTANCE.SET` and, if a single instance has it, as `SET`.
    pub(super) fn of_model(&self, instances: &[(&str, &Scope, i64)]) -> (NodeSets, Unresolved) {
        let (mut sets, mut unresolved) = (NodeSets::new(), Unresolved::new());
        let mut add = |name: String, members: &Found<Member>, shift: i64| match members {
            Ok(members) => {
                let of = |member: &Member| member.id + member.instance.map_or(shift, |k| instances[k].2);
                sets.push((name, members.iter().map(of).collect()));
            }
            Err(refused) => unresolved.push((name, refused.clone())),
        };
        self.all.iter().for_each(|(name, members)| add(name.clone(), members, 0));
        for (k, (instance, scope, shift)) in instances.iter().enumerate() {
            for (name, members) in &scope.sets.all {
                let whole = format!("{instance}.{name}");
                if self.find(&whole).is_none() {
                    add(whole, members, *shift);
                }
                if self.find(name).is_some() {
                    continue;
                }
                let others = || instances.iter().filter(|(_, scope, _)| scope.sets.find(name).is_some());
                match others().count() {
                    1 => add(name.clone(), members, *shift),
                    // The first of several instances reports the ambiguity.
                    _ if instances[..k].iter().all(|(_, scope, _)| scope.sets.find(name).is_none()) => {
                        let names =
                            others().take(MAX_NAMED).map(|(instance, ..)| format!("{instance}.{name}"));
                        add(name.clone(), &Err(ambiguous(name, &names.collect::<Vec<_>>())), 0);
                    }
                    _ => {}
                }
            }
        }
        (sets, unresolved)
    }
}

fn ambiguous(name: &str, all: &[String]) -> Diagnostic {
    let message = format!("several instances have a set `{name}`");
    Diagnostic::new(Code::NodeSetUnknown, message).with_help(format!("name one of them: {}", all.join(", ")))
}

/// Instances from which sets of the assembly select nodes.
pub(super) struct Instances<'s> {
    all: Vec<(&'s str, &'s Scope)>,
}

/// One instance of the assembly.
pub(super) struct OneInstance<'s> {
    place: usize,
    scope: &'s Scope,
}

impl<'s> Instances<'s> {
    pub(super) fn new(all: Vec<(&'s str, &'s Scope)>) -> Self {
        Self { all }
    }

    pub(super) fn find(&self, name: &str) -> Option<OneInstance<'s>> {
        let name = comparable(name);
        let place = self.all.iter().position(|(key, _)| comparable(key) == name)?;
        Some(OneInstance { place, scope: self.all[place].1 })
    }

    /// Returns the nodes of `INSTANCE.12` or `INSTANCE.SET`. Names may contain dots.
    pub(super) fn named(&self, name: &str) -> Option<Vec<Member>> {
        name.match_indices('.').find_map(|(dot, _)| {
            let (instance, rest) = (self.find(&name[..dot])?, &name[dot + 1..]);
            instance.set(rest).or_else(|| integer(rest.as_bytes()).map(|id| vec![instance.member(id)]))
        })
    }

    /// Returns the nodes of an element set of an instance.
    pub(super) fn nodes_of_elements(&self, instance: &str, set: &str) -> Option<Vec<Member>> {
        let one = self.find(instance)?;
        let nodes = one.scope.nodes_of_elements(set)?;
        Some(nodes.into_iter().map(|id| one.member(id)).collect())
    }
}

impl OneInstance<'_> {
    pub(super) fn member(&self, id: i64) -> Member {
        Member { instance: Some(self.place), id }
    }

    /// Returns the nodes of a set of the instance.
    pub(super) fn set(&self, name: &str) -> Option<Vec<Member>> {
        let members = self.scope.sets.find(name)?.as_ref().ok()?;
        Some(members.iter().map(|member| self.member(member.id)).collect())
    }
}
