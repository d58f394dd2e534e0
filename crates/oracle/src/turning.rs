//! Models with rotating nodes that carry mass: a rigid region of a solid, a disc on a shaft, a mass on a rigid arm.

use super::elements::{ElementKind, MassRule, Material};
use super::mesh::{Mesh, grid};
use super::reference;
use flexbody_linalg::CscMatrix;
use flexbody_model::{DofLabel, Nodes, RawModel};
use nalgebra::{DMatrix, Matrix3, Vector3};

/// Returns a sparse matrix as a dense one.
pub fn dense(a: &CscMatrix) -> DMatrix<f64> {
    let a = reference::dense(a);
    DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)])
}

/// Returns a dense matrix as a sparse one without zeros.
pub fn sparse(a: &DMatrix<f64>) -> CscMatrix {
    let mut entries = Vec::new();
    for (j, column) in a.column_iter().enumerate() {
        for (i, value) in column.iter().enumerate().filter(|(_, value)| **value != 0.0) {
            entries.push((i as u32, j as u32, *value));
        }
    }
    CscMatrix::from_triplets(a.nrows(), a.ncols(), &entries)
}

/// Skewed block of solid elements whose end at x = 0 is rigid: its nodes follow a reference point beside them.
pub struct Block {
    /// Positions of all nodes; the nodes of the rigid region are the last ones.
    pub positions: Vec<[f64; 3]>,
    /// Scalar mass matrix Ms between all nodes.
    pub mass: DMatrix<f64>,
    /// Nodes of the rigid region.
    pub rigid: Vec<usize>,
    /// Point that the rigid region follows: the last node of the model.
    pub reference: [f64; 3],
    pub raw: RawModel,
}

/// Returns a skewed block with a rigid end, of elements of this kind.
pub fn block(kind: ElementKind) -> Block {
    let mesh = Mesh::from_cells(kind, &grid([3, 2, 2]), |[x, y, z]| {
        [0.3 * x + 0.04 * y, 0.2 * y * (1.0 - 0.1 * x), 0.15 * z * (1.0 + 0.12 * y) + 0.02 * x]
    });
    let material = Material { youngs: 4.0, poisson: 0.3, density: 1.0 };
    let assembly = mesh.assemble(&material, MassRule::Consistent);
    let positions = assembly.nodes.clone();
    let n = positions.len();
    let k = dense(&assembly.stiffness);
    let mass = dense(&assembly.scalar_mass);
    let whole = mass.kronecker(&DMatrix::<f64>::identity(3, 3));
    let rigid: Vec<usize> = (0..n).filter(|&i| at_start(&positions[i])).collect();
    let free: Vec<usize> = (0..n).filter(|i| !rigid.contains(i)).collect();
    let reference = [-0.1, 0.25, 0.05];

    // u = T (u of the free nodes, t, theta), with u_i = t + theta x r_i in the rigid region.
    let columns = 3 * free.len() + 6;
    let mut t = DMatrix::zeros(3 * n, columns);
    for (at, &i) in free.iter().enumerate() {
        (0..3).for_each(|c| t[(3 * i + c, 3 * at + c)] = 1.0);
    }
    for &i in &rigid {
        let arm = Vector3::from(positions[i]) - Vector3::from(reference);
        for c in 0..3 {
            t[(3 * i + c, 3 * free.len() + c)] = 1.0;
            (0..3).for_each(|a| t[(3 * i + c, 3 * free.len() + 3 + a)] = Vector3::ith(a, 1.0).cross(&arm)[c]);
        }
    }
    let [k, m] = [k, whole].map(|a| {
        let reduced = t.transpose() * a * &t;
        sparse(&((&reduced + reduced.transpose()) * 0.5))
    });
    let mut places: Vec<[f64; 3]> = free.iter().map(|&i| positions[i]).collect();
    places.push(reference);
    let ids: Vec<i64> = (1..=places.len() as i64).collect();
    let own = |node: i64, directions: std::ops::RangeInclusive<u8>| {
        directions.map(move |direction| DofLabel { node, direction })
    };
    let last = ids.len() as i64;
    let dofs: Vec<DofLabel> =
        ids[..ids.len() - 1].iter().flat_map(|&id| own(id, 1..=3)).chain(own(last, 1..=6)).collect();
    let nodes = Nodes { ids, positions: places };
    let raw = RawModel { dofs: Some(dofs), ..RawModel::in_memory("block with a rigid end", k, m, nodes) };
    // Free nodes come first, as in the model.
    let order: Vec<usize> = free.iter().chain(&rigid).copied().collect();
    let positions = order.iter().map(|&i| positions[i]).collect();
    let mass = DMatrix::from_fn(n, n, |i, j| mass[(order[i], order[j])]);
    let rigid = (free.len()..n).collect();
    Block { positions, mass, rigid, reference, raw }
}

/// Returns true for a node of the lattice at x = 0, where the map gives x = 0.04 y / 0.2 at most.
fn at_start(x: &[f64; 3]) -> bool {
    x[0] <= 0.2 * x[1] + 1e-9
}

/// Returns a straight shaft of beams along x with a disc in its middle, whose moment of inertia about the shaft is
/// `ratio` times that about a diameter.
pub fn disc_on_shaft(ratio: f64) -> RawModel {
    const COUNT: usize = 5;
    let (length, section) = (0.25, Vector3::new(1e6, 2e3, 1e2));
    let n = 6 * COUNT;
    let (mut k, mut m) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
    let [extension, bending, twist] = [section.x, section.y, section.z];
    let l = length;
    for beam in 0..COUNT - 1 {
        let rows = |node: usize, direction: usize| 6 * (beam + node) + direction;
        let add = |a: usize, b: usize, value: f64, into: &mut DMatrix<f64>| {
            into[(a, b)] += value;
        };
        for (a, b, sign) in [(0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)] {
            add(rows(a, 0), rows(b, 0), sign * extension / l, &mut k);
            add(rows(a, 3), rows(b, 3), sign * twist / l, &mut k);
        }
        // Deflection along y with rotation about z, and along z with rotation about -y.
        for (deflection, rotation, turn) in [(1, 5, 1.0), (2, 4, -1.0)] {
            let places = [rows(0, deflection), rows(0, rotation), rows(1, deflection), rows(1, rotation)];
            let signs = [1.0, turn, 1.0, turn];
            let own = [
                [12.0, 6.0 * l, -12.0, 6.0 * l],
                [6.0 * l, 4.0 * l * l, -6.0 * l, 2.0 * l * l],
                [-12.0, -6.0 * l, 12.0, -6.0 * l],
                [6.0 * l, 2.0 * l * l, -6.0 * l, 4.0 * l * l],
            ];
            for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
                add(places[i], places[j], signs[i] * signs[j] * own[i][j] * bending / l.powi(3), &mut k);
            }
        }
    }
    for node in 0..COUNT {
        let mass = if node == COUNT / 2 { 5.0 } else { 1.0 };
        (0..3).for_each(|c| m[(6 * node + c, 6 * node + c)] = mass);
        let about_diameter = if node == COUNT / 2 { 0.08 } else { 1e-3 };
        let polar = if node == COUNT / 2 { ratio * about_diameter } else { 2e-3 };
        m[(6 * node + 3, 6 * node + 3)] = polar;
        (4..6).for_each(|c| m[(6 * node + c, 6 * node + c)] = about_diameter);
    }
    let ids: Vec<i64> = (1..=COUNT as i64).collect();
    let positions = (0..COUNT).map(|i| [length * i as f64, 0.0, 0.0]).collect();
    let dofs =
        ids.iter().flat_map(|&node| (1..=6).map(move |direction| DofLabel { node, direction })).collect();
    let nodes = Nodes { ids, positions };
    RawModel { dofs: Some(dofs), ..RawModel::in_memory("disc on a shaft", sparse(&k), sparse(&m), nodes) }
}

/// Attaches a mass to a node by a rigid arm: T = m |v + w x r|^2 / 2, M_tr = -m r~, M_rr = -m r~ r~.
pub fn hang(m: &mut DMatrix<f64>, node: usize, mass: f64, arm: &Vector3<f64>) {
    let skew: Matrix3<f64> = arm.cross_matrix();
    let first = 6 * node;
    for (a, b) in (0..3).flat_map(|a| (0..3).map(move |b| (a, b))) {
        m[(first + a, first + b)] += if a == b { mass } else { 0.0 };
        m[(first + a, first + 3 + b)] += -mass * skew[(a, b)];
        m[(first + 3 + b, first + a)] += -mass * skew[(a, b)];
        m[(first + 3 + a, first + 3 + b)] += -mass * (skew * skew)[(a, b)];
    }
}
