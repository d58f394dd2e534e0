//! From labelled matrix rows to the internal order of [`Rows`]: every used node has as many displacements as the model has
//! dimensions.

use super::rows::{Recovered, Rows};
use super::{DofLabel, RawModel};
use crate::base::diagnostic::{Code, Diagnostic};
use rayon::prelude::*;
use std::collections::HashMap;

/// Where each matrix row goes.
pub(super) struct Layout {
    /// Internal row of each matrix row.
    pub row_to_internal: Vec<u32>,
    /// Indices into the node table of the used nodes, ascending.
    pub used: Vec<usize>,
    /// What the internal rows are; how those without a place move is not known yet.
    pub rows: Rows,
}

impl Layout {
    /// Whether the rows are in internal order already.
    pub fn is_identity(&self) -> bool {
        self.row_to_internal.iter().enumerate().all(|(row, &to)| row == to as usize)
    }
}

/// No row.
const NONE: u32 = u32::MAX;

/// At most this many items are named in a message.
const NAMED: usize = 5;

/// `a, b, c and 7 more`.
pub(super) fn name_some<T: std::fmt::Display>(items: &[T]) -> String {
    let named: Vec<String> = items.iter().take(NAMED).map(T::to_string).collect();
    match items.len().saturating_sub(NAMED) {
        0 => named.join(", "),
        more => format!("{} and {more} more", named.join(", ")),
    }
}

/// Assigns the rows to nodes and directions; all that is wrong is collected into `found`.
pub(super) fn layout(raw: &RawModel, found: &mut Vec<Diagnostic>) -> Option<Layout> {
    let n = raw.stiffness.matrix.n_cols();
    let dimension = usize::from(raw.dimension);
    let implied: Vec<DofLabel>;
    let labels = match &raw.dofs {
        Some(labels) => {
            if labels.len() != n {
                let message = format!(
                    "{} degrees of freedom are labelled, but the matrices have {n} rows",
                    labels.len()
                );
                found.push(Diagnostic::new(Code::DofCount, message).in_file(&raw.dofs_path));
                return None;
            }
            labels
        }
        None => {
            if dimension * raw.nodes.len() != n {
                let message = format!(
                    "{} nodes have {} displacements, but the matrices have {n} rows",
                    raw.nodes.len(),
                    dimension * raw.nodes.len()
                );
                let per_node = n.checked_div(raw.nodes.len()).unwrap_or(0);
                let help = if per_node * raw.nodes.len() == n && per_node > dimension {
                    format!(
                        "give a dofs table that labels the {per_node} rows of each node: 1, 2, 3 for displacements, 4, 5, 6 for rotations"
                    )
                } else {
                    "give a dofs table that says which node and direction each matrix row is".to_owned()
                };
                let diagnostic = Diagnostic::new(Code::DofCount, message).in_file(&raw.nodes_path);
                found.push(diagnostic.with_help(help));
                return None;
            }
            implied = raw
                .nodes
                .ids
                .iter()
                .flat_map(|&node| (1..=raw.dimension).map(move |direction| DofLabel { node, direction }))
                .collect();
            &implied
        }
    };
    let before = found.len();
    let mut index = HashMap::with_capacity(raw.nodes.len());
    for (i, &id) in raw.nodes.ids.iter().enumerate() {
        if index.insert(id, i).is_some() {
            let message = format!("node {id} is given twice");
            found.push(Diagnostic::new(Code::NodeDuplicate, message).in_file(&raw.nodes_path));
        }
    }
    let outside = |l: &&DofLabel| dimension == 2 && (3..=5).contains(&l.direction);
    let outside: Vec<DofLabel> = labels.iter().filter(outside).copied().collect();
    if !outside.is_empty() {
        let message = format!(
            "{} degrees of freedom of a plane model lead out of the plane: {}",
            outside.len(),
            name_some(&outside)
        );
        found.push(Diagnostic::new(Code::DirectionOutOfPlane, message).in_file(&raw.dofs_path));
    }
    // Looked up once: the labels are several times as many as the nodes.
    let places: Vec<Option<usize>> = labels.par_iter().map(|label| index.get(&label.node).copied()).collect();
    if found.len() > before {
        return None;
    }
    let mut row_of = vec![[NONE; 6]; raw.nodes.len()];
    let mut without_place: Vec<(i64, [u32; 6])> = Vec::new();
    let mut twice = Vec::new();
    let mut later = HashMap::new();
    for (row, (label, place)) in labels.iter().zip(places).enumerate() {
        let rows = match place {
            Some(place) => &mut row_of[place],
            None => {
                let at = *later.entry(label.node).or_insert_with(|| {
                    without_place.push((label.node, [NONE; 6]));
                    without_place.len() - 1
                });
                &mut without_place[at].1
            }
        };
        let slot = &mut rows[usize::from(label.direction) - 1];
        if *slot == NONE {
            *slot = row as u32;
        } else {
            twice.push(format!("{label} in rows {} and {row}", *slot));
        }
    }
    if !twice.is_empty() {
        let message = format!("{} labels are given twice: {}", twice.len(), name_some(&twice));
        found.push(Diagnostic::new(Code::DofDuplicate, message).in_file(&raw.dofs_path));
    }
    let mut incomplete = Vec::new();
    let mut used = Vec::new();
    let mut unused = Vec::new();
    for (i, rows) in row_of.iter().enumerate() {
        let missing = |k: &usize| rows[*k] == NONE;
        match (0..dimension).filter(missing).count() {
            0 => used.push(i),
            _ if rows.iter().all(|&row| row == NONE) => unused.push(raw.nodes.ids[i]),
            _ => incomplete.extend(
                (0..dimension)
                    .filter(missing)
                    .map(|k| DofLabel { node: raw.nodes.ids[i], direction: k as u8 + 1 }),
            ),
        }
    }
    if !incomplete.is_empty() {
        let message = format!("{} displacements are missing: {}", incomplete.len(), name_some(&incomplete));
        let mut diagnostic = Diagnostic::new(Code::DofIncomplete, message).in_file(&raw.dofs_path);
        if used.is_empty() && incomplete.iter().all(|label| label.direction == 3) {
            diagnostic = diagnostic.with_help("for a plane model, set `dimension = 2` (--dimension 2)");
        }
        found.push(diagnostic);
    }
    if found.len() > before {
        return None;
    }
    if !unused.is_empty() {
        let message = format!(
            "{} nodes have no degree of freedom and are left out: {}",
            unused.len(),
            name_some(&unused)
        );
        found.push(Diagnostic::new(Code::NodesUnused, message).in_file(&raw.nodes_path));
    }
    let placeless = sort_without_place(raw, &without_place, used.is_empty(), found)?;
    let mut order: Vec<u32> =
        used.iter().flat_map(|&node| row_of[node][..dimension].iter().copied()).collect();
    order.extend(placeless.vectors.iter().flat_map(|(_, rows)| &rows[..dimension]));
    let mut rotations = Vec::new();
    for (internal, &node) in used.iter().enumerate() {
        for (axis, &row) in row_of[node][3..].iter().enumerate().filter(|(_, row)| **row != NONE) {
            rotations.push((internal as u32, axis as u8));
            order.push(row);
        }
    }
    order.extend(placeless.others.iter().map(|(_, row)| row));
    let mut row_to_internal = vec![0u32; n];
    for (internal, row) in order.into_iter().enumerate() {
        row_to_internal[row as usize] = internal as u32;
    }
    let rows = Rows {
        dimension,
        nodes: used.len(),
        vectors: placeless.vectors.into_iter().map(|(number, _)| number).collect(),
        rotations,
        others: placeless.others.into_iter().map(|(label, _)| label).collect(),
        recovered: Recovered::none(),
    };
    Some(Layout { row_to_internal, used, rows })
}

/// Rows of nodes that the node table does not have.
#[derive(Default)]
struct WithoutPlace {
    /// Those that carry mass: complete vectors.
    vectors: Vec<(i64, [u32; 6])>,
    /// Those that do not.
    others: Vec<(DofLabel, u32)>,
}

/// Tells vectors that carry mass from massless rows; `None` with a diagnostic when there are others, or when there is `no_other`
/// node: then the table is another model's.
fn sort_without_place(
    raw: &RawModel,
    nodes: &[(i64, [u32; 6])],
    no_other: bool,
    found: &mut Vec<Diagnostic>,
) -> Option<WithoutPlace> {
    let dimension = usize::from(raw.dimension);
    let massless = |row: u32| raw.mass.matrix.column(row as usize).1.iter().all(|&v| v == 0.0);
    let mut sorted = WithoutPlace::default();
    let mut missing = Vec::new();
    for &(node, rows) in nodes {
        let given = || (0..6).filter(|&k| rows[k] != NONE).map(|k| (k, rows[k]));
        let is_vector = rows[..dimension].iter().all(|&row| row != NONE);
        let carried = given().filter(|&(_, row)| !massless(row));
        if !is_vector && carried.clone().next().is_some() || carried.clone().any(|(k, _)| k >= dimension) {
            missing.push(node);
        } else if carried.count() > 0 {
            sorted.vectors.push((node, rows));
            let rotations = given().filter(|&(k, _)| k >= dimension);
            sorted.others.extend(rotations.map(|(k, row)| (DofLabel { node, direction: k as u8 + 1 }, row)));
        } else {
            sorted.others.extend(given().map(|(k, row)| (DofLabel { node, direction: k as u8 + 1 }, row)));
        }
    }
    if no_other {
        missing = nodes.iter().map(|(node, _)| *node).collect();
    }
    if missing.is_empty() {
        return Some(sorted);
    }
    missing.sort_unstable();
    let message = format!("{} nodes have no coordinates: {}", missing.len(), name_some(&missing));
    found.push(Diagnostic::new(Code::NodesMissing, message).in_file(&raw.nodes_path));
    None
}
