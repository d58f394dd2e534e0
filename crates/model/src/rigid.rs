//! Rigid displacement fields of the nodes, and the residual of K for them.

use faer::Mat;
use flexbody_linalg::{SymmetricMatrix, largest, parallel};

/// Returns the number of rigid motions of a body of the given dimension: six in space, three in the plane.
pub fn rigid_count(dimension: usize) -> usize {
    rigid_axes(dimension).len()
}

/// Returns the indices of the rigid motions of a body of the given dimension, among three translations and three
/// rotations; those of forces and torques are the same.
pub fn rigid_axes(dimension: usize) -> &'static [usize] {
    if dimension == 2 { &[0, 1, 5] } else { &[0, 1, 2, 3, 4, 5] }
}

/// Returns the rigid fields (3n x 6) about `centre`: three unit translations, three rotations e_k x (x -
/// centre) / `length`; in the plane (`dimension` 2) those that stay in it (2n x 3): two translations, and
/// the rotation about z.
pub fn rigid_fields(positions: &[[f64; 3]], dimension: usize, centre: [f64; 3], length: f64) -> Mat<f64> {
    if dimension == 2 {
        let mut fields = Mat::zeros(2 * positions.len(), 3);
        for (i, x) in positions.iter().enumerate() {
            (fields[(2 * i, 0)], fields[(2 * i + 1, 1)]) = (1.0, 1.0);
            fields[(2 * i, 2)] = -(x[1] - centre[1]) / length;
            fields[(2 * i + 1, 2)] = (x[0] - centre[0]) / length;
        }
        return fields;
    }
    let mut fields = Mat::zeros(3 * positions.len(), 6);
    for (i, x) in positions.iter().enumerate() {
        let r = [0, 1, 2].map(|k| (x[k] - centre[k]) / length);
        for k in 0..3 {
            fields[(3 * i + k, k)] = 1.0;
            // e_k x r has the components -r_m at l and r_l at m, for (k, l, m) cyclic.
            let (l, m) = ((k + 1) % 3, (k + 2) % 3);
            fields[(3 * i + l, 3 + k)] = -r[m];
            fields[(3 * i + m, 3 + k)] = r[l];
        }
    }
    fields
}

/// Returns the mean of the positions and the largest distance from it (1 if all coincide).
pub fn centre_and_length(positions: &[[f64; 3]]) -> ([f64; 3], f64) {
    let n = positions.len().max(1) as f64;
    // Sum differences to the first node, so that sums keep their digits far from the origin.
    let first = positions.first().copied().unwrap_or_default();
    let mut centre = [0.0; 3];
    for x in positions {
        for k in 0..3 {
            centre[k] += (x[k] - first[k]) / n;
        }
    }
    for k in 0..3 {
        centre[k] += first[k];
    }
    let length = positions
        .iter()
        .map(|x| (0..3).map(|k| (x[k] - centre[k]).powi(2)).sum::<f64>().sqrt())
        .fold(0.0, f64::max);
    (centre, if length > 0.0 { length } else { 1.0 })
}

/// Returns the size of the bounding box of the positions along each axis; zero without positions.
pub fn extents(positions: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|k| {
        let (low, high) = positions
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (x[k].min(low), x[k].max(high)));
        (high - low).max(0.0)
    })
}

/// Returns the distance of two positions that are far from each other: the search goes from the middle to
/// the farthest position, and on to the one farthest from that, until the distance does not grow. The
/// result is equal in all axes, and for most bodies it is the largest distance; zero without positions.
pub fn span(positions: &[[f64; 3]]) -> f64 {
    let distance = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    let farthest =
        |from: &[f64; 3]| positions.iter().map(|x| (distance(x, from), x)).max_by(|a, b| a.0.total_cmp(&b.0));
    let mut mean = [0.0; 3];
    for x in positions {
        (0..3).for_each(|k| mean[k] += x[k] / positions.len() as f64);
    }
    let mut span = 0.0;
    let mut next = farthest(&mean).and_then(|(_, end)| farthest(end));
    while let Some((distance, end)) = next.filter(|(distance, _)| *distance > span) {
        span = distance;
        next = farthest(end);
    }
    span
}

/// Returns for each row i the maximum over the fields of |(K R)_i| / sum_j |K_ij| r_j, zero for empty rows,
/// with r_j the typical size of a field at row j. Values near one mean a support, values near roundoff a
/// free body.
pub(super) fn rigid_residuals(k: &SymmetricMatrix, fields: &Mat<f64>, sizes: &[f64]) -> Vec<f64> {
    // Store the fields row by row, so that the data for a matrix entry lie in one or two cache lines.
    let rows: Vec<[f64; 7]> = parallel::values(k.n(), 1024, |i| {
        std::array::from_fn(|c| match c {
            6 => sizes[i],
            _ if c < fields.ncols() => fields[(i, c)],
            _ => 0.0,
        })
    });
    parallel::values(k.n(), 1024, |i| {
        let (columns, values) = k.row(i);
        let mut sums = [0.0; 6];
        let mut scale = 0.0;
        for (&j, &v) in columns.iter().zip(values) {
            let row = &rows[j as usize];
            scale += v.abs() * row[6];
            for (sum, field) in sums.iter_mut().zip(row) {
                *sum += v * field;
            }
        }
        let worst = largest(sums.map(f64::abs));
        if scale > 0.0 { worst / scale } else { 0.0 }
    })
}
