//! Reads the table of a scene that says what carries the body.

use super::read_values::{EVERY, axes, direction, history, place, transposed, vector};
use super::{Axes, Carried, CarriedSpin, Drive, History, Translation};
use crate::input::{Table, Walk};
use nalgebra::Vector3;
use std::ops::Range;

pub(super) const CARRIED: &[&str] = &["node", "interface", "spin", "translation"];
pub(super) const CARRIED_SPIN: &[&str] = &["axis", "axes", "through", "rate"];
pub(super) const TRANSLATION: &[&str] = &["direction", "displacement", "velocity", "acceleration"];

/// `None` only with something in `found`, as everything here.
pub(super) fn carried(walk: &mut Walk<'_>, table: &Table, span: Range<usize>) -> Option<Carried> {
    walk.known_keys(table, "[carried]", CARRIED);
    let by = place(walk, table, span);
    let mut part = |key: &str| {
        let found = walk.table(table, key);
        // What is there and no table was complained about.
        if found.is_none() && table.contains_key(key) { Err(()) } else { Ok(found) }
    };
    let (spin_table, translation_table) = (part("spin"), part("translation"));
    let spin = spin_table.map(|found| found.map(|(table, span)| spin(walk, table, span)));
    let translation =
        translation_table.map(|found| found.map(|(table, span)| translation(walk, table, span)));
    Some(Carried { by: by?, spin: transposed(spin.ok()?)?, translation: transposed(translation.ok()?)? })
}

fn spin(walk: &mut Walk<'_>, table: &Table, span: Range<usize>) -> Option<CarriedSpin> {
    walk.known_keys(table, "[carried.spin]", CARRIED_SPIN);
    let axis = match table.contains_key("axis") {
        true => direction(walk, table, "axis"),
        false => Some(Vector3::z()),
    };
    let axes = axes(walk, table, &EVERY, Axes::Model);
    let through = table.get("through").map(|value| vector(walk, "through", value));
    let rate = match table.get("rate") {
        Some(value) => history(walk, "rate", value),
        None => {
            walk.wrong(span, "key `rate` is missing in [carried.spin]".to_owned());
            None
        }
    };
    Some(CarriedSpin { axis: axis?, axes: axes?, through: transposed(through)?, rate: rate? })
}

fn translation(walk: &mut Walk<'_>, table: &Table, span: Range<usize>) -> Option<Translation> {
    walk.known_keys(table, "[carried.translation]", TRANSLATION);
    if !table.contains_key("direction") {
        walk.wrong(span.clone(), "key `direction` is missing in [carried.translation]".to_owned());
    }
    let direction = direction(walk, table, "direction");
    /// Makes a drive of a history.
    type Driven = fn(History) -> Drive;
    let kinds: [(&str, Driven); 3] = [
        ("displacement", Drive::Displacement),
        ("velocity", Drive::Velocity),
        ("acceleration", Drive::Acceleration),
    ];
    let given: Vec<_> = kinds.into_iter().filter(|(key, _)| table.contains_key(*key)).collect();
    let [(key, drive)] = given[..] else {
        let message = match given.is_empty() {
            true => "[carried.translation] has none of `displacement`, `velocity` and `acceleration`",
            false => {
                "[carried.translation] has more than one of `displacement`, `velocity` and `acceleration`"
            }
        };
        walk.wrong(span, message.to_owned());
        return None;
    };
    let value = table.get(key)?;
    let history = history(walk, key, value)?;
    if key == "displacement" && matches!(history, History::Table { .. }) {
        let message = "`displacement` is a table of points, at which the velocity jumps: give `velocity` or `acceleration`, or a sine or a ramp";
        walk.wrong(value.span(), message.to_owned());
        return None;
    }
    Some(Translation { direction: direction?, drive: drive(history) })
}
