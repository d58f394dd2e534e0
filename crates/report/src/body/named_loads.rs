//! Facts about the named loads of a body.

use crate::notation::numbers::percent;
use flexbody_body::flex_body::FlexBody;
use serde::Serialize;

/// Nodal forces with a name.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct NamedLoadFacts {
    pub name: String,
    pub preload: bool,
    /// Resultant force of the amplitude 1, model axes. Unit: force.
    pub force: [f64; 3],
    /// Resultant torque of the amplitude 1 about the origin of the frame, model axes. Unit: force times length.
    pub torque: [f64; 3],
    /// Part of the compliance that the modes do not contain; `None` if it is not known.
    pub missing_compliance: Option<f64>,
}

impl NamedLoadFacts {
    /// Returns the facts about all named loads of `body`.
    pub(crate) fn of(body: &FlexBody) -> Vec<Self> {
        let axes = &body.frame().axes;
        let loads = body.named_loads().iter().zip(body.named_load_truncation());
        let one = |(load, truncation): (&flexbody_body::flex_body::NamedLoad, Option<f64>)| Self {
            name: load.name.clone(),
            preload: load.preload,
            force: (axes * load.force).into(),
            torque: (axes * load.torque).into(),
            missing_compliance: truncation.map(|error| error * error),
        };
        loads.map(one).collect()
    }

    /// Returns `bolts: preload, 12 % of its static response outside the modes`.
    pub(crate) fn in_words(&self) -> String {
        let kind = if self.preload { "preload" } else { "load" };
        let missing = self
            .missing_compliance
            .map_or(String::new(), |part| format!(", {} of its compliance outside the modes", percent(part)));
        format!("{}: {kind}{missing}", self.name)
    }
}
