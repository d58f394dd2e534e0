//! Synthetic bodies and shapes shared by several tests.

use faer::Mat;
use flexbody_body::invariants::{Invariants, primary_differences};
use flexbody_linalg::SymmetricMatrix;
use nalgebra::{Matrix3, Vector3};
use oracle::cuboid::Cuboid;
use oracle::models::symmetric;
use oracle::nodal::expand;
use oracle::random::Random;

/// Scalar mass Ms, its expansion, node positions and shapes.
pub struct Body {
    pub scalar_mass: SymmetricMatrix,
    pub mass: Vec<(usize, usize, f64)>,
    pub positions: Vec<[f64; 3]>,
    pub shapes: Mat<f64>,
}

impl Body {
    pub fn new(scalar_mass: SymmetricMatrix, positions: Vec<[f64; 3]>, shapes: Mat<f64>) -> Self {
        Self { mass: expand(&scalar_mass), scalar_mass, positions, shapes }
    }

    /// Returns a cuboid away from the origin with random shapes.
    pub fn cuboid(seed: u64, modes: usize) -> Self {
        let cuboid = Cuboid { cells: [4, 3, 2], low: [0.3, -0.2, 0.1], size: [1.0, 0.7, 0.4], density: 2.5 };
        let positions = cuboid.positions();
        let shapes = random_matrix(&mut Random(seed), 3 * positions.len(), modes);
        Self::new(cuboid.scalar_mass(), positions, shapes)
    }

    /// Returns nodes, masses and shapes without structure; Ms is only symmetric.
    pub fn random(seed: u64, n: usize, modes: usize) -> Self {
        let mut random = Random(seed);
        let mut triplets = Vec::new();
        for i in 0..n as u32 {
            triplets.push((i, i, 1.5 + random.signed()));
            for j in 0..i {
                if random.signed() > 0.6 {
                    let value = 0.2 * random.signed();
                    triplets.extend([(i, j, value), (j, i, value)]);
                }
            }
        }
        let positions = (0..n).map(|_| random.vector()).collect();
        Self::new(symmetric(n, &triplets), positions, random_matrix(&mut random, 3 * n, modes))
    }
}

pub fn random_matrix(random: &mut Random, rows: usize, columns: usize) -> Mat<f64> {
    Mat::from_fn(rows, columns, |_, _| random.signed())
}

/// Returns smooth displacement fields over the nodes: waves of random direction, length and phase.
pub fn smooth_shapes(random: &mut Random, positions: &[[f64; 3]], modes: usize) -> Mat<f64> {
    let size = positions.iter().flatten().fold(0.0, |m: f64, v| m.max(v.abs()));
    let mut shapes = Mat::zeros(3 * positions.len(), modes);
    for p in 0..modes {
        let wave = Vector3::from(random.vector::<3>()) * (6.0 / size);
        let amplitude = Matrix3::from_fn(|_, _| random.signed());
        for (i, x) in positions.iter().enumerate() {
            let phase = wave.dot(&Vector3::from(*x));
            let u = amplitude * Vector3::new(phase.sin(), phase.cos(), (0.5 * phase).sin());
            for k in 0..3 {
                shapes[(3 * i + k, p)] = u[k];
            }
        }
    }
    shapes
}

/// Returns shapes made M-orthonormal and, if `free` is true, M-orthogonal to rigid motion, by Gram-Schmidt
/// applied twice.
pub fn orthonormalised(
    scalar_mass: &SymmetricMatrix,
    positions: &[[f64; 3]],
    shapes: &Mat<f64>,
    free: bool,
) -> Mat<f64> {
    let n = positions.len();
    let times = |x: &[f64]| -> Vec<f64> {
        let row = |i: usize, k: usize| {
            let (columns, values) = scalar_mass.row(i);
            columns.iter().zip(values).map(|(&j, v)| v * x[3 * j as usize + k]).sum::<f64>()
        };
        (0..3 * n).map(|row_index| row(row_index / 3, row_index % 3)).collect()
    };
    let mut basis: Vec<Vec<f64>> = Vec::new();
    if free {
        for a in 0..3 {
            let axis = Vector3::ith(a, 1.0);
            basis.push((0..3 * n).map(|row| axis[row % 3]).collect());
            basis.push(
                (0..3 * n).map(|row| axis.cross(&Vector3::from(positions[row / 3]))[row % 3]).collect(),
            );
        }
    }
    let rigid = basis.len();
    basis.extend((0..shapes.ncols()).map(|p| (0..3 * n).map(|row| shapes[(row, p)]).collect::<Vec<f64>>()));
    for p in 0..basis.len() {
        for _twice in 0..2 {
            let weighted = times(&basis[p]);
            for q in 0..p {
                let share: f64 = basis[q].iter().zip(&weighted).map(|(a, b)| a * b).sum();
                let (done, rest) = basis.split_at_mut(p);
                rest[0].iter_mut().zip(&done[q]).for_each(|(a, b)| *a -= share * b);
            }
            let weighted = times(&basis[p]);
            let norm = basis[p].iter().zip(&weighted).map(|(a, b)| a * b).sum::<f64>().sqrt();
            basis[p].iter_mut().for_each(|a| *a /= norm);
        }
    }
    Mat::from_fn(3 * n, shapes.ncols(), |row, p| basis[rigid + p][row])
}

/// Returns a matrix that tests use as modal stiffness.
pub fn stiffness(modes: usize) -> Mat<f64> {
    Mat::from_fn(modes, modes, |p, q| if p == q { 10.0 + p as f64 } else { 0.1 / (p + q) as f64 })
}

/// Asserts that the primary data agree relative to their Cauchy-Schwarz bounds, including the modal
/// stiffness.
#[track_caller]
pub fn assert_agree(what: &str, exact: &Invariants, other: &Invariants, limit: f64) {
    for (name, difference) in primary_differences(exact, other) {
        assert!(difference <= limit, "{what}: {name} differs by {difference:e}, limit {limit:e}");
    }
}
