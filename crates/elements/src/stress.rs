//! Strains and stresses at the points of an element and at its nodes, and the forces of stresses.

use crate::Section;
use crate::elasticity::PLACES;
use crate::formulation::Formulation;
use crate::geometry::Point;
use crate::stiffness::Material;
use nalgebra::Vector6;

impl Formulation {
    /// Returns the strains xx, yy, zz, xy, yz, xz (engineering shear) at each point for displacements of nodes and internal
    /// nodes; `None` if the element is inverted or degenerate at a point.
    ///
    /// # Panics
    /// If the number of nodes is another one.
    pub fn strains(self, x: &[[f64; 3]], u: &[[f64; 3]]) -> Option<Vec<[f64; 6]>> {
        self.check_functions(u.len());
        Some(self.geometry(x)?.iter().map(|point| point.strain(u)).collect())
    }

    /// Returns the stresses xx, yy, zz, xy, yz, xz at each point for displacements of nodes and internal nodes; `None` if
    /// the element is inverted or degenerate at a point, or if the section has no axes there.
    ///
    /// # Panics
    /// If the number of nodes is another one.
    pub fn stresses(self, x: &[[f64; 3]], u: &[[f64; 3]], section: &Section) -> Option<Vec<[f64; 6]>> {
        self.check_functions(u.len());
        let material = Material::new(section)?;
        let stress = |point: &Point| {
            let strain = Vector6::from(point.strain(u));
            Some((material.at(point.position)? * strain).into())
        };
        self.geometry(x)?.iter().map(stress).collect()
    }

    /// Returns the rows of the stresses at the points: six for each point, each with three columns for each node and
    /// internal node. Returns `None` where [`Formulation::stresses`] does.
    ///
    /// # Panics
    /// If the number of nodes is another one.
    pub fn stress_rows(self, x: &[[f64; 3]], section: &Section) -> Option<Vec<Vec<f64>>> {
        let material = Material::new(section)?;
        let mut rows = Vec::with_capacity(6 * self.n_points());
        for point in self.geometry(x)? {
            let elasticity = material.at(point.position)?;
            let columns: Vec<Vector6<f64>> = (0..3 * self.n_functions())
                .map(|column| elasticity * Vector6::from(point.unit_strain(column / 3, column % 3)))
                .collect();
            rows.extend((0..6).map(|row| columns.iter().map(|column| column[row]).collect::<Vec<f64>>()));
        }
        Some(rows)
    }

    /// Returns the rows of the stresses at the nodes, extrapolated from the points: six for each node, otherwise as
    /// [`Formulation::stress_rows`].
    ///
    /// # Panics
    /// If the number of nodes is another one.
    pub fn nodal_stress_rows(self, x: &[[f64; 3]], section: &Section) -> Option<Vec<Vec<f64>>> {
        let points = self.stress_rows(x, section)?;
        let at_nodes = self.nodal_extrapolation();
        Some(at_nodes.iter().flat_map(|weights| extrapolated(&points, weights)).collect())
    }

    /// Returns the forces at nodes and internal nodes with which stresses at the points are in equilibrium: the sum over
    /// points of volume times B' stress. The stiffness times displacements has the same forces, and those of the hourglass
    /// control where there is one. Returns `None` if the element is inverted or degenerate at a point.
    ///
    /// # Panics
    /// If the number of nodes or points is another one.
    pub fn forces(self, x: &[[f64; 3]], stresses: &[[f64; 6]]) -> Option<Vec<[f64; 3]>> {
        assert_eq!(stresses.len(), self.n_points(), "stresses of an element: {}", self.name());
        let mut forces = vec![[0.0; 3]; self.n_functions()];
        for (point, stress) in self.geometry(x)?.iter().zip(stresses) {
            for (node, force) in forces.iter_mut().enumerate() {
                for (direction, component) in force.iter_mut().enumerate() {
                    let strain = point.unit_strain(node, direction);
                    let work: f64 = strain.iter().zip(stress).map(|(strain, stress)| strain * stress).sum();
                    *component += point.volume * work;
                }
            }
        }
        Some(forces)
    }

    /// Checks the number of displacements.
    fn check_functions(self, count: usize) {
        assert_eq!(count, self.n_functions(), "displacements of an element: {}", self.name());
    }
}

/// Returns the six rows of the stress at a node, for the rows at the points and the weights of the points at the node.
pub(crate) fn extrapolated(points: &[Vec<f64>], weights: &[f64]) -> [Vec<f64>; 6] {
    std::array::from_fn(|component| {
        let mut row = vec![0.0; points[component].len()];
        for (p, weight) in weights.iter().enumerate() {
            for (sum, value) in row.iter_mut().zip(&points[6 * p + component]) {
                *sum += weight * value;
            }
        }
        row
    })
}

impl Point {
    /// Returns the strain for a unit displacement of a node in a direction.
    fn unit_strain(&self, node: usize, direction: usize) -> [f64; 6] {
        let mut strain = [0.0; 6];
        for (place, row) in PLACES[direction].into_iter().zip(&self.gradients) {
            strain[place] += row[node];
        }
        if let Some(dilation) = &self.dilation {
            for normal in &mut strain[..3] {
                *normal += dilation[direction][node];
            }
        }
        strain
    }

    /// Returns the strain for displacements of all functions.
    pub(crate) fn strain(&self, u: &[[f64; 3]]) -> [f64; 6] {
        // Gradient of the displacement (row: direction, column: derivative along x, y, z).
        let mut slope = [[0.0; 3]; 3];
        let mut growth = 0.0;
        for (node, displacement) in u.iter().enumerate() {
            for (row, size) in slope.iter_mut().zip(displacement) {
                for (entry, gradients) in row.iter_mut().zip(&self.gradients) {
                    *entry += size * gradients[node];
                }
            }
            if let Some(dilation) = &self.dilation {
                growth +=
                    (0..3).map(|direction| displacement[direction] * dilation[direction][node]).sum::<f64>();
            }
        }
        let mut strain = [growth, growth, growth, 0.0, 0.0, 0.0];
        for (row, places) in slope.iter().zip(PLACES) {
            for (entry, place) in row.iter().zip(places) {
                strain[place] += entry;
            }
        }
        strain
    }
}
