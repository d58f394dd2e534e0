//! Surfaces of a keyword deck as sets of nodes.

use super::deck::{Card, Deck, fields};
use super::deck_mesh::DeckMesh;
use flexbody_base::text::scanner::integer;
use std::cell::OnceCell;
use std::collections::{BTreeSet, HashMap};

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

/// Surfaces of a deck as sets of nodes. Cards and elements are sorted once, and each surface is resolved once.
pub(super) struct Surfaces<'d> {
    deck: &'d Deck,
    mesh: &'d DeckMesh,
    /// Cards of each surface by its name in upper case.
    cards: HashMap<String, Vec<&'d Card>>,
    solids: OnceCell<HashMap<i64, Solid<'d>>>,
    counts: HashMap<String, Option<usize>>,
}

impl<'d> Surfaces<'d> {
    pub(super) fn of(deck: &'d Deck, mesh: &'d DeckMesh) -> Self {
        let mut cards: HashMap<String, Vec<&Card>> = HashMap::new();
        for card in deck.cards().iter().filter(|card| card.keyword == "SURFACE") {
            cards.entry(card.name("NAME").unwrap_or_default()).or_default().push(card);
        }
        Self { deck, mesh, cards, solids: OnceCell::new(), counts: HashMap::new() }
    }

    /// Returns the number of nodes of a surface, as [`Self::nodes`].
    pub(super) fn count(&mut self, name: &str) -> Option<usize> {
        if let Some(count) = self.counts.get(name) {
            return *count;
        }
        let count = self.nodes(name).map(|nodes| nodes.len());
        self.counts.insert(name.to_owned(), count);
        count
    }

    /// Returns the nodes of the surface `name` (in upper case), given by nodes or by faces of solid elements. A surface of
    /// nodes takes precedence over one of faces with the same name. Returns `None` if there is no such surface, or if it
    /// has sets that the deck does not define or faces of other elements.
    pub(super) fn nodes(&self, name: &str) -> Option<BTreeSet<i64>> {
        let is_of_nodes = |card: &Card| card.name("TYPE").as_deref() == Some("NODE");
        let cards = self.cards.get(name)?;
        let by_nodes = cards.iter().any(|card| is_of_nodes(card));
        let cards = cards.iter().filter(|card| is_of_nodes(card) == by_nodes);
        let lines = cards.flat_map(|card| self.deck.data(card)).map(|(_, line)| line);
        // Lines that repeat others add nothing.
        let lines: BTreeSet<&[u8]> = lines.collect();
        let mut nodes = BTreeSet::new();
        for line in lines {
            if by_nodes {
                nodes.extend(nodes_of_line(line, self.mesh)?);
            } else {
                let solids = self.solids.get_or_init(|| solids(self.mesh));
                nodes.extend(nodes_of_faces(line, self.mesh, solids)?);
            }
        }
        Some(nodes)
    }
}

/// Returns the nodes that a line names by a number or a node set.
fn nodes_of_line(line: &[u8], mesh: &DeckMesh) -> Option<Vec<i64>> {
    let field = fields(line).next()?;
    let set = || mesh.set(&String::from_utf8_lossy(field));
    integer(field).map(|node| vec![node]).or_else(set)
}

/// Returns the nodes of the faces that a line names by an element or an element set, and S1 to S6.
fn nodes_of_faces(line: &[u8], mesh: &DeckMesh, elements: &HashMap<i64, Solid<'_>>) -> Option<Vec<i64>> {
    let mut given = fields(line);
    let (field, face) = (given.next()?, given.next()?.to_ascii_uppercase());
    let face = usize::try_from(integer(face.strip_prefix(b"S")?)?).ok()?.checked_sub(1)?;
    let set = || mesh.sets.elements(&String::from_utf8_lossy(field));
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
        .flat_map(|element| element.members.iter());
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
            *SURFACE, NAME=W, TYPE=ELEMENT\n4, S4\n*SURFACE, NAME=SHELL\n5, SPOS\n*SURFACE, NAME=NO\nNONE, S1\n\
            *ELSET, ELSET=Range, GENERATE\n1, 2\n*SURFACE, NAME=G\nRange, S3\n";
        fs::write(&path, text).expect("written");
        let deck = Deck::read(&path).expect("a deck");
        let mesh = DeckMesh::of(&deck).expect("a mesh");
        let surfaces = Surfaces::of(&deck, &mesh);
        let nodes = |name| surfaces.nodes(name).map(|nodes| nodes.into_iter().collect::<Vec<_>>());
        assert_eq!(nodes("N"), Some(vec![1, 2, 3, 7]));
        assert_eq!(nodes("F"), Some(vec![1, 2, 5, 6, 9, 10, 31, 32, 33, 37, 38, 39]));
        assert_eq!(nodes("G"), Some(vec![1, 2, 5, 6, 9, 10]));
        assert_eq!(nodes("T"), Some(vec![21, 22, 24, 25, 28, 29]));
        assert_eq!(nodes("W"), Some(vec![32, 33, 35, 36, 38, 41, 44, 45]));
        for name in ["SHELL", "NO", "ABSENT"] {
            assert_eq!(nodes(name), None, "{name}");
        }
    }
}
