//! Stiffness matrices.

use crate::elasticity::PLACES;
use crate::formulation::{Formulation, Strain};
use crate::geometry::{PerFunction, Point};
use crate::shape::{HEX_CORNERS, MAX_NODES};
use crate::{Axes, Elasticity, Section};
use nalgebra::{Matrix6, Vector3};

/// Factor of the hourglass stiffness in CalculiX 2.20, to which the stiffness of the hourglass modes is proportional.
const HOURGLASS_FACTOR: f64 = 0.0005;

/// Nodes whose rows are computed at once, in vector instructions.
const LANES: usize = 4;

/// Sums of the entries of a matrix: by column node, group of row nodes, pair of directions, row node in its group. Only
/// groups up to that of the column node are used.
type Blocks = [[[[f64; LANES]; 9]; MAX_NODES / LANES]; MAX_NODES];

/// Elasticity of a section at the points of an element.
pub(crate) struct Material<'a> {
    section: &'a Section,
    /// Elasticity along the axes of the model, if it is the same everywhere.
    constant: Option<Matrix6<f64>>,
}

impl<'a> Material<'a> {
    /// Returns the material of a section; `None` if the section has no axes.
    pub(crate) fn new(section: &'a Section) -> Option<Self> {
        let constant = match section.axes {
            Axes::Cylinder { .. } => None,
            Axes::Model | Axes::Fixed(_) => Some(section.elasticity_at(&Vector3::zeros())?.0),
        };
        Some(Self { section, constant })
    }

    /// Returns the elasticity at a position; `None` if the section has no axes there.
    pub(crate) fn at(&self, position: [f64; 3]) -> Option<Matrix6<f64>> {
        match self.constant {
            Some(matrix) => Some(matrix),
            None => Some(self.section.elasticity_at(&Vector3::from(position))?.0),
        }
    }
}

impl Formulation {
    /// Returns the stiffness of an element: 3m x 3m for m nodes and internal nodes, row by row, rows node by node in x, y
    /// and z, exactly symmetric. Returns `None` if the element is inverted or degenerate at a point, or if the section has
    /// no axes there.
    ///
    /// # Panics
    /// If the number of nodes is another one.
    pub fn stiffness(self, x: &[[f64; 3]], section: &Section) -> Option<Vec<f64>> {
        let material = Material::new(section)?;
        let functions = self.n_functions();
        let mut blocks = [[[[0.0; LANES]; 9]; MAX_NODES / LANES]; MAX_NODES];
        for point in self.geometry(x)? {
            let elasticity = material.at(point.position)?;
            add_point(&mut blocks, &point, &elasticity, functions);
            if self.strain() == Strain::Mean {
                add_hourglass(&mut blocks, x, &point, hourglass_modulus(&elasticity));
            }
        }
        Some(assemble(&blocks, functions))
    }
}

/// Adds volume times B' D B of a point, for row nodes up to the column node.
fn add_point(blocks: &mut Blocks, point: &Point, elasticity: &Matrix6<f64>, functions: usize) {
    let elasticity: &[[f64; 6]; 6] = elasticity.as_ref();
    for (b, column) in blocks.iter_mut().enumerate().take(functions) {
        let stresses = std::array::from_fn(|direction| unit_stress(point, elasticity, b, direction));
        for (group, entries) in column.iter_mut().enumerate().take(b / LANES + 1) {
            add_gradients(entries, &group_of(&point.gradients, group), &stresses);
            if let Some(dilation) = &point.dilation {
                add_dilation(entries, &group_of(dilation, group), &stresses);
            }
        }
    }
}

/// Returns the values of the row nodes of a group, along x, y and z.
fn group_of(rows: &[PerFunction; 3], group: usize) -> [[f64; LANES]; 3] {
    let part = |row: &PerFunction| row.as_chunks::<LANES>().0[group];
    [part(&rows[0]), part(&rows[1]), part(&rows[2])]
}

/// Adds the work of stresses, one for each direction of the column node, on the gradients of the row nodes.
fn add_gradients(entries: &mut [[f64; LANES]; 9], rows: &[[f64; LANES]; 3], stresses: &[[f64; 6]; 3]) {
    for i in 0..3 {
        for (j, stress) in stresses.iter().enumerate() {
            let [x, y, z] = PLACES[i].map(|place| stress[place]);
            let entry = &mut entries[3 * i + j];
            for lane in 0..LANES {
                entry[lane] += rows[0][lane] * x + rows[1][lane] * y + rows[2][lane] * z;
            }
        }
    }
}

/// Adds the work of the traces of stresses on the dilation of the row nodes.
fn add_dilation(entries: &mut [[f64; LANES]; 9], rows: &[[f64; LANES]; 3], stresses: &[[f64; 6]; 3]) {
    for (i, row) in rows.iter().enumerate() {
        for (j, stress) in stresses.iter().enumerate() {
            let trace = stress[0] + stress[1] + stress[2];
            for (entry, share) in entries[3 * i + j].iter_mut().zip(row) {
                *entry += share * trace;
            }
        }
    }
}

/// Returns volume times stress for a unit displacement of a node in a direction.
fn unit_stress(point: &Point, elasticity: &[[f64; 6]; 6], node: usize, direction: usize) -> [f64; 6] {
    let mut stress = [0.0; 6];
    let mut add = |component: usize, size: f64| {
        // The matrix is symmetric: its rows are its columns.
        for (sum, entry) in stress.iter_mut().zip(&elasticity[component]) {
            *sum += point.volume * size * entry;
        }
    };
    for (component, row) in PLACES[direction].into_iter().zip(&point.gradients) {
        add(component, row[node]);
    }
    if let Some(dilation) = &point.dilation {
        (0..3).for_each(|component| add(component, dilation[direction][node]));
    }
    stress
}

/// Adds the hourglass stiffness of Flanagan and Belytschko (1981) as CalculiX 2.20 has it. The hourglass modes should be
/// orthogonal to all linear displacements; CalculiX makes them orthogonal only to those that grow along z, so that in skewed
/// elements rigid rotations have small forces.
fn add_hourglass(blocks: &mut Blocks, x: &[[f64; 3]], point: &Point, modulus: f64) {
    let products: [fn([f64; 3]) -> f64; 4] =
        [|[_, y, z]| y * z, |[x, _, z]| x * z, |[x, y, _]| x * y, |[x, y, z]| x * y * z];
    let square: f64 = point.gradients.iter().flatten().map(|value| value * value).sum();
    let stiffness = HOURGLASS_FACTOR * modulus * square * point.volume;
    for product in products {
        let mode = HEX_CORNERS.map(product);
        let slope: f64 = x.iter().zip(mode).map(|(position, value)| position[2] * value).sum();
        let shape: [f64; 8] = std::array::from_fn(|n| mode[n] - point.gradients[2][n] * slope);
        for b in 0..8 {
            for a in 0..=b {
                for diagonal in [0, 4, 8] {
                    blocks[b][a / LANES][diagonal][a % LANES] += stiffness * shape[a] * shape[b];
                }
            }
        }
    }
}

/// Returns the modulus of the hourglass stiffness as CalculiX has it: Young's modulus of an isotropic material, otherwise
/// the stress xx for a unit strain xx along the axes of the model.
fn hourglass_modulus(elasticity: &Matrix6<f64>) -> f64 {
    let (lambda, shear) = (elasticity[(0, 1)], elasticity[(3, 3)]);
    let isotropic = Elasticity::of_lame(lambda, shear);
    let full = elasticity[(0, 0)];
    if (elasticity - isotropic.0).amax() <= 1e-12 * full {
        shear * (3.0 * lambda + 2.0 * shear) / (lambda + shear)
    } else {
        full
    }
}

/// Returns the matrix by rows, symmetric.
fn assemble(blocks: &Blocks, functions: usize) -> Vec<f64> {
    let size = 3 * functions;
    let mut matrix = vec![0.0; size * size];
    for (b, groups) in blocks.iter().enumerate().take(functions) {
        for a in 0..=b {
            for (pair, lanes) in groups[a / LANES].iter().enumerate() {
                let (row, column) = (3 * a + pair / 3, 3 * b + pair % 3);
                // Of the two triangles of a diagonal block the upper one counts, so that the matrix is symmetric exactly.
                if row <= column {
                    matrix[row * size + column] = lanes[a % LANES];
                    matrix[column * size + row] = lanes[a % LANES];
                }
            }
        }
    }
    matrix
}
