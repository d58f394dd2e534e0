//! Interfaces as rows of the matrices: the coordinates of a joint, what they do to the nodes, and what they
//! measure of them.

use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_model::{Coupling, FeModel, InterfaceMotion, NodeSet, centre_and_length, rigid_count};
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
    /// The weights about the mean of the nodes (rows x r).
    centred: Mat<f64>,
    /// R about the mean of the nodes, rotations by one over their extent, rows of rotations times it: all of the size of
    /// one.
    balanced: Mat<f64>,
    /// Extent of the nodes about their mean.
    length: f64,
    /// Number of rows that are displacements; rotations follow.
    displaced: usize,
    /// Number of coordinates that are displacements; rotations follow.
    pub displacements: usize,
    /// Whether the nodes determine every coordinate; of a free interface, whether each has all of its
    /// rotations or none has one.
    pub determined: bool,
    /// Whether it holds the body by itself, not only together with others.
    pub holds: bool,
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
            displaced: displaced.len(),
            balanced: unit.clone(),
            length: 1.0,
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
        let (centre, length) = centre_and_length(&positions);
        let length = if length > 0.0 { length } else { 1.0 };
        let about_mean = model.rigid_fields(centre, length);
        let count = d * nodes.len();
        let size = |row: usize| if row < count { 1.0 } else { length };
        Self {
            balanced: Mat::from_fn(rows.len(), about_mean.ncols(), |i, j| size(i) * about_mean[(rows[i], j)]),
            length,
            displaced: count,
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
    pub(super) fn motion(&self) -> MatRef<'_, f64> {
        self.motion.as_ref()
    }

    /// R about the mean of the nodes (rows x r), displacements and turns of the size of one: rotations by one over
    /// [`CoupledInterface::length`], rows of rotations times it.
    pub(super) fn balanced(&self) -> MatRef<'_, f64> {
        self.balanced.as_ref()
    }

    /// Extent of the nodes about their mean.
    pub(super) fn length(&self) -> f64 {
        self.length
    }

    /// Number of rows that are displacements, the first ones.
    pub(super) fn displaced_rows(&self) -> usize {
        self.displaced
    }

    /// A (rows x r), A'R = I: weights that take the coordinates from the displacements, and nodal forces of
    /// unit loads on the coordinates.
    pub(super) fn measure(&self) -> MatRef<'_, f64> {
        self.measure.as_ref()
    }

    /// Returns the weights of [`measure`](Self::measure) about the mean of the nodes: what they leave zero is the same, and
    /// a far reference point costs no digits.
    pub(super) fn centred(&self) -> MatRef<'_, f64> {
        self.centred.as_ref()
    }

    /// Adds the columns of `part` (rows x r) to `whole` (N x c) from column `first` on.
    pub(super) fn scatter(&self, part: MatRef<'_, f64>, whole: &mut Mat<f64>, first: usize) {
        for (i, &row) in self.rows.iter().enumerate() {
            for j in 0..part.ncols() {
                whole[(row, first + j)] += part[(i, j)];
            }
        }
    }

    /// The rows of the nodes.
    pub(super) fn gather(&self, whole: MatRef<'_, f64>) -> Mat<f64> {
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
    Ok(coupled_sets(model, model.interfaces()))
}

/// Node sets of a model as interfaces.
pub(super) fn coupled_sets(model: &FeModel, sets: &[NodeSet]) -> Vec<CoupledInterface> {
    let places: HashMap<i64, usize> = model.nodes().ids.iter().enumerate().map(|(i, &id)| (id, i)).collect();
    sets.iter().map(|set| CoupledInterface::new(model, set, &places)).collect()
}
