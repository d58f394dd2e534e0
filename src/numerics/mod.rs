//! Numerical mathematics: sparse and dense linear algebra, eigen-solvers, time integration. It sees operators
//! and functions, never nodes, files or bodies, and is the only place that names the sparse solvers.

pub mod eigen;
pub mod integration;
pub mod linalg;
pub mod multigrid;
