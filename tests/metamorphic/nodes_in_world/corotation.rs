//! Elastic force with a corotated stiffness matrix.
//!
//! V(x) = u'K u / 2 with u_i = R'x_i - X_i, where R(x) is the rotation that fits the nodes best: the polar
//! factor of sum w_ij x_j X_i'. Translations cancel, since K does not resist them. The force is the exact
//! gradient of V, including the change of R with x.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// Weights of the best fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weights {
    /// The mass matrix: R is the frame of the mean axes.
    Mass,
    /// Equal weights for all nodes.
    Nodes,
}

/// A body of solid elements.
#[derive(Debug, Clone)]
pub struct Solid {
    /// Stiffness matrix K (3n x 3n).
    pub stiffness: DMatrix<f64>,
    /// Scalar mass matrix Ms (n x n): M = Ms kron I3.
    pub mass: DMatrix<f64>,
    /// Positions of the nodes in the model.
    pub places: Vec<Vector3<f64>>,
}

/// Constant data of the best fit of nodes.
#[derive(Debug, Clone)]
pub struct Fit {
    weights: DMatrix<f64>,
    /// Positions relative to their weighted mean.
    arms: Vec<Vector3<f64>>,
    /// Weighted sums sum_i w_ij X_i for every node j.
    weighted: Vec<Vector3<f64>>,
}

/// Returns the i-th vector of a sequence of vectors.
pub fn node(x: &DVector<f64>, i: usize) -> Vector3<f64> {
    x.fixed_rows::<3>(3 * i).into_owned()
}

impl Solid {
    /// Returns the mass of every node, the sum of its row.
    pub fn row_masses(&self) -> Vec<f64> {
        self.mass.row_iter().map(|row| row.sum()).collect()
    }

    /// Returns the centre of mass in the model.
    pub fn centre(&self) -> Vector3<f64> {
        let masses = self.row_masses();
        let moment: Vector3<f64> = self.places.iter().zip(&masses).map(|(x, m)| x * *m).sum();
        moment / masses.iter().sum::<f64>()
    }

    /// Returns the displacements R'x - X up to a translation.
    pub fn displacements(&self, x: &DVector<f64>, turn: &Matrix3<f64>) -> DVector<f64> {
        let mut u = DVector::zeros(x.len());
        for (i, place) in self.places.iter().enumerate() {
            u.fixed_rows_mut::<3>(3 * i).copy_from(&(turn.tr_mul(&node(x, i)) - place));
        }
        u
    }

    /// Returns the force of the nodes in the world if a given rotation carries K.
    pub fn carried_force(&self, x: &DVector<f64>, turn: &Matrix3<f64>) -> DVector<f64> {
        let f = &self.stiffness * self.displacements(x, turn);
        let mut force = DVector::zeros(x.len());
        for i in 0..self.places.len() {
            force.fixed_rows_mut::<3>(3 * i).copy_from(&(turn * node(&f, i)));
        }
        -force
    }

    /// Returns the force of the nodes in the world if the best fit carries K, and that rotation.
    pub fn fitted_force(&self, x: &DVector<f64>, fit: &Fit) -> (DVector<f64>, Matrix3<f64>) {
        let turn = fit.rotation(x);
        let f = &self.stiffness * self.displacements(x, &turn);
        let p: Vec<Vector3<f64>> = (0..self.places.len()).map(|i| turn.tr_mul(&node(x, i))).collect();
        // A change of R by the angle d rotates all p by -d, so that V changes by -d . sum p x f.
        let moment: Vector3<f64> = p.iter().enumerate().map(|(i, p)| p.cross(&node(&f, i))).sum();
        let change = fit.stiffness(&p).transpose().try_inverse().expect("nodes that fix a rotation") * moment;
        let mut force = DVector::zeros(x.len());
        for (i, weighted) in fit.weighted.iter().enumerate() {
            force.fixed_rows_mut::<3>(3 * i).copy_from(&(turn * (change.cross(weighted) - node(&f, i))));
        }
        (force, turn)
    }
}

impl Fit {
    /// Returns the best fit of the nodes of a solid.
    pub fn new(solid: &Solid, weights: Weights) -> Self {
        let n = solid.places.len();
        let weights = match weights {
            Weights::Mass => solid.mass.clone(),
            Weights::Nodes => DMatrix::identity(n, n),
        };
        let sums = weights.row_sum();
        let mean: Vector3<f64> =
            solid.places.iter().enumerate().map(|(i, x)| x * sums[i]).sum::<Vector3<f64>>() / sums.sum();
        let arms: Vec<Vector3<f64>> = solid.places.iter().map(|x| x - mean).collect();
        let weighted = (0..n).map(|j| (0..n).map(|i| arms[i] * weights[(i, j)]).sum()).collect();
        Self { weights, arms, weighted }
    }

    /// Returns R(x), the polar factor, by the Newton iteration A <- (A + A^-T) / 2.
    pub fn rotation(&self, x: &DVector<f64>) -> Matrix3<f64> {
        let mut turn: Matrix3<f64> =
            self.weighted.iter().enumerate().map(|(j, weighted)| node(x, j) * weighted.transpose()).sum();
        turn /= turn.norm();
        for _ in 0..60 {
            let next = (turn + turn.try_inverse().expect("nodes that fix a rotation").transpose()) * 0.5;
            let change = (next - turn).norm();
            turn = next;
            if change < 1e-15 {
                break;
            }
        }
        turn
    }

    /// Returns S with S d = sum w_ij X_i x R'dx_j for a change of R by the angle d: S = sum w_ij (X_i . p_j -
    /// p_j X_i').
    fn stiffness(&self, p: &[Vector3<f64>]) -> Matrix3<f64> {
        let of = |j: usize| {
            let (weighted, p) = (&self.weighted[j], &p[j]);
            Matrix3::identity() * weighted.dot(p) - p * weighted.transpose()
        };
        (0..p.len()).map(of).sum()
    }

    /// Returns the rows of sum w_ij X_i x u_j = 0, which keep the best fit at the rotation that u refers to.
    pub fn rows(&self) -> DMatrix<f64> {
        let n = self.arms.len();
        debug_assert_eq!(self.weights.nrows(), n);
        let mut rows = DMatrix::zeros(3, 3 * n);
        for (j, weighted) in self.weighted.iter().enumerate() {
            rows.view_mut((0, 3 * j), (3, 3)).copy_from(&weighted.cross_matrix());
        }
        rows
    }
}
