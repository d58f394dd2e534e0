//! Points that follow several nodes by constraints, and their mass.
//!
//! A constraint that a reader eliminated (RBE3, MPC, a rigid body with several independent nodes) makes the
//! displacement u_d and the rotation theta_d of a point sums of displacements and rotations of nodes. The
//! matrices hold its mass as T' M T, which does not show with what the mass turns. The point is therefore kept
//! beside the nodes, with its mass before the constraint.
//!
//! The mass lies on an arm r from a centre c, whose displacement
//!
//! ```text
//! u_c = u_d - theta_d x r
//! ```
//!
//! is an average of displacements: a sum of multiples of the vectors of the nodes. For an RBE3 c is the weighted
//! centre of its nodes, for a rigid body its independent node. Arm and directors turn with theta_d.

use crate::rows::{Recovered, Rows};
use crate::{DofLabel, Nodes};
use flexbody_linalg::{CscMatrix, SymmetricMatrix};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Largest deviation of the motion of a point from that of a rigid body, relative to its distance from the nodes
/// that it follows.
const MAX_RIGID_DEVIATION: f64 = 1e-6;

/// Part of the largest singular value below which a component of the arm is not determined.
const SINGULAR: f64 = 1e-10;

/// Points with mass that follow nodes of the model, as delivered by a reader.
#[derive(Debug, Clone, PartialEq)]
pub struct RawFollowers {
    /// Numbers and positions of the points.
    pub points: Nodes,
    /// Rows of the points, point by point: three displacements, then three rotations or none.
    pub labels: Vec<DofLabel>,
    /// Column i: sum of the rows of K and M that row i of the points is.
    pub follows: CscMatrix,
    /// Mass on the rows of K and M, then on those of the points, before the points follow.
    pub mass: CscMatrix,
    /// Number of other points that follow several nodes with a part of their rows: the matrices contain their mass
    /// only as it is after the constraint.
    pub others: usize,
}

impl RawFollowers {
    /// Returns the points beside K and M with `added` more rows at their end, which no point follows.
    pub fn with_more_rows(self, added: usize) -> Self {
        let before = self.follows.n_rows();
        let moved = |row: u32| if (row as usize) < before { row } else { row + added as u32 };
        let with_rows = |matrix: &CscMatrix, [rows, columns]: [usize; 2], column_of: &dyn Fn(u32) -> u32| {
            let entries =
                matrix.triplets().map(|(row, column, value)| (moved(row), column_of(column), value));
            CscMatrix::from_triplets(rows, columns, &entries.collect::<Vec<_>>())
        };
        let follows = with_rows(&self.follows, [before + added, self.follows.n_cols()], &|column| column);
        let all = self.mass.n_cols() + added;
        let mass = with_rows(&self.mass, [all, all], &moved);
        Self { follows, mass, ..self }
    }
}

/// Points of a reader, and the internal row of every row of K and M as read.
#[derive(Debug, Clone)]
pub(crate) struct GivenFollowers {
    pub raw: Arc<RawFollowers>,
    /// Internal row, `u32::MAX` for rows that are left out.
    pub to_internal: Vec<u32>,
}

impl GivenFollowers {
    /// Returns the points for the body made of the internal rows `kept` (ascending).
    pub(crate) fn of_body(&self, kept: &[usize]) -> Self {
        let place = |row: &u32| kept.binary_search(&(*row as usize)).map_or(u32::MAX, |at| at as u32);
        Self { raw: Arc::clone(&self.raw), to_internal: self.to_internal.iter().map(place).collect() }
    }
}

/// Weighted sum of rows.
type Sum = Vec<(u32, f64)>;

/// Point that follows nodes.
#[derive(Debug, Clone)]
struct Follower {
    displacement: [Sum; 3],
    /// Sums of the rotations; `None` for a point without rotations.
    rotation: Option<[Sum; 3]>,
    /// Arm r from the centre to the point.
    arm: Vector3<f64>,
    /// Sums of the displacement u_c of the centre.
    centre: [Sum; 3],
}

/// Points that follow nodes of a model, and the mass on *full rows*: displacements of the vertices of the model, then
/// of the centres; rotations of the nodes, then those of the points.
#[derive(Debug, Clone)]
pub struct Followers {
    points: Nodes,
    all: Vec<Follower>,
    /// Number of points with mass that are not among these.
    others: usize,
    mass: SymmetricMatrix,
    rows: Rows,
    /// Numbers of displacements and of rotations of the model.
    own: [usize; 2],
}

impl Followers {
    /// Creates the points of a body with these rows and nodes; `None` if it has none, or if a point follows rows without
    /// a position or does not follow rigid motion.
    pub(crate) fn new(given: &GivenFollowers, rows: &Rows, nodes: &Nodes) -> Option<Self> {
        let raw = &given.raw;
        let own = [rows.displacements(), rows.rotations().len()];
        let sum = |at: usize| -> Sum {
            let (sources, weights) = raw.follows.column(at);
            let known =
                sources.iter().map(|&row| given.to_internal[row as usize]).zip(weights.iter().copied());
            known.filter(|(row, _)| *row != u32::MAX).collect()
        };
        let (mut points, mut all, mut first_rows) = (Nodes::default(), Vec::new(), Vec::new());
        let mut first = 0;
        for labels in raw.labels.chunk_by(|a, b| a.node == b.node) {
            let three = |from: usize| [0, 1, 2].map(|k| sum(first + from + k));
            let (displacement, rotation) = (three(0), (labels.len() == 6).then(|| three(3)));
            let at = raw.points.ids.iter().position(|id| *id == labels[0].node)?;
            // Points of other bodies follow no row of this one.
            if displacement.iter().any(|sum| !sum.is_empty()) {
                let position = Vector3::from(raw.points.positions[at]);
                all.push(Follower::new(displacement, rotation, position, rows, nodes)?);
                points.ids.push(raw.points.ids[at]);
                points.positions.push(raw.points.positions[at]);
                first_rows.push(first);
            }
            first += labels.len();
        }
        let is_moved = |sum: &Sum| sum.iter().all(|(row, _)| (*row as usize) < own[0] + own[1]);
        let sums = all
            .iter()
            .flat_map(|follower| follower.displacement.iter().chain(follower.rotation.iter().flatten()));
        if all.is_empty() || !sums.into_iter().all(is_moved) {
            return None;
        }
        let full = full_rows(rows, &all);
        let mass = mass_of(given, &all, &first_rows, own, full.len());
        Some(Self { points, all, others: raw.others, mass, rows: full, own })
    }

    /// Returns numbers and positions of the points.
    pub fn points(&self) -> &Nodes {
        &self.points
    }

    /// Returns true if these are all points with mass that follow several nodes.
    pub(crate) fn are_all(&self) -> bool {
        self.others == 0
    }

    /// Returns true if a point has rotations.
    pub fn turn(&self) -> bool {
        self.all.iter().any(|follower| follower.rotation.is_some())
    }

    /// Returns displacements and rotations of the points (three each, zero for points without rotations) for the
    /// displacements `u` of the rows of the model.
    pub fn motion(&self, u: &[f64]) -> [Vec<f64>; 2] {
        let displacements = self.all.iter().flat_map(|one| one.displacement.iter().map(|sum| value(sum, u)));
        let rotations = self.all.iter().flat_map(|follower| {
            (0..3).map(|k| follower.rotation.as_ref().map_or(0.0, |rotation| value(&rotation[k], u)))
        });
        [displacements.collect(), rotations.collect()]
    }

    /// Returns the mass on full rows.
    pub(crate) fn mass(&self) -> &SymmetricMatrix {
        &self.mass
    }

    /// Returns the meaning of the full rows; centres are nodes after the vertices of the model.
    pub(crate) fn rows(&self) -> &Rows {
        &self.rows
    }

    /// Returns the mass of the model without that of the points, by the `n` rows of the model.
    pub(crate) fn own_mass(&self, n: usize) -> SymmetricMatrix {
        let place = |row: usize| self.own_row(row).map(|row| row as u32);
        let entries: Vec<(u32, u32, f64)> = (0..self.mass.n())
            .filter_map(|row| Some((row, place(row)?)))
            .flat_map(|(row, at)| {
                let (columns, values) = self.mass.row(row);
                columns
                    .iter()
                    .zip(values)
                    .filter_map(move |(&column, &value)| Some((at, place(column as usize)?, value)))
            })
            .collect();
        SymmetricMatrix::symmetrised(CscMatrix::from_triplets(n, n, &entries))
    }

    /// Returns the row of the model that a full row is, if there is one.
    fn own_row(&self, full: usize) -> Option<usize> {
        let [displacements, rotations] = self.own;
        let centres = 3 * self.all.len();
        match full {
            _ if full < displacements => Some(full),
            _ if full < displacements + centres => None,
            _ => Some(full - centres).filter(|row| *row < displacements + rotations),
        }
    }

    /// Returns the full rows for the rows of the model.
    pub(crate) fn lift(&self, x: &[f64]) -> Vec<f64> {
        let [displacements, rotations] = self.own;
        let mut full = Vec::with_capacity(self.rows.len());
        full.extend_from_slice(&x[..displacements]);
        full.extend(self.all.iter().flat_map(|one| one.centre.iter().map(|sum| value(sum, x))));
        full.extend_from_slice(&x[displacements..displacements + rotations]);
        full.extend(
            self.all
                .iter()
                .filter_map(|follower| follower.rotation.as_ref())
                .flatten()
                .map(|sum| value(sum, x)),
        );
        full
    }

    /// Adds to `forces` on the rows of the model those with the power of `full` on full rows.
    pub(crate) fn add_restricted(&self, full: &[f64], forces: &mut [f64]) {
        let [displacements, rotations] = self.own;
        let (head, rest) = full.split_at(displacements);
        let (centres, rest) = rest.split_at(3 * self.all.len());
        let (turning, moments) = rest.split_at(rotations);
        forces.iter_mut().zip(head.iter().chain(turning)).for_each(|(force, full)| *force += full);
        let of_centres = self.all.iter().flat_map(|one| &one.centre).zip(centres);
        let of_turns =
            self.all.iter().filter_map(|follower| follower.rotation.as_ref()).flatten().zip(moments);
        for (sum, force) in of_centres.chain(of_turns) {
            sum.iter().for_each(|&(row, weight)| forces[row as usize] += weight * force);
        }
    }
}

fn value(sum: &Sum, x: &[f64]) -> f64 {
    sum.iter().map(|&(row, weight)| weight * x[row as usize]).sum()
}

/// Returns the meaning of the full rows.
fn full_rows(rows: &Rows, all: &[Follower]) -> Rows {
    let first = rows.displacements() / 3;
    let turning = (first as u32..).zip(all).filter(|(_, one)| one.rotation.is_some());
    let added = turning.flat_map(|(node, _)| (0..3).map(move |axis| (node, axis)));
    Rows {
        dimension: 3,
        nodes: first + all.len(),
        vectors: Vec::new(),
        rotations: rows.rotations().iter().copied().chain(added).collect(),
        others: Vec::new(),
        recovered: Recovered::none(),
    }
}

/// Returns the mass on the `n` full rows. `first_rows` are the first rows of the points among the labels.
fn mass_of(
    given: &GivenFollowers,
    all: &[Follower],
    first_rows: &[usize],
    [displacements, rotations]: [usize; 2],
    n: usize,
) -> SymmetricMatrix {
    let raw = &given.raw;
    let given_rows = given.to_internal.len();
    // Full rows that each row of the mass as given is.
    let mut full: Vec<Sum> = vec![Vec::new(); raw.mass.n_cols()];
    for (to, &internal) in full.iter_mut().zip(&given.to_internal) {
        let row = internal as usize;
        match row {
            _ if internal == u32::MAX || row >= displacements + rotations => {}
            _ if row < displacements => to.push((internal, 1.0)),
            _ => to.push(((row + 3 * all.len()) as u32, 1.0)),
        }
    }
    let mut turn = displacements + 3 * all.len() + rotations;
    for (place, (one, first)) in all.iter().zip(first_rows).enumerate() {
        let at = given_rows + first;
        let centre = displacements + 3 * place;
        for k in 0..3 {
            full[at + k].push(((centre + k) as u32, 1.0));
        }
        if one.rotation.is_some() {
            // u_d = u_c + theta x r = u_c - r~ theta.
            let arm = one.arm.cross_matrix();
            for (k, j) in (0..3).flat_map(|k| (0..3).map(move |j| (k, j))).filter(|at| arm[*at] != 0.0) {
                full[at + k].push(((turn + j) as u32, -arm[(k, j)]));
            }
            (0..3).for_each(|k| full[at + 3 + k].push(((turn + k) as u32, 1.0)));
            turn += 3;
        }
    }
    let mut entries = Vec::with_capacity(raw.mass.nnz());
    for (column, to) in full.iter().enumerate() {
        let (rows, values) = raw.mass.column(column);
        for (row, value) in rows.iter().zip(values) {
            for &(p, a) in &full[*row as usize] {
                entries.extend(to.iter().map(|&(q, b)| (p, q, a * value * b)));
            }
        }
    }
    SymmetricMatrix::symmetrised(CscMatrix::from_triplets(n, n, &entries))
}

/// Parts of the sums of a point by the displacements and by the rotations of one node: columns by their axes.
#[derive(Default)]
struct Leader {
    /// Displacement of the point.
    moved: [Matrix3<f64>; 2],
    /// Rotation of the point.
    turned: [Matrix3<f64>; 2],
}

impl Follower {
    /// Creates a point at `position`; `None` if it follows rows without a position or does not follow rigid motion.
    fn new(
        displacement: [Sum; 3],
        rotation: Option<[Sum; 3]>,
        position: Vector3<f64>,
        rows: &Rows,
        nodes: &Nodes,
    ) -> Option<Self> {
        let leaders = leaders(&displacement, rotation.as_ref(), rows)?;
        let place = |node: usize| Vector3::from(nodes.positions[node]);
        let size = leaders.keys().map(|node| (place(*node) - position).norm()).fold(0.0, f64::max);
        let turns = rotation.is_some();
        let follows = follows_rigid_motion(&leaders, turns, |node| place(node) - position, size);
        follows.then_some(())?;
        let arm = if turns { arm(&leaders, size) } else { Vector3::zeros() };
        let mut centre = displacement.clone();
        if let Some(rotation) = &rotation {
            // u_c = u_d + r~ theta.
            let across = arm.cross_matrix();
            for (k, sum) in centre.iter_mut().enumerate() {
                let turned =
                    (0..3).flat_map(|j| rotation[j].iter().map(move |&(row, w)| (row, across[(k, j)] * w)));
                let mut joined: BTreeMap<u32, f64> = BTreeMap::new();
                sum.iter().copied().chain(turned).for_each(|(row, w)| *joined.entry(row).or_default() += w);
                *sum = joined.into_iter().filter(|(_, weight)| *weight != 0.0).collect();
            }
        }
        Some(Self { displacement, rotation, arm, centre })
    }
}

/// Returns the parts of the sums of a point by nodes; `None` for a row without a position.
fn leaders(
    displacement: &[Sum; 3],
    rotation: Option<&[Sum; 3]>,
    rows: &Rows,
) -> Option<BTreeMap<usize, Leader>> {
    let mut leaders: BTreeMap<usize, Leader> = BTreeMap::new();
    let first = rows.displacements();
    for (turned, sums) in std::iter::once((false, displacement)).chain(rotation.map(|sums| (true, sums))) {
        for (k, sum) in sums.iter().enumerate() {
            for &(row, weight) in sum {
                let (row, node) = (row as usize, rows.vertex(row as usize));
                rows.is_node(node).then_some(())?;
                let (by, axis) = match row.checked_sub(first) {
                    None => (0, row % 3),
                    Some(at) => (1, usize::from(rows.rotations()[at].1)),
                };
                let leader = leaders.entry(node).or_default();
                let part = if turned { &mut leader.turned } else { &mut leader.moved };
                part[by][(k, axis)] += weight;
            }
        }
    }
    Some(leaders)
}

/// Returns true if the point moves like a rigid body with its nodes. `arm` returns the position of a node relative to
/// the point.
fn follows_rigid_motion(
    leaders: &BTreeMap<usize, Leader>,
    turns: bool,
    arm: impl Fn(usize) -> Vector3<f64>,
    size: f64,
) -> bool {
    // Sums for unit translations, and for unit rotations about the point.
    let sum = |part: &dyn Fn(&Leader) -> [Matrix3<f64>; 2]| {
        let mut both = [Matrix3::zeros(); 2];
        for (node, leader) in leaders {
            let [by_displacement, by_rotation] = part(leader);
            both[0] += by_displacement;
            both[1] += by_rotation - by_displacement * arm(*node).cross_matrix();
        }
        both
    };
    let size = if size > 0.0 { size } else { 1.0 };
    let [moved, swung] = sum(&|leader| leader.moved);
    let [shifted, turned] = sum(&|leader| leader.turned);
    let identity = Matrix3::identity();
    let mut deviations = vec![(moved - identity).amax(), swung.amax() / size];
    if turns {
        deviations.extend([shifted.amax() * size, (turned - identity).amax()]);
    }
    deviations.iter().all(|deviation| *deviation <= MAX_RIGID_DEVIATION)
}

/// Returns the arm r from the centre to the point: u_d + r x theta_d is then closest to a sum of multiples of the
/// displacement vectors of the nodes. `size` is the distance from the farthest node.
fn arm(leaders: &BTreeMap<usize, Leader>, size: f64) -> Vector3<f64> {
    let scale = if size > 0.0 { size.recip() } else { 1.0 };
    let deviator = |a: Matrix3<f64>| a - Matrix3::identity() * (a.trace() / 3.0);
    // Least squares: the sum over the nodes of |dev(A + r~ C)|^2 + |B + r~ D|^2 / size^2 is least.
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for leader in leaders.values() {
        let parts = |a: [Matrix3<f64>; 2]| [deviator(a[0]), a[1] * scale];
        let residual = parts(leader.moved);
        let of_axis = |k: usize| {
            let across = Vector3::ith(k, 1.0).cross_matrix();
            parts(leader.turned.map(|part| across * part))
        };
        let changes = [0, 1, 2].map(of_axis);
        let dot = |a: &[Matrix3<f64>; 2], b: &[Matrix3<f64>; 2]| a[0].dot(&b[0]) + a[1].dot(&b[1]);
        for k in 0..3 {
            right[k] -= dot(&changes[k], &residual);
            (0..3).for_each(|l| normal[(k, l)] += dot(&changes[k], &changes[l]));
        }
    }
    let decomposition = normal.svd(true, true);
    let limit = SINGULAR * decomposition.singular_values.max();
    decomposition.solve(&right, limit).unwrap_or_else(|_| Vector3::zeros())
}
