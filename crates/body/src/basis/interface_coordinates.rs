//! K and M in interface coordinates, for joints of multibody packages.

use faer::Mat;
use flexbody_linalg::combine;
use nalgebra::Matrix3;

/// Stiffness and mass matrices of a body in the motions of its interfaces and the amplitudes of its
/// fixed-interface modes, and the transformation from its modes. The axes are those of the body; during the
/// computation of a basis those of the model.
///
/// The coordinates of an interface are the motions of its reference point (three translations, three
/// rotations; in the plane two and one) or, for a free interface, the displacements of its nodes in the
/// order of the nodes of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct InterfaceCoordinates {
    /// Names of the nc coordinates (`left ux`, `left rz`, `fixed-interface mode 1`): the interfaces in
    /// their order, then the fixed-interface modes.
    pub names: Vec<String>,
    /// Stiffness matrix (nc x nc): blkdiag(K_cc, diag(lambda of the fixed-interface modes)). Its null space
    /// has the dimension of the rigid motions.
    pub stiffness: Mat<f64>,
    /// Mass matrix (nc x nc): \[M_cc, M_cm; M_mc, I\].
    pub mass: Mat<f64>,
    /// Transformation B (nc x nf): coordinates B p for the amplitudes p of the modes, B'K B = diag(lambda), B'M B = I.
    pub of_modes: Mat<f64>,
}

/// Interface coordinates along the axes of the model, and the positions of vectors among them for a change
/// of axes.
#[derive(Debug, Clone, PartialEq)]
pub struct CoordinatesInModelAxes {
    /// Coordinates along the axes of the model.
    pub coordinates: InterfaceCoordinates,
    /// First of the d coordinates of each vector: these change with the axes, all others do not.
    pub(super) vectors: Vec<usize>,
}

impl CoordinatesInModelAxes {
    /// Returns the coordinates with vectors along the columns of `axes` (right-handed, in the plane about z), for modes
    /// multiplied by `signs`.
    pub fn in_axes(&self, axes: &Matrix3<f64>, dimension: usize, signs: &[f64]) -> InterfaceCoordinates {
        let InterfaceCoordinates { names, stiffness, mass, of_modes } = &self.coordinates;
        let size = names.len();
        let mut turn = Mat::<f64>::identity(size, size);
        for &first in &self.vectors {
            for i in 0..dimension {
                for j in 0..dimension {
                    turn[(first + i, first + j)] = axes[(j, i)];
                }
            }
        }
        let turned = |a: &Mat<f64>| {
            let b = combine(turn.as_ref(), combine(a.as_ref(), turn.as_ref().transpose()).as_ref());
            Mat::from_fn(size, size, |i, j| 0.5 * (b[(i, j)] + b[(j, i)]))
        };
        let of_modes = combine(turn.as_ref(), of_modes.as_ref());
        InterfaceCoordinates {
            names: names.clone(),
            stiffness: turned(stiffness),
            mass: turned(mass),
            of_modes: Mat::from_fn(size, of_modes.ncols(), |i, j| of_modes[(i, j)] * signs[j]),
        }
    }
}
