//! The labels of matrix rows without names: rows of OUTPUT4 follow the points in ascending order, six per grid and one
//! per scalar point, without the points outside the set of the matrix.

use super::bulk::Bulk;
use crate::dmig::Point;
use flexbody_base::diagnostic::{Code, Diagnostic};
use std::collections::BTreeSet;
use std::path::Path;

/// Returns true when matrices of `n` rows may be those of a set of the deck.
pub(super) fn is_set(bulk: &Bulk, n: usize) -> bool {
    bulk.resequenced || points(bulk, n, "", Path::new("")).is_ok()
}

/// Returns the points of the rows of matrices with `n` rows. The first set with this number of rows is chosen among:
/// the g-set, the a-set of the deck, the g-set without dependent points, this one without supported points, and, if all
/// elements are solids, the g-set with displacements and independent points of constraints only.
///
/// # Errors
/// FB112 if no set has this number.
pub(super) fn points(bulk: &Bulk, n: usize, name: &str, path: &Path) -> Result<Vec<Point>, Diagnostic> {
    if bulk.resequenced {
        let message = "SEQGP changes the order of the rows, which OUTPUT4 does not record";
        let help = "remove the SEQGP cards, or write the matrices as DMIG";
        return Err(Diagnostic::new(Code::DeckUnsupported, message).in_file(path).with_help(help));
    }
    // The g-set.
    let all = || {
        let grids = bulk.grids.keys().flat_map(|&id| (1..=6).map(move |component| (id, component)));
        grids.chain(bulk.scalars.iter().map(|&id| (id, 0))).collect::<BTreeSet<Point>>()
    };
    let (grids, scalars) = (bulk.grids.len(), bulk.scalars.len());
    let mut counted = vec![(format!("{grids} grids and {scalars} scalar points"), 6 * grids + scalars)];
    if n == counted[0].1 {
        return Ok(all().into_iter().collect());
    }
    // The a-set.
    let boundary = bulk.boundary();
    if !boundary.is_empty() {
        counted.push(("the a-set".to_owned(), boundary.len()));
        if boundary.len() == n {
            return Ok(boundary.into_iter().collect());
        }
    }
    // The g-set without dependent points.
    let (followers, followed) = bulk.constraints.points();
    let left: BTreeSet<Point> = all().difference(&followers).copied().collect();
    if !followers.is_empty() {
        counted.push(("without rows dependent by constraints".to_owned(), left.len()));
        if left.len() == n {
            return Ok(left.into_iter().collect());
        }
    }
    // The g-set without dependent and supported points.
    let supported = bulk.supported();
    if !supported.is_empty() {
        let free: Vec<Point> = left.difference(&supported).copied().collect();
        counted.push(("without supports".to_owned(), free.len()));
        if free.len() == n {
            return Ok(free);
        }
    }
    // Displacements and independent points of constraints.
    if bulk.has_elements && !bulk.has_rotations {
        let moves = |point: &Point| point.1 <= 3 || followed.contains(point);
        let displacements: Vec<Point> = left.into_iter().filter(moves).collect();
        counted.push(("displacements only".to_owned(), displacements.len()));
        if displacements.len() == n {
            return Ok(displacements);
        }
    }
    let counted: Vec<String> = counted.into_iter().map(|(what, rows)| format!("{what} {rows}")).collect();
    let message = format!("matrix {name} has {n} rows, the deck gives other numbers: {}", counted.join(", "));
    let help = "write KGG and MGG, or the matrices of the a-set that ASET cards of the deck name";
    Err(Diagnostic::new(Code::DeckRows, message).in_file(path).with_help(help))
}
