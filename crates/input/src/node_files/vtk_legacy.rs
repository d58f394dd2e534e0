//! Meshes of VTK in its legacy form (.vtk, text and binary): the points, and in `arrays` the values at them.
//! <https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html>

mod arrays;

pub(crate) use arrays::point_arrays;

use super::{Found, NodeFile, syntax};
use flexbody_base::memory::left;
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{Words, number};
use std::io::{Error, ErrorKind, Read};

const BANNER: &str = "# vtk DataFile Version";

/// Returns true when the text is a legacy file of VTK.
pub(super) fn recognises(head: &str) -> bool {
    head.starts_with(BANNER)
}

/// Reads the points, numbered from 0 as in ParaView.
pub(super) fn read(file: &InputFile) -> Found<NodeFile> {
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

// Numbers in files of VTK: their types, and their packing in XML files.

/// Result of reading an array. The error is a clause about the array for a message.
pub(super) type Unpacked<T> = Result<T, String>;

/// Type of the numbers of an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NumberType {
    Signed(usize),
    Unsigned(usize),
    Float,
    Double,
}

impl NumberType {
    /// Returns the type of this name in XML files (`Float64`) or in legacy files (`double`).
    pub(super) fn named(name: &str) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_str() {
            "float32" | "float" => Self::Float,
            "float64" | "double" => Self::Double,
            "int8" | "char" | "signed_char" => Self::Signed(1),
            "int16" | "short" => Self::Signed(2),
            "int32" | "int" | "vtkidtype" => Self::Signed(4),
            "int64" | "long" | "vtktypeint64" => Self::Signed(8),
            "uint8" | "unsigned_char" => Self::Unsigned(1),
            "uint16" | "unsigned_short" => Self::Unsigned(2),
            "uint32" | "unsigned_int" => Self::Unsigned(4),
            "uint64" | "unsigned_long" | "vtktypeuint64" => Self::Unsigned(8),
            _ => return None,
        })
    }

    /// Returns the number of bytes of a number.
    pub(crate) fn bytes(self) -> usize {
        match self {
            Self::Signed(bytes) | Self::Unsigned(bytes) => bytes,
            Self::Float => 4,
            Self::Double => 8,
        }
    }

    pub(super) fn is_whole(self) -> bool {
        matches!(self, Self::Signed(_) | Self::Unsigned(_))
    }

    /// Returns the numbers in `bytes`; incomplete bytes at the end are left out.
    pub(crate) fn decode(self, bytes: &[u8], big_endian: bool) -> Vec<f64> {
        bytes.chunks_exact(self.bytes()).map(|chunk| self.number(digits(chunk, big_endian))).collect()
    }

    fn number(self, digits: u64) -> f64 {
        match self {
            Self::Float => f64::from(f32::from_bits(digits as u32)),
            Self::Double => f64::from_bits(digits),
            Self::Unsigned(_) => digits as f64,
            Self::Signed(bytes) => {
                let unused = 64 - 8 * bytes as u32;
                (((digits << unused) as i64) >> unused) as f64
            }
        }
    }
}

fn digits(bytes: &[u8], big_endian: bool) -> u64 {
    let append = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
    if big_endian { bytes.iter().fold(0, append) } else { bytes.iter().rev().fold(0, append) }
}

/// Packing of the arrays of an XML file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Packing {
    pub big_endian: bool,
    /// Number of bytes of the length in front of an array.
    pub header_bytes: usize,
    pub zlib: bool,
}

impl Packing {
    /// Returns the bytes of the array at the beginning of the stream, at most `most`.
    pub(super) fn unpack(self, mut stream: impl Read, most: u64) -> Unpacked<Vec<u8>> {
        if !self.zlib {
            let length = self.header(&mut stream)?;
            return exactly(&mut stream, length);
        }
        // The header holds the number of blocks, their size, and the size of an incomplete last block (0 if there is
        // none).
        let [blocks, size, last] =
            [self.header(&mut stream)?, self.header(&mut stream)?, self.header(&mut stream)?];
        let whole = if last == 0 { blocks } else { blocks.saturating_sub(1) };
        let total = whole.saturating_mul(size).saturating_add(last);
        if total > most {
            return Err(format!("unpacks to {total} bytes, {most} are expected"));
        }
        if left().is_some_and(|left| total > left) {
            return Err(format!("unpacks to {total} bytes, more than fit the memory"));
        }
        // The packed length of every block precedes the blocks.
        let lengths = blocks.checked_mul(self.header_bytes as u64).ok_or(ENDS)?;
        let lengths = exactly(&mut stream, lengths)?;
        let mut unpacked = Vec::new();
        for (k, length) in lengths.chunks_exact(self.header_bytes).enumerate() {
            let packed = exactly(&mut stream, digits(length, self.big_endian))?;
            let before = unpacked.len();
            let is_last = k as u64 + 1 == blocks;
            let expected = if is_last && last != 0 { last } else { size };
            let decoder = flate2::read::ZlibDecoder::new(packed.as_slice());
            let read = decoder.take(expected.saturating_add(1)).read_to_end(&mut unpacked);
            read.map_err(|error| format!("is damaged: {error}"))?;
            if (unpacked.len() - before) as u64 != expected {
                return Err(format!("is damaged: its block {} does not have {expected} bytes", k + 1));
            }
        }
        Ok(unpacked)
    }

    fn header(self, stream: &mut impl Read) -> Unpacked<u64> {
        exactly(stream, self.header_bytes as u64).map(|bytes| digits(&bytes, self.big_endian))
    }
}

const ENDS: &str = "ends before its data do: the file may be cut off";

fn exactly(stream: &mut impl Read, length: u64) -> Unpacked<Vec<u8>> {
    let mut bytes = Vec::new();
    stream.take(length).read_to_end(&mut bytes).map_err(|error| format!("is damaged: {error}"))?;
    if bytes.len() as u64 == length { Ok(bytes) } else { Err(ENDS.to_owned()) }
}

/// Decoder of a text in base64. The text may consist of several pieces, each with padding.
pub(super) struct Base64<'a> {
    text: &'a [u8],
    group: [u8; 3],
    /// Number of bytes in the group, and number of those already read.
    count: usize,
    given: usize,
}

impl<'a> Base64<'a> {
    pub(super) fn new(text: &'a [u8]) -> Self {
        Self { text, group: [0; 3], count: 0, given: 0 }
    }

    /// Returns the number of characters that were not decoded yet.
    pub(super) fn n_unread(&self) -> usize {
        self.text.len()
    }

    /// Decodes the next four characters. Returns false at the end.
    fn next_group(&mut self) -> std::io::Result<bool> {
        let wrong = |what: &str| Err(Error::new(ErrorKind::InvalidData, what));
        let (mut bits, mut characters, mut padding) = (0u32, 0, 0);
        while characters < 4 {
            let Some((&character, rest)) = self.text.split_first() else { break };
            self.text = rest;
            let value = match character {
                b'A'..=b'Z' => character - b'A',
                b'a'..=b'z' => character - b'a' + 26,
                b'0'..=b'9' => character - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                b'=' => 0,
                _ if character.is_ascii_whitespace() => continue,
                _ => return wrong("a character does not belong to base64"),
            };
            if padding > 0 && character != b'=' {
                return wrong("padding of base64 is within the text");
            }
            padding += usize::from(character == b'=');
            bits = bits << 6 | u32::from(value);
            characters += 1;
        }
        match (characters, padding) {
            (0, _) => return Ok(false),
            (4, 0..=2) => {}
            _ => return wrong("base64 is cut off"),
        }
        let [_, group @ ..] = bits.to_be_bytes();
        (self.group, self.count, self.given) = (group, 3 - padding, 0);
        Ok(true)
    }
}

impl Read for Base64<'_> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        let mut written = 0;
        while written < out.len() {
            if self.given == self.count && !self.next_group()? {
                break;
            }
            let unread = &self.group[self.given..self.count];
            let length = unread.len().min(out.len() - written);
            out[written..written + length].copy_from_slice(&unread[..length]);
            (written, self.given) = (written + length, self.given + length);
        }
        Ok(written)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_pieces_is_read_as_one_text() {
        let read = |text: &[u8]| {
            let mut bytes = Vec::new();
            Base64::new(text).read_to_end(&mut bytes).map(|_| bytes)
        };
        assert_eq!(read(b" aGVs\nbG8= IHdvcmxk\n").expect("text"), b"hello world");
        assert_eq!(read(b"aA==aQ==").expect("text"), b"hi");
        for bad in [&b"aGV"[..], b"a===", b"aG=s", b"aG*s"] {
            assert!(read(bad).is_err(), "{}", bad.escape_ascii());
        }
    }
}
