//! Axes of materials: *ORIENTATION.

use super::super::deck::{Card, Deck, fields};
use super::super::deck_mesh::Placement;
use flexbody_base::diagnostic::{Code, Diagnosed};
use flexbody_base::text::scanner::{excerpt, real};
use flexbody_elements::Axes;
use flexbody_linalg::rotation;
use nalgebra::{Matrix3, Unit, Vector3};

/// Returns the axes of a card in an instance at `moved`, or the reason in words why they are not described.
///
/// # Errors
/// FB110 for lines that are not numbers, and points that define no axes.
pub(super) fn orientation(deck: &Deck, card: &Card, moved: &Placement) -> Diagnosed<Result<Axes, String>> {
    let system = card.name("SYSTEM").unwrap_or_else(|| "RECTANGULAR".to_owned());
    let definition = card.name("DEFINITION").unwrap_or_else(|| "COORDINATES".to_owned());
    if !matches!(system.as_str(), "RECTANGULAR" | "CYLINDRICAL") {
        return Ok(Err(format!("*ORIENTATION, SYSTEM={system}")));
    }
    if definition != "COORDINATES" {
        return Ok(Err(format!("*ORIENTATION, DEFINITION={definition}")));
    }
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for (line, text) in deck.data(card) {
        let numbers = || fields(text).map(|field| if field.is_empty() { Some(0.0) } else { real(field) });
        match numbers().collect::<Option<Vec<f64>>>() {
            Some(row) => rows.push(row),
            // The first line may name a distribution.
            None if rows.is_empty() && numbers().all(|number| number.is_none()) => {
                return Ok(Err("*ORIENTATION by a *DISTRIBUTION".to_owned()));
            }
            None => {
                let message = format!("*ORIENTATION: expected numbers, found `{}`", excerpt(text));
                return Err(vec![
                    deck.at(card, line, Code::DeckSyntax, message).with_help("correct the line"),
                ]);
            }
        }
    }
    let first = rows.first().map_or(&[][..], Vec::as_slice);
    let point = |k: usize| {
        let values = first.get(3 * k..3 * k + 3)?;
        Some(Vector3::from_column_slice(values))
    };
    let (Some(a), Some(b)) = (point(0), point(1)) else {
        return Err(no_axes(deck, card));
    };
    let turn = rows.get(1).map_or(Ok(None), |row| additional(row)).map_err(|()| no_axes(deck, card))?;
    if system == "CYLINDRICAL" {
        if (b - a).norm() == 0.0 {
            return Err(no_axes(deck, card));
        }
        let placed = |x: Vector3<f64>| Vector3::from(moved.of(x.into()));
        return Ok(match turn {
            None => Ok(Axes::Cylinder { from: placed(a), to: placed(b) }),
            Some(_) => Err("cylindrical *ORIENTATION with an additional rotation".to_owned()),
        });
    }
    let origin = point(2).unwrap_or_default();
    let axes = rectangular(a - origin, b - origin).ok_or_else(|| no_axes(deck, card))?;
    let axes = turn.map_or(axes, |(axis, angle)| {
        let about = Unit::new_normalize(axes.column(axis).into_owned());
        rotation(&about, angle) * axes
    });
    Ok(Ok(Axes::Fixed(moved.rotation() * axes)))
}

/// Returns the axes whose first one is along `a`, and whose plane of the first two has `b`.
fn rectangular(a: Vector3<f64>, b: Vector3<f64>) -> Option<Matrix3<f64>> {
    let first = a.try_normalize(0.0)?;
    let third = first.cross(&b).try_normalize(f64::EPSILON * b.norm())?;
    Some(Matrix3::from_columns(&[first, third.cross(&first), third]))
}

/// Returns the axis (from 0) and the angle in radians of an additional rotation; `None` for no rotation.
fn additional(row: &[f64]) -> Result<Option<(usize, f64)>, ()> {
    match *row {
        [] | [_] => Ok(None),
        [_, 0.0, ..] => Ok(None),
        [axis, angle, ..] => {
            let at = [1.0, 2.0, 3.0].iter().position(|known| *known == axis).ok_or(())?;
            Ok(Some((at, angle.to_radians())))
        }
    }
}

fn no_axes(deck: &Deck, card: &Card) -> Vec<flexbody_base::diagnostic::Diagnostic> {
    let message = "*ORIENTATION: the numbers define no axes";
    let help = "write two points a and b, and below them, for an additional rotation, an axis (1, 2 or 3) and an angle";
    vec![deck.about(card, Code::DeckSyntax, message).with_help(help)]
}
