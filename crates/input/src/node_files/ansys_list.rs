//! Node lists of Ansys: a table with tabs, whose header names the columns in the user's language, and the listing of
//! NLIST. Decimal commas are read.

use super::errors::unexpected;
use crate::node_file::NodeFile;
use flexbody_base::diagnostic::Diagnosed;
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{Line, Lines, integer, real, words};
use flexbody_linalg::rotation;
use flexbody_model::NodeAxes;
use nalgebra::Vector3;

/// Returns true when the text begins with a header with tabs and a column X, or with the listing of NLIST.
pub(super) fn recognises(head: &str) -> bool {
    let first = head.lines().find(|line| !line.trim().is_empty()).unwrap_or_default();
    let tabs = first.contains('\t')
        && first.split('\t').nth(1).is_some_and(|field| field.trim().to_uppercase().starts_with('X'));
    let starts_with_number = first.trim_start().starts_with(|c: char| c.is_ascii_digit());
    (tabs
        && !starts_with_number
        && first.split('\t').next().is_some_and(|name| !name.trim().eq_ignore_ascii_case("node")))
        || head.contains("LIST ALL SELECTED NODES")
        || head.lines().any(is_listing_head)
}

/// Returns true for the heading `NODE  X  Y  Z` above every page of a listing.
fn is_listing_head(line: &str) -> bool {
    let words: Vec<&str> = line.split_whitespace().collect();
    !line.contains([',', '\t', ';']) && words.len() >= 4 && words[..4] == ["NODE", "X", "Y", "Z"]
}

/// Reads every line with a node number and three coordinates, and three angles of rotated nodes if the heading of the
/// page has them (`THXY`). Other lines are headings of pages.
pub(super) fn read(file: &InputFile) -> Diagnosed<NodeFile> {
    let mut read = NodeFile::default();
    let mut with_angles = false;
    for Line { number, text: line } in Lines::of(file.bytes()) {
        let line = line.trim_ascii_start();
        let mut fields = words(line);
        let Some(id) = fields.next().and_then(integer) else {
            let upper = line.to_ascii_uppercase();
            with_angles |= words(&upper).any(|word| word == b"THXY");
            continue;
        };
        let values: Option<Vec<f64>> = fields.take(if with_angles { 6 } else { 3 }).map(decimal).collect();
        let (Some(&[x, y, z, ref angles @ ..]), false) =
            (values.as_deref(), with_angles && values.as_ref().is_some_and(|values| values.len() < 6))
        else {
            return Err(unexpected(file, number, "a node and three coordinates", line));
        };
        read.nodes.ids.push(id);
        read.nodes.positions.push([x, y, z]);
        let angles = <[f64; 3]>::try_from(angles).unwrap_or_default();
        read.axes.extend(axes(angles).map(|axes| (id, axes)));
    }
    Ok(read)
}

/// Parses a number with a decimal point or a decimal comma.
fn decimal(field: &[u8]) -> Option<f64> {
    let text: Vec<u8> = field.iter().map(|&b| if b == b',' { b'.' } else { b }).collect();
    real(&text)
}

/// Returns the unit vectors along the rows of a node; `None` if all angles are zero. The angles are in degrees: THXY
/// about z, THYZ about the rotated x, THZX about the rotated y.
pub(super) fn axes([xy, yz, zx]: [f64; 3]) -> Option<NodeAxes> {
    if [xy, yz, zx] == [0.0; 3] {
        return None;
    }
    let about = |axis, degrees: f64| rotation(&axis, degrees.to_radians());
    let turn = about(Vector3::z_axis(), xy) * about(Vector3::x_axis(), yz) * about(Vector3::y_axis(), zx);
    Some([Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| (turn * axis).into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter turn about z, then one about the rotated x, which points along y: z then points along x.
    #[test]
    fn angles_turn_about_axes_that_are_turned() {
        let turned = axes([90.0, 90.0, 0.0]).expect("turned");
        let expected = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
        for (turned, expected) in turned.iter().flatten().zip(expected.iter().flatten()) {
            assert!((turned - expected).abs() < 1e-15, "{turned} {expected}");
        }
        assert_eq!(axes([0.0; 3]), None);
    }
}
