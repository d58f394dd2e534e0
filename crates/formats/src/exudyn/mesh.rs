//! Mesh of Exudyn: the nodes that its markers are attached to, and the interfaces as sets of nodes.
//!
//! The cost of a marker per step grows with the number of its nodes. If interfaces are selected, an interface
//! with a rotation is therefore written as six nodes on a cross about its reference point, which move rigidly
//! with it: the mean of the nodes is the reference point, and their best-fit rotation is that of the
//! interface, both exactly.

use crate::export::Points;
use crate::export::frames::{ExportFrame, interface_frames, named_nodes};
use faer::Mat;
use flexbody_body::flex_body::{FlexBody, Interface};
use nalgebra::Vector3;

/// Smallest length of the arms of a cross, relative to the largest distance of a node of the body from the
/// reference point.
const ARM: f64 = 0.01;

/// Nodes with their motion, and the interfaces on them.
pub(crate) struct Mesh {
    /// Node numbers in the FE model; for the nodes of a cross the number of the reference point.
    pub numbers: Vec<i64>,
    /// Positions in body axes. Unit: length.
    pub positions: Vec<[f64; 3]>,
    /// Displacements in every mode (3n x nf).
    pub shape: Mat<f64>,
    /// Interfaces in the order of the body.
    pub interfaces: Vec<MeshInterface>,
}

/// An interface as nodes of a mesh.
pub(crate) struct MeshInterface {
    /// Indices of the nodes.
    pub nodes: Vec<usize>,
    /// Reference point; for a free interface the mean of its nodes. Unit: length.
    pub reference: Vector3<f64>,
    /// True if the nodes determine a rotation.
    pub turns: bool,
}

impl Mesh {
    /// Builds the mesh of the nodes of `body` selected by `points`.
    pub(super) fn new(body: &FlexBody, points: &Points) -> Self {
        match points {
            Points::Usual | Points::Nodes => Self::of_all_nodes(body),
            _ => Self::of_places(body, points),
        }
    }

    fn of_all_nodes(body: &FlexBody) -> Self {
        let interface = |interface: &Interface| MeshInterface {
            nodes: interface.nodes.clone(),
            reference: reference(body, interface),
            turns: turns(body, interface),
        };
        Self {
            numbers: body.nodes().ids.clone(),
            positions: body.nodes().positions.clone(),
            shape: body.modes().shape.clone(),
            interfaces: body.interfaces().iter().map(interface).collect(),
        }
    }

    fn of_places(body: &FlexBody, points: &Points) -> Self {
        let mut places = MeshBuilder { body, mesh: Self::empty(), columns: Vec::new() };
        let held: &[Interface] = if points.of_interfaces() { body.interfaces() } else { &[] };
        for (number, interface) in held.iter().enumerate() {
            let frames = interface_frames(body, interface, number);
            let turning = frames.iter().any(|frame| frame.rotation.is_some());
            let arm = arm_of(body, interface);
            let nodes = frames.iter().flat_map(|frame| places.add(frame, arm)).collect();
            let turns = turning || frames.len() > 1 && turns(body, interface);
            let reference = reference(body, interface);
            places.mesh.interfaces.push(MeshInterface { nodes, reference, turns });
        }
        for frame in named_nodes(body, points.named()) {
            places.add(&ExportFrame { rotation: None, ..frame }, 0.0);
        }
        places.finish()
    }

    fn empty() -> Self {
        Self { numbers: Vec::new(), positions: Vec::new(), shape: Mat::new(), interfaces: Vec::new() }
    }
}

/// Mesh under construction, extended place by place.
struct MeshBuilder<'b> {
    body: &'b FlexBody,
    mesh: Mesh,
    /// Motion of every node in each mode.
    columns: Vec<Vec<Vector3<f64>>>,
}

impl MeshBuilder<'_> {
    /// Adds one node, or the six nodes of a cross with this `arm` if the place has a rotation. Returns their
    /// indices.
    fn add(&mut self, frame: &ExportFrame, arm: f64) -> Vec<usize> {
        let column = |a: &Mat<f64>, j: usize| Vector3::from_fn(|k, _| a[(k, j)]);
        let offsets: Vec<Vector3<f64>> = match frame.rotation {
            Some(_) => [Vector3::x(), Vector3::y(), Vector3::z()]
                .into_iter()
                .flat_map(|axis| [axis * arm, -axis * arm])
                .collect(),
            None => vec![Vector3::zeros()],
        };
        let first = self.mesh.numbers.len();
        for offset in &offsets {
            let motion = (0..self.body.n_modes()).map(|j| {
                let turned = frame.rotation.as_ref().map(|rotation| column(rotation, j).cross(offset));
                column(&frame.translation, j) + turned.unwrap_or_default()
            });
            self.columns.push(motion.collect());
            self.mesh.numbers.push(frame.id);
            self.mesh.positions.push((Vector3::from(frame.position) + offset).into());
        }
        (first..first + offsets.len()).collect()
    }

    fn finish(mut self) -> Mesh {
        let columns = &self.columns;
        let entry = |row: usize, j: usize| columns[row / 3][j][row % 3];
        self.mesh.shape = Mat::from_fn(3 * columns.len(), self.body.n_modes(), entry);
        self.mesh
    }
}

/// Returns the reference point; for a free interface without one the mean of its nodes.
fn reference(body: &FlexBody, interface: &Interface) -> Vector3<f64> {
    let nodes = &interface.nodes;
    let sum: Vector3<f64> = nodes.iter().map(|&i| Vector3::from(body.nodes().positions[i])).sum();
    interface.reference.map_or(sum / nodes.len() as f64, Vector3::from)
}

/// Returns the length of the arms of a cross: the root mean square distance of the nodes from the reference
/// point, but at least a fixed part of the largest distance in the body.
fn arm_of(body: &FlexBody, interface: &Interface) -> f64 {
    let centre = reference(body, interface);
    let square = |position: &[f64; 3]| (Vector3::from(*position) - centre).norm_squared();
    let own = interface.nodes.iter().map(|&i| square(&body.nodes().positions[i])).sum::<f64>();
    let arm = (own / interface.nodes.len() as f64).sqrt();
    let farthest = body.nodes().positions.iter().map(square).fold(0.0, f64::max).sqrt();
    arm.max(ARM * farthest)
}

/// Returns true if the positions of the nodes determine a rotation; bodies of Exudyn have no rotations of
/// nodes.
fn turns(body: &FlexBody, interface: &Interface) -> bool {
    let about = Interface { reference: interface.reference.or(Some([0.0; 3])), ..interface.clone() };
    let still = Mat::zeros(3 * body.n_nodes(), 1);
    about.rows(body.nodes(), still.as_ref(), None, 3).is_some_and(|rows| rows.rotation.is_some())
}
