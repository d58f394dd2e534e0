//! Test of M = Ms kron I_d for the displacements, block by block (d: the dimension), and computation of Ms.

use crate::rows::Rows;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::numbers::significant;
use flexbody_linalg::ties::TIE_MARGIN;
use flexbody_linalg::{CscMatrix, SymmetricMatrix, parallel};
use std::ops::Range;

/// Number of nodes per parallel task: sums have fixed partitions.
const NODES_PER_TASK: usize = 2048;

/// Form of the mass matrix.
pub(crate) struct MassForm {
    /// Ms (nodes, then vectors without a position): the common entry of all directions of the displacements
    /// or, if they differ, their mean.
    pub scalar: SymmetricMatrix,
    /// True if every block is exactly a multiple of the identity, so that Ms is M as stored.
    pub exact: bool,
    /// Largest deviation of a block from a multiple of the identity, relative to sqrt(alpha_ii alpha_jj),
    /// and its rows.
    pub deviation: f64,
    pub worst: (usize, usize),
    /// True if M = Ms kron I_d to rounding, and no other row carries mass.
    pub commutes: bool,
}

/// Reduces the displacements of M (internal order, symmetric) to Ms. Deviations up to `tolerance` are
/// rounding.
///
/// # Errors
/// [`MassNotPositive`](Code::MassNotPositive) and [`MassDirectional`](Code::MassDirectional) for a mass
/// that belongs to no physical body.
pub(crate) fn mass_form(m: &SymmetricMatrix, rows: &Rows, tolerance: f64) -> Result<MassForm, Diagnostic> {
    let dimension = rows.dimension;
    let displacements = rows.displacements();
    let n = displacements / dimension;
    let parts = parallel::map(parallel::ranges(rows.nodes, NODES_PER_TASK), |nodes| {
        directional_mass(m, dimension, dimension * rows.nodes, nodes)
    });
    let (mut totals, mut magnitude) = ([0.0f64; 3], 0.0f64);
    for (part, part_magnitude) in parts {
        for (total, part) in totals.iter_mut().zip(part) {
            *total += part;
        }
        magnitude += part_magnitude;
    }
    let totals = &totals[..dimension];
    let mean = totals.iter().sum::<f64>() / dimension as f64;
    if mean.is_nan() || mean <= tolerance * magnitude {
        let message = format!("total mass is {}", significant(mean, 6));
        return Err(Diagnostic::new(Code::MassNotPositive, message));
    }
    let spread = totals.iter().fold(0.0f64, |s, t| s.max((t - mean).abs())) / mean;
    if spread > tolerance.max(1e-9) {
        let along: Vec<String> = totals
            .iter()
            .zip(["x", "y", "z"])
            .map(|(total, axis)| format!("{} along {axis}", significant(*total, 12)))
            .collect();
        let message = format!("total mass is {}", along.join(", "));
        return Err(Diagnostic::new(Code::MassDirectional, message));
    }
    let diagonal = m.diagonal();
    let size = |d: &[f64]| d.iter().fold(0.0f64, |s, d| s.max(d.abs())).sqrt();
    let sizes: Vec<f64> = diagonal[..displacements].chunks_exact(dimension).map(size).collect();
    // Massless nodes have no scale of their own: compare with the mean nodal mass.
    let smallest = f64::EPSILON * mean / n as f64;
    let scale = |a: usize, b: usize| (sizes[a] * sizes[b]).max(smallest);
    let parts = parallel::map(parallel::ranges(n, NODES_PER_TASK), |nodes| {
        reduce(m, dimension, displacements, nodes, scale)
    });
    let mut form = joined(n, parts);
    form.commutes = form.deviation <= tolerance && (displacements..m.n()).all(|row| m.row(row).0.is_empty());
    Ok(form)
}

/// Joins Ms (n x n) from its column parts and finds the largest deviation of a block with its position;
/// `commutes` is still to be set.
fn joined(n: usize, parts: Vec<Partial>) -> MassForm {
    let (mut deviation, mut worst, mut exact) = (0.0f64, (0, 0), true);
    let mut columns = Vec::with_capacity(parts.len());
    for part in parts {
        columns.push(part.columns);
        exact &= !part.differs;
        if part.worst > deviation * (1.0 + TIE_MARGIN) {
            (deviation, worst) = (part.worst, part.worst_at);
        }
    }
    let scalar = SymmetricMatrix::new(Columns::joined(n, columns))
        .expect("the mean of entries is symmetric because each of them is, to the bit");
    MassForm { scalar, exact, deviation, worst, commutes: false }
}

/// Returns the sum of M along each direction over the rows of some nodes and the columns up to `end`, and
/// the mean of the sums of the absolute values.
fn directional_mass(
    m: &SymmetricMatrix,
    dimension: usize,
    end: usize,
    nodes: Range<usize>,
) -> ([f64; 3], f64) {
    let (mut totals, mut magnitude) = ([0.0f64; 3], 0.0f64);
    for node in nodes {
        for (k, total) in totals[..dimension].iter_mut().enumerate() {
            let (columns, values) = m.row(dimension * node + k);
            for (&j, &v) in columns.iter().zip(values).take_while(|(j, _)| (**j as usize) < end) {
                if j as usize % dimension == k {
                    *total += v;
                    magnitude += v.abs() / dimension as f64;
                }
            }
        }
    }
    (totals, magnitude)
}

/// Some columns of Ms, and the largest deviation of their blocks with its position in M.
#[derive(Default)]
struct Partial {
    columns: Columns,
    worst: f64,
    worst_at: (usize, usize),
    /// True if a block is not exactly a multiple of the identity.
    differs: bool,
}

/// Reduces the rows of some nodes and the columns up to `end`; deviations are relative to `scale` of the
/// two nodes.
fn reduce(
    m: &SymmetricMatrix,
    dimension: usize,
    end: usize,
    nodes: Range<usize>,
    scale: impl Fn(usize, usize) -> f64,
) -> Partial {
    let d = dimension as u32;
    let mut part = Partial::default();
    for node in nodes {
        let row = |k: usize| {
            let (columns, values) = m.row(dimension * node + k);
            let count = columns.partition_point(|&j| (j as usize) < end);
            (&columns[..count], &values[..count])
        };
        let rows: Vec<_> = (0..dimension).map(row).collect();
        let mut at = [0usize; 3];
        // The rows are merged: blocks come in the order of the other node.
        while let Some(other) = (0..dimension).filter_map(|k| rows[k].0.get(at[k])).min().map(|j| j / d) {
            let scale = scale(node, other as usize);
            let mut diagonal = [0.0; 3];
            for k in 0..dimension {
                let (columns, values) = rows[k];
                while let Some(&j) = columns.get(at[k]).filter(|&&j| j / d == other) {
                    let v = values[at[k]];
                    at[k] += 1;
                    if j as usize % dimension == k {
                        diagonal[k] = v;
                    } else {
                        part.differs |= v != 0.0;
                        part.deviates(v.abs() / scale, dimension * node + k, j as usize);
                    }
                }
            }
            let diagonal = &diagonal[..dimension];
            let alpha = mean(diagonal);
            for (k, &v) in diagonal.iter().enumerate() {
                let (row, column) = (dimension * node + k, dimension * other as usize + k);
                part.differs |= v != alpha;
                part.deviates((v - alpha).abs() / scale, row, column);
            }
            part.columns.push(other as usize, alpha);
        }
        part.columns.end();
    }
    part
}

/// Returns the mean of the values; equal values are returned as they are, since a sum would round.
fn mean(values: &[f64]) -> f64 {
    if values.iter().all(|value| *value == values[0]) {
        return values[0];
    }
    values.iter().sum::<f64>() / values.len() as f64
}

impl Partial {
    fn deviates(&mut self, by: f64, row: usize, column: usize) {
        if by > self.worst * (1.0 + TIE_MARGIN) {
            (self.worst, self.worst_at) = (by, (row, column));
        }
    }
}

/// Columns of a sparse matrix, one after the other.
#[derive(Default)]
pub(crate) struct Columns {
    ends: Vec<usize>,
    row_idx: Vec<u32>,
    values: Vec<f64>,
}

impl Columns {
    /// Creates `count` columns without entries.
    pub(crate) fn empty(count: usize) -> Self {
        Self { ends: vec![0; count], ..Self::default() }
    }

    /// Adds an entry to the present column, unless it is zero; rows must ascend.
    pub(crate) fn push(&mut self, row: usize, value: f64) {
        if value != 0.0 {
            self.row_idx.push(row as u32);
            self.values.push(value);
        }
    }

    /// Ends the present column.
    pub(crate) fn end(&mut self) {
        self.ends.push(self.row_idx.len());
    }

    /// Returns the n x n matrix whose columns are these parts in their order.
    pub(crate) fn joined(n: usize, parts: Vec<Self>) -> CscMatrix {
        let entries = parts.iter().map(|part| part.values.len()).sum();
        let (mut row_idx, mut values) = (Vec::with_capacity(entries), Vec::with_capacity(entries));
        let mut col_ptr = Vec::with_capacity(n + 1);
        col_ptr.push(0);
        for part in parts {
            let before = row_idx.len();
            col_ptr.extend(part.ends.iter().map(|end| before + end));
            row_idx.extend(part.row_idx);
            values.extend(part.values);
        }
        CscMatrix::from_parts(n, n, col_ptr, row_idx, values)
    }
}
