//! Meshes on an integer lattice and their assembled matrices.
//!
//! A mesh is a set of unit cells and a map from lattice coordinates to space. Nodes sit on the half-integer lattice, so
//! that mid-edge nodes are shared without a search. Cells that touch are connected.

use super::elements::{ElementKind, MassRule, Material, TET_EDGES};
use flexbody_linalg::CscMatrix;
use flexbody_model::{ModelRecovery, Nodes, Quantity, RawModel, RecoveryOperator, RecoveryRow};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Nodes and elements.
#[derive(Debug, Clone)]
pub struct Mesh {
    pub nodes: Vec<[f64; 3]>,
    pub elements: Vec<(ElementKind, Vec<usize>)>,
}

/// Matrices of a mesh, node-major x, y, z.
#[derive(Debug, Clone)]
pub struct Assembly {
    pub nodes: Vec<[f64; 3]>,
    /// Stiffness matrix K (3n x 3n).
    pub stiffness: CscMatrix,
    /// Scalar mass matrix Ms (n x n), with M = Ms kron I3.
    pub scalar_mass: CscMatrix,
}

impl Mesh {
    /// Creates the mesh of the unit cells with lower corners `cells`, as elements `kind` (tetrahedra: six per cell),
    /// mapped to space.
    ///
    /// Tetrahedra stay straight under any map: their mid-edge nodes lie half way between the mapped corners.
    pub fn from_cells(kind: ElementKind, cells: &[[i32; 3]], map: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        let elements: Vec<Vec<[i32; 3]>> =
            cells.iter().flat_map(|c| cell_elements(kind, c.map(|v| 2 * v))).collect();
        // Nodes are ordered by z, then y, then x: thin meshes along x keep neighbours close.
        let mut numbers: BTreeMap<[i32; 3], usize> =
            elements.iter().flatten().map(|p| ([p[2], p[1], p[0]], 0)).collect();
        numbers.values_mut().enumerate().for_each(|(i, number)| *number = i);
        let mut nodes: Vec<[f64; 3]> =
            numbers.keys().map(|&[z, y, x]| map([x, y, z].map(|v| 0.5 * f64::from(v)))).collect();
        let number = |p: &[i32; 3]| numbers[&[p[2], p[1], p[0]]];
        let elements: Vec<_> = elements.iter().map(|e| (kind, e.iter().map(number).collect())).collect();
        if kind == ElementKind::Tet10 {
            straighten(&mut nodes, &elements);
        }
        Self { nodes, elements }
    }

    /// Returns a block of `cells` with one corner at the origin.
    pub fn block(kind: ElementKind, cells: [i32; 3], size: [f64; 3]) -> Self {
        let map = |p: [f64; 3]| std::array::from_fn(|k| size[k] * p[k] / f64::from(cells[k]));
        Self::from_cells(kind, &grid(cells), map)
    }

    /// Returns a ball about the origin of 2n x 2n x 2n hexahedra. The mesh has the symmetry of the cube.
    pub fn ball(kind: ElementKind, n: i32, radius: f64) -> Self {
        Self::from_cells(kind, &grid([2 * n; 3]), |p| {
            let [x, y, z] = p.map(|v| v / f64::from(n) - 1.0);
            let (xx, yy, zz) = (x * x, y * y, z * z);
            // The map takes the cube [-1, 1]^3 to the unit ball, and its faces to the sphere.
            [
                radius * x * (1.0 - yy / 2.0 - zz / 2.0 + yy * zz / 3.0).sqrt(),
                radius * y * (1.0 - zz / 2.0 - xx / 2.0 + zz * xx / 3.0).sqrt(),
                radius * z * (1.0 - xx / 2.0 - yy / 2.0 + xx * yy / 3.0).sqrt(),
            ]
        })
    }

    /// Returns a cylinder about the z axis, of 2n x 2n hexahedra over the section and `layers` along it. The mesh has
    /// four-fold symmetry.
    pub fn cylinder(kind: ElementKind, n: i32, layers: i32, radius: f64, length: f64) -> Self {
        Self::from_cells(kind, &grid([2 * n, 2 * n, layers]), |p| {
            let (x, y) = (p[0] / f64::from(n) - 1.0, p[1] / f64::from(n) - 1.0);
            [
                radius * x * (1.0 - y * y / 2.0).sqrt(),
                radius * y * (1.0 - x * x / 2.0).sqrt(),
                length * p[2] / f64::from(layers),
            ]
        })
    }

    /// Returns a ring about the z axis of `around` hexahedra, with a square section of the given side.
    pub fn ring(kind: ElementKind, around: i32, radius: f64, side: f64) -> Self {
        let mesh = Self::from_cells(kind, &grid([1, around, 1]), |[r, t, z]| {
            let angle = std::f64::consts::TAU * t / f64::from(around);
            let radius = radius + side * (r - 0.5);
            [radius * angle.cos(), radius * angle.sin(), side * z]
        });
        mesh.welded(1e-9 * radius)
    }

    /// Returns the mesh with nodes closer than `distance` merged.
    pub fn welded(self, distance: f64) -> Self {
        let (mut nodes, mut numbers) = (Vec::<[f64; 3]>::new(), Vec::new());
        for x in &self.nodes {
            let near = |y: &[f64; 3]| (Vector3::from(*x) - Vector3::from(*y)).norm() < distance;
            numbers.push(nodes.iter().position(near).unwrap_or_else(|| {
                nodes.push(*x);
                nodes.len() - 1
            }));
        }
        let renumbered = |list: Vec<usize>| list.into_iter().map(|i| numbers[i]).collect();
        let elements = self.elements.into_iter().map(|(kind, list)| (kind, renumbered(list))).collect();
        Self { nodes, elements }
    }

    /// Returns an L-shaped bracket of cubes: `arm` cells along x and along z, `width` along y, two cells thick.
    pub fn bracket(kind: ElementKind, arm: i32, width: i32, cell: f64) -> Self {
        let cells: Vec<_> = grid([arm, width, arm]).into_iter().filter(|c| c[0] < 2 || c[2] < 2).collect();
        Self::from_cells(kind, &cells, |p| p.map(|v| cell * v))
    }

    /// Returns two blocks of n x n x n unit cells that share only the nodes of one edge: a hinge.
    pub fn hinge(kind: ElementKind, n: i32) -> Self {
        let mut cells = grid([n; 3]);
        cells.extend(grid([n; 3]).iter().map(|c| [c[0] + n, c[1] + n, c[2]]));
        Self::from_cells(kind, &cells, |p| p)
    }

    /// Returns two blocks of n x n x n unit cells with a gap between them.
    pub fn two_bodies(kind: ElementKind, n: i32) -> Self {
        let mut cells = grid([n; 3]);
        cells.extend(grid([n; 3]).iter().map(|c| [c[0] + n + 1, c[1], c[2]]));
        Self::from_cells(kind, &cells, |p| p)
    }

    /// Returns the mesh of the elements whose first node fulfils `kept`, with all nodes.
    pub fn part(&self, kept: impl Fn([f64; 3]) -> bool) -> Self {
        let elements =
            self.elements.iter().filter(|(_, nodes)| kept(self.nodes[nodes[0]])).cloned().collect();
        Self { nodes: self.nodes.clone(), elements }
    }

    /// Returns the mesh at x' = R x + d.
    pub fn moved(&self, rotation: &Matrix3<f64>, shift: [f64; 3]) -> Self {
        let place = |x: &[f64; 3]| (rotation * Vector3::from(*x) + Vector3::from(shift)).into();
        Self { nodes: self.nodes.iter().map(place).collect(), elements: self.elements.clone() }
    }

    pub fn assemble(&self, material: &Material, rule: MassRule) -> Assembly {
        let n = self.nodes.len();
        let (mut stiffness, mut mass) = (Vec::new(), Vec::new());
        for (kind, nodes) in &self.elements {
            let positions: Vec<_> = nodes.iter().map(|&i| self.nodes[i]).collect();
            let (ke, me) = kind.matrices(&positions, material, rule);
            let m = nodes.len();
            for (a, &na) in nodes.iter().enumerate() {
                for (b, &nb) in nodes.iter().enumerate() {
                    mass.push((na as u32, nb as u32, me[a * m + b]));
                    for i in 0..3 {
                        for j in 0..3 {
                            let value = ke[(3 * a + i) * 3 * m + 3 * b + j];
                            stiffness.push(((3 * na + i) as u32, (3 * nb + j) as u32, value));
                        }
                    }
                }
            }
        }
        Assembly {
            nodes: self.nodes.clone(),
            stiffness: CscMatrix::from_triplets(3 * n, 3 * n, &stiffness),
            scalar_mass: CscMatrix::from_triplets(n, n, &mass),
        }
    }
}

impl Mesh {
    /// Returns the geometric stiffness (3n x 3n) of the stress that the displacements `moved` (3n) cause.
    pub fn geometric_stiffness(&self, material: &Material, moved: &[f64]) -> CscMatrix {
        let mut all = Vec::new();
        for (kind, nodes) in &self.elements {
            let positions: Vec<_> = nodes.iter().map(|&i| self.nodes[i]).collect();
            let own: Vec<_> = nodes.iter().map(|&i| [0, 1, 2].map(|k| moved[3 * i + k])).collect();
            let ke = kind.geometric_stiffness(&positions, &own, material);
            for (a, &na) in nodes.iter().enumerate() {
                for (b, &nb) in nodes.iter().enumerate() {
                    let value = ke[a * nodes.len() + b];
                    all.extend((0..3).map(|k| ((3 * na + k) as u32, (3 * nb + k) as u32, value)));
                }
            }
        }
        CscMatrix::from_triplets(3 * self.nodes.len(), 3 * self.nodes.len(), &all)
    }
}

impl Mesh {
    /// Returns the transpose of the operator of the stresses at all quadrature points (3n x 6 per point), with the
    /// labels of its rows.
    pub fn stress_operator(&self, material: &Material) -> (CscMatrix, Vec<RecoveryRow>) {
        let (mut all, mut labels) = (Vec::new(), Vec::new());
        for (e, (kind, nodes)) in self.elements.iter().enumerate() {
            let positions: Vec<_> = nodes.iter().map(|&i| self.nodes[i]).collect();
            for (r, row) in kind.stresses(&positions, material).into_iter().enumerate() {
                let component = ["xx", "yy", "zz", "xy", "yz", "xz"][r % 6];
                let column = labels.len() as u32;
                let at = |(c, value): (usize, f64)| ((3 * nodes[c / 3] + c % 3) as u32, column, value);
                all.extend(row.into_iter().enumerate().map(at));
                labels.push(RecoveryRow {
                    name: format!("{} {} {component}", e + 1, r / 6 + 1),
                    quantity: Quantity::Stress,
                    component: component.to_owned(),
                    unit: "Pa".to_owned(),
                    node: None,
                    element: Some(e as i64 + 1),
                });
            }
        }
        (CscMatrix::from_triplets(3 * self.nodes.len(), labels.len(), &all), labels)
    }

    /// Returns the recovery of these stresses.
    pub fn stresses(&self, material: &Material) -> ModelRecovery {
        let (transposed, labels) = self.stress_operator(material);
        let operator = RecoveryOperator::Rows { transposed, labels, offset: None };
        ModelRecovery { name: "stress".to_owned(), operator, path: PathBuf::new(), deformed_inertia: false }
    }
}

impl Assembly {
    /// Returns the sum of two bodies on the same nodes: a body with parts of different material.
    pub fn plus(&self, other: &Self) -> Self {
        assert_eq!(self.nodes, other.nodes, "bodies on the same nodes");
        let sum = |a: &CscMatrix, b: &CscMatrix| {
            let all: Vec<_> = entries(a).chain(entries(b)).collect();
            CscMatrix::from_triplets(a.n_rows(), a.n_cols(), &all)
        };
        Self {
            nodes: self.nodes.clone(),
            stiffness: sum(&self.stiffness, &other.stiffness),
            scalar_mass: sum(&self.scalar_mass, &other.scalar_mass),
        }
    }

    pub fn n_dofs(&self) -> usize {
        3 * self.nodes.len()
    }

    /// Returns M = Ms kron I3 (3n x 3n).
    pub fn mass(&self) -> CscMatrix {
        let ms = &self.scalar_mass;
        let triplets: Vec<_> =
            entries(ms).flat_map(|(r, c, v)| (0..3).map(move |k| (3 * r + k, 3 * c + k, v))).collect();
        CscMatrix::from_triplets(self.n_dofs(), self.n_dofs(), &triplets)
    }

    /// Returns the body with row-sum lumped mass.
    pub fn with_lumped_mass(&self) -> Self {
        let mut sums = vec![0.0; self.nodes.len()];
        entries(&self.scalar_mass).for_each(|(row, _, value)| sums[row as usize] += value);
        let diagonal: Vec<_> = sums.iter().enumerate().map(|(i, m)| (i as u32, i as u32, *m)).collect();
        let scalar_mass = CscMatrix::from_triplets(sums.len(), sums.len(), &diagonal);
        Self { scalar_mass, ..self.clone() }
    }

    /// Returns the model with node numbers 1, 2, ... and node-major rows without labels.
    pub fn raw_model(&self) -> RawModel {
        let nodes = Nodes { ids: (1..=self.nodes.len() as i64).collect(), positions: self.nodes.clone() };
        RawModel::in_memory("test body", self.stiffness.clone(), self.mass(), nodes)
    }
}

/// Returns row, column and value of every stored entry, column by column.
pub fn entries(matrix: &CscMatrix) -> impl Iterator<Item = (u32, u32, f64)> + '_ {
    matrix.triplets()
}

/// Returns the lower corners of the cells of a grid.
pub fn grid(cells: [i32; 3]) -> Vec<[i32; 3]> {
    let mut all = Vec::new();
    for z in 0..cells[2] {
        for y in 0..cells[1] {
            all.extend((0..cells[0]).map(|x| [x, y, z]));
        }
    }
    all
}

/// Returns the nodes of the elements of one cell, on the half-integer lattice (coordinates doubled).
fn cell_elements(kind: ElementKind, corner: [i32; 3]) -> Vec<Vec<[i32; 3]>> {
    let at = |offset: [i32; 3]| -> [i32; 3] { std::array::from_fn(|k| corner[k] + offset[k]) };
    match kind {
        ElementKind::Hex8 | ElementKind::Hex20 => {
            vec![kind.hex_signs().iter().map(|s| at(s.map(|v| v + 1))).collect()]
        }
        // Kuhn's six tetrahedra around the main diagonal: one per order of the axes, alike in every cell.
        ElementKind::Tet4 | ElementKind::Tet10 => {
            [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]]
                .iter()
                .enumerate()
                .map(|(i, axes)| {
                    let mut corners = vec![[0; 3]];
                    for &axis in axes {
                        let mut next = corners[corners.len() - 1];
                        next[axis] = 2;
                        corners.push(next);
                    }
                    if i >= 3 {
                        corners.swap(1, 2); // odd orders of the axes give mirrored tetrahedra
                    }
                    let middle = |&(a, b): &(usize, usize)| -> [i32; 3] {
                        std::array::from_fn(|k| (corners[a][k] + corners[b][k]) / 2)
                    };
                    let middles: Vec<_> = TET_EDGES.iter().map(middle).collect();
                    let n_middles = if kind == ElementKind::Tet10 { 6 } else { 0 };
                    corners.iter().chain(&middles[..n_middles]).map(|p| at(*p)).collect()
                })
                .collect()
        }
    }
}

/// Moves the mid-edge nodes of tet10 elements half way between their corners.
fn straighten(nodes: &mut [[f64; 3]], elements: &[(ElementKind, Vec<usize>)]) {
    for (_, element) in elements {
        for (middle, &(a, b)) in element[4..].iter().zip(&TET_EDGES) {
            let (xa, xb) = (nodes[element[a]], nodes[element[b]]);
            nodes[*middle] = std::array::from_fn(|k| 0.5 * (xa[k] + xb[k]));
        }
    }
}
