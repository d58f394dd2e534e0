//! Reference conditions: what ties the body frame to the deformed body.

/// Reference conditions of the floating frame. The nodal motion of a body does not depend on them, its modal
/// coordinates do: a joint that holds the frame holds what the conditions tie to it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum ReferenceConditions {
    /// Mean axes (Buckens, Tisserand): the modes are M-orthogonal to rigid motion, C1 = C2 = 0.
    #[default]
    MeanAxes,
    /// The frame stands on the reference point of the interface of this name, which rests in every mode. C1 and C2
    /// are the participation of the modes in translation and rotation.
    Interface(String),
    /// The modes tie the frame to the body in a way that nothing states, as those of another program's file do.
    Unstated,
}

/// Words before the name of an interface, in files.
const INTERFACE: &str = "interface ";
const MEAN_AXES: &str = "mean axes";
const UNSTATED: &str = "not stated";

impl ReferenceConditions {
    /// The conditions by the text of a flex-body file; `None` if the text means nothing.
    pub fn from_text(text: &str) -> Option<Self> {
        match text {
            MEAN_AXES => Some(Self::MeanAxes),
            UNSTATED => Some(Self::Unstated),
            _ => Some(Self::Interface(text.strip_prefix(INTERFACE)?.to_owned())),
        }
    }

    /// The text of a flex-body file: `mean axes`, `interface NAME` or `not stated`.
    pub fn text(&self) -> String {
        match self {
            Self::MeanAxes => MEAN_AXES.to_owned(),
            Self::Interface(name) => format!("{INTERFACE}{name}"),
            Self::Unstated => UNSTATED.to_owned(),
        }
    }

    /// True if the frame follows the mean motion of the body.
    pub fn is_mean(&self) -> bool {
        *self == Self::MeanAxes
    }
}

impl std::fmt::Display for ReferenceConditions {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::MeanAxes => f.write_str("the frame follows the mean motion of the body"),
            Self::Interface(name) => write!(f, "the frame stands on interface `{name}`"),
            Self::Unstated => f.write_str("the frame is tied to the body by the modes of another program"),
        }
    }
}
