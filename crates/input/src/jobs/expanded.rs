//! Elements that CalculiX expands into solids: several rows have the label of one node of the deck.
//!
//! A node at the corner of a quadratic shell (S6, S8, S8R) becomes three nodes, on both faces and between them; one at
//! the middle of an edge, and one of a linear shell (S3, S4, S4R), becomes two. The middle node of three has more mass than the others, since it is in the middle
//! of an edge of the solid. With the node of the deck at x, the vector d through the thickness and the OFFSET o of the
//! section, the nodes are at x - (1/2 + o) d, x - o d and x + (1/2 - o) d. K determines d: it follows from K R = 0 for
//! the rigid rotations R. If none of the three is at x, the middle one keeps the number of the node; others get numbers
//! that the deck does not have. Of the two nodes of a linear shell the upper one keeps the number.

use super::deck::Deck;
use super::deck_mesh::DeckMesh;
use crate::sets::NodeCopies;
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::scanner::real;
use flexbody_linalg::ties::first_largest;
use flexbody_linalg::{Analysis, Cholesky, CscMatrix, Pencil, Solve, SymmetricMatrix};
use flexbody_model::{DofLabel, RawMatrix};
use nalgebra::Vector3;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

/// Prefixes of the types of expanded elements; `SHELLS` are the types among them whose rows can be identified.
const EXPANDED: &[&str] = &["S", "B", "CPS", "CPE", "CAX", "M3D", "T3D", "T2D"];
const SHELLS: &[&str] = &["S3", "S4", "S4R", "S6", "S8", "S8R"];
/// Types among them with nodes at the corners only.
const LINEAR_SHELLS: &[&str] = &["S3", "S4", "S4R"];

/// Part of the size of the body by which the rows of a node may differ from those of a point.
const POINT: f64 = 1e-6;

/// Unique labels of the rows, and the positions of nodes that differ from the deck; most of these nodes are not in the
/// deck.
pub(super) struct Once {
    pub labels: Vec<DofLabel>,
    pub places: BTreeMap<i64, [f64; 3]>,
    /// New numbers of the copies of each expanded node.
    pub copies: HashMap<i64, Vec<i64>>,
}

/// Node of the deck that was expanded into several nodes.
struct Expanded {
    node: i64,
    /// First row of each copy, from one face to the other, and its distance from the node of the deck in units of d.
    copies: Vec<(usize, f64)>,
}

/// Gives each row a unique label.
///
/// # Errors
/// FB111 if rows with one label cannot be identified, or K does not determine their positions.
pub(super) fn label_once(
    deck: &Deck,
    mesh: &DeckMesh,
    labels: Vec<DofLabel>,
    [stiffness, mass]: [&RawMatrix; 2],
    path: &Path,
) -> Diagnosed<Once> {
    let mut rows: BTreeMap<i64, Vec<usize>> = BTreeMap::new();
    labels.iter().enumerate().for_each(|(row, label)| rows.entry(label.node).or_default().push(row));
    // Nodes with more than one row in a direction were expanded.
    let is_repeated = |rows: &Vec<usize>| {
        let mut directions: Vec<u8> = rows.iter().map(|row| labels[*row].direction).collect();
        directions.sort_unstable();
        directions.windows(2).any(|pair| pair[0] == pair[1])
    };
    rows.retain(|_, rows_of_node| is_repeated(rows_of_node));
    let Some(first) = rows.values().map(|rows_of_node| rows_of_node[0]).min().map(|row| labels[row]) else {
        return Ok(Once { labels, places: BTreeMap::new(), copies: HashMap::new() });
    };
    let kinds = expanded_kinds(mesh);
    let refuse = |why: &str| vec![refused(first, &kinds, why).in_file(path)];
    if kinds.is_empty() || !kinds.iter().all(|kind| SHELLS.contains(kind)) {
        return Err(refuse("the deck does not determine the positions of their nodes"));
    }
    // Copies of each node from one face to the other, and the vector through the thickness from K.
    let offsets = offsets(deck, mesh, &rows).map_err(refuse)?;
    let mut all = Vec::new();
    for (&node, rows_of_node) in &rows {
        let copies = copies(rows_of_node, &labels, mass, offsets[&node]);
        let copies = copies.ok_or_else(|| refuse("their rows cannot be distinguished"))?;
        all.push(Expanded { node, copies });
    }
    all.sort_by_key(|node| node.copies[0].0);
    let through = thickness(stiffness, &labels, &mesh.nodes, &all)
        .ok_or_else(|| refuse("the stiffness does not determine the positions of their nodes"))?;
    numbered(mesh, labels, &all, &through).ok_or_else(|| refuse("no node numbers are left for their nodes"))
}

/// Returns the copies of a node with their distances from the node in units of d. `None` means that the rows are no
/// points, or that no copy of three can be identified as the middle one.
fn copies(rows: &[usize], labels: &[DofLabel], mass: &RawMatrix, offset: f64) -> Option<Vec<(usize, f64)>> {
    let is_vector = |triple: &[usize]| {
        let direction = |k: usize| triple.get(k).map(|row| (*row, labels[*row].direction));
        (0..3).all(|k| direction(k) == Some((triple[0] + k, k as u8 + 1)))
    };
    let masses: Vec<f64> = rows.chunks(3).map(|triple| mass.matrix.get(triple[0], triple[0])).collect();
    let parts: &[f64] = match *masses.as_slice() {
        [_, _] => &[-0.5, 0.5],
        [below, middle, above] if middle > below.max(above) => &[-0.5, 0.0, 0.5],
        _ => return None,
    };
    let place = |(triple, part): (&[usize], &f64)| (triple[0], part - offset);
    rows.chunks(3).all(is_vector).then(|| rows.chunks(3).zip(parts).map(place).collect())
}

/// Returns the OFFSET of the sections of the elements of each node, in parts of the thickness.
fn offsets(
    deck: &Deck,
    mesh: &DeckMesh,
    nodes: &BTreeMap<i64, Vec<usize>>,
) -> Result<BTreeMap<i64, f64>, &'static str> {
    let mut of_elements: HashMap<i64, f64> = HashMap::new();
    for card in deck.cards().iter().filter(|card| card.keyword == "SHELLSECTION") {
        let Some(offset) = card.name("OFFSET") else { continue };
        let offset = match offset.as_str() {
            "SPOS" => Some(0.5),
            "SNEG" => Some(-0.5),
            number => real(number.as_bytes()).filter(|value| value.is_finite()),
        };
        let members = card.name("ELSET").and_then(|set| mesh.sets.elements(&set));
        let (Some(offset), Some(members)) = (offset, members) else {
            return Err("the OFFSET of a section, or its elements, cannot be read");
        };
        of_elements.extend(members.iter().map(|element| (*element, offset)));
    }
    // Nodes take the OFFSET of their elements, which must agree.
    let mut of_nodes: BTreeMap<i64, f64> = BTreeMap::new();
    for (element, nodes_of_element) in mesh.elements.iter().flat_map(|elements| elements.members.iter()) {
        let offset = of_elements.get(element).copied().unwrap_or(0.0);
        for node in nodes_of_element.iter().filter(|node| nodes.contains_key(node)) {
            if of_nodes.insert(*node, offset).is_some_and(|other| other != offset) {
                return Err("sections with different OFFSET share a node");
            }
        }
    }
    nodes.keys().for_each(|node| {
        of_nodes.entry(*node).or_insert(0.0);
    });
    Ok(of_nodes)
}

/// Returns labels with a number for each copy, and the positions of the copies; `None` if there are no numbers left.
fn numbered(
    mesh: &DeckMesh,
    mut labels: Vec<DofLabel>,
    all: &[Expanded],
    through: &[[f64; 3]],
) -> Option<Once> {
    let mut next = labels.iter().map(|label| label.node).chain(mesh.nodes.keys().copied()).max().unwrap_or(0);
    let linear = corners_of_linear_shells(mesh);
    let (mut places, mut all_copies) = (BTreeMap::new(), HashMap::new());
    for (Expanded { node, copies }, d) in all.iter().zip(through) {
        let x = mesh.nodes[node];
        let at_node = copies.iter().position(|(_, part)| *part == 0.0);
        let keeps = copies.len() == 3 || linear.contains(node);
        let middle = at_node.or(keeps.then_some(1));
        let mut numbers: Vec<i64> = Vec::new();
        for (copy, &(row, part)) in copies.iter().enumerate() {
            let place = [0, 1, 2].map(|k| x[k] + part * d[k]);
            if middle == Some(copy) {
                if part != 0.0 {
                    places.insert(*node, place);
                }
                continue;
            }
            next = next.checked_add(1)?;
            (row..row + 3).for_each(|row| labels[row].node = next);
            places.insert(next, place);
            numbers.push(next);
        }
        all_copies.insert(*node, numbers);
    }
    Some(Once { labels, places, copies: all_copies })
}

/// Returns the nodes of linear shells.
fn corners_of_linear_shells(mesh: &DeckMesh) -> HashSet<i64> {
    let linear = mesh.elements.iter().filter(|elements| LINEAR_SHELLS.contains(&elements.kind.as_str()));
    let members = linear.flat_map(|elements| elements.members.iter());
    members.flat_map(|(_, nodes)| nodes.iter().copied()).collect()
}

/// Returns the vectors d of the nodes. With R_b of the known rows, rotated about each axis, the copies of a node at x
/// move by e x x + c e x d, where c are the distances of the copies: C'KC D = -C'K R_b. `None` means that the rows are
/// no points.
fn thickness(
    stiffness: &RawMatrix,
    labels: &[DofLabel],
    nodes: &BTreeMap<i64, [f64; 3]>,
    all: &[Expanded],
) -> Option<Vec<[f64; 3]>> {
    let n = labels.len();
    let size = nodes.values().flatten().fold(0.0f64, |size, x| size.max(x.abs()));
    // Index of the unknown of each row, and the distance of its copy.
    let mut unknown = vec![None; n];
    for (at, Expanded { node, copies }) in all.iter().enumerate() {
        nodes.get(node)?;
        for &(row, part) in copies.iter().filter(|(_, part)| *part != 0.0) {
            (0..3).for_each(|k| unknown[row + k] = Some(((3 * at + k) as u32, part)));
        }
    }
    let turn = |row: usize, axis: usize| {
        let DofLabel { node, direction } = labels[row];
        let Some(x) = nodes.get(&node) else { return 0.0 };
        let k = usize::from(direction) - 1;
        // Knots have rotations.
        if k >= 3 {
            return if k - 3 == axis { 1.0 } else { 0.0 };
        }
        // Component k of e_a x x.
        match (k + 3 - axis) % 3 {
            1 => -x[(axis + 2) % 3],
            2 => x[(axis + 1) % 3],
            _ => 0.0,
        }
    };
    // Matrix C'KC and load -C'K R_b.
    let mut load = Mat::zeros(3 * all.len(), 3);
    let mut entries = Vec::new();
    for column in 0..n {
        let (rows, values) = stiffness.matrix.column(column);
        for (&row, &value) in rows.iter().zip(values) {
            let Some((i, part)) = unknown[row as usize] else { continue };
            (0..3).for_each(|axis| load[(i as usize, axis)] -= part * value * turn(column, axis));
            if let Some((j, other)) = unknown[column] {
                entries.push((i, j, part * value * other));
            }
        }
    }
    let matrix =
        SymmetricMatrix::symmetrised(CscMatrix::from_triplets(3 * all.len(), 3 * all.len(), &entries));
    let turned = solved(&matrix, &load)?;
    let vector = |at: usize| {
        let entry = |k: usize, axis: usize| turned[(3 * at + k, axis)];
        // Each coordinate of d appears in two entries; the other entries measure the deviation of the rows from those
        // of a point.
        let pairs = [0, 1, 2].map(|c| (entry((c + 1) % 3, (c + 2) % 3), -entry((c + 2) % 3, (c + 1) % 3)));
        let differs = pairs.iter().map(|(a, b)| (a - b).abs()).chain((0..3).map(|k| entry(k, k).abs()));
        (differs.fold(0.0, f64::max) <= POINT * size).then(|| pairs.map(|(a, b)| 0.5 * (a + b)))
    };
    (0..all.len()).map(vector).collect()
}

/// Solves A X = B for a positive definite matrix, with one step of refinement; returns `None` for another matrix.
pub(super) fn solved(matrix: &SymmetricMatrix, load: &Mat<f64>) -> Option<Mat<f64>> {
    let n = matrix.n();
    let unit: Vec<_> = (0..n as u32).map(|i| (i, i, 1.0)).collect();
    let unit = SymmetricMatrix::new(CscMatrix::from_triplets(n, n, &unit))?;
    let pencil = Pencil::new(matrix, &unit, 1);
    let analysis = Analysis::new(&pencil)?;
    let factor = Cholesky::<f64>::new(&analysis, &pencil, 0.0)?;
    let mut solution = load.clone();
    factor.solve_in_place(solution.as_mut());
    let mut rest = load - pencil.apply_stiffness(solution.as_ref());
    factor.solve_in_place(rest.as_mut());
    solution += &rest;
    Some(solution)
}

/// Returns the new nodes that stand for nodes of the sets of a deck; `None` if there are none. A set whose nodes with rows
/// do not lie on one line stays as it is, unless nodes of linear shells, which lie on one face, belong to it. The others
/// get all copies of their nodes, on both faces, so that the edge of a shell determines a rotation.
pub(super) fn copies_in_sets(
    copies: HashMap<i64, Vec<i64>>,
    places: &BTreeMap<i64, [f64; 3]>,
    labels: &[DofLabel],
) -> Option<NodeCopies> {
    let with_rows = || labels.iter().map(|label| label.node).collect();
    (!copies.is_empty()).then(|| NodeCopies {
        copies,
        places: places.clone(),
        with_rows: with_rows(),
        needs_copies: are_on_one_line,
    })
}

/// Returns true if two or more points lie on one line, to the accuracy of their coordinates.
fn are_on_one_line(points: &[[f64; 3]]) -> bool {
    let [first, _, ..] = points else { return false };
    let first = Vector3::from(*first);
    let away = points.iter().map(|point| Vector3::from(*point) - first);
    let farthest = first_largest(away.clone(), |vector| vector.norm()).unwrap_or_default();
    let length = farthest.norm();
    away.map(|vector| vector.cross(&farthest).norm()).all(|area| area <= POINT * length * length)
}

/// Returns the types of the expanded elements of a deck.
fn expanded_kinds(mesh: &DeckMesh) -> Vec<&str> {
    let expanded = |kind: &&str| EXPANDED.iter().any(|head| kind.starts_with(head));
    let mut kinds: Vec<&str> =
        mesh.elements.iter().map(|elements| elements.kind.as_str()).filter(expanded).collect();
    kinds.sort_unstable();
    kinds.dedup();
    kinds
}

fn refused(label: DofLabel, kinds: &[&str], why: &str) -> Diagnostic {
    let kinds = if kinds.is_empty() { "elements".to_owned() } else { kinds.join(", ") };
    let message = format!("{label} labels several rows: CalculiX expands {kinds} into solids, and {why}");
    Diagnostic::new(Code::DeckUnsupported, message).with_help(
        "use solid elements only (C3D4, C3D8, C3D10, C3D20 and their variants), or shells S3, S4, S4R, S6, S8, S8R without layers only",
    )
}
