//! Extrapolation of values at integration points to the nodes.

use crate::formulation::Formulation;
use crate::shape::Shape;
use nalgebra::DMatrix;

impl Formulation {
    /// Returns weights that make values at the nodes of values at the points: one row for each node, one column for each
    /// point. Values at the nodes are those of functions that fit the values at the points with the least squares:
    /// trilinear with 2 x 2 x 2 points, the shape functions with 3 x 3 x 3, linear or those of the wedge with 6 nodes in
    /// tetrahedra and wedges, constant with one point. CalculiX does so with factors of three to six digits. An exception
    /// is C3D6, for which CalculiX 2.20 writes the stresses of the lower triangle at nodes 1, 3 and 5 and of the upper one at
    /// 2, 4 and 6; here both have theirs.
    pub fn nodal_extrapolation(self) -> Vec<Vec<f64>> {
        let nodes = self.shape().nodes();
        let Some(fit) = self.fit() else {
            return self.extrapolation_along_the_axis(&nodes);
        };
        let points: Vec<[f64; 3]> = self.rule().points().iter().map(|point| point.at).collect();
        let at_points = values(fit, &points);
        // Normal equations of the least squares; the functions are far from dependent at the points.
        let inverse = (at_points.transpose() * &at_points).cholesky().map(|factor| factor.inverse());
        let Some(inverse) = inverse else {
            unreachable!("the functions are independent at the points: {}", self.name())
        };
        let weights = values(fit, &nodes) * inverse * at_points.transpose();
        weights.row_iter().map(|row| row.iter().copied().collect()).collect()
    }

    /// Returns the functions that fit the values at the points; `None` if they depend on the axis of the wedge at most.
    fn fit(self) -> Option<Shape> {
        match self {
            Self::Tet10 => Some(Shape::Tet4),
            Self::Wedge6Full | Self::Wedge15 => Some(Shape::Wedge6),
            Self::Hex8 | Self::Hex8MeanDilatation | Self::Hex8Incompatible | Self::Hex20Reduced => {
                Some(Shape::Hex8)
            }
            Self::Hex20 => Some(Shape::Hex20),
            Self::Tet4 | Self::Wedge6 | Self::Hex8UniformStrain => None,
        }
    }

    /// Returns the weights of one point, or of two points of a wedge.
    fn extrapolation_along_the_axis(self, nodes: &[[f64; 3]]) -> Vec<Vec<f64>> {
        let weights = |node: &[f64; 3]| match self {
            Self::Wedge6 => {
                let share = 0.5 * node[2] * 3.0_f64.sqrt();
                vec![0.5 - share, 0.5 + share]
            }
            _ => vec![1.0],
        };
        nodes.iter().map(weights).collect()
    }
}

/// Returns the values of shape functions: one row for each position, one column for each function.
fn values(shape: Shape, positions: &[[f64; 3]]) -> DMatrix<f64> {
    let rows: Vec<f64> =
        positions.iter().flat_map(|&at| shape.functions(at)).map(|function| function.value).collect();
    DMatrix::from_row_slice(positions.len(), shape.n_nodes(), &rows)
}
