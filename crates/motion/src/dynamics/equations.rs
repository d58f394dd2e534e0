//! Constants of the equations of motion, laid out for their evaluation.

use super::Terms;
use super::geometric::{Stiffening, stiffness_under};
use super::kernels::Panels;
use super::modal_matrix::{ModalMass, ModalMatrix};
use faer::Mat;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::Invariants;
use flexbody_model::LoadKind;
use nalgebra::{Matrix3, Vector3};

/// Largest deviation of m_ff from the identity that counts as rounding for mass-normalised modes.
const MASS_ROUNDING: f64 = 1e-12;

/// Largest off-diagonal entry of K_ff and D, relative to sqrt(a_ii a_jj), that counts as rounding of
/// products with K for modes of very different stiffness.
const STIFFNESS_ROUNDING: f64 = 1e-10;

/// Order of the entries of a symmetric 3x3 matrix in all arrays here.
pub(super) const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)];

/// First rows of W0, W1, C1 and C2 in [`EquationsOfMotion::linear`], and their total.
pub(super) const W0: usize = 0;
pub(super) const W1: usize = 9;
pub(super) const C1: usize = 15;
pub(super) const C2: usize = 18;
pub(super) const LINEAR: usize = 21;

/// Equations of motion of one flexible body in constant invariants (theory section 6, which is section 3
/// for solids).
///
/// ```text
/// Mc(q) nu' + h_nu + (0, 0, K_ff q + D qd) = (F, tau, Q),    nu = (V, omega, qd)
/// ```
///
/// V is the velocity of the origin of the body frame, omega the angular velocity of the frame, both in body
/// axes. F, tau (about the origin) and Q are the generalised forces with the power F'V + tau'omega + Q'qd.
/// Vectors have 6 + nf entries in this order, for a plane body 3 + nf: V_x, V_y, omega_z, qd. Units are
/// those of the body: length/time, 1/time and, since q are the amplitudes of mass-normalised modes,
/// mass^(1/2) length/time.
///
/// [`Evaluation`](super::Evaluation) evaluates the equations, which hold for the mass matrices of solids
/// and for general ones. Geometric stiffness of the body (theory 7.3) for spin, acceleration and angular
/// acceleration is part of the kinetic energy. It belongs to motion of second order in q, which adds
/// q'K^a_k q / 2 to the first moment and q'K^alpha_k to row k of C(q), and subtracts q'K^omega(omega) q / 2
/// from T (theory 7.4).
///
/// ```
/// # fn check(body: &flexbody_body::flex_body::FlexBody) {
/// use flexbody_motion::dynamics::{EquationsOfMotion, Evaluation, Terms};
/// let equations = EquationsOfMotion::new(body, Terms::ALL);
/// let mut evaluation = Evaluation::new(&equations);
/// let (q, nu) = (vec![0.0; equations.n_modes()], vec![0.1; equations.n_velocities()]);
/// evaluation.set(&q, &nu);
/// let (free, mut acceleration) = (vec![0.0; nu.len()], vec![0.0; nu.len()]);
/// evaluation.accelerations(&free, &mut acceleration).expect("a body with mass");
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct EquationsOfMotion {
    /// Existing rigid motions, as indices into (V, omega).
    pub(super) rigid: &'static [usize],
    /// Axes that the body turns about.
    pub(super) axes: &'static [usize],
    /// Entries of [`PAIRS`] for these axes.
    pub(super) pairs: &'static [(usize, usize)],
    pub(super) nf: usize,
    pub(super) mass: f64,
    pub(super) first_moment: Vector3<f64>,
    pub(super) inertia: Matrix3<f64>,
    /// Arrays linear in q ([`LINEAR`] x nf, row-major): W0 (row 3 k + b), W1 ([`PAIRS`]), C1, C2.
    pub(super) linear: Vec<f64>,
    /// Matrix `linear` in a layout for products.
    pub(super) linear_panels: Panels,
    /// E_ab = (W2_ab + W2_ab') / 2 for each of `pairs`, minus geometric stiffness for spin: T depends only
    /// on this part of W2.
    pub(super) w2: Option<Panels>,
    /// W3_a' for each of `axes`, with geometric stiffness for angular acceleration.
    pub(super) w3: Option<Panels>,
    /// W3_a' - W3_a, if it is not 2 W3_a' because the blocks are not skew.
    pub(super) w3_skew: Option<Panels>,
    /// Geometric stiffness for acceleration along each axis that the body moves along.
    pub(super) accelerated: Option<Panels>,
    pub(super) modal_mass: ModalMass,
    pub(super) stiffness: ModalMatrix,
    pub(super) damping: ModalMatrix,
    terms: Terms,
}

impl EquationsOfMotion {
    /// Creates the equations of `body` with those of the given terms that the body holds.
    ///
    /// Rounding is removed: m_ff within 1e-12 of the identity (for arrays of 32-bit floats within their
    /// rounding) becomes the identity; K_ff and D with off-diagonal entries below 1e-10 of sqrt(a_ii a_jj)
    /// become diagonal. D is the modal damping of the body or, if there is none, diag(2 zeta_j omega_j).
    pub fn new(body: &FlexBody, terms: Terms) -> Self {
        let parts = EquationParts::new(body, terms);
        let (invariants, nf) = (parts.invariants, parts.nf);
        let linear = parts.linear();
        let (w3, w3_skew) = parts.w3();
        Self {
            rigid: parts.rigid,
            axes: parts.axes,
            pairs: parts.pairs,
            nf,
            mass: invariants.mass(),
            first_moment: parts.first_moment(),
            inertia: parts.inertia(),
            linear_panels: Panels::new(LINEAR, nf, |row, j| linear[row * nf + j]),
            linear,
            w2: parts.w2(),
            w3,
            w3_skew,
            accelerated: parts.accelerated(),
            modal_mass: ModalMass::new(
                invariants.modal_mass().as_ref(),
                MASS_ROUNDING + body.storage().rounding(),
            ),
            stiffness: ModalMatrix::new(invariants.modal_stiffness().as_ref(), STIFFNESS_ROUNDING),
            damping: ModalMatrix::new(body.damping().as_ref(), STIFFNESS_ROUNDING),
            terms: parts.terms,
        }
    }

    /// Returns the number of modes nf.
    pub fn n_modes(&self) -> usize {
        self.nf
    }

    /// Returns the number of rigid motions: 6, for a plane body 3.
    pub fn n_rigid(&self) -> usize {
        self.rigid.len()
    }

    /// Returns the number of velocities in nu: 6 + nf, for a plane body 3 + nf.
    pub fn n_velocities(&self) -> usize {
        self.rigid.len() + self.nf
    }

    /// Returns the elastic energy q'K_ff q / 2.
    ///
    /// # Panics
    /// When the length of `q` is not the number of modes.
    pub fn elastic_energy(&self, q: &[f64]) -> f64 {
        0.5 * self.stiffness.quadratic(q)
    }

    /// Returns the terms that the equations contain.
    pub fn terms(&self) -> Terms {
        self.terms
    }

    /// Returns a row of `linear`.
    pub(super) fn row(&self, row: usize) -> &[f64] {
        &self.linear[row * self.nf..][..self.nf]
    }

    /// Returns V, omega and the modal part of a vector in the order of nu.
    pub(crate) fn split<'v>(&self, nu: &'v [f64]) -> (Vector3<f64>, Vector3<f64>, &'v [f64]) {
        assert_eq!(nu.len(), self.n_velocities(), "one entry per rigid motion and mode");
        let (rigid, modal) = nu.split_at(self.rigid.len());
        let mut both = [Vector3::zeros(); 2];
        for (&axis, &value) in self.rigid.iter().zip(rigid) {
            both[axis / 3][axis % 3] = value;
        }
        let [velocity, omega] = both;
        (velocity, omega, modal)
    }

    /// Returns row `axis` of [C1(q); C(q)].
    pub(super) fn coupling_row<'v>(&self, coupling: &'v [f64], axis: usize) -> &'v [f64] {
        &coupling[axis * self.nf..][..self.nf]
    }

    /// Returns the number of axes that the body moves along.
    pub(super) fn translations(&self) -> usize {
        if self.rigid.len() == 3 { 2 } else { 3 }
    }

    /// Computes y += factor (K_ff q + D qd).
    #[inline(always)]
    pub(super) fn add_internal(&self, factor: f64, q: &[f64], qd: &[f64], y: &mut [f64]) {
        self.stiffness.add_product(factor, q, y);
        self.damping.add_product(factor, qd, y);
    }

    /// Returns stiffness and damping of mode `j`, if the modes are mass-normalised.
    pub(super) fn oscillator(&self, j: usize) -> Option<(f64, f64)> {
        matches!(self.modal_mass, ModalMass::Identity)
            .then(|| (self.stiffness.get(j, j), self.damping.get(j, j)))
    }

    /// Returns qd'D qd, the power dissipated by damping.
    pub(super) fn dissipation(&self, qd: &[f64]) -> f64 {
        self.damping.quadratic(qd)
    }

    /// Writes the entries of a force and a torque that belong to rigid motions of the body.
    pub(super) fn put_rigid(&self, force: Vector3<f64>, torque: Vector3<f64>, rigid: &mut [f64]) {
        let at = |axis: usize| if axis < 3 { force[axis] } else { torque[axis - 3] };
        rigid.iter_mut().zip(self.rigid).for_each(|(entry, &axis)| *entry = at(axis));
    }
}

/// Inputs for the constants of the equations: the body, the requested terms that it holds, and the axes of
/// its motion.
struct EquationParts<'b> {
    body: &'b FlexBody,
    invariants: &'b Invariants,
    nf: usize,
    rigid: &'static [usize],
    axes: &'static [usize],
    pairs: &'static [(usize, usize)],
    terms: Terms,
}

impl<'b> EquationParts<'b> {
    fn new(body: &'b FlexBody, terms: Terms) -> Self {
        let (rigid, axes, pairs): (&[usize], &[usize], &[(usize, usize)]) = if body.dimension() == 2 {
            (&[0, 1, 5], &[2], &PAIRS[2..3])
        } else {
            (&[0, 1, 2, 3, 4, 5], &[0, 1, 2], &PAIRS)
        };
        let invariants = body.invariants();
        let terms = terms.held(invariants.groups());
        Self { body, invariants, nf: body.n_modes(), rigid, axes, pairs, terms }
    }

    fn turns(&self, a: usize) -> bool {
        self.axes.contains(&a)
    }

    fn moves(&self, k: usize) -> bool {
        self.rigid.contains(&k)
    }

    fn first_moment(&self) -> Vector3<f64> {
        Vector3::from_fn(|k, _| if self.moves(k) { self.invariants.first_moment()[k] } else { 0.0 })
    }

    fn inertia(&self) -> Matrix3<f64> {
        let inertia = self.invariants.inertia();
        Matrix3::from_fn(|k, l| {
            if self.turns(k) && self.turns(l) { 0.5 * (inertia[(k, l)] + inertia[(l, k)]) } else { 0.0 }
        })
    }

    /// Returns the rows of [`EquationsOfMotion::linear`].
    fn linear(&self) -> Vec<f64> {
        let (invariants, nf) = (self.invariants, self.nf);
        let (w0, c2) = (invariants.w0(), invariants.c2());
        let w1 = invariants.w1().filter(|_| self.terms.w1);
        let entry = |row: usize, j: usize| match row {
            row if row < W1 => {
                let (k, b) = (row / 3, row % 3);
                if self.moves(k) && self.turns(b) { w0[(k, b * nf + j)] } else { 0.0 }
            }
            row if row < C1 => {
                let (a, b) = PAIRS[row - W1];
                let mean = |w1: &Mat<f64>| 0.5 * (w1[(a, b * nf + j)] + w1[(b, a * nf + j)]);
                w1.as_ref().filter(|_| self.turns(a) && self.turns(b)).map_or(0.0, mean)
            }
            row if row < C2 => f64::from(self.moves(row - C1)) * invariants.c1()[(row - C1, j)],
            row => f64::from(self.turns(row - C2)) * c2[(row - C2, j)],
        };
        (0..LINEAR * nf).map(|at| entry(at / nf, at % nf)).collect()
    }

    /// Returns the symmetric parts of W2, minus geometric stiffness for spin.
    fn w2(&self) -> Option<Panels> {
        let nf = self.nf;
        let spin = self.geometric(LoadKind::Spin);
        let w2 = self.invariants.w2().filter(|_| self.terms.w2);
        (w2.is_some() || spin.is_some()).then(|| {
            self.stacked(self.pairs.len(), &|at, i, j| {
                let (a, b) = self.pairs[at];
                let own = w2
                    .as_ref()
                    .map_or(0.0, |w2| 0.5 * (w2[(a * nf + i, b * nf + j)] + w2[(a * nf + j, b * nf + i)]));
                let component = LoadKind::SPIN.iter().position(|&axes| axes == (a, b));
                let taken = spin.as_ref().zip(component).map_or(0.0, |(spin, c)| spin(c, i, j));
                // w'E w contains both orders of a pair of axes, the load only one.
                own - if a == b { taken } else { 0.5 * taken }
            })
        })
    }

    /// Returns W3' with geometric stiffness for angular acceleration, and W3' - W3 if it is not twice W3'.
    fn w3(&self) -> (Option<Panels>, Option<Panels>) {
        let (nf, axes) = (self.nf, self.axes);
        let turned = self.geometric(LoadKind::AngularAcceleration);
        if !(self.terms.w3 || turned.is_some()) {
            return (None, None);
        }
        let w3 = self.invariants.w3().filter(|_| self.terms.w3);
        // (W3_a)_ij and (W3_a)_ji.
        let entries = |at: usize, i: usize, j: usize| {
            let a = axes[at];
            w3.as_ref().map_or((0.0, 0.0), |w3| (w3[(a * nf + i, j)], w3[(a * nf + j, i)]))
        };
        let general = self.invariants.general().is_some();
        let transposed = self.stacked(axes.len(), &|at, i, j| {
            let (own, mirrored) = entries(at, i, j);
            // The blocks of a solid are skew: W3 + W3' is rounding.
            let w3 = if general { mirrored } else { 0.5 * (mirrored - own) };
            w3 + turned.as_ref().map_or(0.0, |turned| turned(axes[at], i, j))
        });
        let skew = |at: usize, i: usize, j: usize| {
            let (own, mirrored) = entries(at, i, j);
            mirrored - own
        };
        (Some(transposed), (general || turned.is_some()).then(|| self.stacked(axes.len(), &skew)))
    }

    /// Returns the geometric stiffness for acceleration.
    fn accelerated(&self) -> Option<Panels> {
        let along = self.geometric(LoadKind::Acceleration)?;
        Some(self.stacked(if self.body.dimension() == 2 { 2 } else { 3 }, &along))
    }

    fn geometric(&self, kind: LoadKind) -> Option<impl Fn(usize, usize, usize) -> f64 + use<'b>> {
        let which = if self.terms.geometric_stiffness { Stiffening::All } else { Stiffening::OfInertia };
        stiffness_under(self.body, &kind, which)
    }

    /// Returns `count` square matrices stacked vertically, with the entries (matrix, i, j).
    fn stacked(&self, count: usize, entry: &dyn Fn(usize, usize, usize) -> f64) -> Panels {
        let block = |at| Mat::from_fn(self.nf, self.nf, |i, j| entry(at, i, j));
        Panels::stacked(&(0..count).map(block).collect::<Vec<_>>())
    }
}
