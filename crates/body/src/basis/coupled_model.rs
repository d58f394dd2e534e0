//! Model with the couplings that all modes of a body preserve: interfaces that move as rigid bodies (theory section 5);
//! and its responses to harmonic forces, for estimates.

use super::failure::explain;
use super::interface_rows::{CoupledInterface, coupled_sets};
use super::modal_basis::{problem_of_span, rigid_modes};
use faer::{Mat, MatRef};
use flexbody_base::error::Result;
use flexbody_eigen::{EigenFailure, EigenProblem, dynamic_responses_twice};
use flexbody_linalg::context::Context;
use flexbody_linalg::ties::first_largest;
use flexbody_linalg::{
    Dependents, Elimination, Pencil, ReducedPencil, combine, gram, larger, side_by_side, subtract_combination,
};
use flexbody_model::{Coupling, FeModel, NodeSet};
use nalgebra::DMatrix;
use std::borrow::Cow;
use std::collections::HashSet;
use std::ops::Range;

/// Largest deformation of a rigid interface, relative to the largest motion of any node, that rounding of
/// single-precision modes explains.
const MAX_RIGID_DEFORMATION: f64 = 1e-6;

/// Model whose rigid interfaces move as rigid bodies: u = T y, with the pencil (T'KT, T'MT). Forces and
/// displacements refer to all rows of the model. Without rigid interfaces T = 1.
pub struct CoupledModel<'m> {
    model: &'m FeModel,
    coupling: Option<RigidInterfaces>,
}

/// Rigid interfaces with several rows, which have six degrees of freedom each, in the plane three.
struct RigidInterfaces {
    joints: Vec<CoupledInterface>,
    elimination: Elimination,
    reduced: ReducedPencil,
}

impl<'m> CoupledModel<'m> {
    /// Creates a model without couplings: all interfaces deform.
    pub fn uncoupled(model: &'m FeModel) -> Self {
        Self { model, coupling: None }
    }

    /// Creates a model in which an interface of `sets` moves as a rigid body if it is declared rigid and no
    /// mode deforms it.
    ///
    /// * `vectors`: modes Psi of a body (N x nf), in the rows of the model.
    pub fn of_modes(model: &'m FeModel, sets: &[NodeSet], vectors: MatRef<'_, f64>) -> Self {
        let rigid: Vec<NodeSet> =
            sets.iter().filter(|set| set.coupling == Some(Coupling::Rigid)).cloned().collect();
        let mut taken = HashSet::new();
        let mut is_apart = |joint: &CoupledInterface| {
            let apart = !joint.rows.iter().any(|row| taken.contains(row));
            taken.extend(joint.rows.iter().copied());
            apart
        };
        let joints: Vec<CoupledInterface> = coupled_sets(model, &rigid)
            .into_iter()
            .filter(|joint| deformation(model, joint, vectors) <= MAX_RIGID_DEFORMATION && is_apart(joint))
            .collect();
        if joints.is_empty() {
            return Self::uncoupled(model);
        }
        let dependents = joints.iter().map(rigid_rows).collect();
        let elimination = Elimination::new(model.pencil().n(), &[], dependents);
        let reduced = elimination.reduced(&model.pencil());
        Self { model, coupling: Some(RigidInterfaces { joints, elimination, reduced }) }
    }

    /// Returns the model without the couplings.
    pub fn model(&self) -> &'m FeModel {
        self.model
    }

    /// Returns the names of the interfaces that move as rigid bodies.
    pub fn rigid_interfaces(&self) -> Vec<String> {
        self.coupling.iter().flat_map(|coupling| &coupling.joints).map(|joint| joint.name.clone()).collect()
    }

    /// Returns the pencil (T'KT, T'MT).
    pub fn pencil(&self) -> Pencil<'_> {
        self.coupling.as_ref().map_or_else(|| self.model.pencil(), |coupling| coupling.reduced.pencil())
    }

    /// Returns T'f (m x k), the loads on the remaining degrees of freedom due to nodal forces f (N x k).
    pub fn restrict(&self, forces: Mat<f64>) -> Mat<f64> {
        match &self.coupling {
            Some(coupling) => coupling.elimination.restrict(forces.as_ref()),
            None => forces,
        }
    }

    /// Returns T y (N x k).
    pub fn expand<'y>(&self, y: &'y Mat<f64>) -> Cow<'y, Mat<f64>> {
        match &self.coupling {
            Some(coupling) => Cow::Owned(coupling.elimination.expand(y.as_ref())),
            None => Cow::Borrowed(y),
        }
    }

    /// Returns the rigid modes in the remaining degrees of freedom (m x 6, in the plane m x 3), orthonormal
    /// in T'MT.
    ///
    /// # Errors
    /// The errors of [`rigid_modes`].
    pub fn rigid_modes(&self) -> Result<Mat<f64>> {
        let rigid = rigid_modes(self.model, &self.model.pencil())?;
        Ok(match &self.coupling {
            Some(coupling) => coupling.elimination.free_rows(rigid.as_ref()),
            None => rigid,
        })
    }

    /// Replaces the forces f at the nodes of each rigid interface by forces with equal resultants, A R'f
    /// with the rigid motions R of the interface and their averages A. Self-equilibrated forces on a rigid
    /// interface cause no motion.
    pub fn without_inner_forces(&self, forces: &mut Mat<f64>) {
        for joint in self.coupling.iter().flat_map(|coupling| &coupling.joints) {
            let resultant = gram(joint.motion(), joint.gather(forces.as_ref()).as_ref());
            let spread = combine(joint.measure(), resultant.as_ref());
            for (i, &row) in joint.rows.iter().enumerate() {
                (0..forces.ncols()).for_each(|j| forces[(row, j)] = spread[(i, j)]);
            }
        }
    }

    /// Returns the eigenproblem for response computations; there is no search and no first estimate.
    pub(super) fn problem<'a>(&'a self, rigid: MatRef<'a, f64>) -> EigenProblem<'a> {
        let whole = problem_of_span(self.model, rigid);
        match &self.coupling {
            Some(coupling) => EigenProblem { pencil: coupling.reduced.pencil(), order: None, ..whole },
            None => whole,
        }
    }
}

/// Returns the difference of the motion of an interface in the modes from the best-fitting rigid motion.
/// Displacements and rotations are each relative to the largest of any node in any mode.
fn deformation(model: &FeModel, joint: &CoupledInterface, vectors: MatRef<'_, f64>) -> f64 {
    let at_joint = joint.gather(vectors);
    let left = &at_joint - combine(joint.motion(), gram(joint.measure(), at_joint.as_ref()).as_ref());
    let largest = |a: MatRef<'_, f64>, rows: Range<usize>| {
        if rows.is_empty() { 0.0 } else { a.subrows(rows.start, rows.len()).norm_max() }
    };
    let part = |of_joint: Range<usize>, of_all: Range<usize>| match largest(left.as_ref(), of_joint) {
        0.0 => 0.0,
        left => left / largest(vectors, of_all),
    };
    let (displaced, all) = (joint.displaced_rows(), model.rows().displacements());
    let rotations = all..all + model.rows().rotations().len();
    larger(part(0..displaced, 0..all), part(displaced..at_joint.nrows(), rotations))
}

/// Solves u = R q of a rigid interface for its dependent rows. As many rows as there are rigid motions
/// determine the others; complete pivoting chooses them (three nodes far apart, one of them held in all
/// directions).
fn rigid_rows(joint: &CoupledInterface) -> Dependents {
    let Echelon { pivots, others, weights } = Echelon::new(joint.balanced().transpose().to_owned());
    // Convert from scaled displacements and rotations to the units of the model.
    let size = |row: usize| if row < joint.displaced_rows() { 1.0 } else { joint.length() };
    let weight = |i: usize, j: usize| weights[(j, i)] * size(pivots[j]) / size(others[i]);
    Dependents {
        rows: others.iter().map(|&j| joint.rows[j]).collect(),
        on: pivots.iter().map(|&j| joint.rows[j]).collect(),
        weights: Mat::from_fn(others.len(), pivots.len(), weight),
    }
}

/// Returns the responses x = (K - w^2 M)^-1 f to harmonic `loads` f (N x m) at w, and the responses
/// y = (K - w^2 M)^-1 M x to their inertia, as \[x, y\]. With x and y in its basis, a reduced model has the exact
/// transfer functions of the loads at w, and their slope. Returns `None` if w^2 is an eigenvalue to
/// rounding.
///
/// * `conditions`: C' (N x c) of a model with constraints, C x = C y = 0; `None`: the free model, without
///   rigid motion.
/// * `square`: w^2 > 0.
///
/// # Errors
/// Failures of the factorisation: exit code 3.
pub fn oscillating_responses(
    model: &CoupledModel<'_>,
    loads: Mat<f64>,
    conditions: Option<&Mat<f64>>,
    square: f64,
) -> Result<Option<Mat<f64>>> {
    let rigid = match conditions {
        Some(_) => Mat::zeros(model.pencil().n(), 0),
        None => model.rigid_modes()?,
    };
    let problem = model.problem(rigid.as_ref());
    let count = loads.ncols();
    let no_conditions = Mat::zeros(loads.nrows(), 0);
    let conditions = model.restrict(conditions.unwrap_or(&no_conditions).clone());
    // The constraint forces C'm make C x = 0: compute the response to C' together with the others.
    let (mut x, mut to_conditions) = (Mat::new(), Mat::new());
    let further = |all: &Mat<f64>| {
        to_conditions = all.as_ref().subcols(count, conditions.ncols()).to_owned();
        x = all.as_ref().subcols(0, count).to_owned();
        hold(&mut x, &conditions, &to_conditions);
        model.pencil().apply_mass(x.as_ref())
    };
    let all = side_by_side(&[model.restrict(loads).as_ref(), conditions.as_ref()]);
    let [_, mut y] = match dynamic_responses_twice(&problem, all, further, square, &Context::QUIET) {
        Ok(responses) => responses,
        Err(EigenFailure::Inaccurate { .. }) => return Ok(None),
        Err(failure) => return Err(explain(model.model(), failure)),
    };
    hold(&mut y, &conditions, &to_conditions);
    let both = side_by_side(&[x.as_ref(), y.as_ref()]);
    Ok(both.is_all_finite().then(|| model.expand(&both).into_owned()))
}

/// x <- x - X_C (C X_C)^-1 C x, with the responses X_C to the `conditions` C'. Gives NaN if the conditions
/// depend on each other.
fn hold(x: &mut Mat<f64>, conditions: &Mat<f64>, to_conditions: &Mat<f64>) {
    let count = conditions.ncols();
    if count == 0 {
        return;
    }
    let product = gram(conditions.as_ref(), to_conditions.as_ref());
    let inverse = DMatrix::from_fn(count, count, |i, j| product[(i, j)]).try_inverse();
    let inverse =
        Mat::from_fn(count, count, |i, j| inverse.as_ref().map_or(f64::NAN, |inverse| inverse[(i, j)]));
    let moved = combine(inverse.as_ref(), gram(conditions.as_ref(), x.as_ref()).as_ref());
    subtract_combination(x.as_mut(), to_conditions.as_ref(), moved.as_ref());
}

// Solution of linear conditions for some of their unknowns.

/// Reduced echelon form \[1, W\] of a matrix A (r x n) with reordered columns. Its number of rows is the
/// rank of A; the pivots are found by complete pivoting.
pub(super) struct Echelon {
    /// Columns of A that form the unit matrix, and all others.
    pub pivots: Vec<usize>,
    pub others: Vec<usize>,
    /// W (rank x others).
    pub weights: Mat<f64>,
}

impl Echelon {
    /// Pivots below this part of the first pivot count as rounding.
    const ROUNDING_PIVOT: f64 = 1e-9;

    /// Computes the echelon form of `a`.
    pub(super) fn new(mut a: Mat<f64>) -> Self {
        let (r, columns) = (a.nrows(), a.ncols());
        let mut pivots: Vec<usize> = Vec::new();
        let mut first = 0.0;
        for step in 0..r.min(columns) {
            // Largest entry among the remaining rows and columns.
            let places = (step..r).flat_map(|i| (0..columns).map(move |j| (i, j)));
            let open = places.filter(|(_, j)| !pivots.contains(j));
            let Some((i, j)) = first_largest(open, |&place| a[place].abs()) else { break };
            if step == 0 {
                first = a[(i, j)].abs();
            }
            if a[(i, j)].abs() <= Self::ROUNDING_PIVOT * first {
                break;
            }
            // Exchange rows, scale the pivot row, and eliminate its column in all other rows.
            for column in 0..columns {
                let (upper, lower) = (a[(step, column)], a[(i, column)]);
                (a[(step, column)], a[(i, column)]) = (lower, upper);
            }
            let pivot = a[(step, j)];
            (0..columns).for_each(|column| a[(step, column)] /= pivot);
            for other in (0..r).filter(|&other| other != step) {
                let factor = a[(other, j)];
                (0..columns).for_each(|column| a[(other, column)] -= factor * a[(step, column)]);
            }
            pivots.push(j);
        }
        // The remaining columns are W.
        let others: Vec<usize> = (0..columns).filter(|j| !pivots.contains(j)).collect();
        let weights = Mat::from_fn(pivots.len(), others.len(), |i, j| a[(i, others[j])]);
        Self { pivots, others, weights }
    }
}
