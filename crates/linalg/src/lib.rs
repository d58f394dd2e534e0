#![doc = include_str!("../README.md")]
#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

mod assembly_tree;
mod columns;
mod compensated;
pub mod context;
mod dense;
mod factor;
mod few_columns;
mod front;
mod indefinite;
mod inertia;
mod ldl;
pub mod multigrid;
mod ordering;
pub mod parallel;
mod pencil;
mod product;
mod rotation;
mod sparse;
mod substitution;
mod tall;
pub mod ties;

pub use columns::{contiguous, contiguous_mut};
pub use compensated::{
    CompensatedBlock, DoubleDouble, LANES, SmallEigen, accumulate, accumulate_pair, gram_compensated,
    multiply_compensated, projection_compensated, small_pencil, sum_length, with_fma,
};
pub use dense::{
    SymmetricEigen, dense_cholesky, dense_inverse, full_qr, larger, largest, largest_entry,
    left_singular_vectors, not_negative, solve_lower, solve_upper, symmetric_eigen,
};
pub use factor::{Analysis, Cholesky, EliminationOrder, Peaks, Solve, is_positive_semidefinite};
pub use front::Real;
pub use indefinite::Indefinite;
pub use inertia::Inertia;
pub use ldl::{MatrixSum, Scalar, SparseLdl};
pub use ordering::connected_components;
pub use parallel::instruction_set;
pub use pencil::{Dependents, Elimination, Pencil, ReducedPencil};
pub use product::{multiply, multiply_vector, quadratic_form, sum_terms};
pub use rotation::{rotation, rotation_by};
pub use sparse::{ColumnBlock, CscMatrix, Stored, SymmetricMatrix, split_columns};
pub use tall::{
    Tall, add_combination, column_norms, column_products, combine, combine_in_place, combine_into, copied,
    divide, gram, side_by_side, subtract_columns, subtract_combination, uniform, weighted_square, zeros,
};
