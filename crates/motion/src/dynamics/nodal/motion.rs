//! Nodal equations under loads as a system for integration.

use super::conditions::{Motions, add_motion, sums};
use super::equations::{NodalEquations, products};
use super::state_layout::{ANGULAR, ATTITUDE, DISPLACEMENTS, LINEAR, attitude};
use super::{NodalConfiguration, NodalEvaluation};
use crate::dynamics::{Orientation, Prescribed};
use crate::integration::{Failure, STAGES, StageMode, System};
use flexbody_linalg::{MatrixSum, Scalar, SparseLdl, larger, multiply_vector};
use flexbody_model::Damping;
use nalgebra::{Complex, Matrix3, Matrix6, Vector3, Vector6};

/// Deformation, relative to the size of the body, that sets the scale of a body at rest.
const DEFORMATION_AT_REST: f64 = 1e-9;

/// System y' = f(t, y) of all nodes, with y as defined by [`NodalEquations::dimension`].
///
/// The error of a step is measured in energy. With E the kinetic energy about the centre of mass (estimated
/// with the diagonal of M) plus the elastic energy, and n entries of y, the scales are
///
/// ```text
/// u: sqrt(2 E / (n K_ii))    w: sqrt(2 E M_ii / n)    P, L: sqrt(2 E m / n), sqrt(2 E I / n)
/// G, D: length / sqrt(n)    e: 1 / sqrt(n)
/// ```
///
/// so that the mean square of error over scale is the energy of the error relative to E, with the diagonals
/// of K and M in place of the matrices. This is strict for soft modes, whose u has less energy. For a body
/// at rest E is the energy of a deformation by 1e-9 of its size; for a driven body the energy of its spin
/// is added.
///
/// Implicit steps solve the stiff part, u' = P M^-1 w and w' = -K u - D u', with a sparse factor of
/// M + z D + z^2 K.
pub struct NodalMotion<'e, L> {
    pub(super) evaluation: NodalEvaluation<'e>,
    loads: L,
    drive: Option<Box<Drive<'e>>>,
    stiff: Stiff<'e>,
    stiffness: Vec<f64>,
    mass: Vec<f64>,
}

/// Prescribed velocities of the frame at a time, and their rates, for the axes of the frame in the world.
type Drive<'e> = dyn Fn(f64, &Matrix3<f64>) -> (Prescribed, Prescribed) + 'e;

impl<'e> NodalMotion<'e, fn(f64, &mut NodalEvaluation<'e>)> {
    /// Creates the motion of a body without loads.
    pub fn free(equations: &'e NodalEquations<'e>) -> Self {
        Self::new(equations, |_, _| {})
    }
}

impl<'e, L: FnMut(f64, &mut NodalEvaluation<'e>)> NodalMotion<'e, L> {
    /// Creates the motion of a body under `loads`. The closure gets the time and an evaluation set to the
    /// state, and adds the loads to it.
    pub fn new(equations: &'e NodalEquations<'e>, loads: L) -> Self {
        let positive = |diagonal: Vec<f64>| {
            let mean = diagonal.iter().sum::<f64>() / diagonal.len() as f64;
            diagonal.into_iter().map(|d| if d > 0.0 { d } else { mean }).collect()
        };
        Self {
            evaluation: NodalEvaluation::new(equations),
            loads,
            drive: None,
            stiff: Stiff::new(equations),
            stiffness: positive(equations.stiffness().diagonal()),
            mass: positive(equations.model.pencil().mass_diagonal()),
        }
    }

    /// Adds prescribed motion of the frame. `drive` gets the time and the axes of the frame in the world,
    /// and returns velocities V and omega in the axes of the frame, and their rates. The prescribed
    /// components must be the same at all times.
    pub fn driven(self, drive: impl Fn(f64, &Matrix3<f64>) -> (Prescribed, Prescribed) + 'e) -> Self {
        Self { drive: Some(Box::new(drive)), ..self }
    }

    /// Returns the prescribed velocities of the frame at a state, and their rates.
    fn given(&self, time: f64, state: &[f64]) -> (Prescribed, Prescribed) {
        let Some(drive) = &self.drive else {
            return (Prescribed::NOTHING, Prescribed::NOTHING);
        };
        let axes = attitude(state).normalised().axes() * self.evaluation.equations.frame.axes;
        drive(time, &axes)
    }

    /// Returns the body at a state, under its loads.
    ///
    /// # Errors
    /// The error [`Failure::Rates`] of [`NodalEvaluation::set`].
    pub fn evaluate(&mut self, time: f64, state: &[f64]) -> Result<&mut NodalEvaluation<'e>, Failure> {
        let (velocities, _) = self.given(time, state);
        self.evaluation.set_driven(state, &velocities)?;
        (self.loads)(time, &mut self.evaluation);
        Ok(&mut self.evaluation)
    }

    /// Computes V' and omega' in the axes of the frame, and u'' (N), at a state. Afterwards the evaluation
    /// holds the driving force of the frame ([`NodalEvaluation::driving_force`]).
    ///
    /// # Errors
    /// The error [`Failure::Rates`] of [`NodalEvaluation::set`].
    ///
    /// # Panics
    /// When the length of `udd` is not N.
    pub fn accelerations(
        &mut self,
        time: f64,
        state: &[f64],
        udd: &mut [f64],
    ) -> Result<(Vector3<f64>, Vector3<f64>), Failure> {
        let (_, rates) = self.given(time, state);
        self.evaluate(time, state)?;
        match rates {
            Prescribed::NOTHING => self.evaluation.accelerations(udd),
            _ => self.evaluation.driven_accelerations(&rates, udd),
        }
    }

    /// Returns [`NodalEvaluation::loaded_displacements`] at the last evaluated state.
    pub fn loaded_displacements(&mut self) -> &[f64] {
        self.evaluation.loaded_displacements()
    }

    /// Returns the evaluation at the last evaluated state.
    pub fn evaluation(&self) -> &NodalEvaluation<'e> {
        &self.evaluation
    }

    /// Returns the energy E of the scales.
    fn energy(&self, state: &[f64]) -> f64 {
        let body = self.evaluation.equations;
        let (frame, u, w) = body.parts(state);
        let axes = attitude(frame).normalised().axes();
        let mut linear = Vector3::from_column_slice(&frame[LINEAR..LINEAR + 3]) / body.rigid_mass[(0, 0)];
        let mut spin = 0.0;
        if self.drive.is_some() {
            // For a driven body w contains no motion of the frame.
            linear.fill(0.0);
            let omega = self.evaluation.omega;
            spin = omega.dot(&(body.rigid_mass.fixed_view::<3, 3>(3, 3) * omega));
        }
        let drift = body.in_model(&axes.tr_mul(&linear), &Vector3::zeros());
        let about_centre = |((w, mass_rigid), mass): ((&f64, &[f64; 6]), &f64)| {
            (w - Vector6::from(*mass_rigid).dot(&drift)).powi(2) / mass
        };
        let kinetic: f64 = w.iter().zip(&body.mass_rigid).zip(&self.mass).map(about_centre).sum();
        let least: f64 = self.stiffness.iter().sum::<f64>() * (DEFORMATION_AT_REST * body.length).powi(2);
        (0.5 * (kinetic + spin) + body.elastic_energy(u)).max(0.5 * least)
    }
}

impl<'e, L: FnMut(f64, &mut NodalEvaluation<'e>)> System for NodalMotion<'e, L> {
    fn dimension(&self) -> usize {
        self.evaluation.equations.dimension()
    }

    fn rates(&mut self, time: f64, state: &[f64], rates: &mut [f64]) -> Result<(), Failure> {
        self.evaluate(time, state)?.rates(rates)
    }

    fn scales(&self, state: &[f64], scales: &mut [f64]) {
        let body = self.evaluation.equations;
        let share = 2.0 * self.energy(state) / scales.len() as f64;
        let one = (scales.len() as f64).sqrt().recip();
        let (frame, nodes) = scales.split_at_mut(DISPLACEMENTS);
        let inertia = body.rigid_mass.diagonal().fixed_rows::<3>(3).amax();
        frame[..ATTITUDE].fill(body.length * one);
        frame[ATTITUDE..LINEAR].fill(one);
        frame[LINEAR..ANGULAR].fill((share * body.rigid_mass[(0, 0)]).sqrt());
        frame[ANGULAR..].fill((share * inertia).sqrt());
        let (u, w) = nodes.split_at_mut(body.n_rows());
        u.iter_mut().zip(&self.stiffness).for_each(|(scale, k)| *scale = (share / k).sqrt());
        w.iter_mut().zip(&self.mass).for_each(|(scale, m)| *scale = (share * m).sqrt());
    }

    /// Corrects the stages. Returns the energy of the corrections of u and w relative to E of the step, and
    /// of the frame in its scales.
    fn correct_stages(
        &mut self,
        h: f64,
        modes: &[StageMode],
        scales: &[f64],
        residuals: &mut [Vec<f64>],
    ) -> Result<Option<f64>, Failure> {
        let energy = self.stiff.correct(h, modes, residuals)?;
        let of_step = 0.5 * scales.len() as f64 * self.stiffness[0] * scales[DISPLACEMENTS].powi(2);
        let frame = residuals.iter().flat_map(|residual| residual[..DISPLACEMENTS].iter().zip(scales));
        let frame: f64 = frame.map(|(residual, scale)| (residual / scale).powi(2)).sum();
        Ok(Some((energy / of_step + frame / (residuals.len() * scales.len()) as f64).sqrt()))
    }

    /// Scales the Euler parameters to unit length and enforces C u = 0 and, for a driven body, R'w = 0.
    fn settle(&self, state: &mut [f64]) {
        let unit = attitude(state).normalised();
        state[ATTITUDE..LINEAR].copy_from_slice(&unit.0);
        let body = self.evaluation.equations;
        let (u, w) = state[DISPLACEMENTS..].split_at_mut(body.n_rows());
        body.take_rigid(u);
        if self.drive.is_some() {
            body.take_conditions(w);
        }
    }
}

// Static equilibrium of the nodal deformation with the loads and the motion at a given time.

/// Limit of the number of steps.
const MAX_STEPS: usize = 300;
/// Size of a step, relative to the largest displacement, at which the iteration ends.
const STEP_TOLERANCE: f64 = 1e-12;

/// Relative size below which steps that no longer shrink are rounding of K u.
const NEAR_ROUNDING: f64 = 1e-6;

/// Step size that counts as rounding without loads, relative to the extent of the body plus the distance
/// that it travels while it oscillates by one radian.
const STEP_ROUNDING: f64 = 1e-14;

/// Shift of K relative to the square of the first circular frequency. A step of a free body leaves one
/// tenth of the remaining distance or less.
const SHIFT: f64 = 0.1;

/// Shift for a held body, whose first frequency may be far below that of the free body: K with the
/// conditions is definite by itself.
const SHIFT_HELD: f64 = 1e-3;

/// Solver of steps x with (K + sigma M) x = M u'' + C'mu, C x = 0.
struct Steps {
    factor: SparseLdl,
    /// A = (K + sigma M)^-1 C', and (C A)^-1.
    answered: Motions,
    inverse: Matrix6<f64>,
}

impl Steps {
    /// Creates the solver with sigma = `shift`. Returns `None` if the factorisation fails, or if the
    /// conditions depend on each other.
    fn new(body: &NodalEquations<'_>, shift: f64) -> Option<Self> {
        let pencil = body.model.pencil();
        let terms = vec![(1.0, pencil.stiffness(), 1), (shift, pencil.mass(), pencil.block())];
        let factor = SparseLdl::of_sum(&MatrixSum::new(terms), &pencil)?;
        let n = body.n_rows();
        let (mut answered, mut scratch) = (vec![[0.0; 6]; n], vec![0.0; n]);
        for &motion in body.moving {
            let mut column: Vec<f64> = body.conditions.iter().map(|row| row[motion]).collect();
            factor.solve_in_place(1, &mut column, &mut scratch);
            answered.iter_mut().zip(column).for_each(|(row, value)| row[motion] = value);
        }
        let inverse = products(&body.conditions, &answered, body.moving).try_inverse()?;
        Some(Self { factor, answered, inverse })
    }

    /// Replaces the forces by the step.
    fn solve(&self, body: &NodalEquations<'_>, forces: &mut [f64], scratch: &mut [f64]) {
        self.factor.solve_in_place(1, forces, scratch);
        let mu = self.inverse * sums(&body.conditions, forces);
        add_motion(&self.answered, -1.0, &mu, forces);
    }
}

impl<'e, L: FnMut(f64, &mut NodalEvaluation<'e>)> NodalMotion<'e, L> {
    /// Returns `start` with the deformation in equilibrium at `time`: u'' = 0 with u' = 0, by steps u += x
    /// with (K + sigma M) x = M u'' + C'mu and C x = 0.
    ///
    /// * `softest`: square of the first circular frequency.
    ///
    /// # Errors
    /// [`Failure::Rates`] if there is no equilibrium: the spin removes the stiffness of some motion, or K
    /// is not positive semidefinite.
    pub fn settled(
        &mut self,
        time: f64,
        start: &NodalConfiguration,
        softest: f64,
    ) -> Result<NodalConfiguration, Failure> {
        let lost = |reason: &'static str| Failure::Rates { reason };
        let body = self.evaluation.equations;
        let shift = if body.is_held { SHIFT_HELD } else { SHIFT };
        let steps = Steps::new(body, shift * softest);
        let steps = steps.ok_or_else(|| lost("the stiffness of the nodes cannot be factored"))?;
        let n = body.n_rows();
        let (mut step, mut acceleration, mut scratch) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let mut settled = start.clone();
        settled.ud.fill(0.0);
        let least = STEP_ROUNDING * (body.length + start.velocity.norm() / softest.sqrt());
        let mut before = f64::INFINITY;
        for _ in 0..MAX_STEPS {
            let state = body
                .state(&settled)
                .map_err(|_| lost("the deformation does not fulfil the reference conditions"))?;
            // Residual M u'' with u' = 0, and the step (K + sigma M) x = M u'' + C'mu.
            self.accelerations(time, &state, &mut acceleration)?;
            body.weigh(&acceleration, &mut step);
            steps.solve(body, &mut step, &mut scratch);
            let size = |x: &[f64]| x.iter().fold(0.0, |largest: f64, x| larger(largest, x.abs()));
            if size(&step) <= least {
                return Ok(settled);
            }
            settled.u.iter_mut().zip(&step).for_each(|(u, step)| *u += step);
            // Accept a small step, or one at rounding level that no longer shrinks.
            let (size, largest) = (size(&step), size(&settled.u));
            if size <= STEP_TOLERANCE * largest || (size <= NEAR_ROUNDING * largest && size > 0.5 * before) {
                return Ok(settled);
            }
            before = size;
        }
        Err(lost("the iteration diverges under the forces on the deformed body"))
    }
}

// Stiff part of the nodal equations, for implicit steps.

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
struct Stiff<'m> {
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
