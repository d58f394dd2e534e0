//! Derivatives of the forces with respect to coordinates and velocities, and the generalised forces of gravity.

use super::equations::{PAIRS, W0, W1};
use super::evaluation::{add_symmetric, spin_product};
use super::kernels::add_scaled;
use super::{EquationsOfMotion, Evaluation};
use nalgebra::{Matrix3, Vector3};

/// Entries of one mode j in the derivatives with respect to q_j and qd_j.
struct ModeDerivatives {
    /// dN/dq_j.
    lever: Matrix3<f64>,
    /// dI/dq_j, and its rate.
    inertia: Matrix3<f64>,
    inertia_rate: Matrix3<f64>,
    /// (K^a qdd)_j and (K^a qd)_j.
    accelerated_modal: Vector3<f64>,
    accelerated_qd: Vector3<f64>,
    /// (W3 qdd)_j and (W3 qd)_j.
    w3_modal: Vector3<f64>,
    w3_qd: Vector3<f64>,
    /// ((W3' - W3) qd)_j.
    skew_qd: Vector3<f64>,
    /// C1_j and C(q)_j.
    c1: Vector3<f64>,
    coupling: Vector3<f64>,
}

impl Evaluation<'_> {
    /// Computes the derivatives of [`Evaluation::balance`], f = Mc(q) nu' + h_nu + (0, 0, K_ff q + D qd),
    /// at constant accelerations nu'.
    ///
    /// * `acceleration`: nu' (n = 6 + nf, for a plane body 3 + nf); zero for the derivatives of h_nu and
    ///   the elastic forces alone.
    /// * `by_q`: df/dq (n x nf), row-major.
    /// * `by_nu`: df/dnu (n x n), row-major.
    ///
    /// df/dnu' is [`Evaluation::mass_matrix`]. With N = -c~ + W0 Q, N_j = dN/dq_j = (W0)_j and I_j =
    /// dI/dq_j = (W1)_j + 2 (E q)_j, where E is the part of W2 in the kinetic energy (theory 6.4),
    /// transposes as N^T and rates as dN, dI:
    ///
    /// ```text
    /// dF/dq_j      = N_j alpha + omega x N_j omega
    /// dtau/dq_j    = N_j^T V' + I_j alpha + (W3)_j qdd + 2 (E qd)_j omega
    ///                + omega x (N_j^T V + I_j omega + (W3)_j qd) + V x N_j omega
    /// dQ_i/dq_j    = alpha^T (W3)_ji - omega^T E_ij omega + (K_ff)_ij
    /// dF/dV        = m omega~
    /// dtau/dV      = dN^T - p~ + omega~ N^T + m V~
    /// dQ_j/dV      = -N_j omega
    /// dF/domega    = dN - p~ + omega~ N
    /// dtau/domega  = dI - h~ + omega~ I + V~ N
    /// dQ_j/domega  = (W3^T - W3)_j qd - N_j^T V - I_j omega
    /// dF/dqd_j     = N_j omega + omega x C1_j
    /// dtau/dqd_j   = N_j^T V + I_j omega + (W3 + W3^T)_j qd + omega x C(q)_j + V x C1_j
    /// dQ/dqd       = sum_a omega_a (W3_a^T - W3_a) + D
    /// ```
    ///
    /// Geometric stiffness K^a for acceleration adds -(K^a q)_j~ to N_j, and
    ///
    /// ```text
    /// dF/dq_j      : (K^a qdd)_j + 2 omega x (K^a qd)_j
    /// dQ_i/dq_j    : K^a_ij . (V' + omega x V)
    /// dF/dqd_j     : 2 (K^a qd)_j
    /// ```
    ///
    /// # Panics
    /// When a length differs.
    pub fn jacobian(&mut self, acceleration: &[f64], by_q: &mut [f64], by_nu: &mut [f64]) {
        let body = self.equations;
        let (n, nf) = (body.n_velocities(), body.nf);
        let (linear, angular, modal) = body.split(acceleration);
        assert!(by_q.len() == n * nf && by_nu.len() == n * n, "n x nf and n x n entries");
        self.arch().dispatch(|| self.multiply(modal));
        self.rigid_columns(by_nu);
        for j in 0..nf {
            self.modal_columns(j, (&linear, &angular), by_q, by_nu);
        }
        self.modal_block(&(linear + self.omega.cross(&self.velocity)), &angular, by_q, by_nu);
    }

    /// Computes the products with W2, W3 and K^a that an evaluation does not need.
    #[inline(always)] // compiled once per instruction set
    fn multiply(&mut self, modal: &[f64]) {
        let body = self.equations;
        if let Some(w2) = &body.w2 {
            w2.times(&self.qd, &mut self.w2_scratch);
        }
        if let Some(accelerated) = &body.accelerated {
            accelerated.times(modal, &mut self.accelerated_scratch);
        }
        if let Some(w3) = &body.w3 {
            let [transposed, skew] = &mut self.w3_scratch;
            w3.times(modal, transposed);
            match &body.w3_skew {
                Some(w3_skew) => w3_skew.times(modal, skew),
                None => skew.iter_mut().zip(&*transposed).for_each(|(s, t)| *s = 2.0 * t),
            }
        }
    }

    /// Writes df/dV and df/domega of the rigid rows.
    fn rigid_columns(&self, by_nu: &mut [f64]) {
        let body = self.equations;
        let (n, r) = (body.n_velocities(), body.rigid.len());
        let (v, w) = (self.velocity.cross_matrix(), self.omega.cross_matrix());
        let (p, h) = (self.momentum.cross_matrix(), self.angular_momentum.cross_matrix());
        let force = [w * body.mass, self.lever_rate - p + w * self.lever];
        let torque = [
            self.lever_rate.transpose() - p + w * self.lever.transpose() + v * body.mass,
            self.inertia_rate - h + w * self.inertia() + v * self.lever,
        ];
        for (j, &axis) in body.rigid.iter().enumerate() {
            let column = |blocks: &[Matrix3<f64>; 2]| blocks[axis / 3].column(axis % 3).into_owned();
            let mut values = [0.0; 6];
            body.put_rigid(column(&force), column(&torque), &mut values[..r]);
            (0..r).for_each(|i| by_nu[i * n + j] = values[i]);
        }
    }

    /// Writes the columns of q_j and qd_j in the rigid rows, and those of V and omega in row j of the
    /// modes.
    fn modal_columns(
        &self,
        j: usize,
        (linear, angular): (&Vector3<f64>, &Vector3<f64>),
        by_q: &mut [f64],
        by_nu: &mut [f64],
    ) {
        let body = self.equations;
        let (n, nf, r) = (body.n_velocities(), body.nf, body.rigid.len());
        let (v, w) = (&self.velocity, &self.omega);
        let ModeDerivatives {
            lever,
            inertia,
            inertia_rate,
            accelerated_modal,
            accelerated_qd,
            w3_modal,
            w3_qd,
            skew_qd,
            c1,
            coupling,
        } = self.mode_derivatives(j);
        let (p, rate) = (lever * w, lever.tr_mul(v) + inertia * w);
        let by_qj = (
            lever * angular + accelerated_modal + w.cross(&(p + 2.0 * accelerated_qd)),
            lever.tr_mul(linear)
                + inertia * angular
                + w3_modal
                + inertia_rate * w
                + w.cross(&(rate + w3_qd))
                + v.cross(&p),
        );
        let symmetric_qd = w3_qd + w3_qd + skew_qd;
        let by_rate = (
            p + 2.0 * accelerated_qd + w.cross(&c1),
            rate + symmetric_qd + w.cross(&coupling) + v.cross(&c1),
        );
        let by_rigid = (-p, skew_qd - rate);
        let entry = |(a, b): &(Vector3<f64>, Vector3<f64>), axis: usize| {
            if axis < 3 { a[axis] } else { b[axis - 3] }
        };
        for (i, &axis) in body.rigid.iter().enumerate() {
            by_q[i * nf + j] = entry(&by_qj, axis);
            by_nu[i * n + r + j] = entry(&by_rate, axis);
            by_nu[(r + j) * n + i] = entry(&by_rigid, axis);
        }
    }

    /// Returns the entries of mode `j` in the derivatives by q_j and qd_j.
    fn mode_derivatives(&self, j: usize) -> ModeDerivatives {
        let body = self.equations;
        let mut lever = Matrix3::from_fn(|k, b| body.row(W0 + 3 * k + b)[j]);
        let (mut accelerated_modal, mut accelerated_qd) = (Vector3::zeros(), Vector3::zeros());
        if body.accelerated.is_some() {
            lever -= self.accelerated_column(&self.accelerated_q, j).cross_matrix();
            accelerated_modal = self.accelerated_column(&self.accelerated_scratch, j);
            accelerated_qd = self.accelerated_column(&self.accelerated_qd, j);
        }
        let (inertia, inertia_rate) = self.inertia_derivatives(j);
        // (W3_a x)_j is the entry of the transpose minus that of the difference.
        let w3_times = |transposed: &[f64], skew: &[f64]| {
            self.w3_column(|at| transposed[at * body.nf + j] - skew[at * body.nf + j])
        };
        let [transposed, skew] = &self.w3_scratch;
        let row = |axis: usize| body.coupling_row(&self.coupling, axis)[j];
        ModeDerivatives {
            lever,
            inertia,
            inertia_rate,
            accelerated_modal,
            accelerated_qd,
            w3_modal: w3_times(transposed, skew),
            w3_qd: w3_times(&self.w3_qd, &self.skew_qd),
            skew_qd: self.w3_column(|at| self.skew_qd[at * body.nf + j]),
            c1: Vector3::from_fn(|k, _| row(k)),
            coupling: Vector3::from_fn(|k, _| row(3 + k)),
        }
    }

    /// Returns entry `j` of the product with K^a for every axis that the body moves along.
    fn accelerated_column(&self, products: &[f64], j: usize) -> Vector3<f64> {
        let body = self.equations;
        let mut column = Vector3::zeros();
        (0..body.translations()).for_each(|k| column[k] = products[k * body.nf + j]);
        column
    }

    /// Returns `entry` for every axis that the body turns about (by its index among them); zero without W3.
    fn w3_column(&self, entry: impl Fn(usize) -> f64) -> Vector3<f64> {
        let body = self.equations;
        let mut column = Vector3::zeros();
        if body.w3.is_some() {
            body.axes.iter().enumerate().for_each(|(at, &a)| column[a] = entry(at));
        }
        column
    }

    /// Returns dI/dq_j and its rate.
    fn inertia_derivatives(&self, j: usize) -> (Matrix3<f64>, Matrix3<f64>) {
        let (body, nf) = (self.equations, self.equations.nf);
        let (mut inertia, mut rate) = (Matrix3::zeros(), Matrix3::zeros());
        for (pair, &axes) in PAIRS.iter().enumerate() {
            add_symmetric(&mut inertia, axes, body.row(W1 + pair)[j]);
        }
        if body.w2.is_some() {
            for (at, &pair) in body.pairs.iter().enumerate() {
                add_symmetric(&mut inertia, pair, 2.0 * self.w2_q[at * nf + j]);
                add_symmetric(&mut rate, pair, 2.0 * self.w2_scratch[at * nf + j]);
            }
        }
        (inertia, rate)
    }

    /// Writes the derivatives of the modal forces by q and qd; `linear` is the acceleration of the origin,
    /// V' + omega x V.
    fn modal_block(
        &self,
        linear: &Vector3<f64>,
        angular: &Vector3<f64>,
        by_q: &mut [f64],
        by_nu: &mut [f64],
    ) {
        let body = self.equations;
        let (n, nf, r, w) = (body.n_velocities(), body.nf, body.rigid.len(), &self.omega);
        for i in 0..nf {
            for j in 0..nf {
                by_q[(r + i) * nf + j] = body.stiffness.get(i, j);
                by_nu[(r + i) * n + r + j] = body.damping.get(i, j);
            }
        }
        for i in 0..nf {
            let row = &mut by_q[(r + i) * nf..][..nf];
            // -omega' E_ij omega.
            if let Some(w2) = &body.w2 {
                for (at, &pair) in body.pairs.iter().enumerate() {
                    let factor = spin_product(w, pair);
                    row.iter_mut().zip(w2.row(at * nf + i)).for_each(|(sum, e)| *sum -= factor * e);
                }
            }
            // K^a_ij . (V' + omega x V).
            if let Some(accelerated) = &body.accelerated {
                for k in 0..body.translations() {
                    row.iter_mut()
                        .zip(accelerated.row(k * nf + i))
                        .for_each(|(sum, e)| *sum += linear[k] * e);
                }
            }
            // alpha' (W3)_ji, and sum_a omega_a (W3_a' - W3_a) by qd.
            if let Some(w3) = &body.w3 {
                for (at, &a) in body.axes.iter().enumerate() {
                    for (j, transposed) in w3.row(at * nf + i).enumerate() {
                        row[j] += angular[a] * transposed;
                        by_nu[(r + i) * n + r + j] += w[a] * transposed;
                        by_nu[(r + j) * n + r + i] -= w[a] * transposed;
                    }
                }
            }
        }
    }
}

// Generalised forces of gravity, and their derivatives.

impl Evaluation<'_> {
    /// Adds the forces of uniform gravity: (m g, s x g, C1(q)'g), the gradient of -g'(m R + A s).
    ///
    /// * `gravity`: A'g, in body axes. Unit: length/time^2.
    /// * `forces`: 6 + nf entries, for a plane body 3 + nf.
    ///
    /// # Panics
    /// When `forces` has another length.
    pub fn add_gravity(&self, gravity: &Vector3<f64>, forces: &mut [f64]) {
        let body = self.equations();
        let modal = body.add_rigid(body.mass * gravity, self.first_moment().cross(gravity), forces);
        for k in 0..3 {
            add_scaled(gravity[k], body.coupling_row(&self.coupling, k), modal);
        }
    }

    /// Adds the derivatives of the forces of gravity, b = A'g:
    ///
    /// ```text
    /// dtau/dq_j = C1(q)_j x b,    dQ_i/dq_j = K^a_ij . b,    d/dphi = (m b~, s~ b~, C1(q)' b~)
    /// ```
    ///
    /// # Panics
    /// When a length of `jacobian` is not that of the equations.
    pub fn add_gravity_jacobian(&self, gravity: &Vector3<f64>, jacobian: &mut LoadJacobian<'_>) {
        let body = self.equations();
        let row = |k: usize| body.coupling_row(&self.coupling, k);
        jacobian.check(body);
        for j in 0..body.nf {
            let moved = Vector3::from_fn(|k, _| row(k)[j]);
            jacobian.add_by_q(body, j, &moved.cross(gravity));
        }
        if let Some(accelerated) = &body.accelerated {
            for k in 0..body.translations() {
                for i in 0..body.nf {
                    for (entry, value) in
                        jacobian.modal_row(body, i).iter_mut().zip(accelerated.row(k * body.nf + i))
                    {
                        *entry += gravity[k] * value;
                    }
                }
            }
        }
        for (at, &axis) in body.axes.iter().enumerate() {
            let turned = gravity.cross(&Vector3::ith(axis, 1.0));
            let torque = self.first_moment().cross(&turned);
            jacobian.add_by_turn(body, at, &(body.mass * turned), &torque, |j| {
                (0..3).map(|k| turned[k] * row(k)[j]).sum()
            });
        }
    }
}

impl EquationsOfMotion {
    /// Adds a force and a torque about the origin; returns the modal forces.
    pub(super) fn add_rigid<'f>(
        &self,
        force: Vector3<f64>,
        torque: Vector3<f64>,
        forces: &'f mut [f64],
    ) -> &'f mut [f64] {
        assert_eq!(forces.len(), self.n_velocities(), "one entry per rigid motion and mode");
        let (rigid, modal) = forces.split_at_mut(self.rigid.len());
        let mut values = [0.0; 6];
        self.put_rigid(force, torque, &mut values[..rigid.len()]);
        rigid.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        modal
    }
}

/// Axes in which a load is constant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LoadAxes {
    /// World axes: the load keeps its direction while the body turns.
    World,
    /// Body axes: the load turns with the body.
    Body,
}

/// Accumulated derivatives of the generalised forces of loads; n = 6 + nf rows, for a plane body 3 + nf.
///
/// The derivatives belong to the right-hand side; [`Evaluation::jacobian`](super::Evaluation::jacobian)
/// gives those of the left. Constant loads do not depend on the position R of the body.
#[derive(Debug)]
pub struct LoadJacobian<'m> {
    /// Derivatives by q (n x nf), row-major.
    pub by_q: &'m mut [f64],
    /// Derivatives by a small rotation phi in body axes, A becoming A (I + phi~): n x 3, for a plane body n
    /// x 1, row-major.
    pub by_turn: &'m mut [f64],
}

impl LoadJacobian<'_> {
    pub(super) fn check(&self, body: &EquationsOfMotion) {
        let n = body.n_velocities();
        assert!(
            self.by_q.len() == n * body.nf && self.by_turn.len() == n * body.axes.len(),
            "n x nf and n x 3 entries, in the plane n x 1"
        );
    }

    /// Adds a torque to column j of `by_q`.
    pub(super) fn add_by_q(&mut self, body: &EquationsOfMotion, j: usize, torque: &Vector3<f64>) {
        for (i, &axis) in body.rigid.iter().enumerate().filter(|(_, axis)| **axis >= 3) {
            self.by_q[i * body.nf + j] += torque[axis - 3];
        }
    }

    /// Returns the row of mode `i` in `by_q`.
    pub(super) fn modal_row(&mut self, body: &EquationsOfMotion, i: usize) -> &mut [f64] {
        &mut self.by_q[(body.rigid.len() + i) * body.nf..][..body.nf]
    }

    /// Adds a force, a torque about the origin and modal forces to column `at` of `by_turn`, which belongs
    /// to one axis.
    pub(super) fn add_by_turn(
        &mut self,
        body: &EquationsOfMotion,
        at: usize,
        force: &Vector3<f64>,
        torque: &Vector3<f64>,
        modal: impl Fn(usize) -> f64,
    ) {
        let (width, r) = (body.axes.len(), body.rigid.len());
        for (i, &axis) in body.rigid.iter().enumerate() {
            self.by_turn[i * width + at] += if axis < 3 { force[axis] } else { torque[axis - 3] };
        }
        (0..body.nf).for_each(|j| self.by_turn[(r + j) * width + at] += modal(j));
    }
}
