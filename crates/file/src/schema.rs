//! The table of the flex-body file, from which writer, reader, validator, `docs/reference/file_format.md` and the JSON
//! schema follow.

pub(super) mod certificate;
mod entry;
mod interfaces;
mod invariants;
mod named_load;
mod recovery;

use super::draft::node_indices;
use super::item::Extent::{Edges, Fixed, InternalRows, Modes, Nodes, Triangles};
use super::item::ItemKind::{Floats, Indices, Int, Ints, Text};
use super::item::Origin::{ConstantInt, ConstantText};
use super::item::{EntrySet, Item, SchemaGroup, both, field, put, written};
use super::per::Per;
use super::units::{
    LENGTH, MASS_LENGTH, MASS_LENGTH2, ONE, PER_ROOT_MASS, PER_ROOT_MASS_LENGTH, PER_TIME2, Units, dimension,
};
use super::value::{Stored, Value, indices, json_list, shape_rows, text};
use super::version::{DIGESTS_SINCE, MAJOR, least_minor};
use certificate::{CERTIFICATE, CERTIFIED, FREE_EIGENVALUE, FREE_EIGENVALUE_LOWER, INVARIANT_DIGITS, TERMS};
use entry::{INERTIA, attribute, constant, dataset, named};
use flexbody_base::provenance;
use flexbody_body::flex_body::{MassStructure, ReferenceConditions, Storage};
use flexbody_model::NodeMoments;
use interfaces::{COORDINATES, INTERFACES};
use invariants::{
    COMPARISON, DAMPING, ESTIMATED_STIFFNESS, GEOMETRIC_STIFFNESS, INERTIA_STIFFNESS, INVARIANTS, LUMPED,
    ROTATED_STIFFNESS,
};
use nalgebra::{Matrix3, Vector3};
use named_load::NAMED_LOAD;
use recovery::RECOVERY;

#[cfg(feature = "hdf5")]
pub(super) use recovery::labels_json;

pub(super) use flexbody_base::provenance::{DIGEST_OF_LIST as WHOLE, LIST_OF_DIGESTS as LIST};

/// Name of the attribute of `/interfaces`, `/recovery` and `/named_loads` with the order of two or more members: their link
/// names as a JSON array.
pub(super) const ORDER: &str = "order";

/// Value of the root attribute `format`.
pub(super) const FORMAT: &str = "flexbody";

const ROOT: &[Item] = &[
    constant("format", Text, ConstantText(FORMAT), "marks a flex-body file"),
    constant("format_major", Int, ConstantInt(MAJOR), "version of the format; a reader refuses a newer one"),
    attribute(
        "format_minor",
        Int,
        ONE,
        "additions within the major version; a reader ignores what it does not know",
        written(|v| Some(Value::Int(least_minor(TABLE, v.body)))),
    ),
    attribute(
        "generator",
        Text,
        ONE,
        "program and version that wrote the file",
        written(|_| text(provenance::generator())),
    ),
    attribute(
        "dimension",
        Int,
        ONE,
        "3; 2: the body stays in its plane z = 0, all components along z are zero",
        field!(dimension),
    ),
    attribute(
        "units_length",
        Text,
        ONE,
        "unit of length: a name (`m mm cm um km in ft`) or its size in m",
        written(|v| text(v.body.description.units.length.name())),
    ),
    attribute(
        "units_mass",
        Text,
        ONE,
        "unit of mass: a name (`kg g t tonne lb slug slinch`) or its size in kg",
        written(|v| text(v.body.description.units.mass.name())),
    ),
    attribute(
        "units_time",
        Text,
        ONE,
        "unit of time: a name (`s ms us`) or its size in s",
        written(|v| text(v.body.description.units.time.name())),
    ),
    attribute(
        "storage",
        Text,
        ONE,
        "`f32`: shapes and the inertia of the modes are rounded to 32-bit floats, in the datasets marked float32; absent: `f64`, all floats have 64 bits",
        written(|v| text((v.body.storage == Storage::F32).then(|| v.body.storage.name())?)),
    )
    .added(3),
    attribute(
        "units_stated",
        Int,
        ONE,
        "1: the user stated the units; 0: m, kg, s were assumed",
        written(|v| Some(Value::Int(v.body.description.units.stated.into()))),
    ),
    attribute(
        LIST,
        Text,
        ONE,
        "SHA-256 of every group and dataset, as described above: a line for each, by path; absent before 1.4",
        // The writer adds the entry at the end, from the written content.
        written(|_| None),
    )
    .added(DIGESTS_SINCE),
    attribute(
        WHOLE,
        Text,
        ONE,
        "SHA-256 of the text of `digests`: of all content; absent before 1.4",
        written(|_| None),
    )
    .added(DIGESTS_SINCE),
];

/// Returns the message about two entries that require each other.
fn both_or_none(entries: &[(String, bool)]) -> String {
    format!("{} and {}: expected both or none, found one", entries[0].0, entries[1].0)
}

static BODY_NUMBER: EntrySet = EntrySet { problem: both_or_none };
static INTERNAL_ROWS: EntrySet = EntrySet { problem: both_or_none };
const SOURCE: &[Item] = &[
    attribute("model", Text, ONE, "name of the model", field!(description.name)),
    attribute(
        "files",
        Text,
        ONE,
        "input files as a JSON array of objects with `role`, `name`, `sha256`",
        both(
            |v| text(serde_json::to_string(&v.body.source.files).expect("structs of strings are valid JSON")),
            put!(|d, read| d.body.source.files = read.json("a JSON array of files")?),
        ),
    ),
    attribute(
        "body_number",
        Int,
        ONE,
        "which of several bodies in the same matrices this is, from 1 (`--split`)",
        field!(number: number),
    )
    .with(&BODY_NUMBER)
    .added(2),
    attribute("bodies", Int, ONE, "how many bodies the matrices hold (`--split`)", field!(number: of))
        .with(&BODY_NUMBER)
        .added(2),
    attribute("n_nodes", Int, ONE, "nodes of the body", written(|v| v.body.nodes.len().value())).derived(""),
    attribute("n_dofs", Int, ONE, "rows of the FE matrices; 0: not known, the body comes from another program", field!(source.n_dofs)),
    attribute(
        "mass_structure",
        Text,
        ONE,
        "`rotation-invariant`: every 3x3 node block of M is a multiple of I; `diagonal`: that, and M diagonal; `general`: neither, and `/invariants/W0` is there",
        both(
            |v| text(v.body.source.mass_structure.name()),
            put!(|d, read| d.body.source.mass_structure = named(read.text(), MassStructure::ALL, MassStructure::name)?),
        ),
    ),
    attribute(
        "approximation",
        Text,
        ONE,
        "approximation in the invariants for the mass structure `general`; absent: none, the invariants are exact for the matrices",
        field!(source.approximation),
    )
    .added(2),
    attribute(
        "settings",
        Text,
        ONE,
        "settings of the run that can change the result, as JSON",
        both(
            |v| text(v.body.source.settings.to_string()),
            put!(|d, read| d.body.source.settings = read.json("JSON")?),
        ),
    ),
];

const FRAME: &[Item] = &[
    attribute(
        "reference_conditions",
        Text,
        ONE,
        "reference conditions, which tie the frame to the deformed body: `interface NAME`: its reference point is the origin and rests in every mode; `not stated`: the modes imply the conditions, as in a file of another program; absent: `mean axes`, C1 = C2 = 0",
        both(
            |v| text((!v.body.conditions.is_mean()).then(|| v.body.conditions.text())?),
            |d, read| {
                let stated = read.text();
                d.body.conditions = ReferenceConditions::from_text(&stated).ok_or_else(|| {
                    format!("expected `mean axes`, `interface NAME` or `not stated`, found {stated:?}")
                })?;
                Ok(())
            },
        ),
    )
    .added(7),
    dataset(
        "origin",
        Floats(&[Fixed(3)]),
        LENGTH,
        "r0",
        "origin of the body frame in model coordinates",
        field!(frame.origin),
    ),
    dataset(
        "axes",
        Floats(&[Fixed(3), Fixed(3)]),
        ONE,
        "A0",
        "columns are the body axes in model axes, right-handed: x_model = r0 + A0 x_body",
        field!(frame.axes),
    ),
];

const NODES: &[Item] = &[
    dataset(
        "id",
        Ints(&[Nodes]),
        ONE,
        "id",
        "node numbers of the FE model, unique",
        both(
            |v| v.body.nodes.ids.value(),
            |d, read| {
                d.body.nodes.ids = Vec::take(read)?;
                d.index = d.body.nodes.ids.iter().enumerate().map(|(i, id)| (*id, i)).collect();
                Ok(())
            },
        ),
    ),
    dataset(
        "position",
        Floats(&[Nodes, Fixed(3)]),
        LENGTH,
        "x",
        "undeformed node positions in the body frame",
        field!(nodes.positions),
    ),
    dataset(
        "rotational_first_moment",
        Floats(&[Nodes, Fixed(3)]),
        MASS_LENGTH,
        "h",
        "moments of the mass that turns with each node, about the frame origin: of director a the sum of E_s over all points (theory section 6); with `rotational_second_moment` what `/inertia_stiffness` follows from",
        both(
            |v| {
                let moments = &v.body.inertia_stiffness.as_ref()?.moments;
                Some(Value::Floats(moments.iter().flat_map(|own| own.first.iter().copied()).collect()))
            },
            |d, read| {
                let moments = |first: &[f64]| NodeMoments {
                    first: Vector3::from_column_slice(first),
                    second: Matrix3::zeros(),
                };
                d.inertia().moments = read.floats().chunks_exact(3).map(moments).collect();
                Ok(())
            },
        ),
    )
    .with(&INERTIA)
    .added(6),
    dataset(
        "rotational_second_moment",
        Floats(&[Nodes, Fixed(3), Fixed(3)]),
        MASS_LENGTH2,
        "z",
        "row a: of director a the sum of E_s with the places of all points and directors",
        both(
            |v| {
                let moments = v.body.inertia_stiffness.as_ref()?.moments.iter();
                Some(Value::Floats(moments.flat_map(|own| own.second.transpose().as_slice().to_vec()).collect()))
            },
            |d, read| {
                for (own, second) in d.inertia().moments.iter_mut().zip(read.floats().chunks_exact(9)) {
                    own.second = Matrix3::from_row_slice(second);
                }
                Ok(())
            },
        ),
    )
    .with(&INERTIA)
    .added(6),
];

const MESH: &[Item] = &[
    dataset(
        "triangles",
        Indices(&[Triangles, Fixed(3)]),
        ONE,
        "",
        "triangles of the surface by the indices of their nodes in `/nodes`, from 0, counterclockwise seen from outside; absent: lines only",
        both(
            |v| {
                let triangles = v.body.mesh.as_ref()?.triangles();
                (!triangles.is_empty()).then(|| indices(triangles.as_flattened()))
            },
            |d, read| node_indices(read, &mut d.triangles),
        ),
    )
    .added(5),
    dataset(
        "edges",
        Indices(&[Edges, Fixed(2)]),
        ONE,
        "",
        "edges to draw: where the surface turns by more than 30 degrees or ends, and beams; absent: none",
        both(
            |v| {
                let edges = v.body.mesh.as_ref()?.edges();
                (!edges.is_empty()).then(|| indices(edges.as_flattened()))
            },
            |d, read| node_indices(read, &mut d.edges),
        ),
    )
    .added(5),
];

const MODES: &[Item] = &[
    attribute(
        "truncation",
        Text,
        ONE,
        "JSON array with the `load` of every residual vector and of every interface, and the part of the static response to it that the modes cannot represent, in the norm of K, `before` (free modes alone) and `after`; absent: not known",
        both(
            |v| json_list(&v.body.modes.truncation),
            put!(|d, read| d.body.modes.truncation = read.json("a JSON array of loads")?),
        ),
    )
    .added(2),
    attribute(
        "provenance",
        Text,
        ONE,
        "origin of each mode, as a JSON array of nf texts; absent: not known",
        both(
            |v| json_list(&v.body.modes.provenance),
            put!(|d, read| d.body.modes.provenance = read.json("a JSON array of texts")?),
        ),
    )
    .added(2),
    dataset(
        "eigenvalue",
        Floats(&[Modes]),
        PER_TIME2,
        "lambda",
        "eigenvalues of K psi = lambda M psi, positive, ascending",
        field!(modes.eigenvalue),
    ),
    dataset(
        "frequency_hz",
        Floats(&[Modes]),
        Units::Hertz,
        "f",
        "sqrt(lambda) / (2 pi), in hertz whatever the unit of time",
        written(|v| {
            let hertz = v.body.description.units.hertz();
            let frequency = |l: &f64| l.sqrt() / std::f64::consts::TAU * hertz;
            Some(Value::Floats(v.body.modes.eigenvalue.iter().map(frequency).collect()))
        }),
    )
    .derived("frequency_hz"),
    dataset(
        "residual",
        Floats(&[Modes]),
        ONE,
        "rho",
        "|K psi - lambda M psi| / (|K psi| + |lambda| |M psi|), 2-norms",
        field!(modes.residual),
    ),
    dataset(
        "damping_ratio",
        Floats(&[Modes]),
        ONE,
        "zeta",
        "modal damping ratios; 0 where none was given",
        field!(modes.damping_ratio),
    ),
    dataset(
        "eigenvalue_lower",
        Floats(&[Modes]),
        PER_TIME2,
        "lambda-",
        "guaranteed lower bounds of the eigenvalues of K and M as stored; accuracy `certified` only",
        field!(guarantee: eigenvalue_lower),
    )
    .with(&CERTIFIED)
    .added(1),
    dataset(
        "eigenvalue_upper",
        Floats(&[Modes]),
        PER_TIME2,
        "lambda+",
        "guaranteed upper bounds of the eigenvalues of K and M as stored; accuracy `certified` only",
        field!(guarantee: eigenvalue_upper),
    )
    .with(&CERTIFIED)
    .added(1),
    dataset(
        "shape_error",
        Floats(&[Modes]),
        ONE,
        "e",
        "guaranteed upper bounds of the distance of each mode to the exact eigenspace of its cluster, in the norm of M; accuracy `certified` only",
        field!(guarantee: shape_error),
    )
    .with(&CERTIFIED)
    .added(1),
    FREE_EIGENVALUE,
    FREE_EIGENVALUE_LOWER,
    dataset(
        "shape",
        Floats(&[Modes, Nodes, Fixed(3)]),
        PER_ROOT_MASS,
        "Psi",
        "mass-normalised mode shapes: displacement of every node in body axes; the largest component of each mode is positive",
        both(
            |v| Some(shape_rows(&v.body.modes.shape, 0..v.body.nodes.len())),
            put!(|d, read| d.body.modes.shape = read.shapes(d.nf())),
        ),
    )
    .large(),
    dataset(
        "rotation",
        Floats(&[Modes, Nodes, Fixed(3)]),
        PER_ROOT_MASS_LENGTH,
        "theta",
        "rotation of every node in body axes, zero where the model has none; absent: a model of displacements",
        both(
            |v| Some(shape_rows(v.body.modes.rotation.as_ref()?, 0..v.body.nodes.len())),
            put!(|d, read| d.body.modes.rotation = Some(read.shapes(d.nf()))),
        ),
    )
    .added(2)
    .large(),
    dataset(
        "internal_dof",
        Ints(&[InternalRows, Fixed(2)]),
        ONE,
        "",
        "number and direction (1 to 6) that label each row of the FE model without coordinates",
        field!(internal: dofs),
    )
    .with(&INTERNAL_ROWS)
    .added(2),
    dataset(
        "internal",
        Floats(&[InternalRows, Modes]),
        Units::OfModel(dimension(-1, 0, 0)),
        "",
        "the modes at these rows, as the FE model scales them; vectors (three rows) in body axes",
        field!(internal: shape),
    )
    .with(&INTERNAL_ROWS)
    .added(2)
    .large(),
];

/// Groups of the file, in the order in which they are written.
pub(super) const TABLE: &[SchemaGroup] = &[
    SchemaGroup { path: "/", per: Per::Body, description: "Format and units.", items: &[ROOT] },
    SchemaGroup { path: "/source", per: Per::Body, description: "Origin of the body.", items: &[SOURCE] },
    SchemaGroup { path: "/frame", per: Per::Body, description: "The body frame.", items: &[FRAME] },
    SchemaGroup { path: "/nodes", per: Per::Body, description: "Nodes of the body.", items: &[NODES] },
    SchemaGroup {
        path: "/mesh",
        per: Per::Body,
        description: "The surface of the part on some of its nodes, to draw it by. Nothing is computed from it. Absent: not known.",
        items: &[MESH],
    },
    SchemaGroup {
        path: "/modes",
        per: Per::Body,
        description: "Mode shapes and the properties of each mode.",
        items: &[MODES],
    },
    SchemaGroup {
        path: "/invariants",
        per: Per::Body,
        description: "Exact invariants from the consistent mass, about the frame origin, in body axes.",
        items: &[INVARIANTS, DAMPING],
    },
    SchemaGroup {
        path: "/lumped/<scheme>",
        per: Per::LumpingScheme,
        description: "The same invariants from lumped masses, with the same modes.",
        items: &[LUMPED, INVARIANTS],
    },
    SchemaGroup {
        path: "/comparison/<scheme>",
        per: Per::LumpingScheme,
        description: "Errors of the lumped invariants against the exact ones.",
        items: &[COMPARISON],
    },
    SchemaGroup {
        path: "/certificate",
        per: Per::Body,
        description: "Proofs about the modes, and the digits of the input.",
        items: &[CERTIFICATE, INVARIANT_DIGITS],
    },
    SchemaGroup {
        path: "/terms",
        per: Per::Body,
        description: "Groups of the kinetic energy that the body holds or drops, with the reasons. A solver omits a dropped group in all equations.",
        items: &[TERMS],
    },
    SchemaGroup {
        path: "/interfaces/<name>",
        per: Per::Interface,
        description: "Named node sets, their couplings, and the modes at them.",
        items: &[INTERFACES],
    },
    SchemaGroup {
        path: "/geometric_stiffness/<load>",
        per: Per::UnitLoad,
        description: "Stiffness that the stress under a unit load adds. Named `kind_axis`, `kind_axis_interface` or `load_name`; loads along body axes, accelerations and spin about the frame origin. Absent: zero, or not known.",
        items: &[GEOMETRIC_STIFFNESS],
    },
    SchemaGroup {
        path: "/rotated_stiffness/<load>",
        per: Per::RotatedLoad,
        description: "Geometric stiffness of unit rotations R of the body about the axes of the frame, for every load of `/geometric_stiffness`: what modes lose or gain where a rigid motion is taken from them, as that of a carrier (theory section 7). Translations cause no force. Absent: not known.",
        items: &[ROTATED_STIFFNESS],
    },
    SchemaGroup {
        path: "/estimated_stiffness/<load>",
        per: Per::EstimatedLoad,
        description: "Estimate of the geometric stiffness of spin about the centre of mass for the components that `/geometric_stiffness` does not hold: forces of a truss between the nodes that K couples, under the same load (theory section 7). It shows what a result without geometric stiffness is worth; a solver must not add it. Absent: nothing is missing, or not known.",
        items: &[ESTIMATED_STIFFNESS],
    },
    SchemaGroup {
        path: "/inertia_stiffness/<load>",
        per: Per::InertiaLoad,
        description: "Stiffness that the inertia of turning nodes adds: terms of the kinetic energy of second order in the rotations of nodes that carry rotational inertia or an eccentric mass. Signs and loads are those of `/geometric_stiffness`, to which a solver adds it: `acceleration_x` to `_z`, `angular_acceleration_x` to `_z`, `spin_xx` to `_xz`, all of them; in the plane `acceleration_x`, `_y`, `angular_acceleration_z`, `spin_zz`. Absent: zero; in files before 1.6 of mass structure `general`: not known.",
        items: &[INERTIA_STIFFNESS],
    },
    SchemaGroup {
        path: "/recovery/<name>",
        per: Per::Recovery,
        description: "Rows that read stresses, strains, forces or displacements off the deformed body: y = offset + modes q + loads f + spin (w w), with the modal coordinates q, the loads f at the interfaces (and, since 1.9, the amplitudes of named loads), and the angular velocity w (theory section 12). Accelerations and gravity have no columns. The rows are along the axes of the operator that they were made of. Absent: none.",
        items: &[RECOVERY],
    },
    SchemaGroup {
        path: "/named_loads/<name>",
        per: Per::NamedLoad,
        description: "Nodal forces f that act as one load with an amplitude a: generalised forces a (F, T + L q, Psi'f) on the frame and the modes, the forces along body axes at the deformed places of their nodes. Of a preload, whose resultant is zero on the deformed body too, Psi'f alone, always with a = 1. Absent: none.",
        items: &[NAMED_LOAD],
    },
    SchemaGroup {
        path: "/interface_coordinates",
        per: Per::Body,
        description: "Stiffness and mass in the motions of the interfaces and the amplitudes of the fixed-interface modes (Craig-Bampton), six coordinates for every reference point, as reduced-order blocks of multibody packages take them. Only of the basis `craig-bampton`.",
        items: &[COORDINATES],
    },
];

#[cfg(test)]
mod tests;
