//! Sheets whose elements are not quite coplanar: rotations about the normal have a stiffness of the square of the
//! angles between elements.

use super::turning;
use flexbody_model::{DofLabel, Nodes, RawModel};
use nalgebra::{DMatrix, DVector, Rotation3, Vector3};

/// Sheet of bars with out-of-plane bending and torsion along edges and diagonals of a grid of nodes; each bar has
/// a normal of its own, and bends about the direction across it.
pub struct Sheet {
    /// Positions of the nodes.
    pub places: Vec<Vector3<f64>>,
    /// Stiffness; rows node by node, displacements before rotations.
    pub k: DMatrix<f64>,
    /// Mass; rotations have none.
    pub m: DMatrix<f64>,
}

/// Number of nodes along x and along y.
const GRID: [usize; 2] = [5, 3];

/// Repeatable numbers between -1 and 1.
fn scatter(seed: usize) -> f64 {
    ((seed * 7919 + 104_729) % 2003) as f64 / 1001.0 - 1.0
}

impl Sheet {
    /// Returns the sheet whose bars have normals tilted by up to `angle` in radians, and a stiffness `inplane`
    /// of bending in the plane relative to that out of it.
    pub fn new(angle: f64, inplane: f64) -> Self {
        let [nx, ny] = GRID;
        let at = |i: usize, j: usize| nx * j + i;
        let places: Vec<Vector3<f64>> = (0..nx * ny)
            .map(|node| {
                let (i, j) = ((node % nx) as f64, (node / nx) as f64);
                Vector3::new(0.1 * i + 0.01 * j * j, 0.12 * j - 0.015 * i, 0.0)
            })
            .collect();
        let mut edges = Vec::new();
        for (i, j) in (0..nx).flat_map(|i| (0..ny).map(move |j| (i, j))) {
            edges.extend((i + 1 < nx).then(|| (at(i, j), at(i + 1, j))));
            edges.extend((j + 1 < ny).then(|| (at(i, j), at(i, j + 1))));
            edges.extend((i + 1 < nx && j + 1 < ny).then(|| (at(i, j), at(i + 1, j + 1))));
        }
        let n = 6 * places.len();
        let mut sheet = Self { places, k: DMatrix::zeros(n, n), m: DMatrix::zeros(n, n) };
        for (seed, &(a, b)) in edges.iter().enumerate() {
            let along = (sheet.places[b] - sheet.places[a]).normalize();
            let tilt = along * (angle * scatter(seed));
            let normal = Rotation3::new(tilt) * Vector3::z();
            let length = (sheet.places[b] - sheet.places[a]).norm();
            sheet.add(2e7 / length, &sheet.difference((a, b), 0, &along));
            sheet.add(90.0 / length, &sheet.difference((a, b), 3, &along));
            sheet.bend((a, b), 150.0 / length, &along, &normal);
            sheet.bend((a, b), 150.0 * inplane / length, &along, &along.cross(&normal));
            for node in [a, b] {
                (0..3).for_each(|axis| sheet.m[(6 * node + axis, 6 * node + axis)] += 0.4 * length);
            }
        }
        sheet
    }

    fn add(&mut self, stiffness: f64, row: &DVector<f64>) {
        self.k += stiffness * row * row.transpose();
    }

    /// Returns the displacement (`from` 0) or rotation (`from` 3) of a node along a direction, as a row.
    fn part(&self, node: usize, from: usize, direction: &Vector3<f64>) -> DVector<f64> {
        let mut row = DVector::zeros(self.k.nrows());
        (0..3).for_each(|axis| row[6 * node + from + axis] = direction[axis]);
        row
    }

    fn difference(&self, (a, b): (usize, usize), from: usize, direction: &Vector3<f64>) -> DVector<f64> {
        self.part(b, from, direction) - self.part(a, from, direction)
    }

    /// Adds bending with deflections along `normal`, with slopes relative to the chord.
    fn bend(&mut self, (a, b): (usize, usize), size: f64, along: &Vector3<f64>, normal: &Vector3<f64>) {
        let across = normal.cross(along);
        let length = (self.places[b] - self.places[a]).norm();
        let chord = self.difference((a, b), 0, normal) / length;
        let slopes = [a, b].map(|node| -self.part(node, 3, &across) - &chord);
        self.add(2.0 * size, &(&slopes[0] + &slopes[1]));
        slopes.iter().for_each(|slope| self.add(2.0 * size, slope));
    }

    /// Returns the model turned by `rotation`, with lengths multiplied by `scale` (the unit of force stays), and
    /// nodes in the order of `order`.
    pub fn raw(&self, rotation: &Rotation3<f64>, scale: f64, order: &[usize]) -> RawModel {
        let n = self.k.nrows();
        let mut all = DMatrix::zeros(n, n);
        for (to, &node) in order.iter().enumerate() {
            for from in [0, 3] {
                let size = if from == 0 { 1.0 / scale } else { 1.0 };
                let block = size * rotation.matrix();
                all.view_mut((6 * to + from, 6 * node + from), (3, 3)).copy_from(&block);
            }
        }
        let sparse = |matrix: &DMatrix<f64>, size: f64| {
            let matrix = size * &all * matrix * all.transpose();
            let matrix = 0.5 * (&matrix + matrix.transpose());
            turning::sparse(&matrix)
        };
        let nodes = Nodes {
            ids: order.iter().map(|&node| node as i64 + 1).collect(),
            positions: order.iter().map(|&node| (rotation * self.places[node] * scale).into()).collect(),
        };
        let labels =
            nodes.ids.iter().flat_map(|&node| (1..=6).map(move |direction| DofLabel { node, direction }));
        let dofs = Some(labels.collect());
        // Energy per length^2 of displacements: the factor 1 / scale^2 is in the transformation.
        let (k, m) = (sparse(&self.k, scale), sparse(&self.m, scale));
        RawModel { dofs, ..RawModel::in_memory("sheet", k, m, nodes) }
    }

    /// Returns the model in its own axes, units and order.
    pub fn plain(&self) -> RawModel {
        self.raw(&Rotation3::identity(), 1.0, &self.order())
    }

    /// Returns the indices of the nodes.
    pub fn order(&self) -> Vec<usize> {
        (0..self.places.len()).collect()
    }

    /// Returns the flexible eigenvalues by dense algebra, without the massless rows: all rotations, or all but
    /// those about z.
    ///
    /// # Panics
    /// Panics if the rotations are not held.
    pub fn dense(&self, with_normal: bool) -> Vec<f64> {
        let rows = 0..self.k.nrows();
        let (moving, turning): (Vec<usize>, Vec<usize>) =
            rows.filter(|row| with_normal || row % 6 != 5).partition(|row| row % 6 < 3);
        let block =
            |a: &[usize], b: &[usize]| DMatrix::from_fn(a.len(), b.len(), |i, j| self.k[(a[i], b[j])]);
        let inverse = block(&turning, &turning).cholesky().expect("rotations are held");
        let coupling = block(&turning, &moving);
        let condensed = block(&moving, &moving) - coupling.transpose() * inverse.solve(&coupling);
        let root: Vec<f64> = moving.iter().map(|&row| self.m[(row, row)].sqrt()).collect();
        let n = moving.len();
        let scaled = DMatrix::from_fn(n, n, |i, j| condensed[(i, j)] / root[i] / root[j]);
        let mut values: Vec<f64> = scaled.symmetric_eigen().eigenvalues.iter().copied().collect();
        values.sort_by(f64::total_cmp);
        values.split_off(6)
    }
}
