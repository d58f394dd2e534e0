//! Stiffness matrices.

use crate::formulation::{Formulation, Strain};
use crate::geometry::{PerFunction, Point};
use crate::shape::{HEX_CORNERS, MAX_NODES};
use crate::{Axes, Section};
use nalgebra::{Matrix6, Vector3};

/// Factor of the hourglass stiffness in CalculiX 2.20, to which the stiffness of the hourglass modes is proportional.
const HOURGLASS_FACTOR: f64 = 0.0005;

/// Positions of the components of a stress tensor in its vector xx, yy, zz, xy, yz, xz.
const PLACES: [[usize; 3]; 3] = [[0, 3, 5], [3, 1, 4], [5, 4, 2]];

/// Sums of the entries of a matrix by column node, pair of directions and row node.
type Blocks = [[PerFunction; 9]; MAX_NODES];

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
        let mut blocks = [[[0.0; MAX_NODES]; 9]; MAX_NODES];
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
    let [gx, gy, gz] = &point.gradients;
    for (b, column) in blocks.iter_mut().enumerate().take(functions) {
        for j in 0..3 {
            let stress = unit_stress(point, elasticity, b, j);
            for i in 0..3 {
                let [tx, ty, tz] = PLACES[i].map(|place| stress[place]);
                let rows = column[3 * i + j][..=b].iter_mut();
                for (((entry, x), y), z) in rows.zip(gx).zip(gy).zip(gz) {
                    *entry += x * tx + y * ty + z * tz;
                }
                if let Some(dilation) = &point.dilation {
                    let trace = stress[0] + stress[1] + stress[2];
                    for (entry, share) in column[3 * i + j][..=b].iter_mut().zip(&dilation[i]) {
                        *entry += share * trace;
                    }
                }
            }
        }
    }
}

/// Returns volume times stress for a unit displacement of a node in a direction.
fn unit_stress(point: &Point, elasticity: &Matrix6<f64>, node: usize, direction: usize) -> [f64; 6] {
    let columns = PLACES[direction];
    let gradient = point.gradients.map(|row| point.volume * row[node]);
    let share = point.dilation.map(|rows| point.volume * rows[direction][node]);
    std::array::from_fn(|row| {
        let entry = |column: usize| elasticity[(row, column)];
        let mut sum = 0.0;
        for (place, slope) in columns.into_iter().zip(gradient) {
            sum += entry(place) * slope;
        }
        share.map_or(sum, |share| sum + (entry(0) + entry(1) + entry(2)) * share)
    })
}

/// Adds the hourglass stiffness of Flanagan and Belytschko (1981) as CalculiX 2.20 has it. The hourglass modes should be
/// orthogonal to all linear displacements; CalculiX makes them orthogonal only to those that grow along z, so that in skewed
/// elements rigid rotations have small forces.
fn add_hourglass(blocks: &mut Blocks, x: &[[f64; 3]], point: &Point, modulus: f64) {
    let modes = HEX_CORNERS.map(|[a, b, c]| [b * c, a * c, a * b, a * b * c]);
    let square: f64 = point.gradients.iter().flatten().map(|value| value * value).sum();
    let stiffness = HOURGLASS_FACTOR * modulus * square * point.volume;
    for mode in 0..4 {
        let slope: f64 = (0..8).map(|n| x[n][2] * modes[n][mode]).sum();
        let shape: [f64; 8] = std::array::from_fn(|n| modes[n][mode] - point.gradients[2][n] * slope);
        for b in 0..8 {
            for a in 0..=b {
                for diagonal in [0, 4, 8] {
                    blocks[b][diagonal][a] += stiffness * shape[a] * shape[b];
                }
            }
        }
    }
}

/// Returns the modulus of the hourglass stiffness as CalculiX has it: Young's modulus of an isotropic material, otherwise
/// the stress xx for a unit strain xx.
fn hourglass_modulus(elasticity: &Matrix6<f64>) -> f64 {
    let (lambda, shear) = (elasticity[(0, 1)], elasticity[(3, 3)]);
    let isotropic = Matrix6::from_fn(|i, j| match (i < 3 && j < 3, i == j) {
        (true, true) => lambda + 2.0 * shear,
        (true, false) => lambda,
        (false, true) => shear,
        (false, false) => 0.0,
    });
    let full = elasticity[(0, 0)];
    if (elasticity - isotropic).amax() <= 1e-12 * full {
        shear * (3.0 * lambda + 2.0 * shear) / (lambda + shear)
    } else {
        full
    }
}

/// Returns the matrix by rows, symmetric.
fn assemble(blocks: &Blocks, functions: usize) -> Vec<f64> {
    let size = 3 * functions;
    let mut matrix = vec![0.0; size * size];
    for b in 0..functions {
        for a in 0..=b {
            for i in 0..3 {
                for j in 0..3 {
                    let (row, column) = (3 * a + i, 3 * b + j);
                    if row <= column {
                        let value = blocks[b][3 * i + j][a];
                        matrix[row * size + column] = value;
                        matrix[column * size + row] = value;
                    }
                }
            }
        }
    }
    matrix
}
