//! Interfaces with all coordinates prescribed at once: the motions that leave the coordinates zero, and the
//! unit motions.
//!
//! Rigid and free interfaces prescribe the displacements of their nodes. An averaging interface prescribes
//! only the mean of its nodes, which may belong to other interfaces as well. Averaging interfaces that
//! share nodes form one set of conditions C'u = q; nodes of rigid and free interfaces enter it with their
//! prescribed displacements. The conditions are well posed if they are independent on the rows that are not
//! prescribed otherwise.

use super::coupled_model::Echelon;
use super::interface_rows::CoupledInterface;
use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_eigen::EigenFailure;
use flexbody_linalg::{Dependents, Elimination, combine, gram, symmetric_eigen};
use flexbody_model::{Coupling, FeModel, InterfaceMotion};
use std::collections::HashMap;

/// Smallest singular value of the conditions of averaging interfaces that share nodes, each interface
/// orthonormal by itself, above which the conditions count as independent. The static shapes lose as many
/// digits as this value lies below one.
const MIN_SINGULAR_VALUE: f64 = 1e-4;

/// Checks that the coordinates of all `joints` can be prescribed at once, and that the body is held if they
/// are zero.
///
/// # Errors
/// [`InterfaceCoupling`](Code::InterfaceCoupling) and [`InterfaceShared`](Code::InterfaceShared), one
/// diagnostic per conflict.
pub(super) fn check_prescribable(model: &FeModel, joints: &[CoupledInterface]) -> Result<()> {
    let mut found: Vec<Diagnostic> =
        joints.iter().filter(|joint| !joint.determined).map(|joint| undetermined(model, joint)).collect();
    if found.is_empty() {
        found.extend(dependent_on_others(model, joints));
    }
    if found.is_empty() {
        found.extend(body_not_held(model, joints));
    }
    if found.is_empty() { Ok(()) } else { Err(Error::new(found)) }
}

/// Returns the set (point or line) that must not contain all nodes, and the number of nodes that determine
/// all rotations.
fn determining(dimension: usize) -> (&'static str, &'static str) {
    if dimension == 2 {
        ("one point", "two nodes")
    } else {
        ("one line", "three nodes that do not lie on one line")
    }
}

/// Returns the error for an interface whose nodes do not determine its coordinates.
fn undetermined(model: &FeModel, joint: &CoupledInterface) -> Diagnostic {
    if joint.coupling == Coupling::Free {
        let message =
            format!("nodes of the free interface `{}` have only some of their rotations", joint.name);
        let help = "give it nodes with all rotations, nodes with none, or another coupling";
        return Diagnostic::new(Code::InterfaceCoupling, message).with_help(help);
    }
    let (place, least) = determining(model.dimension());
    let message = format!(
        "interface `{}` has {} nodes on {place}: their motion determines no rotation of its reference point",
        joint.name,
        joint.nodes.len()
    );
    let help = format!("give the interface {least}, or coupling = \"free\"");
    Diagnostic::new(Code::InterfaceCoupling, message).with_help(help)
}

/// Averaging interfaces that share nodes, directly or through others: one set of conditions.
struct Conditions {
    /// Indices of the interfaces.
    joints: Vec<usize>,
    /// Rows of their nodes that no rigid or free interface prescribes, ascending.
    rows: Vec<usize>,
    /// True if the interface is the only one and shares no node with any other.
    alone: bool,
}

impl Conditions {
    /// Returns the averaging interfaces in groups that share nodes, in the order of their first interfaces.
    fn of(joints: &[CoupledInterface]) -> Vec<Self> {
        let is_averaging = |j: usize| joints[j].coupling == Coupling::Averaging;
        let prescribed = prescribed_rows(joints);
        let mut groups: Vec<Self> = Vec::new();
        for j in (0..joints.len()).filter(|&j| is_averaging(j)) {
            let unshared: Vec<usize> =
                joints[j].rows.iter().copied().filter(|row| !prescribed.contains_key(row)).collect();
            let alone = unshared.len() == joints[j].rows.len();
            let mut group = Self { joints: vec![j], rows: unshared, alone };
            // Merge with every group that shares a row.
            let (touched, others): (Vec<_>, Vec<_>) = groups
                .into_iter()
                .partition(|other| other.rows.iter().any(|row| group.rows.binary_search(row).is_ok()));
            groups = others;
            for other in touched {
                group.joints.extend(other.joints);
                group.rows.extend(other.rows);
                group.alone = false;
            }
            group.joints.sort_unstable();
            group.rows.sort_unstable();
            group.rows.dedup();
            groups.push(group);
        }
        groups.sort_by_key(|group| group.joints[0]);
        groups
    }

    /// Returns C (rows x coordinates): the weights of all coordinates, taken about the means of the nodes.
    fn weights(&self, joints: &[CoupledInterface]) -> Mat<f64> {
        let place: HashMap<usize, usize> = self.rows.iter().copied().zip(0..).collect();
        let count = self.joints.iter().map(|&j| joints[j].coordinates.len()).sum();
        let mut weights = Mat::zeros(self.rows.len(), count);
        let mut first = 0;
        for joint in self.joints.iter().map(|&j| &joints[j]) {
            for (i, row) in joint.rows.iter().enumerate() {
                if let Some(&at) = place.get(row) {
                    for k in 0..joint.coordinates.len() {
                        weights[(at, first + k)] = joint.centred()[(i, k)];
                    }
                }
            }
            first += joint.coordinates.len();
        }
        weights
    }

    /// Returns the coordinates of displacements `u` (N x k), taken about the means of the nodes.
    fn coordinates(&self, joints: &[CoupledInterface], u: MatRef<'_, f64>) -> Mat<f64> {
        let motions = self.joints.iter().map(|&j| gram(joints[j].centred(), joints[j].gather(u).as_ref()));
        let motions: Vec<Mat<f64>> = motions.collect();
        let rows: Vec<_> = motions.iter().flat_map(|block| block.row_iter()).collect();
        Mat::from_fn(rows.len(), u.ncols(), |i, j| rows[i][j])
    }

    /// Returns, for unit coordinates of all `joints` (`count` columns), the coordinates about the means of
    /// the nodes (rows): those of the rigid motion of each interface.
    fn unit_coordinates(&self, joints: &[CoupledInterface], count: usize) -> Mat<f64> {
        let size = |j: usize| joints[j].coordinates.len();
        let mut wanted = Mat::zeros(self.joints.iter().map(|&j| size(j)).sum(), count);
        let mut first = 0;
        for &j in &self.joints {
            let column: usize = (0..j).map(size).sum();
            let unit = gram(joints[j].centred(), joints[j].motion());
            wanted.as_mut().submatrix_mut(first, column, size(j), size(j)).copy_from(&unit);
            first += size(j);
        }
        wanted
    }

    /// Corrects the free rows of `moved` (n x coordinates) by the smallest change that gives the interfaces
    /// their unit coordinates.
    fn fulfil(&self, joints: &[CoupledInterface], moved: &mut Mat<f64>) {
        let weights = self.weights(joints);
        let root = inverse_root(weights.as_ref()).expect("independent conditions");
        let normal = combine(root.as_ref(), root.transpose());
        let wanted = self.unit_coordinates(joints, moved.ncols());
        // The second pass removes the rounding error of the first.
        for _ in 0..2 {
            let missing = &wanted - self.coordinates(joints, moved.as_ref());
            let correction = combine(weights.as_ref(), combine(normal.as_ref(), missing.as_ref()).as_ref());
            for (i, &row) in self.rows.iter().enumerate() {
                (0..moved.ncols()).for_each(|column| moved[(row, column)] += correction[(i, column)]);
            }
        }
    }

    /// Returns true if the conditions are independent on the free rows.
    fn are_independent(&self, joints: &[CoupledInterface]) -> bool {
        if self.alone {
            return true;
        }
        let weights = self.weights(joints);
        if weights.nrows() < weights.ncols() {
            return false;
        }
        // Make each interface orthonormal by itself, on all of its rows.
        let mut scaled = Mat::zeros(weights.nrows(), weights.ncols());
        let mut first = 0;
        for joint in self.joints.iter().map(|&j| &joints[j]) {
            let count = joint.coordinates.len();
            let Some(root) = inverse_root(joint.centred()) else { return false };
            let scaled_weights = combine(weights.as_ref().subcols(first, count), root.as_ref());
            scaled.as_mut().subcols_mut(first, count).copy_from(&scaled_weights);
            first += count;
        }
        let eigen = symmetric_eigen(gram(scaled.as_ref(), scaled.as_ref()).as_ref());
        eigen.is_some_and(|eigen| {
            eigen.values.first().is_some_and(|least| *least > MIN_SINGULAR_VALUE.powi(2))
        })
    }
}

/// Returns X (r x r) with X'A'A X = I; `None` if the columns of A are dependent.
fn inverse_root(a: MatRef<'_, f64>) -> Option<Mat<f64>> {
    // Scale the columns to one size first: rotations and displacements have different units.
    let size: Vec<f64> = a.col_iter().map(|column| column.norm_l2()).collect();
    let scaled = Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] / size[j]);
    let eigen = symmetric_eigen(gram(scaled.as_ref(), scaled.as_ref()).as_ref())?;
    let is_positive = eigen.values.first().is_some_and(|least| *least > f64::EPSILON);
    let root =
        Mat::from_fn(a.ncols(), a.ncols(), |i, j| eigen.vectors[(i, j)] / (size[i] * eigen.values[j].sqrt()));
    is_positive.then_some(root)
}

/// Returns each row that a rigid or free interface prescribes, with the index of that interface.
fn prescribed_rows(joints: &[CoupledInterface]) -> HashMap<usize, usize> {
    let prescribing = joints.iter().enumerate().filter(|(_, joint)| joint.coupling != Coupling::Averaging);
    prescribing.flat_map(|(j, joint)| joint.rows.iter().map(move |&row| (row, j))).collect()
}

/// Returns an error for each interface whose coordinates depend on other interfaces through shared nodes.
fn dependent_on_others(model: &FeModel, joints: &[CoupledInterface]) -> Vec<Diagnostic> {
    let mut is_dependent = vec![false; joints.len()];
    for group in Conditions::of(joints).iter().filter(|group| !group.are_independent(joints)) {
        group.joints.iter().for_each(|&j| is_dependent[j] = true);
    }
    let mut diagnostics = Vec::new();
    let mut owners: HashMap<usize, Vec<usize>> = HashMap::new();
    for (j, joint) in joints.iter().enumerate() {
        let is_conflict = |&other: &usize| {
            let both_prescribe =
                [joint, &joints[other]].iter().all(|one| one.coupling != Coupling::Averaging);
            both_prescribe || is_dependent[j] || is_dependent[other]
        };
        let mut shared = Vec::new();
        for &node in &joint.nodes {
            let others = owners.entry(node).or_default();
            shared.extend(others.iter().copied().find(is_conflict).map(|other| (node, other)));
            others.push(j);
        }
        if let Some(&(node, other)) = shared.first() {
            let message = format!(
                "interface `{}` shares {} nodes with others, node {} with `{}`: their motions are not independent",
                joint.name,
                shared.len(),
                model.nodes().ids[node],
                joints[other].name
            );
            diagnostics.push(Diagnostic::new(Code::InterfaceShared, message));
        }
    }
    diagnostics
}

/// Returns an error if all interfaces together leave the body free to turn.
fn body_not_held(model: &FeModel, joints: &[CoupledInterface]) -> Option<Diagnostic> {
    let d = model.dimension();
    let held: Vec<[f64; 3]> =
        joints.iter().flat_map(|joint| &joint.nodes).map(|&i| model.nodes().positions[i]).collect();
    if joints.iter().any(|joint| joint.holds) || InterfaceMotion::new(&held, false, d, None).is_determined() {
        return None;
    }
    let (place, least) = determining(d);
    let message = format!("the interfaces have {} nodes on {place}: they do not hold the body", held.len());
    let help = format!("the interfaces together need {least}");
    Some(Diagnostic::new(Code::InterfaceCoupling, message).with_help(help))
}

/// Returns T of u = T y, which leaves every coordinate zero: rows of rigid and free interfaces are zero,
/// rows of averaging interfaces have zero mean.
///
/// # Errors
/// [`EigenFailure::Memory`] if the dense coupling of all rows of averaging interfaces does not fit.
pub(super) fn hold(
    n: usize,
    joints: &[CoupledInterface],
    memory: Option<u64>,
) -> std::result::Result<Elimination, EigenFailure> {
    let groups = Conditions::of(joints);
    // Each entry takes 48 bytes: it is stored in K and in M, and one of them twice while it is made
    // symmetric.
    let entries: u64 = groups.iter().map(|group| (group.rows.len() as u64).pow(2)).sum();
    let bytes = 48 * entries;
    if let Some(available) = memory.filter(|&available| bytes > available) {
        return Err(EigenFailure::Memory { bytes, available });
    }
    let dependents = groups.iter().map(|group| without_mean(&group.rows, group.weights(joints).as_ref()));
    let dependents = dependents.collect();
    let prescribing = joints.iter().filter(|joint| joint.coupling != Coupling::Averaging);
    let zero = prescribing.flat_map(|joint| joint.rows.iter().copied());
    Ok(Elimination::new(n, &zero.collect::<Vec<_>>(), dependents))
}

/// Returns D (n x coordinates): displacements with unit coordinates, C'D = I, in which the nodes of rigid
/// and free interfaces move as prescribed. Nodes of an averaging interface that shares none of them move as
/// a rigid body.
///
/// # Panics
/// When the coordinates cannot be prescribed ([`check_prescribable`]).
pub(super) fn unit_motions(n: usize, joints: &[CoupledInterface]) -> Mat<f64> {
    let groups = Conditions::of(joints);
    let shares = |j: usize| groups.iter().any(|group| !group.alone && group.joints.contains(&j));
    let count = joints.iter().map(|joint| joint.coordinates.len()).sum();
    let mut moved = Mat::zeros(n, count);
    let mut first = 0;
    for (j, joint) in joints.iter().enumerate() {
        if !shares(j) {
            joint.scatter(joint.motion(), &mut moved, first);
        }
        first += joint.coordinates.len();
    }
    for group in groups.iter().filter(|group| !group.alone) {
        group.fulfil(joints, &mut moved);
    }
    moved
}

/// Solves C'u = 0 for as many `rows` as there are conditions, chosen by complete pivoting so that the
/// weights of the other rows stay of order one.
fn without_mean(rows: &[usize], measure: MatRef<'_, f64>) -> Dependents {
    // Scale the rows to one size: rotations and displacements have different units.
    let conditions =
        Mat::from_fn(measure.ncols(), measure.nrows(), |i, j| measure[(j, i)] / measure.col(i).norm_l2());
    let Echelon { pivots, others, weights } = Echelon::new(conditions);
    Dependents {
        rows: pivots.iter().map(|&j| rows[j]).collect(),
        on: others.iter().map(|&j| rows[j]).collect(),
        weights: weights * faer::Scale(-1.0),
    }
}
