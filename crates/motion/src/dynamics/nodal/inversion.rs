//! Velocities from the momenta of turned nodes.

use super::conditions::{add_motion, sums};
use super::directors::Workspace;
use super::drive::LOST;
use super::equations::NodalEquations;
use super::kinetics::Kinetics;
use crate::dynamics::kernels::{add_scaled, dot};
use crate::integration::Failure;
use flexbody_linalg::multiply_vector;
use nalgebra::{LU, Matrix6, U6, Vector6};

/// Relative size of the residual, in the energy norm, at which iterations end: rounding.
const SOLVED: f64 = 1e-15;

/// Limit of the iterations. Their number grows with the rotations of the nodes, to 30 at rotations of 0.3.
/// Beyond the limit the evaluation fails.
const MAX_ITERATIONS: usize = 200;

/// Failure for nodes turned so far that their mass is not positive definite.
const MASS_NOT_DEFINITE: Failure =
    Failure::Rates { reason: "the nodes are rotated so far that their mass matrix is not positive definite" };

/// B'C' at the displacements and its transpose, factored.
#[derive(Debug, Clone)]
pub(super) struct Conditions {
    pub plain: LU<f64, U6, U6>,
    pub transposed: LU<f64, U6, U6>,
}

impl Conditions {
    pub(super) fn new(matrix: &Matrix6<f64>) -> Self {
        Self { plain: matrix.lu(), transposed: matrix.transpose().lu() }
    }
}

/// Mass of turned nodes as a symmetric operator on N rows.
///
/// A vector v of all rows is a motion nu = (C B)^-1 C v of the frame and rates u' = T (v - B nu) with C u'
/// = 0. With its momenta w and (p, h),
///
/// ```text
/// M(u) v = T'w + C'(B'C')^-1 ((p, h) - B'T'w)
/// ```
///
/// is the gradient of T(v). w of a state is defined up to C'mu: v follows from M(u) v = w + C'(B'C')^-1
/// ((p, h) - B'w) by conjugate gradients with the factor of M = M(0) as preconditioner. T moves massless
/// motions to static equilibrium; it is the identity if these turn no node with directors.
#[derive(Debug, Clone)]
pub(super) struct TurnedMass<'e> {
    pub kinetics: Kinetics<'e>,
    body: &'e NodalEquations<'e>,
    /// True if T is not the identity.
    restricts: bool,
    conditions: Conditions,
    u: Vec<f64>,
    rates: Vec<f64>,
    residual: Vec<f64>,
    preconditioned: Vec<f64>,
    direction: Vec<f64>,
    product: Vec<f64>,
    scratch: Vec<f64>,
    workspace: Workspace,
}

/// Prescribed components of (V, omega), or of their rates.
#[derive(Debug, Clone, Copy)]
pub(super) struct Given {
    pub components: [bool; 6],
    /// Values of the prescribed components in model axes; zero in the free components.
    pub motion: Vector6<f64>,
}

impl Given {
    /// Prescribes no component.
    pub(super) fn nothing() -> Self {
        Self { components: [false; 6], motion: Vector6::zeros() }
    }

    /// Returns `free` in the free components and `own` in the prescribed ones.
    pub(super) fn or_own(&self, free: &Vector6<f64>, own: &Vector6<f64>) -> Vector6<f64> {
        Vector6::from_fn(|k, _| if self.components[k] { own[k] } else { free[k] })
    }

    /// Computes x <- v with the prescribed motion, and M(u) v = x + C'(B'C')^-1 (rest of the momenta) in
    /// the free components.
    pub(super) fn solve(
        &self,
        turned: &mut TurnedMass<'_>,
        momenta: &Vector6<f64>,
        own: &Vector6<f64>,
        x: &mut [f64],
    ) -> Result<Vector6<f64>, Failure> {
        turned.complete(&self.or_own(momenta, own), x)?;
        if self.components.contains(&true) {
            turned.solve_given(x, self.components, &self.motion)?
        } else {
            turned.solve(x)?
        }
        turned.frame_of(x)
    }
}

/// Prescribed components of the frame motion, and the matrices that constrain it.
#[derive(Debug, Clone)]
struct Constraint {
    components: [bool; 6],
    /// (B'C')^-1, and the inverse of N'M^-1 N for the columns N of C'(B'C')^-1 of prescribed components.
    multipliers: Matrix6<f64>,
    answer: Matrix6<f64>,
}

impl<'e> TurnedMass<'e> {
    /// Creates the operator for the equations of `body`, at rest without deformation; `None` if no rotation
    /// carries mass.
    pub(super) fn new(body: &'e NodalEquations<'e>) -> Option<Self> {
        let directors = body.directors.as_ref()?;
        let zeros = || vec![0.0; body.n_rows()];
        Some(Self {
            kinetics: Kinetics::new(body, directors),
            body,
            restricts: body.massless.turns(directors),
            conditions: Conditions::new(&body.conditions_rigid),
            u: zeros(),
            rates: zeros(),
            residual: zeros(),
            preconditioned: zeros(),
            direction: zeros(),
            product: zeros(),
            scratch: zeros(),
            workspace: body.massless.workspace(),
        })
    }

    /// Sets the displacements `u` and their `conditions`.
    pub(super) fn turn(&mut self, u: &[f64], conditions: &Conditions) {
        self.u.copy_from_slice(u);
        self.conditions.clone_from(conditions);
        self.kinetics.turn(u);
    }

    /// Computes w <- w + C'(B'C')^-1 (momenta - B'w).
    pub(super) fn complete(&self, momenta: &Vector6<f64>, w: &mut [f64]) -> Result<(), Failure> {
        let missing = momenta - self.body.onto_frame(&self.u, w);
        let mu = self.conditions.plain.solve(&missing).ok_or(LOST)?;
        add_motion(&self.body.conditions, 1.0, &mu, w);
        Ok(())
    }

    /// Returns nu = (C B)^-1 C v.
    fn frame_of(&self, v: &[f64]) -> Result<Vector6<f64>, Failure> {
        let nu = sums(&self.body.conditions, v);
        self.conditions.transposed.solve(&nu).ok_or(LOST)
    }

    /// Computes x <- T'x.
    pub(super) fn restrict(&mut self, x: &mut [f64]) {
        if !self.restricts {
            return;
        }
        self.scratch.fill(0.0);
        self.body.massless.add_static(x, &mut self.scratch, &mut self.workspace);
        multiply_vector(self.body.stiffness(), 1, &self.scratch, &mut self.rates);
        x.iter_mut().zip(&self.rates).for_each(|(x, taken)| *x -= taken);
    }

    /// Computes w = T'dT/du' of v and returns (p, h).
    pub(super) fn momenta(&mut self, v: &[f64], w: &mut [f64]) -> Result<Vector6<f64>, Failure> {
        // Split v into the frame motion and the deformation rates in static equilibrium.
        let nu = self.frame_of(v)?;
        self.rates.copy_from_slice(v);
        self.body.add_frame(-1.0, &nu, &self.u, &mut self.rates);
        if self.restricts {
            self.body.massless.project(self.body.stiffness(), &mut self.rates, &mut self.workspace);
        }
        let momenta = self.kinetics.momenta(&nu, &self.rates, w);
        self.restrict(w);
        Ok(momenta)
    }

    /// Computes product = M(u) v.
    fn multiply(&mut self, v: &[f64], product: &mut [f64]) -> Result<(), Failure> {
        let momenta = self.momenta(v, product)?;
        self.complete(&momenta, product)
    }

    /// Computes x <- M(u)^-1 x for a body without prescribed motion.
    pub(super) fn solve(&mut self, x: &mut [f64]) -> Result<(), Failure> {
        self.residual.copy_from_slice(x);
        x.fill(0.0);
        self.iterate(x, 0.0, None)
    }

    /// Computes x <- v with the prescribed `components` of the frame motion equal to `motion`, and M(u) v =
    /// x up to forces on these components.
    ///
    /// * `motion`: zero in the free components.
    fn solve_given(
        &mut self,
        x: &mut [f64],
        components: [bool; 6],
        motion: &Vector6<f64>,
    ) -> Result<(), Failure> {
        // Start from the rigid motion with the prescribed components, whose momentum leaves the residual.
        let given = self.given(components)?;
        self.residual.copy_from_slice(x);
        x.fill(0.0);
        // x = B motion.
        self.body.add_frame(1.0, motion, &self.u, x);
        let mut product = std::mem::take(&mut self.product);
        let multiplied = self.multiply(x, &mut product);
        self.residual.iter_mut().zip(&product).for_each(|(r, product)| *r -= product);
        let energy = dot(x, &product);
        self.product = product;
        multiplied?;
        self.iterate(x, energy, Some(&given))
    }

    fn given(&self, components: [bool; 6]) -> Result<Constraint, Failure> {
        // N'M^-1 N of the prescribed components; the free ones get the identity, so that the inverse exists.
        let multipliers = self.conditions.plain.solve(&Matrix6::identity()).ok_or(LOST)?;
        let mut answer = multipliers.transpose() * self.body.answer * multipliers;
        for (k, _) in components.iter().enumerate().filter(|(_, given)| !**given) {
            answer.row_mut(k).fill(0.0);
            answer.column_mut(k).fill(0.0);
            answer[(k, k)] = 1.0;
        }
        Ok(Constraint { components, multipliers, answer: answer.try_inverse().ok_or(LOST)? })
    }

    /// Runs conjugate gradients from x, whose residual is set, to rounding of the larger of `energy` and
    /// the energy of the correction.
    fn iterate(&mut self, x: &mut [f64], energy: f64, given: Option<&Constraint>) -> Result<(), Failure> {
        self.precondition(given)?;
        let mut square = dot(&self.residual, &self.preconditioned);
        let enough = SOLVED * SOLVED * square.max(energy);
        self.direction.copy_from_slice(&self.preconditioned);
        for _ in 0..MAX_ITERATIONS {
            if square <= enough {
                return Ok(());
            }
            // Step of least energy along the search direction.
            let curvature = self.curvature()?;
            if curvature.is_nan() || curvature <= 0.0 {
                return Err(MASS_NOT_DEFINITE);
            }
            let step = square / curvature;
            add_scaled(step, &self.direction, x);
            add_scaled(-step, &self.product, &mut self.residual);
            self.precondition(given)?;
            // Next direction, conjugate to the previous one.
            let next = dot(&self.residual, &self.preconditioned);
            let part = next / square;
            self.direction.iter_mut().zip(&self.preconditioned).for_each(|(p, z)| *p = z + part * *p);
            square = next;
        }
        Err(MASS_NOT_DEFINITE)
    }

    /// Computes the product of the mass with the direction; returns its inner product with the direction.
    fn curvature(&mut self) -> Result<f64, Failure> {
        let (direction, mut product) =
            (std::mem::take(&mut self.direction), std::mem::take(&mut self.product));
        let multiplied = self.multiply(&direction, &mut product);
        (self.direction, self.product) = (direction, product);
        multiplied?;
        Ok(dot(&self.direction, &self.product))
    }

    /// Computes the residual times M^-1 without motion in the prescribed components. Forces on these
    /// components are removed from both, and rounding on massless motions from the residual.
    fn precondition(&mut self, given: Option<&Constraint>) -> Result<(), Failure> {
        // Residual without rounding on massless motions, times M^-1.
        let mut residual = std::mem::take(&mut self.residual);
        self.restrict(&mut residual);
        self.residual = residual;
        self.preconditioned.copy_from_slice(&self.residual);
        self.body.solve(&mut self.preconditioned, &mut self.scratch);
        let Some(given) = given else { return Ok(()) };
        // Remove the motion of the prescribed components with the forces that hold them.
        let nu = self.frame_of(&self.preconditioned)?;
        let moved = Vector6::from_fn(|k, _| if given.components[k] { nu[k] } else { 0.0 });
        let mu = given.multipliers * (given.answer * moved);
        add_motion(&self.body.conditions, -1.0, &mu, &mut self.residual);
        add_motion(&self.body.answered, -1.0, &mu, &mut self.preconditioned);
        Ok(())
    }
}
