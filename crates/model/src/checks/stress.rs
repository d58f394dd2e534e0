//! Check of geometric stiffness by its behaviour under rigid motion (theory section 7).

use crate::checks::stress_loads::UnitLoads;
use crate::fe_model::origin::MatrixOrigin;
use crate::rounding::rounding;
use crate::rows::{centre_and_length, rigid_axes};
use crate::wording::name_some;
use crate::{FeModel, GeometricStiffness, UnitLoad};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::ties::first_largest;
use flexbody_linalg::{SymmetricMatrix, gram, larger, parallel, subtract_combination};
use nalgebra::{Matrix3, Vector3};
use std::path::Path;

/// Largest accepted error of a relation: reduced integration leaves some tenths of a percent. A larger
/// value would accept parts of the stiffness of initial displacements, which for a straight bar under
/// tension breaks the relation of rotation by 30 %.
const MAX_RELATION_ERROR: f64 = 1e-2;

/// Errors up to this value are not reported: matrices written with ten digits leave 1e-8.
const MIN_REPORTED_ERROR: f64 = 1e-6;

/// Errors of the load up to this value are not reported: nodal forces are sums of stresses that nearly
/// cancel, and stresses printed with seven digits leave 1e-6 of them (a bracket of 684 nodes).
const MIN_REPORTED_LOAD_ERROR: f64 = 1e-5;

/// Adds an error for each geometric stiffness that breaks a relation with rigid motion, or that belongs to
/// another load.
///
/// * `files`: files of the matrices.
/// * `solid`: true if all elements of the body are known to be solids, so that K_geo is a multiple of I for
///   every pair of nodes.
pub(crate) fn check_stress(
    model: &FeModel,
    files: &[GeometricStiffness<MatrixOrigin>],
    solid: bool,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let given = model.geometric_stiffness();
    if given.is_empty() {
        return;
    }
    let loads = UnitLoads::new(model);
    for GeometricStiffness { load, matrix } in given {
        let file = files.iter().find(|file| file.load == *load).map(|file| &file.matrix);
        let digits = file.map_or(17, |file| file.digits);
        let relations = Relations::new(model, matrix, solid, digits);
        let judged = Judged { model, load, relations };
        let diagnostic = judged.softening(matrix).or_else(|| judged.motion()).or_else(|| judged.load(&loads));
        let path = file.map_or(Path::new(""), |file| &file.path);
        diagnostics.extend(diagnostic.map(|diagnostic| diagnostic.in_file(path)));
    }
}

/// Geometric stiffness with the results of its check.
struct Judged<'m> {
    model: &'m FeModel,
    load: &'m UnitLoad,
    relations: Relations,
}

impl Judged<'_> {
    /// Returns an error if translations cause forces in proportion to mass: the matrix was assembled while a
    /// centrifugal load acted, and holds its change with displacement.
    fn softening(&self, matrix: &SymmetricMatrix) -> Option<Diagnostic> {
        let is_resisted = self.relations.translation.share > MIN_REPORTED_ERROR;
        let rate = is_resisted.then(|| like_mass(self.model, matrix)).flatten()?;
        let message = format!(
            "geometric stiffness for {} resists translation by {rate:.3e} times the mass: it holds the softening of a centrifugal load, which belongs to W2",
            self.load
        );
        let help =
            "assemble the stiffness with the stress alone, in a step in which no centrifugal load is active";
        Some(Diagnostic::new(Code::GeometricStiffnessMotion, message).with_help(help))
    }

    /// Returns an error about the worst relation with rigid motion that holds for every load.
    fn motion(&self) -> Option<Diagnostic> {
        let Relations { translation, rotation, blocks, .. } = &self.relations;
        let (name, per_cent) = (self.load, |share: f64| format!("{:.2} %", 100.0 * share));
        if translation.share > MAX_RELATION_ERROR {
            let labels: Vec<_> = translation.rows.iter().map(|&row| self.model.label(row)).collect();
            let message = format!(
                "geometric stiffness for {name} resists translation: forces reach {} of the row sums (allowed 1 %), at {}",
                per_cent(translation.share),
                name_some(&labels)
            );
            let help = "give the matrix of the free body: rows and columns of supported nodes belong to it";
            return Some(Diagnostic::new(Code::GeometricStiffnessMotion, message).with_help(help));
        }
        if *rotation > MAX_RELATION_ERROR {
            let message = format!(
                "geometric stiffness for {name} does not rotate the forces of its load with the body: {} of its forces under rigid rotation are not rotated forces (allowed 1 %)",
                per_cent(*rotation)
            );
            return Some(Diagnostic::new(Code::GeometricStiffnessMotion, message));
        }
        if *blocks > MAX_RELATION_ERROR {
            let message = format!(
                "geometric stiffness for {name} depends on directions: {} of its entries are outside of multiples of the identity for each pair of nodes (allowed 1 %)",
                per_cent(*blocks)
            );
            return Some(Diagnostic::new(Code::GeometricStiffnessMotion, message));
        }
        None
    }

    /// Returns an error if the load is another one, or a warning about smaller errors.
    fn load(&self, loads: &UnitLoads<'_>) -> Option<Diagnostic> {
        let (name, relations) = (self.load, &self.relations);
        let other = loads.error(self.load, &relations.forces).unwrap_or(0.0);
        if other > MAX_RELATION_ERROR {
            let message = format!(
                "geometric stiffness for {name} belongs to another load: the forces that it turns differ from those of {name} by {:.3} % (allowed 1 %), supports and inertia relief apart",
                100.0 * other
            );
            return Some(Diagnostic::new(Code::GeometricStiffnessLoad, message));
        }
        let errors = [
            ("translation", relations.translation.share),
            ("rotation", relations.rotation),
            ("direction", relations.blocks),
            ("the load", if other > MIN_REPORTED_LOAD_ERROR { other } else { 0.0 }),
        ];
        let (what, worst) = first_largest(errors, |error| error.1)?;
        (worst > MIN_REPORTED_ERROR.max(relations.rounding)).then(|| {
            let message = format!(
                "geometric stiffness for {name} fulfils its relations with rigid motion to {worst:.1e} (worst: {what})"
            );
            Diagnostic::new(Code::GeometricStiffnessRough, message)
        })
    }
}

/// Largest part of the forces of translations that is not in proportion to mass, for a matrix that holds the
/// softening of a centrifugal load. Stress adds no such forces, and rounding is not in proportion to mass.
const MAX_MASSLESS_SHARE: f64 = 0.1;

/// Returns the largest factor of the mass in the forces of translations; `None` if other forces remain.
fn like_mass(model: &FeModel, matrix: &SymmetricMatrix) -> Option<f64> {
    let d = model.dimension();
    let translations = model.rigid_fields([0.0; 3], 1.0).as_ref().subcols(0, d).to_owned();
    let momenta = model.pencil().apply_mass(translations.as_ref());
    let forces = Mat::from_fn(translations.nrows(), d, |i, k| {
        let (columns, values) = matrix.row(i);
        columns.iter().zip(values).map(|(&j, value)| value * translations[(j as usize, k)]).sum()
    });
    let of_mass = gram(momenta.as_ref(), momenta.as_ref());
    let shared = gram(momenta.as_ref(), forces.as_ref());
    let factors = Mat::from_fn(d, d, |i, j| shared[(i, j)] / of_mass[(i, i)]);
    let mut rest = forces.clone();
    subtract_combination(rest.as_mut(), momenta.as_ref(), factors.as_ref());
    (rest.norm_l2() <= MAX_MASSLESS_SHARE * forces.norm_l2()).then(|| factors.norm_max())
}

// Relations between a geometric stiffness and rigid motion of the body.

/// Number of nodes per parallel task.
const NODES_PER_TASK: usize = 16;

/// Smallest size of a row relative to the largest one: forces of smaller rows are compared with this size.
const MIN_ROW_SIZE: f64 = 1e-3;

/// Smallest size of the turned forces relative to the entries times the distances of their nodes: the
/// forces of a stress without load (self-stress) are rounding.
const MIN_FORCE_SIZE: f64 = 1e-3;

/// Relations between a geometric stiffness and rigid motion: the forces that it turns, and relative errors.
struct Relations {
    /// Force f at every node, from K_geo (phi x x) = phi x f. Axes of the model.
    pub forces: Vec<Vector3<f64>>,
    /// Forces of translations.
    pub translation: Translation,
    /// Part of the forces under rotation that is not of the form phi x f; zero in the plane, where every
    /// force has this form.
    pub rotation: f64,
    /// Part of the entries between nodes that depends on direction; zero if nodes have rotations or
    /// internal rows, or if M depends on direction.
    pub blocks: f64,
    /// Error explained by the digits of the file.
    pub rounding: f64,
}

/// Forces of translations, relative to the sums of the entries of the rows.
struct Translation {
    /// Largest force.
    pub share: f64,
    /// Rows with more than half of the largest force.
    pub rows: Vec<usize>,
}

impl Relations {
    fn new(model: &FeModel, matrix: &SymmetricMatrix, solid: bool, digits: u8) -> Self {
        let largest = matrix.as_csc().values().iter().fold(0.0f64, |most, value| most.max(value.abs()));
        let fields = RigidFields::new(model, if largest > 0.0 { largest.recip() } else { 1.0 });
        let nodes: Vec<NodeMotion> = parallel::concat(model.nodes().len(), NODES_PER_TASK, |nodes| {
            nodes.map(|i| fields.of_node(matrix, i)).collect()
        });
        let turned: f64 = nodes.iter().map(|node| node.turned.norm()).sum();
        let entries: f64 = nodes.iter().map(|node| node.entries).sum();
        let size = larger(turned, MIN_FORCE_SIZE * entries);
        let relative = |x: f64| if size > 0.0 { x / size } else { 0.0 };
        let skewed = |node: &NodeMotion| 0.5 * (node.turned + node.turned.transpose()).norm();
        let plain = model.rows().are_plain() && model.scalar_mass().is_some();
        let plane = model.dimension() == 2;
        Self {
            rotation: if plane { 0.0 } else { relative(nodes.iter().map(skewed).sum()) },
            forces: nodes.iter().map(|node| turned_force(&node.turned, plane) / fields.scale).collect(),
            translation: Translation::of(&nodes, model.dimension()),
            blocks: if plain { directed_share(model, matrix, solid) } else { 0.0 },
            rounding: relative(rounding(digits, 2) * entries),
        }
    }
}

/// Returns the force f with G e_k = e_k x f; in the plane only G e_z is known.
fn turned_force(turned: &Matrix3<f64>, plane: bool) -> Vector3<f64> {
    let g = turned;
    if plane {
        return Vector3::new(g[(1, 2)], -g[(0, 2)], 0.0);
    }
    0.5 * Vector3::new(g[(1, 2)] - g[(2, 1)], g[(2, 0)] - g[(0, 2)], g[(0, 1)] - g[(1, 0)])
}

/// Forces of K_geo at one node under rigid motions.
struct NodeMotion {
    /// Largest force along each axis under the translations.
    moved: [f64; 3],
    /// Sum of the magnitudes of the entries of each row of the node at rows that translate.
    rows: [f64; 3],
    /// Column k: force under the rotation e_k about the node.
    turned: Matrix3<f64>,
    /// Sum of |entries| times the largest displacement by a rotation about the node.
    entries: f64,
}

/// Rigid motion of every row: translations, then rotations about the centre, zero for motions that do not
/// exist.
struct RigidFields<'m> {
    model: &'m FeModel,
    centre: [f64; 3],
    rows: Vec<[f64; 6]>,
    /// Reciprocal of the largest entry of K_geo, a factor of all entries that keeps their squares in the
    /// range of numbers.
    scale: f64,
}

impl<'m> RigidFields<'m> {
    fn new(model: &'m FeModel, scale: f64) -> Self {
        let (centre, _) = centre_and_length(&model.nodes().positions);
        let fields = model.rigid_fields(centre, 1.0);
        let columns = rigid_axes(model.dimension());
        let row = |i: usize| {
            let mut row = [0.0; 6];
            columns.iter().enumerate().for_each(|(from, &to)| row[to] = fields[(i, from)]);
            row
        };
        Self { model, centre, rows: (0..fields.nrows()).map(row).collect(), scale }
    }

    fn of_node(&self, matrix: &SymmetricMatrix, node: usize) -> NodeMotion {
        let d = self.model.dimension();
        let x = self.model.nodes().positions[node];
        let arm = Vector3::from_fn(|k, _| x[k] - self.centre[k]);
        let mut motion =
            NodeMotion { moved: [0.0; 3], rows: [0.0; 3], turned: Matrix3::zeros(), entries: 0.0 };
        for axis in 0..d {
            let (columns, values) = matrix.row(d * node + axis);
            let mut moved = Vector3::zeros();
            for (&column, value) in columns.iter().zip(values) {
                let value = value * self.scale;
                let [tx, ty, tz, rx, ry, rz] = self.rows[column as usize];
                let along = Vector3::new(tx, ty, tz);
                // (e_k x (x_j - x_i)) . t = R_jk - (e_k x arm) . t, and the last term is e_k . (arm x t).
                let turn = Vector3::new(rx, ry, rz) - arm.cross(&along);
                moved += value * along;
                motion.rows[axis] += value.abs() * along.norm();
                motion.entries += value.abs() * turn.norm();
                (0..3).for_each(|k| motion.turned[(axis, k)] += value * turn[k]);
            }
            motion.moved[axis] = moved.amax();
        }
        motion
    }
}

impl Translation {
    fn of(nodes: &[NodeMotion], dimension: usize) -> Self {
        let largest = nodes.iter().flat_map(|node| node.rows).fold(0.0, larger);
        if largest == 0.0 {
            return Self { share: 0.0, rows: Vec::new() };
        }
        let share = |node: &NodeMotion, axis: usize| {
            node.moved[axis] / larger(node.rows[axis], MIN_ROW_SIZE * largest)
        };
        let shares: Vec<f64> =
            nodes.iter().flat_map(|node| (0..dimension).map(move |axis| share(node, axis))).collect();
        let worst = shares.iter().copied().fold(0.0, larger);
        let rows = (0..shares.len()).filter(|&row| shares[row] > 0.5 * worst).collect();
        Self { share: worst, rows }
    }
}

/// Returns the part of the entries between different nodes outside of multiples of I. For bodies with
/// elements other than solids, multiples of d d' with d along the line between the nodes, as for bars, are
/// excluded as well.
fn directed_share(model: &FeModel, matrix: &SymmetricMatrix, solid: bool) -> f64 {
    let d = model.dimension();
    let positions = &model.nodes().positions;
    let of_node = |i: usize| {
        let mut sums = [0.0; 2];
        for (j, block) in blocks_of(matrix, d, i) {
            let line = Vector3::from_fn(|k, _| positions[j][k] - positions[i][k]);
            let line = if solid { None } else { line.try_normalize(0.0) };
            sums[0] += outside(&block, d, line).abs().sum();
            sums[1] += block.abs().sum();
        }
        sums
    };
    let shares: Vec<[f64; 2]> =
        parallel::concat(model.nodes().len(), NODES_PER_TASK, |nodes| nodes.map(of_node).collect());
    let [directed, all] = shares.into_iter().fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
    if all > 0.0 { directed / all } else { 0.0 }
}

/// Returns the blocks of K_geo between node `i` and the others, zero out of the plane.
fn blocks_of(matrix: &SymmetricMatrix, d: usize, i: usize) -> Vec<(usize, Matrix3<f64>)> {
    let mut entries: Vec<(usize, usize, usize, f64)> = Vec::new();
    for axis in 0..d {
        let (columns, values) = matrix.row(d * i + axis);
        let entry = |(&column, &value): (&u32, &f64)| (column as usize / d, axis, column as usize % d, value);
        entries.extend(columns.iter().zip(values).map(entry).filter(|pair| pair.0 != i));
    }
    entries.sort_unstable_by_key(|pair| pair.0);
    let block = |same: &[(usize, usize, usize, f64)]| {
        let mut block = Matrix3::zeros();
        same.iter().for_each(|&(_, a, b, value)| block[(a, b)] = value);
        (same[0].0, block)
    };
    entries.chunk_by(|a, b| a.0 == b.0).map(block).collect()
}

/// Returns the part of a block outside of multiples of I in d dimensions and, with a unit vector `line`, of
/// multiples of line line'.
fn outside(block: &Matrix3<f64>, d: usize, line: Option<Vector3<f64>>) -> Matrix3<f64> {
    let part = 1.0 / d as f64;
    let unit = Matrix3::from_diagonal(&Vector3::from_fn(|k, _| if k < d { 1.0 } else { 0.0 }));
    let mut rest = block - unit * (part * block.trace());
    if let Some(line) = line {
        let directed = line * line.transpose() - unit * part;
        let square = directed.norm_squared();
        if square > 0.0 {
            rest -= directed * (rest.dot(&directed) / square);
        }
    }
    rest
}
