//! The rows of `/named_loads/<name>`.

use super::super::item::Extent::{Fixed, Modes};
use super::super::item::Item;
use super::super::item::ItemKind::{Float, Floats, Int};
use super::super::item::{both, field, put};
use super::entry::{attribute, dataset};
use crate::units::{FORCE, ONE, TORQUE, Units, unit};
use crate::value::Value;

/// Unit of a modal load: force over the square root of mass.
const MODAL_FORCE: Units = unit(1, 1, -2);

pub(super) const NAMED_LOAD: &[Item] = &[
    attribute(
        "preload",
        Int,
        ONE,
        "1: the load acts always, with amplitude 1; 0: its amplitude is a history",
        both(
            |v| Some(Value::Int(v.named_load?.preload.into())),
            put!(|d, read| d.named_load().preload = read.int() != 0),
        ),
    )
    .within(9),
    dataset("modal", Floats(&[Modes]), MODAL_FORCE, "Psi'f", "modal load of the amplitude 1", field!(named_load: modal)).within(9),
    dataset(
        "force",
        Floats(&[Fixed(3)]),
        FORCE,
        "F",
        "resultant force of the amplitude 1, body axes",
        field!(named_load: force),
    )
    .within(9),
    dataset(
        "torque",
        Floats(&[Fixed(3)]),
        TORQUE,
        "T",
        "resultant torque of the amplitude 1 about the origin of the frame, body axes",
        field!(named_load: torque),
    )
    .within(9),
    dataset(
        "moments",
        Floats(&[Fixed(3), Fixed(3)]),
        TORQUE,
        "sum x f'",
        "first moments of the forces of the nodes, body axes",
        field!(named_load: moments),
    )
    .within(9),
    dataset(
        "turning",
        Floats(&[Fixed(3), Modes]),
        MODAL_FORCE,
        "L",
        "torque of the forces per unit modal coordinate, which displaces their nodes: sum of psi x f, body axes",
        field!(named_load: turning),
    )
    .within(9),
    attribute(
        "compliance",
        Float,
        TORQUE,
        "f'G f with the static flexibility G of the free body: the modes contain sum_j (Psi'f)_j^2 / lambda_j of it",
        field!(named_load: compliance),
    )
    .added(9),
];
