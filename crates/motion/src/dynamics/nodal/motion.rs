//! Nodal equations under loads as a system for integration.

use super::conditions::{Motions, add_motion, sums};
use super::equations::{NodalEquations, products};
use super::state::{ANGULAR, ATTITUDE, DISPLACEMENTS, LINEAR, attitude};
use super::stiff::Stiff;
use super::{NodalConfiguration, NodalEvaluation};
use crate::dynamics::{Orientation, Prescribed};
use crate::integration::{Failure, StageMode, System};
use flexbody_linalg::{MatrixSum, SparseLdl, larger};
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

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
