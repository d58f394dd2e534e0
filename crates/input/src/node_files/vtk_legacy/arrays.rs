//! Arrays at the points of a mesh of VTK in its legacy form: fields, scalars, vectors, tensors and global ids.

use super::super::point_data::{DIGITS_OF_TEXT, PointArray, PointData, exact_ids};
use super::super::vtk_packing::Unpacked;
use super::Cursor;
use crate::number_type::NumberType;
use flexbody_base::text::scanner::Words;

/// Returns the numbers of the points (the global ids, or the array `node`; `None` without either) and the arrays of real
/// numbers at the points.
///
/// # Errors
/// The number of a line with a description of the problem.
pub(crate) fn point_arrays(bytes: &[u8]) -> Result<PointData, (usize, String)> {
    let mut cursor = Cursor { text: Words::of(bytes), binary: false };
    let read = cursor.points().map(|places| places.len() / 3).and_then(|points| {
        let mut reading = Reading { cursor: &mut cursor, points, place: Place::Mesh, found: Vec::new() };
        reading.sections()?;
        sorted(reading.found)
    });
    read.map_err(|message| (cursor.text.line_number(), message))
}

/// Place of the values of an array.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    /// Before any values.
    Mesh,
    Points,
    /// Number of cells.
    Cells(usize),
}

/// Array at the points with the type of its numbers.
struct Found {
    array: PointArray,
    kind: NumberType,
    /// True for the global ids.
    is_ids: bool,
}

struct Reading<'c, 'a> {
    cursor: &'c mut Cursor<'a>,
    points: usize,
    place: Place,
    found: Vec<Found>,
}

impl Reading<'_, '_> {
    /// Reads the sections behind the points.
    fn sections(&mut self) -> Unpacked<()> {
        while !self.cursor.text.rest().is_empty() {
            let begin = self.cursor.text.at;
            let words = self.cursor.words();
            let Some((keyword, rest)) = words.split_first() else { continue };
            let rest: Vec<&str> = rest.iter().map(String::as_str).collect();
            let keyword = keyword.to_ascii_uppercase();
            if self.section(&keyword, &rest)?.is_none() {
                self.cursor.text.at = begin;
                let line: String = words.join(" ").chars().take(60).collect();
                return Err(format!("expected a section of a mesh, found `{}`", line.escape_default()));
            }
        }
        Ok(())
    }

    /// Reads a section. Returns `None` if its first line is not one.
    fn section(&mut self, keyword: &str, words: &[&str]) -> Unpacked<Option<()>> {
        match (keyword, words) {
            ("METADATA", _) => {
                while !self.cursor.text.rest().is_empty() && !self.cursor.words().is_empty() {}
            }
            ("CELLS" | "VERTICES" | "LINES" | "POLYGONS" | "TRIANGLE_STRIPS", [count, size]) => {
                self.cells(count, size)?;
            }
            ("CELL_TYPES", [count]) => {
                self.skip(count, "1", "int")?;
            }
            ("POINT_DATA", [count]) => {
                if count.parse() != Ok(self.points) {
                    return Err(format!("file has values of {count} points, the mesh has {}", self.points));
                }
                self.place = Place::Points;
            }
            ("CELL_DATA", [count]) => {
                let cells = count.parse().map_err(|_| "expected a number of cells".to_owned())?;
                self.place = Place::Cells(cells);
            }
            ("FIELD", [_, count]) => self.fields(count)?,
            ("SCALARS", [name, kind]) => self.scalars(name, kind, "1")?,
            ("SCALARS", [name, kind, components]) => self.scalars(name, kind, components)?,
            ("COLOR_SCALARS", [name, components]) => {
                let kind = if self.cursor.binary { "unsigned_char" } else { "float" };
                self.array(name, kind, components)?;
            }
            ("LOOKUP_TABLE", [_, size]) => {
                let kind = if self.cursor.binary { "unsigned_char" } else { "float" };
                self.skip(size, "4", kind)?;
            }
            ("VECTORS" | "NORMALS", [name, kind]) => self.array(name, kind, "3")?,
            ("TENSORS", [name, kind]) => self.array(name, kind, "9")?,
            ("TENSORS6", [name, kind]) => self.array(name, kind, "6")?,
            ("TEXTURE_COORDINATES", [name, components, kind]) => self.array(name, kind, components)?,
            ("PEDIGREE_IDS" | "EDGE_FLAGS", [name, kind]) => self.array(name, kind, "1")?,
            ("GLOBAL_IDS", [name, kind]) => {
                self.array(name, kind, "1")?;
                if let (Place::Points, Some(last)) = (self.place, self.found.last_mut()) {
                    last.is_ids = true;
                }
            }
            _ => return Ok(None),
        }
        Ok(Some(()))
    }

    /// Passes the cells: their sizes and points in one list, or the ends of the cells and their points in two.
    fn cells(&mut self, count: &str, size: &str) -> Unpacked<()> {
        for (what, length) in [("OFFSETS", count), ("CONNECTIVITY", size)] {
            if !self.cursor.text.rest().trim_ascii_start().starts_with(what.as_bytes()) {
                return self.skip(size, "1", "int");
            }
            let words = self.line_with_words();
            let [_, kind] = words.as_slice() else { return Err(format!("expected {what} and their type")) };
            self.skip(length, "1", kind)?;
        }
        Ok(())
    }

    fn scalars(&mut self, name: &str, kind: &str, components: &str) -> Unpacked<()> {
        if self.cursor.text.rest().trim_ascii_start().starts_with(b"LOOKUP_TABLE") {
            self.line_with_words();
        }
        self.array(name, kind, components)
    }

    fn fields(&mut self, count: &str) -> Unpacked<()> {
        let count: u64 = count.parse().map_err(|_| "expected the number of fields".to_owned())?;
        for _ in 0..count {
            let mut words = self.line_with_words();
            // Each array may have metadata, which end with an empty line.
            while words.first().is_some_and(|word| word == "METADATA") {
                while !self.cursor.text.rest().is_empty() && !self.cursor.words().is_empty() {}
                words = self.line_with_words();
            }
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            let [name, components, tuples, kind] = words.as_slice() else {
                return Err("expected name, components, tuples and type of a field".to_owned());
            };
            if self.place != Place::Points {
                self.skip(tuples, components, kind)?;
            } else if tuples.parse() == Ok(self.points) {
                self.array(name, kind, components)?;
            } else {
                return Err(format!("field `{name}` has {tuples} tuples for {} points", self.points));
            }
        }
        Ok(())
    }

    /// Returns the words of the next line that has any.
    fn line_with_words(&mut self) -> Vec<String> {
        loop {
            let words = self.cursor.words();
            if !words.is_empty() || self.cursor.text.rest().is_empty() {
                return words;
            }
        }
    }

    fn skip(&mut self, tuples: &str, components: &str, kind: &str) -> Unpacked<()> {
        let begin = self.cursor.text.at;
        let (count, kind) = self.cursor.announced(tuples, components, kind, begin)?;
        self.cursor.numbers(count, kind).map(drop)
    }

    /// Reads an array with a tuple for each point or cell; keeps that of points.
    fn array(&mut self, name: &str, kind: &str, components: &str) -> Unpacked<()> {
        let tuples = match self.place {
            Place::Points => self.points,
            Place::Cells(count) => count,
            Place::Mesh => return Err(format!("array `{name}` belongs neither to points nor to cells")),
        };
        let begin = self.cursor.text.at;
        let (count, kind) = self.cursor.announced(&tuples.to_string(), components, kind, begin)?;
        let values =
            self.cursor.numbers(count, kind).map_err(|message| format!("array `{name}`: {message}"))?;
        if self.place == Place::Points {
            let digits = match (self.cursor.binary, kind.bytes() < 8) {
                (false, _) => DIGITS_OF_TEXT,
                (true, true) => 7,
                (true, false) => 15,
            };
            let components = components.parse().unwrap_or(1);
            let array = PointArray { name: decoded(name), components, values, digits };
            self.found.push(Found { array, kind, is_ids: false });
        }
        Ok(())
    }
}

/// Returns a name whose blanks and signs were written as `%20`.
fn decoded(name: &str) -> String {
    let mut parts = name.split('%');
    let mut bytes = parts.next().unwrap_or_default().as_bytes().to_vec();
    for part in parts {
        match part.get(..2).and_then(|code| u8::from_str_radix(code, 16).ok()) {
            Some(byte) => {
                bytes.push(byte);
                bytes.extend(&part.as_bytes()[2..]);
            }
            None => bytes.extend([b"%", part.as_bytes()].concat()),
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Returns the numbers of the points and the arrays of real numbers.
fn sorted(found: Vec<Found>) -> Unpacked<PointData> {
    let is_list = |found: &Found| found.kind.is_whole() && found.array.components == 1;
    let lists = || found.iter().filter(|found| is_list(found));
    let ids = lists().find(|found| found.is_ids).or_else(|| lists().find(|found| found.array.name == "node"));
    let ids = ids.map(|found| exact_ids(&found.array.name, &found.array.values)).transpose()?;
    let arrays = found.into_iter().filter(|found| !is_list(found)).map(|found| found.array).collect();
    Ok(PointData { ids, arrays, ghosts: Vec::new() })
}

#[cfg(test)]
mod tests {
    use super::*;

    const MESH: &str = "# vtk DataFile Version 5.1\nmesh\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 2 float\n0 0 0 1 0 0\n\
        METADATA\nINFORMATION 1\nNAME L2_NORM LOCATION vtkDataArray\nDATA 1\n\n\
        CELLS 2 2\nOFFSETS vtktypeint64\n0 2\nCONNECTIVITY vtktypeint64\n0 1\nCELL_TYPES 1\n3\n";

    const VALUES: &str = "CELL_DATA 1\nSCALARS part int\nLOOKUP_TABLE default\n7\nFIELD FieldData 1\nof 1 1 double\n3\n\
        POINT_DATA 2\nSCALARS node int 1\nLOOKUP_TABLE own\n5 6\nLOOKUP_TABLE own 1\n0 0 0 1\n\
        COLOR_SCALARS hue 2\n0 0.5 1 1\nVECTORS displacement%201 double\n1 2 3 4 5 nan\nNORMALS up float\n0 0 1 0 0 1\n\
        TEXTURE_COORDINATES map 2 float\n0 0 1 1\nTENSORS6 stress%20%31 double\n1 2 3 4 5 6\n7 8 9 10 11 12\n\
        FIELD FieldData 2\nplain 1 2 double\n8 9\nMETADATA\nCOMPONENT_NAMES\nX\n\nnode%zz%2 2 2 long\n1 2 3 4\n";

    #[test]
    fn every_kind_of_array_is_read_or_passed() {
        let read =
            point_arrays(format!("{MESH}{VALUES}").as_bytes()).unwrap_or_else(|found| panic!("{found:?}"));
        assert_eq!(read.ids, Some(vec![5, 6]));
        let names: Vec<(&str, usize)> =
            read.arrays.iter().map(|array| (array.name.as_str(), array.components)).collect();
        let expected = [
            ("hue", 2),
            ("displacement 1", 3),
            ("up", 3),
            ("map", 2),
            ("stress 1", 6),
            ("plain", 1),
            ("node%zz%2", 2),
        ];
        assert_eq!(names, expected);
        assert_eq!(read.arrays[4].values, (1..=12).map(f64::from).collect::<Vec<_>>());
        assert!(read.arrays[1].values[5].is_nan() && read.arrays[1].digits == DIGITS_OF_TEXT);
    }

    #[test]
    fn global_ids_precede_an_array_of_nodes() {
        let text = format!(
            "{MESH}POINT_DATA 2\nSCALARS node int\nLOOKUP_TABLE default\n5 6\nGLOBAL_IDS own long\n8 9\n"
        );
        assert_eq!(
            point_arrays(text.as_bytes()).unwrap_or_else(|found| panic!("{found:?}")).ids,
            Some(vec![8, 9])
        );
    }

    #[test]
    fn misfits_are_described_at_their_lines() {
        for (values, line, part) in [
            ("POINT_DATA 3\n", 19, "values of 3 points, the mesh has 2"),
            ("POINT_DATA 2\nHYPERTREES 4\n", 19, "expected a section of a mesh, found `HYPERTREES 4`"),
            ("POINT_DATA 2\nVECTORS u double\n1 2 3 4 5\n", 21, "array `u`: file ends after 5 of 6"),
            ("POINT_DATA 2\nVECTORS u text\n", 20, "found `2 text`"),
            ("POINT_DATA 2\nFIELD f 1\nu 3 1 double\n1 2 3\n", 21, "has 1 tuples for 2 points"),
            ("VECTORS u double\n1 2 3 4 5 6\n", 19, "neither to points nor to cells"),
            ("POINT_DATA 2\nGLOBAL_IDS u double\n1 2\nSCALARS node long\n1 1e17\n", 23, "numbers a point"),
        ] {
            let Err((at, message)) = point_arrays(format!("{MESH}{values}").as_bytes()) else {
                panic!("{part}")
            };
            assert!(message.contains(part) && (at == line || at == line + 1), "line {at}: {message}");
        }
    }

    #[test]
    fn damaged_files_end_without_a_panic() {
        let answers = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/small/answers");
        let written =
            ["text.vtk", "binary.vtk"].map(|name| std::fs::read(answers.join(name)).expect("a mesh"));
        for whole in [format!("{MESH}{VALUES}").into_bytes(), written[0].clone(), written[1].clone()] {
            for at in (0..whole.len()).step_by(3) {
                let _ = point_arrays(&whole[..at]);
                for value in [b' ', b'-', b'9', b'\n', b'%', 0xff] {
                    let mut changed = whole.clone();
                    changed[at] = value;
                    let _ = point_arrays(&changed);
                }
            }
        }
    }
}
