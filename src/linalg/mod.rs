//! Sparse and dense kernels: symmetric matrices, block products, ordering, factorisation, M-orthogonalisation.
//! The only room that names the linear-algebra crates' sparse solvers.

mod dense;
mod factor;
mod ordering;
mod pencil;
mod product;
mod sparse;
mod tall;

pub use dense::{SymmetricEigen, dense_cholesky, symmetric_eigen};
pub use factor::{Analysis, Cholesky, Inertia, Solve, is_positive_semidefinite};
pub use ordering::{connected_components, nested_dissection};
pub use pencil::Pencil;
pub use product::multiply;
pub(crate) use sparse::{ColumnBlock, split_columns};
pub use sparse::{CscMatrix, SymmetricMatrix};
pub use tall::{combine, gram, subtract_combination};
