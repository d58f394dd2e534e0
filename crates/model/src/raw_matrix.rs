//! Matrices as delivered by a reader.

use flexbody_linalg::CscMatrix;
use std::path::PathBuf;

/// Matrix with the properties of its file.
#[derive(Debug, Clone, PartialEq)]
pub struct RawMatrix {
    /// Matrix with both triangles (a reader expands a stored triangle), zeros dropped, duplicates summed.
    pub matrix: CscMatrix,
    /// Significant decimal digits of the values, 1 to 17, independent of the number of digits written; 17
    /// for short exact numbers. Thresholds of the model checks depend on it.
    pub digits: u8,
    /// Path of the file; empty for matrices in memory.
    pub path: PathBuf,
}
