//! Conversions for a scene whose selection does not hold: nothing is written unless the user allows it.

use super::arguments::ConvertArguments;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_study::reference::ReferenceError;
use flexbody_study::selection::Selection;

/// Ends a conversion whose `selection` does not hold, unless `--allow-unjudged` is set. `found` are the diagnostics of
/// the conversion, which state the reason.
///
/// # Errors
/// [`SelectionUnjudged`](Code::SelectionUnjudged) after `found`.
pub(super) fn refuse_unjudged(
    arguments: &ConvertArguments,
    selection: Option<&Selection>,
    found: &[Diagnostic],
) -> Result<()> {
    let Some(selection) = selection.filter(|selection| !selection.holds()) else { return Ok(()) };
    if arguments.allow_unjudged {
        return Ok(());
    }
    let message = match selection.reference_errors.last().filter(|own| !ReferenceError::is_reference(own)) {
        Some(own) => format!(
            "no file was written: the error of the reference body of {} modes is {:.0} % of the tolerances, more than half, so that the selection cannot be judged",
            own.modes,
            100.0 * own.worst
        ),
        None => "no file was written: the selected modes and terms do not meet the tolerances of the scene"
            .to_owned(),
    };
    let refused = Error::from(Diagnostic::new(Code::SelectionUnjudged, message));
    Err(refused.after(found.to_vec()))
}
