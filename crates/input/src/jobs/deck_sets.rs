//! Nodes, elements and node sets of a keyword deck, by the scope that defines them, and node sets of instances by the
//! names of the assembly (`INSTANCE.SET`, `INSTANCE.12`).

use super::deck::{Card, Deck, comparable, fields};
use super::deck_mesh::DeckMesh;
use super::{NodeSets, Unresolved};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::scanner::integer;
use std::collections::{BTreeMap, BTreeSet, HashMap};

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

/// Nodes of the faces S1 to S6 of a hexahedron, numbered from 1 in the order of C3D20; C3D8 has the first 8 nodes.
const HEXAHEDRON: &[&[usize]] = &[
    &[1, 2, 3, 4, 9, 10, 11, 12],
    &[5, 6, 7, 8, 13, 14, 15, 16],
    &[1, 2, 6, 5, 9, 18, 13, 17],
    &[2, 3, 7, 6, 10, 19, 14, 18],
    &[3, 4, 8, 7, 11, 20, 15, 19],
    &[4, 1, 5, 8, 12, 17, 16, 20],
];

/// Nodes of the faces S1 to S4 of a tetrahedron, numbered from 1 in the order of C3D10; C3D4 has the first 4 nodes.
const TETRAHEDRON: &[&[usize]] =
    &[&[1, 2, 3, 5, 6, 7], &[1, 2, 4, 5, 9, 8], &[2, 3, 4, 6, 10, 9], &[1, 4, 3, 8, 10, 7]];

/// Nodes of the faces S1 to S5 of a wedge, numbered from 1 in the order of C3D15; C3D6 has the first 6 nodes.
const WEDGE: &[&[usize]] = &[
    &[1, 2, 3, 7, 8, 9],
    &[4, 5, 6, 10, 11, 12],
    &[1, 2, 5, 4, 7, 14, 10, 13],
    &[2, 3, 6, 5, 8, 15, 11, 14],
    &[3, 1, 4, 6, 9, 13, 12, 15],
];

/// Returns the nodes of the surface `name` (in upper case), given by nodes or by faces of solid elements. A surface of
/// nodes takes precedence over one of faces with the same name. Returns `None` if there is no such surface, or if it
/// has sets that the deck does not define or faces of other elements.
pub(super) fn nodes_of_surface(deck: &Deck, mesh: &DeckMesh, name: &str) -> Option<BTreeSet<i64>> {
    let is_wanted = |card: &&Card| card.keyword == "SURFACE" && card.name("NAME").as_deref() == Some(name);
    let is_of_nodes = |card: &Card| card.name("TYPE").as_deref() == Some("NODE");
    let cards: Vec<&Card> = deck.cards().iter().filter(is_wanted).collect();
    let by_nodes = cards.iter().any(|card| is_of_nodes(card));
    let elements = if by_nodes { HashMap::new() } else { solids(mesh) };
    let mut nodes = BTreeSet::new();
    for card in cards.iter().filter(|card| is_of_nodes(card) == by_nodes) {
        for (_, line) in deck.data(card) {
            if by_nodes {
                nodes.extend(nodes_of_line(line, mesh)?);
            } else {
                nodes.extend(nodes_of_faces(line, mesh, &elements)?);
            }
        }
    }
    (!cards.is_empty()).then_some(nodes)
}

/// Returns the nodes that a line names by a number or a node set.
fn nodes_of_line(line: &[u8], mesh: &DeckMesh) -> Option<Vec<i64>> {
    let field = fields(line).next()?;
    let set = String::from_utf8_lossy(field);
    let members = || mesh.set(&set).map(<[i64]>::to_vec);
    integer(field).map(|node| vec![node]).or_else(members)
}

/// Returns the nodes of the faces that a line names by an element or an element set, and S1 to S6.
fn nodes_of_faces(line: &[u8], mesh: &DeckMesh, elements: &HashMap<i64, Solid<'_>>) -> Option<Vec<i64>> {
    let mut given = fields(line);
    let (field, face) = (given.next()?, given.next()?.to_ascii_uppercase());
    let face = usize::try_from(integer(face.strip_prefix(b"S")?)?).ok()?.checked_sub(1)?;
    let set = || mesh.element_sets.get(&comparable(&String::from_utf8_lossy(field))).cloned();
    let members = integer(field).map(|element| vec![element]).or_else(set)?;
    let mut nodes = Vec::new();
    for element in members {
        let solid = elements.get(&element)?;
        nodes.extend(solid.faces.get(face)?.iter().filter_map(|k| solid.nodes.get(k - 1)));
    }
    Some(nodes)
}

/// A solid element.
struct Solid<'m> {
    faces: &'static [&'static [usize]],
    nodes: &'m [i64],
}

/// Returns every solid element by its number.
fn solids(mesh: &DeckMesh) -> HashMap<i64, Solid<'_>> {
    let members = mesh
        .elements
        .iter()
        .filter(|element| element.kind.starts_with("C3D"))
        .flat_map(|element| &element.members);
    let solid = |(id, nodes): &'_ (i64, Vec<i64>)| {
        let faces = match nodes.len() {
            4 | 10 => TETRAHEDRON,
            6 | 15 => WEDGE,
            8 | 20 => HEXAHEDRON,
            _ => return None,
        };
        Some((*id, faces))
    };
    members
        .filter_map(|element| solid(element).map(|(id, faces)| (id, Solid { faces, nodes: &element.1 })))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// A surface of nodes has each member of its sets once, a surface of faces the nodes of the faces, mid-side nodes
    /// included. A surface that cannot be resolved is none.
    #[test]
    fn surfaces_are_sets_of_nodes() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("job.inp");
        let text = "*ELEMENT, TYPE=C3D8, ELSET=Bricks\n1, 1,2,3,4,5,6,7,8\n2, 5,6,7,8,9,10,11,12\n\
            *ELEMENT, TYPE=C3D10\n3, 21,22,23,24,25,26,27,28,29,30\n*ELEMENT, TYPE=C3D15\n\
            4, 31,32,33,34,35,36,37,38,39,40,41,42,43,44,45\n*ELEMENT, TYPE=S4\n5, 1,2,3,4\n\
            *NSET, NSET=Some\n3, 1, 2\n*SURFACE, NAME=n, TYPE=NODE\nSOME\n2\n7\n\
            *SURFACE, NAME=F\nBRICKS, S3\n*SURFACE, NAME=T\n3, S2\n*SURFACE, NAME=F\n4, S1\n\
            *SURFACE, NAME=W, TYPE=ELEMENT\n4, S4\n*SURFACE, NAME=SHELL\n5, SPOS\n*SURFACE, NAME=NO\nNONE, S1\n";
        fs::write(&path, text).expect("written");
        let deck = Deck::read(&path).expect("a deck");
        let mesh = DeckMesh::of(&deck).expect("a mesh");
        let nodes =
            |name| nodes_of_surface(&deck, &mesh, name).map(|nodes| nodes.into_iter().collect::<Vec<_>>());
        assert_eq!(nodes("N"), Some(vec![1, 2, 3, 7]));
        assert_eq!(nodes("F"), Some(vec![1, 2, 5, 6, 9, 10, 31, 32, 33, 37, 38, 39]));
        assert_eq!(nodes("T"), Some(vec![21, 22, 24, 25, 28, 29]));
        assert_eq!(nodes("W"), Some(vec![32, 33, 35, 36, 38, 41, 44, 45]));
        for name in ["SHELL", "NO", "ABSENT"] {
            assert_eq!(nodes(name), None, "{name}");
        }
    }
}
