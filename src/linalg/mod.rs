//! Sparse and dense kernels: symmetric matrices, block products, ordering, factorisation, M-orthogonalisation.
//! The only room that names the linear-algebra crates' sparse solvers.

mod sparse;

pub use sparse::{CscMatrix, SymmetricMatrix};
