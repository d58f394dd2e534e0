//! Motions of single nodes that move no mass, and loads on them.

use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_linalg::{CscMatrix, SparseLdl, SymmetricMatrix, contiguous_mut};
use flexbody_model::FeModel;
use nalgebra::{DMatrix, SymmetricEigen};

/// Part of the rotational mass of a node that counts as rounding. Since M is positive semidefinite, the
/// coupling of such a direction with other rows is at most the root of this part.
const ROUNDING_MASS: f64 = 1e-13;

/// Rows of the model and the components of a motion that moves no mass.
type LocalMotion = Vec<(usize, f64)>;

/// Removes the work of loads on massless motions Z of single nodes and carries their effect over to the
/// rest: f - K Z (Z'K Z)^-1 Z'f.
///
/// Modes of finite frequency respond to this part of a load only. The massless response Z (Z'K Z)^-1 Z'f
/// belongs to no mode; in a residual vector, rounding would amplify it.
///
/// # Errors
/// [`FactorizationFailed`](Code::FactorizationFailed) if K does not resist these motions.
pub(super) fn on_mass(model: &FeModel, mut loads: Mat<f64>) -> Result<Mat<f64>> {
    let motions = massless_motions(model);
    let work = |load: &[f64]| -> Vec<f64> { motions.iter().map(|motion| work_on(motion, load)).collect() };
    let is_loaded = |j: &usize| work(loads.col_as_slice(*j)).iter().any(|work| *work != 0.0);
    // Only loads that do work on massless motions change.
    let loaded: Vec<usize> = (0..loads.ncols()).filter(is_loaded).collect();
    if loaded.is_empty() {
        return Ok(loads);
    }
    let stiffness = model.stiffness();
    // Factor Z'K Z; it must be regular.
    let factor = SparseLdl::new(&stiffness_of(stiffness, &motions), 0.0)
        .filter(|factor| factor.null_rows().is_empty());
    let Some(factor) = factor else {
        let message =
            format!("loads act on {} motions without mass that the stiffness does not hold", motions.len());
        return Err(Diagnostic::new(Code::FactorizationFailed, message).into());
    };
    let mut scratch = vec![0.0; motions.len()];
    for j in loaded {
        // Amplitudes (Z'K Z)^-1 Z'f, then f - K Z times them.
        let mut amplitudes = work(loads.col_as_slice(j));
        factor.solve_in_place(1, &mut amplitudes, &mut scratch);
        let load = contiguous_mut(loads.col_mut(j));
        for (motion, amplitude) in motions.iter().zip(&amplitudes) {
            for &(row, part) in motion {
                let (columns, values) = stiffness.row(row);
                columns.iter().zip(values).for_each(|(&i, k)| load[i as usize] -= k * part * amplitude);
            }
        }
        clear(&motions, load);
    }
    Ok(loads)
}

/// Returns the work of a load on a motion.
fn work_on(motion: &LocalMotion, load: &[f64]) -> f64 {
    motion.iter().map(|&(row, part)| part * load[row]).sum()
}

/// Removes the rounding errors in the work of a load on orthonormal motions.
fn clear(motions: &[LocalMotion], load: &mut [f64]) {
    for motion in motions {
        let work = work_on(motion, load);
        motion.iter().for_each(|&(row, part)| load[row] -= work * part);
    }
}

/// Returns orthonormal motions of single nodes, and of single rows without a node, that move no mass.
fn massless_motions(model: &FeModel) -> Vec<LocalMotion> {
    let (pencil, rows) = (model.pencil(), model.rows());
    let is_empty = |row: usize| pencil.mass().row(row / pencil.block()).0.is_empty();
    let first = rows.displacements();
    let last = first + rows.rotations().len();
    let mut motions: Vec<LocalMotion> =
        (0..first).chain(last..rows.len()).filter(|&row| is_empty(row)).map(|row| vec![(row, 1.0)]).collect();
    let mut from = first;
    for of_node in rows.rotations().chunk_by(|a, b| a.0 == b.0) {
        motions.extend(massless_rotations(model, from, of_node.len()));
        from += of_node.len();
    }
    motions
}

/// Returns the directions in which the `count` rotations of a node, from row `first` on, carry no mass:
/// rotations of shells about their normal, and empty rows of M.
fn massless_rotations(model: &FeModel, first: usize, count: usize) -> Vec<LocalMotion> {
    let mass = model.pencil().mass();
    let rows = first..first + count;
    if rows.clone().all(|row| mass.row(row).0.is_empty()) {
        return rows.map(|row| vec![(row, 1.0)]).collect();
    }
    let block = DMatrix::from_fn(count, count, |i, j| mass.as_csc().get(first + i, first + j));
    let SymmetricEigen { eigenvectors, eigenvalues } = block.clone().symmetric_eigen();
    let size = block.trace();
    let is_massless = |&at: &usize| eigenvalues[at].abs() <= ROUNDING_MASS * size;
    let motion = |at: usize| rows.clone().zip(eigenvectors.column(at).iter().copied()).collect();
    (0..count).filter(is_massless).map(motion).collect()
}

/// Returns Z'K Z.
fn stiffness_of(stiffness: &SymmetricMatrix, motions: &[LocalMotion]) -> SymmetricMatrix {
    let mut parts: Vec<Vec<(u32, f64)>> = vec![Vec::new(); stiffness.n()];
    for (at, motion) in motions.iter().enumerate() {
        motion.iter().for_each(|&(row, part)| parts[row].push((at as u32, part)));
    }
    let mut entries = Vec::new();
    for (row, of_row) in parts.iter().enumerate().filter(|(_, row_parts)| !row_parts.is_empty()) {
        let (columns, values) = stiffness.row(row);
        for (&column, value) in columns.iter().zip(values) {
            for &(j, second) in &parts[column as usize] {
                entries.extend(of_row.iter().map(|&(i, first)| (i, j, first * value * second)));
            }
        }
    }
    SymmetricMatrix::symmetrised(CscMatrix::from_triplets(motions.len(), motions.len(), &entries))
}
