//! Soft rotations: rotations of nodes that K holds by misaligned elements only, and that follow the nodes
//! around them by an added term of K. Estimates the frequencies without the term.

use faer::{Mat, MatRef};
use flexbody_linalg::{SymmetricMatrix, contiguous, symmetric_eigen};

/// Rotation of a node about a direction, which follows the displacements of the nodes around it.
#[derive(Debug, Clone, PartialEq)]
pub struct SoftRotation {
    /// Unit vector v of the direction: rows of rotations and components.
    pub direction: Vec<(u32, f64)>,
    /// g: the rotation minus that of the nodes around it.
    pub term: Vec<(u32, f64)>,
    /// Factor k of the term k g g' that K contains.
    pub stiffness: f64,
}

/// Soft rotations of a body.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SoftRotations {
    all: Vec<SoftRotation>,
}

/// Largest number of steps of the conjugate gradients that release the rotations. More steps raise the effect
/// that is found, which is a lower bound after any number.
const MAX_STEPS: usize = 200;

/// Residual moments relative to the first ones at which the rotations count as released.
const RELEASED: f64 = 1e-8;

/// Stiffness relative to k of the term that is added to every rotation while it is released. Rounding of K makes
/// the released stiffness of some rotations indefinite without it.
const LEAST_STIFFNESS: f64 = 1e-13;

impl SoftRotations {
    pub(crate) fn new(all: Vec<SoftRotation>) -> Self {
        Self { all }
    }

    /// Returns true if the body has no soft rotation.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Returns the rotations, by nodes.
    pub fn iter(&self) -> impl Iterator<Item = &SoftRotation> {
        self.all.iter()
    }

    /// Returns the rotations of the body made of the rows `kept` (ascending).
    pub(crate) fn of_body(&self, kept: &[usize]) -> Self {
        let moved = |part: &[(u32, f64)]| -> Option<Vec<(u32, f64)>> {
            let row = |row: u32| kept.binary_search(&(row as usize)).ok().map(|at| at as u32);
            part.iter().map(|&(old, value)| Some((row(old)?, value))).collect()
        };
        let of_body = |rotation: &SoftRotation| {
            let (direction, term) = (moved(&rotation.direction)?, moved(&rotation.term)?);
            Some(SoftRotation { direction, term, stiffness: rotation.stiffness })
        };
        Self { all: self.all.iter().filter_map(of_body).collect() }
    }

    /// Returns the eigenvalues, ascending, that `shapes` have without the terms of K for soft rotations, if
    /// the rotations turn freely and all else moves in the shapes.
    ///
    /// By Rayleigh's principle they are upper bounds of those of the model without the terms, if the rotations
    /// have no mass.
    ///
    /// * `stiffness`: K with the terms;
    /// * `shapes`: M-orthonormal shapes that diagonalise K (one row per row of K);
    /// * `eigenvalues`: their Rayleigh quotients.
    ///
    /// # Panics
    /// When the sizes disagree.
    pub fn released_eigenvalues(
        &self,
        stiffness: &SymmetricMatrix,
        shapes: MatRef<'_, f64>,
        eigenvalues: &[f64],
    ) -> Vec<f64> {
        assert_eq!(shapes.ncols(), eigenvalues.len(), "one eigenvalue for each shape");
        let released = Released::new(self, stiffness);
        // R = V'K Psi: moments that held the rotations; Z = (V'K V)^-1 R: rotations without the moments.
        let n = eigenvalues.len();
        let moments: Vec<Vec<f64>> = (0..n).map(|j| released.moments(contiguous(shapes.col(j)))).collect();
        let turns: Vec<Vec<f64>> = moments.iter().map(|moments| released.turns(moments)).collect();
        // K of the shapes minus the energy that turning releases.
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let condensed = Mat::from_fn(n, n, |i, j| {
            let energy = 0.5 * (dot(&moments[i], &turns[j]) + dot(&moments[j], &turns[i]));
            f64::from(i == j) * eigenvalues[i] - energy
        });
        symmetric_eigen(condensed.as_ref()).map_or_else(|| eigenvalues.to_vec(), |eigen| eigen.values)
    }
}

/// K without the terms of the soft rotations, between these rotations and all rows.
struct Released<'r> {
    rotations: &'r [SoftRotation],
    /// Rows of V'K, one for each rotation.
    rows: Vec<Vec<(u32, f64)>>,
    /// Diagonal of V'K V.
    diagonal: Vec<f64>,
    n: usize,
}

impl<'r> Released<'r> {
    fn new(soft: &'r SoftRotations, stiffness: &SymmetricMatrix) -> Self {
        let rotations = soft.all.as_slice();
        let row = |rotation: &SoftRotation| {
            // v'(K - k g g') with g'v = 1; the directions of other rotations are orthogonal to g.
            let of_stiffness = rotation.direction.iter().flat_map(|&(row, part)| {
                let (columns, values) = stiffness.row(row as usize);
                columns.iter().zip(values).map(move |(&column, &value)| (column, part * value))
            });
            let without = rotation.term.iter().map(|&(row, part)| (row, -rotation.stiffness * part));
            let mut entries: Vec<(u32, f64)> = of_stiffness.chain(without).collect();
            entries.sort_by_key(|entry| entry.0);
            let of_column = |equal: &[(u32, f64)]| (equal[0].0, equal.iter().map(|entry| entry.1).sum());
            entries.chunk_by(|a, b| a.0 == b.0).map(of_column).collect::<Vec<(u32, f64)>>()
        };
        let rows: Vec<Vec<(u32, f64)>> = rotations.iter().map(row).collect();
        let own = |(row, one): (&Vec<(u32, f64)>, &SoftRotation)| {
            let along = one.direction.iter().map(|&(at, part)| {
                row.binary_search_by_key(&at, |entry| entry.0).map_or(0.0, |found| row[found].1 * part)
            });
            along.sum::<f64>().max(0.0) + LEAST_STIFFNESS * one.stiffness
        };
        let diagonal = rows.iter().zip(rotations).map(own).collect();
        Self { rotations, rows, diagonal, n: stiffness.n() }
    }

    /// Returns the moments V'K u on the rotations for displacements u of all rows.
    fn moments(&self, u: &[f64]) -> Vec<f64> {
        let product = |row: &Vec<(u32, f64)>| row.iter().map(|&(at, value)| value * u[at as usize]).sum();
        self.rows.iter().map(product).collect()
    }

    /// Returns the moments for angles of the rotations.
    fn moments_of_turns(&self, turns: &[f64]) -> Vec<f64> {
        let mut u = vec![0.0; self.n];
        for (one, turn) in self.rotations.iter().zip(turns) {
            one.direction.iter().for_each(|&(row, part)| u[row as usize] += part * turn);
        }
        let mut moments = self.moments(&u);
        let least =
            self.rotations.iter().zip(turns).map(|(one, turn)| LEAST_STIFFNESS * one.stiffness * turn);
        moments.iter_mut().zip(least).for_each(|(moment, least)| *moment += least);
        moments
    }

    /// Returns the angles that need `moments`, by conjugate gradients with a diagonal preconditioner.
    fn turns(&self, moments: &[f64]) -> Vec<f64> {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let scaled = |r: &[f64]| r.iter().zip(&self.diagonal).map(|(r, d)| r / d).collect::<Vec<f64>>();
        let mut turns = vec![0.0; moments.len()];
        let mut residual = moments.to_vec();
        let mut direction = scaled(&residual);
        let mut size = dot(&residual, &direction);
        let first = size;
        for _ in 0..MAX_STEPS {
            if size.is_nan() || size <= RELEASED * RELEASED * first {
                break;
            }
            let product = self.moments_of_turns(&direction);
            let curvature = dot(&direction, &product);
            if curvature.is_nan() || curvature <= 0.0 {
                break;
            }
            let step = size / curvature;
            turns.iter_mut().zip(&direction).for_each(|(x, d)| *x += step * d);
            residual.iter_mut().zip(&product).for_each(|(r, p)| *r -= step * p);
            let next = scaled(&residual);
            let before = std::mem::replace(&mut size, dot(&residual, &next));
            let ratio = size / before;
            direction.iter_mut().zip(&next).for_each(|(d, z)| *d = z + ratio * *d);
        }
        turns
    }
}
