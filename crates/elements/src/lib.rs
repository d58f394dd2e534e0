#![doc = include_str!("../README.md")]
#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

mod described;
mod elasticity;

pub use described::{
    Axes, DescribedElements, ElementGroup, Equation, NodeDirection, NodeStiffness, NotDescribed, Section,
};
pub use elasticity::Elasticity;
