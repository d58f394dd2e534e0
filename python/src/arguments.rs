//! Arguments of Python functions: every value of a wrong type or size gives an exception of this package.

use crate::errors::{type_error, value_error};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyString};
use std::path::PathBuf;

/// Argument of any type, or None.
pub type Argument<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// Returns the name of the type of an argument, with an article.
pub fn kind(given: &Bound<'_, PyAny>) -> String {
    let name = given.get_type().name().map_or_else(|_| "object".to_owned(), |name| name.to_string());
    let article = if name.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {name}")
}

/// Returns the exception for an argument of another type than `expected`.
pub fn mistyped(given: &Bound<'_, PyAny>, name: &str, expected: &str) -> PyErr {
    type_error(given.py(), format!("`{name}` is {}, expected {expected}", kind(given)))
}

/// Returns a number from 0.
pub fn count(given: &Bound<'_, PyAny>, name: &str) -> PyResult<usize> {
    let expected = "a whole number, 0 or larger";
    if given.is_instance_of::<PyBool>() {
        return Err(mistyped(given, name, expected));
    }
    given.extract().map_err(|error| refused(given, name, expected, &error))
}

/// Returns a number from 1.
pub fn positive(given: &Bound<'_, PyAny>, name: &str) -> PyResult<usize> {
    match count(given, name)? {
        0 => Err(value_error(given.py(), format!("`{name}` is 0, expected 1 or more"))),
        number => Ok(number),
    }
}

/// Returns numbers from 0.
pub fn counts(given: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<usize>> {
    let items = given.try_iter().map_err(|_| mistyped(given, name, "a sequence of whole numbers"))?;
    items.map(|item| count(&item?, name)).collect()
}

/// Returns a whole number.
pub fn whole(given: &Bound<'_, PyAny>, name: &str) -> PyResult<i64> {
    given.extract().map_err(|error| refused(given, name, "a whole number of 64 bits", &error))
}

/// Returns a finite number.
pub fn real(given: &Bound<'_, PyAny>, name: &str) -> PyResult<f64> {
    let number: f64 = given.extract().map_err(|error| refused(given, name, "a number", &error))?;
    if number.is_finite() {
        return Ok(number);
    }
    Err(value_error(given.py(), format!("`{name}` is {number}, expected a finite number")))
}

/// Returns a string.
pub fn text(given: &Bound<'_, PyAny>, name: &str) -> PyResult<String> {
    given.extract().map_err(|_| mistyped(given, name, "a string"))
}

/// Returns strings: one, or a sequence of them.
pub fn texts(given: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<String>> {
    if given.is_instance_of::<PyString>() {
        return Ok(vec![text(given, name)?]);
    }
    given.extract().map_err(|_| mistyped(given, name, "a string or a sequence of strings"))
}

/// Returns a path.
pub fn path(given: &Bound<'_, PyAny>, name: &str) -> PyResult<PathBuf> {
    given.extract().map_err(|_| mistyped(given, name, "a path: a str or an os.PathLike"))
}

/// Returns units of length, mass and time as one text: `mm,t,s`.
pub fn units(given: &Bound<'_, PyAny>, name: &str) -> PyResult<String> {
    if given.is_instance_of::<PyString>() {
        return text(given, name);
    }
    let expected = "three units, as in (\"mm\", \"t\", \"s\")";
    let items = given.try_iter().map_err(|_| mistyped(given, name, expected))?;
    let words: Vec<String> = items.map(|item| Ok(item?.str()?.to_string())).collect::<PyResult<_>>()?;
    Ok(words.join(","))
}

/// Returns the exception for a number that cannot be taken: of another type, or out of range.
fn refused(given: &Bound<'_, PyAny>, name: &str, expected: &str, error: &PyErr) -> PyErr {
    if error.is_instance_of::<PyTypeError>(given.py()) {
        return mistyped(given, name, expected);
    }
    let shown = given.repr().map_or_else(|_| kind(given), |shown| shown.to_string());
    let shown: String = shown.chars().take(40).collect();
    value_error(given.py(), format!("`{name}` is {shown}, expected {expected}"))
}
