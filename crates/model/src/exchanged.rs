//! Check for exchanged stiffness and mass matrices.

use super::assembled::Assembled;
use super::rows::Rows;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::SymmetricMatrix;

/// Row sum of a stiffness, relative to that of its absolute values, below which translations leave the row
/// free.
const FREE_ROW_SUM: f64 = 1e-6;

/// Returns an error if translations leave M free but not K.
pub(super) fn check_exchanged_matrices(body: &Assembled) -> Option<Diagnostic> {
    let Assembled { raw, rows, stiffness, mass, .. } = body;
    let (free_in_mass, free_in_stiffness) = (free_rows(mass, rows), free_rows(stiffness, rows));
    (free_in_mass > 0.5 && free_in_stiffness < 0.1).then(|| {
        let message = format!(
            "the matrix given as mass ({}) does not resist translations, like a stiffness matrix, and the one given as stiffness ({}) does, like a mass matrix: they are exchanged",
            raw.mass.path.display(),
            raw.stiffness.path.display()
        );
        Diagnostic::new(Code::MatricesExchanged, message).in_file(&raw.stiffness.path)
    })
}

/// Returns the part of the nonempty rows of displacements without force under translations along all axes.
fn free_rows(matrix: &SymmetricMatrix, rows: &Rows) -> f64 {
    let (d, displacements) = (rows.dimension, rows.dimension * rows.nodes);
    let (mut held, mut free) = (0, 0);
    for row in 0..displacements {
        let (columns, values) = matrix.row(row);
        let (mut sums, mut size) = ([0.0; 3], 0.0);
        for (&column, &value) in
            columns.iter().zip(values).take_while(|(j, _)| (**j as usize) < displacements)
        {
            sums[column as usize % d] += value;
            size += value.abs();
        }
        match sums.iter().all(|sum: &f64| sum.abs() <= FREE_ROW_SUM * size) {
            _ if size == 0.0 => {}
            true => free += 1,
            false => held += 1,
        }
    }
    f64::from(free) / f64::from((free + held).max(1))
}
