//! Harwell-Boeing and Rutherford-Boeing files, plain or compressed: compressed columns as text, whose numbers stand in the
//! columns that a Fortran format of the head states. I. S. Duff, R. G. Grimes, J. G. Lewis: "Users' Guide for the
//! Harwell-Boeing Sparse Matrix Collection", 1992; "The Rutherford-Boeing Sparse Matrix Collection", 1997.

mod format;
mod head;

use super::assemble::{
    Entry, Sides, StoredEntries, assemble, check_extents, check_size, push, refuse_beyond_memory,
    undeclared_triangle,
};
use super::compressed::EntryCheck;
use super::coordinates::{Blocks, cut_off};
use super::operator::OperatorColumns;
use super::reader::{ArraySource, MatrixSource, Reader};
use super::rectangular::Rectangular;
use crate::digits::written_digits;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::text::compression::{Compression, broken};
use flexbody_base::text::input_file::InputFile;
use flexbody_base::text::scanner::{Line, Lines, excerpt, whole};
use flexbody_model::RawMatrix;
use head::{HELP, Head, Part};

/// Reader of Harwell-Boeing and Rutherford-Boeing files.
pub(crate) struct HarwellBoeing;

const BOTH_TRIANGLES: &str = "write both triangles, or declare the matrix symmetric: RSA instead of RUA";

/// Number of values whose written digits are counted: all have the same format.
const MAX_COUNTED_VALUES: usize = 4096;

impl Reader for HarwellBoeing {
    fn name(&self) -> &'static str {
        "Harwell-Boeing"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["hb", "rb", "rsa", "rua", "rra"]
    }

    fn recognises(&self, head: &[u8]) -> bool {
        head::begins(head)
    }

    fn reads_by_itself(&self) -> bool {
        true
    }

    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix> {
        let path = source.file.path();
        let read = source
            .has_one_matrix("a Harwell-Boeing file")
            .map_err(|diagnostic| vec![diagnostic])
            .and_then(|()| read(source));
        read.map_err(|found| Error::new(found.into_iter().map(|d| d.in_file(path)).collect()))
    }

    fn read_operator(&self, source: &ArraySource<'_>) -> Option<Diagnosed<OperatorColumns>> {
        let read = || read_rectangular(source.file, source.compression).map(Rectangular::operator);
        source.name.is_none().then(read)
    }
}

fn read(source: &MatrixSource<'_>) -> Diagnosed<RawMatrix> {
    let check =
        |head: &Head| check_size(head.rows, head.columns, head.entries).map(|n| n as u64).map(|n| [n, n]);
    let Stored { head, pieces, sides, written } = read_entries(source.file, source.compression, check)?;
    let both = sides == Sides { lower: true, upper: true };
    let (stored, wrong) = if head.is_symmetric {
        let message = "matrix is declared symmetric, but has entries on both sides of the diagonal";
        let help = "write one triangle, or declare the matrix RUA";
        let wrong = both.then(|| Diagnostic::new(Code::MatrixTriangles, message).with_help(help));
        (StoredEntries::Triangle, wrong)
    } else {
        (StoredEntries::Full, undeclared_triangle(sides, |_| BOTH_TRIANGLES.into()))
    };
    let made = match wrong {
        Some(wrong) => Err(wrong),
        None => assemble(head.rows as usize, pieces, stored, written, source.file.path()),
    };
    made.map_err(|diagnostic| vec![diagnostic])
}

/// Reads a matrix that need not be square.
///
/// # Errors
/// FB103 for a damaged compressed file, FB301 to FB313 for a file that is not valid.
fn read_rectangular(file: &InputFile, compression: Compression) -> Diagnosed<Rectangular> {
    let check = |head: &Head| {
        check_extents(head.rows, head.columns, head.entries).map(|extents| extents.map(|n| n as u64))
    };
    let Stored { head, pieces, .. } = read_entries(file, compression, check)?;
    let mut entries = pieces.concat();
    if head.is_symmetric {
        let mirrored = |entry: &Entry| Entry { row: entry.col, col: entry.row, value: entry.value };
        let other: Vec<Entry> = entries.iter().filter(|e| e.row != e.col).map(mirrored).collect();
        entries.extend(other);
    }
    let matrix = Rectangular { rows: head.rows as usize, columns: head.columns as usize, entries };
    matrix.checked().map_err(|diagnostic| vec![diagnostic])
}

/// Content of a file.
struct Stored {
    head: Head,
    /// Nonzero entries in file order.
    pieces: Vec<Vec<Entry>>,
    sides: Sides,
    /// Largest number of significant digits of a value as written.
    written: u8,
}

/// Reads head and entries; `check` returns the extents of the matrix if a matrix of this head can be read.
fn read_entries(
    file: &InputFile,
    compression: Compression,
    check: impl FnOnce(&Head) -> std::result::Result<[u64; 2], Diagnostic>,
) -> Diagnosed<Stored> {
    let mut blocks = Blocks::of(file, compression);
    let mut next = || blocks.next().map_err(|error| vec![broken(file.path(), &error)]);
    let one = |diagnostic: Diagnostic| vec![diagnostic];
    let first = next()?.unwrap_or_default();
    let mut lines = Lines::of(&first);
    let head = Head::read(&mut lines).map_err(|diagnostic| vec![diagnostic.at_line(lines.number)])?;
    let extents = check(&head).map_err(|diagnostic| vec![diagnostic.at_line(head::SIZES_LINE)])?;
    // A plain file has a byte or more for every entry, whatever its head states.
    let most = if compression == Compression::None { file.length() } else { u64::MAX };
    refuse_beyond_memory(head.entries.min(most)).map_err(one)?;
    let mut columns = ColumnReader::new(head, extents);
    let (mut at, mut line) = (lines.at, lines.number);
    let mut block = Some(first);
    while let Some(text) = block {
        let mut lines = Lines::starting_at(&text, at, line);
        while !columns.is_complete() {
            let Some(content) = lines.next() else { break };
            line = content.number;
            let is_last = lines.is_at_end() && !text.ends_with(b"\n");
            columns.line(content, is_last).map_err(|diagnostic| vec![diagnostic.at_line(line)])?;
        }
        if columns.is_complete() {
            return Ok(columns.finish());
        }
        (block, at) = (next()?, 0);
    }
    Err(vec![columns.ended().at_line(line)])
}

/// Returns the numbers of a line, `count` as expected. Numbers between blanks need no columns, and SciPy writes them narrower than
/// its head says; numbers that touch each other are told apart by their `width`.
fn fields(text: &[u8], width: usize, count: usize) -> Vec<&[u8]> {
    let apart: Vec<&[u8]> = text.split(u8::is_ascii_whitespace).filter(|field| !field.is_empty()).collect();
    if apart.len() == count { apart } else { text.chunks(width).map(<[u8]>::trim_ascii).collect() }
}

/// Reader of the lines below the head: starts of the columns, rows, values.
struct ColumnReader {
    head: Head,
    rows: u64,
    part: Part,
    starts: Vec<u64>,
    indices: Vec<u32>,
    /// Number of values so far.
    count: u64,
    /// Column of the last value, from 0.
    column: usize,
    pieces: Vec<Vec<Entry>>,
    check: EntryCheck,
    written: u8,
}

impl ColumnReader {
    fn new(head: Head, [rows, columns]: [u64; 2]) -> Self {
        Self {
            head,
            rows,
            part: Part::Starts,
            starts: Vec::new(),
            indices: Vec::new(),
            count: 0,
            column: 0,
            pieces: Vec::new(),
            check: EntryCheck::new(rows.max(columns) as usize, HELP),
            written: 0,
        }
    }

    fn is_complete(&self) -> bool {
        self.part == Part::Values && self.count == self.head.entries
    }

    /// Returns the numbers of the present part that were read, and that it has.
    fn progress(&self) -> [u64; 2] {
        match self.part {
            Part::Starts => [self.starts.len() as u64, self.head.columns + 1],
            Part::Rows => [self.indices.len() as u64, self.head.entries],
            Part::Values => [self.count, self.head.entries],
        }
    }

    /// Reads a line; `is_last` is true for the last line of a file without a line end.
    fn line(&mut self, line: Line<'_>, is_last: bool) -> std::result::Result<(), Diagnostic> {
        let format = self.head.format(self.part);
        let [read, all] = self.progress();
        let count = usize::try_from(all - read).unwrap_or(usize::MAX).min(format.per_line);
        let fields = fields(line.text, format.width, count);
        if fields.len() != count {
            let message = format!(
                "the line has {} numbers of {} columns, expected {count} among the {}",
                fields.len(),
                format.width,
                self.part.name()
            );
            return Err(Diagnostic::new(Code::MatrixCount, message).with_help(HELP));
        }
        // A number that does not reach the end of its columns may lack digits.
        if is_last && !line.text.len().is_multiple_of(format.width) {
            return Err(cut_off(line.number));
        }
        for field in fields {
            self.number(field)?;
        }
        let [read, all] = self.progress();
        if read == all && self.part != Part::Values {
            if self.part == Part::Starts {
                self.check_starts()?;
            }
            self.part = if self.part == Part::Starts && all > 0 { Part::Rows } else { Part::Values };
        }
        Ok(())
    }

    fn number(&mut self, field: &[u8]) -> std::result::Result<(), Diagnostic> {
        let not_whole = || {
            let message = format!("`{}` among the {} is no whole number", excerpt(field), self.part.name());
            Diagnostic::new(Code::MatrixSyntax, message).with_help(HELP)
        };
        match self.part {
            Part::Starts => {
                let start = whole(field).and_then(|start| u64::try_from(start).ok()).ok_or_else(not_whole)?;
                self.starts.push(start);
            }
            Part::Rows => {
                let row = whole(field).ok_or_else(not_whole)?;
                let inside = u64::try_from(row).ok().filter(|row| (1..=self.rows).contains(row));
                let Some(row) = inside else {
                    let message = format!("row {row} is out of range, expected 1 to {}", self.rows);
                    return Err(Diagnostic::new(Code::MatrixIndex, message).with_help(HELP));
                };
                self.indices.push((row - 1) as u32);
            }
            Part::Values => {
                let value = self.head.format(Part::Values).value(field)?;
                while self.starts[self.column + 1] <= self.count + 1 {
                    self.column += 1;
                }
                let row = self.indices[self.count as usize];
                let entry = self.check.entry(i64::from(row), self.column as i64, value)?;
                if value != 0.0 {
                    if self.count < MAX_COUNTED_VALUES as u64 {
                        self.written = self.written.max(written_digits(field));
                    }
                    push(&mut self.pieces, entry);
                }
                self.count += 1;
            }
        }
        Ok(())
    }

    fn check_starts(&self) -> std::result::Result<(), Diagnostic> {
        let end = self.head.entries + 1;
        let rises = self.starts.is_sorted() && self.starts[0] == 1 && self.starts.last() == Some(&end);
        if rises {
            return Ok(());
        }
        let message =
            format!("the starts of the columns do not rise from 1 to {end}, the number of entries and 1");
        Err(Diagnostic::new(Code::MatrixSyntax, message).with_help(HELP))
    }

    fn ended(&self) -> Diagnostic {
        let [read, all] = self.progress();
        let message = format!("file ends after {read} of the {all} {}", self.part.name());
        Diagnostic::new(Code::MatrixCount, message).with_help("write or transfer the file again")
    }

    fn finish(self) -> Stored {
        Stored { head: self.head, pieces: self.pieces, sides: self.check.sides, written: self.written.max(1) }
    }
}
