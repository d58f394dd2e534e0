//! Transfer function as a sum over rigid motion and modes.

use faer::Mat;
use nalgebra::{Complex, DMatrix};

/// Receptances of a free body in coordinates of diagonal stiffness and mass: H(w) = -G / w^2 + C' (diag(k) - w^2
/// diag(m) + i w D)^-1 B.
pub(super) struct ModalSum {
    /// Stiffness k of the coordinates (n).
    pub stiffness: Vec<f64>,
    /// Mass m of the coordinates (n).
    pub mass: Vec<f64>,
    /// Damping D (n x n); `None` without damping.
    pub damping: Option<Mat<f64>>,
    /// Inputs B (n x inputs).
    pub inputs: Mat<f64>,
    /// Outputs C (n x outputs).
    pub outputs: Mat<f64>,
    /// Rigid accelerations G for unit loads (outputs x inputs).
    pub rigid: Mat<f64>,
}

impl ModalSum {
    /// Returns H (outputs x inputs) at w > 0, in radians per unit of time. Entries are infinite or NaN at the resonance
    /// of an undamped coordinate.
    pub(super) fn at(&self, omega: f64) -> DMatrix<Complex<f64>> {
        let amplitudes = self.amplitudes(omega);
        let (outputs, inputs) = (self.outputs.ncols(), self.inputs.ncols());
        DMatrix::from_fn(outputs, inputs, |o, i| {
            let flexible: Complex<f64> =
                (0..self.mass.len()).map(|j| amplitudes[(j, i)] * self.outputs[(j, o)]).sum();
            flexible - self.rigid[(o, i)] / (omega * omega)
        })
    }

    /// Returns (diag(k) - w^2 diag(m) + i w D)^-1 B.
    fn amplitudes(&self, omega: f64) -> DMatrix<Complex<f64>> {
        let (n, inputs) = (self.mass.len(), self.inputs.ncols());
        let input = |j: usize, i: usize| Complex::new(self.inputs[(j, i)], 0.0);
        let dynamic = |j: usize| self.stiffness[j] - omega * omega * self.mass[j];
        match &self.damping {
            None => DMatrix::from_fn(n, inputs, |j, i| input(j, i) / dynamic(j)),
            Some(damping) if is_diagonal(damping) => DMatrix::from_fn(n, inputs, |j, i| {
                input(j, i) / Complex::new(dynamic(j), omega * damping[(j, j)])
            }),
            Some(damping) => {
                let matrix = DMatrix::from_fn(n, n, |j, k| {
                    Complex::new(if j == k { dynamic(j) } else { 0.0 }, omega * damping[(j, k)])
                });
                let nothing = || DMatrix::from_element(n, inputs, Complex::new(f64::NAN, f64::NAN));
                matrix.lu().solve(&DMatrix::from_fn(n, inputs, input)).unwrap_or_else(nothing)
            }
        }
    }

    /// Returns the square of the natural frequency of every coordinate (infinite without mass), and its damping ratio.
    pub(super) fn resonances(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        (0..self.mass.len()).map(|j| {
            let (k, m) = (self.stiffness[j], self.mass[j].max(0.0));
            let rate = self.damping.as_ref().map_or(0.0, |damping| damping[(j, j)]);
            (k / m, 0.5 * rate / (k * m).sqrt())
        })
    }
}

fn is_diagonal(a: &Mat<f64>) -> bool {
    (0..a.ncols()).all(|j| (0..a.nrows()).all(|i| i == j || a[(i, j)] == 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two masses m joined by a spring k and a damper c have H_11 - H_12 = 1 / (2 k - w^2 m + 2 i w c) and H_11 + H_12
    /// = -1 / (w^2 m).
    #[test]
    fn two_masses_have_their_closed_form() {
        let (m, k, c) = (2.0, 50.0, 0.3);
        let share = 1.0 / f64::sqrt(2.0 * m);
        let sum = |spread: bool| ModalSum {
            stiffness: if spread { vec![k / m, k / m] } else { vec![2.0 * k / m] },
            mass: if spread { vec![0.5, 0.5] } else { vec![1.0] },
            damping: Some(if spread {
                // One coordinate split into two that move alike: the sum of their contributions is unchanged.
                Mat::from_fn(2, 2, |_, _| c / m / 2.0)
            } else {
                Mat::from_fn(1, 1, |_, _| 2.0 * c / m)
            }),
            inputs: Mat::from_fn(if spread { 2 } else { 1 }, 2, |_, i| {
                let sign = if i == 0 { 1.0 } else { -1.0 };
                if spread { 0.5 * sign * share } else { sign * share }
            }),
            outputs: Mat::from_fn(if spread { 2 } else { 1 }, 2, |_, i| {
                let sign = if i == 0 { 1.0 } else { -1.0 };
                if spread { 0.5 * sign * share } else { sign * share }
            }),
            rigid: Mat::from_fn(2, 2, |_, _| 0.5 / m),
        };
        for omega in [0.1, 5.0, 7.0710678, 30.0] {
            let h = sum(false).at(omega);
            let apart = 1.0 / Complex::new(2.0 * k - omega * omega * m, 2.0 * omega * c);
            // Rigid motion is large at low frequencies and cancels in the difference.
            let rounding = 1e-14 * h[(0, 0)].norm();
            assert!((h[(0, 0)] - h[(0, 1)] - apart).norm() < rounding + 1e-13 * apart.norm());
            assert!((h[(0, 0)] + h[(0, 1)] + 1.0 / (omega * omega * m)).norm() < rounding + 1e-13);
            let spread = sum(true).at(omega);
            assert!((&spread - &h).map(|z| z.norm()).max() < 1e-12 * h.map(|z| z.norm()).max(), "{omega}");
        }
        let (square, ratio) = sum(false).resonances().next().expect("one");
        assert!((square - 2.0 * k / m).abs() < 1e-12 && (ratio - c / m / square.sqrt()).abs() < 1e-15);
    }
}
