//! Comparison of two sets of modes that differ in sign, or by a rotation within repeated eigenvalues.

use super::{Invariants, primary_differences};
use faer::{Mat, MatRef};
use nalgebra::DMatrix;
use std::ops::Range;

/// Limit of the iterations of a small singular value decomposition, which needs a few per singular value.
const MAX_SVD_ITERATIONS: usize = 10_000;

/// Basis change that maps the modes of one body to those of another.
#[derive(Debug, Clone, PartialEq)]
pub struct Alignment {
    /// T (nf x nf), orthogonal, block-diagonal over the groups: Psi_b T is closest to Psi_a.
    pub basis: Mat<f64>,
    /// Smallest singular value of the blocks of the cross-Gram matrix. For mass-normalised modes and the M
    /// inner product it is the smallest cosine between the subspaces of a group, 1 if all agree. NaN if an
    /// entry of a block is not finite.
    pub agreement: f64,
}

/// Finds the orthogonal T, block-diagonal over `groups`, that minimises |Psi_a - Psi_b T|.
///
/// `cross_gram` (nf x nf) = Psi_a' G Psi_b for an inner product G. For each group T is the orthogonal polar
/// factor of the transposed block. If the modes of a group span one space, Psi_b = Psi_a R, the block is P
/// R with P positive definite for any such G, and T = R' exactly. Without the mass matrix, G = I (the plain
/// product of the nodal components) serves as well. `groups` are the clusters of repeated eigenvalues,
/// ascending and disjoint; a mode outside of them forms its own group, and T is its sign.
///
/// # Panics
/// When the matrix is not square, or the groups overlap or go beyond it.
pub fn align(cross_gram: MatRef<'_, f64>, groups: &[Range<usize>]) -> Alignment {
    let nf = cross_gram.nrows();
    assert_eq!(nf, cross_gram.ncols(), "the same number of modes");
    let mut alignment = Alignment { basis: Mat::identity(nf, nf), agreement: f64::INFINITY };
    let mut next = 0;
    for group in groups {
        assert!(
            next <= group.start && group.start <= group.end && group.end <= nf,
            "groups ascending, disjoint"
        );
        (next..group.start).for_each(|p| alignment.align_group(cross_gram, p..p + 1));
        alignment.align_group(cross_gram, group.clone());
        next = group.end;
    }
    (next..nf).for_each(|p| alignment.align_group(cross_gram, p..p + 1));
    alignment
}

impl Alignment {
    fn align_group(&mut self, cross_gram: MatRef<'_, f64>, group: Range<usize>) {
        let (start, size) = (group.start, group.len());
        if size == 0 {
            return;
        }
        let transposed = DMatrix::from_fn(size, size, |p, q| cross_gram[(start + q, start + p)]);
        let svd = transposed
            .iter()
            .all(|v| v.is_finite())
            .then(|| transposed.try_svd(true, true, f64::EPSILON, MAX_SVD_ITERATIONS))
            .flatten();
        let polar = svd.and_then(|svd| Some((svd.u? * svd.v_t?, svd.singular_values.min())));
        let Some((polar, smallest)) = polar else {
            self.agreement = f64::NAN;
            return;
        };
        // min() would drop an earlier NaN.
        if !self.agreement.is_nan() {
            self.agreement = self.agreement.min(smallest);
        }
        for p in 0..size {
            for q in 0..size {
                self.basis[(start + p, start + q)] = polar[(p, q)];
            }
        }
    }
}

/// Compares the primary data of two bodies whose modes may differ in sign and within repeated eigenvalues:
/// aligns `b` to `a` ([`align`]) and returns the alignment and the differences of [`primary_differences`].
///
/// # Panics
/// When the sizes disagree.
pub fn compare_invariants(
    a: &Invariants,
    b: &Invariants,
    cross_gram: MatRef<'_, f64>,
    groups: &[Range<usize>],
) -> (Alignment, Vec<(String, f64)>) {
    let alignment = align(cross_gram, groups);
    let differences = primary_differences(a, &b.with_basis(alignment.basis.as_ref()));
    (alignment, differences)
}
