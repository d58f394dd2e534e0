//! Conversion of arrays to and from numpy.

use crate::arguments::mistyped;
use crate::errors::value_error;
use crate::types::{Floats, Given};
use flexbody::Matrix;
use nalgebra::{Matrix3, Vector3};
use numpy::{AllowTypeChange, PyArray1, PyArray2, PyArrayLikeDyn, PyArrayMethods};
use pyo3::prelude::*;
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

/// Returns a vector as an array.
pub fn vector<'py>(py: Python<'py>, values: &[f64]) -> Floats<'py> {
    PyArray1::from_slice(py, values).into_any()
}

/// Returns a matrix as an array, row by row.
pub fn matrix<'py>(py: Python<'py>, matrix: &Matrix) -> PyResult<Floats<'py>> {
    let (rows, columns) = (matrix.rows(), matrix.columns());
    let by_rows = (0..rows).flat_map(|i| (0..columns).map(move |j| matrix[(i, j)])).collect();
    shaped(py, by_rows, [rows, columns])
}

/// Returns a matrix with three rows for each node as an array (columns x nodes x 3).
pub fn by_node<'py>(py: Python<'py>, matrix: &Matrix) -> PyResult<Floats<'py>> {
    let all = PyArray1::from_slice(py, matrix.values());
    Ok(all.reshape([matrix.columns(), matrix.rows() / 3, 3])?.into_any())
}

/// Returns numbers that are stored row by row as an array of this shape.
pub fn shaped<'py>(py: Python<'py>, values: Vec<f64>, shape: [usize; 2]) -> PyResult<Floats<'py>> {
    Ok(PyArray1::from_vec(py, values).reshape(shape)?.into_any())
}

/// Returns a 3 x 3 matrix as an array.
pub fn matrix3<'py>(py: Python<'py>, matrix: &Matrix3<f64>) -> PyResult<Floats<'py>> {
    shaped(py, matrix.transpose().as_slice().to_vec(), [3, 3])
}

/// Returns rows of three as an array (n x 3).
pub fn triples<'py>(py: Python<'py>, rows: &[[f64; 3]]) -> PyResult<Floats<'py>> {
    shaped(py, rows.as_flattened().to_vec(), [rows.len(), 3])
}

/// Returns the rows of an array (n x 3).
pub fn rows_of_three(array: &Bound<'_, PyArray2<f64>>, name: &str) -> PyResult<Vec<[f64; 3]>> {
    let py = array.py();
    let array = array.readonly();
    let array = array.as_array();
    if array.ncols() != 3 {
        return Err(value_error(py, format!("`{name}` has {} columns, expected 3", array.ncols())));
    }
    Ok(array.rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect())
}

/// Returns the numbers of an array or a sequence with the given number of axes, row by row, and its shape.
fn array_of(given: &Given<'_>, axes: usize, name: &str) -> PyResult<(Vec<f64>, Vec<usize>)> {
    let array = given.extract::<PyArrayLikeDyn<'_, f64, AllowTypeChange>>().map_err(|_| {
        let words = if axes == 1 { "numbers" } else { "rows of numbers, all of one length" };
        mistyped(given, name, &format!("an array or a sequence of {words}"))
    })?;
    let array = array.as_array();
    if array.ndim() != axes {
        let message = format!("`{name}` has the shape {:?}, expected {axes} axes", array.shape());
        return Err(value_error(given.py(), message));
    }
    Ok((array.iter().copied().collect(), array.shape().to_vec()))
}

/// Returns the numbers of an array or a sequence.
pub fn sequence(given: &Given<'_>, name: &str) -> PyResult<Vec<f64>> {
    Ok(array_of(given, 1, name)?.0)
}

/// Returns the rows of an array or of a sequence of sequences.
pub fn rows_of(given: &Given<'_>, name: &str) -> PyResult<Vec<Vec<f64>>> {
    let (values, shape) = array_of(given, 2, name)?;
    Ok((0..shape[0]).map(|row| values[row * shape[1]..(row + 1) * shape[1]].to_vec()).collect())
}

/// Returns the rows of an array with `N` columns, or of a sequence of such rows.
pub fn rows_of_many<const N: usize>(given: &Given<'_>, name: &str) -> PyResult<Vec<[f64; N]>> {
    let row = |row: Vec<f64>| {
        let width = row.len();
        let wrong = |_| value_error(given.py(), format!("`{name}` has {width} columns, expected {N}"));
        <[f64; N]>::try_from(row).map_err(wrong)
    };
    rows_of(given, name)?.into_iter().map(row).collect()
}

/// Returns `length` finite numbers from a caller; zeros if nothing is given.
pub fn numbers(given: Option<&Given<'_>>, length: usize, name: &str) -> PyResult<Vec<f64>> {
    let Some(given) = given else { return Ok(vec![0.0; length]) };
    let values = sequence(given, name)?;
    let refused = |message| Err(value_error(given.py(), message));
    if values.len() != length {
        return refused(format!("`{name}` has {} entries, expected {length}", values.len()));
    }
    match values.iter().position(|value| !value.is_finite()) {
        Some(bad) => refused(format!("`{name}` has {} at entry {bad}", values[bad])),
        None => Ok(values),
    }
}

/// Returns three numbers from a caller.
pub fn vector3(given: &Given<'_>, name: &str) -> PyResult<Vector3<f64>> {
    Ok(Vector3::from_column_slice(&numbers(Some(given), 3, name)?))
}

/// Cache of arrays for attributes. The arrays are read-only, since all users share them.
#[derive(Default)]
pub struct ArrayCache(Mutex<HashMap<&'static str, Py<PyAny>>>);

impl ArrayCache {
    /// Returns the array of this name, which `make` creates at the first request.
    pub fn get<'py>(
        &self,
        py: Python<'py>,
        name: &'static str,
        make: impl FnOnce() -> PyResult<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let known = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(array) = known().get(name) {
            return Ok(array.bind(py).clone());
        }
        // The array is made without the lock: making it may let other Python threads run.
        let made = make()?;
        if !made.is_none() {
            made.call_method1("setflags", (false,))?;
        }
        Ok(known().entry(name).or_insert_with(|| made.unbind()).bind(py).clone())
    }
}
