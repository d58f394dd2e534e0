//! Static equilibrium of the deformation with the loads and the motion at time zero.

use super::Scene;
use super::surroundings::SceneForces;
use crate::dynamics::{Configuration, EquationsOfMotion, Motion};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_body::flex_body::FlexBody;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Value, or the reason why there is no equilibrium.
type Outcome<T> = std::result::Result<T, String>;

/// Deformation and its residual.
type Trial = (DVector<f64>, DVector<f64>);

/// Limit of Newton steps. Each step squares the error, so that more steps mean divergence.
const MAX_STEPS: usize = 40;

/// Limit of halvings of a Newton step that does not reduce the residual.
const MAX_HALVINGS: usize = 30;

/// Residual of the equilibrium relative to its largest summand, in the norm of K_ff^-1, at which Newton's
/// method ends.
const RESIDUAL: f64 = 1e-12;

/// Residual below which an equilibrium is accepted if Newton's method cannot improve it further, the rest
/// being rounding.
const ROUNDING: f64 = 1e-10;

/// Step of the finite differences in modal coordinates, relative to the size of the deformation in the norm
/// of K_ff.
const DIFFERENCE: f64 = 1e-4;

/// Sets the deformation q of `start` to equilibrium, q'' = 0 with q' = 0, by Newton's method on r(q) = m_ff
/// q''.
///
/// The frame moves as given by the scene and the loads. Except for torques, r is a polynomial of low degree
/// in q; its derivatives are central differences.
///
/// # Errors
/// FB540 if there is no equilibrium near the undeformed body, or if the equilibrium is unstable.
pub(super) fn settle(
    body: &FlexBody,
    scene: &Scene,
    equations: &EquationsOfMotion,
    forces: &SceneForces<'_>,
    start: &mut Configuration,
) -> Result<()> {
    let none = |why: &str| {
        let message = format!("`{}` has no static deformation at time zero: {why}", scene.name);
        Error::from(
            Diagnostic::new(Code::SimulationStopped, message)
                .with_help("remove `deformation` from [initial]"),
        )
    };
    let mut balance = Balance::new(body, equations, forces, start.clone())
        .ok_or_else(|| none("the stiffness of the modes is not positive definite"))?;
    balance.solve().map_err(|reason| none(&reason))?;
    start.q.copy_from_slice(balance.start.q.as_slice());
    Ok(())
}

/// Modal forces r(q) of a body that does not vibrate.
struct Balance<'a> {
    equations: &'a EquationsOfMotion,
    forces: &'a SceneForces<'a>,
    start: Configuration,
    mass: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    factor: Cholesky<f64, Dyn>,
    /// Upper bound, in the norm of K_ff^-1, of inertia and gravity forces on the whole mass; forces that
    /// are small compared with it are rounding.
    of_mass: f64,
}

impl<'a> Balance<'a> {
    fn new(
        body: &FlexBody,
        equations: &'a EquationsOfMotion,
        forces: &'a SceneForces<'a>,
        start: Configuration,
    ) -> Option<Self> {
        let (invariants, n) = (body.invariants(), body.n_modes());
        let stiffness = invariants.symmetric_stiffness();
        let factor = stiffness.clone().cholesky()?;
        let m = invariants.modal_mass();
        let mut balance = Self {
            equations,
            forces,
            start,
            mass: DMatrix::from_fn(n, n, |i, j| m[(i, j)]),
            stiffness,
            factor,
            of_mass: 0.0,
        };
        balance.of_mass = balance.largest_load(body);
        Some(balance)
    }

    /// Returns sqrt(m) (|a| + r |omega|^2 + r |alpha|) / Omega_1 at the start, with the acceleration a of
    /// the origin and gravity, and the radius of gyration r.
    fn largest_load(&self, body: &FlexBody) -> f64 {
        let (mut motion, state) = Motion::new(self.equations, self.forces, &self.start);
        let Ok(rates) = motion.accelerations(0.0, &state) else { return 0.0 };
        let (linear, angular, _) = self.equations.split(rates);
        let mass = body.invariants().mass();
        let radius = (body.invariants().inertia().trace() / mass).sqrt();
        let acceleration = linear.norm() + self.forces.gravity_size();
        let turning = self.start.omega.norm_squared() + angular.norm();
        let lowest = body.modes().eigenvalue.first().copied().unwrap_or(1.0);
        mass.sqrt() * (acceleration + radius * turning) / lowest.sqrt()
    }

    /// Returns r(q) = m_ff q''.
    fn residual(&mut self, q: &DVector<f64>) -> Outcome<DVector<f64>> {
        self.start.q.copy_from_slice(q.as_slice());
        let (mut motion, state) = Motion::new(self.equations, self.forces, &self.start);
        let rates = motion.accelerations(0.0, &state).map_err(|failure| failure.to_string())?;
        Ok(&self.mass * DVector::from_column_slice(self.equations.split(rates).2))
    }

    /// Returns |f| in the norm of K_ff^-1.
    fn norm(&self, force: &DVector<f64>) -> f64 {
        force.dot(&self.factor.solve(force)).max(0.0).sqrt()
    }

    /// Returns the largest summand of the equilibrium at q with the residual r: elastic forces, all other
    /// forces, and the bound of forces on the whole mass.
    fn scale(&self, q: &DVector<f64>, residual: &DVector<f64>) -> f64 {
        let elastic = &self.stiffness * q;
        self.norm(&elastic).max(self.norm(&(residual + elastic))).max(self.of_mass)
    }

    /// Returns dr/dq by central differences.
    fn derivative(&mut self, q: &DVector<f64>, size: f64) -> Outcome<DMatrix<f64>> {
        let n = q.len();
        let mut derivative = DMatrix::zeros(n, n);
        for j in 0..n {
            let step = DIFFERENCE * size / self.stiffness[(j, j)].sqrt();
            let moved = |step: f64| {
                let mut moved = q.clone();
                moved[j] += step;
                moved
            };
            let change = self.residual(&moved(step))? - self.residual(&moved(-step))?;
            derivative.set_column(j, &(change / (2.0 * step)));
        }
        Ok(derivative)
    }

    fn solve(&mut self) -> Outcome<()> {
        let mut q = DVector::from_column_slice(&self.start.q);
        let mut residual = self.residual(&q)?;
        for _ in 0..MAX_STEPS {
            let (left, scale) = (self.norm(&residual), self.scale(&q, &residual));
            if left <= RESIDUAL * scale {
                return self.accept(&q, scale);
            }
            let derivative = self.derivative(&q, scale)?;
            let Some(step) = derivative.lu().solve(&-&residual) else {
                return Err("the spin makes the stiffness of some motion zero or negative".to_owned());
            };
            match self.shortened(&q, &step, left)? {
                Some((moved, rest)) => (q, residual) = (moved, rest),
                None if left <= ROUNDING * scale => return self.accept(&q, scale),
                None => break,
            }
        }
        Err("the iteration diverges under the forces on the deformed body".to_owned())
    }

    /// Returns the first of q + step, q + step / 2, ... with a residual smaller than `left`.
    fn shortened(&mut self, q: &DVector<f64>, step: &DVector<f64>, left: f64) -> Outcome<Option<Trial>> {
        for halvings in 0..MAX_HALVINGS {
            let moved = q + step * 0.5f64.powi(halvings as i32);
            // A state without accelerations is too far away.
            let Ok(rest) = self.residual(&moved) else { continue };
            if self.norm(&rest) < left {
                return Ok(Some((moved, rest)));
            }
        }
        Ok(None)
    }

    /// Accepts the equilibrium q if it is stable: all motions q'' = m_ff^-1 (dr/dq) q oscillate.
    fn accept(&mut self, q: &DVector<f64>, scale: f64) -> Outcome<()> {
        let size = if scale > 0.0 { scale } else { 1.0 };
        let derivative = self.derivative(q, size)?;
        self.start.q.copy_from_slice(q.as_slice());
        let lower = self.factor.l();
        let half = lower.solve_lower_triangular(&-derivative).expect("a factor");
        let relative = lower.solve_lower_triangular(&half.transpose()).expect("a factor");
        // Relative to K_ff, whose eigenvalues become 1.
        let relative = Mat::from_fn(relative.nrows(), relative.ncols(), |i, j| relative[(i, j)]);
        let eigenvalues = relative.eigenvalues();
        let stable = eigenvalues.is_ok_and(|values| values.iter().all(|value| value.re > 0.0));
        if stable {
            Ok(())
        } else {
            Err("the spin makes the stiffness of some motion zero or negative".to_owned())
        }
    }
}
