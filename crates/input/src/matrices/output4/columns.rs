//! The common parts of text and binary files of OUTPUT4: headers, strings of values, and the collected columns.

use crate::matrices::assemble::{
    ColumnEntries, Entry, Sides, StoredEntries, assemble_columns, assemble_distinct, given_twice, push,
};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::memory::allow_failure;
use flexbody_model::RawMatrix;
use std::ops::Range;
use std::path::Path;

/// Number of digits of single precision.
pub(super) const SINGLE_DIGITS: u8 = 7;

/// Number of rows from which on the start of a string does not fit into one word with its length.
const MIN_ROWS_OF_TWO_WORDS: u64 = 65_536;

/// Header of a matrix.
#[derive(Debug, Clone)]
pub(super) struct Header {
    pub name: String,
    pub rows: u64,
    pub columns: u64,
    pub form: i64,
    /// Kind of the numbers: 1, 2 for real numbers of single and double precision; 3, 4 for complex ones.
    pub kind: i64,
    /// True if start and length of strings are in separate words.
    pub is_big: bool,
}

impl Header {
    /// Creates the header from its numbers. The error describes numbers that belong to no matrix.
    pub(super) fn new(
        columns: i64,
        rows: i64,
        form: i64,
        kind: i64,
        name: &[u8],
    ) -> Result<Self, Diagnostic> {
        let name: String = String::from_utf8_lossy(unpadded(name)).to_uppercase();
        let is_name = |c: char| c.is_ascii_graphic();
        if columns <= 0
            || rows == 0
            || rows == i64::MIN
            || !(1..=4).contains(&kind)
            || !name.chars().all(is_name)
        {
            let message = format!("header of a matrix states {columns} columns, {rows} rows, type {kind}");
            return Err(Diagnostic::new(Code::MatrixSyntax, message).with_help("write the file again"));
        }
        Ok(Self {
            name,
            rows: rows.unsigned_abs(),
            columns: columns.unsigned_abs(),
            form,
            kind,
            is_big: rows < 0 || rows.unsigned_abs() >= MIN_ROWS_OF_TWO_WORDS,
        })
    }

    /// Returns a name that is stored in words of eight bytes, with four or eight letters in each.
    pub(super) fn name_of_wide_words(name: &[u8]) -> Vec<u8> {
        let letters = |word: &[u8]| match word.split_at_checked(4) {
            Some((four, rest)) if unpadded(rest).is_empty() => four.to_vec(),
            _ => word.to_vec(),
        };
        name.chunks(8).flat_map(letters).collect()
    }

    pub(super) fn is_real(&self) -> bool {
        matches!(self.kind, 1 | 2)
    }

    pub(super) fn is_single(&self) -> bool {
        self.kind % 2 == 1
    }

    /// Returns start and number of words of a string, which are packed into one number.
    pub(super) fn unpacked(word: i64) -> (i64, i64) {
        let length = (word >> 16) - 1;
        (word - ((length + 1) << 16), length)
    }

    /// Checks a column number: it is within the matrix, or the next one, which ends the matrix.
    pub(super) fn column(&self, column: i64) -> Result<ColumnRecord, Diagnostic> {
        match u64::try_from(column) {
            Ok(column) if column >= 1 && column <= self.columns => {
                Ok(ColumnRecord::Number(column as u32 - 1))
            }
            Ok(column) if column == self.columns + 1 => Ok(ColumnRecord::End),
            _ => {
                let message =
                    format!("matrix {} has {} columns, found column {column}", self.name, self.columns);
                Err(Diagnostic::new(Code::MatrixIndex, message).with_help("write the file again"))
            }
        }
    }

    /// Checks the position of a string of values. Returns its first row, from 0.
    pub(super) fn first_row(&self, row: i64, count: usize) -> Result<u32, Diagnostic> {
        let end = row.checked_add(count as i64 - 1).unwrap_or(i64::MAX);
        if row < 1 || end.unsigned_abs() > self.rows || self.rows > u64::from(u32::MAX) {
            let message = format!("matrix {} has {} rows, found rows {row} to {end}", self.name, self.rows);
            return Err(Diagnostic::new(Code::MatrixIndex, message).with_help("write the file again"));
        }
        Ok(row as u32 - 1)
    }
}

/// Returns a name without the blanks and zero bytes that pad its field.
pub(super) fn unpadded(name: &[u8]) -> &[u8] {
    let fills = |b: &u8| b.is_ascii_whitespace() || *b == 0;
    let start = name.iter().position(|b| !fills(b)).unwrap_or(name.len());
    let end = name.iter().rposition(|b| !fills(b)).map_or(start, |last| last + 1);
    &name[start..end]
}

/// Kind of a column record.
pub(super) enum ColumnRecord {
    Number(u32),
    End,
}

/// Positions of the columns of a matrix in its file, found from the lengths in the file before any value is read.
pub(super) struct Stored {
    pub header: Header,
    /// Groups of whole columns, in file order.
    pub stretches: Vec<Stretch>,
    /// Upper bound of the number of values in the columns.
    pub values: usize,
    /// True if every column has a higher number than the preceding one.
    pub ascending: bool,
    last: Option<u32>,
}

/// Some columns of a matrix: their bytes in the file, and the number of lines above them in a text file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Stretch {
    pub bytes: Range<usize>,
    pub line: usize,
}

impl Stored {
    /// Bytes of columns that one thread reads at a time.
    const BYTES_PER_TASK: usize = 1 << 20;

    pub(super) fn new(header: Header) -> Self {
        Self { header, stretches: Vec::new(), values: 0, ascending: true, last: None }
    }

    /// Adds a column with at most `values` values in the given bytes, below `line` lines.
    pub(super) fn add(&mut self, column: u32, values: usize, bytes: Range<usize>, line: usize) {
        self.ascending &= self.last.is_none_or(|last| last < column);
        self.last = Some(column);
        self.values += values;
        match self.stretches.last_mut() {
            Some(stretch) if stretch.bytes.len() < Self::BYTES_PER_TASK => stretch.bytes.end = bytes.end,
            _ => self.stretches.push(Stretch { bytes, line }),
        }
    }
}

/// Entries of some columns, in file order, without zeros.
#[derive(Default)]
pub(super) struct Columns {
    /// Each column with its number of entries.
    lengths: Vec<(u32, usize)>,
    rows: Vec<u32>,
    values: Vec<f64>,
    sides: Sides,
    /// Largest number of written digits.
    pub written: u8,
}

impl Columns {
    /// Creates an empty list with capacity for `entries` entries, as far as memory allows.
    pub(super) fn with_capacity(entries: usize) -> Self {
        let mut columns_of_task = Self::default();
        allow_failure(|| {
            if columns_of_task.rows.try_reserve_exact(entries).is_ok() {
                let _ = columns_of_task.values.try_reserve_exact(entries);
            }
        });
        columns_of_task
    }

    /// Adds an entry unless it is zero.
    ///
    /// # Errors
    /// FB306 for a value that is not finite.
    pub(super) fn push(&mut self, row: u32, col: u32, value: f64) -> Result<(), Diagnostic> {
        self.extend(row, col, std::iter::once(value))
    }

    /// Adds consecutive values of a column, beginning at row `first`.
    ///
    /// # Errors
    /// FB306 for a value that is not finite.
    pub(super) fn extend(
        &mut self,
        first: u32,
        col: u32,
        values: impl Iterator<Item = f64>,
    ) -> Result<(), Diagnostic> {
        if self.lengths.last().is_none_or(|(last, _)| *last != col) {
            self.lengths.push((col, 0));
        }
        let before = self.rows.len();
        // The zip in this order does not advance the rows beyond the last value.
        for (value, row) in values.zip(first..) {
            if !value.is_finite() {
                let message = format!("entry ({}, {}) is {value}", row + 1, col + 1);
                return Err(Diagnostic::new(Code::MatrixNotFinite, message));
            }
            if value != 0.0 {
                self.rows.push(row);
                self.values.push(value);
            }
        }
        let added = &self.rows[before..];
        // Rows ascend from the first to the last value.
        self.sides.lower |= added.last().is_some_and(|row| *row > col);
        self.sides.upper |= added.first().is_some_and(|row| *row < col);
        if let Some((_, length)) = self.lengths.last_mut() {
            *length += added.len();
        }
        Ok(())
    }

    /// Adds the columns that follow in the file.
    pub(super) fn append(&mut self, next: &Self) {
        self.lengths.extend_from_slice(&next.lengths);
        self.rows.extend_from_slice(&next.rows);
        self.values.extend_from_slice(&next.values);
        self.sides.lower |= next.sides.lower;
        self.sides.upper |= next.sides.upper;
        self.written = self.written.max(next.written);
    }

    pub(super) fn count(&self) -> usize {
        self.values.len()
    }

    pub(super) fn sides(&self) -> Sides {
        self.sides
    }

    /// Returns all entries in file order.
    pub(super) fn into_entries(self) -> Vec<Entry> {
        let columns = self.lengths.iter().flat_map(|&(col, length)| std::iter::repeat_n(col, length));
        let places = columns.zip(self.rows).zip(self.values);
        places.map(|((col, row), value)| Entry { row, col, value }).collect()
    }

    /// Returns the matrix of `n` rows and columns.
    ///
    /// # Errors
    /// FB309 for an entry given twice, FB312 if there is no nonzero entry.
    pub(super) fn into_matrix(self, n: usize, ascending: bool, path: &Path) -> Result<RawMatrix, Diagnostic> {
        if ascending {
            let columns = ColumnEntries::new(n, &self.lengths, self.rows, self.values);
            return assemble_columns(columns, self.written, path);
        }
        let mut pieces = Vec::new();
        let columns = self.lengths.iter().flat_map(|&(col, length)| std::iter::repeat_n(col, length));
        for ((col, row), value) in columns.zip(self.rows).zip(self.values) {
            push(&mut pieces, Entry { row, col, value });
        }
        assemble_distinct(n, pieces, StoredEntries::Full, self.written, path, |row, column| {
            given_twice(&format!("row {}", row + 1), &format!("column {}", column + 1), path)
        })
    }
}

/// Returns FB304: the file ends within a matrix.
pub(super) fn cut_off(name: &str) -> Diagnostic {
    Diagnostic::new(Code::MatrixCount, format!("the file ends within matrix {name}"))
}
