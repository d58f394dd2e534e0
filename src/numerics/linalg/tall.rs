//! Products of tall, skinny blocks (n x m, n large) with fixed partitions: partial results of fixed row
//! chunks are added in a fixed order, so that the bits do not depend on the number of threads.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use rayon::prelude::*;

/// Rows per partial product.
const ROWS: usize = 4096;

/// A' B (m x k) of tall blocks A (n x m) and B (n x k).
///
/// # Panics
/// When the row counts differ.
pub fn gram(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    assert_eq!(a.nrows(), b.nrows(), "rows of a Gram product");
    let n = a.nrows();
    let chunks = n.div_ceil(ROWS).max(1);
    let partial: Vec<Mat<f64>> = (0..chunks)
        .into_par_iter()
        .map(|chunk| {
            let start = chunk * ROWS;
            let rows = ROWS.min(n - start);
            let mut part = Mat::zeros(a.ncols(), b.ncols());
            matmul(
                part.as_mut(),
                Accum::Replace,
                a.subrows(start, rows).transpose(),
                b.subrows(start, rows),
                1.0,
                Par::Seq,
            );
            part
        })
        .collect();
    sum_pairwise(&partial)
}

/// a_j' b_j for the columns of equal-shaped blocks A and B (n x m).
///
/// # Panics
/// When the shapes differ.
pub fn column_products(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Vec<f64> {
    assert_eq!(a.ncols(), b.ncols(), "columns of a product by columns");
    (0..a.ncols()).map(|j| gram(a.subcols(j, 1), b.subcols(j, 1))[(0, 0)]).collect()
}

/// Sum of equal-shaped matrices, pairwise: error grows with the logarithm of their number.
fn sum_pairwise(parts: &[Mat<f64>]) -> Mat<f64> {
    match parts {
        [] => Mat::zeros(0, 0),
        [one] => one.clone(),
        _ => {
            let (left, right) = parts.split_at(parts.len() / 2);
            sum_pairwise(left) + sum_pairwise(right)
        }
    }
}

/// W -= V H for tall V (n x m), W (n x k) and small H (m x k).
///
/// # Panics
/// When the shapes disagree.
pub fn subtract_combination(w: MatMut<'_, f64>, v: MatRef<'_, f64>, h: MatRef<'_, f64>) {
    add_product(w, Accum::Add, v, h, -1.0);
}

/// W += V H for tall V (n x m), W (n x k) and small H (m x k).
///
/// # Panics
/// When the shapes disagree.
pub fn add_combination(w: MatMut<'_, f64>, v: MatRef<'_, f64>, h: MatRef<'_, f64>) {
    add_product(w, Accum::Add, v, h, 1.0);
}

/// V H (n x k) for tall V (n x m) and small H (m x k).
///
/// # Panics
/// When the shapes disagree.
pub fn combine(v: MatRef<'_, f64>, h: MatRef<'_, f64>) -> Mat<f64> {
    let mut out = Mat::zeros(v.nrows(), h.ncols());
    combine_into(out.as_mut(), v, h);
    out
}

/// W = V H for tall V (n x m), W (n x k) and small H (m x k).
///
/// # Panics
/// When the shapes disagree.
pub fn combine_into(w: MatMut<'_, f64>, v: MatRef<'_, f64>, h: MatRef<'_, f64>) {
    add_product(w, Accum::Replace, v, h, 1.0);
}

/// The columns of all blocks, in their order.
///
/// # Panics
/// When the row counts differ.
pub fn side_by_side(blocks: &[MatRef<'_, f64>]) -> Mat<f64> {
    let n = blocks.first().map_or(0, |block| block.nrows());
    assert!(blocks.iter().all(|block| block.nrows() == n), "rows of blocks side by side");
    let columns: Vec<_> = blocks.iter().flat_map(|block| block.col_iter()).collect();
    Mat::from_fn(n, columns.len(), |i, j| columns[j][i])
}

fn add_product(w: MatMut<'_, f64>, accum: Accum, v: MatRef<'_, f64>, h: MatRef<'_, f64>, alpha: f64) {
    assert!(w.nrows() == v.nrows() && v.ncols() == h.nrows() && w.ncols() == h.ncols(), "tall product");
    let chunks = w.nrows().div_ceil(ROWS);
    split_rows(w, chunks).into_par_iter().enumerate().for_each(|(chunk, part)| {
        let rows = part.nrows();
        matmul(part, accum, v.subrows(chunk * ROWS, rows), h, alpha, Par::Seq);
    });
}

/// Cuts a block into `chunks` pieces of [`ROWS`] rows (the last one shorter).
fn split_rows(mut w: MatMut<'_, f64>, chunks: usize) -> Vec<MatMut<'_, f64>> {
    let mut pieces = Vec::with_capacity(chunks);
    for _ in 0..chunks {
        let rows = ROWS.min(w.nrows());
        let (head, tail) = w.split_at_row_mut(rows);
        pieces.push(head);
        w = tail;
    }
    pieces
}
