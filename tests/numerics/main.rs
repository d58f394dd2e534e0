//! Numerical mathematics: eigen-solver, factorisation, integration, and the work that they take.

#[path = "../support/mod.rs"]
mod support;

mod beyond_rounding;
mod extremes;
mod integration;
mod memory;
mod multigrid;
mod second_shift;
mod single_precision;
mod work_counters;
