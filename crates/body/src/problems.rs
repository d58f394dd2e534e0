//! Collection of the errors in a set of arrays: shapes, numbers and texts that no body may have.

use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use std::collections::HashSet;

/// Largest number allowed in the arrays: invariants are sums of products, which overflow beyond it.
pub(crate) const MAX_NUMBER: f64 = 1e300;

/// Longest name of an interface or lumping scheme in bytes, since the name becomes a group name in the
/// file.
const MAX_NAME_BYTES: usize = 1000;

/// Errors found so far.
#[derive(Default)]
pub(crate) struct Problems(Vec<Diagnostic>);

impl Problems {
    pub(crate) fn found(self) -> Vec<Diagnostic> {
        self.0
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(crate) fn extend(&mut self, more: Vec<Diagnostic>) {
        self.0.extend(more);
    }

    pub(crate) fn add(&mut self, message: String) {
        self.0.push(Diagnostic::new(Code::BodySchema, message));
    }

    /// Reports the first value that is not finite, or so large that results computed from it overflow.
    pub(crate) fn finite(&mut self, name: &str, values: impl IntoIterator<Item = f64>) {
        if let Some((i, v)) = values.into_iter().enumerate().find(|(_, v)| v.is_nan() || v.abs() > MAX_NUMBER)
        {
            self.add(format!(
                "`{name}` has the value {v:e} at index {i}, expected finite numbers up to {MAX_NUMBER:e}"
            ));
        }
    }

    pub(crate) fn length(&mut self, name: &str, found: usize, expected: usize, per: &str) {
        if found != expected {
            self.add(format!("`{name}` has {found} values, expected {expected}, one per {per}"));
        }
    }

    pub(crate) fn matrix(&mut self, name: &str, m: &Mat<f64>, rows: usize, columns: usize) {
        if (m.nrows(), m.ncols()) != (rows, columns) {
            let (r, c) = (m.nrows(), m.ncols());
            self.add(format!("`{name}` is {r} x {c}, expected {rows} x {columns}"));
        }
        self.finite(name, values(m.as_ref()));
    }

    /// Reports a text that the file cannot hold.
    pub(crate) fn text(&mut self, name: &str, text: &str) {
        if text.contains('\0') {
            self.add(format!("`{name}` contains a NUL character, expected text"));
        }
    }

    pub(crate) fn names<'a>(&mut self, what: &str, names: impl Iterator<Item = &'a String>) {
        let mut seen = HashSet::new();
        for name in names {
            if name.is_empty() {
                self.add(format!("empty name of {what}"));
            } else if name.len() > MAX_NAME_BYTES {
                self.add(format!(
                    "name of {what} has {} bytes, expected at most {MAX_NAME_BYTES}",
                    name.len()
                ));
            } else if !seen.insert(name) {
                self.add(format!("{what} `{name}` is given twice"));
            }
        }
    }
}

fn values(m: MatRef<'_, f64>) -> impl Iterator<Item = f64> + '_ {
    (0..m.ncols()).flat_map(move |j| (0..m.nrows()).map(move |i| m[(i, j)]))
}
