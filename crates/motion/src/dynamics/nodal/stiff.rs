//! The stiff part of the nodal equations, as implicit steps solve it.

use super::equations::NodalEquations;
use super::state::DISPLACEMENTS;
use crate::integration::{Failure, STAGES, StageMode};
use flexbody_linalg::{MatrixSum, Scalar, SparseLdl, multiply_vector};
use flexbody_model::Damping;
use nalgebra::Complex;

/// M + z D + z^2 K is singular to rounding, or too large for its ordering.
const SINGULAR: Failure = Failure::Rates {
    reason: "mass, damping and stiffness of the nodes cannot be factored for implicit steps",
};

/// u' = P M^-1 w, w' = -K u - D u' with P = I - R (C R)^-1 C: what is linear and fast in the nodal equations,
/// solved in the eigenvalues mu of an implicit method with the step h. What the stages lack, (a, b) in (u,
/// w), is corrected by
///
/// ```text
/// (M + z D + z^2 K) x = z b + M a + z D a,    z = h mu,    u: P x,    w: M (x - a) / z
/// ```
///
/// where K R = 0 and D R = 0, D being the damping of the model; that of modes is left to the iteration. This
/// is what is linear with mean axes; other conditions leave a constraint in M^-1 w that is left to the
/// iteration too, which then asks for steps below the shortest period.
#[derive(Debug)]
pub(super) struct Stiff<'m> {
    equations: &'m NodalEquations<'m>,
    /// Step that the factors are for.
    step: f64,
    factors: Vec<StepFactor>,
    /// Corrections of u and w of every stage.
    corrected: Vec<Vec<f64>>,
    /// Lacks and products in an eigenvalue: real and imaginary parts.
    parts: [Vec<f64>; 4],
    product: Vec<f64>,
    real: [Vec<f64>; 2],
    complex: [Vec<Complex<f64>>; 2],
}

/// M + z D + z^2 K.
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

    /// Corrections in place of what the stages lack; their energy, u'K u / 2 + w'M^-1 w / 2, on an average
    /// over the stages, at the most.
    pub(super) fn correct(
        &mut self,
        h: f64,
        modes: &[StageMode],
        lacks: &mut [Vec<f64>],
    ) -> Result<f64, Failure> {
        let n = self.equations.n_rows();
        if self.step != h || self.factors.len() != modes.len() {
            self.prepare(h, modes, lacks.len())?;
        }
        self.corrected.iter_mut().for_each(|stage| stage.fill(0.0));
        // Square roots of the energies of the stages: those of the parts, of which a pair counts twice, add
        // up at the most.
        let mut roots = [0.0; STAGES];
        for (at, mode) in modes.iter().enumerate() {
            self.gather(mode, lacks);
            let root = self.solve(at, mode.value * h).sqrt();
            self.spread(mode);
            let twice = if mode.paired { 2.0 } else { 1.0 };
            roots.iter_mut().zip(&mode.right).for_each(|(sum, right)| *sum += twice * right.norm() * root);
        }
        for (lack, corrected) in lacks.iter_mut().zip(&self.corrected) {
            lack[DISPLACEMENTS..][..2 * n].copy_from_slice(corrected);
        }
        Ok(roots.iter().map(|root| root * root).sum::<f64>() / lacks.len() as f64)
    }

    fn prepare(&mut self, h: f64, modes: &[StageMode], stages: usize) -> Result<(), Failure> {
        let n = self.equations.n_rows();
        self.factors.clear();
        for mode in modes {
            let z = mode.value * h;
            let factor = match mode.paired {
                true => factored(&self.sum(z), self.equations).map(StepFactor::Complex),
                false => factored(&self.sum(z.re), self.equations).map(StepFactor::Real),
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

    /// M + z D + z^2 K.
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

    /// What the stages lack in an eigenvalue: real and imaginary part of a, then of b.
    fn gather(&mut self, mode: &StageMode, lacks: &[Vec<f64>]) {
        let n = self.equations.n_rows();
        self.parts.iter_mut().for_each(|part| part.fill(0.0));
        for (left, lack) in mode.left.iter().zip(lacks) {
            let (a, b) = lack[DISPLACEMENTS..][..2 * n].split_at(n);
            let [a_re, a_im, b_re, b_im] = &mut self.parts;
            add(left.re, a, a_re);
            add(left.re, b, b_re);
            if mode.paired {
                add(left.im, a, a_im);
                add(left.im, b, b_im);
            }
        }
    }

    /// (a, b) <- (P x, M (x - a) / z), x from the factor; x*K x / 2 + (x - a)*M (x - a) / (2 |z|^2).
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
                // M a, then D a.
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

    /// Gives the parts back to the stages.
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

/// y = D x with the damping of the model; whether there is any.
fn damp(equations: &NodalEquations<'_>, x: &[f64], y: &mut [f64], room: &mut [f64]) -> bool {
    match equations.damping {
        Some(Damping::Rayleigh { alpha, beta }) => {
            equations.weigh(x, room);
            multiply_vector(equations.stiffness(), 1, x, y);
            y.iter_mut().zip(room).for_each(|(y, m)| *y = *beta * *y + alpha * *m);
            true
        }
        Some(Damping::Matrix(damping)) => {
            multiply_vector(damping, 1, x, y);
            true
        }
        Some(Damping::Ratio(_) | Damping::Bands(_)) | None => false,
    }
}

/// y = (M + z D) x for a real z.
fn weigh_damped(equations: &NodalEquations<'_>, z: f64, x: &[f64], y: &mut [f64], room: [&mut Vec<f64>; 2]) {
    let [damped, room] = room;
    equations.weigh(x, y);
    if damp(equations, x, damped, room) {
        add(z, damped, y);
    }
}

/// x'y / 2.
fn half_product(x: &[f64], y: &[f64]) -> f64 {
    0.5 * x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>()
}

/// y += factor x.
fn add(factor: f64, x: &[f64], y: &mut [f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y += factor * x);
}

/// y += factor (re + i im).
fn add_complex(factor: Complex<f64>, re: &[f64], im: &[f64], y: &mut [Complex<f64>]) {
    for ((y, re), im) in y.iter_mut().zip(re).zip(im) {
        *y += factor * Complex::new(*re, *im);
    }
}
