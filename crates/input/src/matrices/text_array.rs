//! Plain text arrays, one row on each line: `numpy.savetxt`, `save -ascii` of MATLAB, `writematrix`, CSV files without a
//! head. Lines that begin with `#` or `%` are comments.

use super::assemble::{StoredEntries, assemble, check_size, push, undeclared_triangle};
use super::compressed::EntryCheck;
use super::coordinates::{Blocks, TextEnd, cut_off};
use super::reader::{ArraySource, HEAD, MatrixSource, Reader};
use crate::array::Array;
use crate::digits::{COUNTED, written_digits};
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::memory::{left, refuse_beyond};
use flexbody_base::text::compression::{Compression, broken};
use flexbody_base::text::input_file::InputFile;
use flexbody_base::text::scanner::{Line, Lines, Separator, excerpt, number, without_mark};
use flexbody_model::RawMatrix;

/// Reader of plain text arrays.
pub(crate) struct TextArray;

const HELP: &str = "write one row on each line, numbers with a decimal point between blanks, commas, semicolons or tabs: numpy.savetxt(file, K)";
const BOTH_TRIANGLES: &str = "write both triangles: K + numpy.tril(K, -1).T";
const LIST: &str = "give all rows and columns; a list of `row column value` needs the first line `%%MatrixMarket matrix coordinate real symmetric` and the line of its sizes, and CalculiX and Abaqus write such lists for their deck: convert the deck (.inp) with the matrices beside it";
const COLUMN: &str = "name the file of the matrix (CalculiX: .sti or .mas; its .dof lists the rows and is the value of `dof`), or write one row on each line: numpy.savetxt(file, K)";

/// Beginnings of comments that are heads of lists `row column value`: Matrix Market, and MFEM's `PrintMatlab`.
const HEADS_OF_LISTS: [&[u8]; 2] = [b"%%matrixmarket", b"% size "];

/// Most memory that a byte of text takes: a number has two bytes with its separator, and is held as an entry (16 bytes) and
/// in a column (12 bytes).
const BYTES_PER_BYTE: f64 = 14.0;

impl Reader for TextArray {
    fn name(&self) -> &'static str {
        "text array"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &[]
    }

    /// Recognises a text whose first line with content has numbers only.
    fn recognises(&self, head: &[u8]) -> bool {
        let head = &head[..head.len().min(HEAD)];
        let Some(text) = without_mark(head) else { return false };
        let is_list = |start: &&[u8]| text.get(..start.len()).is_some_and(|t| t.eq_ignore_ascii_case(start));
        if HEADS_OF_LISTS.iter().any(is_list) {
            return false;
        }
        let mut lines = Lines::of(text);
        let Some(line) = lines.find_map(data) else { return false };
        let mut fields = split(line.text, Separator::of(line.text));
        // The last field of a long line is cut off where the head ends.
        if head.len() == HEAD && lines.is_at_end() && fields.len() > 1 {
            fields.pop();
        }
        fields.iter().all(|field| number(field).is_some())
    }

    fn reads_by_itself(&self) -> bool {
        true
    }

    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix> {
        let path = source.file.path();
        let read = source.has_one_matrix("a plain text").map_err(|d| vec![d]).and_then(|()| read(source));
        read.map_err(|found| Error::new(found.into_iter().map(|d| d.in_file(path)).collect()))
    }

    fn read_array(&self, source: &ArraySource<'_>) -> Option<Diagnosed<Array>> {
        source.name.is_none().then(|| read_array(source.file, source.compression))
    }
}

fn read(source: &MatrixSource<'_>) -> Diagnosed<RawMatrix> {
    let (mut pieces, mut check) = (Vec::new(), EntryCheck::new(0, HELP));
    let text = read_rows(source.file, source.compression, |row, values| {
        let n = values.len() as u64;
        if row == 0 {
            check = EntryCheck::new(check_size(n, n, n.saturating_mul(n))?, HELP);
        }
        if row as u64 >= n {
            return Err(not_square(&format!("more than {n}"), n));
        }
        for (column, &value) in values.iter().enumerate() {
            let entry = check.entry(row as i64, column as i64, value)?;
            if value != 0.0 {
                push(&mut pieces, entry);
            }
        }
        Ok(())
    })?;
    if text.rows != text.columns {
        return Err(vec![not_square(&text.rows.to_string(), text.columns as u64)]);
    }
    let built = match undeclared_triangle(check.sides, |_| BOTH_TRIANGLES.into()) {
        Some(triangle) => Err(triangle),
        None => assemble(text.rows, pieces, StoredEntries::Full, text.written, source.file.path()),
    };
    built.map_err(|diagnostic| vec![diagnostic])
}

fn not_square(rows: &str, columns: u64) -> Diagnostic {
    let message = match columns {
        1 => "file has one number on each line, a matrix has whole rows".into(),
        _ => format!("matrix has {rows} rows and {columns} columns"),
    };
    let help = match columns {
        1 => COLUMN,
        3 => LIST,
        _ => HELP,
    };
    Diagnostic::new(Code::MatrixNotSquare, message).with_help(help)
}

fn read_array(file: &InputFile, compression: Compression) -> Diagnosed<Array> {
    let mut values = Vec::new();
    let text = read_rows(file, compression, |_, row| {
        values.extend_from_slice(row);
        Ok(())
    })?;
    Ok(Array { rows: text.rows, cols: text.columns, row_major: true, values, digits: text.written.max(1) })
}

/// Extents of a text that was read.
#[derive(Default)]
struct RowsRead {
    rows: usize,
    columns: usize,
    /// Largest number of significant digits of a value as written, among the first values of each row.
    written: u8,
}

/// Reads the rows of a text. `take` receives the index of each row, from 0, and its values; all rows have equally many.
///
/// # Errors
/// FB103 for a damaged compressed file, FB301 and FB304 for lines that are no rows, FB601; the errors of `take`.
fn read_rows(
    file: &InputFile,
    compression: Compression,
    mut take: impl FnMut(usize, &[f64]) -> std::result::Result<(), Diagnostic>,
) -> Diagnosed<RowsRead> {
    let mut blocks = Blocks::of(file, compression);
    let (mut read, mut row, mut line) = (RowsRead::default(), RowReader::default(), 0);
    let mut ends_with_line = true;
    while let Some(block) = blocks.next().map_err(|error| vec![broken(file.path(), &error)])? {
        if !ends_with_line {
            let message = format!("the line has more than {} bytes", row.length);
            return Err(vec![Diagnostic::new(Code::MatrixSyntax, message).at_line(line).with_help(HELP)]);
        }
        ends_with_line = block.ends_with(b"\n");
        let what = "reading the numbers of a text";
        refuse_beyond(left(), BYTES_PER_BYTE * block.len() as f64, what, "use a larger machine")
            .map_err(|error| vec![error.first_error().clone()])?;
        let text = if line == 0 { without_mark(&block).unwrap_or(&block) } else { &block };
        for content in Lines::below(text, line) {
            line = content.number;
            let Some(content) = data(content) else { continue };
            let taken = row.parse(content.text).and_then(|()| take(read.rows, &row.values));
            taken.map_err(|diagnostic| vec![diagnostic.at_line(line)])?;
            read.rows += 1;
        }
        blocks
            .refuse_filling((read.rows * row.values.len()) as u64)
            .map_err(|diagnostic| vec![diagnostic])?;
        blocks.take_back(block);
    }
    if blocks.end() == TextEnd::Number && line > 1 {
        return Err(vec![cut_off(line)]);
    }
    if read.rows == 0 {
        return Err(vec![
            Diagnostic::new(Code::MatrixSyntax, "file has no line with numbers").with_help(HELP),
        ]);
    }
    Ok(RowsRead { columns: row.values.len(), written: row.written, ..read })
}

/// Parser of the rows of a text.
#[derive(Default)]
struct RowReader {
    /// Separator of the first row, which all others have too.
    separator: Option<Separator>,
    /// Values of the last row.
    values: Vec<f64>,
    written: u8,
    /// Number of bytes of the last row.
    length: usize,
}

impl RowReader {
    fn parse(&mut self, line: &[u8]) -> std::result::Result<(), Diagnostic> {
        let separator = *self.separator.get_or_insert(Separator::of(line));
        let is_first = self.values.is_empty();
        let fields = split(line, separator);
        if !is_first && fields.len() != self.values.len() {
            let message =
                format!("the row has {} values, the first row has {}", fields.len(), self.values.len());
            return Err(Diagnostic::new(Code::MatrixCount, message).with_help(HELP));
        }
        self.length = line.len();
        self.values.clear();
        for field in fields {
            let value = number(field).ok_or_else(|| {
                let message = format!("value `{}` is not a number", excerpt(field));
                Diagnostic::new(Code::MatrixSyntax, message).with_help(HELP)
            })?;
            if self.values.len() < COUNTED && value != 0.0 {
                self.written = self.written.max(written_digits(field));
            }
            self.values.push(value);
        }
        Ok(())
    }
}

/// Returns the line without its comment; `None` for one without content.
fn data(line: Line<'_>) -> Option<Line<'_>> {
    let end = line.text.iter().position(|byte| matches!(byte, b'#' | b'%')).unwrap_or(line.text.len());
    Line { text: line.text[..end].trim_ascii_end(), ..line }.content()
}

/// Returns the fields of a line; a separator at its end begins none.
fn split(line: &[u8], separator: Separator) -> Vec<&[u8]> {
    let mut fields = separator.split(line);
    if fields.len() > 1 && fields.last().is_some_and(|last| last.is_empty()) {
        fields.pop();
    }
    fields
}
