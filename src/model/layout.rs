//! From labelled matrix rows to the internal order: every used node with as many displacements as the model has dimensions,
//! node-major.

use super::{DofLabel, RawModel};
use crate::diagnostic::{Code, Diagnostic};
use rayon::prelude::*;
use std::collections::HashMap;

/// Where each matrix row goes.
pub(super) struct Layout {
    /// Internal index d i + k of each matrix row, d the dimension.
    pub row_to_internal: Vec<u32>,
    /// Indices into the node table of the used nodes, ascending.
    pub used: Vec<usize>,
}

impl Layout {
    /// Whether the rows are in internal order already.
    pub fn is_identity(&self) -> bool {
        self.row_to_internal.iter().enumerate().all(|(row, &to)| row == to as usize)
    }
}

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
    let labels =
        match &raw.dofs {
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
                    found.push(Diagnostic::new(Code::DofCount, message).in_file(&raw.nodes_path).with_help(
                        "give a dofs table that says which node and direction each matrix row is",
                    ));
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
    let rotations: Vec<DofLabel> = labels.iter().filter(|l| l.direction > 3).copied().collect();
    if !rotations.is_empty() {
        let message = format!("{} rotational degrees of freedom: {}", rotations.len(), name_some(&rotations));
        found.push(Diagnostic::new(Code::RotationsUnsupported, message).in_file(&raw.dofs_path));
    }
    let normal: Vec<DofLabel> =
        labels.iter().filter(|l| (raw.dimension + 1..=3).contains(&l.direction)).copied().collect();
    if !normal.is_empty() {
        let message = format!(
            "{} degrees of freedom of a plane model lead out of the plane: {}",
            normal.len(),
            name_some(&normal)
        );
        found.push(Diagnostic::new(Code::DirectionOutOfPlane, message).in_file(&raw.dofs_path));
    }
    // Looked up once: the labels are several times as many as the nodes.
    let places: Vec<Option<usize>> = labels.par_iter().map(|label| index.get(&label.node).copied()).collect();
    let mut missing: Vec<i64> = labels
        .iter()
        .zip(&places)
        .filter(|(_, place)| place.is_none())
        .map(|(label, _)| label.node)
        .collect();
    missing.sort_unstable();
    missing.dedup();
    if !missing.is_empty() {
        let message = format!("{} nodes have no coordinates: {}", missing.len(), name_some(&missing));
        found.push(Diagnostic::new(Code::NodesMissing, message).in_file(&raw.nodes_path));
    }
    if found.len() > before {
        return None;
    }
    let mut row_of = vec![[u32::MAX; 3]; raw.nodes.len()];
    let mut twice = Vec::new();
    for (row, (label, place)) in labels.iter().zip(places.into_iter().flatten()).enumerate() {
        let slot = &mut row_of[place][usize::from(label.direction) - 1];
        if *slot == u32::MAX {
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
        match rows.iter().filter(|&&row| row != u32::MAX).count() {
            0 => unused.push(raw.nodes.ids[i]),
            given if given == dimension => used.push(i),
            _ => incomplete.extend(
                (0..raw.dimension)
                    .filter(|&k| rows[usize::from(k)] == u32::MAX)
                    .map(|k| DofLabel { node: raw.nodes.ids[i], direction: k + 1 }),
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
    let mut row_to_internal = vec![0u32; n];
    for (internal, &node) in used.iter().enumerate() {
        for (k, &row) in row_of[node][..dimension].iter().enumerate() {
            row_to_internal[row as usize] = (dimension * internal + k) as u32;
        }
    }
    Some(Layout { row_to_internal, used })
}
