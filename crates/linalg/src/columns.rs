//! Columns of dense blocks as slices.

use faer::{ColMut, ColRef};

/// Returns a column as a slice. Every block in this crate is column-major.
pub fn contiguous(column: ColRef<'_, f64>) -> &[f64] {
    column.try_as_col_major().expect("blocks are column-major").as_slice()
}

/// Returns a column as a mutable slice.
pub fn contiguous_mut(column: ColMut<'_, f64>) -> &mut [f64] {
    column.try_as_col_major_mut().expect("blocks are column-major").as_slice_mut()
}
