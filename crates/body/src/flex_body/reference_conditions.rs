//! Reference conditions, which tie the body frame to the deformed body.

/// Reference conditions of the floating frame. The nodal motion of a body does not depend on them, its
/// modal coordinates do: a joint at the frame constrains the part of the body that the conditions tie to
/// it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum ReferenceConditions {
    /// Mean axes (Buckens, Tisserand): the modes are M-orthogonal to rigid motion, C1 = C2 = 0.
    #[default]
    MeanAxes,
    /// The frame is fixed to the reference point of the interface of this name, which is at rest in every
    /// mode. C1 and C2 are the participation of the modes in translation and rotation.
    Interface(String),
    /// The modes tie the frame to the body in an unstated way, as in files of other programs.
    Unstated,
}

/// Words before the name of an interface, in files.
const INTERFACE: &str = "interface ";
const MEAN_AXES: &str = "mean axes";
const UNSTATED: &str = "not stated";

impl ReferenceConditions {
    /// Parses the text of a flex-body file; returns `None` for unknown text.
    pub fn from_text(text: &str) -> Option<Self> {
        match text {
            MEAN_AXES => Some(Self::MeanAxes),
            UNSTATED => Some(Self::Unstated),
            _ => Some(Self::Interface(text.strip_prefix(INTERFACE)?.to_owned())),
        }
    }

    /// Returns the text for a flex-body file: `mean axes`, `interface NAME` or `not stated`.
    pub fn text(&self) -> String {
        match self {
            Self::MeanAxes => MEAN_AXES.to_owned(),
            Self::Interface(name) => format!("{INTERFACE}{name}"),
            Self::Unstated => UNSTATED.to_owned(),
        }
    }

    /// Returns true if the frame follows the mean motion of the body.
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
