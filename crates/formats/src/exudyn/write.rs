//! Exudyn: the file that `ObjectFFRFreducedOrderInterface.LoadFromFile` reads (FEM.py, 1.13.6).
//!
//! The file follows the nodal formulation of Zwölfer and Gerstmayr (Acta Mech. 2021) with matrices that are
//! blocked by modes: three columns, along x, y and z, for each mode. With the skew matrices S_j~ of a mode
//! shape and x~ of the positions, mPsiTildePsi = int S_j~' S_k = -I5, mPsiTildePsiTilde = int S_j~' S_k~ =
//! -I9, mPhitTPsi = int S_j = I3, mPhitTPsiTilde = int S_j~, mXRefTildePsi = int x~' S_j = -I4,
//! mXRefTildePsiTilde = int x~' S_j~ = I8.

use crate::export::Holding::{self, Held, Lost, NotApplicable, Slight};
use crate::export::frames::{ExportFrame, interface_frames, named_nodes};
use crate::export::hdf5_contents::{Hdf5Contents, Hdf5Entry, hdf5_bytes};
use crate::export::matrices::inertia;
use crate::export::stresses::{NodalStresses, without_named_loads};
use crate::export::{ExportChecklist, ExportFormat, ExportOptions, Exported, Points, losses};
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, Interface};
use flexbody_body::invariants::Numbered;
use nalgebra::{Matrix3, Vector3};

/// Export format of Exudyn.
pub(crate) struct Exudyn;

impl ExportFormat for Exudyn {
    fn name(&self) -> &'static str {
        "exudyn"
    }

    fn reader(&self) -> &'static str {
        "Exudyn, ObjectFFRFreducedOrderInterface.LoadFromFile"
    }

    fn has_points(&self) -> bool {
        true
    }

    fn checklist(&self, body: &FlexBody, options: &ExportOptions) -> ExportChecklist {
        ExportChecklist {
            rigid_coupling: Held,
            plane: losses::plane(body),
            deformed_inertia: Held,
            general_w0: losses::general_w0(body),
            coriolis_force: Held,
            general_w3: losses::general_w3(body, options),
            separate_w2: Held,
            geometric_stiffness: losses::geometric_stiffness(body, options, |_| false),
            inertia_stiffness: losses::inertia_stiffness(body, options, |_| false),
            // The accompanying program gives it to the object.
            damping: Held,
            shapes: Held,
            // An interface written as a cross of nodes rotates exactly as in the body.
            rotations: if options.points.of_interfaces() { Held } else { rotations(body) },
            internal_rows: losses::internal_rows(body),
            gravity: Held,
            interfaces: Held,
            surface: Held,
            origins_of_modes: NotApplicable,
            units: NotApplicable,
            storage: NotApplicable,
            named_loads: without_named_loads(body),
            recoveries: {
                let numbers = Mesh::new(body, &options.points).numbers;
                let found = NodalStresses::new(body, numbers.iter().copied());
                NodalStresses::holding(found.as_ref(), body, false)
            },
        }
    }

    fn needs(&self, body: &FlexBody, _: &ExportOptions) -> Vec<String> {
        if !losses::is_damped(body) {
            return Vec::new();
        }
        vec![
            "LoadFromFile leaves out the damping of the file (`dampingMatrixReduced`): add the body by `add_body` of the program that is written beside the file (BODY_exudyn.py), which gives it to the object".to_owned(),
        ]
    }

    fn write(&self, body: &FlexBody, options: &ExportOptions) -> Result<Exported> {
        let mesh = Mesh::new(body, &options.points);
        let file = hdf5_bytes(&entries(body, &mesh))?;
        Ok(Exported { file, beside: vec![(SCRIPT_NAME.into(), SCRIPT.as_bytes().to_vec())] })
    }
}

/// Returns the contents of the file in the order of the writer of Exudyn. The attribute `datatype` is the
/// Python type.
fn entries(body: &FlexBody, mesh: &Mesh) -> Vec<Hdf5Entry> {
    let (n, nf) = (mesh.numbers.len(), body.n_modes());
    let numbered = inertia(body);
    let center = numbered.i2 / numbered.i1;
    let [info, version] = [vec![nf, n, 3, 4, 7, 7 + nf], vec![1]]
        .map(|counts| counts.into_iter().map(|count| count as i64).collect::<Vec<_>>());
    let text = |text: &str| Hdf5Contents::Text(text.to_owned());
    let mut all = vec![
        array("modeBasis", Hdf5Contents::matrix(&mesh.shape)),
        array("trigList", triangles(body, mesh)),
        stress_modes(body, mesh),
        modal_mass(body, &numbered),
        array("stiffnessMatrixReduced", Hdf5Contents::matrix(body.invariants().modal_stiffness())),
        array("infoList", Hdf5Contents::Integers(vec![6], info)),
        text("NodeType.RotationEulerParameters").named("rigidBodyNodeType").with("datatype", "str"),
        array("xRef", Hdf5Contents::list(mesh.positions.as_flattened())),
        array("inertiaLocal", square(&numbered.i7)),
        array("Mtt", square(&(Matrix3::identity() * numbered.i1))),
        Hdf5Contents::number(numbered.i1).named("totalMass").with("datatype", "float64"),
        array("chiU", Hdf5Contents::list(center.as_slice())),
        array("chiUtilde", square(&center.cross_matrix())),
    ];
    all.extend(coupling(&numbered, nf));
    all.extend(interface_entries(body, mesh));
    all.extend(additional_entries(body));
    all.push(Hdf5Contents::Integers(Vec::new(), version).named("fileVersion").with("datatype", "int"));
    all.push(text("ObjectFFRFreducedOrderInterface").named("type").with("datatype", "str"));
    all
}

/// Returns the arrays that the loader of Exudyn ignores and the accompanying program reads: the damping of a body that
/// has some, and the body frame in the model (x_model = origin + axes x_body).
fn additional_entries(body: &FlexBody) -> Vec<Hdf5Entry> {
    let damping =
        losses::is_damped(body).then(|| array("dampingMatrixReduced", Hdf5Contents::matrix(&body.damping())));
    let frame = body.frame();
    let axes = array("frameAxes", square(&frame.axes));
    let origin = array("frameOrigin", Hdf5Contents::list(frame.origin.as_slice()));
    damping.into_iter().chain([axes, origin]).collect()
}

/// Returns the triangles of the surface as indices of mesh nodes (k x 3) for drawing and contact; empty if
/// the mesh does not consist of the nodes of the body.
fn triangles(body: &FlexBody, mesh: &Mesh) -> Hdf5Contents {
    let own = body.mesh().filter(|_| mesh.numbers == body.nodes().ids);
    let corners: Vec<i64> = own.map_or(Vec::new(), |own| {
        own.triangles().as_flattened().iter().map(|&index| i64::from(index)).collect()
    });
    Hdf5Contents::Integers(vec![corners.len() / 3, 3], corners)
}

/// Returns the stresses of the mesh nodes in the modes (n x 6 nf, column 6 j + c for the components xx, yy, zz, yz, xz, xy
/// along body axes) as Exudyn's `StressLocal`; an empty dictionary for a body without stresses of nodes.
fn stress_modes(body: &FlexBody, mesh: &Mesh) -> Hdf5Entry {
    const COMPONENTS: [usize; 6] = [0, 1, 2, 4, 5, 3];
    let found = NodalStresses::new(body, mesh.numbers.iter().copied());
    let entries = found.map_or_else(Vec::new, |stresses| {
        let value = |node: usize, column: usize| stresses.in_mode(node, column / 6)[COMPONENTS[column % 6]];
        let matrix = Hdf5Contents::from_fn(mesh.numbers.len(), 6 * body.n_modes(), value);
        let kind = Hdf5Contents::Text("OutputVariableType.StressLocal".to_owned());
        vec![array("matrix", matrix), kind.named("outputVariableType").with("datatype", "str")]
    });
    Hdf5Contents::Group(entries).named("postProcessingModes").with("datatype", "dict")
}

/// Returns m_ff. For a mass that does not commute with rotations an attribute states it, because no array
/// does: m_ff and mPsiTildePsiTilde then need not agree. Exudyn ignores the attribute.
fn modal_mass(body: &FlexBody, numbered: &Numbered) -> Hdf5Entry {
    let entry = array("massMatrixReduced", Hdf5Contents::matrix(&numbered.i6));
    match body.invariants().general() {
        Some(_) => entry.with("mass_structure", "general"),
        None => entry,
    }
}

/// Returns the arrays that couple translation, rotation and modes. Row or column 3 j + a belongs to axis a of
/// mode j.
fn coupling(numbered: &Numbered, nf: usize) -> Vec<Hdf5Entry> {
    let zero = || 0.0;
    let i5 =
        |row: usize, k: usize| numbered.i5.as_ref().map_or_else(zero, |i5| i5[(row % 3 * nf + row / 3, k)]);
    let i9 = |row: usize, column: usize| {
        let at = |index: usize| index % 3 * nf + index / 3;
        numbered.i9.as_ref().map_or_else(zero, |i9| i9[(at(row), at(column))])
    };
    let skew = |a: usize, column: usize| {
        let j = column / 3;
        Vector3::new(numbered.i3[(0, j)], numbered.i3[(1, j)], numbered.i3[(2, j)]).cross_matrix()
            [(a, column % 3)]
    };
    vec![
        array("mPsiTildePsi", Hdf5Contents::from_fn(3 * nf, nf, |row, k| -i5(row, k))),
        array("mPsiTildePsiTilde", Hdf5Contents::from_fn(3 * nf, 3 * nf, |row, column| -i9(row, column))),
        array("mPhitTPsi", Hdf5Contents::matrix(&numbered.i3)),
        array("mPhitTPsiTilde", Hdf5Contents::from_fn(3, 3 * nf, skew)),
        array("mXRefTildePsi", Hdf5Contents::from_fn(3, nf, |a, j| -numbered.i4[(a, j)])),
        array(
            "mXRefTildePsiTilde",
            Hdf5Contents::from_fn(3, 3 * nf, |a, column| numbered.i8[column / 3][(a, column % 3)]),
        ),
    ]
}

fn array(name: &str, contents: Hdf5Contents) -> Hdf5Entry {
    contents.named(name).with("datatype", "ndarray")
}

fn square(a: &Matrix3<f64>) -> Hdf5Contents {
    Hdf5Contents::from_fn(3, 3, |i, j| a[(i, j)])
}

// Mesh of Exudyn: the nodes that its markers are attached to, and the interfaces as sets of nodes.
//
// The cost of a marker per step grows with the number of its nodes. If interfaces are selected, an interface
// with a rotation is therefore written as six nodes on a cross about its reference point, which move rigidly
// with it: the mean of the nodes is the reference point, and their best-fit rotation is that of the
// interface, both exactly.

/// Smallest length of the arms of a cross, relative to the largest distance of a node of the body from the
/// reference point.
const ARM: f64 = 0.01;

/// Nodes with their motion, and the interfaces on them.
struct Mesh {
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

/// Returns the holding of the rotations of the nodes, which bodies of Exudyn do not have. No frequency and no
/// deflection depends on them, but a joint at an interface whose rotation only they determine cannot turn with it.
fn rotations(body: &FlexBody) -> Holding {
    let modes = body.modes();
    let Some(rotation) = &modes.rotation else { return NotApplicable };
    let needs = |interface: &&Interface| {
        let rows =
            interface.rows(body.nodes(), modes.shape.as_ref(), Some(rotation.as_ref()), body.dimension());
        rows.is_some_and(|rows| rows.rotation.is_some()) && !turns(body, interface)
    };
    let names: Vec<String> =
        body.interfaces().iter().filter(needs).map(|interface| format!("`{}`", interface.name)).collect();
    if names.is_empty() {
        Slight(
        "the rotations of the nodes in the modes: deflections and frequencies do not depend on them, but markers at single nodes do not turn with them".to_owned(),
    )
    } else {
        Lost(format!(
            "the rotations of the nodes in the modes, without which joints do not turn with {}; --points interfaces writes them",
            names.join(", ")
        ))
    }
}

/// Returns true if the positions of the nodes determine a rotation; bodies of Exudyn have no rotations of
/// nodes.
fn turns(body: &FlexBody, interface: &Interface) -> bool {
    let about = Interface { reference: interface.reference.or(Some([0.0; 3])), ..interface.clone() };
    let still = Mat::zeros(3 * body.n_nodes(), 1);
    about.rows(body.nodes(), still.as_ref(), None, 3).is_some_and(|rows| rows.rotation.is_some())
}

// Interfaces of a body for the markers of Exudyn, which refer to mesh nodes, counted from 0, with weights.
//
// `MarkerSuperElementRigid` takes the weighted mean of the nodes as its position and, by its "alternative
// approach", the rotation that fits their displacements best. With equal weights this is the motion of an
// interface of flexbody; `offset` is the vector from the mean to the reference point.

/// Accompanying Python program: loads the body with its damping, puts a joint at each interface and drives one.
const SCRIPT: &str = include_str!("run.py");

/// Suffix that replaces the extension of the file in the name of the accompanying program.
const SCRIPT_NAME: &str = "_exudyn.py";

/// Returns the node numbers of the FE model and the interfaces in their order; the loader of Exudyn ignores
/// both.
fn interface_entries(body: &FlexBody, mesh: &Mesh) -> Vec<Hdf5Entry> {
    let held = body.interfaces().iter().zip(&mesh.interfaces).enumerate();
    let interfaces = held.map(|(number, (own, nodes))| interface(number, own, nodes, mesh)).collect();
    let numbers = integers("nodeNumbers", mesh.numbers.clone());
    vec![numbers, Hdf5Contents::Group(interfaces).named("interfaces").with("datatype", "dict")]
}

fn interface(number: usize, interface: &Interface, own: &MeshInterface, mesh: &Mesh) -> Hdf5Entry {
    let count = own.nodes.len();
    let sum: Vector3<f64> = own.nodes.iter().map(|&i| Vector3::from(mesh.positions[i])).sum();
    let mean = sum / count as f64;
    let text =
        |name: &str, text: &str| Hdf5Contents::Text(text.to_owned()).named(name).with("datatype", "str");
    let list =
        |name: &str, values: &[f64]| Hdf5Contents::list(values).named(name).with("datatype", "ndarray");
    let members = vec![
        text("name", &interface.name),
        text("coupling", interface.coupling.map_or("not stated", |coupling| coupling.name())),
        text("marker", if own.turns { "rigid" } else { "position" }),
        integers("nodeNumbers", own.nodes.iter().map(|&i| mesh.numbers[i]).collect()),
        integers("meshNodeNumbers", own.nodes.iter().map(|&i| i as i64).collect()),
        list("weights", &vec![1.0 / count as f64; count]),
        list("referencePoint", own.reference.as_slice()),
        list("offset", (own.reference - mean).as_slice()),
    ];
    // HDF5 orders links by name.
    Hdf5Contents::Group(members).named(format!("interface{number:04}")).with("datatype", "dict")
}

fn integers(name: &str, values: Vec<i64>) -> Hdf5Entry {
    Hdf5Contents::Integers(vec![values.len()], values).named(name).with("datatype", "ndarray")
}
