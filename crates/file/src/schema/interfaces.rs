//! Entries of interfaces.

use super::super::item::Extent::{Coordinates, Fixed, InterfaceNodes, Modes};
use super::super::item::Item;
use super::super::item::ItemKind::{Floats, Ints, Text};
use super::{LENGTH, ONE, PER_ROOT_MASS, PER_ROOT_MASS_LENGTH, attribute, dataset};
use crate::value::{Units, Value, matrix, shape_rows, text};

pub(super) const INTERFACES: &[Item] = &[
    dataset("node_id", Ints(&[InterfaceNodes]), ONE, "id", "node numbers of the interface", |v| {
        Some(Value::Ints(v.interface_nodes().iter().map(|&i| v.body.nodes.ids[i]).collect()))
    }),
    dataset(
        "position",
        Floats(&[InterfaceNodes, Fixed(3)]),
        LENGTH,
        "x",
        "their positions in the body frame",
        |v| {
            Some(Value::Floats(v.interface_nodes().iter().flat_map(|&i| v.body.nodes.positions[i]).collect()))
        },
    )
    .derived("position"),
    dataset(
        "shape",
        Floats(&[Modes, InterfaceNodes, Fixed(3)]),
        PER_ROOT_MASS,
        "Psi",
        "their rows of /modes/shape",
        |v| Some(shape_rows(&v.body.modes.shape, v.interface_nodes().iter().copied())),
    )
    .derived("shape"),
    attribute(
        "coupling",
        Text,
        ONE,
        "`rigid`: the nodes follow the reference point as one rigid body (RBE2); `averaging`: the reference point follows their mean motion (RBE3); `free`: no reference point; absent: not stated",
        |v| text(v.interface?.coupling?.name()),
    )
    .added(2),
    dataset("reference", Floats(&[Fixed(3)]), LENGTH, "x_ref", "reference point in the body frame", |v| {
        Some(Value::Floats(v.interface?.reference?.to_vec()))
    })
    .added(2),
    dataset(
        "translation",
        Floats(&[Fixed(3), Modes]),
        PER_ROOT_MASS,
        "Phi_t",
        "translation of the reference point in each mode, body axes: with the rotation the rigid motion that fits the nodes best (least squares, the same weight for each)",
        |v| matrix(v.interface_rows()?.translation.as_ref()),
    )
    .added(2)
    .derived("shape"),
    dataset(
        "rotation",
        Floats(&[Fixed(3), Modes]),
        PER_ROOT_MASS_LENGTH,
        "Phi_r",
        "rotation vector of the reference point in each mode, body axes; absent: the nodes lie on one line and have no rotations",
        |v| matrix(v.interface_rows()?.rotation?.as_ref()),
    )
    .added(2)
    .derived("rotation"),
    dataset(
        "misfit",
        Floats(&[Modes]),
        PER_ROOT_MASS,
        "e",
        "root mean square over the nodes of what this rigid motion leaves of their displacement: zero to rounding where they move as a rigid body",
        |v| Some(Value::Floats(v.interface_rows()?.misfit)),
    )
    .added(2)
    .derived("shape"),
];

/// Of a Craig-Bampton basis.
pub(super) const COORDINATES: &[Item] = &[
    attribute(
        "names",
        Text,
        ONE,
        "what each of the nc coordinates is, as a JSON array of texts: for every interface in the order of `/interfaces` the translations and rotations of its reference point (in the plane two and one; of a free interface the displacements of its nodes in the order of `/nodes`), along body axes, then the fixed-interface modes",
        |v| {
            let names = &v.body.coordinates.as_ref()?.names;
            text(serde_json::to_string(names).expect("strings are valid JSON"))
        },
    )
    .added(2),
    dataset(
        "stiffness",
        Floats(&[Coordinates, Coordinates]),
        Units::Mixed,
        "K_c",
        "stiffness; translations carry length, rotations none, fixed-interface modes mass^(1/2) length",
        |v| matrix(v.body.coordinates.as_ref()?.stiffness.as_ref()),
    )
    .added(2),
    dataset("mass", Floats(&[Coordinates, Coordinates]), Units::Mixed, "M_c", "mass, in the same units", |v| {
        matrix(v.body.coordinates.as_ref()?.mass.as_ref())
    })
    .added(2),
    dataset(
        "of_modes",
        Floats(&[Coordinates, Modes]),
        Units::Mixed,
        "B",
        "coordinates of each mode: B' K_c B = diag(lambda), B' M_c B = I",
        |v| matrix(v.body.coordinates.as_ref()?.of_modes.as_ref()),
    )
    .added(2),
];
