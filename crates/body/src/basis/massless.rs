//! Motions of single nodes that move no mass, loads on them, and shapes that are hardly more than such motions.

use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_linalg::{
    CscMatrix, SparseLdl, SymmetricMatrix, combine, contiguous_mut, gram, multiply, side_by_side,
    symmetric_eigen,
};
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
    let Some(factor) = factor_of(stiffness, &motions) else {
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

/// Returns the factor of Z'K Z; `None` if it is singular.
fn factor_of(stiffness: &SymmetricMatrix, motions: &[LocalMotion]) -> Option<SparseLdl> {
    SparseLdl::new(&stiffness_of(stiffness, motions), 0.0).filter(|factor| factor.null_rows().is_empty())
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

// Shapes whose energy is that of motions without mass.

/// Part of the elastic energy of a shape that is left when all massless motions follow elastic forces, its masses in place,
/// below which the shape carries nearly no mass. The eigenvalue of a mode of such shapes is a hundred times what its
/// masses make of it and more, and without bound: on a lumped frame of ten beams with the motions of two interfaces and
/// 10, 14, 18 and 20 of 27 fixed-interface modes the highest modes were at 1.4, 34, 880 and 18,000 times the highest
/// frequency of the frame. A larger value leaves out local flexibility of interfaces that the modes resolve.
const MIN_ENERGY_OF_MASSES: f64 = 0.01;

/// Part of the energy of a shape that is left when massless motions follow, below which its masses move by rounding only.
const ROUNDING_ENERGY: f64 = 1e-9;

/// Energy of a shape, relative to the sum of those of its single rows, above which [`ROUNDING_ENERGY`] of it is more than the
/// rounding of its sums. The energy of local motions is of the order of that of their rows.
const MIN_LOCAL_ENERGY: f64 = 1e-6;

/// Energy of a combination of shapes of unit energy below which the combination is a rigid motion.
const RIGID_ENERGY: f64 = 1e-10;

/// Massless motions Z of the nodes of a model, which follow elastic forces.
pub(super) struct MasslessMotions<'m> {
    stiffness: &'m SymmetricMatrix,
    motions: Vec<LocalMotion>,
    /// Factor of Z'K Z.
    factor: SparseLdl,
}

impl<'m> MasslessMotions<'m> {
    /// Returns the motions; `None` if there are none, or K does not resist them.
    pub(super) fn new(model: &'m FeModel) -> Option<Self> {
        let of_nodes = model.rows().displacements() + model.rows().rotations().len();
        let moves_nodes = |motion: &LocalMotion| motion.iter().all(|(row, _)| *row < of_nodes);
        let motions: Vec<LocalMotion> = massless_motions(model).into_iter().filter(moves_nodes).collect();
        let (stiffness, is_some) = (model.stiffness(), !motions.is_empty());
        let factor = is_some.then(|| factor_of(stiffness, &motions)).flatten()?;
        Some(Self { stiffness, motions, factor })
    }

    /// Returns true if a shape (N x 1) moves no mass but by rounding. A rigid motion, whose energy is rounding, does.
    pub(super) fn make_up(&self, shape: MatRef<'_, f64>) -> bool {
        let [whole, of_masses] = self.energies(shape).map(|energy| energy[(0, 0)]);
        let of_rows: f64 =
            self.stiffness.diagonal().into_iter().zip(shape.col(0).iter()).map(|(k, s)| k * s * s).sum();
        whole > MIN_LOCAL_ENERGY * of_rows && of_masses < ROUNDING_ENERGY * whole
    }

    /// Removes the combinations of the M-orthonormal `vectors` (N x k) that carry nearly no mass. Returns `None` if there are
    /// none.
    pub(super) fn removed_from(&self, vectors: &Mat<f64>) -> Option<ShapesWithMass> {
        let (parts, combinations) = combinations(&self.energies(vectors.as_ref()), vectors.ncols())?;
        let removed = parts.partition_point(|part| *part < MIN_ENERGY_OF_MASSES);
        if removed == 0 {
            return None;
        }
        // The combinations have unit energy: the largest square of the M-norm is one over the lowest eigenvalue.
        let (left_out, retained) = combinations.as_ref().split_at_col(removed);
        let masses = symmetric_eigen(gram(left_out, left_out).as_ref())?;
        let from = masses.values.last().map_or(f64::INFINITY, |mass| 1.0 / mass);
        let vectors = combine(vectors.as_ref(), orthonormal(retained)?.as_ref());
        Some(ShapesWithMass { vectors, removed, from })
    }

    /// Returns the elastic energies of shapes (N x k): V'K V, and what is left of it when massless motions follow,
    /// V'K V - V'K Z (Z'K Z)^-1 Z'K V.
    fn energies(&self, shapes: MatRef<'_, f64>) -> [Mat<f64>; 2] {
        let mut forces = Mat::zeros(shapes.nrows(), shapes.ncols());
        multiply(self.stiffness, 1, shapes, forces.as_mut());
        let whole = gram(shapes, forces.as_ref());
        let works = Mat::from_fn(self.motions.len(), shapes.ncols(), |i, j| {
            self.motions[i].iter().map(|&(row, part)| part * forces[(row, j)]).sum()
        });
        let (mut amplitudes, mut scratch) = (works.clone(), vec![0.0; self.motions.len()]);
        for column in amplitudes.col_iter_mut() {
            self.factor.solve_in_place(1, contiguous_mut(column), &mut scratch);
        }
        let of_masses = &whole - gram(works.as_ref(), amplitudes.as_ref());
        [whole, of_masses]
    }

    /// Returns the largest number of leading columns of `fixed` (N x m) that, with all of `others`, have no more
    /// combinations without mass than `others` alone. Returns `None` if an energy is not finite.
    pub(super) fn most_beside(&self, fixed: &Mat<f64>, others: &Mat<f64>) -> Option<usize> {
        let energies = self.energies(side_by_side(&[others.as_ref(), fixed.as_ref()]).as_ref());
        let massless = |count: usize| {
            let (parts, _) = combinations(&energies, others.ncols() + count)?;
            Some(parts.partition_point(|part| *part < MIN_ENERGY_OF_MASSES))
        };
        // More shapes have no fewer such combinations.
        let (least, mut from, mut to) = (massless(0)?, 0, fixed.ncols());
        while from < to {
            let middle = (from + to).div_ceil(2);
            if massless(middle)? <= least { from = middle } else { to = middle - 1 }
        }
        Some(from)
    }
}

/// Shapes without the combinations that carry nearly no mass.
pub(super) struct ShapesWithMass {
    /// Shapes, M-orthonormal and in elastic equilibrium with the combinations that are left out.
    pub vectors: Mat<f64>,
    /// Number of combinations left out.
    pub removed: usize,
    /// Lowest eigenvalue that a mode of these combinations would have.
    pub from: f64,
}

/// Returns the combinations of the first `count` shapes that deform the body, K-orthogonal and of unit energy, with the
/// part of their energy that is left when massless motions follow, ascending. Returns `None` if an energy is not finite.
fn combinations([whole, of_masses]: &[Mat<f64>; 2], count: usize) -> Option<(Vec<f64>, Mat<f64>)> {
    let sizes: Vec<f64> = (0..count).map(|i| whole[(i, i)].max(f64::MIN_POSITIVE).sqrt()).collect();
    let scaled = |a: &Mat<f64>| {
        Mat::from_fn(count, count, |i, j| 0.5 * (a[(i, j)] + a[(j, i)]) / (sizes[i] * sizes[j]))
    };
    let whole = symmetric_eigen(scaled(whole).as_ref())?;
    let rigid = whole.values.partition_point(|energy| *energy <= RIGID_ENERGY);
    let unit = Mat::from_fn(count, count - rigid, |i, j| {
        whole.vectors[(i, rigid + j)] / whole.values[rigid + j].sqrt()
    });
    let part = gram(unit.as_ref(), combine(scaled(of_masses).as_ref(), unit.as_ref()).as_ref());
    let part = symmetric_eigen(part.as_ref())?;
    let unit = combine(unit.as_ref(), part.vectors.as_ref());
    Some((part.values, Mat::from_fn(count, unit.ncols(), |i, j| unit[(i, j)] / sizes[i])))
}

/// Returns orthonormal columns of the same span. Returns `None` if an entry is not finite.
fn orthonormal(of: MatRef<'_, f64>) -> Option<Mat<f64>> {
    let sizes: Vec<f64> = of.col_iter().map(|column| column.norm_l2()).collect();
    let unit = Mat::from_fn(of.nrows(), of.ncols(), |i, j| of[(i, j)] / sizes[j]);
    let eigen = symmetric_eigen(gram(unit.as_ref(), unit.as_ref()).as_ref())?;
    let root = |i: usize, j: usize| eigen.vectors[(i, j)] / eigen.values[j].sqrt();
    Some(combine(unit.as_ref(), Mat::from_fn(sizes.len(), sizes.len(), root).as_ref()))
}
