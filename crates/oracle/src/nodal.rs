//! The unreduced nodal body: the oracle of every reduction. M is used as 3n x 3n entries, never as Ms.

use super::equations::{ReducedBody, State};
use super::random::Random;
use faer::Mat;
use flexbody_body::invariants::{Invariants, PrimaryData, TermGroups};
use flexbody_linalg::SymmetricMatrix;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// Returns the entries of M = Ms kron I3.
pub fn expand(scalar: &SymmetricMatrix) -> Vec<(usize, usize, f64)> {
    let mut entries = Vec::new();
    for i in 0..scalar.n() {
        let (columns, values) = scalar.row(i);
        for (&j, &value) in columns.iter().zip(values) {
            entries.extend((0..3).map(|k| (3 * i + k, 3 * j as usize + k, value)));
        }
    }
    entries
}

/// Sum of products with compensated rounding errors: twice the digits.
#[derive(Clone, Copy, Default)]
struct Sum(f64, f64);

impl Sum {
    fn add(&mut self, value: f64) {
        let sum = self.0 + value;
        let part = sum - self.0;
        self.1 += (self.0 - (sum - part)) + (value - part);
        self.0 = sum;
    }

    fn add_product(&mut self, a: f64, b: f64) {
        let product = a * b;
        self.add(product);
        self.1 += a.mul_add(b, -product);
    }

    fn value(self) -> f64 {
        self.0 + self.1
    }
}

/// Returns a' M b with twice the digits, for 3n-vectors.
fn weighted(mass: &[(usize, usize, f64)], a: &[f64], b: &[f64]) -> f64 {
    let mut product = vec![Sum::default(); a.len()];
    for &(i, j, value) in mass {
        product[i].add_product(value, b[j]);
    }
    let mut sum = Sum::default();
    for (a, b) in a.iter().zip(&product) {
        sum.add_product(*a, b.0);
        sum.add_product(*a, b.1);
    }
    sum.value()
}

/// Returns the primary data from their definitions as products of 3n-vectors with M, with twice the digits. The vectors
/// are the rigid fields e_a and x_k e_a, and fields of one component of a mode moved to one direction.
pub fn brute_force(mass: &[(usize, usize, f64)], positions: &[[f64; 3]], shapes: &Mat<f64>) -> Invariants {
    let (n, nf) = (positions.len(), shapes.ncols());
    let field = |direction: usize, f: &dyn Fn(usize) -> f64| -> Vec<f64> {
        (0..3 * n).map(|row| if row % 3 == direction { f(row / 3) } else { 0.0 }).collect()
    };
    let one = |a: usize| field(a, &|_| 1.0);
    let x = |k: usize, a: usize| field(a, &|i| positions[i][k]);
    let psi = |k: usize, p: usize, a: usize| field(a, &|i| shapes[(3 * i + k, p)]);
    let mode = |p: usize| -> Vec<f64> { (0..3 * n).map(|row| shapes[(row, p)]).collect() };
    let w = |a: &[f64], b: &[f64]| weighted(mass, a, b);
    // The quantities use different directions: each direction must give the right value.
    Invariants::new(PrimaryData {
        mass: w(&one(1), &one(1)),
        first_moment: Vector3::from_fn(|k, _| w(&one(2), &x(k, 2))),
        second_moment: Matrix3::from_fn(|k, l| w(&x(k, 0), &x(l, 0))),
        c1: Mat::from_fn(3, nf, |k, p| w(&one(k), &mode(p))),
        ibar: std::array::from_fn(|k| {
            std::array::from_fn(|l| (0..nf).map(|p| w(&x(k, l), &mode(p))).collect())
        }),
        s: std::array::from_fn(|k| {
            std::array::from_fn(|l| Mat::from_fn(nf, nf, |p, q| w(&psi(k, p, l), &mode(q))))
        }),
        modal_stiffness: Mat::zeros(nf, nf),
        general: None,
        groups: TermGroups::ALL,
    })
}

/// Returns the forces on (R world, rotation about the origin body, modes): the sums of M times the nodal accelerations.
pub fn inertia_forces(
    mass: &[(usize, usize, f64)],
    positions: &[[f64; 3]],
    shapes: &Mat<f64>,
    state: &State,
    accelerations: &DVector<f64>,
) -> DVector<f64> {
    let (n, nf) = (positions.len(), shapes.ncols());
    let (origin, alpha) =
        (accelerations.fixed_rows::<3>(0).into_owned(), accelerations.fixed_rows::<3>(3).into_owned());
    let field = |i: usize, q: &dyn Fn(usize) -> f64| -> Vector3<f64> {
        Vector3::from_fn(|k, _| (0..nf).map(|p| shapes[(3 * i + k, p)] * q(p)).sum())
    };
    let w = state.omega;
    // Deformed positions (body axes) and accelerations (world axes) of the nodes.
    let place: Vec<Vector3<f64>> =
        (0..n).map(|i| Vector3::from(positions[i]) + field(i, &|p| state.q[p])).collect();
    let acceleration: Vec<Vector3<f64>> = (0..n)
        .map(|i| {
            let relative = field(i, &|p| accelerations[6 + p])
                + 2.0 * w.cross(&field(i, &|p| state.qd[p]))
                + alpha.cross(&place[i])
                + w.cross(&w.cross(&place[i]));
            origin + state.axes * relative
        })
        .collect();
    let mut force = vec![Vector3::zeros(); n];
    for &(row, column, value) in mass {
        force[row / 3][row % 3] += value * acceleration[column / 3][column % 3];
    }
    let mut result = DVector::zeros(6 + nf);
    for i in 0..n {
        let in_body = state.axes.transpose() * force[i];
        let moment = place[i].cross(&in_body);
        for k in 0..3 {
            result[k] += force[i][k];
            result[3 + k] += moment[k];
            for p in 0..nf {
                result[6 + p] += shapes[(3 * i + k, p)] * in_body[k];
            }
        }
    }
    result
}

/// Returns the library's invariants in the form of the equations.
pub fn reduced(body: &Invariants) -> ReducedBody {
    let dense = |a: Mat<f64>| DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)]);
    ReducedBody {
        mass: body.mass(),
        first_moment: body.first_moment(),
        inertia: body.inertia(),
        c1: dense(body.c1().clone()),
        c2: dense(body.c2()),
        w1: dense(body.w1().expect("held")),
        w2: dense(body.w2().expect("held")),
        w3: dense(body.w3().expect("held")),
        modal_mass: dense(body.modal_mass()),
        modal_stiffness: dense(body.modal_stiffness().clone()),
    }
}

/// Returns a random motion with modal coordinates and rates up to `displacement`, and rates of rotation of a few
/// radians.
pub fn random_state(random: &mut Random, modes: usize, displacement: f64) -> (State, DVector<f64>) {
    let mut numbers = |n: usize, scale: f64| DVector::from_fn(n, |_, _| scale * random.signed());
    let (q, qd) = (numbers(modes, displacement), numbers(modes, displacement));
    let mut accelerations = numbers(6 + modes, 1.0);
    accelerations.rows_mut(6, modes).scale_mut(displacement);
    let state = State {
        origin: Vector3::from(random.vector::<3>()),
        axes: random.rotation(),
        velocity: Vector3::from(random.vector::<3>()),
        omega: Vector3::from(random.vector::<3>()) * 3.0,
        q,
        qd,
    };
    (state, accelerations)
}

/// Returns the largest relative deviation over the groups translation, rotation and modes.
pub fn deviation(nodal: &DVector<f64>, reduced: &DVector<f64>) -> f64 {
    let nf = nodal.len() - 6;
    [(0, 3), (3, 3), (6, nf)]
        .map(|(start, rows)| {
            let (a, b) = (nodal.rows(start, rows), reduced.rows(start, rows));
            if rows == 0 { 0.0 } else { (a - b).norm() / a.norm() }
        })
        .into_iter()
        .fold(0.0, f64::max)
}
