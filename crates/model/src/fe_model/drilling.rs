//! Rotations about directions without stiffness, such as about the normal of a shell without drilling
//! stiffness. The direction is found from the block of each node, and the rotation is made to follow the nodes of
//! an element around it. If the normal is an axis of the model, a row is empty; it is kept for such a node.
//!
//! With n the direction at node i, and w(u) the angular velocity of the rigid motion that fits the
//! displacements of node i and of two other nodes of an element, the term
//!
//! ```text
//! k/2 (n' theta_i - n' w(u))^2
//! ```
//!
//! is added to the elastic energy, where k is the largest stiffness of the rotations of the node. No other
//! term depends on n' theta_i, so the term is zero for any k in every mode and every static response to loads
//! without a moment about n: the body does not change, and the rotation moves with its element, which takes
//! moments about n. Rigid motion leaves the term zero.
//!
//! Elements whose normals deviate from n by a small angle delta, as coordinates of few digits make them, give
//! n' theta_i a stiffness of delta^2 times their bending stiffness, and couple it with the bending rotations
//! of other nodes by delta times their bending stiffness. The elements then bend against each other as at a
//! hinge while the node turns by 1/delta times the angle of the hinge, which no small rotation is. Such a
//! rotation is *soft*. The same term makes it follow its element, up to delta^2 of the bending stiffness.
//! A spring, a beam or a shaft of small stiffness about n couples n' theta_i with other rotations by no more
//! than a few times its stiffness, and stays as it is.

use crate::fe_model::element_around::element_around;
use crate::rounding::rounding;
use crate::rows::centre_and_length;
use crate::rows::neighbours::neighbours;
use crate::wording::name_some;
use crate::{Nodes, RawModel, Rows, SoftRotation, SoftRotations};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::{CscMatrix, SymmetricMatrix};
use nalgebra::{DMatrix, Matrix3, Vector3};
use std::collections::BTreeMap;

/// Smallest principal stiffness of the rotations of a node, relative to the largest, below which a rotation
/// may be soft: the square of the angle between the normals of elements, 1e-3 rad. A larger value also takes
/// folds that a mesh may mean.
const SOFT_STIFFNESS: f64 = 1e-6;

/// Coupling of a soft rotation with the bending rotations of other nodes, relative to its own stiffness, from
/// which misaligned elements explain it. Flat shells with angles of 1e-3 to 1e-5 rad between elements have 2e2
/// to 2e4; springs, beams and shafts stay below 2.
const MISALIGNED_COUPLING: f64 = 20.0;

/// Part of the stiffness of a soft rotation that is due to the bending of misaligned elements, from which the
/// rotation acts as a hinge. Shells without drilling stiffness have 0.05 and more. With smaller parts a spring
/// or a drilling stiffness holds the rotation, and the hinge changes bending by less than this part.
const HINGE_SHARE: f64 = 1e-3;

/// Rounding error of a principal stiffness, relative to the tolerance for entries of K.
const ROUNDING_SHARE: f64 = 1e-2;

/// Number of digits of M below which rounding entries along a direction without mass are removed: they
/// would make M indefinite.
const FULL_DIGITS: u8 = 15;

/// K and M of a model whose rotations about directions without stiffness follow their elements, and
/// diagnostics about them.
pub(crate) struct Following {
    pub stiffness: SymmetricMatrix,
    pub mass: SymmetricMatrix,
    /// Rotations to which K gives a stiffness, by misaligned elements.
    pub soft: SoftRotations,
    pub found: Vec<Diagnostic>,
}

/// Returns K and M, with added terms that make rotations about directions without stiffness follow the nodes
/// around them, if there are any.
pub(crate) fn with_following_rotations(
    raw: &RawModel,
    rows: &Rows,
    nodes: &Nodes,
    stiffness: SymmetricMatrix,
    mass: SymmetricMatrix,
) -> Following {
    let unchanged = |stiffness, mass| {
        let (soft, found) = (SoftRotations::default(), Vec::new());
        Following { stiffness, mass, soft, found }
    };
    if rows.dimension != 3 || rows.rotations().is_empty() {
        return unchanged(stiffness, mass);
    }
    let body = Shell {
        rows,
        nodes,
        stiffness: &stiffness,
        mass: &mass,
        centre: centre_and_length(&nodes.positions).0.into(),
        keeps_soft: raw.keep_soft_rotations,
    };
    let followers = body.followers([raw.stiffness.digits, raw.mass.digits]);
    if followers.is_empty() {
        return unchanged(stiffness, mass);
    }
    let found = [false, true].into_iter().filter_map(|soft| remark(&followers, nodes, soft));
    let found = found.map(|diagnostic| diagnostic.in_file(&raw.stiffness.path)).collect();
    let added: Vec<(u32, u32, f64)> = followers
        .iter()
        .flat_map(|follower| square(&follower.rotation.term, follower.rotation.stiffness))
        .collect();
    let held = sum(&stiffness, &added);
    let rounded = raw.mass.digits < FULL_DIGITS;
    let without_mass = followers.iter().filter(|follower| rounded && !follower.has_mass);
    let left: Vec<(u32, u32, f64)> =
        without_mass.flat_map(|follower| rest(&mass, &follower.rotation)).collect();
    let mass = if left.is_empty() { mass } else { sum(&mass, &left) };
    let soft =
        followers.into_iter().filter(|follower| follower.is_soft).map(|follower| follower.rotation).collect();
    Following { stiffness: held, mass, soft: SoftRotations::new(soft), found }
}

/// Returns a diagnostic about the soft rotations that follow, or about those without stiffness and mass;
/// `None` if there are none.
fn remark(followers: &[Follower], nodes: &Nodes, soft: bool) -> Option<Diagnostic> {
    let mut ids: Vec<i64> = followers
        .iter()
        .filter(|follower| follower.is_soft == soft)
        .map(|follower| nodes.ids[follower.node])
        .collect();
    ids.dedup();
    let (count, named) = (ids.len(), name_some(&ids));
    let (code, message) = if soft {
        let message = format!(
            "rotations of {count} nodes have less than {SOFT_STIFFNESS:.0e} of the largest rotational stiffness of their node about one direction, by elements that are not quite coplanar, which would act as hinges: they follow the nodes around ({named})"
        );
        (Code::SoftRotationsFollow, message)
    } else {
        let message = format!(
            "rotations of {count} nodes have neither stiffness nor mass about one direction: they follow the nodes around ({named})"
        );
        (Code::RotationsFollow, message)
    };
    (count > 0).then(|| Diagnostic::new(code, message))
}

/// Rotation of a node that follows the nodes around.
struct Follower {
    node: usize,
    rotation: SoftRotation,
    /// True if K gives the rotation a stiffness, by misaligned elements.
    is_soft: bool,
    /// True if M has entries about the direction.
    has_mass: bool,
}

/// Direction of the rotations of a node without stiffness, or with the stiffness of misaligned elements.
struct LooseDirection {
    /// Unit vector in the rotations of the node.
    vector: Vec<f64>,
    is_soft: bool,
    has_mass: bool,
}

/// Returns the entries of k g g'.
fn square(term: &[(u32, f64)], size: f64) -> impl Iterator<Item = (u32, u32, f64)> {
    let pairs = term.iter().flat_map(move |a| term.iter().map(move |b| (a, b)));
    // Multiply the components first: both triangles get equal bits.
    pairs.map(move |(a, b)| (a.0, b.0, (a.1 * b.1) * size))
}

/// Returns the entries of (I - v v') M (I - v v') - M, which removes the products of M with a direction v.
fn rest(mass: &SymmetricMatrix, follower: &SoftRotation) -> Vec<(u32, u32, f64)> {
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
    /// Mean of the positions of the nodes.
    centre: Vector3<f64>,
    /// True if soft rotations stay as K has them.
    keeps_soft: bool,
}

impl Shell<'_> {
    /// Returns all rotations about directions without stiffness and mass and all soft rotations, node by
    /// node; `digits` are those of K and M.
    fn followers(&self, digits: [u8; 2]) -> Vec<Follower> {
        let tolerances = digits.map(|digits| rounding(digits, 2));
        let mut found = Vec::new();
        let mut first = self.rows.displacements();
        for of_node in self.rows.rotations().chunk_by(|a, b| a.0 == b.0) {
            let rows: Vec<usize> = (first..first + of_node.len()).collect();
            first += of_node.len();
            let node = of_node[0].0 as usize;
            let axes: Vec<usize> = of_node.iter().map(|&(_, axis)| usize::from(axis)).collect();
            let (largest, loose) = self.loose_directions(&rows, tolerances);
            for LooseDirection { vector, is_soft, has_mass } in loose {
                let direction: Vec<(u32, f64)> = rows.iter().map(|&row| row as u32).zip(vector).collect();
                let Some(term) = self.term(node, &axes, &direction) else { continue };
                let stiffness = if has_mass { largest.max(self.holding(&direction, &term)) } else { largest };
                let rotation = SoftRotation { direction, term, stiffness };
                found.push(Follower { node, rotation, is_soft, has_mass });
            }
        }
        found
    }

    /// Returns the largest principal stiffness of the rotations `rows` of a node, and the directions along
    /// which neither K nor M has entries, or which are soft. `tolerances` are the relative rounding errors due
    /// to the digits of K and M.
    fn loose_directions(&self, rows: &[usize], tolerances: [f64; 2]) -> (f64, Vec<LooseDirection>) {
        let block = DMatrix::from_fn(rows.len(), rows.len(), |i, j| entry(self.stiffness, rows[i], rows[j]));
        let eigen = block.symmetric_eigen();
        let largest = eigen.eigenvalues.max();
        if rows.len() < 2 || largest.is_nan() || largest <= 0.0 {
            return (0.0, Vec::new());
        }
        let loose = |j: usize| {
            let vector: Vec<f64> = eigen.eigenvectors.column(j).iter().copied().collect();
            let own = eigen.eigenvalues[j] / largest;
            let [no_stiffness, no_mass] = [0, 1]
                .map(|which| vanishes([self.stiffness, self.mass][which], rows, &vector, tolerances[which]));
            let may_be_soft = !no_stiffness && !self.keeps_soft && own <= SOFT_STIFFNESS;
            let rounding = ROUNDING_SHARE * tolerances[0];
            let is_soft =
                may_be_soft && self.is_misaligned(rows, &vector, [largest * own, largest * rounding]);
            ((no_stiffness && no_mass) || is_soft).then_some(LooseDirection {
                vector,
                is_soft,
                has_mass: !no_mass,
            })
        };
        let small = (0..rows.len()).filter(|&j| eigen.eigenvalues[j] <= 1e-3 * largest);
        (largest, small.filter_map(loose).collect())
    }

    /// Returns true if misaligned elements explain the stiffness `own` of a rotation, known to `rounding`.
    ///
    /// A unit rotation about `direction`, all other rows being held, causes moments about directions across it
    /// at other nodes. They are compared with the stiffness of the rotation, and so is the energy that turning
    /// these nodes would release.
    fn is_misaligned(&self, rows: &[usize], direction: &[f64], [own, rounding]: [f64; 2]) -> bool {
        let (mut squares, mut released) = (0.0, 0.0);
        for (node, moment) in self.bending_moments(rows, direction) {
            let first = self.rows.displacements();
            let at = self.rows.rotations().partition_point(|&(other, _)| other < node);
            let others = self.rows.rotations()[at..].iter().take_while(|(other, _)| *other == node);
            let stiffness: f64 =
                others.enumerate().map(|(k, _)| entry(self.stiffness, first + at + k, first + at + k)).sum();
            squares += moment.norm_squared();
            released += if stiffness > 0.0 { moment.norm_squared() / stiffness } else { 0.0 };
        }
        squares.sqrt() > MISALIGNED_COUPLING * own.max(rounding)
            && (own <= rounding || released > HINGE_SHARE * own)
    }

    /// Returns the moments about directions across `direction` that a unit rotation about it causes at other
    /// nodes, all other rows being held.
    fn bending_moments(&self, rows: &[usize], direction: &[f64]) -> BTreeMap<u32, Vector3<f64>> {
        let first = self.rows.displacements();
        let rotation = |row: usize| row.checked_sub(first).and_then(|at| self.rows.rotations().get(at));
        let mut normal = Vector3::zeros();
        let mut moments: BTreeMap<u32, Vector3<f64>> = BTreeMap::new();
        for (&row, &part) in rows.iter().zip(direction) {
            let Some(&(own, axis)) = rotation(row) else { continue };
            normal[usize::from(axis)] = part;
            let (columns, values) = self.stiffness.row(row);
            for (&column, &value) in columns.iter().zip(values) {
                if let Some(&(node, axis)) = rotation(column as usize).filter(|(node, _)| *node != own) {
                    moments.entry(node).or_default()[usize::from(axis)] += part * value;
                }
            }
        }
        moments.values_mut().for_each(|moment| *moment -= normal * normal.dot(moment));
        moments
    }

    /// Returns a stiffness that holds the inertia about `direction` to the nodes of `term` up to the highest
    /// frequency of their displacements.
    fn holding(&self, direction: &[(u32, f64)], term: &[(u32, f64)]) -> f64 {
        let pairs = direction.iter().flat_map(|a| direction.iter().map(move |b| (a, b)));
        let inertia: f64 = pairs.map(|(a, b)| a.1 * b.1 * entry(self.mass, a.0 as usize, b.0 as usize)).sum();
        let frequencies = term[direction.len()..].iter().filter_map(|&(row, _)| {
            let [k, m] = [self.stiffness, self.mass].map(|matrix| entry(matrix, row as usize, row as usize));
            (m > 0.0).then(|| k / m)
        });
        inertia * frequencies.fold(0.0, f64::max)
    }

    /// Returns g with g'x = n' theta - n' w(u); `None` if no two nodes of an element with the node
    /// determine w.
    fn term(&self, node: usize, axes: &[usize], direction: &[(u32, f64)]) -> Option<Vec<(u32, f64)>> {
        let mut normal = Vector3::zeros();
        axes.iter().zip(direction).for_each(|(&axis, &(_, part))| normal[axis] = part);
        let place = |node: usize| Vector3::from(self.nodes.positions[node]);
        let coupled = |node: usize| {
            let mut near = neighbours(self.stiffness, self.rows, node, |_, _, value| value != 0.0);
            near.retain(|&other| self.rows.is_node(other as usize));
            near
        };
        let around = element_around(node, &normal, &self.centre, place, coupled)?;
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
