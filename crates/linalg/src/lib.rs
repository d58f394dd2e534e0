#![doc = include_str!("../README.md")]
#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

mod assembly_tree;
mod compensated;
mod compensated_pencil;
mod compensated_product;
pub mod context;
mod contiguous;
mod dense;
mod elimination;
mod factor;
mod few_columns;
mod front;
mod indefinite;
mod inertia;
mod instructions;
mod largest;
mod ldl;
mod matrix_sum;
pub mod multigrid;
mod one_sided_jacobi;
mod ordering;
pub mod parallel;
mod pencil;
mod product;
mod random;
mod sparse;
mod stored;
mod substitution;
mod tall;
mod tree_walk;

pub use compensated::{DoubleDouble, accumulate, accumulate_pair, with_fma};
pub use compensated_pencil::{SmallEigen, small_pencil};
pub use compensated_product::{
    CompensatedBlock, LANES, gram_compensated, multiply_compensated, projection_compensated, sum_length,
};
pub use contiguous::{contiguous, contiguous_mut};
pub use dense::{
    SymmetricEigen, dense_cholesky, dense_inverse, full_qr, solve_lower, solve_upper, symmetric_eigen,
};
pub use elimination::{Dependents, Elimination, ReducedPencil};
pub use factor::{Analysis, Cholesky, EliminationOrder, Peaks, Solve, is_positive_semidefinite};
pub use front::Real;
pub use indefinite::Indefinite;
pub use inertia::Inertia;
pub use instructions::instruction_set;
pub use largest::{larger, largest, largest_entry, not_negative};
pub use ldl::SparseLdl;
pub use matrix_sum::{MatrixSum, Scalar};
pub use one_sided_jacobi::left_singular_vectors;
pub use ordering::connected_components;
pub use pencil::Pencil;
pub use product::{multiply, multiply_vector, quadratic_form, sum_terms};
pub use random::uniform;
pub use sparse::{ColumnBlock, split_columns};
pub use sparse::{CscMatrix, SymmetricMatrix};
pub use stored::Stored;
pub use tall::{
    Tall, add_combination, column_norms, column_products, combine, combine_in_place, combine_into, copied,
    divide, gram, side_by_side, subtract_columns, subtract_combination, weighted_square, zeros,
};
