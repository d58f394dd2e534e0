//! Geometric stiffness and stiffness of inertia of unit loads: the rows of `/geometric_stiffness/<load>` and
//! `/inertia_stiffness/<load>`.

use super::super::item::ItemKind::{Floats, Text};
use super::super::item::{Extent::Modes, Item};
use super::super::item::{field, written};
use super::super::value::{Units, Value, View, text};
use super::{INERTIA, ONE, PER_TIME2, attribute, dataset};
use flexbody_body::flex_body::{LoadKind, UnitLoad};

const ACCELERATION: Units = Units::Of { mass_halves: 0, length: 1, time: -2 };
const FORCE: Units = Units::Of { mass_halves: 2, length: 1, time: -2 };
const MOMENT: Units = Units::Of { mass_halves: 2, length: 2, time: -2 };

pub(super) const GEOMETRIC_STIFFNESS: &[Item] = &[
    dataset(
        "stiffness",
        Floats(&[Modes, Modes]),
        PER_TIME2,
        "K_geo",
        "Psi' K_geo Psi for one unit of the load: times the load, it is added to K_ff",
        field!(load: matrix),
    )
    .within(2),
    attribute(
        "kind",
        Text,
        ONE,
        "`acceleration` of the frame's origin, `angular_acceleration`, `spin` (K_geo = sum of w_k w_l times the six), `force` or `moment` at an interface, `load` with a name only",
        written(|v| text(load(v)?.kind.name())),
    )
    .derived("")
    .within(2),
    attribute(
        "axis",
        Text,
        ONE,
        "body axis `x`, `y`, `z`; for `spin` `xx`, `yy`, `zz`, `xy`, `yz`, `xz`; empty for `load`",
        written(|v| text(load(v)?.axis())),
    )
    .derived("")
    .within(2),
    attribute("load_units", Text, ONE, "unit of the load; 1 for `load`, whose unit is the user's", written(load_units))
    .derived("")
    .within(2),
    attribute(
        "interface",
        Text,
        ONE,
        "name of the interface, for `force` and `moment`",
        written(|v| load(v)?.kind.interface().and_then(text)),
    )
    .derived("")
    .added(2),
];

pub(super) const INERTIA_STIFFNESS: &[Item] = &[
    dataset(
        "stiffness",
        Floats(&[Modes, Modes]),
        PER_TIME2,
        "K",
        "stiffness of inertia for one unit of the load: times the load, it is added to K_ff and belongs to the kinetic energy (theory section 6)",
        field!(load: matrix),
    )
    .with(&INERTIA)
    .within(6),
    attribute(
        "kind",
        Text,
        ONE,
        "`acceleration` of the frame's origin less gravity, `angular_acceleration`, or `spin` (K = sum of w_k w_l times the six)",
        written(|v| text(load(v)?.kind.name())),
    )
    .derived("")
    .within(6),
    attribute("axis", Text, ONE, "body axis `x`, `y`, `z`; for `spin` `xx`, `yy`, `zz`, `xy`, `yz`, `xz`", written(|v| text(load(v)?.axis())))
    .derived("")
    .within(6),
    attribute("load_units", Text, ONE, "unit of the load", written(load_units)).derived("").within(6),
];

fn load_units(view: &View<'_>) -> Option<Value> {
    let units = match load(view)?.kind {
        LoadKind::Acceleration => ACCELERATION,
        LoadKind::AngularAcceleration | LoadKind::Spin => PER_TIME2,
        LoadKind::Force(_) => FORCE,
        LoadKind::Moment(_) => MOMENT,
        LoadKind::Named(_) => ONE,
    };
    text(units.concrete(&view.body.units))
}

fn load<'a>(view: &View<'a>) -> Option<&'a UnitLoad> {
    Some(&view.geometric_stiffness?.load)
}
