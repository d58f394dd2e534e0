//! Arrays at the points of a mesh of VTK, and the numbers of the points.

use super::vtk_packing::Unpacked;

/// Array of numbers at the points of a mesh.
#[derive(Clone)]
pub(crate) struct PointArray {
    pub name: String,
    /// Number of values for each point.
    pub components: usize,
    /// Values, point by point.
    pub values: Vec<f64>,
    /// Significant decimal digits.
    pub digits: u8,
}

/// Values at the points of a mesh.
pub(crate) struct PointData {
    /// Numbers of the points, if the file has any.
    pub ids: Option<Vec<i64>>,
    /// Arrays of real numbers.
    pub arrays: Vec<PointArray>,
    /// True for each point that another piece owns (`vtkGhostType` or `vtkGhostLevels`); empty without ghosts.
    pub ghosts: Vec<bool>,
}

/// Significant decimal digits that an array in text is assumed to have.
pub(super) const DIGITS_OF_TEXT: u8 = 6;

/// Returns the numbers of points as integers.
///
/// # Errors
/// A description of the problem.
pub(super) fn exact_ids(name: &str, ids: &[f64]) -> Unpacked<Vec<i64>> {
    // Larger numbers are not exact in f64.
    match ids.iter().find(|id| id.abs() > 9e15) {
        Some(id) => Err(format!("array `{name}` numbers a point {id}")),
        None => Ok(ids.iter().map(|id| *id as i64).collect()),
    }
}
