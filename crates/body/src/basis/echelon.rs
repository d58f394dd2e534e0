//! Solution of linear conditions for some of their unknowns.

use faer::Mat;

/// Reduced echelon form \[1, W\] of a matrix A (r x n) with reordered columns. Its number of rows is the
/// rank of A; the pivots are found by complete pivoting.
pub(super) struct Echelon {
    /// Columns of A that form the unit matrix, and all others.
    pub pivots: Vec<usize>,
    pub others: Vec<usize>,
    /// W (rank x others).
    pub weights: Mat<f64>,
}

impl Echelon {
    /// Pivots below this part of the first pivot count as rounding.
    const ROUNDING_PIVOT: f64 = 1e-9;

    /// Computes the echelon form of `a`.
    pub(super) fn new(mut a: Mat<f64>) -> Self {
        let (r, columns) = (a.nrows(), a.ncols());
        let mut pivots: Vec<usize> = Vec::new();
        let mut first = 0.0;
        for step in 0..r.min(columns) {
            // Largest entry among the remaining rows and columns.
            let places = (step..r).flat_map(|i| (0..columns).map(move |j| (i, j)));
            let open = places.filter(|(_, j)| !pivots.contains(j));
            let Some((i, j)) = open.max_by(|&p, &q| a[p].abs().total_cmp(&a[q].abs())) else { break };
            if step == 0 {
                first = a[(i, j)].abs();
            }
            if a[(i, j)].abs() <= Self::ROUNDING_PIVOT * first {
                break;
            }
            // Exchange rows, scale the pivot row, and eliminate its column in all other rows.
            for column in 0..columns {
                let (upper, lower) = (a[(step, column)], a[(i, column)]);
                (a[(step, column)], a[(i, column)]) = (lower, upper);
            }
            let pivot = a[(step, j)];
            (0..columns).for_each(|column| a[(step, column)] /= pivot);
            for other in (0..r).filter(|&other| other != step) {
                let factor = a[(other, j)];
                (0..columns).for_each(|column| a[(other, column)] -= factor * a[(step, column)]);
            }
            pivots.push(j);
        }
        // The remaining columns are W.
        let others: Vec<usize> = (0..columns).filter(|j| !pivots.contains(j)).collect();
        let weights = Mat::from_fn(pivots.len(), others.len(), |i, j| a[(i, others[j])]);
        Self { pivots, others, weights }
    }
}
