//! Choices that Python makes by name.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Returns the element of `all` that is called `name`, or a ValueError that lists the names of all choices of `what`.
pub fn called<T: Copy>(
    what: &str,
    name: &str,
    all: impl IntoIterator<Item = T>,
    name_of: fn(T) -> &'static str,
) -> PyResult<T> {
    let all: Vec<T> = all.into_iter().collect();
    let found = all.iter().copied().find(|choice| name_of(*choice) == name);
    found.ok_or_else(|| {
        let known = all.into_iter().map(name_of).collect::<Vec<_>>().join(", ");
        PyValueError::new_err(format!("{what} is `{name}`, expected one of {known}"))
    })
}
