//! A check of an audit.

use flexbody_base::diagnostic::{Code, Diagnostic};

/// A check of a file: its condition, the violation, and the meaning of a failure.
#[derive(Debug, Clone, PartialEq)]
pub struct AuditCheck {
    /// Stable name: `Ge = 2 Cr1` is `ge_is_twice_cr1`.
    pub name: &'static str,
    /// Condition in the names of the format.
    pub formula: &'static str,
    /// Violation relative to the size of the terms; 0 is perfect.
    pub value: f64,
    /// Largest value that passes.
    pub limit: f64,
    /// Code of the finding if the check fails.
    pub code: Code,
    /// Meaning of a failure: a fragment in plain words with its facts, without the value.
    pub meaning: String,
}

impl AuditCheck {
    /// Returns true if `value <= limit`; a NaN never passes.
    pub fn passed(&self) -> bool {
        self.value <= self.limit
    }

    /// Returns the finding of a failed check; `None` if it passed.
    pub fn finding(&self) -> Option<Diagnostic> {
        let message =
            || format!("{} ({}: {:.2e}, limit {:.0e})", self.meaning, self.formula, self.value, self.limit);
        (!self.passed()).then(|| Diagnostic::new(self.code, message()))
    }
}
