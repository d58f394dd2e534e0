//! Geometric stiffness: the stiffness of stresses in an element that turns.

use crate::formulation::Formulation;

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
            let [xx, yy, zz, xy, yz, xz] = stress.map(|component| point.volume * component);
            let [gx, gy, gz] = &point.gradients;
            for b in 0..functions {
                let (x, y, z) = (gx[b], gy[b], gz[b]);
                let tx = xx * x + xy * y + xz * z;
                let ty = xy * x + yy * y + yz * z;
                let tz = xz * x + yz * y + zz * z;
                for a in 0..=b {
                    matrix[b * functions + a] += gx[a] * tx + gy[a] * ty + gz[a] * tz;
                }
            }
        }
        for b in 0..functions {
            for a in 0..b {
                matrix[a * functions + b] = matrix[b * functions + a];
            }
        }
        Some(matrix)
    }
}
