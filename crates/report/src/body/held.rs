//! Facts of the modes of a body held at each of its interfaces, with their effective masses.

use crate::document::{Block, Inline, Table, cells};
use crate::notation::numbers::{counted, significant};
use flexbody_body::basis::BasisKind;
use flexbody_body::flex_body::{Carrier, FlexBody, HeldMode, is_static};
use serde::Serialize;

/// Number of modes that are listed. More make the report longer.
const MODES_SHOWN: usize = 10;

/// Lowest modes of a body held at an interface.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct HeldFacts {
    interface: String,
    modes: Vec<HeldModeFacts>,
    /// Sum of the effective masses of all modes of the body along the axes of the model, relative to its mass.
    effective_mass: [f64; 3],
    /// Number of modes of the body.
    count: usize,
    /// True if the body has free modes alone, without static shapes, which hold an interface poorly.
    #[serde(skip)]
    is_poor: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct HeldModeFacts {
    frequency_hz: f64,
    /// Effective masses along the axes of the model, relative to the mass of the body.
    effective_mass: [f64; 3],
}

impl HeldFacts {
    /// Returns the facts for every interface that can carry the body.
    pub(super) fn of(body: &FlexBody) -> Vec<Self> {
        let one = |name: &String| {
            let modes = body.held_modes(&Carrier::Interface(name.clone())).ok()?;
            if modes.is_empty() {
                return None;
            }
            let sum = |k: usize| modes.iter().map(|mode| mode.effective_mass[k]).sum();
            let facts = |mode: &HeldMode| HeldModeFacts {
                frequency_hz: body.units().frequency_of(mode.eigenvalue.max(0.0)),
                effective_mass: mode.effective_mass,
            };
            Some(Self {
                interface: name.clone(),
                effective_mass: [sum(0), sum(1), sum(2)],
                count: modes.len(),
                is_poor: body.basis() == Some(BasisKind::Free)
                    && !body.modes().provenance.iter().any(|origin| is_static(origin)),
                modes: modes.iter().take(MODES_SHOWN).map(facts).collect(),
            })
        };
        body.interfaces().iter().map(|interface| &interface.name).filter_map(one).collect()
    }

    /// Returns the table of the modes.
    pub(super) fn block<'b>(&self) -> Block<'b> {
        let percents = |values: &[f64; 3]| values.map(|value| format!("{:.2}", 100.0 * value));
        let row = |(number, mode): (usize, &HeldModeFacts)| {
            let [x, y, z] = percents(&mode.effective_mass);
            cells([number.to_string(), significant(mode.frequency_hz, 5), x, y, z])
        };
        let heads = ["Mode", "Frequency (Hz)", "x, %", "y, %", "z, %"];
        let [x, y, z] = percents(&self.effective_mass);
        let estimate = if self.is_poor {
            ". Estimates, too high by some per cent: free modes lack a part of the static compliance here, which --residual-vectors interfaces or --basis craig-bampton add"
        } else {
            ""
        };
        let caption = format!(
            "Modes of the body held at `{}`, and their effective masses along the model axes: how strongly an acceleration of this interface drives each. All {} together have {x}, {y} and {z} % of the mass; the rest follows the interface{estimate}",
            self.interface,
            counted(self.count, "mode")
        );
        let rows = (1..).zip(&self.modes).map(row).collect::<Vec<Vec<Inline>>>();
        Block::Table(Table::new(caption, heads, &[], rows))
    }
}
