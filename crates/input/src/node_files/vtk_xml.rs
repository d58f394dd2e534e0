//! Meshes of VTK in XML (.vtu, .vtp, .vts): points, arrays of zeros and ones at the points as sets, and the cells of
//! unstructured grids.
//! <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>

use super::errors::refused;
use super::point_data::{DIGITS_OF_TEXT, PointArray, PointData, exact_ids};
use super::vtk_packing::{Base64, Packing, Unpacked};
use crate::node_file::NodeFile;
use crate::number_type::NumberType;
use crate::sets::{Item, Members, NodeSets, SetList};
use flexbody_base::diagnostic::Diagnosed;
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{number, words};
use flexbody_model::{ElementShape, Elements, Nodes};
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};
use std::cell::Cell;
use std::collections::HashSet;
use std::sync::Arc;

const HELP: &str = "write one mesh of points and cells (.vtu) in double precision, as it is or compressed by zlib, or give a table of nodes";

/// Returns true when the text is an XML file of VTK.
pub(super) fn recognises(head: &str) -> bool {
    head.trim_start().starts_with('<') && head.contains("<VTKFile")
}

/// Reads the points. They are numbered from 0, as in ParaView, or by the array that the file declares as global ids.
pub(super) fn read(file: &InputFile) -> Diagnosed<NodeFile> {
    points_and_sets(file.bytes()).map_err(|message| refused(file, message, HELP))
}

fn points_and_sets(bytes: &[u8]) -> Unpacked<NodeFile> {
    let mesh = Mesh::of(elements(bytes, "AppendedData")?)?;
    let positions = mesh.places()?;
    let ids = match mesh.global_ids() {
        Some(name) => mesh.numbered_by(name)?,
        None => (0..positions.len() as i64).collect(),
    };
    let sets = NodeSets::of_nodes(&ids, mesh.sets()?);
    let elements = mesh.cells(&ids)?;
    Ok(NodeFile { nodes: Nodes { ids, positions }, sets, elements, ..NodeFile::default() })
}

/// Returns the numbers of the points (the global ids, or the array `node`; `None` without either) and the arrays of real
/// numbers at the points of a mesh.
///
/// # Errors
/// A description of the problem.
pub(crate) fn point_arrays(bytes: &[u8]) -> Unpacked<PointData> {
    let mesh = Mesh::of(elements(bytes, "AppendedData")?)?;
    let named_node = || mesh.lists().find_map(|array| array.attribute("Name").filter(|name| *name == "node"));
    let ids = mesh.global_ids().or_else(named_node).map(|name| mesh.numbered_by(name)).transpose()?;
    let mut arrays = Vec::new();
    for array in mesh.arrays("PointData").filter(|array| !is_list_of_whole_numbers(array)) {
        let name = array.attribute("Name").unwrap_or_default().to_owned();
        let components = array.number("NumberOfComponents").unwrap_or(1);
        let values = mesh.numbers(array, mesh.points.saturating_mul(components))?;
        if mesh.points.checked_mul(components) != Some(values.len() as u64) {
            let (found, points) = (values.len(), mesh.points);
            return Err(format!("array `{name}` has {found} values for {points} points of {components}"));
        }
        let is_single =
            array.attribute("type").and_then(NumberType::named).is_some_and(|kind| kind.bytes() < 8);
        let digits = match array.attribute("format") {
            Some("ascii") => DIGITS_OF_TEXT,
            _ if is_single => 7,
            _ => 15,
        };
        arrays.push(PointArray { name, components: components as usize, values, digits });
    }
    let is_ghost = |array: &&Element<'_>| {
        array.attribute("Name").is_some_and(|name| ["vtkGhostType", "vtkGhostLevels"].contains(&name))
    };
    let levels = mesh.lists().find(is_ghost).map(|array| mesh.list(array)).transpose()?;
    let ghosts = levels.map_or(Vec::new(), |levels| levels.iter().map(|level| *level != 0.0).collect());
    Ok(PointData { ids, arrays, ghosts })
}

/// Returns the files of the pieces of a parallel file (.pvtu), in their order; `None` for another file.
///
/// # Errors
/// A clause about a piece without a file, or a file without pieces.
pub(crate) fn pieces(bytes: &[u8]) -> Unpacked<Option<Vec<String>>> {
    let elements = elements(bytes, "AppendedData")?;
    if elements.first().and_then(|head| head.attribute("type")) != Some("PUnstructuredGrid") {
        return Ok(None);
    }
    let pieces = elements.iter().filter(|element| &*element.name == "Piece");
    let source = |(at, piece): (usize, &Element<'_>)| {
        let source = piece.attribute("Source").filter(|source| !source.is_empty());
        source.map(str::to_owned).ok_or_else(|| format!("piece {} names no file (`Source`)", at + 1))
    };
    let found = pieces.enumerate().map(source).collect::<Unpacked<Vec<String>>>()?;
    if found.is_empty() { Err("file has no pieces".to_owned()) } else { Ok(Some(found)) }
}

/// File of a collection.
pub(crate) struct CollectionMember {
    /// Instant at which its values hold.
    pub time: f64,
    /// Path relative to the folder of the collection.
    pub file: String,
}

/// Returns the files of a collection (.pvd) by ascending time; `None` for a file that is no collection.
///
/// # Errors
/// A description of the problem.
pub(crate) fn collection(bytes: &[u8]) -> Unpacked<Option<Vec<CollectionMember>>> {
    let elements = elements(bytes, "AppendedData")?;
    if elements.first().and_then(|head| head.attribute("type")) != Some("Collection") {
        return Ok(None);
    }
    let mut members = Vec::new();
    for element in elements.iter().filter(|element| &*element.name == "DataSet") {
        let time = element.attribute("timestep").and_then(|time| number(time.trim().as_bytes()));
        let time = time.filter(|time| time.is_finite());
        let file = element.attribute("file").filter(|file| !file.is_empty());
        let (Some(time), Some(file)) = (time, file) else {
            return Err(format!("data set {} has no time or no file", members.len() + 1));
        };
        members.push(CollectionMember { time, file: file.to_owned() });
    }
    members.sort_by(|one, other| one.time.total_cmp(&other.time));
    if let Some(pair) = members.windows(2).find(|pair| pair[0].time == pair[1].time) {
        return Err(format!("time {} has several files, expected one mesh in one piece", pair[0].time));
    }
    let mut files = HashSet::new();
    match members.iter().find(|member| !files.insert(&member.file)) {
        Some(member) => Err(format!("{} is the file of several times, expected one of each", member.file)),
        None => Ok(Some(members)),
    }
}

fn is_list_of_whole_numbers(array: &Element<'_>) -> bool {
    let kind = array.attribute("type").and_then(NumberType::named);
    kind.is_some_and(NumberType::is_whole)
        && array.attribute("NumberOfComponents").is_none_or(|components| components.trim() == "1")
}

/// File with one piece of mesh.
struct Mesh<'a> {
    elements: Vec<Element<'a>>,
    packing: Packing,
    /// Number of points.
    points: u64,
    /// Number of cells, if the piece states it.
    cells: Option<u64>,
    /// Number of bytes of the appended data that were read.
    appended: Cell<usize>,
}

impl<'a> Mesh<'a> {
    fn of(elements: Vec<Element<'a>>) -> Unpacked<Self> {
        let outermost = elements.first().filter(|element| &*element.name == "VTKFile");
        let head = outermost.ok_or("file does not begin with VTKFile")?;
        let kind = head.attribute("type").unwrap_or_default();
        if !["UnstructuredGrid", "PolyData", "StructuredGrid"].contains(&kind) {
            return Err(format!("file holds `{kind}`, which has no list of points"));
        }
        let zlib = match head.attribute("compressor") {
            None | Some("") => false,
            Some("vtkZLibDataCompressor") => true,
            Some(other) => return Err(format!("file is compressed by `{other}`, which is not read")),
        };
        let header_bytes = match head.attribute("header_type") {
            None | Some("UInt32") => 4,
            Some("UInt64") => 8,
            Some(other) => return Err(format!("lengths have the type `{other}`, expected UInt32 or UInt64")),
        };
        let packing =
            Packing { big_endian: head.attribute("byte_order") == Some("BigEndian"), header_bytes, zlib };
        let pieces: Vec<&Element<'_>> = elements.iter().filter(|element| &*element.name == "Piece").collect();
        let [piece] = pieces.as_slice() else {
            return Err(format!("file has {} pieces, expected one", pieces.len()));
        };
        let points = piece.number("NumberOfPoints").or_else(|| extent(piece));
        let points = points.ok_or("the piece does not state its number of points")?;
        let cells = piece.number("NumberOfCells");
        Ok(Self { elements, packing, points, cells, appended: Cell::new(0) })
    }

    /// Returns the coordinates of the points.
    fn places(&self) -> Unpacked<Vec<[f64; 3]>> {
        let array = self.arrays("Points").next().ok_or("file has no array of points")?;
        let numbers = self.numbers(array, self.points.saturating_mul(3))?;
        let (count, found) = (self.points, numbers.len());
        if array.number("NumberOfComponents") != Some(3) || count.checked_mul(3) != Some(found as u64) {
            return Err(format!("file states {count} points, but has {found} coordinates"));
        }
        Ok(numbers.chunks_exact(3).map(|x| [x[0], x[1], x[2]]).collect())
    }

    /// Returns the name of the array that numbers the points, if the file declares one.
    fn global_ids(&self) -> Option<&str> {
        let data = self.elements.iter().find(|element| &*element.name == "PointData")?;
        data.attribute("GlobalIds").filter(|name| !name.is_empty())
    }

    fn numbered_by(&self, name: &str) -> Unpacked<Vec<i64>> {
        let array = self.lists().find(|array| array.attribute("Name") == Some(name));
        let array =
            array.ok_or_else(|| format!("the global ids `{name}` are not a list of whole numbers"))?;
        exact_ids(name, &self.list(array)?)
    }

    /// Returns the sets: lists of zeros and ones, which mark their points. A set takes a bit for each point until it is
    /// requested.
    fn sets(&self) -> Unpacked<SetList> {
        let mut sets = SetList::default();
        let global_ids = self.global_ids();
        for array in self.lists().filter(|array| array.attribute("Name") != global_ids) {
            let marks = self.list(array)?;
            if marks.iter().all(|mark| [0.0, 1.0].contains(mark)) {
                let bits = |marks: &[f64]| marks.iter().rev().fold(0, |bits, mark| bits << 1 | *mark as u64);
                let marked: Arc<[u64]> = marks.chunks(64).map(bits).collect();
                let name = array.attribute("Name").unwrap_or_default();
                sets.add(name, vec![Item::own(Members::Marked(marked))]);
            }
        }
        Ok(sets)
    }

    /// Returns the cells of an unstructured grid. Other meshes store cells under other names, and are not drawn.
    fn cells(&self, ids: &[i64]) -> Unpacked<Elements> {
        let array = |name: &str| self.arrays("Cells").find(|array| array.attribute("Name") == Some(name));
        let all = [array("connectivity"), array("offsets"), array("types")];
        let [Some(connectivity), Some(offsets), Some(types)] = all else { return Ok(Elements::default()) };
        let Some(cells) = self.cells else { return Ok(Elements::default()) };
        let [offsets, types] = [self.numbers(offsets, cells)?, self.numbers(types, cells)?];
        let points = offsets.last().map_or(0, |last| *last as u64);
        elements_of(&self.numbers(connectivity, points)?, &offsets, &types, ids)
    }

    /// Returns the arrays at the points with one integer per point.
    fn lists(&self) -> impl Iterator<Item = &Element<'a>> {
        self.arrays("PointData").filter(|array| is_list_of_whole_numbers(array))
    }

    fn list(&self, array: &Element<'_>) -> Unpacked<Vec<f64>> {
        let values = self.numbers(array, self.points)?;
        if values.len() as u64 == self.points {
            return Ok(values);
        }
        let name = array.attribute("Name").unwrap_or_default();
        Err(format!("array `{name}` has {} values for {} points", values.len(), self.points))
    }

    /// Returns the arrays within the elements named `parent`.
    fn arrays(&self, parent: &'static str) -> impl Iterator<Item = &Element<'a>> {
        self.elements
            .iter()
            .filter(move |element| &*element.name == "DataArray" && &*element.parent == parent)
    }

    /// Returns the numbers of an array. A compressed array may have at most `most` of them.
    fn numbers(&self, array: &Element<'_>, most: u64) -> Unpacked<Vec<f64>> {
        let name = array.attribute("Name").unwrap_or("Points");
        let within = |what: String| format!("array `{name}` {what}");
        let kind = array.attribute("type").unwrap_or_default();
        let kind = NumberType::named(kind).ok_or_else(|| within(format!("has numbers of type `{kind}`")))?;
        let most = most.saturating_mul(kind.bytes() as u64);
        let bytes = match array.attribute("format") {
            Some("ascii") => return ascii(array.content).map_err(within),
            Some("binary") => self.packing.unpack(Base64::new(array.content), most),
            Some("appended") => self.appended(array, most),
            other => Err(format!("has the format `{}`, which is not read", other.unwrap_or_default())),
        };
        let bytes = bytes.map_err(within)?;
        if bytes.len() % kind.bytes() != 0 {
            return Err(within(format!("has {} bytes, which is not a whole number of values", bytes.len())));
        }
        Ok(kind.decode(&bytes, self.packing.big_endian))
    }

    /// Returns the bytes of an appended array. Arrays do not overlap: all together have no more bytes than the file.
    fn appended(&self, array: &Element<'_>, most: u64) -> Unpacked<Vec<u8>> {
        // No element follows the appended data.
        let data = self.elements.last().filter(|element| &*element.name == "AppendedData");
        let data = data.ok_or("is appended, but the file has no appended data")?;
        // The data begin after an underscore.
        let content = data.content.trim_ascii_start().strip_prefix(b"_").unwrap_or_default();
        let offset = array.number("offset").and_then(|offset| usize::try_from(offset).ok());
        let encoded = offset.and_then(|offset| content.get(offset..));
        let encoded = encoded.ok_or("begins behind the end of the file: it may be cut off")?;
        let (bytes, unread) = match data.attribute("encoding") {
            Some("raw") => {
                let mut stream = encoded;
                (self.packing.unpack(&mut stream, most)?, stream.len())
            }
            Some("base64") | None => {
                let mut stream = Base64::new(encoded);
                (self.packing.unpack(&mut stream, most)?, stream.n_unread())
            }
            Some(other) => return Err(format!("is encoded by `{other}`, which is not read")),
        };
        let read = self.appended.get() + (encoded.len() - unread);
        self.appended.set(read);
        if read > content.len() {
            return Err(format!(
                "lies where other arrays lie: they have {read} bytes together, the appended data have {}",
                content.len()
            ));
        }
        Ok(bytes)
    }
}

/// Returns the number of points of a structured mesh.
fn extent(piece: &Element<'_>) -> Option<u64> {
    let numbers = piece.attribute("Extent")?.split_whitespace().map(str::parse::<i64>);
    let numbers: Vec<i64> = numbers.collect::<Result<_, _>>().ok()?;
    let count = |pair: &[i64]| u64::try_from(pair[1].checked_sub(pair[0])?.checked_add(1)?).ok();
    numbers.chunks_exact(2).try_fold(1u64, |product, pair| product.checked_mul(count(pair)?))
}

fn ascii(text: &[u8]) -> Unpacked<Vec<f64>> {
    words(text)
        .map(|word| number(word).ok_or_else(|| format!("has `{}` for a number", word.escape_ascii())))
        .collect()
}

/// Order of the corners of pixels and voxels, which VTK lists along the axes, around the quadrilaterals.
const AROUND: [usize; 8] = [0, 1, 3, 2, 4, 5, 7, 6];

/// Order of the nodes of a wedge from its other end: the first triangle of VTK faces outward, that of the shape inward.
const TURNED_WEDGE: [usize; 15] = [0, 2, 1, 3, 5, 4, 8, 7, 6, 11, 10, 9, 12, 14, 13];

/// Returns the elements of cells, with points whose numbers are `ids`.
///
/// * `connectivity`: points of all cells, from 0; `offsets`: end of each cell in `connectivity`; `types`: cell types of
///   VTK.
fn elements_of(connectivity: &[f64], offsets: &[f64], types: &[f64], ids: &[i64]) -> Unpacked<Elements> {
    if offsets.len() != types.len() {
        return Err(format!("file has {} ends of cells and {} types", offsets.len(), types.len()));
    }
    let id =
        |point: &f64| ids.get(*point as usize).filter(|_| *point >= 0.0 && point.fract() == 0.0).copied();
    let mut elements = Elements::default();
    let mut start = 0;
    for (&end, &kind) in offsets.iter().zip(types) {
        let points = connectivity.get(start..end as usize);
        let points = points.ok_or("the ends of the cells do not ascend up to the number of their points")?;
        start += points.len();
        let nodes: Option<Vec<i64>> = points.iter().map(id).collect();
        let nodes = nodes.ok_or("a cell has a point that does not exist")?;
        add(&mut elements, kind as u8, nodes);
    }
    Ok(elements)
}

fn add(elements: &mut Elements, kind: u8, nodes: Vec<i64>) {
    let ordered = |order: &[usize]| order.iter().filter_map(|&k| nodes.get(k).copied()).collect::<Vec<_>>();
    let (shape, nodes) = match kind {
        // Vertices are not drawn.
        1 | 2 => return,
        3 | 21 => (ElementShape::Line, nodes),
        5 | 22 | 34 => (ElementShape::Triangle, nodes),
        8 => (ElementShape::Quadrilateral, ordered(&AROUND[..4])),
        9 | 23 | 28 => (ElementShape::Quadrilateral, nodes),
        10 | 24 => (ElementShape::Tetrahedron, nodes),
        11 => (ElementShape::Hexahedron, ordered(&AROUND)),
        12 | 25 | 29 => (ElementShape::Hexahedron, nodes),
        13 | 26 | 32 => (ElementShape::Wedge, ordered(&TURNED_WEDGE)),
        14 | 27 => (ElementShape::Pyramid, nodes),
        other => return elements.leave_out(&format!("cells of type {other}"), 1),
    };
    elements.add("cells", shape, &nodes);
}

// The elements of an XML file in their order, each with its attributes and the bytes between its tags.

/// Element of an XML file.
struct Element<'a> {
    pub name: Arc<str>,
    /// Name of the enclosing element; empty for the outermost.
    pub parent: Arc<str>,
    attributes: Vec<(String, String)>,
    /// Bytes between its tag and the next one.
    pub content: &'a [u8],
}

impl Element<'_> {
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    /// Returns an attribute as a whole number.
    pub(super) fn number(&self, name: &str) -> Option<u64> {
        self.attribute(name)?.trim().parse().ok()
    }
}

/// Reads the elements up to the end, or up to an element named `last`, whose content is the rest of the file.
///
/// # Errors
/// A description of the problem, if the text is not XML.
fn elements<'a>(bytes: &'a [u8], last: &str) -> Result<Vec<Element<'a>>, String> {
    let mut reader = Reader::from_reader(bytes);
    let mut elements: Vec<Element<'a>> = Vec::new();
    // Indices of the elements that enclose the next one.
    let mut open: Vec<usize> = Vec::new();
    loop {
        let event = reader.read_event().map_err(|error| format!("file is not XML: {error}"))?;
        let begins = matches!(event, Event::Start(_));
        match event {
            Event::Start(tag) | Event::Empty(tag) => {
                let parent =
                    open.last().map_or_else(Arc::default, |outer| Arc::clone(&elements[*outer].name));
                elements.push(element(&tag, parent)?);
            }
            Event::End(_) => {
                open.pop();
            }
            Event::Eof if open.is_empty() => return Ok(elements),
            Event::Eof => return Err("file ends within an element: it may be cut off".to_owned()),
            _ => {}
        }
        if let (true, Some(element)) = (begins, elements.last_mut()) {
            let begin = usize::try_from(reader.buffer_position()).unwrap_or(bytes.len());
            let rest = bytes.get(begin..).unwrap_or_default();
            if &*element.name == last {
                element.content = rest;
                return Ok(elements);
            }
            element.content = &rest[..memchr::memchr(b'<', rest).unwrap_or(rest.len())];
            open.push(elements.len() - 1);
        }
    }
}

fn element<'a>(tag: &BytesStart<'_>, parent: Arc<str>) -> Result<Element<'a>, String> {
    let (mut attributes, mut names) = (Vec::new(), HashSet::new());
    // The check of the reader compares every name with all others.
    for attribute in tag.attributes().with_checks(false) {
        let attribute = attribute.map_err(|error| format!("file is not XML: {error}"))?;
        let value = attribute.normalized_value(XmlVersion::default());
        let value = value.map_err(|error| format!("file is not XML: {error}"))?;
        let name: &str = attribute.key.as_ref();
        if !names.insert(name.to_owned()) {
            return Err(format!("file is not XML: attribute `{name}` is given twice"));
        }
        attributes.push((name.to_owned(), value.into_owned()));
    }
    Ok(Element { name: Arc::from(tag.name().as_ref() as &str), parent, attributes, content: &[] })
}
