#![doc = include_str!("../README.md")]
#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

mod described;
mod difference;
mod elasticity;
mod extrapolation;
mod formulation;
mod geometric;
mod geometry;
mod places;
mod proof;
mod proved;
mod rule;
mod shape;
mod stiffness;
mod stress;

pub use described::{
    Axes, DescribedElements, ElementGroup, Equation, NodeDirection, NodeStiffness, NotDescribed, Section,
};
pub use elasticity::Elasticity;
pub use formulation::Formulation;
pub use geometry::PointVolume;
pub use proof::{Refusal, prove};
pub use proved::{NodalStresses, ProvedElements};
