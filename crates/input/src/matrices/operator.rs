//! Operator of a recovery, as its file gives it.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::CscMatrix;
use flexbody_model::DofLabel;
use std::collections::HashMap;

/// Operator as its file gives it.
#[derive(Debug, Clone, PartialEq)]
pub enum OperatorColumns {
    /// R' with one row for each matrix row.
    Matrix(CscMatrix),
    /// R' with labelled rows (name, number of columns, entries), as Nastran writes DMIG matrices.
    Labelled(String, usize, Vec<(DofLabel, u32, f64)>),
}

impl OperatorColumns {
    /// Returns R' with one row for each of the `labels` of the matrix rows.
    ///
    /// # Errors
    /// FB322 for a label that is none of the matrix rows.
    pub(crate) fn by_rows(self, labels: &[DofLabel]) -> Result<CscMatrix, Diagnostic> {
        let (name, columns, given) = match self {
            Self::Matrix(matrix) => return Ok(matrix),
            Self::Labelled(name, columns, given) => (name, columns, given),
        };
        let places: HashMap<DofLabel, u32> = labels.iter().copied().zip(0..).collect();
        let mut entries = Vec::with_capacity(given.len());
        for (label, column, value) in given {
            let Some(&row) = places.get(&label) else {
                let message = format!(
                    "DMIG {name} has an entry at node {}, component {}, which is no row of the matrices",
                    label.node, label.direction
                );
                return Err(Diagnostic::new(Code::RecoverySize, message));
            };
            entries.push((row, column, value));
        }
        Ok(CscMatrix::from_triplets(labels.len(), columns, &entries))
    }
}
