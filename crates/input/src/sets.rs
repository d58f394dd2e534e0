//! Named sets of nodes and of elements. Sets are kept as their files define them: by numbers, by ranges and by other sets.
//! The members of a set are found when the set is requested, each of them once, so that a short file cannot define sets of
//! more members than there are nodes, and sets that nobody requests take no more memory than their text.

mod list;
mod names;
mod scope;
mod walk;

use flexbody_base::diagnostic::{Code, Diagnostic};
use list::NamedSet;
use scope::SetScopes;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;
use walk::Walk;

pub(super) use list::{Edit, Item, Members, SetList, SoFar};
pub(super) use names::{comparable, dotted};
pub(super) use scope::{ElementNodes, SetIndex, SetInstance, SetScope};

/// Number of instances that a message names.
const MAX_NAMED: usize = 5;

/// Named node sets of a model.
#[derive(Debug, Default)]
pub(crate) struct NodeSets {
    scopes: SetScopes,
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
        Self { scopes: SetScopes { top, instances: Vec::new() }, ..Self::default() }
    }

    /// Returns the sets of an assembly and of its instances. Element sets of instances are resolved if `keep_elements` is
    /// true.
    pub(crate) fn of_instances(
        mut top: SetScope,
        mut instances: Vec<SetInstance>,
        keep_elements: bool,
    ) -> Self {
        let name_elements = |scope: &SetScope| scope.nodes.name_elements();
        let are_used = keep_elements
            || name_elements(&top)
            || instances.iter().any(|instance| name_elements(&instance.scope));
        if !are_used && !top.elements.has_ranges() {
            top.element_nodes.clear();
            instances.iter_mut().for_each(|instance| instance.scope.element_nodes.clear());
        }
        let mut by_form = HashMap::new();
        for (at, instance) in instances.iter().enumerate() {
            by_form.entry(comparable(&instance.name)).or_insert(at);
        }
        Self { scopes: SetScopes { top, instances }, by_form, copies: None }
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
        let mut members = Walk::new(&self.scopes).members(place.instance, place.all());
        if set.is_sorted {
            members.sort_unstable();
        }
        let members = self.copies.as_ref().map(|copies| copies.of_set(&members)).unwrap_or(members);
        Some(Ok(members))
    }

    /// Returns for each set the members that no set named before it has; `None` for a set that cannot be resolved.
    pub(crate) fn union<'n>(&self, names: impl Iterator<Item = &'n str>) -> Vec<Option<Vec<i64>>> {
        let mut walk = Walk::new(&self.scopes);
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
        let set = self.scopes.top.elements.so_far(name)?;
        Some(Walk::new(&self.scopes).elements(None, set))
    }

    /// Returns the members of an element set of an instance, or of the assembly, in the numbering of its part.
    pub(crate) fn elements_of(&self, instance: Option<usize>, name: &str) -> Option<Vec<i64>> {
        let set = self.scopes.of(instance).elements.so_far(name)?;
        Some(Walk::new(&self.scopes).elements(instance, set))
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
        let top = self.scopes.top.nodes.names().map(str::to_owned);
        let is_own = |name: &String| self.scopes.top.nodes.find(name).is_some();
        let inner = self.scopes.instances.iter().flat_map(of_instance).filter(move |name| !is_own(name));
        top.chain(inner.filter(|name| matches!(self.place(name), Some(Ok(_)))))
    }

    /// Returns the place of a set; an error for a name that several instances have.
    fn place(&self, name: &str) -> Option<Result<SetPlace<'_>, Diagnostic>> {
        let within = |instance: Option<usize>, name: &str| {
            let scope = self.scopes.of(instance);
            Some(SetPlace { instance, scope, set: scope.nodes.find(name)? })
        };
        let of_instance =
            || dotted(name).find_map(|(instance, rest)| within(Some(self.instance(instance)?), rest));
        if let Some(place) = within(None, name).or_else(of_instance) {
            return Some(Ok(place));
        }
        let mut holders = (0..self.scopes.instances.len()).filter_map(|at| within(Some(at), name));
        let first = holders.next()?;
        let Some(second) = holders.next() else { return Some(Ok(first)) };
        let own = first.name().unwrap_or(name).to_owned();
        let all = [first, second].into_iter().chain(holders).take(MAX_NAMED);
        let named = |place: SetPlace<'_>| {
            Some(format!("{}.{}", self.scopes.instances[place.instance?].name, place.name()?))
        };
        let names: Vec<String> = all.filter_map(named).collect();
        let message = format!("several instances have a set `{own}`");
        let help = format!("name one of them: {}", names.join(", "));
        Some(Err(Diagnostic::new(Code::NodeSetUnknown, message).with_help(help)))
    }
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
mod tests {
    use super::*;
    use crate::node_files::read_node_file;
    use flexbody_base::text::InputFile;

    fn own(members: Members) -> Item {
        Item::own(members)
    }

    fn range(first: i64, last: i64, step: i64) -> Item {
        own(Members::Range { first, last, step })
    }

    impl NodeSets {
        /// Returns the number of numbers, of words of bits and of parts that are kept.
        fn n_kept(&self) -> usize {
            let of_item = |item: &Item| match &item.members {
                Members::Numbers(numbers) => 1 + numbers.len(),
                Members::Marked(words) => 1 + words.len(),
                Members::Edited(edits) => 1 + edits.len(),
                _ => 1,
            };
            let scopes =
                self.scopes.instances.iter().map(|instance| &instance.scope).chain([&self.scopes.top]);
            let lists = scopes.flat_map(|scope| [&scope.nodes, &scope.elements]);
            lists.flat_map(|list| &list.all).flat_map(|set| &set.items).map(of_item).sum()
        }
    }

    /// Returns the sets of a file of nodes.
    fn sets_of(name: &str, text: impl AsRef<[u8]>) -> NodeSets {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("written");
        read_node_file(&InputFile::open(&path).expect("a file"), 3).expect("nodes").sets
    }

    fn members(sets: &NodeSets, name: &str) -> Vec<i64> {
        sets.find(name).expect("a set").expect("resolved")
    }

    const NODES: &str = "*NODE\n10,0,0,0\n20,.1,0,0\n30,0,.2,0\n40,0,0,.3\n";

    /// Each of 40 levels names the level before it twice: a trillion members, if they were listed.
    #[test]
    fn sets_of_sets_have_each_member_once() {
        let element = "*ELEMENT, TYPE=C3D4, ELSET=A0\n1, 10,20,30,40\n";
        let levels = |keyword: &str, name: &str| -> String {
            (1..=40)
                .map(|k| format!("*{keyword}, {keyword}={name}{k}\n{name}{}, {name}{}\n", k - 1, k - 1))
                .collect()
        };
        let text = format!("{NODES}*NSET, NSET=B0\n20, 10\n{}", levels("NSET", "B"));
        let sets = sets_of("nodes.inp", text);
        assert_eq!(members(&sets, "B40"), [20, 10], "the order of the file");
        assert!(sets.n_kept() < 200, "{}", sets.n_kept());
        let text = format!("{NODES}{element}{}*NSET, NSET=N, ELSET=A40\n", levels("ELSET", "A"));
        let sets = sets_of("nodes.inp", text);
        assert_eq!(members(&sets, "N"), [10, 20, 30, 40]);
        assert!(sets.n_kept() < 250, "{}", sets.n_kept());
        // A set that names itself is the set as it was above.
        let text =
            format!("{NODES}*NSET, NSET=A\n10, 20\n{}*NSET, NSET=A\n30\n", "*NSET, NSET=A\nA\n".repeat(40));
        assert_eq!(members(&sets_of("nodes.inp", text), "A"), [10, 20, 30]);
    }

    /// Sets that name an earlier set have its members at that line.
    #[test]
    fn a_set_has_the_members_that_another_set_had_above() {
        let text =
            format!("{NODES}*NSET, NSET=A\n10\n*NSET, NSET=B\nA\n*NSET, NSET=A\n20\n*NSET, NSET=C\n40, A\n");
        let sets = sets_of("nodes.inp", text);
        assert_eq!(members(&sets, "b"), [10]);
        assert_eq!(members(&sets, "C"), [40, 10, 20]);
        assert_eq!(sets.names().collect::<Vec<_>>(), ["A", "B", "C"]);
    }

    #[test]
    fn ranges_are_the_numbers_that_exist() {
        let lines = "1, 99999999, 1\n1, 200000002, 3\n".repeat(50);
        let text = format!("*NSET, NSET=A, GENERATE\n20, 30, 10\n{lines}{NODES}");
        let sets = sets_of("nodes.inp", text);
        assert_eq!(members(&sets, "A"), [20, 30, 10, 40], "nodes below the set count as well");
        assert!(sets.n_kept() < 150, "{}", sets.n_kept());
        let text = format!(
            "{NODES}*ELEMENT, TYPE=C3D4\n7, 10,20,30,40\n*ELSET, ELSET=E, GENERATE\n{lines}*NSET, NSET=A, ELSET=E\n"
        );
        assert_eq!(members(&sets_of("nodes.inp", text), "A"), [10, 20, 30, 40]);
    }

    #[test]
    fn components_of_ansys_keep_their_ranges() {
        let nodes: String =
            (1..=500).map(|id| format!("{id:9}{:9}{:9}{:21.13E}\n", 0, 0, f64::from(id))).collect();
        let head = "NBLOCK,6,SOLID,500,500\n(3i9,6e21.13e3)\n";
        let components: String =
            (0..500).map(|k| format!("CMBLOCK,C{k},NODE,3\n(8i10)\n{:10}{:10}{:10}\n", 7, 1, -499)).collect();
        let sets = sets_of("nodes.cdb", format!("/PREP7\n{head}{nodes}N,R5.3,LOC,-1,\n{components}"));
        let expected: Vec<i64> = [7, 1].into_iter().chain((2..=499).filter(|id| *id != 7)).collect();
        assert_eq!(members(&sets, "C499"), expected);
        assert!(sets.n_kept() < 500 * 10, "{}", sets.n_kept());
    }

    /// An entity that belongs to many groups: its nodes are kept once.
    #[test]
    fn groups_of_gmsh_share_the_nodes_of_their_entities() {
        let groups: String = (1..=300).map(|group| format!(" {group}")).collect();
        let elements: String = (1..=1000).map(|element| format!("{element} 40 20 30 10\n")).collect();
        let text = format!(
            "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 7 \"seven\"\n$EndPhysicalNames\n$Entities\n0 0 0 1\n1 0 0 0 1 1 1 300{groups} 0\n$EndEntities\n\
            $Nodes\n1 4 10 40\n3 1 0 4\n10\n20\n30\n40\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n\
            $Elements\n1 1000 1 1000\n3 1 4 1000\n{elements}$EndElements\n"
        );
        let sets = sets_of("mesh.msh", text);
        assert_eq!(members(&sets, "seven"), [10, 20, 30, 40]);
        assert_eq!(members(&sets, "300"), [10, 20, 30, 40]);
        assert!(sets.n_kept() < 500, "{}", sets.n_kept());
    }

    /// Marks of points take a bit each, and arrays that lie at one place of the file are refused.
    #[test]
    fn marked_points_of_vtk_take_a_bit() {
        let count = 6400;
        let of = |sets: usize, place: fn(usize) -> usize| {
            let data = [&(24 * count as u32).to_le_bytes()[..], &vec![0; 24 * count]].concat();
            let marks = [&(count as u32).to_le_bytes()[..], &vec![1; count]].concat();
            let array = |k: usize| {
                let offset = data.len() + place(k) * marks.len();
                format!("<DataArray type=\"Int8\" Name=\"s{k}\" format=\"appended\" offset=\"{offset}\"/>")
            };
            let head = format!(
                "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\"><UnstructuredGrid><Piece NumberOfPoints=\"{count}\"><Points>\
                <DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/></Points><PointData>{}</PointData>\
                </Piece></UnstructuredGrid><AppendedData encoding=\"raw\">_",
                (0..sets).map(array).collect::<String>()
            );
            [head.as_bytes(), &data, &marks.repeat(3), b"</AppendedData></VTKFile>"].concat()
        };
        let sets = sets_of("nodes.vtu", of(3, |k| k));
        assert_eq!(members(&sets, "s2").len(), count);
        assert!(sets.n_kept() <= 3 * (1 + count / 64), "{}", sets.n_kept());
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("nodes.vtu");
        std::fs::write(&path, of(200, |_| 0)).expect("written");
        let refused = read_node_file(&InputFile::open(&path).expect("a file"), 3).expect_err("refused");
        assert!(
            refused[0].message().contains("`s3` lies where other arrays lie"),
            "{}",
            refused[0].message()
        );
    }

    /// A chain of sets takes neither a stack nor the square of its length.
    #[test]
    fn long_chains_of_sets_are_walked_once() {
        let mut list = SetList::default();
        list.add("S0", vec![range(1, 3, 1)]);
        for k in 1..200_000 {
            let before = list.so_far(&format!("S{}", k - 1)).expect("a set");
            list.add(&format!("S{k}"), vec![own(Members::Set(before)), own(Members::Set(before))]);
        }
        let sets = NodeSets::of_nodes(&[1, 2, 3, 4], list);
        assert_eq!(members(&sets, "S199999"), [1, 2, 3]);
    }

    /// Returns the members of a set as they were listed: all numbers of all parts, then each once.
    fn listed(list: &SetList, ids: &[i64], SoFar { set, items }: SoFar) -> Vec<i64> {
        let mut all = Vec::new();
        for item in &list.all[set].items[..items] {
            match &item.members {
                Members::Numbers(numbers) => all.extend(numbers),
                Members::Range { first, last, step } => {
                    all.extend((*first..=*last).step_by(*step as usize).filter(|id| ids.contains(id)));
                }
                Members::Set(other) => all.extend(listed(list, ids, *other)),
                other => panic!("{other:?} is not used here"),
            }
        }
        let mut seen = HashSet::new();
        all.retain(|id| seen.insert(*id));
        all
    }

    proptest::proptest! {
        /// Members are those of the parts, in their order, however parts overlap.
        #[test]
        fn members_are_those_that_would_be_listed(
            ids in proptest::collection::btree_set(-20i64..60, 1..40),
            parts in proptest::collection::vec((0usize..4, -20i64..60, 0i64..40, 1i64..6, 0usize..3), 1..25),
        ) {
            let ids: Vec<i64> = ids.into_iter().collect();
            let mut list = SetList::default();
            for (set, first, length, step, kind) in parts {
                let other = list.so_far(&format!("S{}", length % 4));
                let item = match (kind, other) {
                    (0, _) => own(Members::Numbers(vec![first, first + step])),
                    (1, Some(other)) => own(Members::Set(other)),
                    _ => range(first, first + length, step),
                };
                list.extend(&format!("S{set}"), Ok(vec![item]));
            }
            let expected: Vec<Vec<i64>> =
                (0..list.all.len()).map(|set| listed(&list, &ids, list.all_of(set))).collect();
            let names: Vec<String> = list.names().map(str::to_owned).collect();
            let sets = NodeSets::of_nodes(&ids, list);
            for (name, expected) in names.iter().zip(expected) {
                proptest::prop_assert_eq!(members(&sets, name), expected);
            }
        }
    }
}
