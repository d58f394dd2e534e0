//! Mode shapes of two bodies with common nodes.

use super::relative_difference::relative;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use nalgebra::Matrix3;
use std::collections::HashMap;
use std::ops::Range;

/// Returns A B, computed on one thread so that the bits do not depend on the number of threads.
pub(super) fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut c = Mat::zeros(a.nrows(), b.ncols());
    matmul(&mut c, Accum::Replace, a, b, 1.0, Par::Seq);
    c
}

/// Returns shapes (3n x nf) with the nodes in the given order and components along the given axes.
pub(super) fn turned(shapes: MatRef<'_, f64>, axes: &Matrix3<f64>, order: &[usize]) -> Mat<f64> {
    Mat::from_fn(3 * order.len(), shapes.ncols(), |row, p| {
        let (node, k) = (order[row / 3], row % 3);
        (0..3).map(|l| axes[(l, k)] * shapes[(3 * node + l, p)]).sum()
    })
}

/// Returns the index into `b` of each node of `a`; `None` if the node numbers differ.
pub(super) fn common_nodes(a: &[i64], b: &[i64]) -> Option<Vec<usize>> {
    let places: HashMap<i64, usize> = b.iter().enumerate().map(|(i, &id)| (id, i)).collect();
    (a.len() == b.len()).then(|| a.iter().map(|id| places.get(id).copied()).collect()).flatten()
}

/// Returns |A - B|_F / |A|_F of a group of columns.
pub(super) fn shape_difference(a: MatRef<'_, f64>, b: MatRef<'_, f64>, group: &Range<usize>) -> f64 {
    let square = |value: &dyn Fn(usize, usize) -> f64| {
        group.clone().map(|p| (0..a.nrows()).map(|i| value(i, p).powi(2)).sum::<f64>()).sum::<f64>()
    };
    relative(square(&|i, p| a[(i, p)] - b[(i, p)]).sqrt(), square(&|i, p| a[(i, p)]).sqrt())
}
