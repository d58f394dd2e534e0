//! What text and binary files have in common: headers, strings of values, and where they go.

use crate::base::diagnostic::{Code, Diagnostic};
use crate::input::assemble::{Entry, Sides, push};

/// Digits of single precision.
pub(super) const SINGLE_DIGITS: u8 = 7;

/// From this number of rows on, starts of strings do not fit beside their lengths.
const BIG: u64 = 65_536;

/// What a matrix begins with.
#[derive(Debug, Clone)]
pub(super) struct Header {
    pub name: String,
    pub rows: u64,
    pub columns: u64,
    pub form: i64,
    /// 1, 2: real numbers of single and double precision; 3, 4: complex ones.
    pub kind: i64,
    /// Strings have start and length in words of their own.
    pub is_big: bool,
}

impl Header {
    /// From the numbers of a header; a complaint about those of no matrix.
    pub(super) fn new(
        columns: i64,
        rows: i64,
        form: i64,
        kind: i64,
        name: &[u8],
    ) -> Result<Self, Diagnostic> {
        let name: String = String::from_utf8_lossy(name).trim_matches(['\0', ' ']).to_uppercase();
        let is_name = |c: char| c.is_ascii_graphic();
        if columns <= 0
            || rows == 0
            || rows == i64::MIN
            || !(1..=4).contains(&kind)
            || !name.chars().all(is_name)
        {
            let message = format!("header of a matrix says {columns} columns, {rows} rows, type {kind}");
            return Err(Diagnostic::new(Code::MatrixSyntax, message).with_help("write the file again"));
        }
        Ok(Self {
            name,
            rows: rows.unsigned_abs(),
            columns: columns.unsigned_abs(),
            form,
            kind,
            is_big: rows < 0 || rows.unsigned_abs() >= BIG,
        })
    }

    pub(super) fn is_real(&self) -> bool {
        matches!(self.kind, 1 | 2)
    }

    pub(super) fn is_single(&self) -> bool {
        self.kind % 2 == 1
    }

    /// Start and number of words of a string whose two are packed into one number.
    pub(super) fn unpacked(word: i64) -> (i64, i64) {
        let length = (word >> 16) - 1;
        (word - ((length + 1) << 16), length)
    }

    /// Checks a column number: within the matrix, or the one after it, which ends the matrix.
    pub(super) fn column(&self, column: i64) -> Result<Column, Diagnostic> {
        match u64::try_from(column) {
            Ok(column) if column >= 1 && column <= self.columns => Ok(Column::Number(column as u32 - 1)),
            Ok(column) if column == self.columns + 1 => Ok(Column::End),
            _ => {
                let message =
                    format!("matrix {} has {} columns, found column {column}", self.name, self.columns);
                Err(Diagnostic::new(Code::MatrixIndex, message).with_help("write the file again"))
            }
        }
    }

    /// Checks where a string of values lies: its first row, from 0.
    pub(super) fn first_row(&self, row: i64, count: usize) -> Result<u32, Diagnostic> {
        let end = row.checked_add(count as i64 - 1).unwrap_or(i64::MAX);
        if row < 1 || end.unsigned_abs() > self.rows || self.rows > u64::from(u32::MAX) {
            let message = format!("matrix {} has {} rows, found rows {row} to {end}", self.name, self.rows);
            return Err(Diagnostic::new(Code::MatrixIndex, message).with_help("write the file again"));
        }
        Ok(row as u32 - 1)
    }
}

/// What a column record is.
pub(super) enum Column {
    Number(u32),
    End,
}

/// The entries of a matrix.
pub(super) struct Columns {
    pub pieces: Vec<Vec<Entry>>,
    pub count: u64,
    pub sides: Sides,
    /// Digits as written.
    pub written: u8,
}

impl Columns {
    pub(super) fn new(header: &Header) -> Self {
        let written = if header.is_single() { SINGLE_DIGITS } else { 0 };
        Self { pieces: Vec::new(), count: 0, sides: Sides::default(), written }
    }

    /// # Errors
    /// FB306.
    pub(super) fn push(&mut self, row: u32, col: u32, value: f64) -> Result<(), Diagnostic> {
        if !value.is_finite() {
            let message = format!("entry ({}, {}) is {value}", row + 1, col + 1);
            return Err(Diagnostic::new(Code::MatrixNotFinite, message));
        }
        if value != 0.0 {
            self.count += 1;
            self.sides.lower |= row > col;
            self.sides.upper |= row < col;
            push(&mut self.pieces, Entry { row, col, value });
        }
        Ok(())
    }
}

/// FB304.
pub(super) fn cut_off(name: &str) -> Diagnostic {
    Diagnostic::new(Code::MatrixCount, format!("the file ends within matrix {name}"))
}
