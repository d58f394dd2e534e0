//! Conversion from labelled matrix rows to the internal order of [`Rows`]: every used node has as many
//! displacements as the model has dimensions.

use crate::fe_model::element_around::element_around;
use crate::rows::{Recovered, Rows, centre_and_length};
use crate::wording::name_some;
use crate::{Damping, DofLabel, Nodes, RawModel};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::{CscMatrix, parallel};
use nalgebra::Vector3;
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};

/// Target of each matrix row.
pub(crate) struct Layout {
    /// Internal row of each matrix row; `u32::MAX` for rows that are left out.
    pub row_to_internal: Vec<u32>,
    /// Indices into the node table of the used nodes, ascending.
    pub used: Vec<usize>,
    /// Meaning of the internal rows; the motion of rows without a position is not known yet.
    pub rows: Rows,
}

impl Layout {
    /// Returns true if the rows are in internal order already.
    pub(crate) fn is_identity(&self) -> bool {
        self.row_to_internal.iter().enumerate().all(|(row, &to)| row == to as usize)
    }

    /// Returns the used nodes of the node table.
    pub(crate) fn used_nodes(&self, table: &Nodes) -> Nodes {
        Nodes {
            ids: self.used.iter().map(|&i| table.ids[i]).collect(),
            positions: self.used.iter().map(|&i| table.positions[i]).collect(),
        }
    }
}

/// Marks a missing row.
const MISSING_ROW: u32 = u32::MAX;

/// Assigns the rows to nodes and directions; all errors are collected in `found`.
pub(crate) fn layout(raw: &RawModel, diagnostics: &mut Vec<Diagnostic>) -> Option<Layout> {
    let labels = labels(raw, diagnostics)?;
    let before = diagnostics.len();
    let index = index_of_nodes(raw, diagnostics);
    check_plane(raw, &labels, diagnostics);
    if diagnostics.len() > before {
        return None;
    }
    let mut rows = RowsOfNodes::new(raw, &labels, &index, diagnostics);
    let empty = rows.leave_out_empty(raw);
    let occupied = Occupied::new(raw, &rows.placed, diagnostics);
    if diagnostics.len() > before {
        return None;
    }
    diagnostics.extend(empty.note(raw));
    occupied.note_unused(raw, &empty.nodes, diagnostics);
    let placeless = sort_without_place(raw, &rows.without_place, occupied.used.is_empty(), diagnostics)?;
    Some(in_order(raw, &rows.placed, occupied.used, placeless))
}

/// Returns the label of each row, implied if none are given; `None` with a diagnostic if the number of
/// labels is not that of rows.
fn labels<'r>(raw: &'r RawModel, diagnostics: &mut Vec<Diagnostic>) -> Option<Cow<'r, [DofLabel]>> {
    let n = raw.stiffness.matrix.n_cols();
    let Some(labels) = &raw.dofs else { return implied_labels(raw, n, diagnostics).map(Cow::Owned) };
    if labels.len() != n {
        let message =
            format!("{} degrees of freedom are labelled, but the matrices have {n} rows", labels.len());
        diagnostics.push(Diagnostic::new(Code::DofCount, message).in_file(&raw.dofs_path));
        return None;
    }
    Some(Cow::Borrowed(labels))
}

/// Returns the labels of the displacements of each node in turn.
fn implied_labels(raw: &RawModel, n: usize, diagnostics: &mut Vec<Diagnostic>) -> Option<Vec<DofLabel>> {
    let (nodes, dimension) = (raw.nodes.len(), usize::from(raw.dimension));
    if dimension * nodes == n {
        let displacements =
            |&node: &i64| (1..=raw.dimension).map(move |direction| DofLabel { node, direction });
        return Some(raw.nodes.ids.iter().flat_map(displacements).collect());
    }
    let message =
        format!("{nodes} nodes have {} displacements, but the matrices have {n} rows", dimension * nodes);
    let per_node = n.checked_div(nodes).unwrap_or(0);
    let help = if per_node * nodes == n && per_node > dimension {
        format!(
            "give a dofs table that labels the {per_node} rows of each node: 1, 2, 3 for displacements, 4, 5, 6 for rotations"
        )
    } else {
        "give a dofs table that says which node and direction each matrix row is".to_owned()
    };
    let diagnostic = Diagnostic::new(Code::DofCount, message).in_file(&raw.nodes_path);
    diagnostics.push(diagnostic.with_help(help));
    None
}

/// Returns the index of each node in the node table by its number; adds a diagnostic for each duplicate.
fn index_of_nodes(raw: &RawModel, diagnostics: &mut Vec<Diagnostic>) -> HashMap<i64, usize> {
    let mut index = HashMap::with_capacity(raw.nodes.len());
    for (i, &id) in raw.nodes.ids.iter().enumerate() {
        if index.insert(id, i).is_some() {
            let message = format!("node {id} is given twice");
            diagnostics.push(Diagnostic::new(Code::NodeDuplicate, message).in_file(&raw.nodes_path));
        }
    }
    index
}

/// Adds a diagnostic about directions of a plane model that leave its plane.
fn check_plane(raw: &RawModel, labels: &[DofLabel], diagnostics: &mut Vec<Diagnostic>) {
    let leads_out = |label: &&DofLabel| raw.dimension == 2 && (3..=5).contains(&label.direction);
    let outside: Vec<DofLabel> = labels.iter().filter(leads_out).copied().collect();
    if !outside.is_empty() {
        let message = format!(
            "{} degrees of freedom of a plane model are out of the plane: {}",
            outside.len(),
            name_some(&outside)
        );
        diagnostics.push(Diagnostic::new(Code::DirectionOutOfPlane, message).in_file(&raw.dofs_path));
    }
}

/// Matrix row of each direction of each node; [`MISSING_ROW`] for missing directions.
struct RowsOfNodes {
    /// Rows of the nodes of the node table, in its order.
    placed: Vec<[u32; 6]>,
    /// Rows of nodes that are not in the table, by number, in the order of their first labels.
    without_place: Vec<(i64, [u32; 6])>,
}

impl RowsOfNodes {
    /// Creates the rows from the labels; adds a diagnostic about duplicate directions.
    fn new(
        raw: &RawModel,
        labels: &[DofLabel],
        index: &HashMap<i64, usize>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Self {
        // Look up in parallel: there are several labels per node.
        let places: Vec<Option<usize>> = parallel::concat(labels.len(), 1024, |rows| {
            labels[rows].iter().map(|label| index.get(&label.node).copied()).collect()
        });
        let mut all = Self { placed: vec![[MISSING_ROW; 6]; raw.nodes.len()], without_place: Vec::new() };
        let mut twice = Vec::new();
        let mut later = HashMap::new();
        for (row, (label, place)) in labels.iter().zip(places).enumerate() {
            let rows = match place {
                Some(place) => &mut all.placed[place],
                None => {
                    let without_place = &mut all.without_place;
                    let at = *later.entry(label.node).or_insert_with(|| {
                        without_place.push((label.node, [MISSING_ROW; 6]));
                        without_place.len() - 1
                    });
                    &mut without_place[at].1
                }
            };
            let slot = &mut rows[usize::from(label.direction) - 1];
            if *slot == MISSING_ROW {
                *slot = row as u32;
            } else {
                twice.push(format!("{label} in rows {} and {row}", *slot));
            }
        }
        if !twice.is_empty() {
            let message = format!("{} labels are given twice: {}", twice.len(), name_some(&twice));
            diagnostics.push(Diagnostic::new(Code::DofDuplicate, message).in_file(&raw.dofs_path));
        }
        all
    }
}

impl RowsOfNodes {
    /// Leaves out rows that are empty in all matrices: all rows of a node without elements, and rotations, but
    /// for those about the normal of a shell: there the node has other rotations and an element around it. A
    /// displacement without stiffness and mass is kept if the node has other displacements: it is an error.
    fn leave_out_empty(&mut self, raw: &RawModel) -> LeftOut {
        let others = raw.data.damping.as_ref().and_then(Damping::matrix).into_iter();
        let others = others.chain(raw.data.geometric_stiffness.iter().map(|stiffness| &stiffness.matrix));
        let matrices =
            [&raw.stiffness, &raw.mass].into_iter().chain(others).map(|stiffness| &stiffness.matrix);
        let filled = filled_rows(matrices, raw.stiffness.matrix.n_cols());
        let mut left_out = LeftOut::default();
        if filled.iter().all(|filled| *filled) {
            return left_out;
        }
        let about_normals = self.about_normals(raw, &filled);
        let placed = raw.nodes.ids.iter().copied().zip(&mut self.placed);
        let without_place = self.without_place.iter_mut().map(|(node, rows)| (*node, rows));
        for (node, rows) in placed.chain(without_place) {
            let is_empty = |row: u32| row != MISSING_ROW && !filled[row as usize];
            let moves = rows.iter().any(|&row| row != MISSING_ROW && !is_empty(row));
            let given = rows.iter().filter(|row| **row != MISSING_ROW).count();
            if !moves && given > 0 {
                left_out.nodes.push(node);
                left_out.of_nodes += given;
                *rows = [MISSING_ROW; 6];
            }
            let counts = |row: u32| is_empty(row) && about_normals.binary_search(&row).is_err();
            for row in rows[3..].iter_mut().filter(|row| counts(**row)) {
                left_out.rotations += 1;
                *row = MISSING_ROW;
            }
        }
        left_out
    }

    /// Returns the empty rows of rotations about the normals of shells, ascending.
    fn about_normals(&self, raw: &RawModel, filled: &[bool]) -> Vec<u32> {
        let is_filled = |row: u32| row != MISSING_ROW && filled[row as usize];
        let is_empty = |row: u32| row != MISSING_ROW && !filled[row as usize];
        let candidates = self.placed.iter().enumerate().filter(|(_, rows)| {
            rows[..3].iter().all(|&row| is_filled(row))
                && rows[3..].iter().any(|&row| is_filled(row))
                && rows[3..].iter().any(|&row| is_empty(row))
        });
        let candidates: Vec<(usize, &[u32; 6])> = candidates.collect();
        if candidates.is_empty() {
            return Vec::new();
        }
        let matrix = &raw.stiffness.matrix;
        let mut node_of = vec![MISSING_ROW; matrix.n_cols()];
        for (node, rows) in self.placed.iter().enumerate() {
            rows.iter()
                .filter(|row| **row != MISSING_ROW)
                .for_each(|&row| node_of[row as usize] = node as u32);
        }
        let coupled = |node: usize| {
            let rows = self.placed[node].iter().filter(|row| **row != MISSING_ROW);
            let entries = rows.flat_map(|&row| {
                let (rows, values) = matrix.column(row as usize);
                rows.iter()
                    .zip(values)
                    .filter(|(_, value)| **value != 0.0)
                    .map(|(&row, _)| node_of[row as usize])
            });
            let mut near: Vec<u32> =
                entries.filter(|&other| other != MISSING_ROW && other as usize != node).collect();
            near.sort_unstable();
            near.dedup();
            near
        };
        let place = |node: usize| Vector3::from(raw.nodes.positions[node]);
        let centre = centre_and_length(&raw.nodes.positions).0.into();
        let mut all: Vec<u32> = Vec::new();
        for (node, rows) in candidates {
            let normals = (3..6).filter(|&direction| is_empty(rows[direction]));
            let has_element = |direction: &usize| {
                element_around(node, &Vector3::ith(direction - 3, 1.0), &centre, place, coupled).is_some()
            };
            all.extend(normals.filter(has_element).map(|direction| rows[direction]));
        }
        all.sort_unstable();
        all
    }
}

/// Rows that are empty in all matrices.
#[derive(Default)]
struct LeftOut {
    /// Numbers of the nodes that have no other rows.
    nodes: Vec<i64>,
    /// Number of rows of these nodes.
    of_nodes: usize,
    /// Number of rotations of other nodes.
    rotations: usize,
}

impl LeftOut {
    /// Returns a note about the rows, if there are any.
    fn note(&self, raw: &RawModel) -> Option<Diagnostic> {
        let Self { nodes, of_nodes, rotations } = self;
        let of_nodes =
            (*of_nodes > 0).then(|| format!("{of_nodes} of nodes without elements ({})", name_some(nodes)));
        let turning = (*rotations > 0).then(|| format!("{rotations} rotations of other nodes"));
        let parts: Vec<String> = of_nodes.into_iter().chain(turning).collect();
        (!parts.is_empty()).then(|| {
            let count = self.of_nodes + rotations;
            let message =
                format!("{count} rows without stiffness and mass are left out: {}", parts.join(", "));
            Diagnostic::new(Code::RowsEmpty, message).in_file(&raw.stiffness.path)
        })
    }
}

/// Nodes of the node table with and without rows.
struct Occupied {
    /// Indices of the nodes that have all displacements, ascending.
    used: Vec<usize>,
    /// Numbers of the nodes without any row.
    unused: Vec<i64>,
}

impl Occupied {
    /// Sorts the nodes; adds a diagnostic about nodes with only some displacements.
    fn new(raw: &RawModel, placed: &[[u32; 6]], diagnostics: &mut Vec<Diagnostic>) -> Self {
        let dimension = usize::from(raw.dimension);
        let mut sorted = Self { used: Vec::new(), unused: Vec::new() };
        let mut incomplete = Vec::new();
        for (i, (rows, &node)) in placed.iter().zip(&raw.nodes.ids).enumerate() {
            let missing = |k: &usize| rows[*k] == MISSING_ROW;
            match (0..dimension).filter(missing).count() {
                0 => sorted.used.push(i),
                _ if rows.iter().all(|&row| row == MISSING_ROW) => sorted.unused.push(node),
                _ => {
                    let missing = (0..dimension).filter(missing);
                    incomplete.extend(missing.map(|k| DofLabel { node, direction: k as u8 + 1 }));
                }
            }
        }
        if !incomplete.is_empty() {
            let message =
                format!("{} displacements are missing: {}", incomplete.len(), name_some(&incomplete));
            let mut diagnostic = Diagnostic::new(Code::DofIncomplete, message).in_file(&raw.dofs_path);
            if sorted.used.is_empty() && incomplete.iter().all(|label| label.direction == 3) {
                diagnostic = diagnostic.with_help("for a plane model, set `dimension = 2` (--dimension 2)");
            } else if sorted.used.is_empty() && has_one_direction(placed) {
                diagnostic = diagnostic.with_help(
                    "give the rows of all displacements: all rows have one direction, as those of a torsional or axial chain, which has no inertia about other axes and is no body in space or in a plane",
                );
            }
            diagnostics.push(diagnostic);
        }
        sorted
    }

    /// Adds a note about nodes that are left out, except those whose rows a note already reports (`reported`) and points
    /// with mass that follow other nodes.
    fn note_unused(&self, raw: &RawModel, reported: &[i64], diagnostics: &mut Vec<Diagnostic>) {
        let following = raw.followers.iter().flat_map(|followers| &followers.points.ids);
        let reported: HashSet<i64> = reported.iter().chain(following).copied().collect();
        let unused: Vec<i64> = self.unused.iter().copied().filter(|node| !reported.contains(node)).collect();
        if !unused.is_empty() {
            let message = format!(
                "{} nodes have no degree of freedom and are left out: {}",
                unused.len(),
                name_some(&unused)
            );
            diagnostics.push(Diagnostic::new(Code::NodesUnused, message).in_file(&raw.nodes_path));
        }
    }
}

/// Returns true if all rows of the nodes have the same direction.
fn has_one_direction(placed: &[[u32; 6]]) -> bool {
    let with_rows = (0..6).filter(|&k| placed.iter().any(|rows| rows[k] != MISSING_ROW));
    with_rows.count() == 1
}

/// Returns the internal order: displacements of the used nodes, vectors without a position, rotations,
/// massless rows.
fn in_order(raw: &RawModel, placed: &[[u32; 6]], used: Vec<usize>, placeless: WithoutPlace) -> Layout {
    let dimension = usize::from(raw.dimension);
    let mut order: Vec<u32> =
        used.iter().flat_map(|&node| placed[node][..dimension].iter().copied()).collect();
    order.extend(placeless.vectors.iter().flat_map(|(_, rows)| &rows[..dimension]));
    let mut rotations = Vec::new();
    for (internal, &node) in used.iter().enumerate() {
        for (axis, &row) in placed[node][3..].iter().enumerate().filter(|(_, row)| **row != MISSING_ROW) {
            rotations.push((internal as u32, axis as u8));
            order.push(row);
        }
    }
    order.extend(placeless.others.iter().map(|(_, row)| row));
    let mut row_to_internal = vec![MISSING_ROW; raw.stiffness.matrix.n_cols()];
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
    Layout { row_to_internal, used, rows }
}

/// Rows of nodes that are not in the node table.
#[derive(Default)]
struct WithoutPlace {
    /// Rows that carry mass: complete vectors.
    vectors: Vec<(i64, [u32; 6])>,
    /// Rows without mass.
    others: Vec<(DofLabel, u32)>,
}

/// Separates vectors that carry mass from massless rows. Returns `None` with a diagnostic if there are
/// others, or if there is `no_other` node: the table then belongs to another model.
fn sort_without_place(
    raw: &RawModel,
    nodes: &[(i64, [u32; 6])],
    no_other: bool,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<WithoutPlace> {
    let dimension = usize::from(raw.dimension);
    let massless = |row: u32| raw.mass.matrix.column(row as usize).1.iter().all(|&v| v == 0.0);
    let mut sorted = WithoutPlace::default();
    let mut missing = Vec::new();
    for &(node, rows) in nodes {
        let given = || (0..6).filter(|&k| rows[k] != MISSING_ROW).map(|k| (k, rows[k]));
        let is_vector = rows[..dimension].iter().all(|&row| row != MISSING_ROW);
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
    diagnostics.push(Diagnostic::new(Code::NodesMissing, message).in_file(&raw.nodes_path));
    None
}

/// Returns for each of `n` rows true if one of the matrices has an entry in its row or its column. Both are
/// tested, since symmetry is checked later.
pub fn filled_rows<'m>(matrices: impl IntoIterator<Item = &'m CscMatrix>, n: usize) -> Vec<bool> {
    let mut filled = vec![false; n];
    for matrix in matrices {
        for column in 0..n.min(matrix.n_cols()) {
            let (rows, _) = matrix.column(column);
            filled[column] |= !rows.is_empty();
            rows.iter().filter(|row| (**row as usize) < n).for_each(|&row| filled[row as usize] = true);
        }
    }
    filled
}
