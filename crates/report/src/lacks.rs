//! What a body lacks of the model that it was made of.

use super::numbers::significant;
use flexbody_motion::scene::OutputErrors;
use flexbody_study::reference::ReferenceError;
use serde::Serialize;

/// What a body lacks of its model.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct LackFacts {
    modes: usize,
    /// Radians; zero where the rotation is prescribed.
    attitude: Option<f64>,
    deflection: Option<f64>,
    stress: Option<f64>,
    /// Nothing where no motion is prescribed.
    reaction: Option<f64>,
    /// Nothing where it is not known.
    worst: Option<f64>,
    time: f64,
    /// The reason why nothing is known.
    unknown: Option<&'static str>,
}

impl LackFacts {
    pub(crate) fn new(lack: &ReferenceError) -> Self {
        let OutputErrors { attitude, deflection, stress, reaction } = lack.errors;
        let (modes, time, unknown) = (lack.modes, lack.time, lack.unknown);
        let known = |value: f64| unknown.is_none().then_some(value);
        Self {
            modes,
            attitude: known(attitude),
            deflection: deflection.and_then(known),
            stress: stress.and_then(known),
            reaction: reaction.and_then(known),
            worst: known(lack.worst),
            time,
            unknown,
        }
    }

    /// `attitude 0.0012 rad, deflection 0.5 %, stress 8.6 %`, of a prescribed motion with `reaction 1.2 %`.
    pub(crate) fn parts(&self) -> String {
        if let Some(reason) = self.unknown {
            return format!("an unknown part ({reason})");
        }
        let part = |name: &str, value: Option<f64>| {
            value.map(|value| format!("{name} {} %", significant(100.0 * value, 2)))
        };
        let attitude = self.attitude.filter(|angle| *angle > 0.0);
        let attitude = attitude.map(|angle| format!("attitude {} rad", significant(angle, 2)));
        let parts = [
            attitude,
            part("deflection", self.deflection),
            part("stress", self.stress),
            part("reaction", self.reaction),
        ];
        parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
    }

    fn in_words(&self) -> String {
        let (parts, time) = (self.parts(), significant(self.time, 3));
        match self.unknown {
            Some(_) => format!("{} modes lack {parts} of the FE model", self.modes),
            None => format!("{} modes lack {parts} of the FE model, most at t = {time}", self.modes),
        }
    }
}

/// What everything was measured against: the last of `lacks`, the first of which was that before anything was
/// enriched.
pub(super) fn reference_in_words(lacks: &[LackFacts]) -> String {
    match lacks {
        [] => "the modes of the body; what these lack of an FE model is not known".to_owned(),
        [own] => format!("{} (estimated)", own.in_words()),
        [first, .., own] => format!("{} (estimated; {} at first)", own.in_words(), first.in_words()),
    }
}
