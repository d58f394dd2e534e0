//! Motion of one body in space as a system for integration.

use super::kernels::{add_scaled, dot};
use super::natural_modes::NaturalModes;
use super::prescribed::Prescribed;
use super::{Configuration, EquationsOfMotion, EulerParameters, Evaluation, Orientation, Place, Snapshot};
use crate::integration::{Failure, Oscillator, System};
use nalgebra::{Matrix3, Vector3, Vector6};
use pulp::NullaryFnOnce;

/// Smallest deformation, relative to the size of the body, that the scales assume, so that a body at rest
/// has a scale.
const LEAST_DEFORMATION: f64 = 1e-6;

/// Smallest scale of vibration relative to the scale of the whole internal motion.
const LEAST_VIBRATION: f64 = 1e-3;

/// External forces on a body, and prescribed motion.
pub trait Surroundings {
    /// Adds the generalised forces (F, tau, Q) in body axes at the state of `evaluation`
    /// ([`EquationsOfMotion`]).
    fn add_forces(&self, time: f64, place: &Place, evaluation: &Evaluation<'_>, forces: &mut [f64]);

    /// Returns the prescribed rigid motion of a frame with the given axes: velocities (V, omega) along
    /// these axes, and the rates of their components. The default prescribes nothing.
    fn prescribed(&self, _time: f64, _axes: &Matrix3<f64>) -> (Prescribed, Prescribed) {
        (Prescribed::NOTHING, Prescribed::NOTHING)
    }
}

/// Surroundings without forces, for a free body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EmptySpace;

impl Surroundings for EmptySpace {
    fn add_forces(&self, _: f64, _: &Place, _: &Evaluation<'_>, _: &mut [f64]) {}
}

/// The equations of motion of one body as a [`System`] in momenta:
///
/// ```text
/// y = (G, e, q, P, L, pi, D, W, j, k),    R = G + D,    (A'P, A'(L - D x P), pi) = Mc(q) nu
/// G' = P / m     D' = A (p - m V) / m     e' = G'omega / 4     q' = qd
/// P' = A F     L' = A tau + D x A F     pi' = dT/dq - K_ff q - D qd + Q
/// ```
///
/// in world axes, with the angular momentum L about a point G that starts at the origin R of the frame and
/// moves with P / m. P and L of a free body are constant entries of y, so that every method conserves the
/// momenta to rounding, for any mass matrix and frame; it is (6.3) of the theory with the rotation and the
/// translation of the frame separated. For a free body with its frame at the centre of mass D vanishes, and
/// the system is Hamiltonian on quaternions with a constant structure, which Gauss collocation preserves
/// (McLachlan, Modin, Verdier, Collective symplectic integrators, Nonlinearity 27, 2014).
///
/// W, j and k accumulate work and impulses for [`Snapshot::balance`]. A plane body uses the entries of its
/// plane.
pub struct Motion<'a> {
    evaluation: Evaluation<'a>,
    surroundings: &'a dyn Surroundings,
    /// Position of the origin at the start.
    reference: Vector3<f64>,
    size: Size,
    oscillators: Vec<Oscillator>,
    /// Coordinates of the oscillators; `None` if the modes themselves are the oscillators.
    natural: Option<NaturalModes>,
    momenta: Vec<f64>,
    forces: Vec<f64>,
    rates: Vec<f64>,
}

/// Mass, length and rates of a body, the scales of its motion.
#[derive(Debug, Clone)]
struct Size {
    mass: f64,
    /// Radius of gyration about the centre of mass.
    radius: f64,
    /// Stiffness of every mode; positive.
    stiffness: Vec<f64>,
    /// Circular frequency of the softest mode.
    first_rate: f64,
}

impl Size {
    fn new(equations: &EquationsOfMotion) -> Self {
        let (mass, c) = (equations.mass, equations.first_moment);
        let about_origin = 0.5 * equations.inertia.trace() / mass;
        let about_centre = about_origin - c.norm_squared() / (mass * mass);
        let modal_stiffness: Vec<f64> = (0..equations.nf).map(|j| equations.stiffness.get(j, j)).collect();
        // Modes without stiffness get that of the softest mode with stiffness.
        let softest = modal_stiffness.iter().copied().filter(|&k| k > 0.0).fold(f64::INFINITY, f64::min);
        let softest = if softest.is_finite() { softest } else { 1.0 };
        Self {
            mass,
            radius: if about_centre > 0.0 { about_centre } else { about_origin }.sqrt(),
            stiffness: modal_stiffness.iter().map(|&k| k.max(softest)).collect(),
            first_rate: softest.sqrt(),
        }
    }
}

/// Number of entries of y besides q and pi.
const PLAIN: usize = 3 + 4 + 3 + 3 + 3 + 1 + 3 + 3;

/// Positions of the entries of y, for a body of nf modes.
#[derive(Debug, Clone, Copy)]
struct Layout(usize);

impl Layout {
    const FLIGHT: usize = 0;
    const ATTITUDE: usize = 3;
    const MODES: usize = 7;

    fn linear(self) -> usize {
        Self::MODES + self.0
    }

    fn angular(self) -> usize {
        self.linear() + 3
    }

    fn modal(self) -> usize {
        self.angular() + 3
    }

    fn offset(self) -> usize {
        self.modal() + self.0
    }

    fn work(self) -> usize {
        self.offset() + 3
    }

    fn impulse(self) -> usize {
        self.work() + 1
    }

    fn angular_impulse(self) -> usize {
        self.impulse() + 3
    }

    /// Returns the entries of q and of pi.
    fn deformation(self, state: &mut [f64]) -> (&mut [f64], &mut [f64]) {
        let (before, momenta) = state.split_at_mut(self.modal());
        (&mut before[Self::MODES..self.linear()], &mut momenta[..self.0])
    }
}

fn vector(state: &[f64], at: usize) -> Vector3<f64> {
    Vector3::new(state[at], state[at + 1], state[at + 2])
}

fn put(value: &Vector3<f64>, at: usize, state: &mut [f64]) {
    state[at..at + 3].copy_from_slice(value.as_slice());
}

fn attitude(state: &[f64]) -> EulerParameters {
    let at = Layout::ATTITUDE;
    EulerParameters([state[at], state[at + 1], state[at + 2], state[at + 3]])
}

impl<'a> Motion<'a> {
    /// Creates the motion from `start`, and returns y at the start.
    ///
    /// # Panics
    /// When the number of modes of `start` differs from that of the equations.
    pub fn new(
        equations: &'a EquationsOfMotion,
        surroundings: &'a dyn Surroundings,
        start: &Configuration,
    ) -> (Self, Vec<f64>) {
        let (nf, n, r) = (equations.n_modes(), equations.n_velocities(), equations.n_rigid());
        let layout = Layout(nf);
        let axes = start.attitude.axes();
        let mut evaluation = Evaluation::new(equations);
        let mut nu = vec![0.0; n];
        equations.put_rigid(axes.tr_mul(&start.velocity), start.omega, &mut nu[..r]);
        nu[r..].copy_from_slice(&start.qd);
        evaluation.set(&start.q, &nu);

        let mut state = vec![0.0; PLAIN + 2 * nf];
        put(&start.origin, Layout::FLIGHT, &mut state);
        state[Layout::ATTITUDE..Layout::MODES].copy_from_slice(&start.attitude.0);
        state[Layout::MODES..layout.linear()].copy_from_slice(&start.q);
        put(&(axes * evaluation.linear_momentum()), layout.linear(), &mut state);
        put(&(axes * evaluation.angular_momentum()), layout.angular(), &mut state);
        evaluation.modal_momentum(&mut state[layout.modal()..layout.offset()]);

        let natural = if equations.is_normalised() {
            None
        } else {
            NaturalModes::new(equations, &surroundings.prescribed(0.0, &axes).0)
        };
        let oscillator = |j: usize| {
            let own = natural.as_ref().map(|natural| natural.oscillators[j]);
            let (stiffness, damping) = own.or_else(|| equations.oscillator(j))?;
            Some(Oscillator {
                coordinate: Layout::MODES + j,
                momentum: layout.modal() + j,
                stiffness,
                damping,
            })
        };
        let motion = Self {
            evaluation,
            surroundings,
            reference: start.origin,
            size: Size::new(equations),
            oscillators: (0..nf).filter_map(oscillator).collect(),
            natural,
            momenta: vec![0.0; n],
            forces: vec![0.0; n],
            rates: vec![0.0; n],
        };
        (motion, state)
    }

    /// Returns the mass of the body, and its radius of gyration sqrt(tr(I) / 2m) about the centre of mass.
    pub fn size(&self) -> (f64, f64) {
        (self.size.mass, self.size.radius)
    }

    /// Returns the elastic energy of a deformation by 1e-9 of the radius of gyration in the softest mode:
    /// far below the accuracy of the integration, far above rounding.
    pub fn least_energy(&self) -> f64 {
        const PART: f64 = 1e-9;
        0.5 * self.size.mass * (PART * self.size.radius * self.size.first_rate).powi(2)
    }

    /// Returns the body at a state.
    ///
    /// # Errors
    /// [`Failure::Rates`] if the mass matrix of the deformed body is not positive definite.
    pub fn evaluate<'m>(&'m mut self, time: f64, state: &'m [f64]) -> Result<Snapshot<'m>, Failure> {
        let (place, rates) = self.go_to(time, state)?;
        let reaction = match rates {
            Prescribed::NOTHING => (Vector3::zeros(), Vector3::zeros()),
            _ => self.apply(time, &place, &rates)?,
        };
        let layout = self.layout();
        Ok(Snapshot {
            place,
            attitude: attitude(state),
            evaluation: &self.evaluation,
            reference: self.reference,
            mass: self.size.mass,
            work: state[layout.work()],
            impulse: vector(state, layout.impulse()),
            angular_impulse: vector(state, layout.angular_impulse()),
            reaction,
        })
    }

    /// Computes nu' at a state, in the order of [`EquationsOfMotion`]: V' and omega' are the rates of the
    /// components in body axes.
    ///
    /// # Errors
    /// The errors of [`Motion::evaluate`].
    pub fn accelerations(&mut self, time: f64, state: &[f64]) -> Result<&[f64], Failure> {
        let (place, rates) = self.go_to(time, state)?;
        self.apply(time, &place, &rates)?;
        if rates == Prescribed::NOTHING {
            self.evaluation
                .accelerations(&self.forces, &mut self.rates)
                .map_err(|_| not_positive_definite())?;
        }
        Ok(&self.rates)
    }

    fn layout(&self) -> Layout {
        Layout(self.evaluation.equations().n_modes())
    }

    /// Returns attitude of the frame and modal coordinates at a state.
    pub fn shape<'s>(&self, state: &'s [f64]) -> (EulerParameters, &'s [f64]) {
        (attitude(state), &state[Layout::MODES..self.layout().linear()])
    }

    /// Returns the roots of the energies that scale the motion at a state: of the whole motion, and of the vibration.
    fn sizes(&self, state: &[f64]) -> [f64; 2] {
        let (layout, size) = (self.layout(), &self.size);
        let body_angular = attitude(state).axes().tr_mul(&vector(state, layout.angular()));
        let rotation = body_angular.norm() / (size.mass.sqrt() * size.radius);
        let momenta = &state[layout.modal()..layout.offset()];
        let vibration = momenta
            .iter()
            .zip(&state[Layout::MODES..])
            .zip(&size.stiffness)
            .map(|((p, q), stiffness)| p * p + stiffness * q * q)
            .sum::<f64>()
            .sqrt();
        let least = LEAST_DEFORMATION * size.mass.sqrt() * size.radius * size.first_rate;
        let whole = rotation.max(vibration).max(least);
        [whole, vibration.max(LEAST_VIBRATION * whole)]
    }

    /// Sets the evaluation; returns the place of the frame and the rates of prescribed motion.
    fn go_to(&mut self, time: f64, state: &[f64]) -> Result<(Place, Prescribed), Failure> {
        let (layout, equations) = (self.layout(), self.evaluation.equations());
        let (offset, linear) = (vector(state, layout.offset()), vector(state, layout.linear()));
        let place = Place { origin: vector(state, Layout::FLIGHT) + offset, axes: attitude(state).axes() };
        let angular = vector(state, layout.angular()) - offset.cross(&linear);
        let (rigid, modal) = self.momenta.split_at_mut(equations.n_rigid());
        equations.put_rigid(place.axes.tr_mul(&linear), place.axes.tr_mul(&angular), rigid);
        modal.copy_from_slice(&state[layout.modal()..layout.offset()]);
        let (velocities, rates) = self.surroundings.prescribed(time, &place.axes);
        self.evaluation
            .set_momenta(&state[Layout::MODES..layout.linear()], &self.momenta, &velocities)
            .map_err(|_| not_positive_definite())?;
        Ok((place, rates))
    }

    /// Writes the generalised forces to `self.forces`, including those of the prescribed motion, which are
    /// returned.
    fn apply(
        &mut self,
        time: f64,
        place: &Place,
        rates: &Prescribed,
    ) -> Result<(Vector3<f64>, Vector3<f64>), Failure> {
        self.forces.fill(0.0);
        self.surroundings.add_forces(time, place, &self.evaluation, &mut self.forces);
        let none = (Vector3::zeros(), Vector3::zeros());
        if *rates == Prescribed::NOTHING {
            return Ok(none);
        }
        let equations = self.evaluation.equations();
        self.evaluation
            .prescribed_accelerations(&self.forces, rates, &mut self.rates)
            .map_err(|_| not_positive_definite())?;
        self.evaluation.balance(&self.rates, &mut self.momenta);
        let (needed, applied) = (equations.split(&self.momenta), equations.split(&self.forces));
        let reaction = (
            rates.linear.map_or(none.0, |_| needed.0 - applied.0),
            rates.angular.map_or(none.1, |_| needed.1 - applied.1),
        );
        let total = (applied.0 + reaction.0, applied.1 + reaction.1);
        equations.put_rigid(total.0, total.1, &mut self.forces[..equations.n_rigid()]);
        Ok(reaction)
    }
}

fn not_positive_definite() -> Failure {
    Failure::Rates { reason: "the mass matrix of the deformed body is not positive definite" }
}

impl System for Motion<'_> {
    fn dimension(&self) -> usize {
        PLAIN + 2 * self.evaluation.equations().n_modes()
    }

    fn rates(&mut self, time: f64, state: &[f64], rates: &mut [f64]) -> Result<(), Failure> {
        let layout = self.layout();
        let (place, prescribed) = self.go_to(time, state)?;
        self.apply(time, &place, &prescribed)?;
        let equations = self.evaluation.equations();
        let (velocity, omega) = self.evaluation.rigid_velocity();
        let (force, torque, modal) = equations.split(&self.forces);
        let qd = self.evaluation.modal_velocity();
        let (world_force, world_torque) = (place.axes * force, place.axes * torque);
        let (mass, offset) = (self.size.mass, vector(state, layout.offset()));

        put(&(vector(state, layout.linear()) / mass), Layout::FLIGHT, rates);
        rates[Layout::ATTITUDE..Layout::MODES].copy_from_slice(&attitude(state).rate(&omega));
        rates[Layout::MODES..layout.linear()].copy_from_slice(qd);
        put(&world_force, layout.linear(), rates);
        put(&(world_torque + offset.cross(&world_force)), layout.angular(), rates);
        self.evaluation.modal_momentum_rate(modal, &mut rates[layout.modal()..layout.offset()]);
        // Compute A V - P / m without the rounding of V if V follows from P.
        let relative = match prescribed.linear {
            None => place.axes * self.evaluation.relative_momentum() / -mass,
            Some(_) => place.axes * velocity - vector(state, layout.linear()) / mass,
        };
        put(&relative, layout.offset(), rates);
        let modal_power: f64 = modal.iter().zip(qd).map(|(force, rate)| force * rate).sum();
        rates[layout.work()] =
            force.dot(&velocity) + torque.dot(&omega) + modal_power - equations.dissipation(qd);
        let arm = place.origin - self.reference;
        put(&world_force, layout.impulse(), rates);
        put(&(world_torque + arm.cross(&world_force)), layout.angular_impulse(), rates);
        Ok(())
    }

    /// Positions are scaled by the radius of gyration r, attitude by 1, momenta and modes in the energy
    /// norm: by the rotational energy and that of the vibration. The latter is at least 1e-3 of the former
    /// in amplitude, and both are at least those of a deformation of 1e-6 r at the first frequency. Work
    /// and impulses follow and are not controlled.
    fn scales(&self, state: &[f64], scales: &mut [f64]) {
        let (layout, size) = (self.layout(), &self.size);
        let [whole, vibration] = self.sizes(state);
        scales[..Layout::ATTITUDE].fill(size.radius);
        scales[Layout::ATTITUDE..Layout::MODES].fill(1.0);
        for (scale, stiffness) in scales[Layout::MODES..].iter_mut().zip(&size.stiffness) {
            *scale = vibration / stiffness.sqrt();
        }
        scales[layout.linear()..layout.angular()].fill(whole * size.mass.sqrt());
        scales[layout.angular()..layout.modal()].fill(whole * size.mass.sqrt() * size.radius);
        scales[layout.modal()..layout.offset()].fill(vibration);
        scales[layout.offset()..layout.work()].fill(size.radius);
        scales[layout.work()..].fill(f64::INFINITY);
    }

    fn oscillators(&self) -> &[Oscillator] {
        &self.oscillators
    }

    fn work_entry(&self) -> Option<usize> {
        Some(self.layout().work())
    }

    fn follower_scales(&self, state: &[f64], scales: &mut [f64]) {
        let (layout, size) = (self.layout(), &self.size);
        let [whole, _] = self.sizes(state);
        scales[layout.work()] = whole * whole;
        scales[layout.impulse()..layout.angular_impulse()].fill(whole * size.mass.sqrt());
        scales[layout.angular_impulse()..].fill(whole * size.mass.sqrt() * size.radius);
    }

    fn enter_oscillators(&self, residual: &mut [f64]) {
        if let Some(natural) = &self.natural {
            let (q, pi) = self.layout().deformation(residual);
            natural.transform(q, pi);
        }
    }

    fn leave_oscillators(&self, residual: &mut [f64]) {
        if let Some(natural) = &self.natural {
            let (q, pi) = self.layout().deformation(residual);
            natural.transform_back(q, pi);
        }
    }

    /// Scales the Euler parameters to unit length.
    fn settle(&self, state: &mut [f64]) {
        let e = &mut state[Layout::ATTITUDE..Layout::MODES];
        let square: f64 = e.iter().map(|e| e * e).sum();
        if (square - 1.0).abs() > 4.0 * f64::EPSILON {
            let length = square.sqrt();
            e.iter_mut().for_each(|e| *e /= length);
        }
    }
}

// Prescribed rigid motion, and the error of a solution for the free motion.

/// The mass matrix at a state is not positive definite: terms were dropped and the deformation is too large
/// for the remaining ones, or the invariants belong to no physical body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotPositiveDefinite;

impl std::fmt::Display for NotPositiveDefinite {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the mass matrix of the deformed body is not positive definite")
    }
}

impl std::error::Error for NotPositiveDefinite {}

// Accelerations from forces, and velocities from momenta: solutions with Mc(q).

impl Evaluation<'_> {
    /// Computes nu' from Mc(q) nu' = applied - h_nu - (0, 0, K_ff q + D qd).
    ///
    /// `applied` are the generalised forces (F, tau, Q) without elastic and damping forces. V' is the rate
    /// of the components in body axes, so that R'' = A (V' + omega x V). Block elimination: with m_ff = L
    /// L' and Y = L^-1 \[C1' C(q)'\] the rigid motions remain with Mc_rr - Y'Y, 6 x 6 (for a plane body 3 x
    /// 3).
    ///
    /// # Errors
    /// [`NotPositiveDefinite`]; `acceleration` then has no meaning.
    ///
    /// # Panics
    /// When a length is not 6 + nf (for a plane body 3 + nf).
    pub fn accelerations(
        &mut self,
        applied: &[f64],
        acceleration: &mut [f64],
    ) -> Result<(), NotPositiveDefinite> {
        self.prescribed_accelerations(applied, &Prescribed::NOTHING, acceleration)
    }

    /// Computes nu' as [`Evaluation::accelerations`] does, with prescribed components of V' or omega'. The
    /// forces of `applied` along these components are not read. [`Evaluation::balance`] of the result
    /// contains the forces of the prescribed motion.
    ///
    /// # Errors
    /// The errors of [`Evaluation::accelerations`].
    ///
    /// # Panics
    /// The panics of [`Evaluation::accelerations`].
    pub fn prescribed_accelerations(
        &mut self,
        applied: &[f64],
        prescribed: &Prescribed,
        acceleration: &mut [f64],
    ) -> Result<(), NotPositiveDefinite> {
        let body = self.equations;
        let (n, r) = (body.n_velocities(), body.rigid.len());
        assert!(applied.len() == n && acceleration.len() == n, "one entry per rigid motion and mode");
        let (force, torque, modal) = body.split(applied);
        let (force_h, torque_h, modal_h) = body.split(&self.velocity_forces);
        for ((entry, applied), h) in self.modal.iter_mut().zip(modal).zip(modal_h) {
            *entry = applied - h;
        }
        let (linear, angular) = self
            .arch()
            .dispatch(|| {
                body.add_internal(-1.0, &self.q, &self.qd, &mut self.modal);
                self.solve(&(force - force_h), &(torque - torque_h), prescribed)
            })
            .ok_or(NotPositiveDefinite)?;
        body.put_rigid(linear, angular, &mut acceleration[..r]);
        acceleration[r..].copy_from_slice(&self.modal);
        Ok(())
    }

    /// Sets the state to modal coordinates `q` (nf) and momenta (p, h, pi) = Mc(q) nu, in the order of nu.
    /// The cost is that of [`Evaluation::set`] and one solution with Mc.
    ///
    /// * `prescribed`: components of V or omega given instead of their momenta. The momenta along them
    ///   follow, and those in `momenta` are not read.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`]; the state then has no meaning.
    ///
    /// # Panics
    /// When the lengths are not those of the equations.
    pub fn set_momenta(
        &mut self,
        q: &[f64],
        momenta: &[f64],
        prescribed: &Prescribed,
    ) -> Result<(), NotPositiveDefinite> {
        let body = self.equations;
        assert_eq!(q.len(), body.nf, "one coordinate per mode");
        let (linear, angular, modal) = body.split(momenta);
        self.q.copy_from_slice(q);
        self.modal.copy_from_slice(modal);
        let arch = self.arch();
        arch.dispatch(FromMomenta { evaluation: self, linear, angular, prescribed })
            .ok_or(NotPositiveDefinite)
    }

    /// Solves Mc(q) x = (linear, angular, `self.modal`): returns x of V and omega, and writes that of the
    /// modes to `self.modal`.
    #[inline(always)] // compiled once per instruction set
    fn solve(
        &mut self,
        linear: &Vector3<f64>,
        angular: &Vector3<f64>,
        prescribed: &Prescribed,
    ) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let body = self.equations;
        let nf = body.nf;
        body.modal_mass.solve_lower(&mut self.modal)?;
        let mut matrix = self.rigid_mass();
        let mut sides = Vector6::zeros();
        for (at, &i) in body.rigid.iter().enumerate() {
            let row = &mut self.whitened[i * nf..][..nf];
            row.copy_from_slice(body.coupling_row(&self.coupling, i));
            body.modal_mass.solve_lower(row)?;
            let row = &self.whitened[i * nf..][..nf];
            let side = if i < 3 { linear[i] } else { angular[i - 3] };
            sides[i] = side - dot(row, &self.modal);
            for &j in &body.rigid[..=at] {
                matrix[(i, j)] -= dot(row, &self.whitened[j * nf..][..nf]);
                matrix[(j, i)] = matrix[(i, j)];
            }
        }
        // Replace the equations of motions that are prescribed, or that a plane body does not have.
        for i in 0..6 {
            let given = if body.rigid.contains(&i) { prescribed.entry(i) } else { Some(0.0) };
            let Some(value) = given else { continue };
            for j in 0..6 {
                sides[j] -= matrix[(j, i)] * value;
                (matrix[(i, j)], matrix[(j, i)]) = (0.0, 0.0);
            }
            (matrix[(i, i)], sides[i]) = (1.0, value);
        }
        let rigid = matrix.cholesky()?.solve(&sides);
        for &i in body.rigid {
            add_scaled(-rigid[i], &self.whitened[i * nf..][..nf], &mut self.modal);
        }
        body.modal_mass.solve_upper(&mut self.modal)?;
        Some((Vector3::from_fn(|k, _| rigid[k]), Vector3::from_fn(|k, _| rigid[3 + k])))
    }
}

/// Sets the velocities and what follows from them, from the linear and angular momentum and those of the modes in `modal`.
///
/// A structure, since the compiler leaves a closure of this size outside the function that has the instruction set.
struct FromMomenta<'s, 'b> {
    evaluation: &'s mut Evaluation<'b>,
    linear: Vector3<f64>,
    angular: Vector3<f64>,
    prescribed: &'s Prescribed,
}

impl NullaryFnOnce for FromMomenta<'_, '_> {
    type Output = Option<()>;

    #[inline(always)]
    fn call(self) -> Option<()> {
        let Self { evaluation, linear, angular, prescribed } = self;
        evaluation.deform();
        (evaluation.velocity, evaluation.omega) = evaluation.solve(&linear, &angular, prescribed)?;
        evaluation.qd.copy_from_slice(&evaluation.modal);
        evaluation.move_on();
        Some(())
    }
}
