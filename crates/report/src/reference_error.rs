//! Errors of a body relative to the model that it was made from.

use super::errors_in_words::errors_to_digits;
use super::numbers::significant;
use flexbody_motion::scene::OutputErrors;
use flexbody_study::reference::ReferenceError;
use serde::Serialize;

/// Errors of a body relative to its model.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct ReferenceErrorFacts {
    modes: usize,
    /// Errors by quantity. The attitude error is zero if the rotation is prescribed; the reaction error is
    /// `None` without prescribed motion.
    #[serde(flatten)]
    errors: OutputErrors,
    /// Largest ratio of error to tolerance; `None` if unknown.
    worst: Option<f64>,
    time: f64,
    /// Reason why the errors are unknown.
    unknown: Option<&'static str>,
}

impl ReferenceErrorFacts {
    pub(crate) fn new(reference: &ReferenceError) -> Self {
        let (modes, time, unknown) = (reference.modes, reference.time, reference.unknown);
        let known = |value: f64| unknown.is_none().then_some(value);
        Self {
            modes,
            errors: reference.errors.map(|error| error.and_then(known)),
            worst: known(reference.worst),
            time,
            unknown,
        }
    }

    /// Returns the errors in words: `attitude 0.0012 rad, deflection 0.5 %, stress 8.6 %`; with prescribed
    /// motion also `reaction 1.2 %`.
    pub(crate) fn parts(&self) -> String {
        if let Some(reason) = self.unknown {
            return format!("an unknown amount ({reason})");
        }
        let attitude = self.errors.attitude.filter(|angle| *angle > 0.0);
        errors_to_digits(&OutputErrors { attitude, ..self.errors }, 2)
    }

    fn in_words(&self) -> String {
        let (parts, time) = (self.parts(), significant(self.time, 3));
        match self.unknown {
            Some(_) => format!("a body of {} modes differs from the FE model by {parts}", self.modes),
            None => format!(
                "a body of {} modes differs from the FE model by {parts}, most at t = {time}",
                self.modes
            ),
        }
    }
}

/// Returns the error of the reference of all measured errors in words: the last of `rounds`. The first entry
/// is the error before enrichment.
pub(super) fn reference_in_words(rounds: &[ReferenceErrorFacts]) -> String {
    match rounds {
        [] => "the body with all its modes; its difference from an FE model is not known".to_owned(),
        [own] => format!("{} (estimated)", own.in_words()),
        [first, .., own] => format!("{} (estimated; before enrichment {})", own.in_words(), first.in_words()),
    }
}
