//! Rotations about directions without any matrix entries, such as about the normal of a shell without
//! drilling stiffness. If the normal is an axis of the model, the rows are empty and left out. Otherwise
//! the direction is found from the block of each node, and the rotation is made to follow the nodes of an
//! element around it.
//!
//! With n the direction at node i, and w(u) the angular velocity of the rigid motion that fits the
//! displacements of node i and of two other nodes of an element, the term
//!
//! ```text
//! k/2 (n' theta_i - n' w(u))^2
//! ```
//!
//! is added to the elastic energy, where k is the largest stiffness of the rotations of the node. No other
//! term depends on n' theta_i, so the term is zero in every static response and every mode for any k: the
//! body does not change, and the rotation moves with its element. Rigid motion leaves the term zero.

use super::assemble::rounding;
use super::node_pairs::neighbours;
use super::wording::name_some;
use super::{Nodes, RawModel, Rows};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::ties::TIE_MARGIN;
use flexbody_linalg::{CscMatrix, SymmetricMatrix};
use nalgebra::{DMatrix, Matrix3, Vector3};

/// Area of the triangle of three nodes, projected across the direction and relative to the square of its
/// longest side, below which the nodes determine no rotation about it.
const MIN_TRIANGLE_AREA: f64 = 1e-3;

/// Number of digits of M below which rounding entries along a direction without mass are removed: they
/// would make M indefinite.
const FULL_DIGITS: u8 = 15;

/// K and M of a model whose rotations about directions without stiffness and mass follow their elements,
/// and a note about them.
pub(super) struct Following {
    pub stiffness: SymmetricMatrix,
    pub mass: SymmetricMatrix,
    pub note: Option<Diagnostic>,
}

/// Returns K and M, with added terms that make rotations about directions without stiffness and mass follow
/// the nodes around them, if there are any.
pub(super) fn with_following_rotations(
    raw: &RawModel,
    rows: &Rows,
    nodes: &Nodes,
    stiffness: SymmetricMatrix,
    mass: SymmetricMatrix,
) -> Following {
    if rows.dimension != 3 || rows.rotations().is_empty() {
        return Following { stiffness, mass, note: None };
    }
    let body = Shell { rows, nodes, stiffness: &stiffness, mass: &mass };
    let found = body.followers([raw.stiffness.digits, raw.mass.digits]);
    if found.is_empty() {
        return Following { stiffness, mass, note: None };
    }
    let mut ids: Vec<i64> = found.iter().map(|one| nodes.ids[one.node]).collect();
    ids.dedup();
    let message = format!(
        "rotations of {} nodes have neither stiffness nor mass about one direction: they follow the nodes around ({})",
        ids.len(),
        name_some(&ids)
    );
    let note = Diagnostic::new(Code::RotationsFollow, message).in_file(&raw.stiffness.path);
    let added: Vec<(u32, u32, f64)> = found.iter().flat_map(|one| square(&one.term, one.stiffness)).collect();
    let held = sum(&stiffness, &added);
    let rounded = raw.mass.digits < FULL_DIGITS;
    let left: Vec<(u32, u32, f64)> =
        found.iter().filter(|_| rounded).flat_map(|one| rest(&mass, one)).collect();
    let mass = if left.is_empty() { mass } else { sum(&mass, &left) };
    Following { stiffness: held, mass, note: Some(note) }
}

/// Rotation of a node about a direction without stiffness and mass.
struct Follower {
    node: usize,
    /// Unit vector of the direction: rows of rotations and components.
    direction: Vec<(u32, f64)>,
    /// g: the rotation minus that of the nodes around it.
    term: Vec<(u32, f64)>,
    /// Stiffness k of the added term.
    stiffness: f64,
}

/// Returns the entries of k g g'.
fn square(term: &[(u32, f64)], size: f64) -> impl Iterator<Item = (u32, u32, f64)> {
    let pairs = term.iter().flat_map(move |a| term.iter().map(move |b| (a, b)));
    // Multiply the components first: both triangles get equal bits.
    pairs.map(move |(a, b)| (a.0, b.0, (a.1 * b.1) * size))
}

/// Returns the entries of (I - v v') M (I - v v') - M, which removes the products of M with a direction v.
fn rest(mass: &SymmetricMatrix, follower: &Follower) -> Vec<(u32, u32, f64)> {
    let v = &follower.direction;
    let mut product: Vec<(u32, f64)> = Vec::new();
    for &(column, part) in v {
        let (rows, values) = mass.row(column as usize);
        product.extend(rows.iter().zip(values).map(|(&row, &value)| (row, part * value)));
    }
    let weight = |row: u32| v.iter().find(|(other, _)| *other == row).map_or(0.0, |(_, part)| *part);
    let along: f64 = product.iter().map(|&(row, value)| weight(row) * value).sum();
    let crossed = product.iter().flat_map(|&(row, value)| {
        v.iter().flat_map(move |&(other, part)| [(row, other, -part * value), (other, row, -part * value)])
    });
    crossed.chain(square(v, along)).collect()
}

/// Returns a matrix with further entries added.
fn sum(matrix: &SymmetricMatrix, added: &[(u32, u32, f64)]) -> SymmetricMatrix {
    let n = matrix.n();
    let unchanged = (0..n).flat_map(|row| {
        let (columns, values) = matrix.row(row);
        columns.iter().zip(values).map(move |(&column, &value)| (row as u32, column, value))
    });
    let all: Vec<(u32, u32, f64)> = unchanged.chain(added.iter().copied()).collect();
    SymmetricMatrix::symmetrised(CscMatrix::from_triplets(n, n, &all))
}

/// Body with nodal rotations.
struct Shell<'b> {
    rows: &'b Rows,
    nodes: &'b Nodes,
    stiffness: &'b SymmetricMatrix,
    mass: &'b SymmetricMatrix,
}

impl Shell<'_> {
    /// Returns all rotations about directions without stiffness and mass, node by node; `digits` are those
    /// of K and M.
    fn followers(&self, digits: [u8; 2]) -> Vec<Follower> {
        let tolerances = digits.map(|digits| rounding(digits, 2));
        let mut found = Vec::new();
        let mut first = self.rows.displacements();
        for of_node in self.rows.rotations().chunk_by(|a, b| a.0 == b.0) {
            let rows: Vec<usize> = (first..first + of_node.len()).collect();
            first += of_node.len();
            let node = of_node[0].0 as usize;
            let axes: Vec<usize> = of_node.iter().map(|&(_, axis)| usize::from(axis)).collect();
            for (direction, stiffness) in self.empty_directions(&rows, tolerances) {
                let direction: Vec<(u32, f64)> = rows.iter().map(|&row| row as u32).zip(direction).collect();
                let term = self.term(node, &axes, &direction);
                found.extend(term.map(|term| Follower { node, direction, term, stiffness }));
            }
        }
        found
    }

    /// Returns unit vectors in the rotations `own` of a node along which neither K nor M has entries, and
    /// the largest stiffness of these rotations. `tolerances` are the relative rounding errors due to the
    /// digits of K and M.
    fn empty_directions(&self, rows: &[usize], tolerances: [f64; 2]) -> Vec<(Vec<f64>, f64)> {
        let block = DMatrix::from_fn(rows.len(), rows.len(), |i, j| entry(self.stiffness, rows[i], rows[j]));
        let eigen = block.symmetric_eigen();
        let largest = eigen.eigenvalues.max();
        if rows.len() < 2 || largest.is_nan() || largest <= 0.0 {
            return Vec::new();
        }
        let small = (0..rows.len()).filter(|&j| eigen.eigenvalues[j] <= 1e-3 * largest);
        let vectors = small.map(|j| eigen.eigenvectors.column(j).iter().copied().collect::<Vec<f64>>());
        let is_empty = |vector: &Vec<f64>| {
            let matrices = [self.stiffness, self.mass].into_iter().zip(tolerances);
            matrices.into_iter().all(|(matrix, tolerance)| vanishes(matrix, rows, vector, tolerance))
        };
        vectors.filter(is_empty).map(|vector| (vector, largest)).collect()
    }

    /// Returns g with g'x = n' theta - n' w(u); `None` if no two nodes of an element with the node
    /// determine w.
    fn term(&self, node: usize, axes: &[usize], direction: &[(u32, f64)]) -> Option<Vec<(u32, f64)>> {
        let mut normal = Vector3::zeros();
        axes.iter().zip(direction).for_each(|(&axis, &(_, part))| normal[axis] = part);
        let around = self.element_around(node, &normal)?;
        let place = |node: usize| Vector3::from(self.nodes.positions[node]);
        let centre = around.iter().map(|&node| place(node)).sum::<Vector3<f64>>() / around.len() as f64;
        let arms = around.map(|node| place(node) - centre);
        let moment = |r: &Vector3<f64>| Matrix3::identity() * r.norm_squared() - r * r.transpose();
        // n' w = n' I^-1 sum r x u.
        let weight = arms.iter().map(moment).sum::<Matrix3<f64>>().try_inverse()? * normal;
        let moved = around.iter().zip(&arms).flat_map(|(&node, arm)| {
            let force = weight.cross(arm);
            (0..3).map(move |axis| ((3 * node + axis) as u32, -force[axis]))
        });
        Some(direction.iter().copied().chain(moved).collect())
    }

    /// Returns the node and two others that K couples with it and with each other: those with the largest
    /// triangle across `normal`.
    fn element_around(&self, node: usize, normal: &Vector3<f64>) -> Option<[usize; 3]> {
        let coupled = |node: usize| neighbours(self.stiffness, self.rows, node, |_, _, value| value != 0.0);
        let near: Vec<usize> = coupled(node)
            .into_iter()
            .map(|other| other as usize)
            .filter(|&other| self.rows.is_node(other))
            .collect();
        let arm = |other: usize| {
            Vector3::from(self.nodes.positions[other]) - Vector3::from(self.nodes.positions[node])
        };
        let mut best: Option<(f64, [usize; 3])> = None;
        for &a in &near {
            let beside = coupled(a);
            for &b in near.iter().filter(|&&b| b > a && beside.binary_search(&(b as u32)).is_ok()) {
                let (x, y) = (arm(a), arm(b));
                let longest = x.norm_squared().max(y.norm_squared());
                let area = x.cross(&y).dot(normal).abs();
                if area > MIN_TRIANGLE_AREA * longest
                    && best.is_none_or(|(largest, _)| area > largest * (1.0 + TIE_MARGIN))
                {
                    best = Some((area, [node, a, b]));
                }
            }
        }
        best.map(|(_, around)| around)
    }
}

fn entry(matrix: &SymmetricMatrix, row: usize, column: usize) -> f64 {
    let (columns, values) = matrix.row(row);
    columns.binary_search(&(column as u32)).map_or(0.0, |at| values[at])
}

/// Returns true if the combination `vector` of the columns `columns` is zero within `tolerance` of the largest
/// of them.
fn vanishes(matrix: &SymmetricMatrix, columns: &[usize], vector: &[f64], tolerance: f64) -> bool {
    let mut entries: Vec<(u32, f64)> = Vec::new();
    let mut largest = 0.0f64;
    for (&column, &part) in columns.iter().zip(vector) {
        let (rows, values) = matrix.row(column);
        largest = largest.max(values.iter().map(|value| value * value).sum::<f64>());
        entries.extend(rows.iter().zip(values).map(|(&row, &value)| (row, part * value)));
    }
    entries.sort_by_key(|entry| entry.0);
    let sums =
        entries.chunk_by(|a, b| a.0 == b.0).map(|of_row| of_row.iter().map(|entry| entry.1).sum::<f64>());
    sums.map(|sum| sum * sum).sum::<f64>().sqrt() <= tolerance * largest.sqrt()
}
