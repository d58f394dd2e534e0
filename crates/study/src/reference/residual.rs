//! The forces that the equations of all nodes leave unbalanced in the motion of a body.

use super::held::Held;
use faer::{Mat, MatRef};
use flexbody_body::basis::CoupledModel;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::{
    SymmetricMatrix, combine, dense_cholesky, gram, multiply, solve_lower, solve_upper, subtract_combination,
};
use flexbody_model::{Damping, FeModel, InertialRows, RigidAcceleration};
use flexbody_motion::dynamics::NodalPoint;
use flexbody_motion::scene::Instant;
use nalgebra::{Matrix3, Vector3};

/// Instants that are computed together.
pub(super) const BLOCK: usize = 32;

/// A body in its frame, seen from the rows of its model.
pub(super) struct NodalView<'m> {
    pub model: &'m FeModel,
    /// The model that answers forces: under the couplings of the body, or without.
    pub coupled: CoupledModel<'m>,
    /// Psi (N x nf), M Psi and D Psi, rows and axes of the model.
    pub vectors: Mat<f64>,
    pub weighted: Mat<f64>,
    pub damped: Mat<f64>,
    /// m_ff = Psi'M Psi, and its Cholesky factor.
    pub modal_mass: Mat<f64>,
    lower: Mat<f64>,
    /// D_ff of the modes.
    pub modal_damping: Mat<f64>,
    /// Damping of the model, unless the scene replaces it.
    damping: Option<&'m Damping<SymmetricMatrix>>,
    /// Whether the body has stiffness that depends on the motion, which nodes do not have.
    stiffens: bool,
    /// Rigid motions about the origin of the frame (N x 6, in the plane N x 3), axes of the model.
    pub rigid: Mat<f64>,
    /// The rows that inertia acts on, the modes there and M times these where they are not the rows of the model,
    /// and rigid motions about their centre.
    pub rows: InertialRows<'m>,
    extended: Option<[Mat<f64>; 2]>,
    pub extended_rigid: Mat<f64>,
    /// Where that centre is from the origin of the frame, axes of the model.
    pub centre: Vector3<f64>,
    /// Axes of the frame in the model.
    pub axes: Matrix3<f64>,
    /// Nodal forces of unit forces and torques where each load of the scene acts (N x 6, in the plane N x 3).
    pub loads: Vec<Mat<f64>>,
    /// What carries the body.
    pub held: Option<Held>,
}

/// Forces that are left unbalanced.
pub(super) struct Unbalanced {
    /// At the nodes, beside what they do to the modes (N of every instant).
    pub forces: Mat<f64>,
    /// What they do to the modes (nf of every instant).
    pub in_modes: Mat<f64>,
}

/// Displacements of all rows of the model with their rates and accelerations, relative to the frame (N of every instant).
pub(super) struct Displacements {
    pub u: Mat<f64>,
    pub ud: Mat<f64>,
    pub udd: Mat<f64>,
}

/// Inertia of the rows that it acts on ([`InertialRows`]) at every instant, gravity as an acceleration that is not
/// there. Where rotations of nodes carry mass, V = 0 and V' - g is a = V' + omega x V - g, both of the centre of
/// mass.
pub(super) struct Inertia {
    /// The displacements u and rates u' there.
    pub u: Mat<f64>,
    pub ud: Mat<f64>,
    /// w = M (R (V, omega) + omega x u + u').
    pub momentum: Mat<f64>,
    /// M (R (V' - g, omega') + omega' x u + omega x u' + u'').
    pub change: Mat<f64>,
}

impl<'m> NodalView<'m> {
    /// `body`, with the damping of its scene, which was made of `model` and is carried by the point
    /// `carrier`; `None` when it has other rows, modes that depend on each other, or is carried by a point
    /// without an orientation.
    ///
    /// * `coupled`: the model under the couplings of `body`.
    /// * `damping`: that of the model, unless the scene replaces it by that of `body`.
    pub(super) fn new(
        coupled: CoupledModel<'m>,
        body: &FlexBody,
        loads: Vec<Mat<f64>>,
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

    /// r = f - K u - D u' - omega x w - M (R (V', omega') + omega' x u + omega x u' + u'') with
    /// w = M (R (V, omega) + omega x u + u') and u = Psi q (theory 6.9 to 6.13), a column for every
    /// instant, parted into g = Psi'r and r - M Psi m_ff^-1 g, of which what carries the body takes the
    /// resultants. g vanishes but for what the equations of the body take as approximate; of geometric
    /// stiffness, which nodes do not have, nothing is counted.
    pub(super) fn unbalanced(&self, motion: &[Instant]) -> Unbalanced {
        let own = |of: fn(&Instant) -> &Vec<f64>| self.displacements(motion, of);
        let field = Displacements { u: own(|now| &now.q), ud: own(|now| &now.qd), udd: own(|now| &now.qdd) };
        let Inertia { momentum, mut change, .. } = self.inertia(motion, &field);
        self.rows.add_turned(|i| self.axes * motion[i].omega, &momentum, &mut change);
        let mut taken = self.rows.restrict(change);
        if self.rows.have_directors() {
            for (i, now) in motion.iter().enumerate() {
                let rigid = self.rigid_acceleration(now);
                self.rows.add_second_order(&rigid, field.u.col_as_slice(i), taken.col_as_slice_mut(i));
            }
        }
        taken += self.model.pencil().apply_stiffness(field.u.as_ref());
        let rates = Mat::from_fn(self.vectors.ncols(), motion.len(), |j, i| motion[i].qd[j]);
        taken += combine(self.damped.as_ref(), rates.as_ref());
        self.part(self.loads_of(motion) - taken)
    }

    /// Parts forces as those that are left unbalanced: what they do to the modes, and the rest.
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

    /// The forces of [`NodalView::unbalanced`] beside what they do to the modes, few instants at a time.
    pub(super) fn residual(&self, motion: &[Instant]) -> Mat<f64> {
        let mut residual = Mat::zeros(self.vectors.nrows(), motion.len());
        for first in (0..motion.len()).step_by(BLOCK) {
            let block = &motion[first..motion.len().min(first + BLOCK)];
            residual.as_mut().subcols_mut(first, block.len()).copy_from(self.unbalanced(block).forces);
        }
        residual
    }

    /// m_ff^-1 x.
    pub(super) fn over_mass(&self, x: &Mat<f64>) -> Mat<f64> {
        solve_upper(&self.lower, &solve_lower(&self.lower, x))
    }

    /// D Psi, as the equations of all nodes have it: that of the model, else that of the modes on the nodes
    /// (theory 6.15).
    fn damping_of_modes(&self) -> Mat<f64> {
        self.damped_by_model(self.vectors.as_ref())
            .unwrap_or_else(|| combine(self.weighted.as_ref(), self.over_mass(&self.modal_damping).as_ref()))
    }

    /// D x with the damping of the model by mass and stiffness or by a matrix; `None` where it has none of these.
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

    /// The inertia of the displacements `field` while the frame moves as in `motion`.
    fn inertia(&self, motion: &[Instant], field: &Displacements) -> Inertia {
        self.inertia_of(motion, [&field.u, &field.ud, &field.udd].map(|x| self.rows.extend(x).into_owned()))
    }

    /// The same with nodes that turn to second order, as momenta have it.
    pub(super) fn inertia_of_turned(&self, motion: &[Instant], field: &Displacements) -> Inertia {
        self.inertia_of(motion, self.rows.extend_turned([&field.u, &field.ud, &field.udd]))
    }

    /// The inertia of displacements, rates and accelerations of the rows that it acts on.
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

    /// (V, omega) of [`Inertia`], axes of the frame.
    pub(super) fn rigid_velocity(&self, now: &Instant) -> (Vector3<f64>, Vector3<f64>) {
        let velocity = if self.rows.have_directors() { Vector3::zeros() } else { now.velocity };
        (velocity, now.omega)
    }

    /// (V' - g, omega') of [`Inertia`], axes of the frame.
    pub(super) fn free_acceleration(&self, now: &Instant) -> (Vector3<f64>, Vector3<f64>) {
        let mut linear = now.velocity_rate - now.gravity;
        if self.rows.have_directors() {
            let (w, centre) = (now.omega, self.axes.tr_mul(&self.centre));
            linear += w.cross(&now.velocity) + now.omega_rate.cross(&centre) + w.cross(&w.cross(&centre));
        }
        (linear, now.omega_rate)
    }

    /// The acceleration of the undeformed body about the centre of mass, axes of the model.
    pub(super) fn rigid_acceleration(&self, now: &Instant) -> RigidAcceleration {
        let (linear, angular) = self.free_acceleration(now);
        RigidAcceleration::new(self.axes * linear, self.axes * angular, &(self.axes * now.omega))
    }

    /// The modes in the rows that inertia acts on, and the mass times these.
    pub(super) fn extended(&self) -> [&Mat<f64>; 2] {
        match &self.extended {
            Some([modes, weighted]) => [modes, weighted],
            None => [&self.vectors, &self.weighted],
        }
    }

    /// Psi q, or with the rates or accelerations in place of q.
    pub(super) fn displacements(&self, motion: &[Instant], of: impl Fn(&Instant) -> &Vec<f64>) -> Mat<f64> {
        let q = Mat::from_fn(self.vectors.ncols(), motion.len(), |j, i| of(&motion[i])[j]);
        combine(self.vectors.as_ref(), q.as_ref())
    }

    /// R (linear, angular) of the rows that inertia acts on, given along the axes of the frame.
    fn rigid_part(
        &self,
        motion: &[Instant],
        of: impl Fn(&Instant) -> (Vector3<f64>, Vector3<f64>),
    ) -> Mat<f64> {
        let amplitudes = self.along_model(motion, of);
        combine(self.extended_rigid.as_ref(), amplitudes.as_ref())
    }

    /// A linear and an angular vector in the coordinates of the model, a column for every instant.
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
            let entries = match plane {
                true => vec![linear.x, linear.y, angular.z],
                false => linear.iter().chain(&angular).copied().collect(),
            };
            entries.iter().enumerate().for_each(|(k, value)| both[(k, i)] = *value);
        }
        both
    }

    /// Nodal forces of the loads of the scene.
    pub(super) fn loads_of(&self, motion: &[Instant]) -> Mat<f64> {
        let mut forces = Mat::zeros(self.vectors.nrows(), motion.len());
        for (at, columns) in self.loads.iter().enumerate() {
            forces += combine(columns.as_ref(), self.load_amplitudes(motion, at).as_ref());
        }
        forces
    }

    /// Force and torque of one of the loads, as many of their components as act on its point.
    pub(super) fn load_amplitudes(&self, motion: &[Instant], at: usize) -> Mat<f64> {
        let amplitudes = self.along_model(motion, |now| now.loads[at]);
        amplitudes.as_ref().subrows(0, self.loads[at].ncols()).to_owned()
    }
}
