//! A sum of sparse symmetric matrices with real or complex factors, which is not formed.

use super::SymmetricMatrix;
use nalgebra::Complex;
use std::ops::{AddAssign, Div, Mul, SubAssign};

/// Real or complex numbers.
pub trait Scalar: Copy + Mul<Output = Self> + Div<Output = Self> + AddAssign + SubAssign {
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// The product with a real number.
    fn times(self, real: f64) -> Self;
    /// 1 / x.
    fn reciprocal(self) -> Self;
    /// The square of |x|.
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

/// sum_k a_k A_k kron I: numbers, matrices, and the size of the identity.
#[derive(Debug, Clone)]
pub struct MatrixSum<'a, T> {
    terms: Vec<(T, &'a SymmetricMatrix, usize)>,
}

impl<'a, T: Scalar> MatrixSum<'a, T> {
    /// The sum of `terms`.
    ///
    /// # Panics
    /// When there are none, or their sizes disagree.
    pub fn new(terms: Vec<(T, &'a SymmetricMatrix, usize)>) -> Self {
        assert!(
            terms.windows(2).all(|pair| pair[0].1.n() * pair[0].2 == pair[1].1.n() * pair[1].2),
            "sizes of a sum"
        );
        assert!(!terms.is_empty(), "a sum of something");
        Self { terms }
    }

    /// Number of rows.
    pub fn n(&self) -> usize {
        self.terms[0].1.n() * self.terms[0].2
    }

    /// Shows column and value of the entries of a row: those of one matrix after those of another.
    pub fn for_row(&self, row: usize, mut see: impl FnMut(usize, T)) {
        for (factor, matrix, block) in &self.terms {
            let (columns, values) = matrix.row(row / block);
            for (&column, &value) in columns.iter().zip(values) {
                see(block * column as usize + row % block, factor.times(value));
            }
        }
    }
}
