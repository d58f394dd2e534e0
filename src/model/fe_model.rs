//! The checked model: every used node has three displacements, DOF 3 i + k is direction k of node i.

use super::{NodeSet, Nodes};
use crate::linalg::SymmetricMatrix;
use crate::provenance::SourceFile;
use crate::units::UnitSystem;

/// A checked free body. Internal order of degrees of freedom: node-major x, y, z in the order of `nodes`.
#[derive(Debug, Clone)]
pub struct FeModel {
    name: String,
    units: UnitSystem,
    nodes: Nodes,
    stiffness: SymmetricMatrix,
    scalar_mass: SymmetricMatrix,
    interfaces: Vec<NodeSet>,
    sources: Vec<SourceFile>,
    digits: u8,
}

impl FeModel {
    /// Model name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Units of all numbers.
    pub fn units(&self) -> &UnitSystem {
        &self.units
    }

    /// Nodes that carry degrees of freedom, in the order of the node table.
    pub fn nodes(&self) -> &Nodes {
        &self.nodes
    }

    /// K (3n x 3n), row 3 i + k.
    pub fn stiffness(&self) -> &SymmetricMatrix {
        &self.stiffness
    }

    /// Ms (n x n): M = Ms kron I3.
    pub fn scalar_mass(&self) -> &SymmetricMatrix {
        &self.scalar_mass
    }

    /// Named node sets.
    pub fn interfaces(&self) -> &[NodeSet] {
        &self.interfaces
    }

    /// Files it was read from.
    pub fn sources(&self) -> &[SourceFile] {
        &self.sources
    }

    /// Significant decimal digits of the stiffness values.
    pub fn digits(&self) -> u8 {
        self.digits
    }
}
