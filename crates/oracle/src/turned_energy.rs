//! The kinetic energy of nodes whose rotations carry mass, as docs/theory.md section 6 prints it: sums over blocks of
//! M, and Lagrange's equations of this energy by differences. Dense, without code of the library.

use super::general::{Row, RowKind};
use faer::Mat;
use nalgebra::{DVector, Matrix3, Rotation3, Vector3};
use std::collections::HashMap;

/// Moments in the blocks of M between the displacements of one node and displacements and rotations of another.
struct Block {
    nodes: [usize; 2],
    /// Parts of M_tt = mean I + deviator.
    mean: f64,
    deviator: Matrix3<f64>,
    /// Parts of M_tr = -moment~ + symmetric; for a plane body moment = (M_y, -M_x).
    moment: Vector3<f64>,
    symmetric: Matrix3<f64>,
    /// Matrix P of M_rr = tr(P) I - P'; for a plane body P = M_rr / 2 I.
    second: Matrix3<f64>,
}

/// Kinetic energy T as a function of displacements and velocities.
pub struct TurnedEnergy {
    /// Node positions relative to the origin of the frame.
    positions: Vec<Vector3<f64>>,
    /// Row of every displacement and of every rotation.
    rows: HashMap<Row, usize>,
    blocks: Vec<Block>,
    centre: Vector3<f64>,
    /// First moment c_R.
    first_moment: Vector3<f64>,
}

/// Velocities of a body along the axes of its frame.
#[derive(Clone)]
pub struct Velocities {
    pub linear: Vector3<f64>,
    pub omega: Vector3<f64>,
    pub ud: DVector<f64>,
}

impl Velocities {
    fn plus(&self, factor: f64, other: &Self) -> Self {
        Self {
            linear: self.linear + other.linear * factor,
            omega: self.omega + other.omega * factor,
            ud: &self.ud + &other.ud * factor,
        }
    }
}

/// Returns f'(0) by central differences of sixth order.
fn derivative<T>(step: f64, f: impl Fn(f64) -> T) -> T
where
    T: std::ops::Sub<Output = T> + std::ops::Add<Output = T> + std::ops::Mul<f64, Output = T>,
{
    let pair = |k: f64| f(k * step) - f(-k * step);
    (pair(1.0) * 45.0 - pair(2.0) * 9.0 + pair(3.0)) * (1.0 / (60.0 * step))
}

impl TurnedEnergy {
    /// Creates the energy from the mass matrix, the kinds of its rows, node `positions` relative to the origin of the
    /// frame, and the centre of mass `centre`.
    pub fn new(mass: &Mat<f64>, rows: &[Row], positions: &[[f64; 3]], centre: Vector3<f64>) -> Self {
        let index: HashMap<Row, usize> = rows.iter().enumerate().map(|(i, &row)| (row, i)).collect();
        let n = positions.len();
        let plane = !index.contains_key(&Row { kind: RowKind::Displacement, node: 0, axis: 2 });
        let of = |(a, p): (RowKind, usize), (b, q): (RowKind, usize)| {
            Matrix3::from_fn(|k, l| {
                let (i, j) = (
                    index.get(&Row { kind: a, node: p, axis: k }),
                    index.get(&Row { kind: b, node: q, axis: l }),
                );
                i.zip(j).map_or(0.0, |(&i, &j)| mass[(i, j)])
            })
        };
        let skew = |a: &Matrix3<f64>| {
            Vector3::new(a[(1, 2)] - a[(2, 1)], a[(2, 0)] - a[(0, 2)], a[(0, 1)] - a[(1, 0)]) * 0.5
        };
        let mut blocks = Vec::new();
        for (p, q) in (0..n).flat_map(|p| (0..n).map(move |q| (p, q))) {
            use RowKind::{Displacement, Rotation};
            let (tt, tr) = (of((Displacement, p), (Displacement, q)), of((Displacement, p), (Rotation, q)));
            let rr = of((Rotation, p), (Rotation, q));
            if tt.norm() + tr.norm() + rr.norm() == 0.0 {
                continue;
            }
            let d = if plane { 2.0 } else { 3.0 };
            let mean = tt.trace() / d;
            let unit = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, d - 2.0));
            let (moment, symmetric, second) = if plane {
                (Vector3::new(tr[(1, 2)], -tr[(0, 2)], 0.0), Matrix3::zeros(), unit * (0.5 * rr[(2, 2)]))
            } else {
                (skew(&tr), (tr + tr.transpose()) * 0.5, unit * (0.5 * rr.trace()) - rr.transpose())
            };
            blocks.push(Block { nodes: [p, q], mean, deviator: tt - unit * mean, moment, symmetric, second });
        }
        let positions: Vec<Vector3<f64>> = positions.iter().map(|x| Vector3::from(*x)).collect();
        let mut energy = Self { positions, rows: index, blocks, centre, first_moment: Vector3::zeros() };
        let lever = |w: Vector3<f64>| {
            let moved = energy.blocks.iter().map(|block| {
                block.deviator * w.cross(&(energy.positions[block.nodes[1]] - centre)) + block.symmetric * w
            });
            moved.sum::<Vector3<f64>>()
        };
        // Products w x c for unit rotations w.
        let columns = [Vector3::x(), Vector3::y(), Vector3::z()].map(lever);
        energy.first_moment = if plane {
            Vector3::new(columns[2].y, -columns[2].x, 0.0)
        } else {
            skew(&Matrix3::from_columns(&columns))
        };
        energy
    }

    fn vector(&self, x: &DVector<f64>, kind: RowKind, node: usize) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| self.rows.get(&Row { kind, node, axis }).map_or(0.0, |&row| x[row]))
    }

    /// Returns C1_R x.
    fn rest_momentum(&self, x: &DVector<f64>) -> Vector3<f64> {
        let of_block = |block: &Block| {
            let [_, q] = block.nodes;
            block.deviator * self.vector(x, RowKind::Displacement, q)
                + block.symmetric * self.vector(x, RowKind::Rotation, q)
        };
        self.blocks.iter().map(of_block).sum()
    }

    /// Returns T at the displacements u.
    pub fn kinetic(&self, u: &DVector<f64>, v: &Velocities) -> f64 {
        let n = self.positions.len();
        let (w, skew) = (v.omega, v.omega.cross_matrix());
        // Rates of the directors: omega x e_a and their rate relative to the frame.
        let directors: Vec<Matrix3<f64>> = (0..n)
            .map(|i| {
                let (theta, rate) =
                    (self.vector(u, RowKind::Rotation, i), self.vector(&v.ud, RowKind::Rotation, i));
                let turn = |t: f64| Rotation3::new(theta + rate * t).into_inner();
                let size = rate.norm();
                let own = if size > 0.0 { derivative(0.03 / size, turn) } else { Matrix3::zeros() };
                skew * turn(0.0) + own
            })
            .collect();
        // Velocities of the nodes relative to the centre of mass.
        let relative: Vec<Vector3<f64>> = (0..n)
            .map(|i| {
                let place = self.positions[i] - self.centre + self.vector(u, RowKind::Displacement, i);
                w.cross(&place) + self.vector(&v.ud, RowKind::Displacement, i)
            })
            .collect();
        // Velocity of the centre of mass of the undeformed body.
        let flight = v.linear + w.cross(&self.centre);
        let of_block = |block: &Block| {
            let [p, q] = block.nodes;
            let (of_p, of_q) = (relative[p] + flight, relative[q] + flight);
            let turning = w + self.vector(&v.ud, RowKind::Rotation, q);
            0.5 * block.mean * of_p.dot(&of_q)
                + of_p.dot(&(directors[q] * block.moment))
                + 0.5 * (directors[p] * block.second * directors[q].transpose()).trace()
                + 0.5 * relative[p].dot(&(block.deviator * relative[q]))
                + relative[p].dot(&(block.symmetric * turning))
        };
        let rest = w.cross(&(self.first_moment + self.rest_momentum(u))) + self.rest_momentum(&v.ud);
        self.blocks.iter().map(of_block).sum::<f64>() + flight.dot(&rest)
    }

    /// Returns the derivative of T along a change of the velocities. `size` makes the change as large as the
    /// velocities: T is quadratic in them, so that the difference is exact.
    fn momentum(&self, u: &DVector<f64>, v: &Velocities, change: &Velocities, size: f64) -> f64 {
        0.5 * (self.kinetic(u, &v.plus(size, change)) - self.kinetic(u, &v.plus(-size, change))) / size
    }

    /// Returns dT/dV and dT/domega.
    pub fn momenta(&self, u: &DVector<f64>, v: &Velocities) -> (Vector3<f64>, Vector3<f64>) {
        let zero = || DVector::zeros(u.len());
        let along = |linear: Vector3<f64>, omega: Vector3<f64>, size: f64| {
            self.momentum(u, v, &Velocities { linear, omega, ud: zero() }, size)
        };
        let none = Vector3::zeros();
        (
            Vector3::from_fn(|k, _| along(Vector3::ith(k, 1.0), none, v.linear.norm())),
            Vector3::from_fn(|k, _| along(none, Vector3::ith(k, 1.0), v.omega.norm())),
        )
    }

    /// Returns p' + omega x p, h' + omega x h + V x p, and d/dt dT/du' - dT/du along `shapes` (N x k), where `rates`
    /// are the rates of the velocities.
    pub fn inertia_forces(
        &self,
        u: &DVector<f64>,
        v: &Velocities,
        rates: &Velocities,
        shapes: &Mat<f64>,
        step: f64,
    ) -> (Vector3<f64>, Vector3<f64>, DVector<f64>) {
        let at = |t: f64| (u + &v.ud * t + &rates.ud * (0.5 * t * t), v.plus(t, rates));
        let (p, h) = self.momenta(u, v);
        let p_rate = derivative(step, |t| {
            let (u, v) = at(t);
            self.momenta(&u, &v).0
        });
        let h_rate = derivative(step, |t| {
            let (u, v) = at(t);
            self.momenta(&u, &v).1
        });
        let along = |j: usize| {
            let shape = DVector::from_fn(u.len(), |i, _| shapes[(i, j)]);
            let none = Vector3::zeros();
            let change = Velocities { linear: none, omega: none, ud: shape.clone() };
            let rate = derivative(step, |t| {
                let (u, v) = at(t);
                self.momentum(&u, &v, &change, v.ud.amax() / shape.amax())
            });
            rate - derivative(0.03 / shape.amax(), |s| self.kinetic(&(u + &shape * s), v))
        };
        let rows = DVector::from_fn(shapes.ncols(), |j, _| along(j));
        (p_rate + v.omega.cross(&p), h_rate + v.omega.cross(&h) + v.linear.cross(&p), rows)
    }
}
