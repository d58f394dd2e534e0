//! Carriers of a body, the places that its frame can be fixed to, and their motion in the modes.

use super::FlexBody;
use super::modal_change::stacked;
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_model::Coupling;
use nalgebra::Vector3;

/// Carrier of a body: the place that its frame is fixed to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Carrier {
    /// The reference point of the interface of this name.
    Interface(String),
    /// Node of this number, which must have rotations.
    Node(i64),
}

impl Carrier {
    /// Returns the interface of `body` with this name, or else the node with this number.
    pub fn named(body: &FlexBody, name: &str) -> Self {
        let is_interface = body.interfaces().iter().any(|interface| interface.name == name);
        match name.parse() {
            Ok(number) if !is_interface => Self::Node(number),
            _ => Self::Interface(name.to_owned()),
        }
    }

    /// Parses the name of a carrier in simulation files: `interface NAME` or `node 17`.
    pub fn from_words(words: &str) -> Option<Self> {
        match words.split_once(' ')? {
            ("interface", name) => Some(Self::Interface(name.to_owned())),
            ("node", number) => Some(Self::Node(number.parse().ok()?)),
            _ => None,
        }
    }
}

impl std::fmt::Display for Carrier {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Interface(name) => write!(f, "interface `{name}`"),
            Self::Node(number) => write!(f, "node {number}"),
        }
    }
}

/// Reference point of a carrier and its motion in every mode.
pub(super) struct CarriedPoint {
    /// Reference point, body frame.
    pub reference: Vector3<f64>,
    /// Translations, then rotations, of the point in the modes (6 x nf), body axes.
    pub motion: Mat<f64>,
}

impl FlexBody {
    /// Returns the reference point of `carrier` and its motion in every mode.
    ///
    /// # Errors
    /// The errors FB212 and FB214 of [`FlexBody::carried`].
    pub(super) fn place_of(&self, carrier: &Carrier) -> Result<CarriedPoint> {
        let unknown = |message: String| Err(Diagnostic::new(Code::SceneBody, message).into());
        match carrier {
            Carrier::Node(number) => {
                let Some(node) = self.nodes().ids.iter().position(|id| id == number) else {
                    return unknown(format!("the body has no node {number}"));
                };
                let rotation = self.modes().rotation.as_ref();
                let at = |shape: &Mat<f64>| shape.as_ref().subrows(3 * node, 3).to_owned();
                let rotation = rotation.map(at).filter(|rows| rows.norm_max() > 0.0);
                let Some(rotation) = rotation else {
                    return Err(refused(format!(
                        "node {number} has no rotations: its orientation is not known"
                    )));
                };
                let motion = stacked(&at(&self.modes().shape), &rotation);
                Ok(CarriedPoint { reference: Vector3::from(self.nodes().positions[node]), motion })
            }
            Carrier::Interface(name) => {
                let Some(interface) = self.interfaces().iter().find(|interface| interface.name == *name)
                else {
                    let all: Vec<&str> = self.interfaces().iter().map(|i| i.name.as_str()).collect();
                    let known = if all.is_empty() { "it has none".to_owned() } else { all.join(", ") };
                    return unknown(format!("the body has no interface `{name}`: {known}"));
                };
                let modes = self.modes();
                let rotation = modes.rotation.as_ref().map(Mat::as_ref);
                let rows = interface.rows(self.nodes(), modes.shape.as_ref(), rotation, self.dimension());
                let Some((rows, reference)) = rows.zip(interface.reference) else {
                    let why = if interface.coupling == Some(Coupling::Free) { " (it is free)" } else { "" };
                    return Err(refused(format!("interface `{name}` has no reference point{why}")));
                };
                let Some(motion) = rows.rigid_motion() else {
                    return Err(refused(format!(
                        "the nodes of interface `{name}` lie on one line: its orientation is not known"
                    )));
                };
                Ok(CarriedPoint { reference: Vector3::from(reference), motion })
            }
        }
    }
}

/// Returns the error FB214 with a message.
pub(super) fn refused(message: String) -> Error {
    Diagnostic::new(Code::CarrierImpossible, message).into()
}
