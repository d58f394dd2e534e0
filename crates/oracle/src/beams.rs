//! Small frames of beams: nodes with three displacements and three rotations.

use crate::random::Random;
use faer::Mat;
use flexbody_linalg::CscMatrix;
use flexbody_model::{DofLabel, Nodes, RawModel};
use nalgebra::{Matrix3, Vector3};

/// Distribution of the mass of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BeamMass {
    /// Consistent mass of cubic deflections, linear extension and twist.
    Consistent,
    /// Consistent mass with the rotary inertia of the sections.
    Rotary,
    /// Lumped mass: half of every beam at each of its nodes, nothing on the rotations.
    Lumped,
    /// Lumped mass with the inertia of half a beam on the rotations of its nodes, equal about all axes.
    LumpedRotary,
}

/// Young's modulus of [`shaft`], whose density is 1.
pub const SHAFT_YOUNGS: f64 = 4.0;

/// Square section of Euler-Bernoulli beams.
struct Section {
    width: f64,
    youngs: f64,
    shear: f64,
    density: f64,
}

/// Returns a star of six short rubber beams that meet in one node, with three nodes at either end along x.
pub fn star(mass: BeamMass) -> RawModel {
    let positions: [[f64; 3]; 7] = [
        [0.0, 0.0, 0.0],
        [0.0, 0.5, 0.1],
        [0.05, 0.2, 0.4],
        [0.5, 0.22, 0.12],
        [1.0, 0.05, 0.0],
        [0.95, 0.45, 0.05],
        [1.0, 0.25, 0.35],
    ];
    let beams = [(0, 3), (1, 3), (2, 3), (3, 4), (3, 5), (3, 6)];
    let section = Section { width: 0.2, youngs: 4.0, shear: 1.5, density: 1.0 };
    frame("star of beams", &positions, &beams, &section, mass)
}

/// Returns a tube of unit radius around z, with consistent mass: rings of `around` beams at distances of 0.5, and axial
/// beams between them. Returns also the eigenvalue of its rings in their planes with two waves around the
/// circumference, in which the axial beams move without deformation (Blevins, Formulas for Natural Frequency and Mode
/// Shape, table 9-2).
pub fn tube(around: usize, rings: usize, width: f64) -> (RawModel, f64) {
    const APART: f64 = 0.5;
    let angle = |i: usize| std::f64::consts::TAU * i as f64 / around as f64;
    let node = |ring: usize, i: usize| ring * around + i % around;
    let places =
        |ring: usize| (0..around).map(move |i| [angle(i).cos(), angle(i).sin(), APART * ring as f64]);
    let positions: Vec<[f64; 3]> = (0..rings).flat_map(places).collect();
    let closed = |ring: usize| (0..around).map(move |i| (node(ring, i), node(ring, i + 1)));
    let along = |ring: usize| (0..around).map(move |i| (node(ring, i), node(ring + 1, i)));
    let beams: Vec<_> = (0..rings).flat_map(closed).chain((0..rings - 1).flat_map(along)).collect();
    let section = Section { width, youngs: 4.0, shear: 1.5, density: 1.0 };
    let of_rings = std::f64::consts::TAU * rings as f64;
    let part = of_rings / (of_rings + APART * (around * (rings - 1)) as f64);
    let first = part * 36.0 / 5.0 * section.youngs * width * width / 12.0;
    (frame("tube of beams", &positions, &beams, &section, BeamMass::Consistent), first)
}

/// Returns an elbow of two legs along no axis, each of `parts` consistent beams.
pub fn elbow(parts: usize) -> RawModel {
    let corners = [Vector3::new(0.1, -0.2, 0.3), Vector3::new(0.9, 0.5, 0.1), Vector3::new(1.1, 0.2, 0.9)];
    let along =
        |leg: usize, i: usize| corners[leg] + (corners[leg + 1] - corners[leg]) * (i as f64 / parts as f64);
    let positions: Vec<[f64; 3]> =
        (0..=2 * parts).map(|i| if i <= parts { along(0, i) } else { along(1, i - parts) }.into()).collect();
    chain("elbow of beams", &positions)
}

/// Returns a chain of consistent rubber beams through `positions`.
pub fn chain(name: &str, positions: &[[f64; 3]]) -> RawModel {
    let beams: Vec<_> = (1..positions.len()).map(|i| (i - 1, i)).collect();
    let section = Section { width: 0.05, youngs: 4.0, shear: 1.5, density: 1.0 };
    frame(name, positions, &beams, &section, BeamMass::Consistent)
}

/// Returns a straight shaft of unit length along x, of `parts` beams with rotary inertia and a square section of this
/// width.
pub fn shaft(parts: usize, width: f64) -> RawModel {
    let positions: Vec<[f64; 3]> = (0..=parts).map(|i| [i as f64 / parts as f64, 0.0, 0.0]).collect();
    let beams: Vec<_> = (0..parts).map(|i| (i, i + 1)).collect();
    let section = Section { width, youngs: SHAFT_YOUNGS, shear: 1.5, density: 1.0 };
    frame("shaft", &positions, &beams, &section, BeamMass::Rotary)
}

/// Returns a random tree of `count` nodes, each joined by a beam to the nearest node before it. In the plane z = 0 the
/// nodes have two displacements and the rotation about z.
pub fn tree(random: &mut Random, count: usize, is_plane: bool, mass: BeamMass) -> RawModel {
    let mut positions = vec![[0.0; 3]];
    let mut beams = Vec::new();
    while positions.len() < count {
        let [x, y, z] = random.vector::<3>();
        let place = Vector3::new(x, y, if is_plane { 0.0 } else { z }) * (count as f64).sqrt();
        let distance = |node: &usize| (Vector3::from(positions[*node]) - place).norm();
        let nearest =
            (0..positions.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).expect("a node");
        if distance(&nearest) > 0.2 {
            beams.push((nearest, positions.len()));
            positions.push(place.into());
        }
    }
    let section = Section { width: 0.05, youngs: 4.0, shear: 1.5, density: 1.0 };
    let raw = frame("tree of beams", &positions, &beams, &section, mass);
    if is_plane { in_plane(raw) } else { raw }
}

/// Returns the model with the displacements along x and y and the rotation about z alone.
fn in_plane(raw: RawModel) -> RawModel {
    let rows: Vec<u32> =
        (0..raw.stiffness.matrix.n_rows() as u32).filter(|row| [0, 1, 5].contains(&(row % 6))).collect();
    let place = |row: u32| rows.binary_search(&row).ok().map(|at| at as u32);
    let part = |a: &CscMatrix| {
        let entries = crate::mesh::entries(a).filter_map(|(i, j, v)| Some((place(i)?, place(j)?, v)));
        CscMatrix::from_triplets(rows.len(), rows.len(), &entries.collect::<Vec<_>>())
    };
    let (k, m) = (part(&raw.stiffness.matrix), part(&raw.mass.matrix));
    let labels = raw.dofs.as_ref().map(|all| rows.iter().map(|row| all[*row as usize]).collect());
    RawModel { dofs: labels, dimension: 2, ..RawModel::in_memory("plane tree of beams", k, m, raw.nodes) }
}

/// Returns the model of beams of one section between nodes.
fn frame(
    name: &str,
    positions: &[[f64; 3]],
    beams: &[(usize, usize)],
    section: &Section,
    mass: BeamMass,
) -> RawModel {
    let n = 6 * positions.len();
    let (mut k, mut m) = (Mat::<f64>::zeros(n, n), Mat::<f64>::zeros(n, n));
    for &(a, b) in beams {
        let ends = [a, b].map(|node| Vector3::from(positions[node]));
        let rows = |r: usize| if r < 6 { 6 * a + r } else { 6 * b + r - 6 };
        let (ke, me) = section.beam(ends, mass);
        for i in 0..12 {
            for j in 0..12 {
                k[(rows(i), rows(j))] += ke[(i, j)];
                m[(rows(i), rows(j))] += me[(i, j)];
            }
        }
    }
    let ids = (1..=positions.len() as i64).collect::<Vec<_>>();
    let labels = ids.iter().flat_map(|&node| (1..=6).map(move |direction| DofLabel { node, direction }));
    let dofs = Some(labels.collect());
    let nodes = Nodes { ids, positions: positions.to_vec() };
    RawModel { dofs, ..RawModel::in_memory(name, sparse(&k), sparse(&m), nodes) }
}

impl Section {
    /// Returns stiffness and mass (12 x 12) of a beam in the axes of the model.
    fn beam(&self, ends: [Vector3<f64>; 2], mass: BeamMass) -> (Mat<f64>, Mat<f64>) {
        let along = ends[1] - ends[0];
        let length = along.norm();
        let x = along / length;
        let aside = if x.z.abs() < 0.9 { Vector3::z() } else { Vector3::y() };
        let y = aside.cross(&x).normalize();
        let axes = Matrix3::from_columns(&[x, y, x.cross(&y)]);
        let turn = Mat::from_fn(12, 12, |i, j| if i / 3 == j / 3 { axes[(i % 3, j % 3)] } else { 0.0 });
        let m = match mass {
            BeamMass::Consistent => self.consistent(length),
            BeamMass::Rotary => self.consistent(length) + self.rotary(length),
            BeamMass::Lumped | BeamMass::LumpedRotary => {
                let half = 0.5 * self.density * self.width * self.width * length;
                let turning = if mass == BeamMass::Lumped { 0.0 } else { half * length * length / 12.0 };
                let of_row = |row: usize| if row % 6 < 3 { half } else { turning };
                Mat::from_fn(12, 12, |i, j| if i == j { of_row(i) } else { 0.0 })
            }
        };
        let turned = |a: Mat<f64>| &turn * a * turn.transpose();
        (turned(self.stiffness(length)), turned(m))
    }

    fn stiffness(&self, l: f64) -> Mat<f64> {
        let area = self.width * self.width;
        let bending = area * area / 12.0;
        let mut k = Mat::zeros(12, 12);
        add_bar(&mut k, 0, self.youngs * area / l, [1.0, -1.0]);
        add_bar(&mut k, 3, self.shear * 2.0 * bending / l, [1.0, -1.0]);
        let scale = self.youngs * bending / (l * l * l);
        add_bending(&mut k, l, scale, [12.0, 6.0, -12.0, 6.0, 4.0, -6.0, 2.0, 12.0, -6.0, 4.0]);
        k
    }

    /// Returns the rotary inertia of the sections about their transverse axes, with cubic deflections.
    fn rotary(&self, l: f64) -> Mat<f64> {
        let area = self.width * self.width;
        let mut m = Mat::zeros(12, 12);
        let scale = self.density * area * area / 12.0 / (30.0 * l);
        add_bending(&mut m, l, scale, [36.0, 3.0, -36.0, 3.0, 4.0, -3.0, -1.0, 36.0, -3.0, 4.0]);
        m
    }

    fn consistent(&self, l: f64) -> Mat<f64> {
        let area = self.width * self.width;
        let mass = self.density * area * l;
        let polar = area / 6.0;
        let mut m = Mat::zeros(12, 12);
        add_bar(&mut m, 0, mass / 6.0, [2.0, 1.0]);
        add_bar(&mut m, 3, mass * polar / 6.0, [2.0, 1.0]);
        add_bending(&mut m, l, mass / 420.0, [156.0, 22.0, 54.0, -13.0, 4.0, 13.0, -3.0, 156.0, -22.0, 4.0]);
        m
    }
}

/// Adds a bar along one direction, with the entries `diagonal` of each end and `coupling` between the ends.
fn add_bar(a: &mut Mat<f64>, at: usize, scale: f64, [diagonal, coupling]: [f64; 2]) {
    for (i, j, value) in [(0, 0, diagonal), (6, 6, diagonal), (0, 6, coupling), (6, 0, coupling)] {
        a[(at + i, at + j)] += scale * value;
    }
}

/// Adds bending in both planes; `upper` holds the rows of the upper triangle for (v, l v') of either end.
fn add_bending(a: &mut Mat<f64>, l: f64, scale: f64, upper: [f64; 10]) {
    // A positive rotation about y lowers the deflection along z.
    for (rows, slope) in [([1, 5, 7, 11], l), ([2, 4, 8, 10], -l)] {
        let factor = [1.0, slope, 1.0, slope];
        let mut values = upper.iter();
        for i in 0..4 {
            for j in i..4 {
                let value = scale * factor[i] * factor[j] * values.next().expect("ten of them");
                a[(rows[i], rows[j])] += value;
                if i != j {
                    a[(rows[j], rows[i])] += value;
                }
            }
        }
    }
}

fn sparse(a: &Mat<f64>) -> CscMatrix {
    let entries = (0..a.ncols()).flat_map(|j| (0..a.nrows()).map(move |i| (i as u32, j as u32, a[(i, j)])));
    CscMatrix::from_triplets(a.nrows(), a.ncols(), &entries.filter(|e| e.2 != 0.0).collect::<Vec<_>>())
}
