//! The class of flexible bodies, on which the studies that return bodies depend. Its Python methods are in `body.rs`.

use crate::arguments::mistyped;
use crate::arrays::{ArrayCache, matrix, vector};
use crate::types::{Floats, FloatsOrNone};
use crate::work::alone;
use flexbody::{Diagnostic, FlexBody, Matrix};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;

/// A flexible body with n nodes and nf modes: the modes, and the constant invariants in the equations of motion of its
/// floating frame. Vectors are along the axes of the body frame, about its origin, in the units of the model. Arrays
/// are read-only and made once: copy an array before you change it.
///
/// `flexbody.convert` makes one, `flexbody.read` reads one. Bodies can be compared for equality, copied and pickled.
#[pyclass(frozen, eq, module = "flexbody")]
pub struct Body {
    pub inner: Arc<FlexBody>,
    pub diagnostics: Vec<Diagnostic>,
    /// Arrays that Python has requested.
    pub cache: ArrayCache,
}

impl PartialEq for Body {
    fn eq(&self, other: &Self) -> bool {
        self.inner == other.inner
    }
}

impl Body {
    pub fn new(inner: FlexBody, diagnostics: Vec<Diagnostic>) -> Self {
        Self { inner: Arc::new(inner), diagnostics, cache: ArrayCache::default() }
    }

    /// Returns the body that a caller gives: a `Body`, or the path of a flex-body file.
    pub fn given(given: &Bound<'_, PyAny>, name: &str) -> PyResult<Arc<FlexBody>> {
        if let Ok(body) = given.cast::<Self>() {
            return Ok(Arc::clone(&body.get().inner));
        }
        let expected = "a Body, or the path of a flex-body file";
        let path: PathBuf = given.extract().map_err(|_| mistyped(given, name, expected))?;
        Ok(Arc::new(alone(given.py(), || FlexBody::read(&path))?))
    }

    pub fn numbers<'py>(&self, py: Python<'py>, name: &'static str, of: &[f64]) -> PyResult<Floats<'py>> {
        self.cache.get(py, name, || Ok(vector(py, of)))
    }

    /// Returns a matrix, or None if the body has none of this name.
    pub fn matrix<'py>(
        &self,
        py: Python<'py>,
        name: &'static str,
        of: impl FnOnce(&FlexBody) -> Option<Matrix>,
    ) -> PyResult<FloatsOrNone<'py>> {
        self.cache.get(py, name, || match of(&self.inner) {
            Some(given) => matrix(py, &given),
            None => Ok(py.None().into_bound(py)),
        })
    }
}
