//! Reader of the table of a scene about the carrier of the body.

use super::read_attitude::turning;
use super::read_columns::{HistoryFiles, columns_history};
use super::read_values::{direction, history, place, transposed, vector};
use super::{Carried, CarriedSpin, Drive, Interpolation, VectorHistory};
use flexbody_base::diagnostic::Code;
use flexbody_base::text::walk::{TomlTable, Walk};
use std::ops::Range;

pub(super) const CARRIED: &[&str] = &["node", "interface", "spin", "translation"];
pub(super) const CARRIED_SPIN: &[&str] =
    &["axis", "axes", "through", "rate", "angular_velocity_from", "attitude_from"];
pub(super) const TRANSLATION: &[&str] = &[
    "direction",
    "displacement",
    "velocity",
    "acceleration",
    "displacement_from",
    "velocity_from",
    "acceleration_from",
];

/// Reads the carrier. As in this whole module, a result `None` comes with a diagnostic in `found`.
pub(super) fn carried(
    walk: &mut Walk<'_>,
    files: &HistoryFiles,
    table: &TomlTable,
    span: Range<usize>,
) -> Option<Carried> {
    walk.known_keys(table, "[carried]", CARRIED);
    let by = place(walk, table, span);
    let mut part = |key: &str| {
        let found = walk.table(table, key);
        // The key exists but is no table; a diagnostic reports it.
        if found.is_none() && table.contains_key(key) { Err(()) } else { Ok(found) }
    };
    let (spin_table, translation_table) = (part("spin"), part("translation"));
    let spin = spin_table.map(|found| found.map(|(table, span)| spin(walk, files, table, span)));
    let translation =
        translation_table.map(|found| found.map(|(table, span)| translation(walk, files, table, span)));
    Some(Carried { by: by?, spin: transposed(spin.ok()?)?, translation: transposed(translation.ok()?)? })
}

fn spin(
    walk: &mut Walk<'_>,
    files: &HistoryFiles,
    table: &TomlTable,
    span: Range<usize>,
) -> Option<CarriedSpin> {
    walk.known_keys(table, "[carried.spin]", CARRIED_SPIN);
    let through = table.get("through").map(|value| vector(walk, "through", value));
    let turning = turning(walk, files, table, span, "[carried.spin]")?;
    Some(CarriedSpin {
        velocity: turning.velocity,
        axes: turning.axes,
        start: turning.start,
        through: transposed(through)?,
    })
}

/// Function that makes a drive of a history.
type Driven = fn(VectorHistory) -> Drive;

/// Derivatives that can define a translation: the key of a history along a direction, the key of three
/// columns, and the constructor of the drive.
const DERIVATIVES: [(&str, &str, Driven); 3] = [
    ("displacement", "displacement_from", Drive::Displacement),
    ("velocity", "velocity_from", Drive::Velocity),
    ("acceleration", "acceleration_from", Drive::Acceleration),
];

fn translation(
    walk: &mut Walk<'_>,
    files: &HistoryFiles,
    table: &TomlTable,
    span: Range<usize>,
) -> Option<Drive> {
    walk.known_keys(table, "[carried.translation]", TRANSLATION);
    let all = DERIVATIVES
        .into_iter()
        .flat_map(|(along, columns, drive)| [(along, false, drive), (columns, true, drive)]);
    let given: Vec<_> = all.filter(|(key, ..)| table.contains_key(*key)).collect();
    let [(key, has_columns, drive)] = given[..] else {
        let message = if given.is_empty() {
            "[carried.translation] has none of `displacement`, `velocity` and `acceleration`"
        } else {
            "[carried.translation] has more than one of `displacement`, `velocity` and `acceleration`"
        };
        walk.wrong(span, message.to_owned());
        return None;
    };
    let value = table.get(key)?;
    let mut has_direction = true;
    let history = if has_columns {
        if let Some(direction) = table.get("direction") {
            let message = format!(
                "`direction` of [carried.translation] has no effect: `{key}` has all three components"
            );
            walk.complain(Code::SceneContradicts, direction.span(), message);
            return None;
        }
        columns_history(walk, files, key, value, Interpolation::Cubic)?
    } else {
        if !table.contains_key("direction") {
            walk.wrong(span, "key `direction` is missing in [carried.translation]".to_owned());
        }
        let direction = direction(walk, table, "direction");
        let factor = history(walk, files, key, value)?;
        // Check the history even if the direction is invalid.
        has_direction = direction.is_some();
        VectorHistory::Along { direction: direction.unwrap_or_default(), factor }
    };
    if matches!(drive(VectorHistory::nothing()), Drive::Displacement(_)) && !history.is_smooth() {
        let message = format!(
            "`{key}` is linear between its points, so that the velocity jumps there: give `interpolation` = \"cubic\", a sine or a ramp, or prescribe a velocity or an acceleration"
        );
        walk.wrong(value.span(), message);
        return None;
    }
    has_direction.then(|| drive(history))
}
