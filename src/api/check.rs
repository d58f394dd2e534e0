//! Checks of a body, alone or against its model.

use super::{FlexBody, Identity, Model};
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_body::invariants::IdentityCheck;
use flexbody_body::verification::Checks;
use flexbody_report::{checks_json, checks_text};

/// Checks of a body.
#[derive(Debug, Clone)]
pub struct Check {
    inner: Checks,
    text: String,
}

impl Identity {
    /// Returns the result of a check.
    pub(super) fn of(check: &IdentityCheck) -> Self {
        Self { name: check.name, value: check.value, limit: check.limit, holds: check.passed }
    }
}

impl FlexBody {
    /// Checks every identity of the body and, with the model that it was made of, every invariant and every mode against
    /// the matrices, like `flexbody check`. [`Model::read_for`] reads one of several bodies in the matrices.
    ///
    /// # Errors
    /// FB707 if the body and the model differ in dimension, nodes or rows of the modes.
    pub fn check(&self, against: Option<&Model>) -> Result<Check> {
        let inner = Checks::of(&self.0, against.map(|model| &model.checked))?;
        let text = checks_text(&self.0, &inner);
        Ok(Check { inner, text })
    }
}

impl Check {
    /// Returns true if every check passed.
    pub fn passed(&self) -> bool {
        self.inner.passed()
    }

    /// Returns all checks.
    pub fn identities(&self) -> Vec<Identity> {
        self.inner.identities.iter().map(Identity::of).collect()
    }

    /// Returns warnings about rigid interfaces that the modes deform, and about source files that have changed.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.inner.diagnostics
    }

    /// Returns the report of `flexbody check` as text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns the report of `flexbody check` as JSON.
    pub fn json(&self) -> String {
        checks_json(&self.inner)
    }
}
