//! Interfaces as rows of the matrices: the coordinates of a joint, what they do to the nodes, and what they
//! measure of them.

use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::{Error, Result};
use crate::model::{Coupling, FeModel, InterfaceMotion, NodeSet, rigid_count};
use crate::numerics::eigen::EigenFailure;
use crate::numerics::linalg::{Dependents, Elimination};
use faer::{Mat, MatRef};
use std::collections::HashMap;

/// Axes in names.
pub(super) const AXES: [&str; 3] = ["x", "y", "z"];

/// An interface with r coordinates: the motion of its reference point, or, without one, all displacements of
/// its nodes.
pub(super) struct CoupledInterface {
    pub name: String,
    pub coupling: Coupling,
    /// Indices of its nodes.
    pub nodes: Vec<usize>,
    /// Their rows in the matrices.
    pub rows: Vec<usize>,
    /// What each coordinate is, as in `ux` or `node 7 ux`.
    pub coordinates: Vec<String>,
    /// The load that works on each coordinate, as in `force x` or `torque z`.
    pub loads: Vec<String>,
    /// Displacements of the rows for unit coordinates that deform nothing at the interface, and weights of
    /// the rows with measure' motion = I, which are also the loads that work on unit coordinates (both rows x
    /// r).
    motion: Mat<f64>,
    measure: Mat<f64>,
    /// The same weights about the mean of the nodes: what they leave zero is the same, and a far reference
    /// point costs no digits.
    centred: Mat<f64>,
    /// Number of coordinates that are displacements; rotations follow.
    pub displacements: usize,
    /// Whether the nodes determine every coordinate; of a free interface, whether each has all of its
    /// rotations or none has one.
    determined: bool,
    /// Whether it holds the body by itself, not only together with others.
    holds: bool,
}

impl CoupledInterface {
    fn new(model: &FeModel, set: &NodeSet, places: &HashMap<i64, usize>) -> Self {
        let members = Members::new(model, set, places);
        match set.coupling() {
            Coupling::Free => Self::free(model, set, members),
            _ => Self::at_reference(model, set, members),
        }
    }

    /// Every row of the nodes is a coordinate.
    fn free(model: &FeModel, set: &NodeSet, members: Members) -> Self {
        let Members { nodes, displaced, turned, all_turn } = members;
        let rows = [displaced.as_slice(), &turned].concat();
        let unit = Mat::identity(rows.len(), rows.len());
        let load = |&row: &usize| {
            let label = model.label(row);
            let kind = if row < model.rows().displacements() { "force" } else { "torque" };
            format!("node {} {kind} {}", label.node, AXES[(usize::from(label.direction) - 1) % 3])
        };
        Self {
            name: set.name.clone(),
            coupling: set.coupling(),
            coordinates: rows.iter().map(|&row| model.label(row).to_string()).collect(),
            loads: rows.iter().map(load).collect(),
            displacements: displaced.len(),
            motion: unit.clone(),
            measure: unit.clone(),
            centred: unit,
            // Axes turn only whole vectors.
            determined: turned.is_empty() || all_turn,
            holds: all_turn,
            nodes,
            rows,
        }
    }

    /// The motion of the reference point is its coordinates.
    fn at_reference(model: &FeModel, set: &NodeSet, members: Members) -> Self {
        let Members { nodes, displaced, turned, all_turn } = members;
        let (coupling, d) = (set.coupling(), model.dimension());
        let positions: Vec<[f64; 3]> = nodes.iter().map(|&i| model.nodes().positions[i]).collect();
        let reference = set.reference.point();
        let by_place = InterfaceMotion::new(&positions, false, d, reference);
        // The mean motion leaves the rotations of the nodes alone, unless nothing else tells its own.
        let rows = match coupling {
            Coupling::Averaging if by_place.is_determined() || !all_turn => displaced,
            _ => [displaced.as_slice(), &turned].concat(),
        };
        let with_rotations = all_turn && rows.len() > d * nodes.len();
        let motion = InterfaceMotion::new(&positions, with_rotations, d, reference);
        let centred = InterfaceMotion::new(&positions, with_rotations, d, None);
        let padded = |a: MatRef<'_, f64>| {
            Mat::from_fn(rows.len(), a.ncols(), |i, j| if i < a.nrows() { a[(i, j)] } else { 0.0 })
        };
        // Of all rows, also where some nodes have a part of the rotations only.
        let fields = model.rigid_fields(motion.reference(), 1.0);
        Self {
            name: set.name.clone(),
            coupling,
            coordinates: along_axes(d, "u", "r"),
            loads: along_axes(d, "force ", "torque "),
            displacements: d,
            motion: Mat::from_fn(rows.len(), fields.ncols(), |i, j| fields[(rows[i], j)]),
            measure: padded(motion.average()),
            centred: padded(centred.average()),
            determined: motion.is_determined(),
            holds: true,
            nodes,
            rows,
        }
    }

    /// R (rows x r): displacements of the nodes for unit coordinates, nothing deformed at the interface.
    pub fn motion(&self) -> MatRef<'_, f64> {
        self.motion.as_ref()
    }

    /// A (rows x r), A'R = I: weights that take the coordinates from the displacements, and nodal forces of
    /// unit loads on the coordinates.
    pub fn measure(&self) -> MatRef<'_, f64> {
        self.measure.as_ref()
    }

    /// Adds the columns of `part` (rows x r) to `whole` (N x c) from column `first` on.
    pub fn scatter(&self, part: MatRef<'_, f64>, whole: &mut Mat<f64>, first: usize) {
        for (i, &row) in self.rows.iter().enumerate() {
            for j in 0..part.ncols() {
                whole[(row, first + j)] += part[(i, j)];
            }
        }
    }

    /// The rows of the nodes.
    pub fn gather(&self, whole: MatRef<'_, f64>) -> Mat<f64> {
        Mat::from_fn(self.rows.len(), whole.ncols(), |i, j| whole[(self.rows[i], j)])
    }
}

/// The nodes of an interface and their rows.
struct Members {
    /// Indices of the nodes, ascending.
    nodes: Vec<usize>,
    /// Rows of their displacements, and of their rotations where they have them.
    displaced: Vec<usize>,
    turned: Vec<usize>,
    /// Whether every node has all rotations.
    all_turn: bool,
}

impl Members {
    fn new(model: &FeModel, set: &NodeSet, places: &HashMap<i64, usize>) -> Self {
        let d = model.dimension();
        // In the order of the node table: equal sets give equal results.
        let mut nodes: Vec<usize> = set.nodes.iter().filter_map(|id| places.get(id)).copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let displaced = nodes.iter().flat_map(|i| (0..d).map(move |k| d * i + k)).collect();
        let rotations = (model.rows().displacements()..).zip(model.rows().rotations());
        let turned: Vec<usize> = rotations
            .filter(|(_, (node, _))| nodes.binary_search(&(*node as usize)).is_ok())
            .map(|(row, _)| row)
            .collect();
        let all_turn = turned.len() == (rigid_count(d) - d) * nodes.len();
        Self { nodes, displaced, turned, all_turn }
    }
}

/// Names of what acts along the axes and about them; in the plane about the third alone.
fn along_axes(dimension: usize, along: &str, about: &str) -> Vec<String> {
    let turning = if dimension == 2 { &AXES[2..] } else { &AXES[..] };
    let along = AXES[..dimension].iter().map(|axis| format!("{along}{axis}"));
    along.chain(turning.iter().map(|axis| format!("{about}{axis}"))).collect()
}

/// All interfaces of a model.
///
/// # Errors
/// [`InterfaceNode`](Code::InterfaceNode) when there is none; `what` needs one, as in `interface loads`.
pub(super) fn coupled_interfaces(model: &FeModel, what: &str) -> Result<Vec<CoupledInterface>> {
    if model.interfaces().is_empty() {
        let message = format!("the model has no interfaces, so there are no {what}");
        return Err(Diagnostic::new(Code::InterfaceNode, message)
            .with_help("name node sets as [[interface]] in the manifest")
            .into());
    }
    let places: HashMap<i64, usize> = model.nodes().ids.iter().enumerate().map(|(i, &id)| (id, i)).collect();
    Ok(model.interfaces().iter().map(|set| CoupledInterface::new(model, set, &places)).collect())
}

/// Checks that the coordinates of `joints` can be prescribed all at once, and hold the body when they are
/// zero.
///
/// # Errors
/// [`InterfaceCoupling`](Code::InterfaceCoupling) and [`InterfaceShared`](Code::InterfaceShared), all that
/// are found.
pub(super) fn check_prescribable(model: &FeModel, joints: &[CoupledInterface]) -> Result<()> {
    let mut found: Vec<Diagnostic> =
        joints.iter().filter(|joint| !joint.determined).map(|joint| undetermined(model, joint)).collect();
    found.extend(shared_nodes(model, joints));
    if found.is_empty() {
        found.extend(body_not_held(model, joints));
    }
    if found.is_empty() { Ok(()) } else { Err(Error::new(found)) }
}

/// Where nodes must not lie that are to determine every rotation, and how many of them do.
fn determining(dimension: usize) -> (&'static str, &'static str) {
    if dimension == 2 {
        ("one point", "two nodes")
    } else {
        ("one line", "three nodes that do not lie on one line")
    }
}

/// The nodes of a joint do not determine its coordinates.
fn undetermined(model: &FeModel, joint: &CoupledInterface) -> Diagnostic {
    if joint.coupling == Coupling::Free {
        let message =
            format!("nodes of the free interface `{}` have a part of their rotations only", joint.name);
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

/// Nodes that belong to several joints.
fn shared_nodes(model: &FeModel, joints: &[CoupledInterface]) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    let mut owner: HashMap<usize, &str> = HashMap::new();
    for joint in joints {
        let shared: Vec<(i64, &str)> = joint
            .nodes
            .iter()
            .filter_map(|&i| owner.insert(i, &joint.name).map(|other| (model.nodes().ids[i], other)))
            .collect();
        if let Some((node, other)) = shared.first() {
            let message = format!(
                "interface `{}` shares {} nodes with others, node {node} with `{other}`: their motions are not independent",
                joint.name,
                shared.len()
            );
            found.push(Diagnostic::new(Code::InterfaceShared, message));
        }
    }
    found
}

/// All joints together leave the body free to turn.
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

/// T of u = T y, which leaves every coordinate zero: the rows of rigid and free interfaces are zero, those of
/// averaging ones have no mean.
///
/// # Errors
/// [`EigenFailure::Memory`]: an averaging interface couples all of its rows with each other, which does not
/// fit.
pub(super) fn hold(
    n: usize,
    joints: &[CoupledInterface],
    memory: Option<u64>,
) -> std::result::Result<Elimination, EigenFailure> {
    let averaging = |joint: &&CoupledInterface| joint.coupling == Coupling::Averaging;
    // In K and in M. Bytes of an entry: in both matrices, one of them twice while it is made symmetric.
    let entries: u64 = joints.iter().filter(averaging).map(|joint| (joint.rows.len() as u64).pow(2)).sum();
    let bytes = 48 * entries;
    if let Some(available) = memory.filter(|&available| bytes > available) {
        return Err(EigenFailure::Memory { bytes, available });
    }
    let dependents = joints.iter().filter(averaging).map(without_mean).collect();
    let zero = joints.iter().filter(|joint| !averaging(joint)).flat_map(|joint| joint.rows.iter().copied());
    Ok(Elimination::new(n, &zero.collect::<Vec<_>>(), dependents))
}

/// A'u = 0 solved for as many rows as it has, chosen by complete pivoting: the weights of the others stay of
/// the size of one.
fn without_mean(joint: &CoupledInterface) -> Dependents {
    let measure = joint.centred.as_ref();
    let (rows, r) = (measure.nrows(), measure.ncols());
    // Rows of one size: rotations are in other units than displacements.
    let mut a = Mat::from_fn(r, rows, |i, j| measure[(j, i)] / measure.col(i).norm_l2());
    let mut pivots: Vec<usize> = Vec::new();
    for step in 0..r {
        let places = (step..r).flat_map(|i| (0..rows).map(move |j| (i, j)));
        let (i, j) = places
            .filter(|(_, j)| !pivots.contains(j))
            .max_by(|&p, &q| a[p].abs().total_cmp(&a[q].abs()))
            .expect("an averaging interface has more rows than coordinates");
        for column in 0..rows {
            let (upper, lower) = (a[(step, column)], a[(i, column)]);
            (a[(step, column)], a[(i, column)]) = (lower, upper);
        }
        let pivot = a[(step, j)];
        (0..rows).for_each(|column| a[(step, column)] /= pivot);
        for other in (0..r).filter(|&other| other != step) {
            let factor = a[(other, j)];
            (0..rows).for_each(|column| a[(other, column)] -= factor * a[(step, column)]);
        }
        pivots.push(j);
    }
    let others: Vec<usize> = (0..rows).filter(|j| !pivots.contains(j)).collect();
    Dependents {
        rows: pivots.iter().map(|&j| joint.rows[j]).collect(),
        on: others.iter().map(|&j| joint.rows[j]).collect(),
        weights: Mat::from_fn(r, others.len(), |i, j| -a[(i, others[j])]),
    }
}
