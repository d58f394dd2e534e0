//! Geometric stiffness of the modes together with that of unit rotations of the body: what a change of the reference
//! conditions needs, since it removes rigid motion from the modes.
//!
//! Rigid translations cause no force, K_geo t = 0, so that rotations about the origin of the frame are those about any
//! point. A rotation turns the forces of the load with the body (theory section 7): K_geo (phi x x) is not zero.

use super::{GeometricStiffness, UnitLoad};
use faer::{Mat, MatRef};
use flexbody_linalg::{combine, gram};
use nalgebra::Matrix3;

/// Geometric stiffness K_geo R of unit rotations R about the axes of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct RotatedStiffness {
    /// Unit load of K_geo.
    pub load: UnitLoad,
    /// Psi' K_geo R (nf x 3). Unit: mass^(1/2) length/time^2 over the unit of the load.
    pub modes: Mat<f64>,
    /// R' K_geo R (3 x 3). Unit: mass length^2/time^2 over the unit of the load.
    pub rotation: Mat<f64>,
}

/// Geometric stiffness of the modes, and of unit rotations, for the same loads in the same order.
pub type SplitStiffness = (Vec<GeometricStiffness<Mat<f64>>>, Vec<RotatedStiffness>);

/// Returns the parts of K_geo on modes and rotations ((nf + 3) square).
pub fn split(all: Vec<GeometricStiffness<Mat<f64>>>) -> SplitStiffness {
    let parts = all.into_iter().map(|GeometricStiffness { load, matrix }| {
        let nf = matrix.nrows() - 3;
        let part = |row: usize, column: usize, rows: usize, columns: usize| {
            matrix.as_ref().submatrix(row, column, rows, columns).to_owned()
        };
        let rotated =
            RotatedStiffness { load: load.clone(), modes: part(0, nf, nf, 3), rotation: part(nf, nf, 3, 3) };
        (GeometricStiffness { load, matrix: part(0, 0, nf, nf) }, rotated)
    });
    parts.unzip()
}

/// Returns K_geo on modes and `scale` times unit rotations together ((nf + 3) square), of parts that belong together.
pub fn joined(
    given: &[GeometricStiffness<Mat<f64>>],
    rotated: &[RotatedStiffness],
    scale: f64,
) -> Vec<GeometricStiffness<Mat<f64>>> {
    let both = given.iter().zip(rotated).map(|(own, rotated)| {
        let nf = own.matrix.nrows();
        let entry = |i: usize, j: usize| match (i < nf, j < nf) {
            (true, true) => own.matrix[(i, j)],
            (true, false) => rotated.modes[(i, j - nf)] * scale,
            (false, true) => rotated.modes[(j, i - nf)] * scale,
            (false, false) => rotated.rotation[(i - nf, j - nf)] * scale * scale,
        };
        GeometricStiffness { load: own.load.clone(), matrix: Mat::from_fn(nf + 3, nf + 3, entry) }
    });
    both.collect()
}

/// Returns T'A T of every matrix A.
pub(super) fn transformed(
    all: Vec<GeometricStiffness<Mat<f64>>>,
    change: &Mat<f64>,
) -> Vec<GeometricStiffness<Mat<f64>>> {
    let one = |stiffness: GeometricStiffness<Mat<f64>>| GeometricStiffness {
        matrix: gram(change.as_ref(), combine(stiffness.matrix.as_ref(), change.as_ref()).as_ref()),
        load: stiffness.load,
    };
    all.into_iter().map(one).collect()
}

/// Returns T for the modes (Psi - R A) X beside the rotations: `taken` are the rotations in A (3 x nf), `modes` is X (nf x
/// nf').
pub(super) fn without_rotation(taken: MatRef<'_, f64>, modes: &Mat<f64>) -> Mat<f64> {
    let (nf, count) = (modes.nrows(), modes.ncols());
    let rotations = combine(taken, modes.as_ref());
    Mat::from_fn(nf + 3, count + 3, |i, j| match (i < nf, j < count) {
        (true, true) => modes[(i, j)],
        (true, false) => 0.0,
        (false, true) => -rotations[(i - nf, j)],
        (false, false) => f64::from(i - nf == j - count),
    })
}

/// Returns T for rotations about the columns of `axes`, beside `nf` modes.
pub(super) fn about_axes(nf: usize, axes: &Matrix3<f64>) -> Mat<f64> {
    Mat::from_fn(nf + 3, nf + 3, |i, j| match (i < nf, j < nf) {
        (true, true) => f64::from(i == j),
        (false, false) => axes[(i - nf, j - nf)],
        _ => 0.0,
    })
}
