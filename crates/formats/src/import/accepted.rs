//! Acceptance of imported bodies by the identities of every body.

use super::Imported;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_body::verification::body_identities;

/// Returns an error for an imported body that violates an identity of theory section 10: its file contradicts
/// itself.
///
/// # Errors
/// [`ForeignUnsound`](Code::ForeignUnsound), one diagnostic for every violated identity.
pub fn accept_imported(imported: &Imported) -> Result<()> {
    let broken = body_identities(&imported.body).into_iter().filter(|check| !check.passed);
    let found: Vec<Diagnostic> = broken
        .map(|check| {
            let message = format!(
                "the numbers of the file violate the identity `{}` ({}): {:.1e}, and at most {:.1e} is rounding",
                check.name, check.formula, check.value, check.limit
            );
            Diagnostic::new(Code::ForeignUnsound, message)
        })
        .collect();
    if found.is_empty() { Ok(()) } else { Err(Error::new(found)) }
}
