//! Canonical bases of repeated eigenvalues and canonical signs. A body has the same modes whatever algorithm computed
//! them.

use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Mat, MatMut, MatRef};
use flexbody_linalg::{combine, contiguous_mut, parallel};
use std::ops::Range;

/// Relative gap between eigenvalues below which they belong to one cluster, which is completed and put into canonical
/// form as a whole.
pub const CLUSTER_GAP: f64 = 1e-9;

/// Relative difference of squared components below which the components count as equally large. The first of them in
/// row order is chosen, so that neither rounding nor the residual that [`Accuracy::Fast`](super::Accuracy::Fast) allows
/// decides between symmetric nodes.
const EQUAL_COMPONENT_DIFFERENCE: f64 = 1e-4;

/// Returns the index ranges of eigenvalues (ascending) whose neighbours differ by at most `gap` relative to their size.
pub fn clusters(eigenvalues: &[f64], gap: f64) -> Vec<Range<usize>> {
    let mut ranges = Vec::new();
    let mut start = 0;
    for i in 1..=eigenvalues.len() {
        let ends = i == eigenvalues.len()
            || eigenvalues[i] - eigenvalues[i - 1] > gap * eigenvalues[i].abs().max(eigenvalues[i - 1].abs());
        if ends {
            ranges.push(start..i);
            start = i;
        }
    }
    ranges
}

/// Returns the number of eigenvalues up to the end of the cluster that contains the last of the first `wanted`.
/// Clusters are formed as by [`clusters`] from the `count` eigenvalues lambda(0), lambda(1), ...
pub(super) fn cluster_end(wanted: usize, count: usize, gap: f64, lambda: impl Fn(usize) -> f64) -> usize {
    let near = |i: usize| {
        let (below, above) = (lambda(i - 1), lambda(i));
        above - below <= gap * above.abs().max(below.abs())
    };
    let wanted = wanted.min(count);
    if wanted == 0 { 0 } else { (wanted..count).find(|&i| !near(i)).unwrap_or(count) }
}

/// Rotates the columns of each cluster into echelon form and fixes all signs.
///
/// Within a cluster, the row with the largest norm is found and the columns are rotated so that only the first has a
/// component in that row; the remaining columns are treated alike. The component of largest magnitude of every column
/// is made positive.
pub fn canonical_basis(mut shapes: MatMut<'_, f64>, clusters: &[Range<usize>]) {
    for cluster in clusters {
        let mut block = shapes.rb_mut().subcols_mut(cluster.start, cluster.len());
        for first in 0..cluster.len().saturating_sub(1) {
            let mut rest = block.rb_mut().subcols_mut(first, cluster.len() - first);
            let row = dominant_row(rest.rb());
            reflect_onto_first(rest.rb_mut(), row);
        }
    }
    parallel::for_each(shapes.col_iter_mut().map(contiguous_mut), |column| {
        if canonical_sign(column.iter().copied()) < 0.0 {
            column.iter_mut().for_each(|x| *x = -*x);
        }
    });
}

/// Returns the sign, 1 or -1, that makes the component of largest magnitude positive.
pub fn canonical_sign(mut shape: impl Iterator<Item = f64> + Clone) -> f64 {
    let dominant = first_largest(shape.clone().map(|x| x * x));
    if shape.nth(dominant).is_some_and(|x| x < 0.0) { -1.0 } else { 1.0 }
}

/// Returns the first row whose norm is the largest, up to [`EQUAL_COMPONENT_DIFFERENCE`].
fn dominant_row(block: MatRef<'_, f64>) -> usize {
    let mut squares = vec![0.0f64; block.nrows()];
    for j in 0..block.ncols() {
        for (square, value) in squares.iter_mut().zip(block.col(j).iter()) {
            *square += value * value;
        }
    }
    first_largest(squares.iter().copied())
}

/// Returns the index of the first square that is the largest, up to [`EQUAL_COMPONENT_DIFFERENCE`].
fn first_largest(mut squares: impl Iterator<Item = f64> + Clone) -> usize {
    let largest = squares.clone().fold(0.0, f64::max);
    squares.position(|square| square >= largest * (1.0 - EQUAL_COMPONENT_DIFFERENCE)).unwrap_or(0)
}

/// Applies the Householder reflection of the columns after which only the first column has a component in `row`.
fn reflect_onto_first(mut block: MatMut<'_, f64>, row: usize) {
    let k = block.ncols();
    let target: Vec<f64> = (0..k).map(|j| block[(row, j)]).collect();
    let norm = target.iter().map(|v| v * v).sum::<f64>().sqrt();
    if norm == 0.0 {
        return;
    }
    // u = target + sign * norm * e1: H = I - 2 u u' / u'u maps the target onto the first axis without cancellation.
    let mut u = target;
    u[0] += if u[0] < 0.0 { -norm } else { norm };
    let square = u.iter().map(|v| v * v).sum::<f64>();
    let coefficients = Mat::from_fn(k, 1, |j, _| u[j]);
    let along = combine(block.rb(), coefficients.as_ref());
    for j in 0..k {
        let factor = 2.0 * u[j] / square;
        for i in 0..block.nrows() {
            block[(i, j)] -= factor * along[(i, 0)];
        }
    }
    // The reflection makes these components zero but for rounding.
    for j in 1..k {
        block[(row, j)] = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_inside_a_cluster_lead_to_the_same_basis() {
        let basis =
            Mat::from_fn(7, 3, |i, j| ((i * 3 + j * 5) as f64).sin() + if i == 2 * j { 2.0 } else { 0.0 });
        let (c, s) = (0.6f64, 0.8f64);
        let rotation = Mat::from_fn(3, 3, |i, j| match (i, j) {
            (0, 0) | (1, 1) => c,
            (0, 1) => -s,
            (1, 0) => s,
            (2, 2) => -1.0,
            _ => 0.0,
        });
        let mut a = basis.clone();
        let mut b = &basis * &rotation;
        canonical_basis(a.as_mut(), std::slice::from_ref(&(0..3)));
        canonical_basis(b.as_mut(), std::slice::from_ref(&(0..3)));
        assert!((&a - &b).norm_max() < 1e-14, "{a:?} {b:?}");
    }

    #[test]
    fn clusters_are_chains_of_close_eigenvalues() {
        assert_eq!(clusters(&[1.0, 1.0 + 1e-10, 2.0, 3.0, 3.0], 1e-9), vec![0..2, 2..3, 3..5]);
        assert!(clusters(&[], 1e-9).is_empty());
    }
}
