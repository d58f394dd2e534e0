//! The front door: what a program that uses the library sees. It wraps the types of the other rooms, so that
//! these can change, and shows arrays as slices.

mod body;
mod conversion;
mod matrix;
mod model;
mod scene;

pub use body::{FlexBody, Identity};
pub use conversion::{Accuracy, Basis, Conversion, ConvertOptions, Frame};
pub use matrix::Matrix;
pub use model::{Model, ModelBuilder, SparseMatrix};
pub use scene::{Motion, Scene, Selection};
