//! Point masses on nodes that rotate: rigid regions, or masses on rigid arms, without matrices of rotations.

use super::equations::State;
use super::random::Random;
use super::turning::{dense, sparse};
use flexbody_model::{DofLabel, Nodes, RawModel};
use nalgebra::{DMatrix, DVector, Rotation3, Vector3};

/// Point at x + t + exp(theta~) r of a node with the displacement t and the rotation vector theta; nodes without
/// rotations have theta = 0.
#[derive(Debug, Clone, Copy)]
pub struct Attached {
    pub node: usize,
    pub arm: Vector3<f64>,
}

/// Points carried by nodes, with a mass matrix between the points that is the same along every axis.
pub struct Carriers {
    pub positions: Vec<[f64; 3]>,
    /// First row of the rotations of every node; `None` without rotations. Displacements of node i have the rows from 3
    /// i on.
    pub turning: Vec<Option<usize>>,
    pub points: Vec<Attached>,
    /// Mass matrix between the points (p x p).
    pub mass: DMatrix<f64>,
}

/// Motion at an instant: velocities and accelerations of the frame along its axes, displacements u and their rates.
pub struct Path<'a> {
    pub velocity: Vector3<f64>,
    pub omega: Vector3<f64>,
    pub linear: Vector3<f64>,
    pub angular: Vector3<f64>,
    pub u: &'a DVector<f64>,
    pub ud: &'a DVector<f64>,
    pub udd: &'a DVector<f64>,
}

impl Carriers {
    /// Creates nodes at `positions`. The nodes `turning` have three rotations each, in rows after all displacements.
    pub fn new(
        positions: Vec<[f64; 3]>,
        turning: &[usize],
        points: Vec<Attached>,
        mass: DMatrix<f64>,
    ) -> Self {
        let first = 3 * positions.len();
        let row = |i: usize| turning.iter().position(|&node| node == i).map(|at| first + 3 * at);
        Self { turning: (0..positions.len()).map(row).collect(), positions, points, mass }
    }

    pub fn rows(&self) -> usize {
        3 * (self.positions.len() + self.turning.iter().flatten().count())
    }

    fn vector(x: &DVector<f64>, row: usize) -> Vector3<f64> {
        x.fixed_rows::<3>(row).into_owned()
    }

    /// Returns the positions of the points relative to `origin`, in the frame, at the displacements u.
    pub fn places(&self, origin: &Vector3<f64>, u: &DVector<f64>) -> Vec<Vector3<f64>> {
        let place = |point: &Attached| {
            let turn = self.turning[point.node].map_or_else(Vector3::zeros, |row| Self::vector(u, row));
            let arm = Rotation3::new(turn) * point.arm;
            Vector3::from(self.positions[point.node]) + Self::vector(u, 3 * point.node) + arm - origin
        };
        self.points.iter().map(place).collect()
    }

    /// Returns the derivative of the positions along a direction, by differences of sixth order.
    fn derivative(&self, u: &DVector<f64>, along: &DVector<f64>, step: f64) -> Vec<Vector3<f64>> {
        let at = |h: f64| self.places(&Vector3::zeros(), &(u + along * (h * step)));
        let pairs = [1.0, 2.0, 3.0].map(|k| (at(k), at(-k)));
        let of_point = |i: usize| {
            let [a, b, c] = pairs.each_ref().map(|(after, before)| after[i] - before[i]);
            (a * 45.0 - b * 9.0 + c) / (60.0 * step)
        };
        (0..self.points.len()).map(of_point).collect()
    }

    /// Returns the second derivative of the positions along the path u + u' t + u'' t^2 / 2, by differences of sixth
    /// order.
    fn second_derivative(&self, path: &Path<'_>, step: f64) -> Vec<Vector3<f64>> {
        let at = |k: f64| {
            let t = k * step;
            self.places(&Vector3::zeros(), &(path.u + path.ud * t + path.udd * (0.5 * t * t)))
        };
        let (middle, pairs) = (at(0.0), [1.0, 2.0, 3.0].map(|k| (at(k), at(-k))));
        let of_point = |i: usize| {
            let [a, b, c] = pairs.each_ref().map(|(after, before)| after[i] + before[i]);
            (a * 270.0 - b * 27.0 + c * 2.0 - middle[i] * 490.0) / (180.0 * step * step)
        };
        (0..self.points.len()).map(of_point).collect()
    }

    /// Returns the velocities of the points along the axes of the frame.
    fn velocities(&self, origin: &Vector3<f64>, path: &Path<'_>, step: f64) -> Vec<Vector3<f64>> {
        let places = self.places(origin, path.u);
        let relative = self.derivative(path.u, path.ud, step);
        places.iter().zip(relative).map(|(y, yd)| path.velocity + path.omega.cross(y) + yd).collect()
    }

    /// Returns the products of the mass matrix with vectors of the points.
    fn weighted(&self, x: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        (0..x.len()).map(|i| (0..x.len()).map(|j| x[j] * self.mass[(i, j)]).sum()).collect()
    }

    /// Returns kinetic energy, linear momentum and angular momentum about the origin of the frame.
    pub fn momenta(
        &self,
        origin: &Vector3<f64>,
        path: &Path<'_>,
        step: f64,
    ) -> (f64, Vector3<f64>, Vector3<f64>) {
        let v = self.velocities(origin, path, step);
        let momentum = self.weighted(&v);
        let energy = 0.5 * v.iter().zip(&momentum).map(|(v, p)| v.dot(p)).sum::<f64>();
        let places = self.places(origin, path.u);
        let angular = places.iter().zip(&momentum).map(|(y, p)| y.cross(p)).sum();
        (energy, momentum.iter().sum(), angular)
    }

    /// Returns the inertia forces of d'Alembert: force and torque on the frame about its origin, and forces on all
    /// rows.
    pub fn inertia_forces(
        &self,
        origin: &Vector3<f64>,
        path: &Path<'_>,
        step: f64,
    ) -> (Vector3<f64>, Vector3<f64>, DVector<f64>) {
        let (places, yd) = (self.places(origin, path.u), self.derivative(path.u, path.ud, step));
        let (w, ydd) = (path.omega, self.second_derivative(path, step));
        // Acceleration in a moving frame: of the origin, Euler, centripetal, Coriolis and relative.
        let accelerations: Vec<Vector3<f64>> = (0..places.len())
            .map(|i| {
                path.linear
                    + w.cross(&path.velocity)
                    + path.angular.cross(&places[i])
                    + w.cross(&w.cross(&places[i]))
                    + w.cross(&yd[i]) * 2.0
                    + ydd[i]
            })
            .collect();
        let forces = self.weighted(&accelerations);
        let rows = self.onto_rows(path.u, &forces, step);
        let torque = places.iter().zip(&forces).map(|(y, f)| y.cross(f)).sum();
        (forces.iter().sum(), torque, rows)
    }

    /// Returns the forces on the rows that forces at the points cause: their power on every unit rate.
    pub fn onto_rows(&self, u: &DVector<f64>, forces: &[Vector3<f64>], step: f64) -> DVector<f64> {
        DVector::from_fn(self.rows(), |row, _| {
            let unit = DVector::from_fn(self.rows(), |i, _| f64::from(u8::from(i == row)));
            self.derivative(u, &unit, step).iter().zip(forces).map(|(y, f)| y.dot(f)).sum()
        })
    }

    /// Returns the forces of a uniform acceleration `b` on the points.
    pub fn weights(&self, b: &Vector3<f64>) -> Vec<Vector3<f64>> {
        self.weighted(&vec![*b; self.points.len()])
    }

    /// Returns the linear map from the displacements of all rows to those of all points (3 p x N).
    pub fn linear_map(&self) -> DMatrix<f64> {
        let mut map = DMatrix::zeros(3 * self.points.len(), self.rows());
        for (i, point) in self.points.iter().enumerate() {
            for k in 0..3 {
                map[(3 * i + k, 3 * point.node + k)] = 1.0;
                if let Some(row) = self.turning[point.node] {
                    let moved = Vector3::ith(k, 1.0).cross(&point.arm);
                    (0..3).for_each(|l| map[(3 * i + l, row + k)] = moved[l]);
                }
            }
        }
        map
    }

    /// Returns the model with the stiffness `k` of its rows, and the mass of the points.
    pub fn model(&self, name: &str, k: &DMatrix<f64>) -> RawModel {
        let map = self.linear_map();
        let mass = map.transpose() * self.mass.kronecker(&DMatrix::<f64>::identity(3, 3)) * &map;
        let ids: Vec<i64> = (1..=self.positions.len() as i64).collect();
        let of = |first: u8| {
            move |&node: &i64| (first..first + 3).map(move |direction| DofLabel { node, direction })
        };
        let mut dofs: Vec<DofLabel> = ids.iter().flat_map(of(1)).collect();
        let turning: Vec<i64> =
            ids.iter().zip(&self.turning).filter(|(_, row)| row.is_some()).map(|(id, _)| *id).collect();
        dofs.extend(turning.iter().flat_map(of(4)));
        let nodes = Nodes { ids, positions: self.positions.clone() };
        RawModel {
            dofs: Some(dofs),
            ..RawModel::in_memory(name, sparse(&symmetric(k)), sparse(&symmetric(&mass)), nodes)
        }
    }
}

/// Returns the symmetric part of a matrix: products round differently on both sides of the diagonal.
fn symmetric(a: &DMatrix<f64>) -> DMatrix<f64> {
    (a + a.transpose()) * 0.5
}

/// Returns a solid with a rigid region: the nodes of `region` of a solid with the stiffness `k` (3n) and the mass
/// `mass` (n) follow a new last node at `reference`.
pub fn rigid_region(
    positions: &[[f64; 3]],
    region: &[usize],
    reference: [f64; 3],
    mass: &DMatrix<f64>,
    k: &DMatrix<f64>,
) -> (Carriers, DMatrix<f64>) {
    let free: Vec<usize> = (0..positions.len()).filter(|i| !region.contains(i)).collect();
    let mut own: Vec<[f64; 3]> = free.iter().map(|&i| positions[i]).collect();
    own.push(reference);
    let last = free.len();
    let attached = |i: usize| match free.iter().position(|&node| node == i) {
        Some(node) => Attached { node, arm: Vector3::zeros() },
        None => Attached { node: last, arm: Vector3::from(positions[i]) - Vector3::from(reference) },
    };
    let points = (0..positions.len()).map(attached).collect();
    let carriers = Carriers::new(own, &[last], points, mass.clone());
    let map = carriers.linear_map();
    let stiffness = map.transpose() * k * &map;
    (carriers, stiffness)
}

/// Returns beams without rotational mass, in which each node carries three masses on rigid arms in arbitrary directions
/// instead of the mass of the beams.
pub fn masses_on_beams(beams: &RawModel, seed: u64) -> (Carriers, RawModel) {
    let mut random = Random(seed);
    let positions = beams.nodes.positions.clone();
    let n = positions.len();
    // The rows of the beams are node by node; displacements come first here.
    let k = dense(&beams.stiffness.matrix);
    let row = |i: usize| match i.checked_sub(3 * n) {
        None => 6 * (i / 3) + i % 3,
        Some(at) => 6 * (at / 3) + 3 + at % 3,
    };
    let k = DMatrix::from_fn(6 * n, 6 * n, |i, j| k[(row(i), row(j))]);
    let attached = |i: usize| Attached { node: i / 3, arm: Vector3::from(random.vector::<3>()) * 0.2 };
    let points: Vec<Attached> = (0..3 * n).map(attached).collect();
    let masses = DVector::from_fn(points.len(), |_, _| 0.01 * (1.5 + random.signed()));
    let all: Vec<usize> = (0..n).collect();
    let carriers = Carriers::new(positions, &all, points, DMatrix::from_diagonal(&masses));
    let model = carriers.model("masses on arms", &k);
    (carriers, model)
}

/// Returns the motion of a state of the oracle along the axes of the frame, with accelerations.
pub fn path<'a>(
    state: &State,
    (u, ud, udd): (&'a DVector<f64>, &'a DVector<f64>, &'a DVector<f64>),
    (linear, angular): (Vector3<f64>, Vector3<f64>),
) -> Path<'a> {
    let velocity = state.axes.transpose() * state.velocity;
    Path { velocity, omega: state.omega, linear, angular, u, ud, udd }
}
