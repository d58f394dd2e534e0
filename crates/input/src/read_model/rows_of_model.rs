//! Rows of the model for the matrices of its files: their labels, the axes of nodes, and matrices beside K and M.

use crate::matrices::turn::Turn;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_model::{DofLabel, GivenRows, LostRow, NodeAxes, Nodes, RawMatrix, RowMap};
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Returns the labels of rows that follow the nodes of a table, each with its displacements.
pub(super) fn in_order_of_nodes(nodes: &Nodes, dimension: u8) -> Vec<DofLabel> {
    let of_node = |&node: &i64| (1..=dimension).map(move |direction| DofLabel { node, direction });
    nodes.ids.iter().flat_map(of_node).collect()
}

/// Returns FB111 for matrices with rows that follow others by constraints of the deck of their nodes: the matrices do
/// not contain these constraints.
pub(super) fn refuse_followers(
    followers: &[(String, Vec<DofLabel>)],
    labels: &[DofLabel],
    deck: &Path,
) -> Diagnosed<()> {
    let labels: HashSet<DofLabel> = labels.iter().copied().collect();
    let open = followers.iter().filter(|(_, rows)| rows.iter().any(|row| labels.contains(row)));
    let names: Vec<&str> = open.map(|(name, _)| name.as_str()).collect();
    if names.is_empty() {
        return Ok(());
    }
    let message =
        format!("rows of the matrices depend on others by constraints of the deck: {}", names.join(", "));
    let diagnostic = Diagnostic::new(Code::DeckUnsupported, message).in_file(deck);
    Err(vec![diagnostic.with_help("give the deck as the model, with its matrices beside it")])
}

/// Returns K and M along the axes of the model, with rows originally along the `axes` of nodes, and the map that
/// transforms other data by these rows.
///
/// # Errors
/// FB404 for a rotated node without all directions that are rotated together.
pub(super) fn turned(
    matrices: [RawMatrix; 2],
    labels: &[DofLabel],
    axes: HashMap<i64, NodeAxes>,
) -> Diagnosed<([RawMatrix; 2], GivenRows)> {
    let [stiffness, mass] = matrices;
    let has_rows = |raw: &RawMatrix| raw.matrix.n_cols() == labels.len();
    // Different numbers of rows are reported later.
    if !labels.iter().any(|label| axes.contains_key(&label.node)) || !has_rows(&stiffness) || !has_rows(&mass)
    {
        return Ok(([stiffness, mass], GivenRows::default()));
    }
    let turn = Turn::new(labels, &axes).map_err(|node| {
        let message =
            format!("rows of node {node} are along local axes, but not each of its directions occurs once");
        vec![Diagnostic::new(Code::DofIncomplete, message).in_file(&stiffness.path)]
    })?;
    let transformed = |raw: RawMatrix| turn.turned(raw).map_err(|diagnostic| vec![diagnostic]);
    let matrices = [transformed(stiffness)?, transformed(mass)?];
    let rows = (0..labels.len() as u32).collect();
    let map = RowMap::new(turn.axes(), turn.axes(), rows);
    Ok((matrices, GivenRows::new(vec![map], axes)))
}

/// Returns an additional matrix, such as damping, by the rows of the model.
pub(super) fn by_rows_of_model(raw: RawMatrix, rows: &GivenRows) -> Diagnosed<RawMatrix> {
    let RawMatrix { matrix, digits, path } = raw;
    match rows.matrix(matrix) {
        Ok(matrix) => Ok(RawMatrix { matrix, digits, path }),
        Err(LostRow) => {
            let message = "the matrix has entries in rows that K and M leave empty";
            let diagnostic = Diagnostic::new(Code::MatrixSizesDiffer, message).in_file(path);
            Err(vec![
                diagnostic.with_help("remove these rows from the matrix, or give them stiffness and mass"),
            ])
        }
    }
}
