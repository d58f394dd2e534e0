//! Compressed columns from entries in file order, by counting. Each task handles some columns and takes their entries
//! in file order, so that the bits are the same for any number of tasks.

use crate::digits::significant_digits;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::memory::{allow_failure, left, refuse_beyond};
use flexbody_linalg::{ColumnBlock, CscMatrix, parallel, split_columns};
use flexbody_model::RawMatrix;
use std::ops::Range;
use std::path::Path;

/// Stored entry with indices from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Entry {
    pub row: u32,
    pub col: u32,
    pub value: f64,
}

/// Part of a matrix that a file stores.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StoredEntries {
    /// All entries of the matrix.
    Full,
    /// One triangle of a symmetric matrix: every off-diagonal entry represents two.
    Triangle,
}

/// Sides of the diagonal on which entries lie.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Sides {
    pub lower: bool,
    pub upper: bool,
}

impl StoredEntries {
    /// Returns the stored part for a file without a declaration: entries on one side alone represent both.
    pub(crate) fn of(sides: Sides) -> Self {
        match sides {
            Sides { lower: true, upper: true } => Self::Full,
            _ => Self::Triangle,
        }
    }
}

/// Largest number of entries per position of a matrix: contributions of many elements may be listed one by one. A
/// larger number lets a compressed file unpack to more; every known file has less than 10.
const MAX_ENTRIES_PER_POSITION: u128 = 64;

/// Number of entries that a matrix of any size may have.
const ALWAYS_ALLOWED_ENTRIES: u64 = 1_000_000;

/// Bytes per entry while a matrix is assembled: as it was read, and in a compressed column.
const BYTES_PER_ENTRY: f64 = (size_of::<Entry>() + size_of::<u32>() + size_of::<f64>()) as f64;

/// Returns the largest number of entries of a matrix with `n` rows.
pub(super) fn most_entries_of(n: u64) -> u64 {
    let places = u128::from(n) * u128::from(n);
    u64::try_from(MAX_ENTRIES_PER_POSITION.saturating_mul(places))
        .unwrap_or(u64::MAX)
        .max(ALWAYS_ALLOWED_ENTRIES)
}

/// Refuses a number of entries that does not fit the memory left.
///
/// # Errors
/// FB601 if they do not fit.
pub(super) fn refuse_beyond_memory(entries: u64) -> Result<(), Diagnostic> {
    let what = format!("a matrix of {entries} entries");
    let refused = refuse_beyond(left(), entries as f64 * BYTES_PER_ENTRY, &what, "use a larger machine");
    refused.map_err(|error| error.first_error().clone())
}

/// Checks a declared size against the number of stored entries, before memory of this size is allocated. Returns the
/// number of rows.
pub fn check_size(rows: u64, cols: u64, entries: u64) -> Result<usize, Diagnostic> {
    if rows != cols {
        return Err(Diagnostic::new(
            Code::MatrixNotSquare,
            format!("matrix has {rows} rows and {cols} columns"),
        ));
    }
    if rows > u64::from(u32::MAX) {
        return Err(Diagnostic::new(Code::MatrixTooLarge, format!("matrix has {rows} rows")));
    }
    // Memory grows with the rows: a file must not request it without entries.
    if rows > 1_000_000 && rows / 100 > entries {
        let message = format!("matrix declares {rows} rows but stores only {entries} entries");
        return Err(Diagnostic::new(Code::MatrixSyntax, message).with_help("write the matrix again"));
    }
    if entries > most_entries_of(rows) {
        let message = format!("matrix of {rows} rows declares {entries} entries");
        return Err(Diagnostic::new(Code::MatrixCount, message).with_help("write the matrix again"));
    }
    Ok(rows as usize)
}

/// Checks the declared size of a matrix that need not be square, as [`check_size`] does for square ones.
pub(super) fn check_extents(rows: u64, cols: u64, entries: u64) -> Result<[usize; 2], Diagnostic> {
    check_size(rows, rows, entries)?;
    check_size(cols, cols, entries.min(most_entries_of(cols)))?;
    refuse_beyond_memory(entries)?;
    Ok([rows as usize, cols as usize])
}

/// Returns FB307 if only one triangle is stored and the file does not declare it; `help` receives the name of the
/// triangle.
pub(super) fn undeclared_triangle(sides: Sides, help: impl FnOnce(&str) -> String) -> Option<Diagnostic> {
    let stored = match sides {
        Sides { lower: true, upper: false } => "lower",
        Sides { lower: false, upper: true } => "upper",
        _ => return None,
    };
    let message =
        format!("only the {stored} triangle is stored, in a file that does not declare the matrix symmetric");
    Some(Diagnostic::new(Code::MatrixAsymmetric, message).with_help(help(stored)))
}

/// Builds the matrix (both triangles) from `pieces` of entries in file order. Zeros are dropped, and duplicates are
/// summed in file order. `written` is the largest number of written digits, see [`significant_digits`].
///
/// # Errors
/// FB306 if a sum of duplicates is not finite, FB312 if no nonzero entry is left.
pub(crate) fn assemble(
    n: usize,
    pieces: Vec<Vec<Entry>>,
    stored: StoredEntries,
    written: u8,
    path: &Path,
) -> Result<RawMatrix, Diagnostic> {
    let digits = digits_of(&pieces, written);
    finish(n, Counted::of(n, pieces, stored).added_up(), digits, path)
}

/// Builds the matrix like [`assemble`], but refuses duplicates: `twice` receives row and column of the first duplicate,
/// by row and then column, and returns its diagnostic. For a triangle the position is the one below the diagonal.
///
/// # Errors
/// The diagnostic from `twice`; FB312 if no nonzero entry is left.
pub(crate) fn assemble_distinct(
    n: usize,
    pieces: Vec<Vec<Entry>>,
    stored: StoredEntries,
    written: u8,
    path: &Path,
    twice: impl FnOnce(u32, u32) -> Diagnostic,
) -> Result<RawMatrix, Diagnostic> {
    let digits = digits_of(&pieces, written);
    match Counted::of(n, pieces, stored).distinct(stored) {
        Ok(matrix) => finish(n, Ok(matrix), digits, path),
        Err((row, col)) => Err(twice(row, col)),
    }
}

/// Returns the diagnostic for an entry that a list of a program gives twice: such lists have every entry once and no count,
/// so that a file written twice into one, or a line too many, shows in nothing else.
pub(crate) fn given_twice(row: &str, column: &str, path: &Path) -> Diagnostic {
    let message = format!("the entry of {row} and {column} is given twice");
    Diagnostic::new(Code::MatrixTriangles, message)
        .in_file(path)
        .with_help("write the file again: it has every entry once")
}

/// Builds the matrix like [`assemble`] from complete columns, in place.
///
/// # Errors
/// The errors of [`assemble`].
pub(super) fn assemble_columns(
    columns: ColumnEntries,
    written: u8,
    path: &Path,
) -> Result<RawMatrix, Diagnostic> {
    let digits = significant_digits(columns.values.len(), written, |k| columns.values[k]);
    finish(columns.counts.len() - 1, columns.compress(), digits, path)
}

/// Returns a complete matrix with its number of significant digits.
///
/// # Errors
/// The errors of [`assemble`].
#[cfg(feature = "hdf5")]
pub(super) fn assembled(matrix: CscMatrix, written: u8, path: &Path) -> Result<RawMatrix, Diagnostic> {
    let digits = significant_digits(matrix.nnz(), written, |k| matrix.values()[k]);
    finish(matrix.n_cols(), Ok(matrix), digits, path)
}

fn finish(
    n: usize,
    matrix: Result<CscMatrix, (u32, u32)>,
    digits: u8,
    path: &Path,
) -> Result<RawMatrix, Diagnostic> {
    let matrix = matrix.map_err(|(row, col)| {
        let message =
            format!("duplicates of entry ({}, {}) add up to a value that is not finite", row + 1, col + 1);
        Diagnostic::new(Code::MatrixNotFinite, message).in_file(path)
    })?;
    if matrix.nnz() == 0 {
        let message = format!("all entries of the {n} x {n} matrix are zero or missing");
        return Err(Diagnostic::new(Code::MatrixEmpty, message).in_file(path));
    }
    Ok(RawMatrix { matrix, digits, path: path.to_path_buf() })
}

fn digits_of(pieces: &[Vec<Entry>], written: u8) -> u8 {
    let mut starts = Vec::with_capacity(pieces.len());
    let mut count = 0;
    for piece in pieces {
        starts.push(count);
        count += piece.len();
    }
    significant_digits(count, written, |k| {
        let piece = starts.partition_point(|&start| start <= k) - 1;
        pieces[piece][k - starts[piece]].value
    })
}

/// Entries in compressed columns, each sorted by row; duplicates stay in file order.
struct Counted {
    col_ptr: Vec<usize>,
    row_idx: Vec<u32>,
    values: Vec<f64>,
    has_duplicates: bool,
}

impl Counted {
    fn of(n: usize, pieces: Vec<Vec<Entry>>, stored: StoredEntries) -> Self {
        let list = List::new(pieces, stored);
        let mut col_ptr = vec![0usize; n + 1];
        let width = n.div_ceil(4 * rayon::current_num_threads()).max(1);
        // Each task counts the entries of its columns.
        parallel::for_each(col_ptr[1..].chunks_mut(width).enumerate(), |(task, counts)| {
            let first = task * width;
            list.visit(first..first + counts.len(), |_, col, _| counts[col - first] += 1);
        });
        add_up(&mut col_ptr);
        let entries = col_ptr[n];
        // Each task then puts the entries of its columns in file order, and sorts the columns.
        let (mut row_idx, mut values) = (vec![0u32; entries], vec![0.0f64; entries]);
        let fill = |block: ColumnBlock<'_>| {
            let (first, end) = (block.columns.start, block.columns.end);
            let start = col_ptr[first];
            let mut next = col_ptr[first..end].to_vec();
            list.visit(first..end, |row, col, value| {
                let at = &mut next[col - first];
                block.rows[*at - start] = row;
                block.values[*at - start] = value;
                *at += 1;
            });
            sort_columns(&col_ptr[first..=end], block.rows, block.values)
        };
        let blocks = split_columns(&col_ptr, &equal_shares(&col_ptr), &mut row_idx, &mut values);
        let has_duplicates = parallel::map(blocks, fill).contains(&true);
        Self { col_ptr, row_idx, values, has_duplicates }
    }

    /// Returns the matrix with summed duplicates. The error is the position of a sum that is not finite.
    fn added_up(self) -> Result<CscMatrix, (u32, u32)> {
        let Self { mut col_ptr, mut row_idx, mut values, has_duplicates } = self;
        if has_duplicates {
            merge_duplicates(&mut col_ptr, &mut row_idx, &mut values)?;
        }
        let n = col_ptr.len() - 1;
        Ok(CscMatrix::from_parts(n, n, col_ptr, row_idx, values))
    }

    /// Returns the matrix if it has no duplicates. The error is the position of the first duplicate, by row and then
    /// column.
    fn distinct(self, stored: StoredEntries) -> Result<CscMatrix, (u32, u32)> {
        if !self.has_duplicates {
            return self.added_up();
        }
        let twice = self.col_ptr.windows(2).zip(0u32..).flat_map(|(ends, col)| {
            let rows = &self.row_idx[ends[0]..ends[1]];
            rows.windows(2).filter(|pair| pair[0] == pair[1]).map(move |pair| (pair[0], col))
        });
        // For a triangle every entry is also in the other triangle.
        let twice = twice.filter(|(row, col)| stored == StoredEntries::Full || row >= col);
        Err(twice.min().expect("duplicates were found"))
    }
}

/// Adds an entry to the last piece, or begins a new one. Small pieces cover few columns, so that most tasks skip them.
pub(super) fn push(pieces: &mut Vec<Vec<Entry>>, entry: Entry) {
    const ENTRIES_PER_PIECE: usize = 1 << 15;
    match pieces.last_mut() {
        Some(piece) if piece.len() < ENTRIES_PER_PIECE => piece.push(entry),
        _ => {
            let mut piece = Vec::with_capacity(ENTRIES_PER_PIECE);
            piece.push(entry);
            pieces.push(piece);
        }
    }
}

/// Entries that come column by column, without zeros, in any order within a column.
pub(super) struct ColumnEntries {
    /// Number of entries of column j, at index j + 1.
    counts: Vec<usize>,
    row_idx: Vec<u32>,
    values: Vec<f64>,
}

impl ColumnEntries {
    /// Creates an empty list for `n` columns, with capacity for about `entries`.
    pub(super) fn with_capacity(n: usize, entries: usize) -> Self {
        let (mut row_idx, mut values) = (Vec::new(), Vec::new());
        // The number comes from a file. Without memory for it the lists grow as needed.
        allow_failure(|| {
            if row_idx.try_reserve_exact(entries).is_ok() {
                let _ = values.try_reserve_exact(entries);
            }
        });
        Self { counts: vec![0; n + 1], row_idx, values }
    }

    /// Creates the list of `n` columns. `lengths` holds each column with entries and their number, in ascending order.
    pub(super) fn new(n: usize, lengths: &[(u32, usize)], row_idx: Vec<u32>, values: Vec<f64>) -> Self {
        let mut counts = vec![0; n + 1];
        lengths.iter().for_each(|&(column, length)| counts[column as usize + 1] = length);
        Self { counts, row_idx, values }
    }

    /// Adds an entry to its column. Columns must come in ascending order.
    pub(super) fn push(&mut self, entry: Entry) {
        self.counts[entry.col as usize + 1] += 1;
        self.row_idx.push(entry.row);
        self.values.push(entry.value);
    }

    /// Returns the entries one by one.
    #[cfg(feature = "hdf5")]
    pub(super) fn into_entries(self) -> Vec<Vec<Entry>> {
        let mut entries = Vec::new();
        let mut at = 0;
        for (col, &count) in self.counts[1..].iter().enumerate() {
            for k in at..at + count {
                let entry = Entry { row: self.row_idx[k], col: col as u32, value: self.values[k] };
                push(&mut entries, entry);
            }
            at += count;
        }
        entries
    }

    /// Sorts the columns and sums duplicates. The error is the position of a sum that is not finite.
    fn compress(self) -> Result<CscMatrix, (u32, u32)> {
        let Self { counts: mut col_ptr, mut row_idx, mut values } = self;
        add_up(&mut col_ptr);
        let n = col_ptr.len() - 1;
        let cuts = equal_shares(&col_ptr);
        let blocks = split_columns(&col_ptr, &cuts, &mut row_idx, &mut values);
        let sort =
            |b: ColumnBlock<'_>| sort_columns(&col_ptr[b.columns.start..=b.columns.end], b.rows, b.values);
        if parallel::map(blocks, sort).contains(&true) {
            merge_duplicates(&mut col_ptr, &mut row_idx, &mut values)?;
        }
        Ok(CscMatrix::from_parts(n, n, col_ptr, row_idx, values))
    }
}

/// Turns the numbers of entries of columns j, at j + 1, into column pointers.
fn add_up(counts: &mut [usize]) {
    for j in 1..counts.len() {
        counts[j] += counts[j - 1];
    }
}

/// Cuts the columns into four parts per thread, with about equal numbers of entries.
fn equal_shares(col_ptr: &[usize]) -> Vec<usize> {
    let (n, parts) = (col_ptr.len() - 1, 4 * rayon::current_num_threads());
    let cut = |part: usize| col_ptr.partition_point(|&p| p < col_ptr[n] / parts * part).min(n);
    (0..parts).map(cut).chain([n]).collect()
}

/// All entries of a file.
struct List {
    pieces: Vec<Vec<Entry>>,
    /// First and last column of the entries of each piece.
    extents: Vec<(u32, u32)>,
    mirror: bool,
}

impl List {
    fn new(pieces: Vec<Vec<Entry>>, stored: StoredEntries) -> Self {
        let mirror = stored == StoredEntries::Triangle;
        let extent = |piece: &Vec<Entry>| {
            piece.iter().fold((u32::MAX, 0), |(low, high): (u32, u32), e| {
                let other = if mirror { e.row } else { e.col };
                (low.min(e.col).min(other), high.max(e.col).max(other))
            })
        };
        let extents = parallel::map(&pieces, extent);
        Self { pieces, extents, mirror }
    }

    /// Calls `take` with row, column and value of every nonzero entry of `columns`, in file order.
    fn visit(&self, columns: Range<usize>, mut take: impl FnMut(u32, usize, f64)) {
        let (start, len) = (columns.start as u32, columns.len() as u32);
        let here = |column: u32| column.wrapping_sub(start) < len;
        for (piece, &(low, high)) in self.pieces.iter().zip(&self.extents) {
            if high < start || low as usize >= columns.end {
                continue;
            }
            for e in piece.iter().filter(|e| e.value != 0.0) {
                if here(e.col) {
                    take(e.row, e.col as usize, e.value);
                }
                if self.mirror && e.row != e.col && here(e.row) {
                    take(e.col, e.row as usize, e.value);
                }
            }
        }
    }
}

/// Sorts every column by row, with duplicates in file order. Returns true when there are duplicates. `pointers` are the
/// column pointers of the entries in `rows` and `values`.
fn sort_columns(pointers: &[usize], rows: &mut [u32], values: &mut [f64]) -> bool {
    let mut duplicates = false;
    let mut scratch: Vec<(u32, f64)> = Vec::new();
    for column in pointers.windows(2) {
        let range = column[0] - pointers[0]..column[1] - pointers[0];
        let (rows, values) = (&mut rows[range.clone()], &mut values[range]);
        if rows.is_sorted_by(|a, b| a < b) {
            continue;
        }
        scratch.clear();
        scratch.extend(rows.iter().copied().zip(values.iter().copied()));
        scratch.sort_by_key(|entry| entry.0); // stable
        for (k, &(row, value)) in scratch.iter().enumerate() {
            rows[k] = row;
            values[k] = value;
        }
        duplicates |= rows.windows(2).any(|w| w[0] == w[1]);
    }
    duplicates
}

/// Sums runs of equal rows and drops sums that are zero, in place. The error is the position of a sum that is not
/// finite.
fn merge_duplicates(
    col_ptr: &mut [usize],
    row_idx: &mut Vec<u32>,
    values: &mut Vec<f64>,
) -> Result<(), (u32, u32)> {
    // Entries are read at `from` and written at `to`, which never passes it.
    let (mut from, mut to) = (0, 0);
    for j in 0..col_ptr.len() - 1 {
        let end = col_ptr[j + 1];
        while from < end {
            let row = row_idx[from];
            let mut sum = values[from];
            from += 1;
            while from < end && row_idx[from] == row {
                sum += values[from];
                from += 1;
            }
            if !sum.is_finite() {
                return Err((row, j as u32));
            }
            if sum != 0.0 {
                row_idx[to] = row;
                values[to] = sum;
                to += 1;
            }
        }
        col_ptr[j + 1] = to;
    }
    row_idx.truncate(to);
    values.truncate(to);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(list: &[(u32, u32, f64)]) -> Vec<Entry> {
        list.iter().map(|&(row, col, value)| Entry { row, col, value }).collect()
    }

    #[test]
    fn a_triangle_stands_for_both_and_duplicates_add_up_in_file_order() {
        // 1e16 + 1 - 1e16 is 0 from the left, 1 in another order.
        let pieces = vec![
            entries(&[(2, 0, 1e16), (0, 0, 3.0), (1, 1, 0.0)]),
            entries(&[(2, 0, 1.0), (2, 1, 5.0), (2, 0, -1e16), (2, 1, -2.0)]),
        ];
        let raw = assemble(3, pieces, StoredEntries::Triangle, 17, Path::new("K.mtx")).unwrap();
        let expected = CscMatrix::from_triplets(3, 3, &[(0, 0, 3.0), (2, 1, 3.0), (1, 2, 3.0)]);
        assert_eq!(raw.matrix, expected);
    }

    /// Returns entries of a lower triangle in random order, with zeros and with duplicates whose sums depend on their
    /// order.
    fn disordered(n: u32, count: u32) -> Vec<Entry> {
        let at = |k: u32| k.wrapping_mul(2_654_435_761) >> 7;
        let place = |k: u32| (at(k) % n, at(k + count) % n);
        let value = |k: u32| if k.is_multiple_of(11) { 0.0 } else { (f64::from(k) * 1e3).sin() };
        (0..count)
            .map(|k| {
                let (a, b) = place(if k % 3 == 2 { k - 1 } else { k }); // every third is a duplicate
                Entry { row: a.max(b), col: a.min(b), value: value(k) }
            })
            .collect()
    }

    #[test]
    fn entries_in_any_order_are_put_where_they_belong_and_summed_in_file_order() {
        const N: u32 = 3000;
        let list = disordered(N, 40_000);
        let mut both = Vec::new();
        for e in &list {
            both.push((e.row, e.col, e.value));
            if e.row != e.col {
                both.push((e.col, e.row, e.value));
            }
        }
        let n = N as usize;
        let expected = CscMatrix::from_triplets(n, n, &both);
        let pieces: Vec<Vec<Entry>> = list.chunks(777).map(<[Entry]>::to_vec).collect();
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let raw =
                pool.install(|| assemble(n, pieces.clone(), StoredEntries::Triangle, 17, Path::new("K.mtx")));
            assert_eq!(raw.unwrap().matrix, expected, "{threads} threads");
        }
        // Column by column, as in binary files, the matrix must be equal.
        let mut ordered: Vec<Entry> = list.into_iter().filter(|e| e.value != 0.0).collect();
        ordered.sort_by_key(|e| e.col);
        let columns = || {
            let mut columns = ColumnEntries::with_capacity(n, ordered.len());
            ordered.iter().for_each(|&e| columns.push(e));
            columns
        };
        let lower: Vec<_> = ordered.iter().map(|e| (e.row, e.col, e.value)).collect();
        let full = assemble_columns(columns(), 17, Path::new("K.h5")).unwrap();
        assert_eq!(full.matrix, CscMatrix::from_triplets(n, n, &lower));
        let mirrored = assemble(n, columns().into_entries(), StoredEntries::Triangle, 17, Path::new("K.h5"));
        assert_eq!(mirrored.unwrap().matrix, expected);
    }

    #[test]
    fn sums_that_overflow_are_refused_by_name() {
        let pieces = vec![entries(&[(1, 0, 1e308), (1, 0, 1e308)])];
        let error = assemble(2, pieces, StoredEntries::Full, 17, Path::new("K.mtx")).unwrap_err();
        assert_eq!(error.code(), Code::MatrixNotFinite);
        assert!(error.message().contains("(2, 1)"), "{error}");
    }

    #[test]
    fn a_header_cannot_ask_for_memory() {
        assert_eq!(check_size(4_000_000_000, 4_000_000_000, 3).unwrap_err().code(), Code::MatrixSyntax);
        assert_eq!(check_size(1 << 40, 1 << 40, 1 << 50).unwrap_err().code(), Code::MatrixTooLarge);
        assert_eq!(check_size(3, 4, 3).unwrap_err().code(), Code::MatrixNotSquare);
        assert_eq!(check_size(1_000_000, 1_000_000, 1), Ok(1_000_000));
        assert_eq!(check_size(12, 12, 1_000_001).unwrap_err().code(), Code::MatrixCount);
        assert_eq!(check_size(1000, 1000, 64_000_000), Ok(1000));
    }
}
