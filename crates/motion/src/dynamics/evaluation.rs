//! Evaluation of the equations of motion at one state.

use super::EquationsOfMotion;
use super::equations::{C1, LINEAR, PAIRS, W0, W1};
use super::kernels::{WIDTH, add_scaled, dot};
use nalgebra::{Matrix3, Matrix6, Vector3};
use pulp::Arch;

const _: () = assert!(LINEAR <= WIDTH, "what is linear in q is one panel");

/// Equations of motion at one state, with all memory for their evaluation: nothing is allocated after
/// [`Evaluation::new`].
///
/// [`Evaluation::set`] sets the state; all other methods refer to the last state. The initial state is at
/// rest and undeformed. Vectors with 6 + nf entries (for a plane body 3 + nf) are in the order of
/// [`EquationsOfMotion`], in body axes about the origin of the body frame; matrices are row-major.
#[derive(Debug, Clone)]
pub struct Evaluation<'a> {
    pub(super) equations: &'a EquationsOfMotion,
    arch: Arch,
    pub(super) q: Vec<f64>,
    pub(super) qd: Vec<f64>,
    pub(super) velocity: Vector3<f64>,
    pub(super) omega: Vector3<f64>,
    /// E_ab q for each pair.
    pub(super) w2_q: Vec<f64>,
    /// W3_a' q for each axis.
    w3_q: Vec<f64>,
    /// W3_a' qd.
    pub(super) w3_qd: Vec<f64>,
    /// (W3_a' - W3_a) qd.
    pub(super) skew_qd: Vec<f64>,
    /// K^a_k q for each translation, and K^a_k qd.
    pub(super) accelerated_q: Vec<f64>,
    pub(super) accelerated_qd: Vec<f64>,
    /// [C1(q); C(q)] (6 x nf).
    pub(super) coupling: Vec<f64>,
    first_moment: Vector3<f64>,
    /// C1(q) qd.
    c1_qd: Vector3<f64>,
    /// -c~ + W0 Q, with the contribution of geometric stiffness to c: linear momentum per angular velocity.
    pub(super) lever: Matrix3<f64>,
    pub(super) lever_rate: Matrix3<f64>,
    inertia: Matrix3<f64>,
    pub(super) inertia_rate: Matrix3<f64>,
    pub(super) momentum: Vector3<f64>,
    pub(super) angular_momentum: Vector3<f64>,
    pub(super) velocity_forces: Vec<f64>,
    /// Work arrays of [`Evaluation::accelerations`]: L^-1 [C1(q)' C(q)'] (6 x nf) and modal forces.
    pub(super) whitened: Vec<f64>,
    pub(super) modal: Vec<f64>,
    /// Work arrays of [`Evaluation::jacobian`]: products with rates and accelerations.
    pub(super) w2_scratch: Vec<f64>,
    pub(super) w3_scratch: [Vec<f64>; 2],
    pub(super) accelerated_scratch: Vec<f64>,
}

impl<'a> Evaluation<'a> {
    /// Creates an evaluation of `equations` at rest without deformation.
    pub fn new(equations: &'a EquationsOfMotion) -> Self {
        let nf = equations.nf;
        let zeros = |n: usize| vec![0.0; n];
        let pair_products = || zeros(equations.w2.as_ref().map_or(0, |w2| w2.padded_rows()));
        let axis_products = || zeros(equations.w3.as_ref().map_or(0, |w3| w3.padded_rows()));
        let translation_products = || zeros(equations.accelerated.as_ref().map_or(0, |k| k.padded_rows()));
        let mut evaluation = Self {
            equations,
            arch: Arch::new(),
            q: zeros(nf),
            qd: zeros(nf),
            velocity: Vector3::zeros(),
            omega: Vector3::zeros(),
            w2_q: pair_products(),
            w3_q: axis_products(),
            w3_qd: axis_products(),
            skew_qd: axis_products(),
            accelerated_q: translation_products(),
            accelerated_qd: translation_products(),
            coupling: zeros(6 * nf),
            first_moment: Vector3::zeros(),
            c1_qd: Vector3::zeros(),
            lever: Matrix3::zeros(),
            lever_rate: Matrix3::zeros(),
            inertia: Matrix3::zeros(),
            inertia_rate: Matrix3::zeros(),
            momentum: Vector3::zeros(),
            angular_momentum: Vector3::zeros(),
            velocity_forces: zeros(equations.n_velocities()),
            whitened: zeros(6 * nf),
            modal: zeros(nf),
            w2_scratch: pair_products(),
            w3_scratch: [axis_products(), axis_products()],
            accelerated_scratch: translation_products(),
        };
        let (q, nu) = (zeros(nf), zeros(equations.n_velocities()));
        evaluation.set(&q, &nu);
        evaluation
    }

    /// Sets the state to modal coordinates `q` (nf) and velocities `nu`.
    ///
    /// Takes one pass over W2 and two over W3 (theory 6.2, 6.3):
    ///
    /// ```text
    /// (p, h, pi) = Mc(q) nu
    /// h_nu = dMc/dt nu + (omega x p, omega x h + V x p, -dT/dq)
    /// ```
    ///
    /// # Panics
    /// When the lengths are not those of the equations.
    pub fn set(&mut self, q: &[f64], nu: &[f64]) {
        let equations = self.equations;
        assert_eq!(q.len(), equations.nf, "one coordinate per mode");
        let (velocity, omega, qd) = equations.split(nu);
        self.q.copy_from_slice(q);
        self.qd.copy_from_slice(qd);
        (self.velocity, self.omega) = (velocity, omega);
        self.arch.dispatch(|| {
            self.deform();
            self.move_on();
        });
    }

    /// Sets everything that depends on q alone.
    #[inline(always)] // compiled once per instruction set
    pub(super) fn deform(&mut self) {
        let body = self.equations;
        let nf = body.nf;
        let q = &self.q[..];
        // Terms linear in q: first moment, lever -c~ + W0 Q, and I0 + W1 Q.
        let mut linear_q = [0.0; WIDTH];
        body.linear_panels.times(q, &mut linear_q);
        self.first_moment = body.first_moment + Vector3::from_fn(|k, _| linear_q[C1 + k]);
        self.lever = Matrix3::from_fn(|k, b| linear_q[W0 + 3 * k + b]) - body.first_moment.cross_matrix();
        self.inertia = body.inertia;
        for (pair, &axes) in PAIRS.iter().enumerate() {
            add_symmetric(&mut self.inertia, axes, linear_q[W1 + pair]);
        }
        // I(q) += Q' W2 Q.
        if let Some(w2) = &body.w2 {
            w2.times(q, &mut self.w2_q);
            for (&pair, product) in body.pairs.iter().zip(self.w2_q.chunks_exact(nf)) {
                add_symmetric(&mut self.inertia, pair, dot(q, product));
            }
        }
        // C1(q) and C(q), with K^a q in the rows of C1 and W3' q in those of C.
        self.coupling.copy_from_slice(&body.linear[C1 * nf..]);
        if let Some(accelerated) = &body.accelerated {
            accelerated.times(q, &mut self.accelerated_q);
            let mut shift = Vector3::zeros();
            for (k, product) in self.accelerated_q.chunks_exact(nf).take(body.translations()).enumerate() {
                add_scaled(1.0, product, &mut self.coupling[k * nf..][..nf]);
                shift[k] = 0.5 * dot(q, product);
            }
            self.first_moment += shift;
            self.lever -= shift.cross_matrix();
        }
        if let Some(w3) = &body.w3 {
            w3.times(q, &mut self.w3_q);
            for (&a, product) in body.axes.iter().zip(self.w3_q.chunks_exact(nf)) {
                add_scaled(1.0, product, &mut self.coupling[(3 + a) * nf..][..nf]);
            }
        }
    }

    /// Sets everything that depends on the velocities as well; must follow [`Evaluation::deform`].
    #[inline(always)] // compiled once per instruction set
    pub(super) fn move_on(&mut self) {
        let c1_rate_qd = self.set_lever_and_inertia_rates();
        let (coupling_qd, coupling_rate_qd) = self.set_coupling_products();
        self.set_momenta_of_frame(&coupling_qd);
        self.set_rigid_velocity_forces(&c1_rate_qd, &coupling_rate_qd);
        self.set_modal_velocity_forces();
    }

    /// Sets C1 qd and the rates of lever and inertia; returns dC1/dt qd.
    #[inline(always)] // compiled once per instruction set
    fn set_lever_and_inertia_rates(&mut self) -> Vector3<f64> {
        let body = self.equations;
        let nf = body.nf;
        let qd = &self.qd[..];
        // Rates of the terms linear in q.
        let mut linear_qd = [0.0; WIDTH];
        body.linear_panels.times(qd, &mut linear_qd);
        self.c1_qd = Vector3::from_fn(|k, _| linear_qd[C1 + k]);
        self.lever_rate = Matrix3::from_fn(|k, b| linear_qd[W0 + 3 * k + b]);
        let mut c1_rate_qd = Vector3::zeros();
        // Geometric stiffness: rate q' K^a qd of the first moment, and qd' K^a qd.
        if let Some(accelerated) = &body.accelerated {
            accelerated.times(qd, &mut self.accelerated_qd);
            let mut rate = Vector3::zeros();
            for k in 0..body.translations() {
                rate[k] = dot(&self.accelerated_q[k * nf..][..nf], qd);
                c1_rate_qd[k] = dot(&self.accelerated_qd[k * nf..][..nf], qd);
            }
            self.c1_qd += rate;
            self.lever_rate -= rate.cross_matrix();
        }
        // Rate of I(q): W1 Qd + 2 Q' W2 Qd.
        self.inertia_rate = Matrix3::zeros();
        for (pair, &axes) in PAIRS.iter().enumerate() {
            add_symmetric(&mut self.inertia_rate, axes, linear_qd[W1 + pair]);
        }
        if body.w2.is_some() {
            for (&pair, product) in body.pairs.iter().zip(self.w2_q.chunks_exact(nf)) {
                add_symmetric(&mut self.inertia_rate, pair, 2.0 * dot(qd, product));
            }
        }
        c1_rate_qd
    }

    /// Sets the products of W3 with qd; returns C(q) qd and dC/dt qd.
    #[inline(always)] // compiled once per instruction set
    fn set_coupling_products(&mut self) -> (Vector3<f64>, Vector3<f64>) {
        let body = self.equations;
        let nf = body.nf;
        let qd = &self.qd[..];
        let coupling_qd = Vector3::from_fn(|a, _| dot(&self.coupling[(3 + a) * nf..][..nf], qd));
        let mut coupling_rate_qd = Vector3::zeros();
        if let Some(w3) = &body.w3 {
            w3.times(qd, &mut self.w3_qd);
            match &body.w3_skew {
                Some(skew) => {
                    skew.times(qd, &mut self.skew_qd);
                    for (&a, product) in body.axes.iter().zip(self.w3_qd.chunks_exact(nf)) {
                        coupling_rate_qd[a] = dot(product, qd);
                    }
                }
                None => self.skew_qd.iter_mut().zip(&self.w3_qd).for_each(|(skew, w3)| *skew = 2.0 * w3),
            }
        }
        (coupling_qd, coupling_rate_qd)
    }

    /// Sets p and h.
    #[inline(always)] // compiled once per instruction set
    fn set_momenta_of_frame(&mut self, coupling_qd: &Vector3<f64>) {
        self.momentum = self.equations.mass * self.velocity + self.relative_momentum();
        self.angular_momentum = self.lever.tr_mul(&self.velocity) + self.inertia * self.omega + coupling_qd;
    }

    /// Sets the rigid entries of h_nu.
    #[inline(always)] // compiled once per instruction set
    fn set_rigid_velocity_forces(&mut self, c1_rate_qd: &Vector3<f64>, coupling_rate_qd: &Vector3<f64>) {
        let body = self.equations;
        let (v, w, p, h) = (self.velocity, self.omega, self.momentum, self.angular_momentum);
        let force = self.lever_rate * w + c1_rate_qd + w.cross(&p);
        let torque =
            self.lever_rate.tr_mul(&v) + self.inertia_rate * w + coupling_rate_qd + w.cross(&h) + v.cross(&p);
        body.put_rigid(force, torque, &mut self.velocity_forces[..body.rigid.len()]);
    }

    /// Sets the modal entries of h_nu.
    #[inline(always)] // compiled once per instruction set
    fn set_modal_velocity_forces(&mut self) {
        let body = self.equations;
        let (nf, v, w) = (body.nf, self.velocity, self.omega);
        let modal = &mut self.velocity_forces[body.rigid.len()..];
        modal.fill(0.0);
        for at in 0..9 {
            let weight = v[at / 3] * w[at % 3];
            add_scaled(-weight, body.row(W0 + at), modal);
        }
        if body.accelerated.is_some() {
            let carried = w.cross(&v);
            for (k, product) in self.accelerated_q.chunks_exact(nf).take(body.translations()).enumerate() {
                add_scaled(carried[k], product, modal);
            }
        }
        if body.terms().w1 {
            for (pair, &(a, b)) in PAIRS.iter().enumerate() {
                add_scaled(-0.5 * spin_product(&w, (a, b)), body.row(W1 + pair), modal);
            }
        }
        if body.w2.is_some() {
            for (&pair, product) in body.pairs.iter().zip(self.w2_q.chunks_exact(nf)) {
                add_scaled(-spin_product(&w, pair), product, modal);
            }
        }
        if body.w3.is_some() {
            for (&a, product) in body.axes.iter().zip(self.skew_qd.chunks_exact(nf)) {
                add_scaled(w[a], product, modal);
            }
        }
    }

    /// Returns the equations.
    pub fn equations(&self) -> &'a EquationsOfMotion {
        self.equations
    }

    /// Returns s(q) = c + C1 q + q'K^a q / 2, the first moment of the deformed body with its geometric
    /// stiffness K^a for acceleration. Unit: mass length.
    pub fn first_moment(&self) -> Vector3<f64> {
        self.first_moment
    }

    /// Returns I(q) = I0 + W1 Q + Q'W2 Q, minus q'K^omega q: the inertia of the deformed body about the
    /// origin. Unit: mass length^2.
    pub fn inertia(&self) -> Matrix3<f64> {
        self.inertia
    }

    /// Returns the linear momentum p = m V + (-c~ + W0 Q) omega + C1(q) qd, body axes; -c~ + W0 Q includes
    /// the contribution of geometric stiffness to c.
    pub fn linear_momentum(&self) -> Vector3<f64> {
        self.momentum
    }

    /// Returns the angular momentum about the origin of the body frame, h = (-c~ + W0 Q)'V + I(q) omega +
    /// C(q) qd, body axes.
    pub fn angular_momentum(&self) -> Vector3<f64> {
        self.angular_momentum
    }

    /// Computes pi = C1(q)'V + C(q)'omega + m_ff qd (nf).
    ///
    /// # Panics
    /// When the length of `pi` is not nf.
    pub fn modal_momentum(&self, pi: &mut [f64]) {
        assert_eq!(pi.len(), self.equations.nf, "one entry per mode");
        pi.fill(0.0);
        self.add_modal_inertia(&self.velocity, &self.omega, &self.qd, pi);
    }

    /// Returns T = nu' Mc(q) nu / 2.
    pub fn kinetic_energy(&self) -> f64 {
        // V'p + omega'h contains the coupling to qd once.
        let product = |axis: usize| dot(self.equations.coupling_row(&self.coupling, axis), &self.qd);
        let coupling: f64 =
            (0..3).map(|k| self.velocity[k] * product(k) + self.omega[k] * product(3 + k)).sum();
        let rigid = self.velocity.dot(&self.momentum) + self.omega.dot(&self.angular_momentum);
        0.5 * (rigid + coupling + self.equations.modal_mass.quadratic(&self.qd))
    }

    /// Returns U = q' K_ff q / 2.
    pub fn elastic_energy(&self) -> f64 {
        self.equations.elastic_energy(&self.q)
    }

    /// Returns V and omega: velocity of the origin and angular velocity of the body frame, body axes.
    pub fn rigid_velocity(&self) -> (Vector3<f64>, Vector3<f64>) {
        (self.velocity, self.omega)
    }

    /// Returns q (nf).
    pub fn modal_coordinates(&self) -> &[f64] {
        &self.q
    }

    /// Returns qd (nf).
    pub fn modal_velocity(&self) -> &[f64] {
        &self.qd
    }

    /// Computes pi' = dT/dq - K_ff q - D qd + Q for modal forces `applied` = Q (nf).
    ///
    /// # Panics
    /// When a length is not nf.
    pub fn modal_momentum_rate(&self, applied: &[f64], rate: &mut [f64]) {
        let body = self.equations;
        assert!(applied.len() == body.nf && rate.len() == body.nf, "one entry per mode");
        for ((rate, applied), h) in
            rate.iter_mut().zip(applied).zip(&self.velocity_forces[body.rigid.len()..])
        {
            *rate = applied - h;
        }
        // h_nu contains the rates of C1(q)'V and C(q)'omega, which belong to pi': add them back.
        if body.accelerated.is_some() {
            let translations = self.accelerated_qd.chunks_exact(body.nf).take(body.translations());
            for (k, product) in translations.enumerate() {
                add_scaled(self.velocity[k], product, rate);
            }
        }
        if body.w3.is_some() {
            for (&a, product) in body.axes.iter().zip(self.w3_qd.chunks_exact(body.nf)) {
                add_scaled(self.omega[a], product, rate);
            }
        }
        body.add_internal(-1.0, &self.q, &self.qd, rate);
    }

    /// Returns p - m V = (-c~ + W0 Q) omega + C1 qd: the linear momentum of the motion relative to the
    /// origin, body axes.
    pub fn relative_momentum(&self) -> Vector3<f64> {
        self.lever * self.omega + self.c1_qd
    }

    /// Returns h_nu, the inertia forces without acceleration (6 + nf, or 3 + nf).
    pub fn velocity_forces(&self) -> &[f64] {
        &self.velocity_forces
    }

    /// Computes the forces that cause the accelerations nu': Mc(q) nu' + h_nu + (0, 0, K_ff q + D qd).
    ///
    /// # Panics
    /// When a length is not 6 + nf (for a plane body 3 + nf).
    pub fn balance(&self, acceleration: &[f64], forces: &mut [f64]) {
        let body = self.equations;
        let (linear, angular, modal) = body.split(acceleration);
        assert_eq!(forces.len(), acceleration.len(), "as many forces as velocities");
        forces.copy_from_slice(&self.velocity_forces);
        let (mut force, mut torque) =
            (body.mass * linear + self.lever * angular, self.lever.tr_mul(&linear) + self.inertia * angular);
        for k in 0..3 {
            force[k] += dot(body.coupling_row(&self.coupling, k), modal);
            torque[k] += dot(body.coupling_row(&self.coupling, 3 + k), modal);
        }
        let (rigid, flexible) = forces.split_at_mut(body.rigid.len());
        let at = |axis: usize| if axis < 3 { force[axis] } else { torque[axis - 3] };
        rigid.iter_mut().zip(body.rigid).for_each(|(sum, &axis)| *sum += at(axis));
        self.add_modal_inertia(&linear, &angular, modal, flexible);
        body.add_internal(1.0, &self.q, &self.qd, flexible);
    }

    /// Computes Mc(q), (6 + nf) x (6 + nf), for a plane body (3 + nf) x (3 + nf), row-major (theory 6.2).
    ///
    /// # Panics
    /// When `matrix` has another number of entries.
    pub fn mass_matrix(&self, matrix: &mut [f64]) {
        let body = self.equations;
        let (r, n) = (body.rigid.len(), body.n_velocities());
        assert_eq!(matrix.len(), n * n, "a square matrix");
        let rigid = self.rigid_mass();
        for (i, &axis) in body.rigid.iter().enumerate() {
            for (j, &other) in body.rigid.iter().enumerate() {
                matrix[i * n + j] = rigid[(axis, other)];
            }
            for (j, &value) in body.coupling_row(&self.coupling, axis).iter().enumerate() {
                matrix[i * n + r + j] = value;
                matrix[(r + j) * n + i] = value;
            }
        }
        for i in 0..body.nf {
            for j in 0..body.nf {
                matrix[(r + i) * n + r + j] = body.modal_mass.get(i, j);
            }
        }
    }

    /// Returns the block of Mc for V and omega; zero for motions that the body does not have.
    pub(super) fn rigid_mass(&self) -> Matrix6<f64> {
        let mut matrix = Matrix6::zeros();
        for &i in self.equations.rigid {
            for &j in self.equations.rigid {
                matrix[(i, j)] = match (i < 3, j < 3) {
                    (true, true) => self.equations.mass * f64::from(i == j),
                    (true, false) => self.lever[(i, j - 3)],
                    (false, true) => self.lever[(j, i - 3)],
                    (false, false) => self.inertia[(i - 3, j - 3)],
                };
            }
        }
        matrix
    }

    /// Computes y += C1(q)' linear + C(q)' angular + m_ff modal.
    fn add_modal_inertia(&self, linear: &Vector3<f64>, angular: &Vector3<f64>, modal: &[f64], y: &mut [f64]) {
        for k in 0..3 {
            add_scaled(linear[k], self.equations.coupling_row(&self.coupling, k), y);
            add_scaled(angular[k], self.equations.coupling_row(&self.coupling, 3 + k), y);
        }
        self.equations.modal_mass.add_product(modal, y);
    }

    /// Returns the dispatcher to the vector instructions of the machine.
    pub(super) fn arch(&self) -> Arch {
        self.arch
    }
}

/// Adds `value` at (a, b) and (b, a).
pub(super) fn add_symmetric(matrix: &mut Matrix3<f64>, (a, b): (usize, usize), value: f64) {
    matrix[(a, b)] += value;
    if a != b {
        matrix[(b, a)] += value;
    }
}

/// Returns w_a w_b, summed over both orders of a pair of different axes.
pub(super) fn spin_product(w: &Vector3<f64>, (a, b): (usize, usize)) -> f64 {
    if a == b { w[a] * w[a] } else { 2.0 * w[a] * w[b] }
}
