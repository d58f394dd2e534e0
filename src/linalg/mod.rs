//! Sparse and dense kernels: symmetric matrices, block products, ordering, factorisation, M-orthogonalisation.
//! The only room that names the linear-algebra crates' sparse solvers.

mod assembly_tree;
mod dense;
mod factor;
mod front;
mod inertia;
mod ordering;
mod pencil;
mod product;
mod sparse;
mod substitution;
mod tall;
mod tree_walk;

pub use dense::{SymmetricEigen, dense_cholesky, symmetric_eigen};
pub use factor::{Analysis, Cholesky, Solve, is_positive_semidefinite};
pub use inertia::Inertia;
pub use ordering::connected_components;
pub use pencil::Pencil;
pub use product::multiply;
pub use sparse::{CscMatrix, SymmetricMatrix};
pub use tall::{combine, gram, subtract_combination};
