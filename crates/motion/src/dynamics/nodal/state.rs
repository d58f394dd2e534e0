//! States of the nodal equations: positions, velocities, momenta and energies at a state, the conversion between modal
//! coordinates and nodal displacements, and the change of a motion to the frame defined by the conditions.

use super::equations::NodalEquations;
use super::inversion::{Conditions, TurnedMass};
use super::state_layout::DISPLACEMENTS;
use super::{NodalError, NodalEvaluation};
use crate::dynamics::{Configuration, EulerParameters, Orientation};
use faer::{Mat, MatRef};
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::rotation_by;
use flexbody_linalg::{combine, gram, quadratic_form};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix3, Rotation3, UnitQuaternion, Vector3};

/// Rigid motion in displacements, relative to the largest displacement, that counts as rounding.
const ROUNDING: f64 = 1e-8;

/// Rigid motion in displacements, relative to the extent of the body, that counts as rounding of positions.
const ROUNDING_OF_POSITIONS: f64 = 1e-12;

/// State in velocities: a [`Configuration`](crate::dynamics::Configuration) with nodal displacements.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalConfiguration {
    /// Origin of the body frame, world axes.
    pub origin: Vector3<f64>,
    /// Attitude of the frame, of unit length.
    pub attitude: EulerParameters,
    /// Velocity of the origin, world axes.
    pub velocity: Vector3<f64>,
    /// Angular velocity of the frame, in its axes.
    pub omega: Vector3<f64>,
    /// Displacements relative to the frame (N), in the rows and axes of the model.
    pub u: Vec<f64>,
    /// Rates of the displacements (N).
    pub ud: Vec<f64>,
}

impl NodalEquations<'_> {
    /// Returns the number of entries of a state y = (G, D, e, P, L, u, w): 16 + 2 N. The frame has its
    /// origin at R = G + D and the Euler parameters e. P is the linear momentum, L the angular momentum
    /// about G, which starts at R and moves with P / m; all in world axes. P and L of a free body are
    /// constant entries, which every method conserves to rounding.
    pub fn dimension(&self) -> usize {
        DISPLACEMENTS + 2 * self.n_rows()
    }

    /// Returns the state y of a configuration.
    ///
    /// Massless motions are set to static equilibrium. Rigid motion in u' is attributed to the frame: the
    /// velocities in a state fulfil C u' = 0.
    ///
    /// # Errors
    /// [`NodalError::ConditionsViolated`] if C u is not zero to rounding.
    ///
    /// # Panics
    /// When a length is not N.
    pub fn state(&self, configuration: &NodalConfiguration) -> Result<Vec<f64>, NodalError> {
        let NodalConfiguration { origin, attitude, velocity, omega, u, ud } = configuration;
        let n = self.n_rows();
        assert!(u.len() == n && ud.len() == n, "one entry per row");
        let (mut u, mut vbar) = (u.clone(), ud.clone());
        let mut workspace = self.massless.workspace();
        self.massless.project(self.stiffness(), &mut u, &mut workspace);
        self.massless.project(self.stiffness(), &mut vbar, &mut workspace);
        let taken = self.take_rigid(&mut u);
        let largest = u.iter().fold(0.0f64, |m, u| m.max(u.abs()));
        let moved = taken.fixed_rows::<3>(0).amax().max(taken.fixed_rows::<3>(3).amax() * self.length);
        let allowed = (ROUNDING * largest).max(ROUNDING_OF_POSITIONS * self.length);
        // The maxima ignore NaN, so that it must be checked separately.
        if taken.iter().any(|part| part.is_nan()) || moved > allowed {
            return Err(NodalError::ConditionsViolated { part: moved / largest });
        }
        let attitude = attitude.normalised();
        let nu = self.in_model(&attitude.axes().tr_mul(velocity), omega);
        self.add_frame(1.0, &nu, &u, &mut vbar);
        let mut w = vec![0.0; n];
        let momenta = match TurnedMass::new(self) {
            Some(mut turned) => {
                turned.turn(&u, &Conditions::new(&self.conditions_at(&u)));
                turned.momenta(&vbar, &mut w).map_err(|_| NodalError::ConditionsDependent)?
            }
            None => {
                self.weigh(&vbar, &mut w);
                self.onto_frame(&u, &w)
            }
        };

        let to_world = attitude.axes() * self.frame.axes.transpose();
        let linear = to_world * momenta.fixed_rows::<3>(0);
        let angular = to_world * momenta.fixed_rows::<3>(3);
        let mut state = Vec::with_capacity(self.dimension());
        state.extend(origin.iter().chain(&[0.0; 3]).chain(&attitude.0).chain(&linear).chain(&angular));
        state.extend(u);
        state.extend(w);
        Ok(state)
    }

    /// Returns the parts of a state: frame, u and w.
    pub(super) fn parts<'s>(&self, state: &'s [f64]) -> (&'s [f64], &'s [f64], &'s [f64]) {
        assert_eq!(state.len(), self.dimension(), "a state of these equations");
        let (frame, nodes) = state.split_at(DISPLACEMENTS);
        let (u, w) = nodes.split_at(self.n_rows());
        (frame, u, w)
    }

    /// Returns u'K u / 2 for displacements u (N), model axes.
    ///
    /// # Panics
    /// When the length of `u` is not N.
    pub fn elastic_energy(&self, u: &[f64]) -> f64 {
        0.5 * quadratic_form(self.stiffness(), u)
    }
}

impl NodalEvaluation<'_> {
    /// Returns the state in positions and velocities.
    pub fn configuration(&self) -> NodalConfiguration {
        NodalConfiguration {
            origin: self.origin,
            attitude: self.attitude.normalised(),
            velocity: self.axes * self.velocity,
            omega: self.equations.frame.axes.tr_mul(&self.omega),
            u: self.u.clone(),
            ud: self.ud.clone(),
        }
    }

    /// Returns the axes of the frame in the world, in columns.
    pub fn axes(&self) -> Matrix3<f64> {
        self.axes * self.equations.frame.axes
    }

    /// Returns u (N), model axes.
    pub fn displacements(&self) -> &[f64] {
        &self.u
    }

    /// Returns u (N), model axes, with the response of massless motions to the loads and inertia forces,
    /// which u of the state excludes (theory 6.13). Earlier rates and accelerations are overwritten.
    pub fn loaded_displacements(&mut self) -> &[f64] {
        let body = self.equations;
        if body.massless.is_empty() {
            return &self.u;
        }
        self.find_forces();
        self.second.copy_from_slice(&self.u);
        body.massless.add_static(&self.first, &mut self.second, &mut self.workspace);
        &self.second
    }

    /// Returns u' (N), model axes, with C u' = 0.
    pub fn displacement_rates(&self) -> &[f64] {
        &self.ud
    }

    /// Returns the position of node `i`, world axes.
    ///
    /// # Panics
    /// When `i` is not below the number of nodes.
    pub fn place(&self, i: usize) -> Vector3<f64> {
        self.origin + self.axes * (self.equations.positions[i] + self.node_vector(&self.u, i))
    }

    /// Returns the velocity of node `i`, world axes.
    ///
    /// # Panics
    /// The panics of [`NodalEvaluation::place`].
    pub fn node_velocity(&self, i: usize) -> Vector3<f64> {
        self.axes * self.node_vector(&self.vbar, i)
    }

    /// Returns the entries of node `i`, zero along an axis that a plane model does not have.
    pub(super) fn node_vector(&self, x: &[f64], i: usize) -> Vector3<f64> {
        let d = self.equations.model.dimension();
        Vector3::from_fn(|k, _| if k < d { x[d * i + k] } else { 0.0 })
    }

    /// Returns the linear momentum P and the angular momentum L about the origin of the frame, world axes.
    pub fn momenta(&self) -> (Vector3<f64>, Vector3<f64>) {
        (self.axes * self.p, self.axes * self.h)
    }

    /// Returns T, which is vbar'M vbar / 2 if no rotation carries mass.
    pub fn kinetic_energy(&self) -> f64 {
        if let Some(turned) = &self.turned {
            return turned.kinetics.energy();
        }
        0.5 * self.vbar.iter().zip(&self.w).map(|(v, w)| v * w).sum::<f64>()
    }

    /// Returns U = u'K u / 2.
    pub fn elastic_energy(&self) -> f64 {
        self.equations.elastic_energy(&self.u)
    }
}

/// Modes of a body in the rows of its model, to compare motions of the reduced and of the nodal equations.
#[derive(Debug, Clone)]
pub struct NodalModes {
    vectors: Mat<f64>,
    /// M Psi.
    weighted: Mat<f64>,
    modal_mass: Cholesky<f64, Dyn>,
}

impl NodalModes {
    /// Returns the modes of `body`, which was made of the model of `equations`. Returns `None` if the body
    /// has other rows, another frame, or modes that depend on each other.
    pub fn new(equations: &NodalEquations<'_>, body: &FlexBody) -> Option<Self> {
        let vectors = body.vectors_of(equations.model).filter(|_| *body.frame() == equations.frame)?;
        let weighted = equations.model.pencil().apply_mass(vectors.as_ref());
        let mass = gram(vectors.as_ref(), weighted.as_ref());
        let modal_mass = DMatrix::from_fn(mass.nrows(), mass.ncols(), |i, j| mass[(i, j)]).cholesky()?;
        Some(Self { vectors, weighted, modal_mass })
    }

    /// Returns Psi (N x nf), model axes.
    pub fn vectors(&self) -> MatRef<'_, f64> {
        self.vectors.as_ref()
    }

    /// Returns the state of all nodes, u = Psi q.
    ///
    /// # Panics
    /// When the length of q or its rates is not nf.
    pub fn lift(&self, modal: &Configuration) -> NodalConfiguration {
        let Configuration { origin, attitude, velocity, omega, q, qd } = modal;
        let lifted = |q: &[f64]| {
            assert_eq!(q.len(), self.vectors.ncols(), "one coordinate per mode");
            let u = combine(self.vectors.as_ref(), MatRef::from_column_major_slice(q, q.len(), 1));
            u.col_as_slice(0).to_vec()
        };
        let (u, ud) = (lifted(q), lifted(qd));
        NodalConfiguration { origin: *origin, attitude: *attitude, velocity: *velocity, omega: *omega, u, ud }
    }

    /// Returns the nearest modal state, q = (Psi'M Psi)^-1 Psi'M u.
    ///
    /// # Panics
    /// When the length of u or its rates is not N.
    pub fn project(&self, nodal: &NodalConfiguration) -> Configuration {
        let NodalConfiguration { origin, attitude, velocity, omega, u, ud } = nodal;
        let projected = |u: &[f64]| {
            assert_eq!(u.len(), self.vectors.nrows(), "one entry per row");
            let product = gram(self.weighted.as_ref(), MatRef::from_column_major_slice(u, u.len(), 1));
            self.modal_mass.solve(&DVector::from_column_slice(product.col_as_slice(0))).as_slice().to_vec()
        };
        let (q, qd) = (projected(u), projected(ud));
        Configuration { origin: *origin, attitude: *attitude, velocity: *velocity, omega: *omega, q, qd }
    }
}

/// Limit of the corrections of the frame. Each correction reduces the remaining rigid motion by a factor of
/// the size of the deformation.
const MAX_CORRECTIONS: usize = 100;

/// Remaining rigid motion, relative to the size of the body, that counts as rounding.
const RIGID_MOTION_TOLERANCE: f64 = 1e-14;

impl NodalEquations<'_> {
    /// Returns the configuration with equal positions and velocities of all nodes whose displacements
    /// fulfil C u = 0. Use it to convert a state with mean axes, as given by modes, to a state with held
    /// degrees of freedom.
    ///
    /// The frame moves by d and turns by S; u becomes S'(x + u - d) - x. For models of displacements only:
    /// K and M treat nodal rotations and rows without a position as small.
    ///
    /// # Errors
    /// [`NodalError::FrameTied`] if the model has other rows, [`NodalError::ConditionsViolated`] if no
    /// frame was found because the deformation is too large.
    ///
    /// # Panics
    /// When a length is not N.
    pub fn reframed(&self, configuration: &NodalConfiguration) -> Result<NodalConfiguration, NodalError> {
        if !self.model.rows().are_plain() {
            return Err(NodalError::FrameTied);
        }
        let NodalConfiguration { origin, attitude, velocity, omega, u, ud } = configuration;
        assert!(u.len() == self.n_rows() && ud.len() == self.n_rows(), "one entry per row");
        let (mut shift, mut turn) = (Vector3::zeros(), Rotation3::identity());
        let mut moved = vec![0.0; u.len()];
        let mut left = f64::INFINITY;
        for _ in 0..MAX_CORRECTIONS {
            let places = |i: usize, u| turn.inverse() * (self.positions[i] + u - shift) - self.positions[i];
            self.seen(u, places, &mut moved);
            let part = self.rigid_motion(&moved);
            let (by, about) = (part.fixed_rows::<3>(0).into_owned(), part.fixed_rows::<3>(3).into_owned());
            left = by.amax() / self.length + about.amax();
            if left <= RIGID_MOTION_TOLERANCE {
                break;
            }
            shift += turn * by;
            turn *= rotation_by(&about);
        }
        if left.is_nan() || left > RIGID_MOTION_TOLERANCE {
            return Err(NodalError::ConditionsViolated { part: left });
        }
        let mut rates = vec![0.0; ud.len()];
        self.seen(ud, |_, ud| turn.inverse() * ud, &mut rates);

        // Convert to the axes of the frame.
        let to_frame = |v: Vector3<f64>| self.frame.axes.tr_mul(&v);
        let (shift, turn): (_, Matrix3<f64>) =
            (to_frame(shift), self.frame.axes.transpose() * turn.matrix() * self.frame.axes);
        let axes = attitude.normalised().axes();
        let quaternion =
            |m: &Matrix3<f64>| UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*m));
        let EulerParameters([w, i, j, k]) = attitude.normalised();
        let whole = UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, i, j, k)) * quaternion(&turn);
        Ok(NodalConfiguration {
            origin: origin + axes * shift,
            attitude: EulerParameters([whole.w, whole.i, whole.j, whole.k]),
            velocity: velocity + axes * omega.cross(&shift),
            omega: turn.transpose() * omega,
            u: moved,
            ud: rates,
        })
    }

    /// Applies `rule` to the displacement of each node.
    fn seen(&self, from: &[f64], rule: impl Fn(usize, Vector3<f64>) -> Vector3<f64>, to: &mut [f64]) {
        let d = self.model.dimension();
        for (i, (from, to)) in from.chunks_exact(d).zip(to.chunks_exact_mut(d)).enumerate() {
            let own = Vector3::from_fn(|k, _| if k < d { from[k] } else { 0.0 });
            to.copy_from_slice(&rule(i, own).as_slice()[..d]);
        }
    }
}
