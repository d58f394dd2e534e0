//! Meshes of Gmsh (.msh, versions 2.2 and 4.1, text): nodes, the nodes of physical groups as sets, and elements.

use super::errors::syntax;
use crate::node_file::NodeFile;
use crate::sets::{Item, Members, NodeSets, SetList, SoFar};
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{Words, integer, number};
use flexbody_model::{ElementShape, Elements};
use std::collections::{BTreeMap, HashMap};

/// Returns true when the text is a mesh of Gmsh.
pub(super) fn recognises(head: &str) -> bool {
    head.trim_start().starts_with("$MeshFormat")
}

/// Dimension and tag of a geometric entity, or of a physical group.
type Tag = (i64, i64);

/// State of reading a mesh.
#[derive(Default)]
struct Mesh {
    read: NodeFile,
    names: HashMap<Tag, String>,
    /// Physical groups of the entities (version 4).
    groups: HashMap<Tag, Vec<i64>>,
    /// Nodes of the elements of each entity (version 4), or of each group (version 2).
    members: BTreeMap<Tag, Vec<i64>>,
    version: i64,
}

/// Reads nodes, groups and elements.
pub(super) fn read(file: &InputFile) -> Diagnosed<NodeFile> {
    let mut words = MeshWords { file, text: Words::of(file.bytes()) };
    let mut mesh = Mesh::default();
    while let Some(section) = words.section() {
        match section.as_str() {
            "$MeshFormat" => mesh.version = format(&mut words)?,
            "$PhysicalNames" => mesh.physical_names(&mut words)?,
            "$Entities" if mesh.version == 4 => mesh.entities(&mut words)?,
            "$Nodes" if mesh.version == 4 => mesh.nodes_4(&mut words)?,
            "$Nodes" => mesh.nodes_2(&mut words)?,
            "$Elements" if mesh.version == 4 => mesh.elements_4(&mut words)?,
            "$Elements" => mesh.elements_2(&mut words)?,
            _ => {}
        }
        words.skip_to_end(&section);
    }
    Ok(mesh.finish())
}

fn format(words: &mut MeshWords<'_>) -> Diagnosed<i64> {
    let (version, binary) = (words.real("a version")?, words.whole("0 for text")?);
    let message = match (version, binary) {
        (v, 0) if (2.0..3.0).contains(&v) => return Ok(2),
        (v, 0) if (4.1..5.0).contains(&v) => return Ok(4),
        (_, 0) => format!("version {version} of the mesh is not read"),
        _ => "the mesh is binary".to_owned(),
    };
    let help = "write it as text: gmsh -save -format msh41 (or msh22), without Mesh.Binary";
    Err(vec![
        Diagnostic::new(Code::NodeFileSyntax, message)
            .in_file(words.file.path())
            .at_line(words.text.line_number())
            .with_help(help),
    ])
}

impl Mesh {
    fn physical_names(&mut self, words: &mut MeshWords<'_>) -> Diagnosed<()> {
        for _ in 0..words.whole("a count")? {
            let (dimension, tag) = (words.whole("a dimension")?, words.whole("a tag")?);
            let name = String::from_utf8_lossy(words.text.line()).into_owned();
            self.names.insert((dimension, tag), name.trim().trim_matches('"').to_owned());
        }
        Ok(())
    }

    fn entities(&mut self, words: &mut MeshWords<'_>) -> Diagnosed<()> {
        let counts: Vec<i64> = (0..4).map(|_| words.whole("a count")).collect::<Diagnosed<_>>()?;
        for (dimension, count) in counts.into_iter().enumerate() {
            for _ in 0..count {
                let tag = words.whole("a tag")?;
                for _ in 0..if dimension == 0 { 3 } else { 6 } {
                    words.real("a bound")?;
                }
                let groups = words.whole("a count")?;
                let groups = (0..groups).map(|_| words.whole("a group")).collect::<Diagnosed<Vec<_>>>()?;
                if dimension > 0 {
                    for _ in 0..words.whole("a count")? {
                        words.whole("a bounding entity")?;
                    }
                }
                self.groups.insert((dimension as i64, tag), groups);
            }
        }
        Ok(())
    }

    fn nodes_2(&mut self, words: &mut MeshWords<'_>) -> Diagnosed<()> {
        for _ in 0..words.whole("a count")? {
            self.read.nodes.ids.push(words.whole("a node")?);
            self.read.nodes.positions.push(words.place()?);
        }
        Ok(())
    }

    fn nodes_4(&mut self, words: &mut MeshWords<'_>) -> Diagnosed<()> {
        let blocks = words.whole("a count")?;
        for _ in 0..3 {
            words.whole("a count")?;
        }
        for _ in 0..blocks {
            let dimension = words.whole("a dimension")?;
            words.whole("an entity")?;
            let parametric = words.whole("0 or 1")?;
            let count = words.whole("a count")?;
            for _ in 0..count {
                self.read.nodes.ids.push(words.whole("a node")?);
            }
            for _ in 0..count {
                self.read.nodes.positions.push(words.place()?);
                for _ in 0..if parametric == 1 { dimension } else { 0 } {
                    words.real("a parameter")?;
                }
            }
        }
        Ok(())
    }

    fn elements_2(&mut self, words: &mut MeshWords<'_>) -> Diagnosed<()> {
        for _ in 0..words.whole("a count")? {
            words.whole("an element")?;
            let kind = words.whole("a type")?;
            let tags =
                (0..words.whole("a count")?).map(|_| words.whole("a tag")).collect::<Diagnosed<Vec<_>>>()?;
            let nodes = words.nodes(kind)?;
            draw(&mut self.read.elements, kind, &nodes);
            if let (Some(&group), Some(dimension)) = (tags.first(), dimension_of(kind)) {
                self.add_members((dimension, group), &nodes);
            }
        }
        Ok(())
    }

    fn elements_4(&mut self, words: &mut MeshWords<'_>) -> Diagnosed<()> {
        let blocks = words.whole("a count")?;
        for _ in 0..3 {
            words.whole("a count")?;
        }
        for _ in 0..blocks {
            let (dimension, entity) = (words.whole("a dimension")?, words.whole("an entity")?);
            let (kind, count) = (words.whole("a type")?, words.whole("a count")?);
            for _ in 0..count {
                words.whole("an element")?;
                let nodes = words.nodes(kind)?;
                draw(&mut self.read.elements, kind, &nodes);
                self.add_members((dimension, entity), &nodes);
            }
        }
        Ok(())
    }

    /// Adds the nodes of an element to an entity or a group. A full list is sorted and keeps each node once before it grows.
    fn add_members(&mut self, tag: Tag, nodes: &[i64]) {
        let members = self.members.entry(tag).or_default();
        if members.len() + nodes.len() > members.capacity() {
            members.sort_unstable();
            members.dedup();
            members.reserve(members.len() + nodes.len());
        }
        members.extend(nodes);
    }

    /// Returns the nodes, sets and elements. Groups without a name are named by their tag. The nodes of an entity are kept
    /// once, however many groups it has.
    fn finish(self) -> NodeFile {
        let Self { mut read, names, groups, members, version } = self;
        let mut sets = SetList::default();
        let mut parts: BTreeMap<Tag, Vec<SoFar>> = BTreeMap::new();
        for ((dimension, tag), nodes) in members {
            let nodes = sets.add_nameless(vec![Item::own(Members::Numbers(nodes))]);
            let own = [tag];
            let of_entity = groups.get(&(dimension, tag)).map_or(&[][..], Vec::as_slice);
            for group in if version == 4 { of_entity } else { &own } {
                parts.entry((dimension, *group)).or_default().push(nodes);
            }
        }
        for (tag, nodes) in parts.into_iter().filter(|((_, tag), _)| *tag != 0) {
            let name = names.get(&tag).cloned().unwrap_or_else(|| tag.1.to_string());
            let items = nodes.into_iter().map(|nodes| Item::own(Members::Set(nodes)));
            sets.add_sorted(&name, items.collect());
        }
        read.sets = NodeSets::of_nodes(&read.nodes.ids, sets);
        read
    }
}

/// Returns the number of nodes of an element type.
fn nodes_of(kind: i64) -> Option<usize> {
    const NODES: [usize; 31] = [
        2, 3, 4, 4, 8, 6, 5, 3, 6, 9, 10, 27, 18, 14, 1, 8, 20, 15, 13, 9, 10, 12, 15, 15, 21, 4, 5, 6, 20,
        35, 56,
    ];
    usize::try_from(kind - 1).ok().and_then(|at| NODES.get(at).copied())
}

/// Returns the dimension of an element type.
fn dimension_of(kind: i64) -> Option<i64> {
    Some(match kind {
        15 => 0,
        1 | 8 | 26..=28 => 1,
        2 | 3 | 9 | 10 | 16 | 20..=25 => 2,
        4..=7 | 11..=14 | 17..=19 | 29..=31 => 3,
        _ => return None,
    })
}

/// Element type of a point.
const POINT: i64 = 15;

/// Adds an element of a type for drawing. Elements of the third order and higher are drawn by their corners only.
fn draw(elements: &mut Elements, kind: i64, nodes: &[i64]) {
    let (shape, middles): (_, &[[usize; 2]]) = match kind {
        POINT => return,
        1 | 26..=28 => (ElementShape::Line, &[]),
        2 | 20..=25 => (ElementShape::Triangle, &[]),
        3 => (ElementShape::Quadrilateral, &[]),
        4 | 29..=31 => (ElementShape::Tetrahedron, &[]),
        5 => (ElementShape::Hexahedron, &[]),
        6 => (ElementShape::Wedge, &[]),
        7 => (ElementShape::Pyramid, &[]),
        8 => (ElementShape::Line, ElementShape::Line.edges()),
        9 => (ElementShape::Triangle, ElementShape::Triangle.edges()),
        10 | 16 => (ElementShape::Quadrilateral, ElementShape::Quadrilateral.edges()),
        11 => (ElementShape::Tetrahedron, &TETRAHEDRON),
        12 | 17 => (ElementShape::Hexahedron, &HEXAHEDRON),
        13 | 18 => (ElementShape::Wedge, &WEDGE),
        14 | 19 => (ElementShape::Pyramid, &PYRAMID),
        _ => return elements.leave_out(&format!("Gmsh type {kind}"), 1),
    };
    let corners = shape.corners();
    let mut ordered: Vec<i64> = nodes.iter().take(corners).copied().collect();
    for &[a, b] in shape.edges() {
        let at = middles.iter().position(|&[c, d]| [c, d] == [a, b] || [d, c] == [a, b]);
        ordered.extend(at.and_then(|at| nodes.get(corners + at)));
    }
    elements.add(&format!("Gmsh type {kind}"), shape, &ordered);
}

/// Edges of a tetrahedron whose mid-edge nodes follow the corners of elements of the second order, in the order of
/// Gmsh, which differs from that of [`ElementShape::edges`].
const TETRAHEDRON: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [2, 3], [1, 3]];
/// Edges of a hexahedron, see [`TETRAHEDRON`].
const HEXAHEDRON: [[usize; 2]; 12] =
    [[0, 1], [0, 3], [0, 4], [1, 2], [1, 5], [2, 3], [2, 6], [3, 7], [4, 5], [4, 7], [5, 6], [6, 7]];
/// Edges of a wedge, see [`TETRAHEDRON`].
const WEDGE: [[usize; 2]; 9] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 4], [2, 5], [3, 4], [3, 5], [4, 5]];
/// Edges of a pyramid, see [`TETRAHEDRON`].
const PYRAMID: [[usize; 2]; 8] = [[0, 1], [0, 3], [0, 4], [1, 2], [1, 4], [2, 3], [2, 4], [3, 4]];

/// Words of a mesh.
struct MeshWords<'a> {
    file: &'a InputFile,
    text: Words<'a>,
}

impl MeshWords<'_> {
    fn wrong<T>(&self, expected: &str, found: Option<&[u8]>) -> Diagnosed<T> {
        let found =
            found.map_or("the end of the file".to_owned(), |word| format!("`{}`", word.escape_ascii()));
        Err(syntax(self.file, self.text.line_number(), format!("expected {expected}, found {found}")))
    }

    fn whole(&mut self, expected: &str) -> Diagnosed<i64> {
        let word = self.text.next();
        match word.and_then(integer) {
            Some(number) => Ok(number),
            None => self.wrong(expected, word),
        }
    }

    fn real(&mut self, expected: &str) -> Diagnosed<f64> {
        let word = self.text.next();
        match word.and_then(number) {
            Some(number) => Ok(number),
            None => self.wrong(expected, word),
        }
    }

    fn place(&mut self) -> Diagnosed<[f64; 3]> {
        Ok([self.real("a coordinate")?, self.real("a coordinate")?, self.real("a coordinate")?])
    }

    fn nodes(&mut self, kind: i64) -> Diagnosed<Vec<i64>> {
        match nodes_of(kind) {
            Some(count) => (0..count).map(|_| self.whole("a node")).collect(),
            None => self.wrong("a known element type", Some(kind.to_string().as_bytes())),
        }
    }

    /// Returns the name of the next section.
    fn section(&mut self) -> Option<String> {
        loop {
            let word = self.text.next()?;
            if word.starts_with(b"$") && !word.starts_with(b"$End") {
                return Some(String::from_utf8_lossy(word).into_owned());
            }
        }
    }

    /// Skips the text up to the end of a section.
    fn skip_to_end(&mut self, section: &str) {
        let end = format!("$End{}", &section[1..]);
        for word in self.text.by_ref() {
            if word == end.as_bytes() {
                return;
            }
        }
    }
}
