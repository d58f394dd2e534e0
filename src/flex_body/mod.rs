//! The product: a validated flexible body, independent of the files it came from and goes to.

mod body;
mod parts;
mod validate;

pub use crate::invariants::Frame;
pub use crate::model::{GeometricStiffness, LoadKind, UnitLoad};
pub use body::FlexBody;
pub use parts::{
    Certificate, Guarantee, Interface, InternalRows, LumpedBody, MassStructure, Modes, Parts, Source,
    Truncation,
};
