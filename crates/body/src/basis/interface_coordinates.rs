//! K and M in interface coordinates, as joints of multibody packages want them.

use faer::Mat;
use flexbody_linalg::combine;
use nalgebra::Matrix3;

/// K and M of a body in the motions q of its interfaces and the amplitudes eta of its fixed-interface modes
/// (c + m in all), in this order, and the transformation from the modes of the body: \[q; eta\] = B p for
/// modal amplitudes p, so that B'K B = diag(lambda), B'M B = I.
#[derive(Debug, Clone, PartialEq)]
pub struct InterfaceCoordinates {
    /// What each coordinate is: `left ux`, `left rz`, `fixed-interface mode 1`.
    pub names: Vec<String>,
    /// First of the d coordinates of each vector among them: these change with the axes, all others do not.
    pub(super) vectors: Vec<usize>,
    /// blkdiag(K_cc, diag(lambda of the fixed-interface modes)): as many zero-energy motions as the body has
    /// rigid ones.
    pub stiffness: Mat<f64>,
    /// \[M_cc, M_cm; M_mc, I\].
    pub mass: Mat<f64>,
    /// B ((c + m) x nf).
    pub of_modes: Mat<f64>,
}

impl InterfaceCoordinates {
    /// The same with vectors along the columns of `axes` (right-handed, in the plane about z), for modes
    /// multiplied by `signs`.
    pub fn in_axes(&self, axes: &Matrix3<f64>, dimension: usize, signs: &[f64]) -> Self {
        let size = self.names.len();
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
        let of_modes = combine(turn.as_ref(), self.of_modes.as_ref());
        Self {
            names: self.names.clone(),
            vectors: self.vectors.clone(),
            stiffness: turned(&self.stiffness),
            mass: turned(&self.mass),
            of_modes: Mat::from_fn(size, of_modes.ncols(), |i, j| of_modes[(i, j)] * signs[j]),
        }
    }
}
