//! Transfer function as a sum over rigid motion and modes.

use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::basis::{CoupledModel, free_static_responses};
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::{
    combine, dense_cholesky, gram, side_by_side, solve_lower, solve_upper, subtract_combination,
    symmetric_eigen,
};
use nalgebra::{Complex, DMatrix};

/// Receptances of a free body in coordinates of diagonal stiffness and mass: H(w) = -G / w^2 + (C + i w C1 - w^2 C2)'
/// (diag(k) - w^2 diag(m) + i w D)^-1 B + S / (1 + i w beta).
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
    /// Outputs C1 and C2 of the first and second time derivatives of the coordinates (n x outputs); `None` for zero.
    pub outputs_of_rates: Option<[Mat<f64>; 2]>,
    /// Rigid accelerations G for unit loads (outputs x inputs).
    pub rigid: Mat<f64>,
    /// Static response S outside the coordinates (outputs x inputs); `None` for zero.
    pub direct: Option<Mat<f64>>,
    /// beta of damping in proportion to the stiffness, which S has too: S / (1 + i w beta). Unit: time.
    pub lag: f64,
}

impl ModalSum {
    /// Returns H (outputs x inputs) at w > 0, in radians per unit of time. Entries are infinite or NaN at the resonance
    /// of an undamped coordinate.
    pub(super) fn at(&self, omega: f64) -> DMatrix<Complex<f64>> {
        let amplitudes = self.amplitudes(omega);
        let (outputs, inputs) = (self.outputs.ncols(), self.inputs.ncols());
        let output = |j: usize, o: usize| match &self.outputs_of_rates {
            None => Complex::new(self.outputs[(j, o)], 0.0),
            Some([first, second]) => {
                Complex::new(self.outputs[(j, o)] - omega * omega * second[(j, o)], omega * first[(j, o)])
            }
        };
        DMatrix::from_fn(outputs, inputs, |o, i| {
            let flexible: Complex<f64> =
                (0..self.mass.len()).map(|j| amplitudes[(j, i)] * output(j, o)).sum();
            let direct = self.direct.as_ref().map_or(0.0, |direct| direct[(o, i)]);
            flexible - self.rigid[(o, i)] / (omega * omega) + direct / self.lagging(omega)
        })
    }

    /// Returns 1 + i w beta.
    pub(super) fn lagging(&self, omega: f64) -> Complex<f64> {
        Complex::new(1.0, omega * self.lag)
    }

    /// Returns (diag(k) - w^2 diag(m) + i w D)^-1 B.
    pub(super) fn amplitudes(&self, omega: f64) -> DMatrix<Complex<f64>> {
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

// Frequency response with static responses added to the modes: the estimate of the truncation error (theory section
// 8).

/// Relative residual of a mode below which it counts as an eigenvector and leaves no unbalanced force.
const EIGENVECTOR: f64 = 1e-6;

/// Smallest part of a load outside rigid motions and modes that gets a static response.
const MIN_REMAINING_LOAD: f64 = 1e-10;

/// Smallest elastic energy of a direction of the static responses, relative to the largest, that counts as independent.
const MIN_ENERGY_RATIO: f64 = 1e-9;

/// A body expressed in the rows of its model.
pub(super) struct NodalModes<'m> {
    pub model: CoupledModel<'m>,
    /// Rigid modes Phi (N x 6), orthonormal in M.
    pub rigid: Mat<f64>,
    /// Modes Psi (N x nf), M Psi and K Psi.
    pub vectors: Mat<f64>,
    pub inertial: Mat<f64>,
    pub elastic: Mat<f64>,
    /// Loads B (N x inputs) and outputs L (N x outputs).
    pub loads: Mat<f64>,
    pub measured: Mat<f64>,
    /// Outputs that move with the body; the others are rows of recoveries, which are relative to its frame.
    pub moving: Vec<bool>,
    /// Number of outputs, the first ones, whose static responses improve the estimate.
    pub improved: usize,
    /// beta and C - beta K_ff of modal damping C in proportion to the stiffness, which what the modes leave out has too;
    /// `None` for other damping.
    pub whole: Option<(f64, Mat<f64>)>,
}

impl NodalModes<'_> {
    /// Returns the transfer function in the span of the modes and of the static responses E = K^+ \[(1 - M Phi Phi' - M
    /// Psi Psi') \[B, L\], K Psi - M Psi Psi'K Psi\], with the modal damping C: D = M Psi (C - beta K_ff) (M Psi)' + beta K.
    /// Returns `None` if
    /// the modes leave no unbalanced force; otherwise also the displacements of its coordinates (N x n).
    ///
    /// # Errors
    /// The errors of [`free_static_responses`]; [`FactorizationFailed`](Code::FactorizationFailed) if the modes and
    /// responses are linearly dependent.
    pub(super) fn enriched(
        &self,
        body: &FlexBody,
        damping: Option<&Mat<f64>>,
    ) -> Result<Option<(ModalSum, Mat<f64>)>> {
        let Some(static_responses) = self.static_responses(body)? else { return Ok(None) };
        let stiff = normalised(&self.vectors, &self.elastic);
        let all = side_by_side(&[stiff.as_ref(), static_responses.as_ref()]);
        let dependent = || {
            Diagnostic::new(
                Code::FactorizationFailed,
                "the static responses that an estimate needs depend on the modes",
            )
        };
        Ok(Some(self.in_span(&all, damping).ok_or_else(dependent)?))
    }

    /// Returns E (N x k), orthonormal in K; `None` if there are no unbalanced forces.
    fn static_responses(&self, body: &FlexBody) -> Result<Option<Mat<f64>>> {
        let [loads, modes] = [self.unbalanced_loads(), self.unbalanced_modes(body)];
        let unbalanced = side_by_side(&[loads.as_ref(), modes.as_ref()]);
        if unbalanced.ncols() == 0 {
            return Ok(None);
        }
        let mut responses = free_static_responses(&self.model, unbalanced, body.modes().eigenvalue[0])?;
        let along = gram(self.inertial.as_ref(), responses.as_ref());
        subtract_combination(responses.as_mut(), self.vectors.as_ref(), along.as_ref());
        let responses =
            normalised(&responses, &self.model.model().pencil().apply_stiffness(responses.as_ref()));
        Ok(orthonormal(&responses, &self.model.model().pencil().apply_stiffness(responses.as_ref())))
    }

    /// Returns the part of the loads B and L outside rigid motions and modes.
    fn unbalanced_loads(&self) -> Mat<f64> {
        let loads = side_by_side(&[self.loads.as_ref(), self.measured.as_ref().subcols(0, self.improved)]);
        let mut left = loads.clone();
        let rigid = self.model.model().pencil().apply_mass(self.rigid.as_ref());
        for (vectors, products) in [(&self.rigid, &rigid), (&self.vectors, &self.inertial)] {
            let along = gram(vectors.as_ref(), left.as_ref());
            subtract_combination(left.as_mut(), products.as_ref(), along.as_ref());
        }
        self.model.without_inner_forces(&mut left);
        let kept = (0..loads.ncols())
            .filter(|&j| left.col(j).norm_l2() > MIN_REMAINING_LOAD * loads.col(j).norm_l2());
        columns(&left, &kept.collect::<Vec<_>>())
    }

    /// Returns K psi - M Psi Psi'K psi for the modes that are not eigenvectors.
    fn unbalanced_modes(&self, body: &FlexBody) -> Mat<f64> {
        let residual = &body.modes().residual;
        let kept: Vec<usize> = (0..residual.len()).filter(|&j| residual[j] > EIGENVECTOR).collect();
        let mut left = columns(&self.elastic, &kept);
        let along = gram(self.vectors.as_ref(), left.as_ref());
        subtract_combination(left.as_mut(), self.inertial.as_ref(), along.as_ref());
        self.model.without_inner_forces(&mut left);
        left
    }

    /// Returns the transfer function of motion in the span of rigid motions and the columns of `span`, and the displacements
    /// of its coordinates (N x n).
    fn in_span(&self, span: &Mat<f64>, damping: Option<&Mat<f64>>) -> Option<(ModalSum, Mat<f64>)> {
        let pencil = self.model.model().pencil();
        let stiffness = gram(span.as_ref(), pencil.apply_stiffness(span.as_ref()).as_ref());
        let mass = gram(span.as_ref(), pencil.apply_mass(span.as_ref()).as_ref());
        // K = T T' is positive definite on the span, and M may be singular: T^-1 M T^-T = Y diag(m) Y'.
        let lower = dense_cholesky(stiffness)?;
        let half = solve_lower(&lower, &mass).transpose().to_owned();
        let whole = solve_lower(&lower, &half);
        let symmetric =
            Mat::from_fn(whole.nrows(), whole.ncols(), |i, j| 0.5 * (whole[(i, j)] + whole[(j, i)]));
        let eigen = symmetric_eigen(symmetric.as_ref())?;
        // Coordinates of unit stiffness and diagonal mass; project loads, outputs and damping.
        let coordinates = solve_upper(&lower, &eigen.vectors);
        let seen = |columns: MatRef<'_, f64>| {
            combine(coordinates.transpose().to_owned().as_ref(), gram(span.as_ref(), columns).as_ref())
        };
        let mut rigid = gram(
            gram(self.rigid.as_ref(), self.measured.as_ref()).as_ref(),
            gram(self.rigid.as_ref(), self.loads.as_ref()).as_ref(),
        );
        clear_rows(&mut rigid, &self.moving);
        let damping = damping.map(|c| {
            let (beta, c) = self.whole.as_ref().map_or((0.0, c), |(beta, beside)| (*beta, beside));
            let modal = seen(self.inertial.as_ref());
            let left = combine(modal.as_ref(), c.as_ref());
            let of_modes = combine(left.as_ref(), modal.transpose().to_owned().as_ref());
            // The stiffness of the coordinates is one.
            let entry = |i: usize, j: usize| of_modes[(i, j)] + if i == j { beta } else { 0.0 };
            Mat::from_fn(of_modes.nrows(), of_modes.ncols(), entry)
        });
        let sum = ModalSum {
            stiffness: vec![1.0; eigen.values.len()],
            mass: eigen.values,
            damping,
            inputs: seen(self.loads.as_ref()),
            outputs: seen(self.measured.as_ref()),
            outputs_of_rates: None,
            rigid,
            direct: None,
            lag: 0.0,
        };
        Some((sum, combine(span.as_ref(), coordinates.as_ref())))
    }
}

/// Sets the rows to zero that are not `kept`.
pub(super) fn clear_rows(a: &mut Mat<f64>, kept: &[bool]) {
    for (row, _) in kept.iter().enumerate().filter(|(_, kept)| !**kept) {
        (0..a.ncols()).for_each(|c| a[(row, c)] = 0.0);
    }
}

/// Returns the columns with the indices `kept`.
fn columns(a: &Mat<f64>, kept: &[usize]) -> Mat<f64> {
    Mat::from_fn(a.nrows(), kept.len(), |i, j| a[(i, kept[j])])
}

/// Returns the columns x / sqrt(x'p) for columns x of `vectors` and p of `products`. Columns with x'p <= 0 are dropped.
fn normalised(vectors: &Mat<f64>, products: &Mat<f64>) -> Mat<f64> {
    let square = |j: usize| (0..vectors.nrows()).map(|i| vectors[(i, j)] * products[(i, j)]).sum::<f64>();
    let sizes: Vec<(usize, f64)> =
        (0..vectors.ncols()).map(|j| (j, square(j).sqrt())).filter(|(_, size)| *size > 0.0).collect();
    Mat::from_fn(vectors.nrows(), sizes.len(), |i, at| vectors[(i, sizes[at].0)] / sizes[at].1)
}

/// Returns an orthonormal basis of the span of `vectors` in the inner product whose products with them are `products`.
/// Returns `None` if the span is empty.
fn orthonormal(vectors: &Mat<f64>, products: &Mat<f64>) -> Option<Mat<f64>> {
    let square = gram(vectors.as_ref(), products.as_ref());
    let symmetric =
        Mat::from_fn(square.nrows(), square.ncols(), |i, j| 0.5 * (square[(i, j)] + square[(j, i)]));
    let eigen = symmetric_eigen(symmetric.as_ref())?;
    let largest = eigen.values.last().copied()?;
    let kept: Vec<usize> =
        (0..eigen.values.len()).filter(|&j| eigen.values[j] > MIN_ENERGY_RATIO * largest).collect();
    let turned = Mat::from_fn(eigen.values.len(), kept.len(), |i, j| {
        eigen.vectors[(i, kept[j])] / eigen.values[kept[j]].sqrt()
    });
    (!kept.is_empty()).then(|| combine(vectors.as_ref(), turned.as_ref()))
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
            outputs_of_rates: None,
            rigid: Mat::from_fn(2, 2, |_, _| 0.5 / m),
            direct: None,
            lag: 0.0,
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
