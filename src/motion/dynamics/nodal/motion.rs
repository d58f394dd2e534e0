//! The nodal equations under loads as a system that is integrated.

use super::NodalEvaluation;
use super::equations::NodalEquations;
use super::state::{ANGULAR, ATTITUDE, DISPLACEMENTS, LINEAR, attitude};
use crate::motion::dynamics::Orientation;
use crate::numerics::integration::{Failure, System};
use nalgebra::{Vector3, Vector6};

/// Deformation that is nothing, relative to the size of the body: the scale of a body at rest.
const NOTHING: f64 = 1e-9;

/// y' = f(t, y) of all nodes, with y as [`NodalEquations::dimension`] says.
///
/// The error of a step is measured in energy: with E the kinetic energy about the centre of mass (estimated with the diagonal of M)
/// and the elastic energy, and n entries of y,
///
/// ```text
/// u: sqrt(2 E / (n K_ii))    w: sqrt(2 E M_ii / n)    P, L: sqrt(2 E m / n), sqrt(2 E I / n)    G, D: length / sqrt(n)    e: 1 / sqrt(n)
/// ```
///
/// so that the mean square of error over scale is the energy of the error relative to E, with the diagonals of K and M in place of the
/// matrices: strict for soft modes, whose u has less energy than that. A body at rest has in place of E what deforms it by 1e-9 of its
/// size.
#[derive(Debug)]
pub struct NodalMotion<'e, L> {
    evaluation: NodalEvaluation<'e>,
    loads: L,
    stiffness: Vec<f64>,
    mass: Vec<f64>,
}

impl<'e> NodalMotion<'e, fn(f64, &mut NodalEvaluation<'e>)> {
    /// A body without loads.
    pub fn free(equations: &'e NodalEquations<'e>) -> Self {
        Self::new(equations, |_, _| {})
    }
}

impl<'e, L: FnMut(f64, &mut NodalEvaluation<'e>)> NodalMotion<'e, L> {
    /// A body under `loads`, which are added at a time and to an evaluation that is set to the state.
    pub fn new(equations: &'e NodalEquations<'e>, loads: L) -> Self {
        let positive = |diagonal: Vec<f64>| {
            let mean = diagonal.iter().sum::<f64>() / diagonal.len() as f64;
            diagonal.into_iter().map(|d| if d > 0.0 { d } else { mean }).collect()
        };
        Self {
            evaluation: NodalEvaluation::new(equations),
            loads,
            stiffness: positive(equations.stiffness().diagonal()),
            mass: positive(equations.model.pencil().mass_diagonal()),
        }
    }

    /// The body at a state, under its loads.
    ///
    /// # Errors
    /// [`Failure::Rates`] as [`NodalEvaluation::set`].
    pub fn evaluate(&mut self, time: f64, state: &[f64]) -> Result<&mut NodalEvaluation<'e>, Failure> {
        self.evaluation.set(state)?;
        (self.loads)(time, &mut self.evaluation);
        Ok(&mut self.evaluation)
    }

    /// E.
    fn energy(&self, state: &[f64]) -> f64 {
        let body = self.evaluation.equations;
        let (frame, u, w) = body.parts(state);
        let axes = attitude(frame).normalised().axes();
        let linear = Vector3::from_column_slice(&frame[LINEAR..LINEAR + 3]) / body.rigid_mass[(0, 0)];
        let drift = body.in_model(&axes.tr_mul(&linear), &Vector3::zeros());
        let about_centre = |((w, mass_rigid), mass): ((&f64, &[f64; 6]), &f64)| {
            (w - Vector6::from(*mass_rigid).dot(&drift)).powi(2) / mass
        };
        let kinetic: f64 = w.iter().zip(&body.mass_rigid).zip(&self.mass).map(about_centre).sum();
        let least: f64 = self.stiffness.iter().sum::<f64>() * (NOTHING * body.length).powi(2);
        (0.5 * kinetic + body.elastic_energy(u)).max(0.5 * least)
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

    /// Euler parameters of unit length; C u = 0.
    fn settle(&self, state: &mut [f64]) {
        let unit = attitude(state).normalised();
        state[ATTITUDE..LINEAR].copy_from_slice(&unit.0);
        let body = self.evaluation.equations;
        body.take_rigid(&mut state[DISPLACEMENTS..][..body.n_rows()]);
    }
}
