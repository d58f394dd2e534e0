//! Meshes of VTK in its legacy form (.vtk, text and binary): the points, and in `arrays` the values at them.
//! <https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html>

mod arrays;

pub(crate) use arrays::point_arrays;

use super::errors::syntax;
use crate::node_file::NodeFile;
use crate::number_type::NumberType;
use flexbody_base::diagnostic::Diagnosed;
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{Words, number};

const BANNER: &str = "# vtk DataFile Version";

/// Returns true when the text is a legacy file of VTK.
pub(super) fn recognises(head: &str) -> bool {
    head.starts_with(BANNER)
}

/// Reads the points, numbered from 0 as in ParaView.
pub(super) fn read(file: &InputFile) -> Diagnosed<NodeFile> {
    let mut cursor = Cursor { text: Words::of(file.bytes()), binary: false };
    let places = cursor.points().map_err(|message| syntax(file, cursor.text.line_number(), message))?;
    let mut read = NodeFile::default();
    read.nodes.positions = places.chunks_exact(3).map(|x| [x[0], x[1], x[2]]).collect();
    read.nodes.ids = (0..read.nodes.positions.len() as i64).collect();
    Ok(read)
}

struct Cursor<'a> {
    text: Words<'a>,
    binary: bool,
}

impl Cursor<'_> {
    /// Reads the coordinates of all points.
    fn points(&mut self) -> Result<Vec<f64>, String> {
        // Banner and title are skipped.
        self.text.line();
        self.text.line();
        self.binary = match self.words().first().map(|word| word.to_ascii_uppercase()).as_deref() {
            Some("ASCII") => false,
            Some("BINARY") => true,
            _ => return Err("expected ASCII or BINARY".to_owned()),
        };
        loop {
            if self.text.rest().is_empty() {
                return Err("file has no POINTS".to_owned());
            }
            let begin = self.text.at;
            // Keywords are case-insensitive.
            let words: Vec<String> = self.words().iter().map(|word| word.to_ascii_uppercase()).collect();
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            match words.as_slice() {
                [] | ["DIMENSIONS" | "METADATA" | "INFORMATION" | "NAME" | "DATA", ..] => {}
                ["DATASET", "UNSTRUCTURED_GRID" | "POLYDATA" | "STRUCTURED_GRID"] => {}
                ["DATASET", kind] => return Err(format!("a data set {kind} has no list of points")),
                ["FIELD", _, count] => self.skip_fields(count)?,
                ["POINTS", count, kind] => {
                    let (count, kind) = self.announced(count, "3", kind, begin)?;
                    return self.numbers(count, kind);
                }
                [word, ..] => {
                    self.text.at = begin;
                    return Err(format!("expected POINTS, found `{}`", word.escape_default()));
                }
            }
        }
    }

    /// Skips arrays that hold no points.
    fn skip_fields(&mut self, count: &str) -> Result<(), String> {
        let count: u64 = count.parse().map_err(|_| "expected the number of fields".to_owned())?;
        for _ in 0..count {
            let begin = self.text.at;
            let mut words = self.words();
            if words.is_empty() {
                words = self.words();
            }
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            let [_, components, tuples, kind] = words.as_slice() else {
                self.text.at = begin;
                return Err("expected name, components, tuples and type of a field".to_owned());
            };
            let (count, kind) = self.announced(tuples, components, kind, begin)?;
            self.numbers(count, kind)?;
        }
        Ok(())
    }

    /// Returns the announced number of numbers, and their type.
    fn announced(
        &mut self,
        tuples: &str,
        components: &str,
        kind: &str,
        begin: usize,
    ) -> Result<(usize, NumberType), String> {
        let number = |text: &str| text.parse::<usize>().ok();
        let count = number(tuples).zip(number(components)).and_then(|(a, b)| a.checked_mul(b));
        match count.zip(NumberType::named(kind)) {
            Some(announced) => Ok(announced),
            None => {
                self.text.at = begin;
                Err(format!("expected a count and a type of numbers, found `{tuples} {kind}`"))
            }
        }
    }

    fn numbers(&mut self, count: usize, kind: NumberType) -> Result<Vec<f64>, String> {
        if self.binary {
            let bytes = count.checked_mul(kind.bytes()).and_then(|length| self.text.rest().get(..length));
            let bytes = bytes.ok_or_else(|| format!("file ends before its {count} numbers do"))?;
            self.text.at += bytes.len();
            return Ok(kind.decode(bytes, true));
        }
        let mut numbers = Vec::new();
        while numbers.len() < count {
            let Some(word) = self.text.next() else {
                return Err(format!("file ends after {} of {count} numbers", numbers.len()));
            };
            let value = number(word);
            numbers.push(value.ok_or_else(|| format!("expected a number, found `{}`", word.escape_ascii()))?);
        }
        Ok(numbers)
    }

    /// Returns the words of the rest of the line.
    fn words(&mut self) -> Vec<String> {
        String::from_utf8_lossy(self.text.line()).split_whitespace().map(str::to_owned).collect()
    }
}
