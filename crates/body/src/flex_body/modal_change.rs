//! Changes of the modal coordinates of a body: to mean axes, or to normalised modes in the present frame
//! (theory 5.2).

use super::rotated_stiffness::without_rotation;
use crate::invariants::{GeneralTerms, Invariants, symmetric_part};
use faer::{Mat, MatRef};
use flexbody_linalg::{dense_cholesky, solve_lower, solve_upper, symmetric_eigen};
use flexbody_model::rigid_axes;

/// Part of the squared M-norm left after removal of rigid motion, below which a combination of modes is a
/// rigid motion.
const RIGID_REMAINDER: f64 = 1e-10;

/// New modes psi' = (Psi - R(x) A) X with the rigid motions R about the origin of the frame. The span of
/// frame motion and modes does not change.
#[derive(Debug, Clone)]
pub struct ModalChange {
    /// X (nf x nf').
    modes: Mat<f64>,
    /// A (6 x nf): translation and rotation removed from each old mode; `None` if the frame stays tied to
    /// the body unchanged.
    taken: Option<Mat<f64>>,
    /// Rigid motions among the modes, which are removed.
    left_out: RigidMotions,
}

/// Rigid motions in the span of a set of modes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RigidMotions {
    /// Dimension of the span.
    pub count: usize,
    /// Modes (from 0) that are rigid motions by themselves.
    pub modes: Vec<usize>,
}

impl RigidMotions {
    /// Returns a text such as `modes 1, 4 are rigid motions` or `3 combinations of the modes are rigid
    /// motions`; `None` if there are none.
    pub fn in_words(&self) -> Option<String> {
        let named =
            |modes: &[usize]| modes.iter().map(|j| (j + 1).to_string()).collect::<Vec<_>>().join(", ");
        match (self.count, self.modes.len()) {
            (0, _) => None,
            (1, 1) => Some(format!("mode {} is a rigid motion", named(&self.modes))),
            (count, rigid) if count == rigid => {
                Some(format!("modes {} are rigid motions", named(&self.modes)))
            }
            (1, _) => Some("a combination of the modes is a rigid motion".to_owned()),
            (count, 0) => Some(format!("{count} combinations of the modes are rigid motions")),
            (count, _) => Some(format!(
                "{count} combinations of the modes are rigid motions, among them modes {}",
                named(&self.modes)
            )),
        }
    }
}

/// Coupling of the modes with rigid motion by the mass.
pub(super) struct RigidCoupling {
    axes: &'static [usize],
    /// Lower Cholesky factor L of the mass of rigid motion.
    lower: Mat<f64>,
    /// L^-1 C with the coupling C of rigid motions and modes.
    whitened: Mat<f64>,
}

impl RigidCoupling {
    /// Returns the coupling; `None` if the mass of rigid motion is not positive definite. `mass` is that of rigid motion
    /// and modes together.
    pub(super) fn new(mass: &Mat<f64>, dimension: usize) -> Option<Self> {
        let axes = rigid_axes(dimension);
        let rigid = Mat::from_fn(axes.len(), axes.len(), |i, j| mass[(axes[i], axes[j])]);
        let coupling = Mat::from_fn(axes.len(), mass.ncols() - 6, |i, j| mass[(axes[i], 6 + j)]);
        let lower = dense_cholesky(rigid)?;
        let whitened = solve_lower(&lower, &coupling);
        Some(Self { axes, lower, whitened })
    }

    /// Returns A (6 x nf): the rigid motion nearest to each mode in the M-norm.
    pub(super) fn nearest(&self) -> Mat<f64> {
        let nearest = solve_upper(&self.lower, &self.whitened);
        let row = |k: usize| self.axes.iter().position(|axis| *axis == k);
        Mat::from_fn(6, nearest.ncols(), |k, j| row(k).map_or(0.0, |row| nearest[(row, j)]))
    }
}

/// Modes split into a rigid part and deformation.
struct Split {
    /// A (6 x nf): the rigid motion nearest to each mode in the M-norm.
    rigid: Mat<f64>,
    /// Z (nf x nf'): combinations of the modes that deform the body, orthonormal in m_ff and orthogonal in
    /// the mass without rigid motion.
    deforming: Mat<f64>,
    /// Part of the squared M-norm of each combination left after removal of rigid motion.
    left: Vec<f64>,
    rigid_motions: RigidMotions,
}

impl Split {
    fn new(invariants: &Invariants, dimension: usize) -> Result<Self, String> {
        let nf = invariants.n_modes();
        let mass = invariants.mass_matrix();
        let Some(coupling) = RigidCoupling::new(&mass, dimension) else {
            return Err("the mass matrix of rigid motion is not positive definite".to_owned());
        };
        let whitened = &coupling.whitened;
        let modal = Mat::from_fn(nf, nf, |i, j| mass[(6 + i, 6 + j)]);
        let beside = |i: usize, j: usize| {
            modal[(i, j)] - (0..whitened.nrows()).map(|k| whitened[(k, i)] * whitened[(k, j)]).sum::<f64>()
        };
        let remainder = |j: usize| beside(j, j) / modal[(j, j)];
        if let Some(j) = (0..nf).find(|&j| remainder(j) < -RIGID_REMAINDER) {
            return Err(format!(
                "mode {} and rigid motion together have negative kinetic energy: mass, coupling and modal mass contradict each other",
                j + 1
            ));
        }
        // m_ff without rigid motion, relative to m_ff: its eigenvalues are the squared sines of the angles
        // to rigid motion.
        let Some(modal_lower) = dense_cholesky(modal.clone()) else {
            return Err("modes depend on each other: their mass matrix is not positive definite".to_owned());
        };
        let half = solve_lower(&modal_lower, &Mat::from_fn(nf, nf, beside));
        let relative = symmetric_part(&solve_lower(&modal_lower, &half.transpose().to_owned()));
        let Some(eigen) = symmetric_eigen(relative.as_ref()) else {
            return Err("the modal mass holds numbers that are not finite".to_owned());
        };
        let count = eigen.values.iter().filter(|left| **left <= RIGID_REMAINDER).count();
        if count == nf {
            return Err("all modes are rigid motions: nothing deforms the body".to_owned());
        }
        let vectors = eigen.vectors.as_ref().subcols(count, nf - count).to_owned();
        Ok(Self {
            rigid: coupling.nearest(),
            deforming: solve_upper(&modal_lower, &vectors),
            left: eigen.values[count..].to_vec(),
            rigid_motions: RigidMotions {
                count,
                modes: (0..nf).filter(|&j| remainder(j) <= RIGID_REMAINDER).collect(),
            },
        })
    }
}

/// Returns the rigid motions among the modes of a body in space.
///
/// # Errors
/// A text with the reason if the mass data belong to no physical body.
pub fn rigid_motions(invariants: &Invariants) -> Result<RigidMotions, String> {
    Split::new(invariants, 3).map(|split| split.rigid_motions)
}

impl ModalChange {
    /// Returns the change to mean axes: removes the rigid part of the modes and normalises them.
    ///
    /// # Errors
    /// A text with the reason: modes that depend on each other or deform nothing, or a stiffness that is
    /// not positive.
    pub(crate) fn to_mean_axes(invariants: &Invariants, dimension: usize) -> Result<Self, String> {
        let split = Split::new(invariants, dimension)?;
        // Scale Z to be orthonormal in the mass without rigid motion.
        let scaled = Mat::from_fn(split.deforming.nrows(), split.left.len(), |i, j| {
            split.deforming[(i, j)] / split.left[j].sqrt()
        });
        let modes = eigenmodes(invariants, &scaled)?;
        Ok(Self { modes, taken: Some(split.rigid), left_out: split.rigid_motions })
    }

    /// Returns the change to normalised modes in the present frame: rigid motions among the modes are
    /// removed, m_ff becomes the unit matrix and K_ff diagonal.
    ///
    /// # Errors
    /// The errors of `ModalChange::to_mean_axes`.
    pub fn in_present_frame(invariants: &Invariants, dimension: usize) -> Result<Self, String> {
        let split = Split::new(invariants, dimension)?;
        let modes = eigenmodes(invariants, &split.deforming)?;
        Ok(Self { modes, taken: None, left_out: split.rigid_motions })
    }

    /// Returns the change to normalised modes in the span of `basis` (nf x nf'), orthonormal combinations of modes in the
    /// present frame whose mass is the unit matrix.
    ///
    /// # Errors
    /// A text with the reason: a stiffness that is not positive.
    pub(super) fn in_span(invariants: &Invariants, basis: &Mat<f64>) -> Result<Self, String> {
        let modes = eigenmodes(invariants, basis)?;
        Ok(Self { modes, taken: None, left_out: RigidMotions::default() })
    }

    /// Returns X (nf x nf').
    pub(super) fn modes(&self) -> &Mat<f64> {
        &self.modes
    }

    /// Returns the rigid motion (6 x nf) that is removed from each old mode; `None` if none is.
    pub(super) fn taken(&self) -> Option<&Mat<f64>> {
        self.taken.as_ref()
    }

    /// Returns the rigid motions among the modes, which are removed.
    pub fn left_out(&self) -> &RigidMotions {
        &self.left_out
    }

    /// Returns T ((nf + 3) x (nf' + 3)) of the new modes and unit rotations from the old ones.
    pub(super) fn beside_rotations(&self) -> Mat<f64> {
        let none = Mat::zeros(3, self.modes.nrows());
        let rotations = self.taken.as_ref().map_or(none.as_ref(), |taken| taken.as_ref().subrows(3, 3));
        without_rotation(rotations, &self.modes)
    }

    /// Returns X'A X.
    pub fn congruent(&self, a: &Mat<f64>) -> Mat<f64> {
        symmetric_part(&(self.modes.transpose() * a * &self.modes))
    }

    /// Returns rows of the old modes (rows x nf) that rigid motion does not change, in the new modes: A X.
    pub(crate) fn combined(&self, rows: &Mat<f64>) -> Mat<f64> {
        rows * &self.modes
    }

    /// Returns the displacements of nodes (3n x nf) at `positions` in the new modes.
    pub fn shapes(&self, shape: &Mat<f64>, positions: &[[f64; 3]]) -> Mat<f64> {
        match &self.taken {
            Some(taken) => shapes_without(taken, shape, positions) * &self.modes,
            None => shape * &self.modes,
        }
    }

    /// Returns the rotations of nodes (3n x nf) in the new modes. Nodes without rotations have zero rows.
    ///
    /// * `shape`: displacements of the nodes in the old modes.
    pub fn rotations(&self, rotation: &Mat<f64>, shape: &Mat<f64>) -> Mat<f64> {
        match &self.taken {
            Some(taken) => rotations_without(taken, rotation, shape) * &self.modes,
            None => rotation * &self.modes,
        }
    }

    /// Returns the invariants in the new modes (see [`Invariants::without_rigid_motion`] for masses that do
    /// not commute with rotations).
    pub fn invariants(&self, old: &Invariants) -> Invariants {
        let tied = self.taken.as_ref().map(|taken| old.without_rigid_motion(taken.as_ref()));
        normalised(tied.as_ref().unwrap_or(old).with_basis(self.modes.as_ref()))
    }
}

/// Returns the invariants with the unit matrix as modal mass, if they store a modal mass.
fn normalised(new: Invariants) -> Invariants {
    let Some(general) = new.general().cloned() else { return new };
    let (groups, count) = (new.groups(), new.n_modes());
    new.with_general(GeneralTerms { modal_mass: Mat::identity(count, count), ..general }).with_groups(groups)
}

/// Returns the diagonal of K_ff, ascending: rounding may have exchanged repeated entries.
pub fn diagonal_eigenvalues(invariants: &Invariants) -> Vec<f64> {
    let mut largest = 0.0f64;
    let mut next = |j: usize| {
        largest = largest.max(invariants.modal_stiffness()[(j, j)]);
        largest
    };
    (0..invariants.n_modes()).map(&mut next).collect()
}

/// Returns the residuals |K x - lambda x| / (2 lambda) of the unit vectors x in the reduced stiffness.
pub fn reduced_residuals(invariants: &Invariants, eigenvalue: &[f64]) -> Vec<f64> {
    let k = invariants.modal_stiffness();
    let beside = |j: usize| (0..eigenvalue.len()).filter(|i| *i != j).map(|i| k[(i, j)].powi(2)).sum::<f64>();
    eigenvalue.iter().enumerate().map(|(j, l)| beside(j).sqrt() / (2.0 * l)).collect()
}

/// Returns the eigenmodes of K_ff in the span of `basis` (nf x nf'), whose mass is the unit matrix.
fn eigenmodes(invariants: &Invariants, basis: &Mat<f64>) -> Result<Mat<f64>, String> {
    let stiffness = symmetric_part(&(basis.transpose() * invariants.modal_stiffness() * basis));
    let eigen = symmetric_eigen(stiffness.as_ref());
    let Some(eigen) = eigen.filter(|eigen| eigen.values.first().is_some_and(|first| *first > 0.0)) else {
        return Err("the stiffness of the modes is not positive definite beside their mass".to_owned());
    };
    let mut modes = basis * &eigen.vectors;
    for j in 0..modes.ncols() {
        // Choose the sign that makes the largest component of each mode positive.
        let larger = |a: f64, b: &f64| if b.abs() > a.abs() { *b } else { a };
        if modes.col(j).iter().fold(0.0, larger) < 0.0 {
            (0..modes.nrows()).for_each(|i| modes[(i, j)] = -modes[(i, j)]);
        }
    }
    Ok(modes)
}

// Removal of rigid motion from the modes at nodes: psi'_j(x) = psi_j(x) - t_j - theta_j x x.

/// Returns the displacements of nodes (3n x nf) at `positions` without the translations and rotations
/// `taken` (6 x nf) about the origin.
pub(super) fn shapes_without(taken: &Mat<f64>, shape: &Mat<f64>, positions: &[[f64; 3]]) -> Mat<f64> {
    Mat::from_fn(shape.nrows(), shape.ncols(), |row, j| {
        let (x, k) = (positions[row / 3], row % 3);
        let (l, m) = ((k + 1) % 3, (k + 2) % 3);
        shape[(row, j)] - (taken[(k, j)] + taken[(3 + l, j)] * x[m] - taken[(3 + m, j)] * x[l])
    })
}

/// Returns the rotations of nodes (3n x nf) without those of `taken` (6 x nf); nodes without rotations keep
/// their zeros. `shape` has the displacements in the same modes.
pub(super) fn rotations_without(taken: &Mat<f64>, rotation: &Mat<f64>, shape: &Mat<f64>) -> Mat<f64> {
    let known = NodesWithRotations::new(shape.as_ref(), rotation.as_ref());
    let turns: Vec<bool> = (0..rotation.nrows() / 3).map(|node| known.has(node)).collect();
    Mat::from_fn(rotation.nrows(), rotation.ncols(), |row, j| {
        if turns[row / 3] { rotation[(row, j)] - taken[(3 + row % 3, j)] } else { 0.0 }
    })
}

/// Displacement relative to the largest of the modes below which a node counts as at rest in all modes: what rounding
/// leaves of the motion that was taken from them.
const MAX_REST: f64 = 1e-10;

/// Nodes whose rotations are known, by the displacements and rotations of all nodes in the modes (3n x nf each). Nodes
/// without rotations have zeros. So has the node to which the frame is fixed, at rest in every mode; it has rotations.
pub(super) struct NodesWithRotations<'m> {
    shape: MatRef<'m, f64>,
    rotation: MatRef<'m, f64>,
    rest: f64,
}

impl<'m> NodesWithRotations<'m> {
    pub(super) fn new(shape: MatRef<'m, f64>, rotation: MatRef<'m, f64>) -> Self {
        Self { shape, rotation, rest: MAX_REST * shape.norm_max() }
    }

    /// Returns true if the rotations of `node` are known.
    pub(super) fn has(&self, node: usize) -> bool {
        let largest = |of: MatRef<'_, f64>| of.subrows(3 * node, 3).norm_max();
        largest(self.rotation) != 0.0 || largest(self.shape) <= self.rest
    }
}

/// Returns the translations stacked over the rotations (6 x nf).
pub(super) fn stacked(translation: &Mat<f64>, rotation: &Mat<f64>) -> Mat<f64> {
    let entry = |i: usize, j: usize| if i < 3 { translation[(i, j)] } else { rotation[(i - 3, j)] };
    Mat::from_fn(6, translation.ncols(), entry)
}
