//! Clusters of modes whose basis is not reproducible between two computations.

use std::ops::Range;

/// Relative gap of eigenvalues below which neighbours are compared as one space. Rounding p of the
/// eigenproblem rotates two modes with the relative gap g by p/g: with p = 1e-13, modes further apart than
/// this agree to 1e-8. A smaller value would show rounding of closer modes as a difference.
const CLUSTER_GAP: f64 = 1e-5;

/// Returns true if the eigenvalue `i` (from 1) of `values` (ascending) belongs to the same cluster as its
/// predecessor.
pub(super) fn close(values: &[f64], i: usize) -> bool {
    values[i] - values[i - 1] <= CLUSTER_GAP * values[i]
}

/// Returns the ranges of modes that are close to each other in `a` or in `b` (both ascending, of equal
/// length).
pub(super) fn clusters(a: &[f64], b: &[f64]) -> Vec<Range<usize>> {
    let mut ranges = Vec::new();
    let mut start = 0;
    for i in 1..=a.len() {
        if i == a.len() || !(close(a, i) || close(b, i)) {
            ranges.push(start..i);
            start = i;
        }
    }
    ranges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_close_in_either_body_are_one_space() {
        let (a, b) = ([1.0, 1.0 + 1e-9, 2.0, 3.0], [1.0, 1.1, 2.0, 2.0 + 1e-7]);
        assert_eq!(clusters(&a, &b), [0..2, 2..4]);
        assert_eq!(clusters(&b, &a), [0..2, 2..4]);
        assert!(clusters(&[], &[]).is_empty());
    }
}
