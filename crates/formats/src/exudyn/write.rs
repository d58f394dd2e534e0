//! Exudyn: the file that `ObjectFFRFreducedOrderInterface.LoadFromFile` reads (FEM.py, 1.13.6).
//!
//! The file follows the nodal formulation of Zwölfer and Gerstmayr (Acta Mech. 2021) with matrices that are
//! blocked by modes: three columns, along x, y and z, for each mode. With the skew matrices S_j~ of a mode
//! shape and x~ of the positions, mPsiTildePsi = int S_j~' S_k = -I5, mPsiTildePsiTilde = int S_j~' S_k~ =
//! -I9, mPhitTPsi = int S_j = I3, mPhitTPsiTilde = int S_j~, mXRefTildePsi = int x~' S_j = -I4,
//! mXRefTildePsiTilde = int x~' S_j~ = I8.

use super::interfaces;
use super::mesh::Mesh;
use crate::export::Holding::{Held, NotApplicable};
use crate::export::hdf5_contents::{Hdf5Contents, Hdf5Entry, hdf5_bytes};
use crate::export::inertia::inertia;
use crate::export::stresses::NodalStresses;
use crate::export::{ExportChecklist, ExportFormat, ExportOptions, Exported, losses};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
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
            general_w3: losses::general_w3(body),
            separate_w2: Held,
            geometric_stiffness: losses::geometric_stiffness(body, |_| false),
            inertia_stiffness: losses::inertia_stiffness(body, options, |_| false),
            damping: losses::damping(body),
            shapes: Held,
            // An interface written as a cross of nodes rotates exactly as in the body.
            rotations: if options.points.of_interfaces() { Held } else { losses::rotations(body) },
            internal_rows: losses::internal_rows(body),
            gravity: Held,
            interfaces: Held,
            surface: Held,
            origins_of_modes: NotApplicable,
            units: NotApplicable,
            storage: NotApplicable,
            recoveries: {
                let numbers = Mesh::new(body, &options.points).numbers;
                let found = NodalStresses::new(body, numbers.iter().copied());
                NodalStresses::holding(found.as_ref(), body, false)
            },
        }
    }

    fn write(&self, body: &FlexBody, options: &ExportOptions) -> Result<Exported> {
        let mesh = Mesh::new(body, &options.points);
        let file = hdf5_bytes(&entries(body, &mesh))?;
        let script = (!mesh.interfaces.is_empty())
            .then(|| (interfaces::SCRIPT_NAME, interfaces::SCRIPT.as_bytes().to_vec()));
        Ok(Exported { file, beside: script.into_iter().map(|(name, text)| (name.into(), text)).collect() })
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
    all.extend(interfaces::entries(body, mesh));
    all.push(Hdf5Contents::Integers(Vec::new(), version).named("fileVersion").with("datatype", "int"));
    all.push(text("ObjectFFRFreducedOrderInterface").named("type").with("datatype", "str"));
    all
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
