//! Conditions on each matrix by itself: finite, symmetric to rounding, no negative diagonal entry.

use super::layout::Layout;
use super::tolerance::rounding;
use super::wording::name_some;
use super::{DofLabel, RawMatrix, RawModel};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::{CscMatrix, SymmetricMatrix, parallel};
use std::ops::Range;
use std::path::Path;

/// Adds an error for a matrix that is not square, empty, or not finite.
pub(super) fn check_matrix(raw: &RawMatrix, name: &str, found: &mut Vec<Diagnostic>) {
    let matrix = &raw.matrix;
    if matrix.n_rows() != matrix.n_cols() {
        let message = format!("{name} matrix has {} rows and {} columns", matrix.n_rows(), matrix.n_cols());
        found.push(Diagnostic::new(Code::MatrixNotSquare, message).in_file(&raw.path));
    } else if matrix.nnz() == 0 {
        let message = format!("{name} matrix has no nonzero entries");
        found.push(Diagnostic::new(Code::MatrixEmpty, message).in_file(&raw.path));
    }
    let not_finite = |values: &[f64]| values.iter().any(|v| !v.is_finite());
    if parallel::any(matrix.values().chunks(1 << 16), not_finite) {
        let at = matrix.values().iter().position(|v| !v.is_finite()).expect("just found");
        let column = matrix.col_ptr().partition_point(|&p| p <= at);
        let message = format!(
            "{name} matrix has {} in row {}, column {column}",
            matrix.values()[at],
            matrix.row_idx()[at] + 1
        );
        found.push(Diagnostic::new(Code::MatrixNotFinite, message).in_file(&raw.path));
    }
}

/// Takes a matrix out of `raw` and returns it symmetric and in internal order; `None` with a diagnostic if
/// it is not symmetric to rounding.
pub(super) fn symmetric(
    raw: &mut RawMatrix,
    layout: &Layout,
    name: &str,
    label: impl Fn(usize) -> DofLabel,
    found: &mut Vec<Diagnostic>,
) -> Option<SymmetricMatrix> {
    let matrix = std::mem::take(&mut raw.matrix);
    let ordered = if layout.is_identity() { matrix } else { matrix.permuted(&layout.row_to_internal) };
    let ordered = match SymmetricMatrix::try_from(ordered) {
        Ok(symmetric) => return Some(symmetric),
        Err(ordered) => ordered,
    };
    let n = ordered.n_cols();
    let Asymmetry { worst, at, one_sided } = Asymmetry::of(&ordered);
    if worst > rounding(raw.digits, 2) {
        let (i, j) = at;
        let message = format!(
            "{name} matrix is not symmetric: {} at ({}, {}), {} at the mirrored place",
            ordered.get(i, j),
            label(i),
            label(j),
            ordered.get(j, i)
        );
        let mut diagnostic = Diagnostic::new(Code::MatrixAsymmetric, message).in_file(&raw.path);
        if one_sided * 2 >= ordered.nnz().saturating_sub(n) * 2 && one_sided > 0 {
            diagnostic = diagnostic.with_help("declare the matrix symmetric: only one triangle is stored");
        }
        found.push(diagnostic);
        return None;
    }
    Some(SymmetricMatrix::symmetrised(ordered))
}

/// Difference between a matrix and its transpose.
#[derive(Clone, Copy, Default)]
struct Asymmetry {
    /// Largest difference relative to the size of the entries or of their diagonal entries, and the first
    /// entry with this difference.
    worst: f64,
    at: (usize, usize),
    /// Number of entries without a mirrored entry.
    one_sided: usize,
}

impl Asymmetry {
    fn of(matrix: &CscMatrix) -> Self {
        /// Number of columns per parallel task.
        const COLUMNS_PER_TASK: usize = 256;
        let n = matrix.n_cols();
        let size: Vec<f64> = (0..n).map(|i| matrix.get(i, i).abs().sqrt()).collect();
        let of_column = |j: usize| {
            let mut task = Self::default();
            let (rows, values) = matrix.column(j);
            for (&i, &v) in rows.iter().zip(values) {
                let i = i as usize;
                let other = matrix.get(j, i);
                task.one_sided += usize::from(other == 0.0);
                // An entry larger than the root of its diagonal entries, which occurs in indefinite
                // matrices only, is compared with itself.
                let scale = (size[i] * size[j]).max(v.abs()).max(other.abs());
                let difference = (v - other).abs() / scale;
                if difference > task.worst {
                    (task.worst, task.at) = (difference, (i, j));
                }
            }
            task
        };
        let of_columns = |columns: Range<usize>| columns.map(of_column).fold(Self::default(), Self::and);
        let parts = parallel::map(parallel::ranges(n, COLUMNS_PER_TASK), of_columns);
        parts.into_iter().fold(Self::default(), Self::and)
    }

    /// Combines the results of some columns and of the columns after them.
    fn and(self, next: Self) -> Self {
        let first = if next.worst > self.worst { next } else { self };
        Self { one_sided: self.one_sided + next.one_sided, ..first }
    }
}

pub(super) fn check_diagonals(
    stiffness: &SymmetricMatrix,
    mass: &SymmetricMatrix,
    label: impl Fn(usize) -> DofLabel,
    raw: &RawModel,
    found: &mut Vec<Diagnostic>,
) {
    check_diagonal(stiffness, "stiffness", &raw.stiffness.path, &label, found);
    check_diagonal(mass, "mass", &raw.mass.path, &label, found);
    let empty = |m: &SymmetricMatrix, i: usize| m.row(i).0.is_empty();
    let both: Vec<DofLabel> =
        (0..stiffness.n()).filter(|&i| empty(stiffness, i) && empty(mass, i)).map(&label).collect();
    if !both.is_empty() {
        let message = format!("{} rows are empty in both matrices: {}", both.len(), name_some(&both));
        found.push(Diagnostic::new(Code::PencilSingular, message).in_file(&raw.stiffness.path));
    }
}

pub(super) fn check_diagonal(
    matrix: &SymmetricMatrix,
    name: &str,
    path: &Path,
    label: impl Fn(usize) -> DofLabel,
    found: &mut Vec<Diagnostic>,
) {
    let negative: Vec<DofLabel> =
        matrix.diagonal().iter().enumerate().filter(|(_, d)| **d < 0.0).map(|(i, _)| label(i)).collect();
    if !negative.is_empty() {
        let message = format!(
            "{} diagonal entries of the {name} matrix are negative: {}",
            negative.len(),
            name_some(&negative)
        );
        found.push(Diagnostic::new(Code::DiagonalNegative, message).in_file(path));
    }
}
