//! The rows of `/recovery/<name>`.

use super::super::item::Extent::{
    Fixed, LoadedInterfaces, Modes, NamedLoads, RecoveryRows, SixModes, ThreeModes,
};
use super::super::item::Item;
use super::super::item::ItemKind::{Floats, Text};
use super::super::item::{both, field};
use super::entry::{attribute, dataset};
use crate::units::{OF_ROWS, ONE, Units, dimension};
use crate::value::{Value, text};
use faer::Mat;
use flexbody_body::flex_body::{
    LOAD_COMPONENTS, LoadColumns, MotionColumns, MotionLoad, Quantity, Recovery, RecoveryRow,
};

/// Label of a row as it is written.
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Label {
    name: String,
    quantity: String,
    component: String,
    unit: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    node: Option<i64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    element: Option<i64>,
}

impl Label {
    fn of(row: &RecoveryRow) -> Self {
        let RecoveryRow { name, quantity, component, unit, node, element } = row.clone();
        Self { name, quantity: quantity.name().to_owned(), component, unit, node, element }
    }

    fn row(self) -> Result<RecoveryRow, String> {
        let Self { name, quantity, component, unit, node, element } = self;
        let known = Quantity::from_name(&quantity).ok_or_else(|| {
            let all = Quantity::NAMES.join(", ");
            format!("expected one of the quantities {all}, found {quantity:?}")
        })?;
        Ok(RecoveryRow { name, quantity: known, component, unit, node, element })
    }
}

/// Returns the labels of rows as a JSON array.
pub(crate) fn labels_json(rows: &[RecoveryRow]) -> String {
    let labels: Vec<Label> = rows.iter().map(Label::of).collect();
    serde_json::to_string(&labels).expect("structs of strings are valid JSON")
}

/// Returns the columns of the forces of motion of one kind; `None` if the recovery does not have them.
fn motion_of(recovery: &Recovery, load: MotionLoad) -> Option<Value> {
    recovery.of_motion(load).map(|columns| Value::Floats(crate::value::rows(columns.as_ref()).collect()))
}

/// Adds the columns of the forces of motion of one kind to a recovery whose rows are known.
fn add_motion(recovery: &mut Recovery, load: MotionLoad, values: &[f64]) {
    let rows = recovery.rows.len();
    let count = values.len() / rows.max(1);
    let columns = Mat::from_fn(rows, count, |i, c| values[i * count + c]);
    recovery.motion.push(MotionColumns { load, columns });
}

pub(super) const RECOVERY: &[Item] = &[
    attribute(
        "rows",
        Text,
        ONE,
        "label of each row, as a JSON array of objects with `name`, `quantity` (`stress`, `strain`, `force`, `moment`, `displacement`, `other`), `component`, `unit`, and optional numbers `node` and `element`",
        both(
            |v| text(labels_json(&v.recovery?.rows)),
            |d, read| {
                let labels: Vec<Label> = read.json("a JSON array of labels")?;
                d.recovery().rows = labels.into_iter().map(Label::row).collect::<Result<_, _>>()?;
                Ok(())
            },
        ),
    )
    .within(8),
    dataset(
        "offset",
        Floats(&[RecoveryRows]),
        OF_ROWS,
        "y0",
        "values of the undeformed body, in the unit of each row",
        field!(recovery: offset),
    )
    .within(8),
    dataset(
        "modes",
        Floats(&[RecoveryRows, Modes]),
        Units::RowsOver(dimension(1, 1, 0)),
        "R Psi",
        "values for unit modal coordinates: the unit of each row over mass^(1/2) length",
        field!(recovery: modes),
    )
    .within(8),
    dataset(
        "spin",
        Floats(&[RecoveryRows, Fixed(6)]),
        Units::RowsOver(dimension(0, 0, -2)),
        "-R G_r M c_kl",
        "static values beside the modes for the products w_x w_x, w_y w_y, w_z w_z, w_x w_y, w_y w_z, w_x w_z of the angular velocity along body axes: the unit of each row times time^2",
        field!(recovery: spin),
    )
    .within(8),
    attribute(
        "loaded_interfaces",
        Text,
        ONE,
        "interfaces of `loads`, as a JSON array of names; absent: none has a reference point",
        both(
            |v| {
                let loads = &v.recovery?.loads;
                let names: Vec<&str> = loads.iter().map(|load| load.interface.as_str()).collect();
                text((!names.is_empty()).then(|| serde_json::to_string(&names).expect("strings are valid JSON"))?)
            },
            |d, read| {
                let names: Vec<String> = read.json("a JSON array of names")?;
                d.recovery_interfaces(names)
            },
        ),
    )
    .added(8),
    dataset(
        "loads",
        Floats(&[LoadedInterfaces, RecoveryRows, Fixed(LOAD_COMPONENTS)]),
        Units::RowsOverLoad,
        "R G_r b_a",
        "static values beside the modes for unit forces x, y, z and unit torques x, y, z at the reference point of each interface, along body axes: the unit of each row over that of the load",
        both(
            |v| {
                let loads = &v.recovery?.loads;
                let values = |load: &LoadColumns| crate::value::rows(load.columns.as_ref()).collect::<Vec<_>>();
                (!loads.is_empty()).then(|| Value::Floats(loads.iter().flat_map(values).collect()))
            },
            |d, read| {
                let rows = d.recovery().rows.len();
                let size = rows * LOAD_COMPONENTS;
                let values = read.floats();
                let at = |k: usize, i: usize, a: usize| values[k * size + i * LOAD_COMPONENTS + a];
                let columns = (0..values.len() / size.max(1))
                    .map(|k| Mat::from_fn(rows, LOAD_COMPONENTS, |i, a| at(k, i, a)))
                    .collect();
                d.recovery_columns(columns)
            },
        ),
    )
    .added(8),
    attribute(
        "named_loads",
        Text,
        ONE,
        "named loads of `named`, as a JSON array of names; absent: the body has none",
        both(
            |v| {
                let names: Vec<&str> = v.body.named_loads.iter().map(|load| load.name.as_str()).collect();
                v.recovery?;
                text((!names.is_empty()).then(|| serde_json::to_string(&names).expect("strings are valid JSON"))?)
            },
            |d, read| {
                let names: Vec<String> = read.json("a JSON array of names")?;
                d.recovery_named(names)
            },
        ),
    )
    .added(9),
    dataset(
        "named",
        Floats(&[RecoveryRows, NamedLoads]),
        OF_ROWS,
        "R G_r f",
        "static values beside the modes for each named load of `named_loads` with the amplitude 1, in the unit of each row",
        both(
            |v| {
                let named = &v.recovery?.named;
                (named.ncols() > 0).then(|| Value::Floats(crate::value::rows(named.as_ref()).collect()))
            },
            |d, read| {
                let rows = d.recovery().rows.len();
                let values = read.floats();
                let count = values.len() / rows.max(1);
                d.recovery().named = Mat::from_fn(rows, count, |i, c| values[i * count + c]);
                Ok(())
            },
        ),
    )
    .added(9),
    dataset(
        "damping",
        Floats(&[RecoveryRows, Modes]),
        Units::RowsOver(dimension(1, 1, -1)),
        "-R G_r D Psi",
        "static values beside the modes for the rates of the modal coordinates, of damping forces that the modes do not hold: the unit of each row times time over mass^(1/2) length",
        both(
            |v| motion_of(v.recovery?, MotionLoad::Damping),
            |d, read| {
                add_motion(d.recovery(), MotionLoad::Damping, &read.floats());
                Ok(())
            },
        ),
    )
    .added(11),
    dataset(
        "acceleration",
        Floats(&[RecoveryRows, Modes]),
        Units::RowsOver(dimension(1, 1, -2)),
        "-R G_r M Psi",
        "static values beside the modes for the second time derivatives of the modal coordinates: the unit of each row times time^2 over mass^(1/2) length",
        both(
            |v| motion_of(v.recovery?, MotionLoad::Acceleration),
            |d, read| {
                add_motion(d.recovery(), MotionLoad::Acceleration, &read.floats());
                Ok(())
            },
        ),
    )
    .added(11),
    dataset(
        "turning",
        Floats(&[RecoveryRows, ThreeModes]),
        Units::RowsOver(dimension(1, 1, -2)),
        "-R G_r M S_k Psi",
        "static values beside the modes for alpha_k q_j + 2 w_k qd_j, the modes of x, then of y, then of z, along body axes: the unit of each row times time^2 over mass^(1/2) length",
        both(
            |v| motion_of(v.recovery?, MotionLoad::Turning),
            |d, read| {
                add_motion(d.recovery(), MotionLoad::Turning, &read.floats());
                Ok(())
            },
        ),
    )
    .added(11),
    dataset(
        "centrifugal",
        Floats(&[RecoveryRows, SixModes]),
        Units::RowsOver(dimension(1, 1, -2)),
        "-R G_r M C_kl Psi",
        "static values beside the modes for w_k w_l q_j, the modes of each product in the order of `spin`, along body axes: the unit of each row times time^2 over mass^(1/2) length",
        both(
            |v| motion_of(v.recovery?, MotionLoad::Centrifugal),
            |d, read| {
                add_motion(d.recovery(), MotionLoad::Centrifugal, &read.floats());
                Ok(())
            },
        ),
    )
    .added(11),
];
