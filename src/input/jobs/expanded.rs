//! Elements that CalculiX expands into solids: several rows have the label of one node of the deck.
//!
//! A node at the corner of a quadratic shell (S6, S8, S8R) becomes three, on both faces and between them, one
//! at the middle of an edge becomes two. The one between the faces lies where the deck says; it has more mass
//! than those beside it, since it is the middle of an edge of the solid. The others get numbers that the deck
//! does not have, and lie where K says: K R = 0 of the rigid rotations R leaves them no other place.

use super::Found;
use super::deck::Deck;
use super::deck_mesh::DeckMesh;
use crate::base::diagnostic::{Code, Diagnostic};
use crate::model::{DofLabel, Nodes, RawMatrix};
use crate::numerics::linalg::{Analysis, Cholesky, CscMatrix, Pencil, Solve, SymmetricMatrix};
use faer::Mat;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// Elements that are expanded, and those among them whose rows can be told apart.
const EXPANDED: &[&str] = &["S", "B", "CPS", "CPE", "CAX", "M3D", "T3D", "T2D"];
const SHELLS: &[&str] = &["S6", "S8", "S8R"];

/// Part of the size of the body by which the rows of a node may differ from those of a point.
const POINT: f64 = 1e-6;

/// Labels of which each stands for one row, and the nodes that the deck does not have.
///
/// # Errors
/// FB111 where rows of one label cannot be told apart, or K does not say where they belong.
pub(super) fn label_once(
    deck: &Deck,
    mesh: &DeckMesh,
    labels: Vec<DofLabel>,
    [stiffness, mass]: [&RawMatrix; 2],
    path: &Path,
) -> Found<(Vec<DofLabel>, Nodes)> {
    let mut rows: HashMap<i64, Vec<usize>> = HashMap::new();
    labels.iter().enumerate().for_each(|(row, label)| rows.entry(label.node).or_default().push(row));
    let is_repeated = |rows: &&Vec<usize>| {
        let mut directions: Vec<u8> = rows.iter().map(|row| labels[*row].direction).collect();
        directions.sort_unstable();
        directions.windows(2).any(|pair| pair[0] == pair[1])
    };
    let mut several: Vec<&Vec<usize>> = rows.values().filter(is_repeated).collect();
    several.sort_unstable();
    let Some(first) = several.first().map(|rows| labels[rows[0]]) else {
        return Ok((labels, Nodes::default()));
    };
    let kinds = expanded_kinds(mesh);
    let refuse = |why: &str| Err(vec![refused(first, &kinds, why).in_file(path)]);
    if kinds.is_empty() || !kinds.iter().all(|kind| SHELLS.contains(kind)) {
        return refuse("the deck does not say where their nodes lie");
    }
    if deck.cards().iter().any(|card| card.keyword == "SHELL SECTION" && card.parameter("OFFSET").is_some()) {
        return refuse("a section with OFFSET does not lie where the deck says");
    }
    let mut once = labels.clone();
    let mut added = Vec::new();
    let mut next = labels.iter().map(|label| label.node).chain(mesh.nodes.keys().copied()).max().unwrap_or(0);
    for rows in several {
        let is_vector = |own: &[usize]| {
            let direction = |k: usize| own.get(k).map(|row| (*row, labels[*row].direction));
            (0..3).all(|k| direction(k) == Some((own[0] + k, k as u8 + 1)))
        };
        let masses: Vec<f64> = rows.chunks(3).map(|own| mass.matrix.get(own[0], own[0])).collect();
        let is_told = match *masses.as_slice() {
            [_, _] => true,
            [below, middle, above] => middle > below.max(above),
            _ => false,
        };
        if !is_told || !rows.chunks(3).all(is_vector) {
            return refuse("their rows cannot be told apart");
        }
        for (copy, own) in rows.chunks(3).enumerate() {
            if masses.len() == 3 && copy == 1 {
                continue;
            }
            let Some(number) = next.checked_add(1) else { return refuse("their nodes have no numbers left") };
            next = number;
            own.iter().for_each(|row| once[*row].node = number);
            added.push((number, own[0]));
        }
    }
    added.sort_unstable_by_key(|(_, row)| *row);
    match places(stiffness, &once, &mesh.nodes, &added) {
        Some(positions) => {
            Ok((once, Nodes { ids: added.iter().map(|(number, _)| *number).collect(), positions }))
        }
        None => refuse("the stiffness does not say where their nodes lie"),
    }
}

/// Places of the nodes that the deck does not have, each given by its first row (ascending): with all others
/// turned about each axis, the rows i without a load turn by R_i = -K_ii^-1 K_ib R_b, and e x r is the turn
/// of a point at r. `None` where they are no points.
fn places(
    stiffness: &RawMatrix,
    labels: &[DofLabel],
    nodes: &BTreeMap<i64, [f64; 3]>,
    added: &[(i64, usize)],
) -> Option<Vec<[f64; 3]>> {
    let whole = SymmetricMatrix::new(stiffness.matrix.clone())?;
    let rows: Vec<usize> = added.iter().flat_map(|(_, row)| *row..row + 3).collect();
    let size = nodes.values().flatten().fold(0.0f64, |size, x| size.max(x.abs()));
    let turn = |row: usize, axis: usize| {
        let DofLabel { node, direction } = labels[row];
        let x = nodes.get(&node)?;
        let k = usize::from(direction) - 1;
        // e_a x x along k.
        Some(match (k + 3 - axis) % 3 {
            1 => -x[(axis + 2) % 3],
            2 => x[(axis + 1) % 3],
            _ => 0.0,
        })
    };
    let load = |i: usize, axis: usize| {
        let (columns, values) = whole.row(rows[i]);
        let others = columns.iter().zip(values).map(|(j, k)| k * turn(*j as usize, axis).unwrap_or(0.0));
        -others.sum::<f64>()
    };
    let load = Mat::from_fn(rows.len(), 3, load);
    let own = whole.principal(&rows);
    let unit: Vec<_> = (0..rows.len() as u32).map(|i| (i, i, 1.0)).collect();
    let unit = SymmetricMatrix::new(CscMatrix::from_triplets(rows.len(), rows.len(), &unit))?;
    let pencil = Pencil::new(&own, &unit, 1);
    let analysis = Analysis::new(&pencil)?;
    let factor = Cholesky::<f64>::new(&analysis, &pencil, 0.0)?;
    let mut turned = load.clone();
    factor.solve_in_place(turned.as_mut());
    // Once more with what is left: the motion is as exact as K.
    let mut rest = &load - pencil.apply_stiffness(turned.as_ref());
    factor.solve_in_place(rest.as_mut());
    turned += &rest;
    let place = |node: usize| {
        let entry = |k: usize, axis: usize| turned[(3 * node + k, axis)];
        // The two entries that a coordinate has, and how far the rows are from those of a point.
        let pairs = [0, 1, 2].map(|c| (entry((c + 1) % 3, (c + 2) % 3), -entry((c + 2) % 3, (c + 1) % 3)));
        let differs = pairs.iter().map(|(a, b)| (a - b).abs()).chain((0..3).map(|k| entry(k, k).abs()));
        (differs.fold(0.0, f64::max) <= POINT * size).then(|| pairs.map(|(a, b)| 0.5 * (a + b)))
    };
    (0..added.len()).map(place).collect()
}

/// Types of the expanded elements of a deck.
fn expanded_kinds(mesh: &DeckMesh) -> Vec<&str> {
    let expanded = |kind: &&str| EXPANDED.iter().any(|head| kind.starts_with(head));
    let mut kinds: Vec<&str> = mesh.elements.iter().map(|own| own.kind.as_str()).filter(expanded).collect();
    kinds.sort_unstable();
    kinds.dedup();
    kinds
}

fn refused(label: DofLabel, kinds: &[&str], why: &str) -> Diagnostic {
    let kinds = if kinds.is_empty() { "elements".to_owned() } else { kinds.join(", ") };
    let message = format!("{label} labels several rows: CalculiX expands {kinds} into solids, and {why}");
    Diagnostic::new(Code::DeckUnsupported, message)
        .with_help("model the part with solid elements, C3D4, C3D8, C3D10, C3D20 and their kin, or with the shells S6, S8, S8R alone")
}
