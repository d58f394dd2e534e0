//! Description of a model, shared by all steps from its files to its body.

use crate::BodyNumber;
use flexbody_base::units::UnitSystem;

/// Name and units of a model. Every step from the manifest to the flex-body file passes the description on as a whole:
/// a new text about a model is a field of this struct, a key of the manifest, an entry of the file and a line of the
/// reports.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Description {
    /// Name of the model.
    pub name: String,
    /// Number of the body if the matrices held several bodies and were split.
    pub number: Option<BodyNumber>,
    /// Units of all numbers.
    pub units: UnitSystem,
}

impl Description {
    /// Creates the description of a model that is not one of several bodies.
    pub fn new(name: impl Into<String>, units: UnitSystem) -> Self {
        Self { name: name.into(), units, ..Self::default() }
    }

    /// Returns every text with the name of its field. No file can hold a text with a NUL character.
    pub fn texts(&self) -> [(&'static str, &str); 1] {
        [("name", &self.name)]
    }
}
