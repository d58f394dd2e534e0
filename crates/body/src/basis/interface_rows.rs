//! Interfaces as rows of the matrices: the coordinates of a joint, the nodal motions they cause, and the
//! weights that measure them.

use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_linalg::combine;
use flexbody_model::{Coupling, FeModel, InterfaceMotion, NodeSet, centre_and_length, rigid_count};
use nalgebra::Matrix3;
use std::collections::HashMap;

/// Names of the axes.
pub(super) const AXES: [&str; 3] = ["x", "y", "z"];

/// Interface with r coordinates: the motion of its reference point or, without one, all displacements of
/// its nodes.
pub(super) struct CoupledInterface {
    pub name: String,
    pub coupling: Coupling,
    /// Indices of its nodes.
    pub nodes: Vec<usize>,
    /// Their rows in the matrices.
    pub rows: Vec<usize>,
    /// Name of each coordinate, such as `ux` or `node 7 ux`.
    pub coordinates: Vec<String>,
    /// Name of the load that works on each coordinate, such as `force x` or `torque z`.
    pub loads: Vec<String>,
    /// `motion`: displacements of the rows for unit coordinates without deformation of the interface.
    /// `measure`: weights of the rows with measure' motion = I, which are also the nodal forces of unit
    /// loads on the coordinates. Both are rows x r.
    motion: Mat<f64>,
    measure: Mat<f64>,
    /// Weights about the mean of the nodes (rows x r).
    centred: Mat<f64>,
    /// R about the mean of the nodes. Columns of rotations are divided by the extent of the nodes and rows
    /// of rotations multiplied by it, so that all entries are of order one.
    balanced: Mat<f64>,
    /// Extent of the nodes about their mean.
    length: f64,
    /// Number of rows that are displacements; rows of rotations follow.
    displaced: usize,
    /// Number of coordinates that are displacements; rotations follow.
    pub displacements: usize,
    /// True if the nodes determine every coordinate; for a free interface, true if each node has all
    /// rotations or none has any.
    pub determined: bool,
    /// True if this interface alone holds the body.
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

    /// Creates a free interface: every row of its nodes is a coordinate.
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
            // Changes of axes need whole rotation vectors.
            determined: turned.is_empty() || all_turn,
            holds: all_turn,
            nodes,
            rows,
        }
    }

    /// Creates an interface whose coordinates are the motion of its reference point.
    fn at_reference(model: &FeModel, set: &NodeSet, members: Members) -> Self {
        let Members { nodes, displaced, turned, all_turn } = members;
        let (coupling, d) = (set.coupling(), model.dimension());
        let positions: Vec<[f64; 3]> = nodes.iter().map(|&i| model.nodes().positions[i]).collect();
        let reference = set.reference.point();
        let by_place = InterfaceMotion::new(&positions, false, d, reference);
        // The mean motion excludes the nodal rotations unless the displacements alone do not determine the
        // rotation.
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
        // Rigid motion of all rows, including nodes with only some rotations.
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

    /// Returns R (rows x r): displacements of the nodes for unit coordinates without deformation of the
    /// interface.
    pub(super) fn motion(&self) -> MatRef<'_, f64> {
        self.motion.as_ref()
    }

    /// Returns R about the mean of the nodes (rows x r), scaled so that displacements and rotations are of
    /// order one: columns of rotations are divided by [`CoupledInterface::length`], rows of rotations
    /// multiplied by it.
    pub(super) fn balanced(&self) -> MatRef<'_, f64> {
        self.balanced.as_ref()
    }

    /// Returns the extent of the nodes about their mean.
    pub(super) fn length(&self) -> f64 {
        self.length
    }

    /// Returns the number of leading rows that are displacements.
    pub(super) fn displaced_rows(&self) -> usize {
        self.displaced
    }

    /// Returns A (rows x r) with A'R = I: weights that give the coordinates from the displacements, and
    /// nodal forces of unit loads on the coordinates.
    pub(super) fn measure(&self) -> MatRef<'_, f64> {
        self.measure.as_ref()
    }

    /// Returns the weights of [`measure`](Self::measure) about the mean of the nodes. They vanish for the
    /// same displacements, and a distant reference point costs no digits.
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

    /// Returns the rows of `whole` (N x c) that belong to this interface.
    pub(super) fn gather(&self, whole: MatRef<'_, f64>) -> Mat<f64> {
        Mat::from_fn(self.rows.len(), whole.ncols(), |i, j| whole[(self.rows[i], j)])
    }
}

/// Nodes of an interface and their matrix rows.
struct Members {
    /// Indices of the nodes, ascending.
    nodes: Vec<usize>,
    /// Rows of the displacements of the nodes, and of their rotations, if any.
    displaced: Vec<usize>,
    turned: Vec<usize>,
    /// True if every node has all rotations.
    all_turn: bool,
}

impl Members {
    fn new(model: &FeModel, set: &NodeSet, places: &HashMap<i64, usize>) -> Self {
        let d = model.dimension();
        // The order of the node table makes results independent of the order in the set.
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

/// Returns names along the axes and about them; in the plane about the third axis only.
fn along_axes(dimension: usize, along: &str, about: &str) -> Vec<String> {
    let turning = if dimension == 2 { &AXES[2..] } else { &AXES[..] };
    let along = AXES[..dimension].iter().map(|axis| format!("{along}{axis}"));
    along.chain(turning.iter().map(|axis| format!("{about}{axis}"))).collect()
}

/// Returns all interfaces of a model.
///
/// # Errors
/// [`InterfaceNode`](Code::InterfaceNode) if the model has no interface; `what` names the purpose, such as
/// `interface loads`.
pub(super) fn coupled_interfaces(model: &FeModel, what: &str) -> Result<Vec<CoupledInterface>> {
    if model.interfaces().is_empty() {
        let message = format!("the model has no interfaces, so there are no {what}");
        return Err(Diagnostic::new(Code::InterfaceNode, message)
            .with_help("name node sets as [[interface]] in the manifest, or with --interface NAME=SET,rigid")
            .into());
    }
    Ok(coupled_sets(model, model.interfaces()))
}

/// Converts node sets of a model to interfaces.
pub(super) fn coupled_sets(model: &FeModel, sets: &[NodeSet]) -> Vec<CoupledInterface> {
    let places: HashMap<i64, usize> = model.nodes().ids.iter().enumerate().map(|(i, &id)| (id, i)).collect();
    sets.iter().map(|set| CoupledInterface::new(model, set, &places)).collect()
}

// K and M in interface coordinates, for joints of multibody packages.

/// Stiffness and mass matrices of a body in the motions of its interfaces and the amplitudes of its
/// fixed-interface modes, and the transformation from its modes. The axes are those of the body; during the
/// computation of a basis those of the model.
///
/// The coordinates of an interface are the motions of its reference point (three translations, three
/// rotations; in the plane two and one) or, for a free interface, the displacements of its nodes in the
/// order of the nodes of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct InterfaceCoordinates {
    /// Names of the nc coordinates (`left ux`, `left rz`, `fixed-interface mode 1`): the interfaces in
    /// their order, then the fixed-interface modes.
    pub names: Vec<String>,
    /// Stiffness matrix (nc x nc): blkdiag(K_cc, diag(lambda of the fixed-interface modes)). Its null space
    /// has the dimension of the rigid motions.
    pub stiffness: Mat<f64>,
    /// Mass matrix (nc x nc): \[M_cc, M_cm; M_mc, I\].
    pub mass: Mat<f64>,
    /// Transformation B (nc x nf): coordinates B p for the amplitudes p of the modes, B'K B = diag(lambda), B'M B = I.
    pub of_modes: Mat<f64>,
}

impl InterfaceCoordinates {
    /// Returns the eigenvalues of the fixed-interface modes, K_jj / M_jj of their amplitudes. Unit: 1/time^2.
    pub fn fixed_interface_eigenvalues(&self) -> Vec<f64> {
        self.amplitudes().into_iter().map(|j| self.stiffness[(j, j)] / self.mass[(j, j)]).collect()
    }

    /// Returns the coordinates that are amplitudes of fixed-interface modes.
    pub(crate) fn amplitudes(&self) -> Vec<usize> {
        (0..self.names.len()).filter(|j| Self::is_amplitude(&self.names[*j])).collect()
    }

    /// Returns the name of the amplitude of the fixed-interface mode with this number, from 1.
    pub(crate) fn amplitude(number: usize) -> String {
        format!("fixed-interface mode {number}")
    }

    /// Returns true if the coordinate of this name is the amplitude of a fixed-interface mode.
    pub fn is_amplitude(name: &str) -> bool {
        name.starts_with("fixed-interface mode ")
    }
}

/// Interface coordinates along the axes of the model, and the positions of vectors among them for a change
/// of axes.
#[derive(Debug, Clone, PartialEq)]
pub struct CoordinatesInModelAxes {
    /// Coordinates along the axes of the model.
    pub coordinates: InterfaceCoordinates,
    /// First of the d coordinates of each vector: these change with the axes, all others do not.
    pub(super) vectors: Vec<usize>,
}

impl CoordinatesInModelAxes {
    /// Returns the coordinates with vectors along the columns of `axes` (right-handed, in the plane about z), for modes
    /// multiplied by `signs`.
    pub fn in_axes(&self, axes: &Matrix3<f64>, dimension: usize, signs: &[f64]) -> InterfaceCoordinates {
        let InterfaceCoordinates { names, stiffness, mass, of_modes } = &self.coordinates;
        let size = names.len();
        let mut turn = Mat::<f64>::identity(size, size);
        for &first in &self.vectors {
            for i in 0..dimension {
                for j in 0..dimension {
                    turn[(first + i, first + j)] = axes[(j, i)];
                }
            }
        }
        let turned = |a: &Mat<f64>| {
            let b = combine(turn.as_ref(), combine(a.as_ref(), turn.as_ref().transpose()).as_ref());
            Mat::from_fn(size, size, |i, j| 0.5 * (b[(i, j)] + b[(j, i)]))
        };
        let of_modes = combine(turn.as_ref(), of_modes.as_ref());
        InterfaceCoordinates {
            names: names.clone(),
            stiffness: turned(stiffness),
            mass: turned(mass),
            of_modes: Mat::from_fn(size, of_modes.ncols(), |i, j| of_modes[(i, j)] * signs[j]),
        }
    }
}
