//! Choices that Python makes by name.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Returns the choice that is called `name`, or a ValueError that lists the names of all choices of `what`.
pub fn one_of<T, const N: usize>(what: &str, name: &str, choices: [(&str, T); N]) -> PyResult<T> {
    let known = choices.iter().map(|(known, _)| *known).collect::<Vec<_>>().join(", ");
    let found = choices.into_iter().find(|(known, _)| *known == name);
    let unknown = || PyValueError::new_err(format!("{what} is `{name}`, expected one of {known}"));
    found.map(|(_, choice)| choice).ok_or_else(unknown)
}
