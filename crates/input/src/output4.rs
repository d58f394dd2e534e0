//! Matrices that Nastran writes with OUTPUT4: as text or binary, dense or as strings of nonzeros (with starts packed
//! into their lengths, or in separate words: BIGMAT).

mod binary;
mod text;

use super::assemble::{check_extents, check_size, given_twice, undeclared_triangle};
use super::named_matrices::{choose, named_or_only};
use super::reader::{MatrixSource, Reader};
use super::recovery_files::Rectangular;
use crate::assemble::{
    ColumnEntries, Entry, Sides, StoredEntries, assemble_columns, assemble_distinct, push,
};
use binary::Binary;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::memory::allow_failure;
use flexbody_base::text::{Compression, InputFile};
use flexbody_linalg::parallel;
use flexbody_model::RawMatrix;
use std::ops::Range;
use std::path::Path;
use text::Format;

/// Number of digits with which OUTPUT4 writes single-precision numbers as text.
const PADDED_DIGITS: u8 = 10;

/// Reader of OUTPUT4 files.
pub(super) struct Output4;

impl Reader for Output4 {
    fn name(&self) -> &'static str {
        "OUTPUT4"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["op4"]
    }

    fn recognises(&self, head: &[u8]) -> bool {
        Binary::of(head).is_some() || text::begins(head)
    }

    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix> {
        let path = source.file.path();
        if source.compression != Compression::None {
            let message = "OUTPUT4 file is compressed as a whole";
            let diagnostic = Diagnostic::new(Code::FileFormatUnknown, message).in_file(path);
            return Err(diagnostic.with_help("unpack it").into());
        }
        let read = || {
            let contents = Contents::of(source.file)?;
            contents.matrix(source.file, choose(&contents.names(), source.role, source.group)?)
        };
        read().map_err(|found: Diagnostic| Error::from(found.in_file(path)))
    }
}

type Found<T> = std::result::Result<T, Diagnostic>;

/// Matrices of a file, in its order.
pub(super) struct Contents {
    matrices: Vec<(Stored, Encoding)>,
}

/// Encoding of the columns of a matrix.
#[derive(Clone, Copy)]
enum Encoding {
    Text(Format),
    Binary(Binary),
}

impl Contents {
    /// Scans a file without reading a value.
    ///
    /// # Errors
    /// FB301 for a file that is no OUTPUT4 file, FB303, FB304 for files that are cut off.
    pub(super) fn of(file: &InputFile) -> Found<Self> {
        let matrices = match Binary::of(file.bytes()) {
            Some(binary) => {
                let all = binary.contents(file)?.into_iter();
                all.map(|stored| (stored, Encoding::Binary(binary))).collect()
            }
            None => {
                let all = text::contents(file)?.into_iter();
                all.map(|(stored, format)| (stored, Encoding::Text(format))).collect()
            }
        };
        Ok(Self { matrices })
    }

    /// Returns the names of the matrices.
    pub(super) fn names(&self) -> Vec<String> {
        self.matrices.iter().map(|(stored, _)| stored.header.name.clone()).collect()
    }

    /// Returns the number of rows of a square matrix with entries; `None` for another matrix.
    pub(super) fn square(&self, at: usize) -> Option<usize> {
        let (stored, _) = self.matrices.get(at)?;
        let is_square = stored.header.rows == stored.header.columns && stored.values > 0;
        usize::try_from(stored.header.rows).ok().filter(|_| is_square)
    }

    /// Returns a matrix that need not be square; `file` must be the file that was scanned.
    ///
    /// # Errors
    /// FB301 for text that cannot be parsed, FB302 for complex matrices and other forms, FB303 for rows outside the
    /// matrix, FB306 for values that are not finite, FB313 for more entries than memory holds.
    fn rectangular(&self, file: &InputFile, wanted: usize) -> Found<Rectangular> {
        let (stored, encoding) = &self.matrices[wanted];
        let header = &stored.header;
        let about = |diagnostic: Diagnostic| diagnostic.about(&header.name);
        let refuse = |message: String, help: &str| {
            Err(about(Diagnostic::new(Code::MatrixKind, message).with_help(help)))
        };
        if !header.is_real() {
            let message = format!("type {} is complex", header.kind);
            return refuse(message, "write real matrices, without structural damping");
        }
        if !matches!(header.form, 1 | 2 | 6) {
            let message = format!("form {} is not that of a matrix with all its entries", header.form);
            return refuse(message, "write a matrix of form 2: forms are 1, 2 and 6");
        }
        let columns = columns(file, stored, *encoding)?;
        let extents = check_extents(header.rows, header.columns, columns.count() as u64).map_err(about)?;
        Ok(Rectangular { rows: extents[0], columns: extents[1], entries: columns.into_entries() })
    }

    /// Returns the matrix with this index; `file` must be the file that was scanned.
    ///
    /// # Errors
    /// FB301 for text that cannot be parsed, FB302 for complex and other matrices, FB303 for rows outside the matrix,
    /// FB305 for a matrix that is not square, FB306 for values that are not finite, FB307 for a single triangle, FB312
    /// if there is no nonzero entry.
    pub(super) fn matrix(&self, file: &InputFile, wanted: usize) -> Found<RawMatrix> {
        let Some((stored, encoding)) = self.matrices.get(wanted) else {
            return Err(Diagnostic::new(Code::MatrixSyntax, "the matrix is not in the file"));
        };
        let header = &stored.header;
        let about = |diagnostic: Diagnostic| diagnostic.about(&header.name);
        if !header.is_real() {
            let message = format!("type {} is complex", header.kind);
            let help = "write real matrices, without structural damping";
            return Err(about(Diagnostic::new(Code::MatrixKind, message).with_help(help)));
        }
        let columns = columns(file, stored, *encoding)?;
        if !matches!(header.form, 1 | 2 | 6) {
            let message = format!("form {} is not that of a symmetric matrix", header.form);
            return Err(about(
                Diagnostic::new(Code::MatrixKind, message)
                    .with_help("write a matrix of form 6: forms are 1, 2 and 6"),
            ));
        }
        let n = check_size(header.rows, header.columns, columns.count() as u64).map_err(about)?;
        let triangle = undeclared_triangle(columns.sides(), |_| "write the whole matrix".into());
        if let Some(triangle) = triangle {
            return Err(about(triangle));
        }
        let written = columns.written;
        let raw = columns.into_matrix(n, stored.ascending, file.path())?;
        // Nastran with words of eight bytes also declares single precision, but writes all digits of its numbers.
        let is_single = header.is_single() && written <= PADDED_DIGITS;
        let digits = if is_single { raw.digits.min(SINGLE_DIGITS) } else { raw.digits };
        Ok(RawMatrix { digits, ..raw })
    }
}

/// Reads the matrix `name`, or the only one of the file, which need not be square.
///
/// # Errors
/// FB310 if there is no such matrix, the errors of [`Contents::of`] and of the matrix.
pub(super) fn read_rectangular(file: &InputFile, name: Option<&str>) -> Found<Rectangular> {
    let contents = Contents::of(file)?;
    let wanted = named_or_only(&contents.names(), name)?;
    contents.rectangular(file, wanted)
}

/// Reads all columns of a matrix. Groups of stretches are read in parallel and joined in the order of the file before
/// the next group, so that the entries are in memory once.
fn columns(file: &InputFile, stored: &Stored, encoding: Encoding) -> Found<Columns> {
    let at_once = 8 * rayon::current_num_threads();
    let mut all = Columns::with_capacity(stored.values);
    for stretches in stored.stretches.chunks(at_once) {
        let read = |stretch: &Stretch| {
            let bytes = &file.bytes()[stretch.bytes.clone()];
            match encoding {
                Encoding::Text(format) => text::columns(bytes, stretch.line, &stored.header, format),
                Encoding::Binary(binary) => binary.columns(bytes, &stored.header),
            }
        };
        for columns in parallel::try_map(stretches, read)? {
            all.append(&columns);
        }
    }
    Ok(all)
}

// The common parts of text and binary files: headers, strings of values, and the collected columns.

/// Number of digits of single precision.
const SINGLE_DIGITS: u8 = 7;

/// Number of rows from which on the start of a string does not fit into one word with its length.
const MIN_ROWS_OF_TWO_WORDS: u64 = 65_536;

/// Header of a matrix.
#[derive(Debug, Clone)]
struct Header {
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
    fn new(
        columns: i64,
        rows: i64,
        form: i64,
        kind: i64,
        name: &[u8],
    ) -> std::result::Result<Self, Diagnostic> {
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
    fn name_of_wide_words(name: &[u8]) -> Vec<u8> {
        let letters = |word: &[u8]| match word.split_at_checked(4) {
            Some((four, rest)) if unpadded(rest).is_empty() => four.to_vec(),
            _ => word.to_vec(),
        };
        name.chunks(8).flat_map(letters).collect()
    }

    fn is_real(&self) -> bool {
        matches!(self.kind, 1 | 2)
    }

    fn is_single(&self) -> bool {
        self.kind % 2 == 1
    }

    /// Returns start and number of words of a string, which are packed into one number.
    fn unpacked(word: i64) -> (i64, i64) {
        let length = (word >> 16) - 1;
        (word - ((length + 1) << 16), length)
    }

    /// Checks a column number: it is within the matrix, or the next one, which ends the matrix.
    fn column(&self, column: i64) -> std::result::Result<ColumnRecord, Diagnostic> {
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
    fn first_row(&self, row: i64, count: usize) -> std::result::Result<u32, Diagnostic> {
        let end = row.checked_add(count as i64 - 1).unwrap_or(i64::MAX);
        if row < 1 || end.unsigned_abs() > self.rows || self.rows > u64::from(u32::MAX) {
            let message = format!("matrix {} has {} rows, found rows {row} to {end}", self.name, self.rows);
            return Err(Diagnostic::new(Code::MatrixIndex, message).with_help("write the file again"));
        }
        Ok(row as u32 - 1)
    }
}

/// Returns a name without the blanks and zero bytes that pad its field.
fn unpadded(name: &[u8]) -> &[u8] {
    let fills = |b: &u8| b.is_ascii_whitespace() || *b == 0;
    let start = name.iter().position(|b| !fills(b)).unwrap_or(name.len());
    let end = name.iter().rposition(|b| !fills(b)).map_or(start, |last| last + 1);
    &name[start..end]
}

/// Kind of a column record.
enum ColumnRecord {
    Number(u32),
    End,
}

/// Positions of the columns of a matrix in its file, found from the lengths in the file before any value is read.
struct Stored {
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
struct Stretch {
    pub bytes: Range<usize>,
    pub line: usize,
}

impl Stored {
    /// Bytes of columns that one thread reads at a time.
    const BYTES_PER_TASK: usize = 1 << 20;

    fn new(header: Header) -> Self {
        Self { header, stretches: Vec::new(), values: 0, ascending: true, last: None }
    }

    /// Adds a column with at most `values` values in the given bytes, below `line` lines.
    fn add(&mut self, column: u32, values: usize, bytes: Range<usize>, line: usize) {
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
struct Columns {
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
    fn with_capacity(entries: usize) -> Self {
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
    fn push(&mut self, row: u32, col: u32, value: f64) -> std::result::Result<(), Diagnostic> {
        self.extend(row, col, std::iter::once(value))
    }

    /// Adds consecutive values of a column, beginning at row `first`.
    ///
    /// # Errors
    /// FB306 for a value that is not finite.
    fn extend(
        &mut self,
        first: u32,
        col: u32,
        values: impl Iterator<Item = f64>,
    ) -> std::result::Result<(), Diagnostic> {
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
    fn append(&mut self, next: &Self) {
        self.lengths.extend_from_slice(&next.lengths);
        self.rows.extend_from_slice(&next.rows);
        self.values.extend_from_slice(&next.values);
        self.sides.lower |= next.sides.lower;
        self.sides.upper |= next.sides.upper;
        self.written = self.written.max(next.written);
    }

    fn count(&self) -> usize {
        self.values.len()
    }

    fn sides(&self) -> Sides {
        self.sides
    }

    /// Returns all entries in file order.
    fn into_entries(self) -> Vec<Entry> {
        let columns = self.lengths.iter().flat_map(|&(col, length)| std::iter::repeat_n(col, length));
        let places = columns.zip(self.rows).zip(self.values);
        places.map(|((col, row), value)| Entry { row, col, value }).collect()
    }

    /// Returns the matrix of `n` rows and columns.
    ///
    /// # Errors
    /// FB309 for an entry given twice, FB312 if there is no nonzero entry.
    fn into_matrix(
        self,
        n: usize,
        ascending: bool,
        path: &Path,
    ) -> std::result::Result<RawMatrix, Diagnostic> {
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
fn cut_off(name: &str) -> Diagnostic {
    Diagnostic::new(Code::MatrixCount, format!("the file ends within matrix {name}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use flexbody_linalg::CscMatrix;
    use std::fmt::Write;

    const N: usize = 3000;
    const BAND: usize = 16;

    /// Returns the band of a column: its first row, and its values, which are symmetric and have all digits.
    fn column(j: usize) -> (usize, Vec<f64>) {
        let (first, end) = (j.saturating_sub(BAND), (j + BAND + 1).min(N));
        (first, (first..end).map(|i| ((i * j) as f64).sqrt() + (i + j) as f64 + 1.0).collect())
    }

    fn expected() -> CscMatrix {
        let entries = |j: usize| {
            let (first, values) = column(j);
            values.into_iter().enumerate().map(move |(k, value)| ((first + k) as u32, j as u32, value))
        };
        CscMatrix::from_triplets(N, N, &(0..N).flat_map(entries).collect::<Vec<_>>())
    }

    /// Returns the matrix as text, with its columns in the given order.
    fn text(order: impl Iterator<Item = usize>) -> String {
        let mut text = format!("{N:8}{:8}{:8}{:8}{:8}1P,3E24.16\n", -(N as i64), 6, 2, "KGG");
        for j in order {
            let (first, values) = column(j);
            writeln!(text, "{:8}{:8}{:8}", j + 1, 0, 2 * values.len() + 2).expect("memory");
            writeln!(text, "{:8}{:8}", 2 * values.len() + 1, first + 1).expect("memory");
            for three in values.chunks(3) {
                three.iter().for_each(|value| write!(text, "{value:24.16E}").expect("memory"));
                text.push('\n');
            }
        }
        write!(text, "{:8}{:8}{:8}\n{:24.16E}\n", N + 1, 1, 1, 2f64.sqrt()).expect("memory");
        text
    }

    fn binary() -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut record = |words: &[i32], name: &[u8], values: &[f64]| {
            let mut payload: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
            payload.extend_from_slice(name);
            payload.extend(values.iter().flat_map(|value| value.to_le_bytes()));
            let length = (payload.len() as i32).to_le_bytes();
            bytes.extend([&length[..], &payload, &length].concat());
        };
        let n = N as i32;
        record(&[n, -n, 6, 2], b"KGG     ", &[]);
        for j in 0..N {
            let (first, values) = column(j);
            let words = 2 * values.len() as i32;
            record(&[j as i32 + 1, 0, words + 2, words + 1, first as i32 + 1], b"", &values);
        }
        record(&[n + 1, 1, 2], b"", &[2f64.sqrt()]);
        bytes
    }

    fn read(bytes: &[u8], threads: usize) -> Found<RawMatrix> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("job.op4");
        std::fs::write(&path, bytes).expect("written");
        let file = InputFile::open(&path).expect("a file");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| Contents::of(&file)?.matrix(&file, 0))
    }

    #[test]
    fn a_matrix_of_many_stretches_is_the_same_on_any_number_of_threads_and_in_any_order_of_columns() {
        let (expected, upright, reversed) = (expected(), text(0..N), text((0..N).rev()));
        assert!(upright.len() > 2 << 20, "more than two stretches");
        for threads in [1, 3] {
            for bytes in [upright.as_bytes(), reversed.as_bytes(), &binary()] {
                let raw = read(bytes, threads).expect("read");
                assert_eq!((&raw.matrix, raw.digits), (&expected, 17));
            }
        }
    }

    #[test]
    fn a_bad_number_is_told_with_its_line_in_the_whole_file() {
        let text = text(0..N);
        let lines: Vec<&str> = text.lines().collect();
        // The first line of values of the last column but one.
        let bad = lines.len() - 2 - 2 * (2 + (BAND + 1).div_ceil(3)) + 2;
        for (number, code) in [("x", Code::MatrixSyntax), ("NaN", Code::MatrixNotFinite)] {
            let mut lines = lines.clone();
            let changed = lines[bad].replace(&lines[bad][..24], &format!("{number:>24}"));
            lines[bad] = &changed;
            for threads in [1, 3] {
                let found = read((lines.join("\n") + "\n").as_bytes(), threads).expect_err("refused");
                assert_eq!((found.code(), found.line()), (code, Some(bad + 1)), "{found}");
            }
        }
    }

    #[test]
    fn a_line_that_is_too_short_is_told_with_its_line_in_the_whole_file() {
        let text = text(0..N);
        let line = text.lines().count() - 4;
        let short: Vec<&str> = text
            .lines()
            .enumerate()
            .map(|(k, text_of_line)| if k == line { &text_of_line[..30] } else { text_of_line })
            .collect();
        let found = read(short.join("\n").as_bytes(), 2).expect_err("refused");
        assert_eq!((found.code(), found.line()), (Code::MatrixSyntax, Some(line + 1)), "{found}");
    }
}
