//! The test M = Ms kron I3, block by block, and Ms itself.

use super::DofLabel;
use crate::diagnostic::{Code, Diagnostic};
use crate::linalg::{CscMatrix, SymmetricMatrix};

/// What the mass matrix turned out to be.
pub(super) struct ScalarMass {
    /// Ms: the mean of the three directions.
    pub matrix: SymmetricMatrix,
    /// Largest deviation of a block from a multiple of the identity, relative to sqrt(alpha_ii alpha_jj).
    pub deviation: f64,
}

/// Reduces M (3n x 3n, internal order, symmetric) to Ms; `label` names a row for messages. Deviations up to `tolerance` are
/// rounding.
pub(super) fn scalar_mass(
    m: &SymmetricMatrix,
    tolerance: f64,
    label: impl Fn(usize) -> DofLabel,
) -> Result<ScalarMass, Diagnostic> {
    let n = m.n() / 3;
    let mut totals = [0.0f64; 3];
    let mut magnitude = 0.0f64;
    for i in 0..m.n() {
        let (columns, values) = m.row(i);
        for (&j, &v) in columns.iter().zip(values) {
            if j as usize % 3 == i % 3 {
                totals[i % 3] += v;
                magnitude += v.abs() / 3.0;
            }
        }
    }
    let mean = totals.iter().sum::<f64>() / 3.0;
    if mean.is_nan() || mean <= tolerance * magnitude {
        let message = format!("total mass is {mean:e}");
        return Err(Diagnostic::new(Code::MassNotPositive, message));
    }
    let spread = totals.iter().fold(0.0f64, |s, t| s.max((t - mean).abs())) / mean;
    if spread > tolerance.max(1e-9) {
        let [x, y, z] = totals;
        let message = format!("total mass is {x} along x, {y} along y and {z} along z");
        return Err(Diagnostic::new(Code::MassDirectional, message));
    }
    let diagonal = m.diagonal();
    let size = |i: usize| (0..3).fold(0.0f64, |s, k| s.max(diagonal[3 * i + k].abs())).sqrt();
    let sizes: Vec<f64> = (0..n).map(size).collect();
    let (mut worst, mut worst_at) = (0.0f64, (0, 0));
    let (mut col_ptr, mut row_idx, mut values) = (vec![0usize], Vec::new(), Vec::new());
    let mut block: Vec<[f64; 3]> = vec![[0.0; 3]; n];
    let mut touched: Vec<u32> = Vec::new();
    let mut is_touched = vec![false; n];
    for node in 0..n {
        for k in 0..3 {
            let (columns, entries) = m.row(3 * node + k);
            for (&j, &v) in columns.iter().zip(entries) {
                let (other, l) = (j as usize / 3, j as usize % 3);
                if !is_touched[other] {
                    is_touched[other] = true;
                    touched.push(other as u32);
                }
                if k == l {
                    block[other][l] = v;
                } else {
                    // Massless nodes have no scale of their own: compare with the mean nodal mass.
                    let deviation =
                        v.abs() / (sizes[node] * sizes[other]).max(f64::EPSILON * mean / n as f64);
                    if deviation > worst {
                        (worst, worst_at) = (deviation, (3 * node + k, j as usize));
                    }
                }
            }
        }
        touched.sort_unstable();
        for &other in &touched {
            let diagonal = std::mem::take(&mut block[other as usize]);
            is_touched[other as usize] = false;
            let alpha = (diagonal[0] + diagonal[1] + diagonal[2]) / 3.0;
            let scale = (sizes[node] * sizes[other as usize]).max(f64::EPSILON * mean / n as f64);
            for (k, &v) in diagonal.iter().enumerate() {
                let deviation = (v - alpha).abs() / scale;
                if deviation > worst {
                    (worst, worst_at) = (deviation, (3 * node + k, 3 * other as usize + k));
                }
            }
            if alpha != 0.0 {
                row_idx.push(other);
                values.push(alpha);
            }
        }
        touched.clear();
        col_ptr.push(row_idx.len());
    }
    if worst > tolerance {
        let (a, b) = worst_at;
        let message = format!(
            "mass blocks deviate by {worst:.3e} from multiples of the identity (allowed {tolerance:.0e}), most between {} and {}",
            label(a),
            label(b)
        );
        return Err(Diagnostic::new(Code::MassBlockStructure, message));
    }
    // The mean of three entries is symmetric because each of them is.
    let csc = CscMatrix::from_parts(n, n, col_ptr, row_idx, values);
    Ok(ScalarMass { matrix: SymmetricMatrix::symmetrised(&csc), deviation: worst })
}
