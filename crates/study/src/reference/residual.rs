//! Forces that the equations of all nodes leave unbalanced in the motion of a body.

use faer::{Mat, MatRef};
use flexbody_body::basis::CoupledModel;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::{
    SymmetricMatrix, combine, dense_cholesky, gram, multiply, solve_lower, solve_upper, subtract_combination,
};
use flexbody_model::{Damping, FeModel, InertialRows, RigidAcceleration};
use flexbody_motion::dynamics::NodalPoint;
use flexbody_motion::scene::Instant;
use nalgebra::{DMatrix, Matrix3, Vector3};

/// Number of instants that are evaluated together. It limits the memory for nodal vectors.
pub(super) const BLOCK: usize = 32;

/// A body in its frame, expressed in the rows of its model.
pub(super) struct NodalView<'m> {
    pub model: &'m FeModel,
    /// Model whose response to forces is computed: with the couplings of the body, or without.
    pub coupled: CoupledModel<'m>,
    /// Modes Psi (N x nf), M Psi and D Psi, in rows and axes of the model.
    pub vectors: Mat<f64>,
    pub weighted: Mat<f64>,
    pub damped: Mat<f64>,
    /// Modal mass m_ff = Psi'M Psi, and its Cholesky factor.
    pub modal_mass: Mat<f64>,
    lower: Mat<f64>,
    /// Damping D_ff of the modes.
    pub modal_damping: Mat<f64>,
    /// Damping of the model; `None` if the scene replaces it.
    damping: Option<&'m Damping<SymmetricMatrix>>,
    /// True if the body has stiffness that depends on its motion, which the nodal equations do not have.
    stiffens: bool,
    /// Rigid motions about the origin of the frame (N x 6, in the plane N x 3), axes of the model.
    pub rigid: Mat<f64>,
    /// Rows that inertia acts on (extended rows if nodal rotations carry mass).
    pub rows: InertialRows<'m>,
    /// Modes in the extended rows and M times these; `None` if inertia acts on the rows of the model.
    extended: Option<[Mat<f64>; 2]>,
    /// Rigid motions of the rows that inertia acts on, about their centre.
    pub extended_rigid: Mat<f64>,
    /// Position of that centre relative to the origin of the frame, axes of the model.
    pub centre: Vector3<f64>,
    /// Axes of the frame in the model.
    pub axes: Matrix3<f64>,
    /// Nodal forces of unit forces and torques at the point of each load of the scene (N x 6, in the plane N x 3).
    pub loads: Vec<SceneLoad>,
    /// Point that carries the body; `None` for a free body.
    pub held: Option<Held>,
}

/// Unbalanced forces, split into a nodal and a modal part.
pub(super) struct Unbalanced {
    /// Nodal forces without their modal part (N x instants).
    pub forces: Mat<f64>,
    /// Modal forces (nf x instants).
    pub in_modes: Mat<f64>,
}

/// Load of a scene at the nodes of the model.
#[derive(Debug, Clone)]
pub(super) struct SceneLoad {
    /// Nodal forces of unit forces and torques at its point (N x 6, in the plane N x 3).
    pub unit: Mat<f64>,
    /// Nodal loads whose products with the displacements are the torque that a named load gains (N x 3); `None` for a point.
    pub turning: Option<Mat<f64>>,
}

impl SceneLoad {
    pub(super) fn new(model: &FeModel, point: &NodalPoint) -> Self {
        Self { unit: point.unit_loads(model), turning: point.turning_loads(model) }
    }
}

/// Displacements of all rows of the model with their rates and accelerations, relative to the frame (N x instants).
pub(super) struct Displacements {
    pub u: Mat<f64>,
    pub ud: Mat<f64>,
    pub udd: Mat<f64>,
}

/// Inertia of the rows that it acts on ([`InertialRows`]) at every instant. Gravity enters as a negative acceleration.
/// If nodal rotations carry mass, V = 0 and V' - g is a = V' + omega x V - g, both of the centre of mass.
pub(super) struct Inertia {
    /// Displacements u and rates u' of these rows.
    pub u: Mat<f64>,
    pub ud: Mat<f64>,
    /// Momentum w = M (R (V, omega) + omega x u + u').
    pub momentum: Mat<f64>,
    /// Inertia forces M (R (V' - g, omega') + omega' x u + omega x u' + u'').
    pub change: Mat<f64>,
}

impl<'m> NodalView<'m> {
    /// Builds the view of `body`, which has the damping of its scene and may be carried by the point `carrier`. Returns
    /// `None` if the body has other rows than its model, if its modes are linearly dependent, or if the carrier has no
    /// orientation.
    ///
    /// * `coupled`: the model that the body was made of, with the couplings to be assumed.
    /// * `damping`: damping of the model; `None` if the model has none or the scene replaces it.
    pub(super) fn new(
        coupled: CoupledModel<'m>,
        body: &FlexBody,
        loads: Vec<SceneLoad>,
        carrier: Option<&NodalPoint>,
        damping: Option<&'m Damping<SymmetricMatrix>>,
    ) -> Option<Self> {
        let model = coupled.model();
        let vectors = body.vectors_of(model)?;
        let weighted = model.pencil().apply_mass(vectors.as_ref());
        let modal_mass = gram(vectors.as_ref(), weighted.as_ref());
        let lower = dense_cholesky(modal_mass.clone())?;
        let rigid = model.rigid_fields(body.frame().origin.into(), 1.0);
        let held = match carrier {
            Some(point) => Some(Held::new(model, point, &rigid)?),
            None => None,
        };
        let origin = body.frame().origin;
        let rows = InertialRows::new(model, origin);
        let extended = rows.have_directors().then(|| {
            let modes = rows.extend(&vectors).into_owned();
            let weighted = rows.weigh(modes.as_ref());
            [modes, weighted]
        });
        let mut view = Self {
            model,
            coupled,
            centre: rows.centre() - origin,
            extended_rigid: rows.rigid(),
            extended,
            rows,
            damping,
            damped: Mat::new(),
            vectors,
            weighted,
            modal_mass,
            lower,
            modal_damping: body.damping(),
            stiffens: !body.geometric_stiffness().is_empty(),
            rigid,
            axes: body.frame().axes,
            loads,
            held,
        };
        view.damped = view.damping_of_modes();
        Some(view)
    }

    /// Returns r = f - K u - D u' - omega x w - M (R (V', omega') + omega' x u + omega x u' + u'') with w = M (R (V,
    /// omega) + omega x u + u') and u = Psi q (theory 6.9 to 6.13), one column for every instant. Nodes whose rotations carry
    /// mass turn to second order. The forces are split into g = Psi'r and r - M Psi m_ff^-1 g; the resultants of the
    /// latter act on the carrying point, if there is one. g vanishes except for approximations in the equations of the
    /// body. Geometric stiffness is not included, since the nodal equations do not have it.
    pub(super) fn unbalanced(&self, motion: &[Instant]) -> Unbalanced {
        let own = |of: fn(&Instant) -> &Vec<f64>| self.displacements(motion, of);
        let field = Displacements { u: own(|now| &now.q), ud: own(|now| &now.qd), udd: own(|now| &now.qdd) };
        let mut taken = self.inertial_forces(motion, &field);
        // Elastic and damping forces; the loads minus all of these are unbalanced.
        taken += self.model.pencil().apply_stiffness(field.u.as_ref());
        let rates = Mat::from_fn(self.vectors.ncols(), motion.len(), |j, i| motion[i].qd[j]);
        taken += combine(self.damped.as_ref(), rates.as_ref());
        self.part(self.loads_of(motion) - taken)
    }

    /// Returns the forces that give the displacements `field` their acceleration, with terms of second order if
    /// directors turn: d'Alembert's principle for directors at e_a + theta x e_a + theta x (theta x e_a) / 2.
    fn inertial_forces(&self, motion: &[Instant], field: &Displacements) -> Mat<f64> {
        let on_rows = |extended: [Mat<f64>; 3]| {
            let Inertia { momentum, mut change, .. } = self.inertia_of(motion, extended);
            self.rows.add_turned(|i| self.axes * motion[i].omega, &momentum, &mut change);
            change
        };
        let Displacements { u, ud, udd } = field;
        let linear = [u, ud, udd].map(|x| self.rows.extend(x).into_owned());
        if !self.rows.have_directors() {
            return self.rows.restrict(on_rows(linear));
        }
        let moments = self.rows.turned_moments(&on_rows(linear), |i| u.col_as_slice(i));
        self.rows.restrict(on_rows(self.rows.extend_turned([u, ud, udd]))) + moments
    }

    /// Splits forces into modal forces and the nodal rest.
    pub(super) fn part(&self, mut forces: Mat<f64>) -> Unbalanced {
        let mut in_modes = gram(self.vectors.as_ref(), forces.as_ref());
        subtract_combination(forces.as_mut(), self.weighted.as_ref(), self.over_mass(&in_modes).as_ref());
        if let Some(held) = &self.held {
            held.balance(&mut forces);
        }
        self.coupled.without_inner_forces(&mut forces);
        if self.stiffens {
            in_modes.fill(0.0);
        }
        Unbalanced { forces, in_modes }
    }

    /// Returns the nodal part of [`NodalView::unbalanced`], evaluated in blocks of instants.
    pub(super) fn residual(&self, motion: &[Instant]) -> Mat<f64> {
        let mut residual = Mat::zeros(self.vectors.nrows(), motion.len());
        for first in (0..motion.len()).step_by(BLOCK) {
            let block = &motion[first..motion.len().min(first + BLOCK)];
            residual.as_mut().subcols_mut(first, block.len()).copy_from(self.unbalanced(block).forces);
        }
        residual
    }

    /// Returns m_ff^-1 x.
    fn over_mass(&self, x: &Mat<f64>) -> Mat<f64> {
        solve_upper(&self.lower, &solve_lower(&self.lower, x))
    }

    /// Returns D Psi in the equations of all nodes: with the damping matrix of the model if it has one, else with the
    /// modal damping distributed to the nodes (theory 6.15).
    fn damping_of_modes(&self) -> Mat<f64> {
        self.damped_by_model(self.vectors.as_ref())
            .unwrap_or_else(|| combine(self.weighted.as_ref(), self.over_mass(&self.modal_damping).as_ref()))
    }

    /// Returns D x with the mass- and stiffness-proportional damping or the damping matrix of the model; `None` if the
    /// model has neither.
    pub(super) fn damped_by_model(&self, x: MatRef<'_, f64>) -> Option<Mat<f64>> {
        let pencil = self.model.pencil();
        match self.damping? {
            Damping::Rayleigh { alpha, beta } => {
                let (inertial, elastic) = (pencil.apply_mass(x), pencil.apply_stiffness(x));
                let force = |i, j| alpha * inertial[(i, j)] + beta * elastic[(i, j)];
                Some(Mat::from_fn(x.nrows(), x.ncols(), force))
            }
            Damping::Matrix(damping) => {
                let mut forces = Mat::zeros(x.nrows(), x.ncols());
                multiply(damping, 1, x, forces.as_mut());
                Some(forces)
            }
            Damping::Ratio(_) | Damping::Bands(_) => None,
        }
    }

    /// Returns the inertia of the displacements `field` with directors that turn to second order, as momenta require.
    fn inertia_of_turned(&self, motion: &[Instant], field: &Displacements) -> Inertia {
        self.inertia_of(motion, self.rows.extend_turned([&field.u, &field.ud, &field.udd]))
    }

    /// Returns the inertia for displacements, rates and accelerations of the rows that inertia acts on.
    fn inertia_of(&self, motion: &[Instant], [u, ud, udd]: [Mat<f64>; 3]) -> Inertia {
        let omega = |i: usize| self.axes * motion[i].omega;
        let mut velocity = self.rigid_part(motion, |now| self.rigid_velocity(now)) + &ud;
        self.rows.add_turned(omega, &u, &mut velocity);
        let mut acceleration = self.rigid_part(motion, |now| self.free_acceleration(now)) + udd;
        self.rows.add_turned(|i| self.axes * motion[i].omega_rate, &u, &mut acceleration);
        self.rows.add_turned(omega, &ud, &mut acceleration);
        let weigh = |x: &Mat<f64>| self.rows.weigh(x.as_ref());
        Inertia { u, ud, momentum: weigh(&velocity), change: weigh(&acceleration) }
    }

    /// Returns (V, omega) of [`Inertia`], axes of the frame.
    pub(super) fn rigid_velocity(&self, now: &Instant) -> (Vector3<f64>, Vector3<f64>) {
        let velocity = if self.rows.have_directors() { Vector3::zeros() } else { now.velocity };
        (velocity, now.omega)
    }

    /// Returns (V' - g, omega') of [`Inertia`], axes of the frame.
    pub(super) fn free_acceleration(&self, now: &Instant) -> (Vector3<f64>, Vector3<f64>) {
        let mut linear = now.velocity_rate - now.gravity;
        if self.rows.have_directors() {
            let (w, centre) = (now.omega, self.axes.tr_mul(&self.centre));
            linear += w.cross(&now.velocity) + now.omega_rate.cross(&centre) + w.cross(&w.cross(&centre));
        }
        (linear, now.omega_rate)
    }

    /// Returns the acceleration of the undeformed body about the centre of mass, axes of the model.
    pub(super) fn rigid_acceleration(&self, now: &Instant) -> RigidAcceleration {
        let (linear, angular) = self.free_acceleration(now);
        RigidAcceleration::new(self.axes * linear, self.axes * angular, &(self.axes * now.omega))
    }

    /// Returns the modes in the rows that inertia acts on, and the mass times these.
    pub(super) fn extended(&self) -> [&Mat<f64>; 2] {
        match &self.extended {
            Some([modes, weighted]) => [modes, weighted],
            None => [&self.vectors, &self.weighted],
        }
    }

    /// Returns Psi q at the given instants. `of` returns q, its rate or its acceleration.
    pub(super) fn displacements(&self, motion: &[Instant], of: impl Fn(&Instant) -> &Vec<f64>) -> Mat<f64> {
        let q = Mat::from_fn(self.vectors.ncols(), motion.len(), |j, i| of(&motion[i])[j]);
        combine(self.vectors.as_ref(), q.as_ref())
    }

    /// Returns R (linear, angular) in the rows that inertia acts on. `of` returns the vectors in axes of the frame.
    fn rigid_part(
        &self,
        motion: &[Instant],
        of: impl Fn(&Instant) -> (Vector3<f64>, Vector3<f64>),
    ) -> Mat<f64> {
        let amplitudes = self.along_model(motion, of);
        combine(self.extended_rigid.as_ref(), amplitudes.as_ref())
    }

    /// Returns a linear and an angular vector in axes of the model, one column for every instant.
    pub(super) fn along_model(
        &self,
        motion: &[Instant],
        of: impl Fn(&Instant) -> (Vector3<f64>, Vector3<f64>),
    ) -> Mat<f64> {
        let plane = self.model.dimension() == 2;
        let mut both = Mat::zeros(self.rigid.ncols(), motion.len());
        for (i, now) in motion.iter().enumerate() {
            let (linear, angular) = of(now);
            let (linear, angular) = (self.axes * linear, self.axes * angular);
            let entries = if plane {
                vec![linear.x, linear.y, angular.z]
            } else {
                linear.iter().chain(&angular).copied().collect()
            };
            entries.iter().enumerate().for_each(|(k, value)| both[(k, i)] = *value);
        }
        both
    }

    /// Returns the nodal forces of the loads of the scene.
    fn loads_of(&self, motion: &[Instant]) -> Mat<f64> {
        let mut forces = Mat::zeros(self.vectors.nrows(), motion.len());
        for (at, columns) in self.loads.iter().enumerate() {
            forces += combine(columns.unit.as_ref(), self.load_amplitudes(motion, at).as_ref());
        }
        forces
    }

    /// Returns force and torque of load `at`, with the components that act on its point.
    pub(super) fn load_amplitudes(&self, motion: &[Instant], at: usize) -> Mat<f64> {
        let amplitudes = self.along_model(motion, |now| now.loads[at]);
        amplitudes.as_ref().subrows(0, self.loads[at].unit.ncols()).to_owned()
    }
}

// The point that carries a body, expressed in the rows of its model.

/// Conditions C u = 0 of a point that is at rest in the frame that it carries. There are as many conditions as rigid
/// motions R. The projection T = 1 - R (C R)^-1 C removes from a displacement the motion of the point. T' adds to
/// forces the reaction at the point, so that the sum is in balance.
pub(super) struct Held {
    /// C' (N x 6, in the plane N x 3).
    conditions: Mat<f64>,
    rigid: Mat<f64>,
    /// (C R)^-1.
    inverse: Mat<f64>,
}

impl Held {
    /// Builds the conditions for `point` of `model`, whose rigid motions are `rigid`. Returns `None` if C R is
    /// singular: the point has no orientation.
    pub(super) fn new(model: &FeModel, point: &NodalPoint, rigid: &Mat<f64>) -> Option<Self> {
        let conditions = point.unit_loads(model);
        let product = gram(conditions.as_ref(), rigid.as_ref());
        let count = product.nrows();
        let inverse = DMatrix::from_fn(count, count, |i, j| product[(i, j)]).try_inverse()?;
        let inverse = Mat::from_fn(count, count, |i, j| inverse[(i, j)]);
        Some(Self { conditions, rigid: rigid.clone(), inverse })
    }

    /// Returns C' (N x 6, in the plane N x 3).
    pub(super) fn conditions(&self) -> &Mat<f64> {
        &self.conditions
    }

    /// Applies T' to forces in place.
    pub(super) fn balance(&self, forces: &mut Mat<f64>) {
        let resultants = gram(self.rigid.as_ref(), forces.as_ref());
        let taken = gram(self.inverse.as_ref(), resultants.as_ref());
        subtract_combination(forces.as_mut(), self.conditions.as_ref(), taken.as_ref());
    }

    /// Applies T to displacements in place.
    pub(super) fn hold(&self, displacements: &mut Mat<f64>) {
        let moved = gram(self.conditions.as_ref(), displacements.as_ref());
        let motion = combine(self.inverse.as_ref(), moved.as_ref());
        subtract_combination(displacements.as_mut(), self.rigid.as_ref(), motion.as_ref());
    }
}

// Reaction of a prescribed motion, from the displacements of all nodes.

impl NodalView<'_> {
    /// Returns the reaction at every instant: force and torque about the origin of the frame, axes of the model, that
    /// the motion of the frame in `motion` requires with the nodal displacements `field`. With the momenta p = R_t'w
    /// and h = (R_r + B(u))'w,
    ///
    /// ```text
    /// p' + omega x p - F,    h' + omega x h + V x p - tau
    /// ```
    ///
    /// (theory 6.17, without the elastic forces, which balance each other). Directors turn to second order: their
    /// rotations also move their mass against each other, theta' x (theta' x e_a) and so on.
    pub(super) fn reactions(
        &self,
        motion: &[Instant],
        field: &Displacements,
    ) -> Vec<(Vector3<f64>, Vector3<f64>)> {
        let Inertia { u, ud, momentum, change } = self.inertia_of_turned(motion, field);
        // Resultants of momentum, its change and the loads.
        let momenta = self.resultants(self.extended_rigid.as_ref(), &momentum);
        let changes = self.resultants(self.extended_rigid.as_ref(), &change);
        let loads = self.resultants(self.rigid.as_ref(), &self.loads_of(motion));
        let shifts = self.shifts(motion, &field.u);
        let at = |i: usize| {
            let [u, ud, w, change] = [&u, &ud, &momentum, &change].map(|x| x.col_as_slice(i));
            let (velocity, _) = self.rigid_velocity(&motion[i]);
            let (velocity, omega) = (self.axes * velocity, self.axes * motion[i].omega);
            let (p, h) = (momenta[i].0, momenta[i].1 + self.rows.moment(u, w));
            let force = changes[i].0 + omega.cross(&p);
            let turning = changes[i].1 + self.rows.moment(u, change) + self.rows.moment(ud, w);
            let about_centre = turning + omega.cross(&h) + velocity.cross(&p);
            // Rigid motions about the centre of mass give torques about that centre: transfer the force to the origin.
            let torque = about_centre + self.centre.cross(&force);
            (force - loads[i].0, torque - loads[i].1 - shifts[i])
        };
        (0..motion.len()).map(at).collect()
    }

    /// Returns force and torque, about the reference point of the `rigid` motions, of each column of `forces`.
    fn resultants(&self, rigid: MatRef<'_, f64>, forces: &Mat<f64>) -> Vec<(Vector3<f64>, Vector3<f64>)> {
        let all = gram(rigid, forces.as_ref());
        let of = |i: usize| match self.model.dimension() {
            2 => (Vector3::new(all[(0, i)], all[(1, i)], 0.0), Vector3::new(0.0, 0.0, all[(2, i)])),
            _ => (Vector3::from_fn(|k, _| all[(k, i)]), Vector3::from_fn(|k, _| all[(3 + k, i)])),
        };
        (0..forces.ncols()).map(of).collect()
    }

    /// Returns the torque that the loads gain by the displacements `u` of their points, at every instant.
    fn shifts(&self, motion: &[Instant], u: &Mat<f64>) -> Vec<Vector3<f64>> {
        let mut torques = vec![Vector3::zeros(); motion.len()];
        for (at, load) in self.loads.iter().enumerate() {
            let arms = self.arms(load, u.as_ref());
            for (i, torque) in torques.iter_mut().enumerate() {
                *torque += arms[i] * (self.axes * motion[i].loads[at].0);
            }
        }
        torques
    }

    /// Returns, for every column of `displacements`, the matrix that gives the torque that a load gains by them from its force:
    /// u x of the displacement u of its point; of a named load the torque of its forces in the first column.
    pub(super) fn arms(&self, load: &SceneLoad, displacements: MatRef<'_, f64>) -> Vec<Matrix3<f64>> {
        let Some(turning) = &load.turning else {
            let moved = self.moved(load.unit.as_ref(), displacements);
            return moved.iter().map(Vector3::cross_matrix).collect();
        };
        let torques = gram(turning.as_ref(), displacements);
        let of = |i: usize| Matrix3::from_fn(|k, c| if c == 0 { torques[(k, i)] } else { 0.0 });
        (0..torques.ncols()).map(of).collect()
    }

    /// Returns the displacement of the point with the unit loads `unit`, axes of the model, for every column.
    pub(super) fn moved(&self, unit: MatRef<'_, f64>, displacements: MatRef<'_, f64>) -> Vec<Vector3<f64>> {
        let d = self.model.dimension();
        let moved = gram(unit.subcols(0, d), displacements);
        let of = |i: usize| Vector3::from_fn(|k, _| if k < d { moved[(k, i)] } else { 0.0 });
        (0..moved.ncols()).map(of).collect()
    }

    /// Returns the displacements Psi q + X y of all rows at the given instants, with rates and accelerations. `columns`
    /// is X, `amplitudes` are y, y' and y''.
    pub(super) fn field(
        &self,
        motion: &[Instant],
        columns: MatRef<'_, f64>,
        amplitudes: [MatRef<'_, f64>; 3],
    ) -> Displacements {
        let own = |of: fn(&Instant) -> &Vec<f64>, y: MatRef<'_, f64>| {
            self.displacements(motion, of) + combine(columns, y.to_owned().as_ref())
        };
        let [y, yd, ydd] = amplitudes;
        Displacements { u: own(|now| &now.q, y), ud: own(|now| &now.qd, yd), udd: own(|now| &now.qdd, ydd) }
    }
}
