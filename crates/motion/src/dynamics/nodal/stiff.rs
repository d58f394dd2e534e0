//! Stiff part of the nodal equations, for implicit steps.

use super::equations::NodalEquations;
use super::state::DISPLACEMENTS;
use crate::integration::{Failure, STAGES, StageMode};
use flexbody_linalg::{MatrixSum, Scalar, SparseLdl, multiply_vector};
use flexbody_model::Damping;
use nalgebra::Complex;

/// Failure for M + z D + z^2 K that is singular to rounding, or too large for its ordering.
const SINGULAR: Failure = Failure::Rates {
    reason: "mass, damping and stiffness of the nodes cannot be factored for implicit steps",
};

/// Linear and fast part of the nodal equations, u' = P M^-1 w, w' = -K u - D u' with P = I - R (C R)^-1 C,
/// solved for the eigenvalues mu of an implicit method with the step h. The residuals (a, b) of the stages
/// in (u, w) are corrected by
///
/// ```text
/// (M + z D + z^2 K) x = z b + M a + z D a,    z = h mu,    u: P x,    w: M (x - a) / z
/// ```
///
/// where K R = 0 and D R = 0. D is the damping of the model; modal damping is left to the iteration. This
/// is the linear part for mean axes. Other conditions leave a constraint in M^-1 w to the iteration too,
/// which then needs steps below the shortest period.
#[derive(Debug)]
pub(super) struct Stiff<'m> {
    equations: &'m NodalEquations<'m>,
    /// Step length of the factors.
    step: f64,
    factors: Vec<StepFactor>,
    /// Corrections of u and w for every stage.
    corrected: Vec<Vec<f64>>,
    /// Residuals and products for an eigenvalue: real and imaginary parts.
    parts: [Vec<f64>; 4],
    product: Vec<f64>,
    real: [Vec<f64>; 2],
    complex: [Vec<Complex<f64>>; 2],
}

/// Factor of M + z D + z^2 K.
#[derive(Debug)]
enum StepFactor {
    Real(SparseLdl),
    Complex(SparseLdl<Complex<f64>>),
}

impl<'m> Stiff<'m> {
    pub(super) fn new(equations: &'m NodalEquations<'m>) -> Self {
        Self {
            equations,
            step: f64::NAN,
            factors: Vec::new(),
            corrected: Vec::new(),
            parts: Default::default(),
            product: Vec::new(),
            real: Default::default(),
            complex: Default::default(),
        }
    }

    /// Replaces the residuals of the stages by corrections. Returns an upper bound of the mean energy of
    /// the corrections over the stages, u'K u / 2 + w'M^-1 w / 2.
    pub(super) fn correct(
        &mut self,
        h: f64,
        modes: &[StageMode],
        residuals: &mut [Vec<f64>],
    ) -> Result<f64, Failure> {
        let n = self.equations.n_rows();
        if self.step != h || self.factors.len() != modes.len() {
            self.prepare(h, modes, residuals.len())?;
        }
        self.corrected.iter_mut().for_each(|stage| stage.fill(0.0));
        // Bound the square roots of the energies of the stages by the sum of those of the parts; a
        // conjugate pair counts twice.
        let mut roots = [0.0; STAGES];
        for (at, mode) in modes.iter().enumerate() {
            self.gather(mode, residuals);
            let root = self.solve(at, mode.value * h).sqrt();
            self.spread(mode);
            let twice = if mode.paired { 2.0 } else { 1.0 };
            roots.iter_mut().zip(&mode.right).for_each(|(sum, right)| *sum += twice * right.norm() * root);
        }
        for (residual, corrected) in residuals.iter_mut().zip(&self.corrected) {
            residual[DISPLACEMENTS..][..2 * n].copy_from_slice(corrected);
        }
        Ok(roots.iter().map(|root| root * root).sum::<f64>() / residuals.len() as f64)
    }

    fn prepare(&mut self, h: f64, modes: &[StageMode], stages: usize) -> Result<(), Failure> {
        let n = self.equations.n_rows();
        self.factors.clear();
        for mode in modes {
            let z = mode.value * h;
            let factor = if mode.paired {
                factored(&self.sum(z), self.equations).map(StepFactor::Complex)
            } else {
                factored(&self.sum(z.re), self.equations).map(StepFactor::Real)
            };
            self.factors.push(factor.ok_or(SINGULAR)?);
        }
        self.corrected.resize(stages, Vec::new());
        self.corrected.iter_mut().for_each(|stage| stage.resize(2 * n, 0.0));
        self.parts.iter_mut().chain(&mut self.real).for_each(|part| part.resize(n, 0.0));
        self.complex.iter_mut().for_each(|part| part.resize(n, Complex::new(0.0, 0.0)));
        self.product.resize(n, 0.0);
        self.step = h;
        Ok(())
    }

    /// Returns the sum M + z D + z^2 K.
    fn sum<T: Scalar>(&self, z: T) -> MatrixSum<'m, T> {
        let model = self.equations.model;
        let pencil = model.pencil();
        let (mut of_mass, mut of_stiffness) = (T::ONE, z * z);
        let mut terms = Vec::new();
        match self.equations.damping {
            Some(Damping::Rayleigh { alpha, beta }) => {
                of_mass += z.times(*alpha);
                of_stiffness += z.times(*beta);
            }
            Some(Damping::Matrix(damping)) => terms.push((z, damping, 1)),
            Some(Damping::Ratio(_) | Damping::Bands(_)) | None => {}
        }
        terms.extend([(of_stiffness, pencil.stiffness(), 1), (of_mass, pencil.mass(), pencil.block())]);
        MatrixSum::new(terms)
    }

    /// Computes the residual for an eigenvalue: real and imaginary part of a, then of b.
    fn gather(&mut self, mode: &StageMode, residuals: &[Vec<f64>]) {
        let n = self.equations.n_rows();
        self.parts.iter_mut().for_each(|part| part.fill(0.0));
        for (left, residual) in mode.left.iter().zip(residuals) {
            let (a, b) = residual[DISPLACEMENTS..][..2 * n].split_at(n);
            let [a_re, a_im, b_re, b_im] = &mut self.parts;
            add(left.re, a, a_re);
            add(left.re, b, b_re);
            if mode.paired {
                add(left.im, a, a_im);
                add(left.im, b, b_im);
            }
        }
    }

    /// Computes (a, b) <- (P x, M (x - a) / z) with x from the factor; returns x*K x / 2 + (x - a)*M (x -
    /// a) / (2 |z|^2).
    fn solve(&mut self, at: usize, z: Complex<f64>) -> f64 {
        let Self { equations, factors, parts: [a_re, a_im, b_re, b_im], product, real, complex, .. } = self;
        match &factors[at] {
            StepFactor::Real(factor) => {
                let [x, scratch] = real;
                weigh_damped(equations, z.re, a_re, product, [x, scratch]);
                x.iter_mut().zip(&*product).zip(&*b_re).for_each(|((x, m), b)| *x = z.re * b + m);
                factor.solve_in_place(1, x, scratch);
                a_re.iter_mut().zip(&*x).for_each(|(a, x)| *a = (x - *a) / z.re);
                equations.weigh(a_re, b_re);
                let kinetic = half_product(a_re, b_re);
                a_re.copy_from_slice(x);
                equations.take_rigid(a_re);
                kinetic + equations.elastic_energy(a_re)
            }
            StepFactor::Complex(factor) => {
                let [x, scratch] = complex;
                let [more, other] = real;
                for ((x, re), im) in x.iter_mut().zip(&*b_re).zip(&*b_im) {
                    *x = z * Complex::new(*re, *im);
                }
                // Add M a, then z D a.
                equations.weigh(a_re, product);
                equations.weigh(a_im, more);
                add_complex(Complex::new(1.0, 0.0), product, more, x);
                if damp(equations, a_re, product, other) {
                    damp(equations, a_im, more, other);
                    add_complex(z, product, more, x);
                }
                factor.solve_in_place(1, x, scratch);
                for ((x, re), im) in x.iter().zip(&mut *a_re).zip(&mut *a_im) {
                    let v = (x - Complex::new(*re, *im)) / z;
                    (*re, *im) = (v.re, v.im);
                }
                equations.weigh(a_re, b_re);
                equations.weigh(a_im, b_im);
                let kinetic = half_product(a_re, b_re) + half_product(a_im, b_im);
                for ((x, re), im) in x.iter().zip(&mut *a_re).zip(&mut *a_im) {
                    (*re, *im) = (x.re, x.im);
                }
                equations.take_rigid(a_re);
                equations.take_rigid(a_im);
                kinetic + equations.elastic_energy(a_re) + equations.elastic_energy(a_im)
            }
        }
    }

    /// Distributes the parts to the stages.
    fn spread(&mut self, mode: &StageMode) {
        let n = self.equations.n_rows();
        let twice = if mode.paired { 2.0 } else { 1.0 };
        let [a_re, a_im, b_re, b_im] = &self.parts;
        for (right, stage) in mode.right.iter().zip(&mut self.corrected) {
            let (u, w) = stage.split_at_mut(n);
            add(twice * right.re, a_re, u);
            add(twice * right.re, b_re, w);
            if mode.paired {
                add(-twice * right.im, a_im, u);
                add(-twice * right.im, b_im, w);
            }
        }
    }
}

fn factored<T: Scalar>(sum: &MatrixSum<'_, T>, equations: &NodalEquations<'_>) -> Option<SparseLdl<T>> {
    SparseLdl::of_sum(sum, &equations.model.pencil())
}

/// Computes y = D x with the damping of the model; returns true if the model has damping.
fn damp(equations: &NodalEquations<'_>, x: &[f64], y: &mut [f64], workspace: &mut [f64]) -> bool {
    match equations.damping {
        Some(Damping::Rayleigh { alpha, beta }) => {
            equations.weigh(x, workspace);
            multiply_vector(equations.stiffness(), 1, x, y);
            y.iter_mut().zip(workspace).for_each(|(y, m)| *y = *beta * *y + alpha * *m);
            true
        }
        Some(Damping::Matrix(damping)) => {
            multiply_vector(damping, 1, x, y);
            true
        }
        Some(Damping::Ratio(_) | Damping::Bands(_)) | None => false,
    }
}

/// Computes y = (M + z D) x for a real z.
fn weigh_damped(
    equations: &NodalEquations<'_>,
    z: f64,
    x: &[f64],
    y: &mut [f64],
    workspace: [&mut Vec<f64>; 2],
) {
    let [damped, workspace] = workspace;
    equations.weigh(x, y);
    if damp(equations, x, damped, workspace) {
        add(z, damped, y);
    }
}

/// Returns x'y / 2.
fn half_product(x: &[f64], y: &[f64]) -> f64 {
    0.5 * x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>()
}

/// Computes y += factor x.
fn add(factor: f64, x: &[f64], y: &mut [f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y += factor * x);
}

/// Computes y += factor (re + i im).
fn add_complex(factor: Complex<f64>, re: &[f64], im: &[f64], y: &mut [Complex<f64>]) {
    for ((y, re), im) in y.iter_mut().zip(re).zip(im) {
        *y += factor * Complex::new(*re, *im);
    }
}
