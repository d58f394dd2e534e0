//! The test M = Ms kron I3, block by block, and Ms itself.

use super::DofLabel;
use crate::diagnostic::{Code, Diagnostic};
use crate::linalg::{CscMatrix, SymmetricMatrix};
use rayon::prelude::*;
use std::ops::Range;

/// Nodes per parallel task: sums have fixed partitions.
const NODES: usize = 2048;

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
    let chunks: Vec<Range<usize>> = (0..n).step_by(NODES).map(|i| i..(i + NODES).min(n)).collect();
    let parts: Vec<([f64; 3], f64)> =
        chunks.par_iter().map(|nodes| directional_mass(m, nodes.clone())).collect();
    let (mut totals, mut magnitude) = ([0.0f64; 3], 0.0f64);
    for (part, part_magnitude) in parts {
        for (total, part) in totals.iter_mut().zip(part) {
            *total += part;
        }
        magnitude += part_magnitude;
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
    let size = |d: &[f64]| d.iter().fold(0.0f64, |s, d| s.max(d.abs())).sqrt();
    let sizes: Vec<f64> = diagonal.chunks_exact(3).map(size).collect();
    // Massless nodes have no scale of their own: compare with the mean nodal mass.
    let smallest = f64::EPSILON * mean / n as f64;
    let scale = |a: usize, b: usize| (sizes[a] * sizes[b]).max(smallest);
    let parts: Vec<Part> = chunks.into_par_iter().map(|nodes| reduce(m, nodes, scale)).collect();
    let entries = parts.iter().map(|part| part.row_idx.len()).sum();
    let (mut worst, mut worst_at) = (0.0f64, (0, 0));
    let mut col_ptr = Vec::with_capacity(n + 1);
    let (mut row_idx, mut values) = (Vec::with_capacity(entries), Vec::with_capacity(entries));
    col_ptr.push(0);
    for part in parts {
        let before = row_idx.len();
        col_ptr.extend(part.ends.iter().map(|end| before + end));
        row_idx.extend(part.row_idx);
        values.extend(part.values);
        if part.worst > worst {
            (worst, worst_at) = (part.worst, part.worst_at);
        }
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
    let csc = CscMatrix::from_parts(n, n, col_ptr, row_idx, values);
    let matrix = SymmetricMatrix::new(csc)
        .expect("the mean of three entries is symmetric because each of them is, to the bit");
    Ok(ScalarMass { matrix, deviation: worst })
}

/// Sum of M along each direction over the rows of some nodes, and a third of the sum of the absolute values.
fn directional_mass(m: &SymmetricMatrix, nodes: Range<usize>) -> ([f64; 3], f64) {
    let (mut totals, mut magnitude) = ([0.0f64; 3], 0.0f64);
    for node in nodes {
        for (k, total) in totals.iter_mut().enumerate() {
            let (columns, values) = m.row(3 * node + k);
            for (&j, &v) in columns.iter().zip(values) {
                if j % 3 == k as u32 {
                    *total += v;
                    magnitude += v.abs() / 3.0;
                }
            }
        }
    }
    (totals, magnitude)
}

/// Some columns of Ms, and the largest deviation of their blocks with its place in M.
#[derive(Default)]
struct Part {
    ends: Vec<usize>,
    row_idx: Vec<u32>,
    values: Vec<f64>,
    worst: f64,
    worst_at: (usize, usize),
}

/// Reduces the rows of some nodes; deviations are relative to `scale` of the two nodes.
fn reduce(m: &SymmetricMatrix, nodes: Range<usize>, scale: impl Fn(usize, usize) -> f64) -> Part {
    let mut part = Part::default();
    for node in nodes {
        let rows = [0, 1, 2].map(|k| m.row(3 * node + k));
        let mut at = [0usize; 3];
        // The three rows are merged: blocks come in the order of the other node.
        while let Some(other) = (0..3).filter_map(|k| rows[k].0.get(at[k])).min().map(|j| j / 3) {
            let scale = scale(node, other as usize);
            let mut diagonal = [0.0; 3];
            for k in 0..3 {
                let (columns, values) = rows[k];
                while let Some(&j) = columns.get(at[k]).filter(|&&j| j / 3 == other) {
                    let v = values[at[k]];
                    at[k] += 1;
                    if j as usize % 3 == k {
                        diagonal[k] = v;
                    } else {
                        part.deviates(v.abs() / scale, 3 * node + k, j as usize);
                    }
                }
            }
            let alpha = (diagonal[0] + diagonal[1] + diagonal[2]) / 3.0;
            for (k, &v) in diagonal.iter().enumerate() {
                part.deviates((v - alpha).abs() / scale, 3 * node + k, 3 * other as usize + k);
            }
            if alpha != 0.0 {
                part.row_idx.push(other);
                part.values.push(alpha);
            }
        }
        part.ends.push(part.row_idx.len());
    }
    part
}

impl Part {
    fn deviates(&mut self, by: f64, row: usize, column: usize) {
        if by > self.worst {
            (self.worst, self.worst_at) = (by, (row, column));
        }
    }
}
