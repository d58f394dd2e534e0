//! Geometric stiffness: the stiffness of stresses in an element that turns.

use crate::Section;
use crate::formulation::Formulation;
use crate::geometry::Point;
use crate::stiffness::Material;
use nalgebra::Vector6;

impl Formulation {
    /// Returns the geometric stiffness of stresses xx, yy, zz, xy, yz, xz at the points: m x m for m nodes and internal
    /// nodes, row by row, exactly symmetric. Its entry for two functions is the sum over points of volume times grad N_a'
    /// stress grad N_b, the same in the three directions. Returns `None` if the element is inverted or degenerate at a
    /// point.
    ///
    /// # Panics
    /// If the number of nodes or points is another one.
    pub fn geometric_stiffness(self, x: &[[f64; 3]], stresses: &[[f64; 6]]) -> Option<Vec<f64>> {
        assert_eq!(stresses.len(), self.n_points(), "stresses of an element: {}", self.name());
        let functions = self.n_functions();
        let mut matrix = vec![0.0; functions * functions];
        for (point, stress) in self.geometry(x)?.iter().zip(stresses) {
            add_stress(&mut matrix, functions, point, stress);
        }
        mirror(&mut matrix, functions);
        Some(matrix)
    }

    /// Returns the geometric stiffness of the stresses that displacements of nodes and internal nodes cause, as
    /// [`Formulation::geometric_stiffness`] does, for each of several sets of displacements; `None` where
    /// [`Formulation::stresses`] is.
    ///
    /// # Panics
    /// If the number of nodes is another one.
    pub(crate) fn stress_stiffness(
        self,
        x: &[[f64; 3]],
        displacements: &[Vec<[f64; 3]>],
        section: &Section,
    ) -> Option<Vec<Vec<f64>>> {
        let material = Material::new(section)?;
        let functions = self.n_functions();
        let mut matrices = vec![vec![0.0; functions * functions]; displacements.len()];
        for point in &self.geometry(x)? {
            let elasticity = material.at(point.position)?;
            for (matrix, moved) in matrices.iter_mut().zip(displacements) {
                let stress = elasticity * Vector6::from(point.strain(moved));
                add_stress(matrix, functions, point, stress.as_ref());
            }
        }
        matrices.iter_mut().for_each(|matrix| mirror(matrix, functions));
        Some(matrices)
    }
}

/// Adds the geometric stiffness of the stress at a point to the lower triangle of a matrix of `functions` rows.
fn add_stress(matrix: &mut [f64], functions: usize, point: &Point, stress: &[f64; 6]) {
    let [xx, yy, zz, xy, yz, xz] = stress.map(|component| point.volume * component);
    let [gx, gy, gz] = &point.gradients;
    for b in 0..functions {
        let (x, y, z) = (gx[b], gy[b], gz[b]);
        let tx = xx * x + xy * y + xz * z;
        let ty = xy * x + yy * y + yz * z;
        let tz = xz * x + yz * y + zz * z;
        let row = &mut matrix[b * functions..=b * functions + b];
        for (entry, ((gx, gy), gz)) in row.iter_mut().zip(gx.iter().zip(gy).zip(gz)) {
            *entry += gx * tx + gy * ty + gz * tz;
        }
    }
}

/// Copies the lower triangle of a matrix of `functions` rows to the upper one.
fn mirror(matrix: &mut [f64], functions: usize) {
    for b in 0..functions {
        for a in 0..b {
            matrix[a * functions + b] = matrix[b * functions + a];
        }
    }
}
