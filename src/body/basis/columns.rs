//! Shapes or loads from outside: checked, and brought into the order of the model.

use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::{Error, Result};
use crate::model::{FeModel, RawShapes};
use faer::Mat;

/// The columns of `raw` (called `what`) in the model's order of degrees of freedom.
///
/// # Errors
/// [`ShapesSize`](Code::ShapesSize) when the rows are not those of the matrices,
/// [`MatrixNotFinite`](Code::MatrixNotFinite) and [`ShapesZero`](Code::ShapesZero), all that are found.
pub(super) fn columns(model: &FeModel, raw: RawShapes, what: &str) -> Result<Mat<f64>> {
    let (n, k) = (raw.matrix.nrows(), raw.matrix.ncols());
    let refuse = |code, message: String| Diagnostic::new(code, message).in_file(&raw.path);
    if n != model.matrix_rows() || k == 0 {
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
    if found.is_empty() { Ok(model.in_internal_order(raw.matrix)) } else { Err(Error::new(found)) }
}
