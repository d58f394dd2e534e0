//! Implicit conserving steps: collocation at Gauss points.

use super::stages::{STAGES, StageMode};
use super::{Failure, Oscillator, System, Work};
use flexbody_linalg::ties::first_largest;
use nalgebra::{Complex, DMatrix};

type Square = [[f64; STAGES]; STAGES];

/// Limit of the number of corrections in a step: a contracting iteration reaches rounding long before.
const MOST_CORRECTIONS: usize = 100;

/// Corrections below this part of the scales that no longer shrink have reached rounding.
const NEAR_ROUNDING: f64 = 1e-9;

/// Residual of the stages, in scales, at which the iteration ends: so far below rounding that it does not
/// add up over millions of steps.
const SOLVED: f64 = 1e-20;

/// Collocation at Gauss points (Hairer, Lubich, Wanner, Geometric Numerical Integration, II.1.3): order 2
/// (the implicit midpoint rule), 4 or 6 with steps of constant length.
///
/// The methods are symmetric and symplectic, conserve quadratic invariants, and are stable for every step
/// length. Stages are solved to rounding by iterations that treat the [`Oscillator`]s of the system
/// exactly; increments are summed with compensation, so that rounding does not drift over millions of
/// steps.
#[derive(Debug, Clone)]
pub struct Gauss {
    tableau: Box<Tableau>,
    modes: Vec<StageMode>,
    /// Size of corrections at which the iteration ends.
    solved: f64,
    /// Number of parts that each step is divided into.
    refinement: u32,
    /// Increments Z of the stages, and their rates.
    increments: [Vec<f64>; STAGES],
    rates: [Vec<f64>; STAGES],
    stage: Vec<f64>,
    scales: Vec<f64>,
    /// Rounding errors of the state, for compensated summation.
    carry: Vec<f64>,
    /// (I + d h A + lambda h^2 A^2)^-1 of every oscillator.
    oscillators: Vec<(Oscillator, Square)>,
    /// Length of the last step, whose increments start the next.
    last: Option<f64>,
    work: Work,
}

/// Coefficients of a method.
#[derive(Debug, Clone)]
struct Tableau {
    stages: usize,
    /// Positions of the stages in the step, and weights of their rates.
    nodes: [f64; STAGES],
    weights: Square,
    /// Coefficients of the stages of the next step, and of the end of this step, on the increments of this
    /// step.
    ahead: Square,
    to_end: [f64; STAGES],
}

impl Tableau {
    fn new(order: usize) -> Self {
        let (a, b) = (3.0_f64.sqrt() / 6.0, 15.0_f64.sqrt());
        let (nodes, weights) = match order {
            2 => ([0.5, 0.0, 0.0], [[0.5, 0.0, 0.0], [0.0; 3], [0.0; 3]]),
            4 => ([0.5 - a, 0.5 + a, 0.0], [[0.25, 0.25 - a, 0.0], [0.25 + a, 0.25, 0.0], [0.0; 3]]),
            6 => (
                [0.5 - b / 10.0, 0.5, 0.5 + b / 10.0],
                [
                    [5.0 / 36.0, 2.0 / 9.0 - b / 15.0, 5.0 / 36.0 - b / 30.0],
                    [5.0 / 36.0 + b / 24.0, 2.0 / 9.0, 5.0 / 36.0 - b / 24.0],
                    [5.0 / 36.0 + b / 30.0, 2.0 / 9.0 + b / 15.0, 5.0 / 36.0],
                ],
            ),
            _ => panic!("Gauss methods of order 2, 4 and 6, not {order}"),
        };
        let stages = order / 2;
        // Lagrange polynomial through zero and the increments.
        let polynomial = |j: usize, x: f64| {
            let others = (0..stages).filter(|&k| k != j);
            others.fold(x / nodes[j], |product, k| product * (x - nodes[k]) / (nodes[j] - nodes[k]))
        };
        let to_end = std::array::from_fn(|j| if j < stages { polynomial(j, 1.0) } else { 0.0 });
        let ahead = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                if i < stages && j < stages { polynomial(j, 1.0 + nodes[i]) - to_end[j] } else { 0.0 }
            })
        });
        Self { stages, nodes, weights, ahead, to_end }
    }
}

impl Gauss {
    /// Creates the method of the given order for `dimension` entries.
    ///
    /// # Panics
    /// When the order is not 2, 4 or 6.
    pub fn new(dimension: usize, order: usize) -> Self {
        let zeros = || vec![0.0; dimension];
        let tableau = Tableau::new(order);
        Self {
            modes: stage_modes(&tableau.weights, tableau.stages),
            tableau: Box::new(tableau),
            solved: SOLVED,
            refinement: 1,
            increments: std::array::from_fn(|_| zeros()),
            rates: std::array::from_fn(|_| zeros()),
            stage: zeros(),
            scales: zeros(),
            carry: zeros(),
            oscillators: Vec::new(),
            last: None,
            work: Work::default(),
        }
    }

    /// Returns the method with stages solved until the residual is below `solved` in scales, instead of to
    /// rounding.
    pub fn solved_to(self, solved: f64) -> Self {
        Self { solved, ..self }
    }

    /// Returns the method with every step of an integration divided into `refinement` parts. The ends of
    /// the undivided steps remain among the ends of steps.
    pub fn refined(self, refinement: u32) -> Self {
        Self { refinement: refinement.max(1), ..self }
    }

    /// Returns the number of parts that each step is divided into.
    pub(super) fn refinement(&self) -> u32 {
        self.refinement
    }

    /// Returns the work done so far.
    pub fn work(&self) -> Work {
        self.work
    }

    /// Discards the last step, because f or the state jumps here.
    pub fn restart(&mut self) {
        self.last = None;
        self.carry.fill(0.0);
    }

    /// Takes a step of length `h` from `time`. The step continues the last one unless [`Gauss::restart`]
    /// was called.
    ///
    /// # Errors
    /// [`Failure::NotConverged`] if the step is too long for the part of the system outside the
    /// oscillators; failures of the system.
    ///
    /// # Panics
    /// When the state has another number of entries.
    pub fn step(
        &mut self,
        system: &mut dyn System,
        time: f64,
        state: &mut [f64],
        h: f64,
    ) -> Result<(), Failure> {
        self.prepare(system, h);
        system.scales(state, &mut self.scales);
        let failed = Failure::NotConverged { time, step: h };
        let mut before = None;
        for _ in 0..MOST_CORRECTIONS {
            for i in 0..self.tableau.stages {
                for (at, stage) in self.stage.iter_mut().enumerate() {
                    *stage = state[at] + (self.increments[i][at] + self.carry[at]);
                }
                self.work.rates += 1;
                system.rates(time + self.tableau.nodes[i] * h, &self.stage, &mut self.rates[i])?;
            }
            self.find_residuals(h);
            let residuals = &mut self.rates[..self.tableau.stages];
            let own_size = system.correct_stages(h, &self.modes, &self.scales, residuals)?;
            residuals.iter_mut().for_each(|residual| system.enter_oscillators(residual));
            self.filter(h);
            let corrections = &mut self.rates[..self.tableau.stages];
            corrections.iter_mut().for_each(|correction| system.leave_oscillators(correction));
            let in_scales = self.correct();
            let size = own_size.unwrap_or(in_scales);
            // Contraction of the corrections; unknown at the first correction.
            let ratio = before.map(|before: f64| size / before);
            let stalled = |ratio: f64| ratio > 0.5 && size < NEAR_ROUNDING;
            if !size.is_finite() || ratio.is_some_and(|ratio| ratio > 2.0 && !stalled(ratio)) {
                self.work.rejected += 1;
                return Err(failed);
            }
            if size == 0.0 || ratio.is_some_and(|ratio| size * ratio <= self.solved || stalled(ratio)) {
                self.advance(state);
                self.last = Some(h);
                self.work.steps += 1;
                system.settle(state);
                return Ok(());
            }
            before = Some(size);
        }
        self.work.rejected += 1;
        Err(failed)
    }

    /// Computes start increments, and the oscillator matrices for this step length.
    fn prepare(&mut self, system: &dyn System, h: f64) {
        if self.last == Some(h) {
            for at in 0..self.stage.len() {
                let increments = self.increments.each_ref().map(|z| z[at]);
                for i in 0..self.tableau.stages {
                    self.increments[i][at] = product(&self.tableau.ahead[i], &increments);
                }
            }
            return;
        }
        self.increments.iter_mut().for_each(|z| z.fill(0.0));
        let own = system.oscillators().iter();
        self.oscillators = own.map(|&oscillator| (oscillator, self.inverse(&oscillator, h))).collect();
    }

    /// Returns (I + d h A + lambda h^2 A^2)^-1.
    fn inverse(&self, oscillator: &Oscillator, h: f64) -> Square {
        let n = self.tableau.stages;
        let a = nalgebra::DMatrix::from_fn(n, n, |i, j| h * self.tableau.weights[i][j]);
        let matrix =
            nalgebra::DMatrix::identity(n, n) + &a * oscillator.damping + &a * (&a * oscillator.stiffness);
        // The eigenvalues of A lie in the right half plane: the matrix is regular for every damped
        // oscillator. Otherwise the plain iteration treats it.
        let inverse = matrix.try_inverse().unwrap_or_else(|| nalgebra::DMatrix::identity(n, n));
        std::array::from_fn(|i| std::array::from_fn(|j| if i < n && j < n { inverse[(i, j)] } else { 0.0 }))
    }

    /// Computes the residual of the increments, h A f - Z, in place of the rates.
    fn find_residuals(&mut self, h: f64) {
        for at in 0..self.stage.len() {
            let rates = self.rates.each_ref().map(|rates| rates[at]);
            for i in 0..self.tableau.stages {
                self.rates[i][at] = h * product(&self.tableau.weights[i], &rates) - self.increments[i][at];
            }
        }
    }

    /// Replaces the residuals of the oscillators by the corrections that solve them.
    fn filter(&mut self, h: f64) {
        for (oscillator, inverse) in &self.oscillators {
            let (x, p) = (oscillator.coordinate, oscillator.momentum);
            let entry = |rates: &[Vec<f64>; STAGES], at: usize| rates.each_ref().map(|rates| rates[at]);
            let (residuals, mut residuals_p) = (entry(&self.rates, x), entry(&self.rates, p));
            for (residuals_p, weights) in residuals_p.iter_mut().zip(&self.tableau.weights) {
                *residuals_p -= oscillator.stiffness * h * product(weights, &residuals);
            }
            let correction: [f64; STAGES] = std::array::from_fn(|i| product(&inverse[i], &residuals_p));
            for i in 0..self.tableau.stages {
                self.rates[i][p] = correction[i];
                self.rates[i][x] = residuals[i] + h * product(&self.tableau.weights[i], &correction);
            }
        }
    }

    /// Adds the corrections to the increments; returns their root mean square in scales.
    fn correct(&mut self) -> f64 {
        let mut sum = 0.0;
        for (increments, corrections) in self.increments.iter_mut().zip(&self.rates).take(self.tableau.stages)
        {
            for ((z, correction), scale) in increments.iter_mut().zip(corrections).zip(&self.scales) {
                *z += correction;
                sum += (correction / scale).powi(2);
            }
        }
        (sum / (self.tableau.stages * self.stage.len()) as f64).sqrt()
    }

    /// Adds the increment of the step and the compensation of earlier rounding.
    fn advance(&mut self, state: &mut [f64]) {
        for (at, y) in state.iter_mut().enumerate() {
            let increments = self.increments.each_ref().map(|z| z[at]);
            let increment = product(&self.tableau.to_end, &increments) + self.carry[at];
            let sum = *y + increment;
            // Exact if the state is larger than its increment; otherwise the rounding is that of the
            // increment.
            self.carry[at] = (*y - sum) + increment;
            *y = sum;
        }
    }
}

fn product(a: &[f64; STAGES], b: &[f64; STAGES]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

// Stages of an implicit step, decoupled by the eigenvalues of the method.

/// Returns the eigenvalues of the first `stages` rows and columns of A, which are distinct.
fn stage_modes(a: &[[f64; STAGES]; STAGES], stages: usize) -> Vec<StageMode> {
    let matrix = DMatrix::from_fn(stages, stages, |i, j| a[i][j]);
    let complex = matrix.map(|entry| Complex::new(entry, 0.0));
    let values = matrix.complex_eigenvalues();
    let identity = DMatrix::<Complex<f64>>::identity(stages, stages);
    let mode = |value: Complex<f64>, at: usize| {
        // The projector prod (A - nu) / (mu - nu) over all other nu, of rank one.
        let others = (0..stages).filter(|&other| other != at).map(|other| values[other]);
        let projector = others.fold(identity.clone(), |product, other| {
            product * (&complex - &identity * other) / (value - other)
        });
        let (row, column) = largest_entry(&projector);
        let entry = |i: usize, j: usize| {
            if i < stages && j < stages { projector[(i, j)] } else { Complex::new(0.0, 0.0) }
        };
        StageMode {
            value,
            left: std::array::from_fn(|j| entry(row, j) / projector[(row, column)]),
            right: std::array::from_fn(|i| entry(i, column)),
            paired: is_paired(value),
        }
    };
    let mut modes: Vec<StageMode> =
        (0..stages).filter(|&at| !below(values[at])).map(|at| mode(values[at], at)).collect();
    modes.sort_by(|a, b| a.value.im.total_cmp(&b.value.im));
    for mode in modes.iter_mut().filter(|mode| !mode.paired) {
        mode.value.im = 0.0;
        mode.left.iter_mut().chain(&mut mode.right).for_each(|entry| entry.im = 0.0);
    }
    modes
}

/// Returns the position of the entry of largest magnitude.
fn largest_entry(matrix: &DMatrix<Complex<f64>>) -> (usize, usize) {
    let places = (0..matrix.nrows()).flat_map(|i| (0..matrix.ncols()).map(move |j| (i, j)));
    first_largest(places, |at| matrix[*at].norm_sqr()).expect("a matrix with entries")
}

/// Imaginary part relative to the real part that counts as rounding.
const IMAGINARY_ROUNDING: f64 = 1e-9;

fn is_paired(value: Complex<f64>) -> bool {
    value.im.abs() > IMAGINARY_ROUNDING * value.re.abs()
}

fn below(value: Complex<f64>) -> bool {
    is_paired(value) && value.im < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalues_and_their_parts_make_the_matrix() {
        let b = 15.0_f64.sqrt();
        let matrices = [
            ([[0.5, 0.0, 0.0], [0.0; 3], [0.0; 3]], 1),
            (
                [
                    [0.25, 0.25 - 3.0_f64.sqrt() / 6.0, 0.0],
                    [0.25 + 3.0_f64.sqrt() / 6.0, 0.25, 0.0],
                    [0.0; 3],
                ],
                2,
            ),
            (
                [
                    [5.0 / 36.0, 2.0 / 9.0 - b / 15.0, 5.0 / 36.0 - b / 30.0],
                    [5.0 / 36.0 + b / 24.0, 2.0 / 9.0, 5.0 / 36.0 - b / 24.0],
                    [5.0 / 36.0 + b / 30.0, 2.0 / 9.0 + b / 15.0, 5.0 / 36.0],
                ],
                3,
            ),
        ];
        for (a, stages) in matrices {
            let modes = stage_modes(&a, stages);
            assert_eq!(modes.len(), stages.div_ceil(2));
            for (i, row) in a.iter().enumerate().take(stages) {
                for (j, entry) in row.iter().enumerate().take(stages) {
                    let part = |mode: &StageMode| {
                        let own = mode.right[i] * mode.value * mode.left[j];
                        if mode.paired { 2.0 * own.re } else { own.re }
                    };
                    let sum: f64 = modes.iter().map(part).sum();
                    assert!((sum - entry).abs() < 1e-14, "{stages} stages: ({i}, {j})");
                }
            }
            for mode in modes {
                let square = mode.value * mode.value;
                assert!(mode.value.re > 0.0 && square.re > 0.0 && square.im >= 0.0, "{mode:?}");
            }
        }
    }
}
