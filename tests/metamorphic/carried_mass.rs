//! The points with mass that follow nodes of a random body, and their counterparts in a transformed model.

use crate::transformations::{rows, turned};
use flexbody_linalg::CscMatrix;
use flexbody_model::{DofLabel, RawFollowers, RawModel};
use nalgebra::Matrix3;
use oracle::mesh::entries;

/// Parts of the new rows in an old one.
type Parts = Vec<(u32, f64)>;

/// Returns the labels of the rows of a model, then of its points.
fn labels(raw: &RawModel, points: &RawFollowers) -> Vec<DofLabel> {
    rows(raw).into_iter().chain(points.labels.iter().copied()).collect()
}

/// Returns the points after a rotation or reflection of the model and its shift.
pub fn moved(
    raw: &RawModel,
    turn: &Matrix3<f64>,
    place: impl Fn([f64; 3]) -> [f64; 3],
) -> Option<RawFollowers> {
    let points = raw.followers.as_ref()?;
    let parts = turned(&labels(raw, points), turn);
    let parts = |row: u32| parts[row as usize].clone();
    Some(changed(points, parts, parts, 1.0, place))
}

/// Returns the points with row i of the model at `place[i]`.
pub fn permuted(raw: &RawModel, place: &[u32]) -> Option<RawFollowers> {
    let parts = |row: u32| vec![(place.get(row as usize).copied().unwrap_or(row), 1.0)];
    Some(changed(raw.followers.as_ref()?, parts, parts, 1.0, |x| x))
}

/// Returns the points in units with `length` times larger numbers of lengths and `mass` times larger ones of masses.
pub fn scaled(raw: &RawModel, length: f64, mass: f64) -> Option<RawFollowers> {
    let points = raw.followers.as_ref()?;
    let labels = labels(raw, points);
    let size = |row: u32| if labels[row as usize].direction > 3 { 1.0 } else { length };
    let (moved, pushed) = (|row: u32| vec![(row, size(row))], |row: u32| vec![(row, 1.0 / size(row))]);
    Some(changed(points, moved, pushed, mass * length * length, |x| x.map(|x| x * length)))
}

/// Returns the points with every displacement as those that `moved` makes of it, every force as those that `pushed` makes
/// of it with the same power, and `energy` times larger numbers of energies.
fn changed(
    points: &RawFollowers,
    moved: impl Fn(u32) -> Parts,
    pushed: impl Fn(u32) -> Parts,
    energy: f64,
    place: impl Fn([f64; 3]) -> [f64; 3],
) -> RawFollowers {
    let n = points.follows.n_rows() as u32;
    let made = |matrix: &CscMatrix, parts: &dyn Fn(u32, u32) -> (Parts, Parts)| {
        let of = |(i, j, value): (u32, u32, f64)| {
            let (rows, columns) = parts(i, j);
            let pairs = rows.into_iter().flat_map(move |a| columns.clone().into_iter().map(move |b| (a, b)));
            pairs.map(move |((i, a), (j, b))| (i, j, value * (a * b)))
        };
        let all: Vec<_> = entries(matrix).flat_map(of).collect();
        CscMatrix::from_triplets(matrix.n_rows(), matrix.n_cols(), &all)
    };
    let of_points = |j: u32| moved(n + j).into_iter().map(|(to, part)| (to - n, part)).collect();
    let mut new = points.clone();
    new.points.positions.iter_mut().for_each(|x| *x = place(*x));
    new.follows = made(&points.follows, &|i, j| (pushed(i), of_points(j)));
    new.mass = made(&points.mass, &|i, j| {
        (pushed(i).into_iter().map(|(to, part)| (to, energy * part)).collect(), pushed(j))
    });
    new
}
