//! Choices that Python makes by name.

use crate::arguments::mistyped;
use crate::errors::value_error;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Returns the element of `all` that is called like the argument `given`, or an exception that lists the names of all
/// choices of `what`.
pub fn called<T: Copy>(
    what: &str,
    given: &Bound<'_, PyAny>,
    all: &[T],
    name_of: fn(T) -> &'static str,
) -> PyResult<T> {
    let known = || names_of(all, name_of).join(", ");
    let Ok(name) = given.extract::<String>() else {
        return Err(mistyped(given, what, &format!("one of {}", known())));
    };
    all.iter()
        .copied()
        .find(|choice| name_of(*choice) == name)
        .ok_or_else(|| value_error(given.py(), format!("`{what}` is {name:?}, expected one of {}", known())))
}

/// Returns the names of `all`.
fn names_of<T: Copy>(all: &[T], name_of: fn(T) -> &'static str) -> Vec<&'static str> {
    all.iter().map(|choice| name_of(*choice)).collect()
}

/// Returns the names of all choices, for the test that the types of the package state the same ones.
#[pyfunction]
#[pyo3(signature = () -> "dict[str, list[str]]")]
pub fn _choices(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let all = PyDict::new(py);
    let names = |choices: &[&str]| choices.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
    let bases = flexbody::Basis::ALL.iter().filter(|basis| **basis != flexbody::Basis::Imported);
    all.set_item("Basis", bases.map(|basis| basis.name()).collect::<Vec<_>>())?;
    all.set_item("Accuracy", names_of(flexbody::Accuracy::ALL, flexbody::Accuracy::name))?;
    all.set_item("Coupling", names_of(flexbody::Coupling::ALL, flexbody::Coupling::name))?;
    all.set_item("Reference", names_of(flexbody::ReferenceChoice::ALL, flexbody::ReferenceChoice::name))?;
    let formats: Vec<&str> = flexbody::FlexBody::export_formats().iter().map(|(name, _)| *name).collect();
    let dialects = formats.iter().filter_map(|name| flexbody::FlexBody::export_dialects(name).ok());
    all.set_item("Dialect", names(&dialects.flatten().copied().collect::<Vec<_>>()))?;
    all.set_item("ExportFormat", names(&formats))?;
    all.set_item("ImportFormat", names(&flexbody::FlexBody::import_formats()))?;
    let [length, mass, time] = flexbody::unit_names();
    all.set_item("Length", names(&length))?;
    all.set_item("Mass", names(&mass))?;
    all.set_item("Time", names(&time))?;
    all.set_item("Program", names(&flexbody::Model::programs()))?;
    all.set_item("RecipeProgram", names(&flexbody::Recipe::programs()))?;
    Ok(all)
}
