//! One thing that an audit looks at.

use flexbody_base::diagnostic::{Code, Diagnostic};

/// A check of a file: what must hold, how far it is missed, and what that means.
#[derive(Debug, Clone, PartialEq)]
pub struct AuditCheck {
    /// Name, stable: `Ge = 2 Cr1` is `ge_is_twice_cr1`.
    pub name: &'static str,
    /// What must hold, in the names of the format.
    pub formula: &'static str,
    /// How far it is missed, relative to the size of its terms; 0 is perfect.
    pub value: f64,
    /// Largest value that passes.
    pub limit: f64,
    /// Code of the finding when it does not pass.
    pub code: Code,
    /// What it means when it does not pass: a fragment in plain words with the facts in it, without the
    /// value.
    pub meaning: String,
}

impl AuditCheck {
    /// Whether `value <= limit`; a NaN never passes.
    pub fn passed(&self) -> bool {
        self.value <= self.limit
    }

    /// The finding.
    pub fn finding(&self) -> Option<Diagnostic> {
        let message =
            || format!("{} ({}: {:.2e}, limit {:.0e})", self.meaning, self.formula, self.value, self.limit);
        (!self.passed()).then(|| Diagnostic::new(self.code, message()))
    }
}
