//! Sum of sparse symmetric matrices with real or complex factors, which is not formed.

use super::SymmetricMatrix;
use nalgebra::Complex;
use std::ops::{AddAssign, Div, Mul, SubAssign};

/// Real or complex number.
pub trait Scalar: Copy + Mul<Output = Self> + Div<Output = Self> + AddAssign + SubAssign {
    /// Number zero.
    const ZERO: Self;
    /// Number one.
    const ONE: Self;
    /// Returns the product with a real number.
    fn times(self, real: f64) -> Self;
    /// Returns 1 / x.
    fn reciprocal(self) -> Self;
    /// Returns |x|^2.
    fn square(self) -> f64;
}

impl Scalar for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    fn times(self, real: f64) -> Self {
        self * real
    }
    fn reciprocal(self) -> Self {
        self.recip()
    }
    fn square(self) -> f64 {
        self * self
    }
}

impl Scalar for Complex<f64> {
    const ZERO: Self = Self::new(0.0, 0.0);
    const ONE: Self = Self::new(1.0, 0.0);
    fn times(self, real: f64) -> Self {
        self * real
    }
    fn reciprocal(self) -> Self {
        self.inv()
    }
    fn square(self) -> f64 {
        self.norm_sqr()
    }
}

/// Sum of a_k A_k kron I, stored as factors, matrices and sizes of the identities.
#[derive(Debug, Clone)]
pub struct MatrixSum<'a, T> {
    terms: Vec<(T, &'a SymmetricMatrix, usize)>,
}

impl<'a, T: Scalar> MatrixSum<'a, T> {
    /// Creates the sum of `terms`.
    ///
    /// # Panics
    /// If there are no terms, or their sizes differ.
    pub fn new(terms: Vec<(T, &'a SymmetricMatrix, usize)>) -> Self {
        assert!(
            terms.windows(2).all(|pair| pair[0].1.n() * pair[0].2 == pair[1].1.n() * pair[1].2),
            "sizes of a sum"
        );
        assert!(!terms.is_empty(), "a sum of something");
        Self { terms }
    }

    /// Returns the number of rows.
    pub fn n(&self) -> usize {
        self.terms[0].1.n() * self.terms[0].2
    }

    /// Calls `see` with column and value of every entry of a row, matrix by matrix.
    pub fn for_row(&self, row: usize, mut see: impl FnMut(usize, T)) {
        for (factor, matrix, block) in &self.terms {
            let (columns, values) = matrix.row(row / block);
            for (&column, &value) in columns.iter().zip(values) {
                see(block * column as usize + row % block, factor.times(value));
            }
        }
    }
}
