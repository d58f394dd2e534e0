//! Pairs of nodes coupled by each matrix. An element that gives two nodes common mass couples them by its
//! stiffness too.

use crate::accepted::acceptance;
use crate::fe_model::assemble::Assembled;
use crate::rows::Rows;
use crate::rows::neighbours::neighbours;
use crate::wording::name_some;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::{SymmetricMatrix, parallel};
use std::collections::HashMap;
use std::ops::Range;

/// Mass between two rows, relative to the root of their diagonal entries, below which it is the rounding of
/// zero.
const ROUNDING_MASS: f64 = 1e-10;

/// Number of vertices per parallel task.
const VERTICES_PER_TASK: usize = 2048;

/// Pairs of vertices ([`Rows::vertex`]) coupled by the mass.
#[derive(Default)]
pub(crate) struct MassPairs {
    /// Number of pairs.
    pub count: usize,
    /// Pairs that the stiffness does not couple, ascending, the lower vertex first.
    pub foreign: Vec<[u32; 2]>,
}

impl MassPairs {
    /// Finds all pairs in matrices in the internal order.
    pub(crate) fn new(stiffness: &SymmetricMatrix, mass: &SymmetricMatrix, rows: &Rows) -> Self {
        let diagonal = mass.diagonal();
        let pairs_of_chunk = |vertices: Range<usize>| {
            let mut part = Self::default();
            for vertex in vertices {
                let mut coupled = by_mass(mass, &diagonal, rows, vertex);
                coupled.retain(|&other| other as usize > vertex);
                part.count += coupled.len();
                // Bubbles of one element share mass, but their strains may be orthogonal.
                if !coupled.is_empty() && rows.is_node(vertex) {
                    let tied = neighbours(stiffness, rows, vertex, |_, _, value| value != 0.0);
                    coupled.retain(|other| tied.binary_search(other).is_err());
                    part.foreign.extend(coupled.into_iter().map(|other| [vertex as u32, other]));
                }
            }
            part
        };
        let mut all = Self::default();
        for part in parallel::map(parallel::ranges(rows.vertices(), VERTICES_PER_TASK), pairs_of_chunk) {
            all.count += part.count;
            all.foreign.extend(part.foreign);
        }
        all
    }
}

fn by_mass(mass: &SymmetricMatrix, diagonal: &[f64], rows: &Rows, vertex: usize) -> Vec<u32> {
    let counts = |i: usize, j: usize, value: f64| {
        value != 0.0 && value * value > ROUNDING_MASS * ROUNDING_MASS * (diagonal[i] * diagonal[j]).abs()
    };
    neighbours(mass, rows, vertex, counts)
}

/// Adds an error if the mass couples nodes that the stiffness does not couple, which cannot happen if both
/// have one order of rows. The finding is a warning if the pairs belong to mass elements, or if the user
/// allows it. Returns the number of pairs coupled by the mass, and the number of these that the stiffness
/// does not couple. `own_mass` is the mass without that of points which follow nodes, if there are any.
pub(crate) fn check_mass_pairs(
    body: &Assembled,
    own_mass: Option<&SymmetricMatrix>,
    diagnostics: &mut Vec<Diagnostic>,
) -> [usize; 2] {
    let Assembled { origin, nodes, rows, stiffness, .. } = body;
    let mass = own_mass.unwrap_or(&body.mass);
    let MassPairs { count, foreign } = MassPairs::new(stiffness, mass, rows);
    if foreign.is_empty() {
        return [count, 0];
    }
    let number = |vertex: u32| rows.number(nodes, vertex as usize);
    let named: Vec<String> =
        foreign.iter().take(6).map(|&[a, b]| format!("{} with {}", number(a), number(b))).collect();
    let some = match foreign.len().checked_sub(named.len()) {
        None | Some(0) => name_some(&named),
        Some(_) => named.join(", ") + ", ...",
    };
    let message = format!(
        "mass couples {count} pairs of nodes, {} of which stiffness does not couple: {some}",
        foreign.len()
    );
    let report = |code| Diagnostic::new(code, message.as_str()).in_file(&origin.mass.path);
    if origin.allow_implausible.accepts(Code::MassOrder) {
        diagnostics.push(report(Code::MassPairs));
    } else if let Some(order) = other_order(body) {
        diagnostics.push(report(Code::MassOrder).with_help(order));
    } else if are_mass_elements(mass, rows, count, &foreign) {
        let help = "nothing to do if the model has a mass element or a mass spread over nodes: each of these nodes shares mass with each other";
        diagnostics.push(report(Code::MassPairs).with_help(help));
    } else if diagnostics.iter().any(|note| note.code() == Code::DeckConstrained) {
        let help = format!(
            "give the points with mass that follow others (RBE3, MPC) rows of their own, tied by RBE2 or stiff beams: the mass of a dependent point lies on all points that it follows, and the part of it that rotations of the point move does not turn with these points; {} accepts errors of W2 and W3 by it",
            acceptance(Code::MassOrder)
        );
        diagnostics.push(report(Code::MassOrder).with_help(help));
    } else {
        diagnostics.push(report(Code::MassOrder));
    }
    [count, foreign.len()]
}

/// Returns true if the pairs form groups within which the mass couples every node with every other, as if a
/// mass is distributed over them. One node coupled with several others is no such group, nor are several
/// single pairs, the sign of two exchanged nodes.
fn are_mass_elements(mass: &SymmetricMatrix, rows: &Rows, count: usize, foreign: &[[u32; 2]]) -> bool {
    if foreign.len() * 4 > count {
        // A quarter of the pairs is too many for such elements. A single pair in a tiny model may be one.
        return foreign.len() == 1;
    }
    let mut pairs_of: HashMap<u32, Vec<u32>> = HashMap::new();
    for &[a, b] in foreign {
        pairs_of.entry(a).or_default().push(b);
        pairs_of.entry(b).or_default().push(a);
    }
    let diagonal = mass.diagonal();
    let mut members: Vec<u32> = pairs_of.keys().copied().collect();
    members.sort_unstable();
    let mut seen: HashMap<u32, usize> = HashMap::new();
    for (group, &first) in members.iter().enumerate() {
        if seen.contains_key(&first) {
            continue;
        }
        let mut clique = vec![first];
        seen.insert(first, group);
        let mut at = 0;
        while at < clique.len() {
            for &other in &pairs_of[&clique[at]] {
                if seen.insert(other, group).is_none() {
                    clique.push(other);
                }
            }
            at += 1;
        }
        let pairs = clique.iter().map(|vertex| pairs_of[vertex].len()).sum::<usize>() / 2;
        let single = pairs == 1 && foreign.len() > 1;
        let star = pairs > 1 && clique.iter().any(|vertex| pairs_of[vertex].len() == pairs);
        let complete = |&vertex: &u32| {
            let coupled = by_mass(mass, &diagonal, rows, vertex as usize);
            coupled.iter().filter(|other| seen.get(other) == Some(&group)).count() == clique.len() - 1
        };
        if single || star || !clique.iter().all(complete) {
            return false;
        }
    }
    true
}

/// Possible order of the rows of M: true if the model can have it, the row that each row of the file would
/// represent, and the advice for the user.
type Order<'o> = (bool, &'o dyn Fn(usize) -> usize, &'static str);

/// Returns advice if the mass fits the stiffness in another order of its rows.
fn other_order(body: &Assembled) -> Option<&'static str> {
    let Assembled { nodes, rows, row_to_internal, .. } = body;
    let n = rows.len();
    if row_to_internal.as_ref().is_some_and(|to| to.len() != n) {
        return None;
    }
    let internal = |row: usize| row_to_internal.as_ref().map_or(row, |to| to[row] as usize);
    let mut by_label: Vec<usize> = (0..n).collect();
    by_label.sort_by_key(|&row| {
        let label = rows.label(nodes, row);
        (label.node, label.direction)
    });
    let mut row_of = vec![0; n];
    (0..n).for_each(|row| row_of[internal(row)] = row);
    let per_node = n / rows.nodes.max(1);
    let blocked = |row: usize| per_node * (row % rows.nodes) + row / rows.nodes;
    let transposed = |row: usize| rows.nodes * (row % per_node) + row / per_node;
    // Internal row that each row of the mass file would represent.
    let orders: [Order<'_>; 5] = [
        (
            true,
            &|row| by_label[row],
            "write both matrices in one order: the rows of the mass matrix follow ascending node numbers, those of the stiffness matrix do not",
        ),
        (
            true,
            &|row| row,
            "write both matrices in one order: the rows of the mass matrix follow the node table, those of the stiffness matrix do not",
        ),
        (
            true,
            &|row| internal(n - 1 - row),
            "write both matrices in one order: the rows of the mass matrix are in the reverse order of those of the stiffness matrix",
        ),
        (
            per_node * rows.nodes == n,
            &|row| internal(blocked(row)),
            "write both matrices in one order: the rows of the mass matrix go direction by direction, those of the stiffness matrix node by node",
        ),
        (
            per_node * rows.nodes == n,
            &|row| internal(transposed(row)),
            "write both matrices in one order: the rows of the mass matrix go node by node, those of the stiffness matrix direction by direction",
        ),
    ];
    orders.iter().find(|(possible, to, _)| *possible && fits(body, &row_of, to)).map(|(.., help)| *help)
}

/// Returns true if the mass couples only nodes that the stiffness couples when each row of its file
/// represents the internal row `to`; `row_of` is the row of the file that each internal row came from.
fn fits(body: &Assembled, row_of: &[usize], to: &dyn Fn(usize) -> usize) -> bool {
    let Assembled { rows, stiffness, mass, .. } = body;
    let place: Vec<usize> = row_of.iter().map(|&row| rows.vertex(to(row))).collect();
    let mut tied: HashMap<usize, Vec<u32>> = HashMap::new();
    (0..rows.len()).all(|row| {
        let target = place[row];
        let near =
            tied.entry(target).or_insert_with(|| neighbours(stiffness, rows, target, |_, _, v| v != 0.0));
        mass.row(row).0.iter().all(|&column| {
            let other = place[column as usize];
            other == target || near.binary_search(&(other as u32)).is_ok()
        })
    })
}
