//! Columns as slices.

use faer::{ColMut, ColRef};

/// A column as a slice: every block in this crate is column-major.
pub fn contiguous(column: ColRef<'_, f64>) -> &[f64] {
    column.try_as_col_major().expect("blocks are column-major").as_slice()
}

/// The same, to be written.
pub fn contiguous_mut(column: ColMut<'_, f64>) -> &mut [f64] {
    column.try_as_col_major_mut().expect("blocks are column-major").as_slice_mut()
}
