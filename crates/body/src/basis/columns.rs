//! Shapes or loads from outside: checks, and transformation to the rows of the model.

use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_model::{FeModel, LostRow, RawShapes};

/// Kind of columns given by rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Given {
    /// Displacements.
    Shapes,
    /// Forces.
    Loads,
}

impl Given {
    fn name(self) -> &'static str {
        match self {
            Self::Shapes => "shape",
            Self::Loads => "load",
        }
    }
}

/// Returns the columns of `raw` in the model's order of degrees of freedom.
///
/// # Errors
/// [`ShapesSize`](Code::ShapesSize) if the rows are not those of the matrices, or a load acts on a row that
/// has neither stiffness nor mass; [`MatrixNotFinite`](Code::MatrixNotFinite) and
/// [`ShapesZero`](Code::ShapesZero), one diagnostic per finding.
pub(super) fn columns(model: &FeModel, raw: RawShapes, given: Given) -> Result<Mat<f64>> {
    let (n, k, what) = (raw.matrix.nrows(), raw.matrix.ncols(), given.name());
    let path = raw.path.clone();
    let refuse = |code, message: String| Diagnostic::new(code, message).in_file(&path);
    if !model.row_counts().contains(&n) || k == 0 {
        let message = format!("{k} {what}s have {n} rows, the matrices have {}", model.matrix_rows());
        return Err(refuse(Code::ShapesSize, message).into());
    }
    let mut found = Vec::new();
    for j in 0..k {
        let column = raw.matrix.col(j);
        if let Some(row) = column.iter().position(|value| !value.is_finite()) {
            let message = format!("{what} {} has {} in row {}", j + 1, column[row], row + 1);
            found.push(refuse(Code::MatrixNotFinite, message));
        } else if column.iter().all(|&value| value == 0.0) {
            found.push(refuse(Code::ShapesZero, format!("{what} {} is zero everywhere", j + 1)));
        }
    }
    if !found.is_empty() {
        return Err(Error::new(found));
    }
    let rows = match given {
        Given::Shapes => model.given_rows().motions(raw.matrix),
        Given::Loads => {
            let lost =
                |LostRow| refuse(Code::ShapesSize, "loads act on rows that K and M leave empty".to_owned());
            model.given_rows().forces(raw.matrix).map_err(lost)?
        }
    };
    let mut acting = (0..k).flat_map(|j| (0..rows.nrows()).map(move |row| (row, j)));
    let left_out = |&(row, j): &(usize, usize)| model.is_left_out(row) && rows[(row, j)] != 0.0;
    if let Some((row, j)) = acting.find(left_out).filter(|_| given == Given::Loads) {
        let message = format!("load {} acts on row {}, which has neither stiffness nor mass", j + 1, row + 1);
        return Err(refuse(Code::ShapesSize, message).into());
    }
    Ok(model.in_internal_order(rows))
}
