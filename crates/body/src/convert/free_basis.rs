//! Static responses of the free body to loads, outside the modes and whole (theory section 12).

use super::motion_forces::{MotionForces, motion_forces};
use crate::basis::{CoupledModel, centrifugal_loads, coupled_static_responses, interface_loads, rigid_modes};
use crate::flex_body::{
    LOAD_COMPONENTS, LoadColumns, LoadKind, MotionColumns, MotionLoad, Recovery, TermGroups, UnitLoad,
    modes_respond,
};
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_eigen::ResponseAccuracy;
use flexbody_linalg::context::Context;
use flexbody_linalg::{
    column_products, combine, dense_cholesky, gram, side_by_side, solve_lower, solve_upper,
    subtract_combination,
};
use flexbody_model::{Coupling, FeModel, ModelRecovery, RecoveryRow, rigid_axes};

/// Modes without rigid motion, and the model with the couplings that they preserve.
pub(super) struct FreeBasis<'m> {
    pub(super) coupled: CoupledModel<'m>,
    /// Rigid motions (N x 6), M-orthonormal.
    pub(super) rigid: Mat<f64>,
    /// Psi_m = Psi - R R'M Psi (N x nf).
    pub(super) modes: Mat<f64>,
    /// K_ff.
    stiffness: Mat<f64>,
}

impl<'m> FreeBasis<'m> {
    /// Creates the basis of the modes `vectors` (N x nf) with the stiffness `stiffness`.
    pub(super) fn new(model: &'m FeModel, vectors: &Mat<f64>, stiffness: Mat<f64>) -> Result<Self> {
        let pencil = model.pencil();
        let rigid = rigid_modes(model, &pencil)?;
        let mut modes = vectors.clone();
        let along = gram(rigid.as_ref(), pencil.apply_mass(modes.as_ref()).as_ref());
        subtract_combination(modes.as_mut(), rigid.as_ref(), along.as_ref());
        let coupled = CoupledModel::of_modes(model, model.interfaces(), vectors.as_ref());
        Ok(Self { coupled, rigid, modes, stiffness })
    }

    /// Returns the static responses G_r F to all loads (N x m), in mean axes.
    ///
    /// * `first`: about the first flexible eigenvalue.
    pub(super) fn responses(
        &self,
        loads: &StaticLoads,
        first: f64,
        groups: TermGroups,
        context: &Context<'_>,
    ) -> Result<Mat<f64>> {
        let mut responses = self.whole_responses(loads, first, context)?;
        // Less the part that the modes contain.
        let amplitudes = self.static_amplitudes(loads, groups);
        subtract_combination(responses.as_mut(), self.modes.as_ref(), amplitudes.as_ref());
        Ok(responses)
    }

    /// Returns the whole static responses G F to all loads (N x m), in mean axes.
    ///
    /// * `first`: about the first flexible eigenvalue.
    pub(super) fn whole_responses(
        &self,
        loads: &StaticLoads,
        first: f64,
        context: &Context<'_>,
    ) -> Result<Mat<f64>> {
        self.responses_to(loads.forces.clone(), first, ResponseAccuracy::FULL, context)
    }

    /// Returns the static responses G F to nodal forces (N x m), in mean axes.
    ///
    /// * `first`: about the first flexible eigenvalue.
    pub(super) fn responses_to(
        &self,
        forces: Mat<f64>,
        first: f64,
        accuracy: ResponseAccuracy,
        context: &Context<'_>,
    ) -> Result<Mat<f64>> {
        coupled_static_responses(&self.coupled, forces, first, accuracy, context)
    }

    /// Returns f'G f of each named load, for its `responses` G_r F in mean axes among those to all loads.
    pub(super) fn compliances(&self, loads: &StaticLoads, responses: &Mat<f64>) -> Vec<f64> {
        let amplitudes = self.static_amplitudes(loads, TermGroups::ALL);
        let modal = loads.modal(&self.modes, TermGroups::ALL);
        let one = |c: usize| -> f64 {
            let outside: f64 = (0..responses.nrows()).map(|i| loads.forces[(i, c)] * responses[(i, c)]).sum();
            let inside: f64 = (0..modal.nrows()).map(|j| modal[(j, c)] * amplitudes[(j, c)]).sum();
            outside + inside
        };
        loads.named_columns().map(one).collect()
    }

    /// Returns the parts of nodal forces (N x m), beside those of rigid motion, that the inertia of the modes does not balance,
    /// F - M R R'F - M Psi_m m^-1 Psi_m'F with m = Psi_m'M Psi_m, and that their stiffness does not, with K and K_ff in place of
    /// M and m. Sections depend on the former, rows of an operator on the latter.
    fn outside(&self, forces: &Mat<f64>) -> [Mat<f64>; 2] {
        let pencil = self.coupled.model().pencil();
        let (inertial, elastic) =
            (pencil.apply_mass(self.modes.as_ref()), pencil.apply_stiffness(self.modes.as_ref()));
        let mass = gram(self.modes.as_ref(), inertial.as_ref());
        let modal = gram(self.modes.as_ref(), forces.as_ref());
        let beside_rigid = beside_rigid(self.coupled.model(), &self.rigid, forces);
        [(inertial, &mass), (elastic, &self.stiffness)].map(|(balanced, matrix)| {
            let amplitudes =
                solve(matrix, &modal).expect("mass and stiffness of modes are positive definite");
            // Inner forces of rigid interfaces do not deform the body.
            self.coupled.restrict(&beside_rigid - combine(balanced.as_ref(), amplitudes.as_ref()))
        })
    }

    /// Removes rigid motion from fields (N x m): the part that rounding leaves.
    pub(super) fn remove_rigid_motion(&self, fields: &mut Mat<f64>) {
        let moved = self.coupled.model().pencil().apply_mass(fields.as_ref());
        let along = gram(self.rigid.as_ref(), moved.as_ref());
        subtract_combination(fields.as_mut(), self.rigid.as_ref(), along.as_ref());
    }

    /// Returns the M-norms of the whole static responses, about |G_r F| + |Psi_m K_ff^-1 Psi_m'F|.
    pub(super) fn sizes_of_responses(
        &self,
        responses: &Mat<f64>,
        loads: &StaticLoads,
        groups: TermGroups,
    ) -> Vec<f64> {
        let amplitudes = self.static_amplitudes(loads, groups);
        let of_modes = combine(self.modes.as_ref(), amplitudes.as_ref());
        let both = self.norms(responses).into_iter().zip(self.norms(&of_modes));
        both.map(|(outside, inside)| outside + inside).collect()
    }

    /// Returns the M-norms of fields (N x m).
    pub(super) fn norms(&self, fields: &Mat<f64>) -> Vec<f64> {
        let moved = self.coupled.model().pencil().apply_mass(fields.as_ref());
        let squares = column_products(fields.as_ref(), moved.as_ref());
        squares.into_iter().map(|square| square.max(0.0).sqrt()).collect()
    }

    /// Returns the amplitudes K_ff^-1 Psi_m'F of the modes under constant loads; zero for the forces of motion that the modes
    /// do not respond to without a group.
    pub(super) fn static_amplitudes(&self, loads: &StaticLoads, groups: TermGroups) -> Mat<f64> {
        let solved = solve(&self.stiffness, &loads.modal(&self.modes, groups));
        solved.expect("the stiffness of modes with positive eigenvalues is positive definite")
    }

    /// Returns the section forces of one side with the motions T_S (N x 6): in the modes, T_S'M Psi_m m^-1 K_ff, and
    /// under the loads, T_S'(F - M R R'F - M Psi_m m^-1 Psi_m'F) with m = Psi_m'M Psi_m. They are the loads less the
    /// inertia of this side, so that no static solution and no strain enters.
    pub(super) fn section_forces(
        &self,
        model: &FeModel,
        side: &Mat<f64>,
        loads: &StaticLoads,
        groups: TermGroups,
    ) -> (Mat<f64>, Mat<f64>) {
        let pencil = model.pencil();
        let moved = pencil.apply_mass(side.as_ref());
        let of_inertia = gram(moved.as_ref(), self.modes.as_ref());
        let mass = gram(self.modes.as_ref(), pencil.apply_mass(self.modes.as_ref()).as_ref());
        let accelerations = |modal: &Mat<f64>| {
            solve(&mass, modal).expect("the mass of independent modes is positive definite")
        };
        let forces = beside_rigid(model, &self.rigid, &loads.forces);
        let modal = accelerations(&loads.modal(&self.modes, groups));
        let columns = gram(side.as_ref(), forces.as_ref()) - combine(of_inertia.as_ref(), modal.as_ref());
        (combine(of_inertia.as_ref(), accelerations(&self.stiffness).as_ref()), columns)
    }
}

/// Returns F - M R R'F: nodal forces (N x m) less those that accelerate the body rigidly.
///
/// * `rigid`: rigid motions R, M-orthonormal.
pub(super) fn beside_rigid(model: &FeModel, rigid: &Mat<f64>, forces: &Mat<f64>) -> Mat<f64> {
    let resultants = gram(rigid.as_ref(), forces.as_ref());
    let inertial = model.pencil().apply_mass(rigid.as_ref());
    forces - combine(inertial.as_ref(), resultants.as_ref())
}

/// Returns A^-1 B for a symmetric positive definite A; `None` for another.
fn solve(a: &Mat<f64>, b: &Mat<f64>) -> Option<Mat<f64>> {
    let lower = dense_cholesky(a.clone())?;
    Some(solve_upper(&lower, &solve_lower(&lower, b)))
}

/// Loads of the columns, along the axes of the model: six (in the plane one) centrifugal loads, then six (in the plane
/// three) for each interface with a reference point, then the named loads, then the forces of the deformed body by its
/// motion.
pub(super) struct StaticLoads {
    /// Nodal forces (N x m).
    forces: Mat<f64>,
    /// Components of [`LoadKind::SPIN`] of the centrifugal loads.
    spins: &'static [usize],
    interfaces: Vec<String>,
    /// Components of force and torque of the loads at an interface.
    components: &'static [usize],
    named: Vec<String>,
    /// Kinds of forces of the deformed body, with the components of the model's dimension.
    motion: Vec<(MotionLoad, &'static [usize])>,
    /// Number of modes whose deformation exerts forces.
    modes: usize,
}

impl StaticLoads {
    /// Creates the loads of a model and the forces of its modes `vectors` (N x nf) in the frame of the body, whose span with
    /// rigid motion is that of `basis`.
    ///
    /// * `inertia`: true to add the inertia of the deformation.
    pub(super) fn new(
        model: &FeModel,
        basis: &FreeBasis<'_>,
        vectors: &Mat<f64>,
        inertia: bool,
    ) -> Result<Self> {
        let motion = motion_forces(model, vectors, inertia, |forces| basis.outside(forces));
        Self::with_motion(model, motion, vectors.ncols())
    }

    /// Creates the loads of a model alone.
    pub(super) fn of_model(model: &FeModel) -> Result<Self> {
        Self::with_motion(model, Vec::new(), 0)
    }

    fn with_motion(model: &FeModel, motion: Vec<MotionForces>, modes: usize) -> Result<Self> {
        let mut parts = centrifugal_loads(model);
        let mut interfaces = Vec::new();
        for set in model.interfaces().iter().filter(|set| set.coupling() != Coupling::Free) {
            if let Some(loads) = interface_loads(model, &set.name)? {
                interfaces.push(set.name.clone());
                parts.push(loads);
            }
        }
        let named = model.named_loads();
        parts.push(Mat::from_fn(model.rows().len(), named.len(), |i, c| named[c].forces[i]));
        let of_motion = |forces: &MotionForces| (forces.load, forces.load.of_dimension(model.dimension()));
        let kinds = motion.iter().map(of_motion).collect();
        parts.extend(motion.into_iter().map(|response| response.forces));
        let parts: Vec<_> = parts.iter().map(Mat::as_ref).collect();
        Ok(Self {
            forces: side_by_side(&parts),
            spins: LoadKind::Spin.of_dimension(model.dimension()),
            interfaces,
            components: rigid_axes(model.dimension()),
            named: named.iter().map(|load| load.name.clone()).collect(),
            motion: kinds,
            modes,
        })
    }

    /// Returns the nodal forces of some of the loads (N x columns).
    pub(super) fn forces_of(&self, columns: &[usize]) -> Mat<f64> {
        Mat::from_fn(self.forces.nrows(), columns.len(), |i, at| self.forces[(i, columns[at])])
    }

    /// Returns the names of the loads, in their order.
    pub(super) fn names(&self) -> Vec<String> {
        let of_kind = |&(load, components): &(MotionLoad, &'static [usize])| {
            components.iter().flat_map(move |&c| (0..self.modes).map(move |j| load.step(c, j)))
        };
        let loads = self.unit_loads();
        loads.iter().map(UnitLoad::step).chain(self.motion.iter().flat_map(of_kind)).collect()
    }

    /// Returns the columns of the named loads.
    fn named_columns(&self) -> std::ops::Range<usize> {
        let first = self.spins.len() + self.interfaces.len() * self.components.len();
        first..first + self.named.len()
    }

    /// Returns the number of loads that have columns in a recovery, which come first: the inertia of the deformation where it
    /// is asked for, and all others.
    pub(super) fn count_for(&self, asked: &ModelRecovery) -> usize {
        let of_inertia =
            self.of_motion().find(|(load, ..)| *load != MotionLoad::Damping && !asked.deformed_inertia);
        of_inertia.map_or(self.forces.ncols(), |(.., first)| first)
    }

    /// Returns the kinds of forces of the deformed body, their components and their first column.
    fn of_motion(&self) -> impl Iterator<Item = (MotionLoad, &'static [usize], usize)> {
        let mut next = self.named_columns().end;
        self.motion.iter().map(move |&(load, components)| {
            let first = next;
            next += components.len() * self.modes;
            (load, components, first)
        })
    }

    /// Returns the unit loads of geometric stiffness that the loads are, in their order, without forces of motion.
    pub(super) fn unit_loads(&self) -> Vec<UnitLoad> {
        let spin = self.spins.iter().map(|&component| UnitLoad { kind: LoadKind::Spin, component });
        let at = |interface: &String| {
            let all = UnitLoad::at_interface(interface);
            self.components.iter().map(|&component| all[component].clone()).collect::<Vec<_>>()
        };
        let named =
            self.named.iter().map(|name| UnitLoad { kind: LoadKind::Named(name.clone()), component: 0 });
        spin.chain(self.interfaces.iter().flat_map(at)).chain(named).collect()
    }

    /// Returns the modal loads Psi_m'F (nf x m); those of spin and of other motion are zero if the modes do not respond to it
    /// without a group.
    fn modal(&self, modes: &Mat<f64>, groups: TermGroups) -> Mat<f64> {
        let mut modal = gram(modes.as_ref(), self.forces.as_ref());
        if !groups.w1 {
            modal.as_mut().subcols_mut(0, self.spins.len()).fill(0.0);
        }
        for (load, components, first) in self.of_motion() {
            if !modes_respond(load, groups) {
                modal.as_mut().subcols_mut(first, components.len() * self.modes).fill(0.0);
            }
        }
        modal
    }

    /// Returns the recovery with the rows in the modes and under all loads (rows x m), along the axes of the model.
    pub(super) fn recovery(
        &self,
        asked: &ModelRecovery,
        rows: Vec<RecoveryRow>,
        offset: Vec<f64>,
        modes: Mat<f64>,
        columns: &Mat<f64>,
    ) -> Recovery {
        let count = rows.len();
        let mut spin = Mat::zeros(count, LoadKind::SPIN.len());
        for (from, &to) in self.spins.iter().enumerate() {
            (0..count).for_each(|i| spin[(i, to)] = columns[(i, from)]);
        }
        let at = |(a, interface): (usize, &String)| {
            let mut own = Mat::zeros(count, LOAD_COMPONENTS);
            for (from, &to) in self.components.iter().enumerate() {
                let from = self.spins.len() + a * self.components.len() + from;
                (0..count).for_each(|i| own[(i, to)] = columns[(i, from)]);
            }
            LoadColumns { interface: interface.clone(), columns: own }
        };
        let loads = self.interfaces.iter().enumerate().map(at).collect();
        let named = columns.as_ref().subcols(self.named_columns().start, self.named.len()).to_owned();
        let nf = self.modes;
        let of_kind = |(load, components, first): (MotionLoad, &'static [usize], usize)| {
            let mut own = Mat::zeros(count, load.components() * nf);
            for (from, &to) in components.iter().enumerate() {
                let columns = columns.as_ref().subcols(first + from * nf, nf);
                own.as_mut().subcols_mut(to * nf, nf).copy_from(columns);
            }
            MotionColumns { load, columns: own }
        };
        let asked_for = self.of_motion().filter(|(.., first)| *first < self.count_for(asked));
        let motion = asked_for.map(of_kind).collect();
        Recovery { name: asked.name.clone(), rows, offset, modes, spin, loads, named, motion }
    }
}
