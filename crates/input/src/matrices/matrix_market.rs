//! Matrix Market coordinate files, plain or compressed: <https://math.nist.gov/MatrixMarket/formats.html>.

use super::assemble::{
    Entry, StoredEntries, assemble, check_extents, check_size, refuse_beyond_memory, undeclared_triangle,
};
use super::coordinates::{Blocks, Coordinates, Limits, TextEnd, cut_off};
use super::operator::OperatorColumns;
use super::reader::{ArraySource, MatrixSource, Reader};
use super::rectangular::Rectangular;
use crate::array::Array;
use crate::digits::written_digits;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::memory::{left, refuse_beyond};
use flexbody_base::text::InputFile;
use flexbody_base::text::compression::{Compression, broken};
use flexbody_base::text::scanner::{Line, Lines, excerpt, real, words};
use flexbody_model::RawMatrix;

/// Reader of Matrix Market files.
pub(crate) struct MatrixMarket;

impl Reader for MatrixMarket {
    fn name(&self) -> &'static str {
        "Matrix Market"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["mtx", "mm"]
    }

    fn recognises(&self, head: &[u8]) -> bool {
        has_banner(head)
    }

    fn reads_by_itself(&self) -> bool {
        true
    }

    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix> {
        let path = source.file.path();
        if let Some(group) = source.group {
            let message = format!("group `{group}` is named, but Matrix Market files have no groups");
            let help = "give the file without a group";
            return Err(Diagnostic::new(Code::Hdf5Layout, message).in_file(path).with_help(help).into());
        }
        read(source)
            .map_err(|diagnostics| Error::new(diagnostics.into_iter().map(|d| d.in_file(path)).collect()))
    }

    fn read_operator(&self, source: &ArraySource<'_>) -> Option<Diagnosed<OperatorColumns>> {
        let read = || read_rectangular(source.file, source.compression).map(Rectangular::operator);
        (source.name.is_none() && is_coordinate(source.head)).then(read)
    }

    fn read_array(&self, source: &ArraySource<'_>) -> Option<Diagnosed<Array>> {
        source.name.is_none().then(|| read_array(source.file, source.compression))
    }
}

fn read(source: &MatrixSource<'_>) -> Diagnosed<RawMatrix> {
    let path = source.file.path();
    let mut blocks = Blocks::of(source.file, source.compression);
    let Some(first) = blocks.next().map_err(|e| vec![broken(path, &e)])? else {
        return Err(vec![Diagnostic::new(Code::FileEmpty, "compressed file holds no bytes")]);
    };
    let (header, length, lines) = parse_header(&first)?;
    check_size(header.rows, header.cols, header.entries).map_err(|d| vec![d.at_line(lines)])?;
    refuse_beyond_memory(header.entries.min(possible_entries(source))).map_err(|d| vec![d])?;
    let limits = Limits { n: header.rows as u32, integer: header.integer };
    let mut body = Coordinates::new(limits, Some(header.entries), lines);
    let end = body.read(path, blocks, first, length)?;
    let mut found = body.bad_lines(end);
    found.extend(wrong_count(&header, &body));
    found.extend(wrong_triangles(&header, &body));
    if !found.is_empty() {
        return Err(found);
    }
    let stored = match header.symmetry {
        Symmetry::Symmetric => StoredEntries::Triangle,
        Symmetry::General => StoredEntries::Full,
    };
    assemble(header.rows as usize, body.pieces, stored, body.written, path).map_err(|d| vec![d])
}

/// Returns true if the (unpacked) file that begins with `head` lists entries, not a dense array.
fn is_coordinate(head: &[u8]) -> bool {
    let first = head.split(|&byte| byte == b'\n').next().unwrap_or_default();
    has_banner(head) && !String::from_utf8_lossy(first).to_lowercase().contains(" array ")
}

/// Reads a matrix that need not be square, with all entries stored: its numbers of rows and columns, and its entries
/// from 0.
///
/// # Errors
/// FB301 to FB306 for a file that is not valid, all that are found.
fn read_rectangular(file: &InputFile, compression: Compression) -> Diagnosed<Rectangular> {
    let path = file.path();
    let mut blocks = Blocks::of(file, compression);
    let Some(first) = blocks.next().map_err(|e| vec![broken(path, &e)])? else {
        return Err(vec![Diagnostic::new(Code::FileEmpty, "compressed file holds no bytes")]);
    };
    let (header, length, lines) = parse_header(&first)?;
    if header.symmetry == Symmetry::Symmetric && header.rows != header.cols {
        let message =
            format!("matrix of {} rows and {} columns is declared symmetric", header.rows, header.cols);
        return Err(vec![Diagnostic::new(Code::MatrixKind, message).with_help("declare it general")]);
    }
    let [rows, columns] =
        check_extents(header.rows, header.cols, header.entries).map_err(|d| vec![d.at_line(lines)])?;
    let limits = Limits { n: rows.max(columns) as u32, integer: header.integer };
    let mut body = Coordinates::new(limits, Some(header.entries), lines);
    let end = body.read(path, blocks, first, length)?;
    let mut found = body.bad_lines(end);
    found.extend(wrong_count(&header, &body));
    if !found.is_empty() {
        return Err(found);
    }
    let mut entries: Vec<Entry> = body.pieces.into_iter().flatten().collect();
    if header.symmetry == Symmetry::Symmetric {
        let mirrored: Vec<Entry> = entries
            .iter()
            .filter(|entry| entry.row != entry.col)
            .map(|entry| Entry { row: entry.col, col: entry.row, value: entry.value })
            .collect();
        entries.extend(mirrored);
    }
    Rectangular { rows, columns, entries }.checked().map_err(|diagnostic| vec![diagnostic])
}

/// Returns the largest number of entries that the file can hold, whatever it announces.
fn possible_entries(source: &MatrixSource<'_>) -> u64 {
    /// Bytes of the shortest line, `1 1 1`, with its end.
    const MIN_LINE_BYTES: u64 = 6;
    /// Largest ratio by which deflate shrinks data.
    const MAX_DEFLATE_RATIO: u64 = 1032;
    let unpacked = match source.compression {
        Compression::None => source.file.length(),
        Compression::Gzip => source.file.length().saturating_mul(MAX_DEFLATE_RATIO),
        Compression::Zstd => u64::MAX,
    };
    unpacked / MIN_LINE_BYTES + 1
}

fn wrong_count(header: &Header, body: &Coordinates) -> Option<Diagnostic> {
    if body.count == header.entries {
        return None;
    }
    let found = if body.stopped { "more".to_owned() } else { body.count.to_string() };
    let message = format!("header announces {} entries, the file has {found}", header.entries);
    let diagnostic = Diagnostic::new(Code::MatrixCount, message);
    Some(if body.count > header.entries {
        diagnostic.with_help("correct the size line, or write the file again")
    } else {
        diagnostic
    })
}

fn wrong_triangles(header: &Header, body: &Coordinates) -> Option<Diagnostic> {
    match (header.symmetry, body.lower, body.upper) {
        (Symmetry::Symmetric, Some(lower), Some(upper)) => {
            let (stored, other, line) =
                if lower < upper { ("lower", "above", upper) } else { ("upper", "below", lower) };
            let message = format!(
                "matrix is declared symmetric and stored by its {stored} triangle, but this entry lies {other} the diagonal"
            );
            Some(Diagnostic::new(Code::MatrixTriangles, message).at_line(line))
        }
        (Symmetry::General, ..) => undeclared_triangle(body.sides(), |_| {
            "write `symmetric` instead of `general` in the first line, or store both triangles".into()
        }),
        _ => None,
    }
}

// Banner, comments and size line.

/// Entries of the matrix that are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Symmetry {
    /// One triangle of a symmetric matrix.
    Symmetric,
    /// All entries.
    General,
}

/// Sizes and symmetry stated in the header of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Header {
    pub integer: bool,
    pub symmetry: Symmetry,
    pub rows: u64,
    pub cols: u64,
    pub entries: u64,
}

const BANNER: &[u8] = b"%%MatrixMarket";

/// Returns true when the text begins with the banner, in any case.
fn has_banner(text: &[u8]) -> bool {
    without_bom(text).get(..BANNER.len()).is_some_and(|start| start.eq_ignore_ascii_case(BANNER))
}

fn without_bom(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text)
}

/// Returns the header, and its numbers of bytes and lines.
fn parse_header(text: &[u8]) -> Diagnosed<(Header, usize, usize)> {
    let mut lines = Lines::of(text);
    let first = lines.next().map_or(&b""[..], |line| line.text);
    let (integer, symmetry) = banner(without_bom(first))?;
    while let Some(Line { number, text: line }) = lines.next() {
        let line = line.trim_ascii_start();
        if line.is_empty() || line.starts_with(b"%") {
            continue;
        }
        let numbers: Vec<Option<u64>> = words(line).map(size).collect();
        let &[Some(rows), Some(cols), Some(entries)] = numbers.as_slice() else {
            let message = format!("size line is `{}`, expected rows, columns and entries", excerpt(line));
            return Err(vec![Diagnostic::new(Code::MatrixSyntax, message).at_line(number)]);
        };
        return Ok((Header { integer, symmetry, rows, cols, entries }, lines.at, number));
    }
    let message = "file ends before the line with rows, columns and entries";
    Err(vec![Diagnostic::new(Code::MatrixSyntax, message).at_line(lines.number)])
}

/// Parses a whole number.
fn size(field: &[u8]) -> Option<u64> {
    std::str::from_utf8(field).ok()?.parse().ok()
}

/// Returns field type and symmetry of the banner. The error names every unsupported property.
fn banner(line: &[u8]) -> Diagnosed<(bool, Symmetry)> {
    let shown = excerpt(line.trim_ascii());
    if !has_banner(line) {
        let message =
            format!("first line is `{shown}`, expected `%%MatrixMarket matrix coordinate real symmetric`");
        let help = "CalculiX and Abaqus write `row column value` without a header: convert their deck (.inp) with the matrices beside it";
        return Err(vec![Diagnostic::new(Code::MatrixSyntax, message).at_line(1).with_help(help)]);
    }
    let words: Vec<String> =
        String::from_utf8_lossy(line).split_whitespace().map(str::to_lowercase).collect();
    let &[_, object, format, field, symmetry] =
        words.iter().map(String::as_str).collect::<Vec<_>>().as_slice()
    else {
        let message = format!("first line is `{shown}`, expected five words");
        return Err(vec![Diagnostic::new(Code::MatrixSyntax, message).at_line(1)]);
    };
    let mut diagnostics = Vec::new();
    let mut refuse = |what: &str, word: &str, expected: &str, help: &str| {
        let message = format!("{what} is `{word}`, expected {expected}");
        diagnostics.push(Diagnostic::new(Code::MatrixKind, message).at_line(1).with_help(help));
    };
    if object != "matrix" {
        refuse("object", object, "`matrix`", "write the matrix");
    }
    if format != "coordinate" {
        refuse(
            "storage",
            format,
            "`coordinate`",
            "write the sparse matrix: row, column and value of each entry",
        );
    }
    let integer = matches!(field, "integer" | "unsigned-integer");
    if !integer && field != "real" {
        let help = match field {
            "complex" => {
                "write the real part; structural damping (an imaginary stiffness) does not belong here"
            }
            "pattern" => "write the values too, not only where they are",
            _ => Code::MatrixKind.help(),
        };
        refuse("field", field, "`real` or `integer`", help);
    }
    let kind = match symmetry {
        "symmetric" => Symmetry::Symmetric,
        "general" => Symmetry::General,
        _ => {
            let help = match symmetry {
                "skew-symmetric" => {
                    "gyroscopic matrices do not belong here: give K and M, which are symmetric"
                }
                _ => "K and M are real and symmetric",
            };
            refuse("symmetry", symmetry, "`symmetric` or `general`", help);
            Symmetry::General
        }
    };
    if diagnostics.is_empty() { Ok((integer, kind)) } else { Err(diagnostics) }
}

// Matrix Market arrays: dense, column by column.

/// Number of values whose written digits are counted.
const MAX_COUNTED_VALUES: usize = 4096;

const HELP: &str = "write the array as Matrix Market array real general: scipy.io.mmwrite of a numpy array";

/// Reads an array of real numbers.
pub(crate) fn read_array(file: &InputFile, compression: Compression) -> Diagnosed<Array> {
    let damaged = |e: std::io::Error| vec![broken(file.path(), &e)];
    let mut blocks = Blocks::of(file, compression);
    let mut reading = ArrayReader::default();
    while let Some(block) = blocks.next().map_err(damaged)? {
        for Line { number, text } in Lines::below(&block, reading.line) {
            reading.line = number;
            let line = text.trim_ascii_start();
            if reading.line == 1 {
                check_array_banner(line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line))?;
            } else if !line.is_empty() && !line.starts_with(b"%") {
                reading.content(line).map_err(|diagnostic| vec![diagnostic.at_line(reading.line)])?;
            }
        }
        blocks.refuse_filling(reading.values.len() as u64).map_err(|diagnostic| vec![diagnostic])?;
    }
    let line = reading.line;
    let array = reading.finish().map_err(|diagnostic| vec![diagnostic])?;
    if blocks.end() == TextEnd::Number { Err(vec![cut_off(line)]) } else { Ok(array) }
}

fn check_array_banner(line: &[u8]) -> Diagnosed<()> {
    let text = String::from_utf8_lossy(line).to_lowercase();
    let kinds: Vec<&str> = text.split_whitespace().collect();
    if !has_banner(line) || kinds.len() != 5 {
        let message =
            format!("first line is `{}`, expected `%%MatrixMarket matrix array real general`", excerpt(line));
        return Err(vec![Diagnostic::new(Code::MatrixSyntax, message).at_line(1)]);
    }
    let expected: [(&str, &[&str], &str); 4] = [
        ("object", &["matrix"], "write the array"),
        ("storage", &["array"], "write a dense array: scipy.io.mmwrite of a numpy array"),
        ("field", &["real", "integer"], "write real numbers"),
        ("symmetry", &["general"], "write all values"),
    ];
    let wrong = expected.iter().zip(&kinds[1..]).filter(|((_, allowed, _), word)| !allowed.contains(word));
    let diagnostics: Vec<Diagnostic> = wrong
        .map(|((what, allowed, help), word)| {
            let message =
                format!("{what} is `{}`, expected `{}`", word.escape_default(), allowed.join("` or `"));
            Diagnostic::new(Code::MatrixKind, message).at_line(1).with_help(*help)
        })
        .collect();
    if diagnostics.is_empty() { Ok(()) } else { Err(diagnostics) }
}

/// State of reading below the first line.
#[derive(Default)]
struct ArrayReader {
    line: usize,
    /// Number of rows, number of columns and their product.
    size: Option<(usize, usize, usize)>,
    values: Vec<f64>,
    written: u8,
}

impl ArrayReader {
    fn content(&mut self, line: &[u8]) -> std::result::Result<(), Diagnostic> {
        let content = line.split(|&b| b == b'%').next().unwrap_or(line);
        let mut fields = words(content);
        let Some((_, _, count)) = self.size else {
            let numbers: Vec<Option<u64>> = fields.take(3).map(size).collect();
            let extents = match *numbers.as_slice() {
                [Some(rows), Some(cols)] => usize::try_from(rows).ok().zip(usize::try_from(cols).ok()),
                _ => None,
            };
            self.size = extents.and_then(|(rows, cols)| Some((rows, cols, rows.checked_mul(cols)?)));
            let message = || format!("size line is `{}`, expected rows and columns", excerpt(line));
            let Some((_, _, count)) = self.size else {
                return Err(Diagnostic::new(Code::MatrixSyntax, message()).with_help(HELP));
            };
            let (what, needed) =
                (format!("an array of {count} values"), count as f64 * size_of::<f64>() as f64);
            let refused = refuse_beyond(left(), needed, &what, "use a larger machine");
            return refused.map_err(|error| error.first_error().clone());
        };
        fields.try_for_each(|field| {
            let value = real(field).ok_or_else(|| {
                let message = format!("value `{}` is not a number", excerpt(field));
                Diagnostic::new(Code::MatrixSyntax, message).with_help(HELP)
            })?;
            if self.values.len() == count {
                let message = format!("header announces {count} values, the file has more");
                return Err(Diagnostic::new(Code::MatrixCount, message));
            }
            if self.values.len() < MAX_COUNTED_VALUES && value != 0.0 {
                self.written = self.written.max(written_digits(field));
            }
            self.values.push(value);
            Ok(())
        })
    }

    fn finish(self) -> std::result::Result<Array, Diagnostic> {
        let Some((rows, cols, count)) = self.size else {
            return Err(Diagnostic::new(
                Code::MatrixSyntax,
                "file ends before the line with rows and columns",
            ));
        };
        if self.values.len() < count {
            let message = format!("header announces {count} values, the file has {}", self.values.len());
            return Err(Diagnostic::new(Code::MatrixCount, message));
        }
        Ok(Array { rows, cols, row_major: false, values: self.values, digits: self.written.max(1) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn banner_in_any_case_with_comments_and_blank_lines_after_it() {
        let text =
            b"%%matrixmarket MATRIX Coordinate Real SYMMETRIC\r\n% x\r\n\r\n  %y\r\n 3 3\t4 \r\n1 1 1\r\n";
        let (header, length, lines) = parse_header(text).unwrap();
        assert_eq!(
            header,
            Header { integer: false, symmetry: Symmetry::Symmetric, rows: 3, cols: 3, entries: 4 }
        );
        assert_eq!(&text[length..], b"1 1 1\r\n");
        assert_eq!(lines, 5);
    }

    #[test]
    fn everything_unsupported_is_named_at_once() {
        let found = parse_header(b"%%MatrixMarket matrix array complex hermitian\n2 2\n").unwrap_err();
        assert_eq!(found.len(), 3);
        for (diagnostic, word) in found.iter().zip(["array", "complex", "hermitian"]) {
            assert_eq!(diagnostic.code(), Code::MatrixKind);
            assert!(diagnostic.message().contains(word));
        }
    }
}
