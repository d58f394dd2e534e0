//! Meshes of VTK in XML (.vtu, .vtp, .vts): points, arrays of zeros and ones at the points as sets, and the cells of
//! unstructured grids.
//! <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>

use super::vtk_cells::elements_of;
use super::vtk_numbers::{Base64, NumberType, Packing, Unpacked};
use super::xml_elements::{Element, elements};
use super::{Found, NodeFile, refused};
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{number, words};
use flexbody_model::{Elements, Nodes};

const HELP: &str = "write one mesh of points and cells (.vtu) in double precision, as it is or compressed by zlib, or give a table of nodes";

/// Returns true when the text is an XML file of VTK.
pub(super) fn recognises(head: &str) -> bool {
    head.trim_start().starts_with('<') && head.contains("<VTKFile")
}

/// Reads the points. They are numbered from 0, as in ParaView, or by the array that the file declares as global ids.
pub(super) fn read(file: &InputFile) -> Found<NodeFile> {
    points_and_sets(file.bytes()).map_err(|message| refused(file, message, HELP))
}

fn points_and_sets(bytes: &[u8]) -> Unpacked<NodeFile> {
    let mesh = Mesh::of(elements(bytes, "AppendedData")?)?;
    let positions = mesh.places()?;
    let ids = match mesh.global_ids() {
        Some(name) => mesh.numbered_by(name)?,
        None => (0..positions.len() as i64).collect(),
    };
    let sets = mesh.sets(&ids)?;
    let elements = mesh.cells(&ids)?;
    Ok(NodeFile { nodes: Nodes { ids, positions }, sets, elements, ..NodeFile::default() })
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
}

impl<'a> Mesh<'a> {
    fn of(elements: Vec<Element<'a>>) -> Unpacked<Self> {
        let outermost = elements.first().filter(|element| element.name == "VTKFile");
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
        let pieces: Vec<&Element<'_>> = elements.iter().filter(|element| element.name == "Piece").collect();
        let [piece] = pieces.as_slice() else {
            return Err(format!("file has {} pieces, expected one", pieces.len()));
        };
        let points = piece.number("NumberOfPoints").or_else(|| extent(piece));
        let points = points.ok_or("the piece does not state its number of points")?;
        let cells = piece.number("NumberOfCells");
        Ok(Self { elements, packing, points, cells })
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
        let data = self.elements.iter().find(|element| element.name == "PointData")?;
        data.attribute("GlobalIds").filter(|name| !name.is_empty())
    }

    fn numbered_by(&self, name: &str) -> Unpacked<Vec<i64>> {
        let array = self.lists().find(|array| array.attribute("Name") == Some(name));
        let array =
            array.ok_or_else(|| format!("the global ids `{name}` are not a list of whole numbers"))?;
        let ids = self.list(array)?;
        // Larger numbers are not exact in f64.
        match ids.iter().find(|id| id.abs() > 9e15) {
            Some(id) => Err(format!("array `{name}` numbers a point {id}")),
            None => Ok(ids.iter().map(|id| *id as i64).collect()),
        }
    }

    /// Returns the sets: lists of zeros and ones, which mark their points.
    fn sets(&self, ids: &[i64]) -> Unpacked<Vec<(String, Vec<i64>)>> {
        let mut sets = Vec::new();
        for array in self.lists().filter(|array| array.attribute("Name") != self.global_ids()) {
            let marks = self.list(array)?;
            if marks.iter().all(|mark| [0.0, 1.0].contains(mark)) {
                let marked = ids.iter().zip(&marks).filter(|(_, mark)| **mark == 1.0);
                let name = array.attribute("Name").unwrap_or_default();
                sets.push((name.to_owned(), marked.map(|(id, _)| *id).collect()));
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
        self.elements.iter().filter(move |element| element.name == "DataArray" && element.parent == parent)
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

    fn appended(&self, array: &Element<'_>, most: u64) -> Unpacked<Vec<u8>> {
        let data = self.elements.iter().find(|element| element.name == "AppendedData");
        let data = data.ok_or("is appended, but the file has no appended data")?;
        // The data begin after an underscore.
        let content = data.content.trim_ascii_start().strip_prefix(b"_").unwrap_or_default();
        let offset = array.number("offset").and_then(|offset| usize::try_from(offset).ok());
        let encoded = offset.and_then(|offset| content.get(offset..));
        let encoded = encoded.ok_or("begins behind the end of the file: it may be cut off")?;
        match data.attribute("encoding") {
            Some("raw") => self.packing.unpack(encoded, most),
            Some("base64") | None => self.packing.unpack(Base64::new(encoded), most),
            Some(other) => Err(format!("is encoded by `{other}`, which is not read")),
        }
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
