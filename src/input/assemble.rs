//! From entries in file order to compressed columns, by counting: the same bits at any number of threads.

use super::digits::significant_digits;
use crate::diagnostic::{Code, Diagnostic};
use crate::linalg::CscMatrix;
use crate::model::RawMatrix;
use rayon::prelude::*;
use std::path::Path;

/// One stored entry, indices from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Entry {
    pub row: u32,
    pub col: u32,
    pub value: f64,
}

/// What the entries of a file stand for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Storage {
    /// All of them.
    Full,
    /// One triangle of a symmetric matrix: every off-diagonal entry stands for two.
    Triangle,
}

/// Whether entries lie below and above the diagonal.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Sides {
    pub lower: bool,
    pub upper: bool,
}

/// Checks a declared size against the number of stored entries, before anything of that size is allocated.
pub(super) fn check_size(rows: u64, cols: u64, entries: u64) -> Result<usize, Diagnostic> {
    if rows != cols {
        return Err(Diagnostic::new(
            Code::MatrixNotSquare,
            format!("matrix has {rows} rows and {cols} columns"),
        ));
    }
    if rows > u64::from(u32::MAX) {
        return Err(Diagnostic::new(Code::MatrixTooLarge, format!("matrix has {rows} rows")));
    }
    // Memory goes with the rows; a file must not be able to ask for it without entries to show.
    if rows > 1_000_000 && rows / 100 > entries {
        let message = format!("matrix declares {rows} rows but stores only {entries} entries");
        return Err(Diagnostic::new(Code::MatrixSyntax, message).with_help("write the matrix again"));
    }
    Ok(rows as usize)
}

/// FB307 for a matrix of which only one triangle is there although its file does not say so.
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

/// Builds the matrix (both triangles) from `pieces` of entries in file order: zeros dropped, duplicates summed in
/// file order. `written` is the largest number of digits as written, see [`significant_digits`].
///
/// # Errors
/// FB306 when a sum of duplicates is not finite, FB312 when nothing but zeros is left.
pub(super) fn assemble(
    n: usize,
    pieces: Vec<Vec<Entry>>,
    storage: Storage,
    written: u8,
    path: &Path,
) -> Result<RawMatrix, Diagnostic> {
    let digits = digits_of(&pieces, written);
    let matrix = compress(n, pieces, storage).map_err(|(row, col)| {
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

/// `Err` holds the entry whose sum is not finite.
fn compress(n: usize, pieces: Vec<Vec<Entry>>, storage: Storage) -> Result<CscMatrix, (u32, u32)> {
    let mirrored = |e: &Entry| storage == Storage::Triangle && e.row != e.col;
    let mut col_ptr = vec![0usize; n + 1];
    for e in pieces.iter().flatten().filter(|e| e.value != 0.0) {
        col_ptr[e.col as usize + 1] += 1;
        if mirrored(e) {
            col_ptr[e.row as usize + 1] += 1;
        }
    }
    for j in 0..n {
        col_ptr[j + 1] += col_ptr[j];
    }
    let mut row_idx = vec![0u32; col_ptr[n]];
    let mut values = vec![0.0f64; col_ptr[n]];
    let mut next = col_ptr[..n].to_vec();
    let mut put = |row: u32, col: u32, value: f64| {
        let at = &mut next[col as usize];
        row_idx[*at] = row;
        values[*at] = value;
        *at += 1;
    };
    for piece in pieces {
        // Each piece is freed as soon as it is spread out.
        for e in piece.iter().filter(|e| e.value != 0.0) {
            put(e.row, e.col, e.value);
            if mirrored(e) {
                put(e.col, e.row, e.value);
            }
        }
    }
    if sort_columns(&col_ptr, &mut row_idx, &mut values) {
        merge_duplicates(&mut col_ptr, &mut row_idx, &mut values)?;
    }
    Ok(CscMatrix::from_parts(n, n, col_ptr, row_idx, values))
}

/// Sorts every column by row, duplicates staying in file order; says whether there are any.
fn sort_columns(col_ptr: &[usize], row_idx: &mut [u32], values: &mut [f64]) -> bool {
    // Blocks of whole columns, each with its share of the entries.
    const BLOCK: usize = 4096;
    let n = col_ptr.len() - 1;
    let mut blocks = Vec::with_capacity(n / BLOCK + 1);
    let (mut rows_left, mut values_left) = (row_idx, values);
    for first in (0..n).step_by(BLOCK) {
        let pointers = &col_ptr[first..=(first + BLOCK).min(n)];
        let share = pointers[pointers.len() - 1] - pointers[0];
        let (rows, rest) = rows_left.split_at_mut(share);
        rows_left = rest;
        let (vals, rest) = values_left.split_at_mut(share);
        values_left = rest;
        blocks.push((pointers, rows, vals));
    }
    let sort_block = |(pointers, rows, vals): (&[usize], &mut [u32], &mut [f64])| {
        let mut duplicates = false;
        let mut scratch: Vec<(u32, f64)> = Vec::new();
        for column in pointers.windows(2) {
            let range = column[0] - pointers[0]..column[1] - pointers[0];
            let (rows, vals) = (&mut rows[range.clone()], &mut vals[range]);
            if rows.is_sorted_by(|a, b| a < b) {
                continue;
            }
            scratch.clear();
            scratch.extend(rows.iter().copied().zip(vals.iter().copied()));
            scratch.sort_by_key(|entry| entry.0); // stable
            for (k, &(row, value)) in scratch.iter().enumerate() {
                rows[k] = row;
                vals[k] = value;
            }
            duplicates |= rows.windows(2).any(|w| w[0] == w[1]);
        }
        duplicates
    };
    blocks.into_par_iter().map(sort_block).reduce(|| false, |a, b| a | b)
}

/// Sums runs of equal rows and drops sums that are zero, in place.
fn merge_duplicates(
    col_ptr: &mut [usize],
    row_idx: &mut Vec<u32>,
    values: &mut Vec<f64>,
) -> Result<(), (u32, u32)> {
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
        let raw = assemble(3, pieces, Storage::Triangle, 17, Path::new("K.mtx")).unwrap();
        let expected = CscMatrix::from_triplets(3, 3, &[(0, 0, 3.0), (2, 1, 3.0), (1, 2, 3.0)]);
        assert_eq!(raw.matrix, expected);
    }

    #[test]
    fn sums_that_overflow_are_refused_by_name() {
        let pieces = vec![entries(&[(1, 0, 1e308), (1, 0, 1e308)])];
        let error = assemble(2, pieces, Storage::Full, 17, Path::new("K.mtx")).unwrap_err();
        assert_eq!(error.code(), Code::MatrixNotFinite);
        assert!(error.message().contains("(2, 1)"), "{error}");
    }

    #[test]
    fn a_header_cannot_ask_for_memory() {
        assert_eq!(check_size(4_000_000_000, 4_000_000_000, 3).unwrap_err().code(), Code::MatrixSyntax);
        assert_eq!(check_size(1 << 40, 1 << 40, 1 << 50).unwrap_err().code(), Code::MatrixTooLarge);
        assert_eq!(check_size(3, 4, 3).unwrap_err().code(), Code::MatrixNotSquare);
        assert_eq!(check_size(1_000_000, 1_000_000, 1), Ok(1_000_000));
    }
}
