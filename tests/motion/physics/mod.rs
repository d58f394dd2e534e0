//! Properties of bodies that mechanics dictates: closed forms, symmetry, convergence, covariance,
//! conservation.

mod assembler;
mod beams;
mod convergence;
mod covariance;
mod errata;
mod mechanisms;
mod model_files;
mod precision;
mod real_models;
mod rotation;
mod small_models;
mod symmetry;
