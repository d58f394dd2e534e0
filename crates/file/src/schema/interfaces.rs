//! The rows of interfaces and of interface coordinates.

use super::super::item::Extent::{Coordinates, Fixed, InterfaceNodes, Modes};
use super::super::item::Item;
use super::super::item::ItemKind::{Floats, Ints, Text};
use super::super::item::{EntrySet, both, field, put, written};
use super::entry::{attribute, dataset, named};
use crate::units::{LENGTH, ONE, PER_ROOT_MASS, PER_ROOT_MASS_LENGTH, Units, dimension};
use crate::value::{Stored, Value, matrix, shape_rows, text};
use flexbody_model::Coupling;

pub(super) const INTERFACES: &[Item] = &[
    dataset(
        "node_id",
        Ints(&[InterfaceNodes]),
        ONE,
        "id",
        "node numbers of the interface",
        both(
            |v| Some(Value::Ints(v.interface_nodes().iter().map(|&i| v.body.nodes.ids[i]).collect())),
            |d, read| {
                let ids: Vec<i64> = Stored::take(read)?;
                d.interface().nodes = ids.iter().filter_map(|id| d.index.get(id).copied()).collect();
                match ids.iter().find(|id| !d.index.contains_key(id)) {
                    Some(id) => Err(format!("expected nodes of /nodes/id, found {id}")),
                    None => Ok(()),
                }
            },
        ),
    ),
    dataset(
        "position",
        Floats(&[InterfaceNodes, Fixed(3)]),
        LENGTH,
        "x",
        "their positions in the body frame",
        written(|v| {
            Some(Value::Floats(v.interface_nodes().iter().flat_map(|&i| v.body.nodes.positions[i]).collect()))
        }),
    )
    .derived("position"),
    dataset(
        "shape",
        Floats(&[Modes, InterfaceNodes, Fixed(3)]),
        PER_ROOT_MASS,
        "Psi",
        "their rows of /modes/shape",
        written(|v| Some(shape_rows(&v.body.modes.shape, v.interface_nodes().iter().copied()))),
    )
    .derived("shape"),
    attribute(
        "coupling",
        Text,
        ONE,
        "`rigid`: the nodes follow the reference point as one rigid body (RBE2); `averaging`: the reference point follows their mean motion (RBE3); `free`: no reference point; absent: not stated",
        both(
            |v| text(v.interface?.coupling?.name()),
            put!(|d, read| d.interface().coupling = Some(named(read.text(), Coupling::ALL, Coupling::name)?)),
        ),
    )
    .added(2),
    dataset(
        "reference",
        Floats(&[Fixed(3)]),
        LENGTH,
        "x_ref",
        "reference point in the body frame",
        field!(interface: reference),
    )
    .added(2),
    dataset(
        "translation",
        Floats(&[Fixed(3), Modes]),
        PER_ROOT_MASS,
        "Phi_t",
        "translation of the reference point in each mode, body axes: with the rotation the rigid motion that fits the nodes best (least squares, the same weight for each)",
        written(|v| matrix(v.interface_rows()?.translation.as_ref())),
    )
    .added(2)
    .derived("shape"),
    dataset(
        "rotation",
        Floats(&[Fixed(3), Modes]),
        PER_ROOT_MASS_LENGTH,
        "Phi_r",
        "rotation vector of the reference point in each mode, body axes; absent: the nodes lie on one line and have no rotations",
        written(|v| matrix(v.interface_rows()?.rotation?.as_ref())),
    )
    .added(2)
    .derived("rotation"),
    dataset(
        "misfit",
        Floats(&[Modes]),
        PER_ROOT_MASS,
        "e",
        "root mean square over the nodes of what this rigid motion leaves of their displacement: zero to rounding where they move as a rigid body",
        written(|v| Some(Value::Floats(v.interface_rows()?.misfit))),
    )
    .added(2)
    .derived("shape"),
];

static COORDINATES_TOGETHER: EntrySet = EntrySet {
    problem: |entries| {
        let count = entries.iter().filter(|(_, there)| *there).count();
        format!(
            "/interface_coordinates: expected `names`, `stiffness`, `mass` and `of_modes`, found {count} of them"
        )
    },
};

/// Entries of the coordinates of a Craig-Bampton basis.
pub(super) const COORDINATES: &[Item] = &[
    attribute(
        "names",
        Text,
        ONE,
        "meaning of each of the nc coordinates, as a JSON array of texts: for every interface in the order of `/interfaces` the translations and rotations of its reference point (in the plane two and one; of a free interface the displacements of its nodes in the order of `/nodes`), along body axes, then the fixed-interface modes",
        both(
            |v| text(serde_json::to_string(&v.coordinates()?.names).expect("strings are valid JSON")),
            |d, read| {
                let names: Vec<String> = read.json("a JSON array of texts")?;
                let found = names.len();
                d.coordinates().names = names;
                match d.n_coordinates.filter(|size| *size != found) {
                    Some(size) => Err(format!(
                        "expected a name for each coordinate, found {found} for {} numbers in `stiffness`",
                        size * size
                    )),
                    None => Ok(()),
                }
            },
        ),
    )
    .with(&COORDINATES_TOGETHER)
    .added(2),
    dataset(
        "stiffness",
        Floats(&[Coordinates, Coordinates]),
        Units::PerCoordinates(dimension(2, 2, -2)),
        "K_c",
        "stiffness; translations carry length, rotations none, fixed-interface modes mass^(1/2) length",
        field!(coordinates: stiffness),
    )
    .with(&COORDINATES_TOGETHER)
    .added(2),
    dataset(
        "mass",
        Floats(&[Coordinates, Coordinates]),
        Units::PerCoordinates(dimension(2, 2, 0)),
        "M_c",
        "mass, in the same units",
        field!(coordinates: mass),
    )
    .with(&COORDINATES_TOGETHER)
    .added(2),
    dataset(
        "of_modes",
        Floats(&[Coordinates, Modes]),
        Units::CoordinatesOfModes,
        "B",
        "coordinates of each mode: B' K_c B = diag(lambda), B' M_c B = I",
        field!(coordinates: of_modes),
    )
    .with(&COORDINATES_TOGETHER)
    .added(2),
];
