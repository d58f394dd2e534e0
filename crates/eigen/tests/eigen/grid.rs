//! Equal masses on the nodes of a free grid connected by equal springs along its lines: every eigenpair has a
//! closed form.

use faer::{Mat, MatRef};
use flexbody_eigen::{EigenFailure, EigenProblem, EigenSettings, EigenSolution, solve};
use flexbody_linalg::context::Context;
use flexbody_linalg::{CscMatrix, Pencil, SymmetricMatrix};
use std::f64::consts::PI;

/// A grid of n x m nodes; for m = 1 a chain.
pub struct Grid {
    /// Numbers of nodes along each direction.
    pub nodes: [usize; 2],
    pub stiffness: SymmetricMatrix,
    pub mass: SymmetricMatrix,
    /// Rigid motion, of unit modal mass.
    pub rigid: Mat<f64>,
}

/// A closed-form mode: eigenvalue and numbers of half waves.
#[derive(Debug, Clone, Copy)]
pub struct Exact {
    pub eigenvalue: f64,
    pub waves: [usize; 2],
}

impl Grid {
    /// Builds the grid with springs of stiffness `spring` and masses `mass` at the nodes.
    pub fn new(nodes: [usize; 2], spring: f64, mass: f64) -> Self {
        let count = nodes[0] * nodes[1];
        let number = |i: usize, j: usize| (i + nodes[0] * j) as u32;
        let mut k = Vec::new();
        let mut join = |a: u32, b: u32| {
            k.extend([(a, a, spring), (b, b, spring), (a, b, -spring), (b, a, -spring)]);
        };
        for j in 0..nodes[1] {
            for i in 0..nodes[0] {
                if i + 1 < nodes[0] {
                    join(number(i, j), number(i + 1, j));
                }
                if j + 1 < nodes[1] {
                    join(number(i, j), number(i, j + 1));
                }
            }
        }
        let m: Vec<_> = (0..count as u32).map(|a| (a, a, mass)).collect();
        let [stiffness, masses] = [k, m].map(|entries| matrix(count, &entries));
        let rigid = Mat::from_fn(count, 1, |_, _| (mass * count as f64).sqrt().recip());
        Self { nodes, stiffness, mass: masses, rigid }
    }

    pub fn rows(&self) -> usize {
        self.nodes[0] * self.nodes[1]
    }

    pub fn problem(&self) -> EigenProblem<'_> {
        EigenProblem {
            pencil: Pencil::new(&self.stiffness, &self.mass, 1),
            rigid: self.rigid.as_ref(),
            // The Rayleigh quotient of a ramp along the longer side is at least 12 k / (m n^2); twice the
            // exact eigenvalue.
            first_estimate: 2.0 * self.exact()[0].eigenvalue,
            input_error: 0.0,
            order: None,
        }
    }

    /// Returns all flexible modes, ascending: lambda = k / m sum_d 4 sin^2(pi j_d / 2 n_d).
    pub fn exact(&self) -> Vec<Exact> {
        let ratio = -self.stiffness.row(0).1.iter().copied().fold(0.0, f64::min) / self.mass.diagonal()[0];
        let part = |j: usize, n: usize| 4.0 * (PI * j as f64 / (2.0 * n as f64)).sin().powi(2);
        let waves = (0..self.rows()).map(|at| [at % self.nodes[0], at / self.nodes[0]]);
        let mut all: Vec<Exact> = waves
            .filter(|waves| *waves != [0, 0])
            .map(|waves| Exact {
                eigenvalue: ratio * (part(waves[0], self.nodes[0]) + part(waves[1], self.nodes[1])),
                waves,
            })
            .collect();
        all.sort_by(|a, b| a.eigenvalue.total_cmp(&b.eigenvalue));
        all
    }

    /// Returns the mass-normalised shape of a mode, a product of cosines.
    pub fn shape(&self, mode: &Exact) -> Vec<f64> {
        let wave = |j: usize, n: usize, i: usize| (PI * j as f64 * (i as f64 + 0.5) / n as f64).cos();
        let at = |row: usize| {
            wave(mode.waves[0], self.nodes[0], row % self.nodes[0])
                * wave(mode.waves[1], self.nodes[1], row / self.nodes[0])
        };
        let shape: Vec<f64> = (0..self.rows()).map(at).collect();
        let mass: f64 = shape.iter().map(|x| x * x).sum::<f64>() * self.mass.diagonal()[0];
        shape.into_iter().map(|x| x / mass.sqrt()).collect()
    }

    /// Returns the shapes of some modes as columns.
    pub fn shapes(&self, modes: &[Exact]) -> Mat<f64> {
        let columns: Vec<Vec<f64>> = modes.iter().map(|mode| self.shape(mode)).collect();
        Mat::from_fn(self.rows(), modes.len(), |i, j| columns[j][i])
    }

    pub fn solve(&self, settings: &EigenSettings) -> Result<EigenSolution, EigenFailure> {
        solve(&self.problem(), settings, &Context::QUIET)
    }

    /// Asserts that modes agree with the closed form: eigenvalues to `tolerance`, and each vector with the
    /// span of the exact modes of its eigenvalue.
    pub fn assert_exact(&self, found: &EigenSolution, tolerance: f64, what: &str) {
        let exact = self.exact();
        for (j, lambda) in found.eigenvalues.iter().enumerate() {
            let off = lambda / exact[j].eigenvalue - 1.0;
            assert!(off.abs() < tolerance, "{what}, mode {j}: {lambda} is off by {off:e}");
        }
        self.assert_spans(&exact, found.vectors.as_ref(), tolerance, what);
    }

    /// Asserts that the part of each vector outside the span of the exact modes near its eigenvalue is
    /// rounding.
    fn assert_spans(&self, exact: &[Exact], vectors: MatRef<'_, f64>, tolerance: f64, what: &str) {
        let mass = self.mass.diagonal()[0];
        for j in 0..vectors.ncols() {
            let near = exact.iter().filter(|mode| (mode.eigenvalue / exact[j].eigenvalue - 1.0).abs() < 1e-6);
            let within: f64 = near
                .map(|mode| {
                    let shape = self.shape(mode);
                    (0..self.rows()).map(|i| shape[i] * vectors[(i, j)] * mass).sum::<f64>().powi(2)
                })
                .sum();
            assert!((within - 1.0).abs() < tolerance, "{what}, mode {j}: {within} of it in its eigenspace");
        }
    }
}

/// Returns a symmetric matrix of these entries; repeated entries are added.
pub fn matrix(n: usize, entries: &[(u32, u32, f64)]) -> SymmetricMatrix {
    SymmetricMatrix::new(CscMatrix::from_triplets(n, n, entries)).expect("symmetric")
}

/// Returns the entries of a matrix: row, column, value.
pub fn entries(a: &SymmetricMatrix) -> Vec<(u32, u32, f64)> {
    let row = |i: usize| {
        let (columns, values) = a.row(i);
        columns.iter().zip(values).map(move |(&j, &v)| (i as u32, j, v)).collect::<Vec<_>>()
    };
    (0..a.n()).flat_map(row).collect()
}
