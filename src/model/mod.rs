//! The finite element model of one free body: nodes, degrees of freedom, K, M. Knows no file format.

mod fe_model;
mod nodes;
mod raw;

pub use fe_model::FeModel;
pub use nodes::{DofLabel, NodeSet, Nodes};
pub use raw::{RawMatrix, RawModel};
