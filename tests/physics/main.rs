//! Properties of bodies that mechanics dictates: closed forms, symmetry, convergence, covariance, conservation.

#[path = "../support/mod.rs"]
mod support;

mod assembler;
mod beams;
mod symmetry;
mod convergence;
