//! Redundant information in files that list the nine invariants.
//!
//! I4 is the skew part of I8, I5 that of I9, I6 half the trace of -I9. Values are relative to the
//! Cauchy-Schwarz bounds set by I6 and I7, so that 1 is the largest possible difference.

use super::AuditCheck;
use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_body::invariants::Numbered;
use flexbody_linalg::{larger, symmetric_eigen};

/// Relative rounding error of sums over the nodes of a large model, the limit of redundant numbers. A smaller
/// value reports rounding as contradictions.
pub(crate) const ROUNDING: f64 = 1e-10;

/// The invariants with their bounds.
pub(crate) struct Redundant<'n> {
    numbered: &'n Numbered,
    /// Bound sqrt(int x . x).
    extent: f64,
    /// Bound sqrt(I6_jj) of each mode.
    modes: Vec<f64>,
}

impl<'n> Redundant<'n> {
    pub(crate) fn new(numbered: &'n Numbered) -> Self {
        let modes = (0..numbered.i8.len()).map(|j| numbered.i6[(j, j)].abs().sqrt()).collect();
        Self { numbered, extent: (0.5 * numbered.i7.trace()).abs().sqrt(), modes }
    }

    fn nf(&self) -> usize {
        self.modes.len()
    }

    fn of_pairs(&self, missed: impl Fn(usize, usize) -> f64) -> f64 {
        let pairs = (0..self.nf()).flat_map(|j| (0..self.nf()).map(move |k| (j, k)));
        pairs.map(|(j, k)| relative(missed(j, k), self.modes[j] * self.modes[k])).fold(0.0, larger)
    }

    /// Returns the difference of I4_j and the skew part of I8_j.
    pub(crate) fn i4_of_i8(&self) -> f64 {
        let numbered = self.numbered;
        let missed = |j: usize| {
            let missed_along = |(a, b, c): (usize, usize, usize)| {
                numbered.i4[(c, j)] - (numbered.i8[j][(a, b)] - numbered.i8[j][(b, a)])
            };
            CYCLIC.map(missed_along).into_iter().map(f64::abs).fold(0.0, larger)
        };
        (0..self.nf()).map(|j| relative(missed(j), self.extent * self.modes[j])).fold(0.0, larger)
    }

    /// Returns the violation of I5_jk = -I5_kj.
    pub(crate) fn i5_antisymmetric(&self) -> f64 {
        let Some(i5) = &self.numbered.i5 else { return 0.0 };
        let nf = self.nf();
        self.of_pairs(|j, k| {
            (0..3).map(|c| (i5[(c * nf + j, k)] + i5[(c * nf + k, j)]).abs()).fold(0.0, larger)
        })
    }

    /// Returns the difference of I5_jk and the skew part of I9_jk.
    pub(crate) fn i5_of_i9(&self) -> f64 {
        let (Some(i5), Some(i9)) = (&self.numbered.i5, &self.numbered.i9) else { return 0.0 };
        let nf = self.nf();
        self.of_pairs(|j, k| {
            let at = |a: usize, b: usize| i9[(a * nf + j, b * nf + k)];
            let missed_along =
                |(a, b, c): (usize, usize, usize)| (i5[(c * nf + j, k)] - (at(b, a) - at(a, b))).abs();
            CYCLIC.map(missed_along).into_iter().fold(0.0, larger)
        })
    }

    /// Returns the violation of I9_jk = I9_kj'.
    pub(crate) fn i9_symmetric(&self) -> f64 {
        let Some(i9) = &self.numbered.i9 else { return 0.0 };
        let nf = self.nf();
        self.of_pairs(|j, k| {
            let axes = (0..9).map(|ab| (ab / 3, ab % 3));
            let missed = |(a, b): (usize, usize)| i9[(a * nf + j, b * nf + k)] - i9[(b * nf + k, a * nf + j)];
            axes.map(missed).map(f64::abs).fold(0.0, larger)
        })
    }

    /// Returns the difference of I6 and half the trace of -I9, which is zero for a mass that commutes with
    /// rotations.
    pub(crate) fn i6_of_i9(&self) -> f64 {
        let Some(i9) = &self.numbered.i9 else { return 0.0 };
        self.of_pairs(|j, k| (self.numbered.i6[(j, k)] + self.half_trace(i9, j, k)).abs())
    }

    /// Returns the smallest and largest eigenvalue of the modal mass implied by I9, relative to I6, for
    /// messages.
    pub(crate) fn mass_of_i9(&self) -> Option<(f64, f64)> {
        let i9 = self.numbered.i9.as_ref()?;
        let scaled = |j: usize, k: usize| -self.half_trace(i9, j, k) / (self.modes[j] * self.modes[k]);
        let sum = Mat::from_fn(self.nf(), self.nf(), scaled);
        if (0..self.nf()).any(|j| (0..self.nf()).any(|k| !sum[(j, k)].is_finite())) {
            return None;
        }
        let values = symmetric_eigen(sum.as_ref())?.values;
        Some((*values.first()?, *values.last()?))
    }

    fn half_trace(&self, i9: &Mat<f64>, j: usize, k: usize) -> f64 {
        let nf = self.nf();
        0.5 * (0..3).map(|a| i9[(a * nf + j, a * nf + k)]).sum::<f64>()
    }

    /// Returns the check of I6 against I9 with the meaning of its failure; `arrays` names the arrays of the
    /// file.
    pub(crate) fn lumped(&self, name: &'static str, formula: &'static str, arrays: &str) -> AuditCheck {
        let sizes = match self.mass_of_i9() {
            Some((least, most)) => format!(" (by {arrays} it is {least:.3} to {most:.3} of this mass)"),
            None => String::new(),
        };
        AuditCheck {
            name,
            formula,
            value: self.i6_of_i9(),
            limit: ROUNDING,
            code: Code::AuditLumped,
            meaning: format!(
                "the inertia of the modes does not give the modal mass{sizes}: lumped masses were mixed with a consistent modal mass, unless the model has nodes with rotations or constraints"
            ),
        }
    }
}

/// Replaces failed checks by findings of another entry order if all of the checks hold in that order. `other`
/// lists the checks that detect the order, with their values in the other order.
pub(crate) fn in_other_order(checks: &mut [AuditCheck], other: &[(&str, f64)], meaning: &str) {
    let failed = |name: &str| checks.iter().any(|check| check.name == name && !check.passed());
    let seen: Vec<(&str, f64)> = other.iter().copied().filter(|(name, _)| failed(name)).collect();
    if seen.iter().any(|(_, value)| value.is_nan() || *value > ROUNDING) {
        return;
    }
    for check in checks.iter_mut().filter(|check| seen.iter().any(|(name, _)| *name == check.name)) {
        check.code = Code::AuditLayout;
        check.meaning = meaning.to_owned();
    }
}

/// Returns true if I9 has no part symmetric in its axes although the modes have mass, as for a body without
/// W2.
pub(crate) fn has_no_w2(numbered: &Numbered) -> bool {
    let nf = numbered.i8.len();
    let Some(i9) = &numbered.i9 else { return true };
    let symmetric = |row: usize, column: usize| {
        let (a, j, b, k) = (row / nf, row % nf, column / nf, column % nf);
        i9[(row, column)] + i9[(b * nf + j, a * nf + k)]
    };
    (0..3 * nf).all(|row| (0..3 * nf).all(|column| symmetric(row, column) == 0.0))
}

/// Returns |A - A'| relative to the geometric mean of the diagonal entries.
pub(crate) fn asymmetry(a: &Mat<f64>) -> f64 {
    let pairs = (0..a.nrows()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let bound = |i: usize, j: usize| (a[(i, i)] * a[(j, j)]).abs().sqrt();
    pairs.map(|(i, j)| relative((a[(i, j)] - a[(j, i)]).abs(), bound(i, j))).fold(0.0, larger)
}

/// Returns `missed / size`; 0 if `missed` is zero, even if `size` is zero.
pub(crate) fn relative(missed: f64, size: f64) -> f64 {
    if missed == 0.0 { 0.0 } else { missed / size }
}

/// Indices (a, b, c) in cyclic order.
const CYCLIC: [(usize, usize, usize); 3] = [(1, 2, 0), (2, 0, 1), (0, 1, 2)];
