//! Deck of CalculiX: one linear static step for each shape, with given displacements of all nodes.

use super::{NodalShapes, written};
use std::io::{self, Write};

/// Set of the nodes with stresses.
const WATCHED: &str = "FLEXBODY_WATCHED";

/// Set of the elements around these nodes.
const WATCHED_ELEMENTS: &str = "FLEXBODY_WATCHED_ELEMENTS";

/// Set of all solid elements, whose strain energy is printed.
const SOLIDS: &str = "FLEXBODY_SOLIDS";

/// Number of members in a line of a set.
const MEMBERS_PER_LINE: usize = 8;

/// Places of the stresses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StressPlaces {
    /// Nodes, in a `.frd` with 64-bit numbers. Stresses are means over the elements at the node.
    Nodes,
    /// Integration points, in a `.dat` with seven digits.
    IntegrationPoints,
}

/// Deck that asks CalculiX for the stresses of shapes.
#[derive(Debug, Clone)]
pub struct StressDeck<'a> {
    /// Shapes.
    pub shapes: &'a NodalShapes,
    /// Cards of nodes, elements and materials.
    pub elements: &'a [u8],
    /// Numbers and nodes of the solid elements.
    pub solids: &'a [(i64, Vec<i64>)],
    /// Nodes with stresses.
    pub watched: &'a [i64],
    /// Places of the stresses.
    pub places: StressPlaces,
}

impl StressDeck<'_> {
    /// Writes the deck.
    ///
    /// # Errors
    /// Errors of `out`.
    pub fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let shapes = self.shapes;
        writeln!(
            out,
            "*HEADING\nShapes of a flexible body; the stresses of all steps are read by flexbody convert"
        )?;
        out.write_all(self.elements)?;
        set(out, "NSET", WATCHED, self.watched.iter().copied())?;
        set(out, "ELSET", SOLIDS, self.solids.iter().map(|(id, _)| *id))?;
        if self.places == StressPlaces::IntegrationPoints {
            let watched: std::collections::HashSet<i64> = self.watched.iter().copied().collect();
            let touching = |(_, nodes): &&(i64, Vec<i64>)| nodes.iter().any(|node| watched.contains(node));
            set(out, "ELSET", WATCHED_ELEMENTS, self.solids.iter().filter(touching).map(|(id, _)| *id))?;
        }
        for (step, (column, factor)) in shapes.columns().enumerate() {
            writeln!(out, "** step {}: {factor:e} times {column}", step + 1)?;
            writeln!(out, "*STEP\n*STATIC\n*BOUNDARY")?;
            for (node, u) in shapes.nodes.iter().zip(&shapes.displacements[step]) {
                for (direction, &value) in (1..).zip(u) {
                    writeln!(out, "{node},{direction},{direction},{}", written(value))?;
                }
            }
            match self.places {
                StressPlaces::Nodes => {
                    writeln!(out, "*NODE OUTPUT, NSET={WATCHED}, DOUBLE\nU")?;
                    writeln!(out, "*ELEMENT OUTPUT, NSET={WATCHED}, DOUBLE\nS, NOE")?;
                }
                StressPlaces::IntegrationPoints => {
                    writeln!(out, "*NODE PRINT, NSET={WATCHED}\nU")?;
                    writeln!(out, "*EL PRINT, ELSET={WATCHED_ELEMENTS}, GLOBAL=YES\nS")?;
                }
            }
            writeln!(out, "*EL PRINT, ELSET={SOLIDS}, TOTALS=ONLY\nELSE\n*END STEP")?;
        }
        Ok(())
    }
}

/// Writes a set of nodes or elements.
fn set(
    out: &mut impl Write,
    keyword: &str,
    name: &str,
    members: impl Iterator<Item = i64>,
) -> io::Result<()> {
    writeln!(out, "*{keyword}, {keyword}={name}")?;
    let members: Vec<String> = members.map(|member| member.to_string()).collect();
    for line in members.chunks(MEMBERS_PER_LINE) {
        writeln!(out, "{}", line.join(", "))?;
    }
    Ok(())
}
