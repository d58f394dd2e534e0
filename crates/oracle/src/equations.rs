//! The reduced equations of motion as docs/theory.md section 3 prints them. They are not optimised and share no code
//! with the library; their oracle is the nodal model.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// Invariants of a body about the origin of its frame, in blocks by component.
pub struct ReducedBody {
    pub mass: f64,
    pub first_moment: Vector3<f64>,
    pub inertia: Matrix3<f64>,
    /// Matrix C1 (3 x nf).
    pub c1: DMatrix<f64>,
    /// Matrix C2 (3 x nf).
    pub c2: DMatrix<f64>,
    /// Matrix W1 (3 x 3nf).
    pub w1: DMatrix<f64>,
    /// Matrix W2 (3nf x 3nf).
    pub w2: DMatrix<f64>,
    /// Matrix W3 (3nf x nf).
    pub w3: DMatrix<f64>,
    pub modal_mass: DMatrix<f64>,
    pub modal_stiffness: DMatrix<f64>,
}

/// Position and velocity of a body: R and A (body to world), velocity of the origin (world axes), omega (body axes), q
/// and its rate.
#[derive(Clone)]
pub struct State {
    pub origin: Vector3<f64>,
    pub axes: Matrix3<f64>,
    pub velocity: Vector3<f64>,
    pub omega: Vector3<f64>,
    pub q: DVector<f64>,
    pub qd: DVector<f64>,
}

/// Form of the terms of the modal rates in the angular velocity equation.
#[derive(Clone, Copy, PartialEq)]
pub enum Coriolis {
    /// W1 Qd + Q'W2 Qd + Qd'W2 Q, with the W3 term.
    Correct,
    /// W1 Qd + 2 Q'W2 Qd, with the W3 term: printed in the literature, counts the skew part of Q'W2 Qd twice.
    Printed,
}

pub fn skew(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

fn fixed(a: &DMatrix<f64>) -> Matrix3<f64> {
    Matrix3::from_fn(|k, l| a[(k, l)])
}

fn vector(a: &DVector<f64>) -> Vector3<f64> {
    Vector3::new(a[0], a[1], a[2])
}

impl ReducedBody {
    pub fn n_modes(&self) -> usize {
        self.c1.ncols()
    }

    /// Returns Q = I3 kron q.
    fn kron(&self, q: &DVector<f64>) -> DMatrix<f64> {
        DMatrix::<f64>::identity(3, 3).kronecker(q)
    }

    /// Returns s = c + C1 q.
    pub fn first_moment_at(&self, q: &DVector<f64>) -> Vector3<f64> {
        self.first_moment + vector(&(&self.c1 * q))
    }

    /// Returns I(q) = I0 + W1 Q + Q'W2 Q.
    pub fn inertia_at(&self, q: &DVector<f64>) -> Matrix3<f64> {
        let kron = self.kron(q);
        self.inertia + fixed(&(&self.w1 * &kron + kron.transpose() * &self.w2 * &kron))
    }

    /// Returns C(q) = C2 + Q'W3.
    pub fn coupling_at(&self, q: &DVector<f64>) -> DMatrix<f64> {
        &self.c2 + self.kron(q).transpose() * &self.w3
    }

    /// Returns the mass matrix for (R'' world, alpha body, q'').
    pub fn mass_matrix(&self, state: &State) -> DMatrix<f64> {
        let nf = self.n_modes();
        let translation_rotation = -state.axes * skew(&self.first_moment_at(&state.q));
        let translation_modes = state.axes * &self.c1;
        let rotation_modes = self.coupling_at(&state.q);
        let mut matrix = DMatrix::zeros(6 + nf, 6 + nf);
        matrix.view_mut((0, 0), (3, 3)).copy_from(&(Matrix3::identity() * self.mass));
        matrix.view_mut((0, 3), (3, 3)).copy_from(&translation_rotation);
        matrix.view_mut((3, 0), (3, 3)).copy_from(&translation_rotation.transpose());
        matrix.view_mut((0, 6), (3, nf)).copy_from(&translation_modes);
        matrix.view_mut((6, 0), (nf, 3)).copy_from(&translation_modes.transpose());
        matrix.view_mut((3, 3), (3, 3)).copy_from(&self.inertia_at(&state.q));
        matrix.view_mut((3, 6), (3, nf)).copy_from(&rotation_modes);
        matrix.view_mut((6, 3), (nf, 3)).copy_from(&rotation_modes.transpose());
        matrix.view_mut((6, 6), (nf, nf)).copy_from(&self.modal_mass);
        matrix
    }

    /// Returns (h_R, h_T, h_f): the inertia forces of the velocities.
    pub fn velocity_terms(&self, state: &State, coriolis: Coriolis) -> DVector<f64> {
        let nf = self.n_modes();
        let (w, skew_w) = (&state.omega, skew(&state.omega));
        let (kron, kron_rate) = (self.kron(&state.q), self.kron(&state.qd));
        let s = self.first_moment_at(&state.q);
        let h_r = state.axes * (skew_w * skew_w * s + 2.0 * skew_w * vector(&(&self.c1 * &state.qd)));

        let mixed = fixed(&(kron.transpose() * &self.w2 * &kron_rate));
        let quadratic = match coriolis {
            Coriolis::Correct => mixed + mixed.transpose(),
            Coriolis::Printed => 2.0 * mixed,
        };
        let h_t = skew_w * self.inertia_at(&state.q) * w
            + (fixed(&(&self.w1 * &kron_rate)) + quadratic) * w
            + skew_w * vector(&(self.coupling_at(&state.q) * &state.qd));

        // Matrix [w1 I, w2 I, w3 I] (nf x 3nf).
        let spin = w.transpose().kronecker(&DMatrix::<f64>::identity(nf, nf));
        let centrifugal = spin * (self.w1.transpose() * 0.5 + &self.w2 * &kron) * w;
        let h_f = -centrifugal + 2.0 * self.w3.transpose() * kron_rate * w;

        let mut h = DVector::zeros(6 + nf);
        h.fixed_rows_mut::<3>(0).copy_from(&h_r);
        h.fixed_rows_mut::<3>(3).copy_from(&h_t);
        h.rows_mut(6, nf).copy_from(&h_f);
        h
    }

    /// Returns the inertia forces: mass matrix times accelerations (R'', alpha, q''), plus the velocity terms.
    pub fn inertia_forces(&self, state: &State, accelerations: &DVector<f64>) -> DVector<f64> {
        self.mass_matrix(state) * accelerations + self.velocity_terms(state, Coriolis::Correct)
    }

    /// Returns the accelerations (R'', alpha, q'') of the free undamped body.
    pub fn free_accelerations(&self, state: &State, coriolis: Coriolis) -> DVector<f64> {
        let mut forces = -self.velocity_terms(state, coriolis);
        let mut modal = forces.rows_mut(6, self.n_modes());
        modal -= &self.modal_stiffness * &state.q;
        self.mass_matrix(state).lu().solve(&forces).expect("the mass matrix is positive definite")
    }

    /// Returns the generalised velocities (R', omega, q').
    pub fn velocities(state: &State) -> DVector<f64> {
        let parts = state.velocity.iter().chain(state.omega.iter()).chain(state.qd.iter());
        DVector::from_iterator(6 + state.qd.len(), parts.copied())
    }

    /// Returns the kinetic energy.
    pub fn kinetic_energy(&self, state: &State) -> f64 {
        let v = Self::velocities(state);
        0.5 * v.dot(&(self.mass_matrix(state) * &v))
    }

    /// Returns the sum of kinetic and strain energy.
    pub fn energy(&self, state: &State) -> f64 {
        self.kinetic_energy(state) + 0.5 * state.q.dot(&(&self.modal_stiffness * &state.q))
    }

    /// Returns the linear momentum in world axes: m R' + A (omega x s + C1 q').
    pub fn linear_momentum(&self, state: &State) -> Vector3<f64> {
        let s = self.first_moment_at(&state.q);
        self.mass * state.velocity + state.axes * (state.omega.cross(&s) + vector(&(&self.c1 * &state.qd)))
    }

    /// Returns the angular momentum about the world origin in world axes: A (I omega + C q' + s x A'R') + R x p.
    pub fn angular_momentum(&self, state: &State) -> Vector3<f64> {
        let about_frame = self.inertia_at(&state.q) * state.omega
            + vector(&(self.coupling_at(&state.q) * &state.qd))
            + self.first_moment_at(&state.q).cross(&(state.axes.transpose() * state.velocity));
        state.axes * about_frame + state.origin.cross(&self.linear_momentum(state))
    }
}
