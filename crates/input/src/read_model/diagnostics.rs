//! Collection of the problems of all files.

use flexbody_base::diagnostic::{Diagnosed, Diagnostic};

/// Returns a value that could be read; adds the errors of another.
pub(super) fn take<T>(diagnostics: &mut Vec<Diagnostic>, found: Diagnosed<T>) -> Option<T> {
    found.map_err(|list| collect(diagnostics, list)).ok()
}

/// Adds the diagnostics that are not in the list yet: a file that is used twice is reported once.
pub(super) fn collect(diagnostics: &mut Vec<Diagnostic>, found: Vec<Diagnostic>) {
    for diagnostic in found {
        if !diagnostics.contains(&diagnostic) {
            diagnostics.push(diagnostic);
        }
    }
}
