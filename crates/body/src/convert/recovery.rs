//! Recoveries of a body: the rows of its model in the modes, and their static columns outside the modes (theory
//! section 12).

use super::answered::{Targets, mapped_answers};
use super::motion_forces::{MotionForces, motion_forces};
use super::{BodyModes, ModalModel, NodesInFrame};
use crate::basis::{
    CoupledModel, accurate_static_responses, centrifugal_loads, interface_loads, rigid_modes,
};
use crate::flex_body::{
    LOAD_COMPONENTS, LoadColumns, LoadKind, MotionColumns, MotionLoad, NamedLoad, Recovery, TermGroups,
    UnitLoad, modes_respond,
};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::numbers::significant;
use flexbody_linalg::context::Context;
use flexbody_linalg::{
    CscMatrix, column_products, combine, dense_cholesky, gram, side_by_side, solve_lower, solve_upper,
    subtract_combination,
};
use flexbody_model::{Coupling, FeModel, ModelRecovery, Quantity, RecoveryOperator, RecoveryRow, rigid_axes};
use std::collections::HashSet;

/// Names of the components of force and torque.
const COMPONENTS: [&str; LOAD_COMPONENTS] = ["Fx", "Fy", "Fz", "Mx", "My", "Mz"];

/// Recoveries and named loads of a body.
#[derive(Debug, Default)]
pub(crate) struct Recovered {
    pub recoveries: Vec<Recovery>,
    pub named_loads: Vec<NamedLoad>,
    /// Notes and warnings.
    pub diagnostics: Vec<Diagnostic>,
    /// Columns of the modes in place of the static columns of each recovery: their static responses to the same loads.
    /// Only for a check, which needs their sizes.
    pub of_modes: Vec<Recovery>,
}

/// A model and the modes of a body in it, from which recoveries and named loads follow.
pub(crate) struct BodyOfModel<'a> {
    pub model: &'a FeModel,
    pub modes: &'a BodyModes,
    pub place: &'a NodesInFrame,
    /// Psi' K Psi.
    pub modal_stiffness: &'a Mat<f64>,
    /// About the first flexible eigenvalue.
    pub lowest: f64,
    /// Interface that the frame follows.
    pub held_at: Option<&'a str>,
    /// True if a body is checked, not made.
    pub is_check: bool,
}

/// Static responses of the free body.
struct Responses {
    /// G_r F (N x m), relative to the frame of the body.
    fields: Mat<f64>,
    /// f'G f of each named load.
    compliances: Vec<f64>,
}

impl ModalModel<'_> {
    /// Returns the model and the modes, from which recoveries and named loads follow.
    pub(super) fn of_model(&self) -> BodyOfModel<'_> {
        BodyOfModel {
            model: self.model,
            modes: &self.modes,
            place: &self.place,
            modal_stiffness: &self.modal_stiffness,
            lowest: self.found.solution.eigenvalues[0],
            held_at: self.settings.frame.interface(),
            is_check: false,
        }
    }
}

impl BodyOfModel<'_> {
    /// Returns the recoveries and named loads that the model asks for, with notes and warnings. Their static responses need one factor of
    /// K + tau M; cuts need none.
    ///
    /// * `groups`: groups that the body holds, by which the modes respond to its motion.
    ///
    /// # Errors
    /// [`RecoveryCut`](Code::RecoveryCut) for a cut through a rigid interface; failures of the factor, and responses
    /// that are not accurate.
    pub(crate) fn recoveries(&self, groups: TermGroups, context: &Context<'_>) -> Result<Recovered> {
        let (asked, mut named_loads) = (self.model.recoveries(), self.named_loads());
        if asked.is_empty() && named_loads.is_empty() {
            return Ok(Recovered::default());
        }
        context.phase("recovery");
        let basis = FreeBasis::new(self.model, &self.modes.vectors, self.modal_stiffness.clone())?;
        let inertia = asked.iter().any(|one| one.deformed_inertia);
        let loads = StaticLoads::new(self.model, &basis, &self.modes.vectors, inertia)?;
        let is_cut = |one: &ModelRecovery| matches!(one.operator, RecoveryOperator::Cut { .. });
        let responses = if !asked.iter().all(is_cut) || !named_loads.is_empty() {
            self.responses(&basis, &loads, groups, context)?
        } else {
            Responses { fields: Mat::new(), compliances: Vec::new() }
        };
        named_loads.iter_mut().zip(&responses.compliances).for_each(|(load, c)| load.compliance = Some(*c));
        let responses = responses.fields;
        let sizes = match responses.ncols() {
            0 => Vec::new(),
            _ => basis.sizes_of_responses(&responses, &loads, groups),
        };
        let mut diagnostics = Vec::new();
        let one = |one: &ModelRecovery| match &one.operator {
            RecoveryOperator::Rows { transposed, labels, offset } => {
                let modes = product(transposed, &self.modes.vectors);
                let columns = product(transposed, &responses);
                let offset = offset.clone().unwrap_or_else(|| vec![0.0; labels.len()]);
                Ok(loads.recovery(one, labels.clone(), offset, modes, &columns))
            }
            RecoveryOperator::Shapes { shapes, labels } => {
                let responses = responses.as_ref().subcols(0, loads.count_for(one)).to_owned();
                let targets = Targets {
                    modes: &basis.modes,
                    responses: &responses,
                    sizes: sizes[..responses.ncols()].to_vec(),
                    names: loads.names(),
                };
                let mapped = mapped_answers(self.model, one, shapes, &targets)?;
                diagnostics.extend(mapped.diagnostics);
                let offset = vec![0.0; labels.len()];
                Ok(loads.recovery(one, labels.clone(), offset, mapped.modes, &mapped.columns))
            }
            RecoveryOperator::Cut { nodes, about } => {
                self.refuse_divided_interface(one, nodes, &basis.coupled)?;
                let side = one_side(self.model, nodes, *about);
                let (modes, columns) = basis.section_forces(self.model, &side, &loads, groups);
                let labels = section_labels(self.model, *about);
                let offset = vec![0.0; labels.len()];
                Ok(loads.recovery(one, labels, offset, modes, &columns))
            }
        };
        let along_model = asked.iter().map(one).collect::<Result<Vec<Recovery>>>()?;
        let turned = |one: &Recovery| one.in_axes(&self.place.frame.axes);
        let mut of_modes = Vec::new();
        if self.is_check {
            let amplitudes = basis.static_amplitudes(&loads, groups);
            of_modes.extend(along_model.iter().zip(asked).map(|(own, one)| {
                let columns = combine(own.modes.as_ref(), amplitudes.as_ref());
                turned(&loads.recovery(
                    one,
                    own.rows.clone(),
                    own.offset.clone(),
                    own.modes.clone(),
                    &columns,
                ))
            }));
        }
        let recoveries = along_model.iter().map(turned).collect();
        Ok(Recovered { recoveries, named_loads, diagnostics, of_modes })
    }

    /// Returns the static responses G_r F to all loads (N x m), relative to the frame of the body, and the compliances of the
    /// named loads.
    fn responses(
        &self,
        basis: &FreeBasis<'_>,
        loads: &StaticLoads,
        groups: TermGroups,
        context: &Context<'_>,
    ) -> Result<Responses> {
        let mut responses = basis.responses(loads, self.lowest, groups, context)?;
        let compliances = basis.compliances(loads, &responses);
        // A frame on an interface follows its motion.
        if let Some(name) = self.held_at
            && let Some(measure) = interface_loads(self.model, name)?
        {
            let motion = gram(measure.as_ref(), responses.as_ref());
            let rigid = self.model.rigid_fields(self.place.frame.origin.into(), 1.0);
            subtract_combination(responses.as_mut(), rigid.as_ref(), motion.as_ref());
        }
        Ok(Responses { fields: responses, compliances })
    }

    /// Returns an error if a cut divides an interface that all modes leave rigid: its inner forces are unknown.
    fn refuse_divided_interface(
        &self,
        cut: &ModelRecovery,
        side: &[i64],
        coupled: &CoupledModel<'_>,
    ) -> Result<()> {
        let side: HashSet<i64> = side.iter().copied().collect();
        for name in coupled.rigid_interfaces() {
            let set = self.model.interfaces().iter().find(|set| set.name == name);
            let nodes = set.map_or(&[][..], |set| set.nodes.as_slice());
            let inside = nodes.iter().filter(|id| side.contains(id)).count();
            if inside > 0 && inside < nodes.len() {
                let message = format!(
                    "recovery `{}`: its cut divides the rigid interface `{name}`, {inside} of {} nodes are on this side",
                    cut.name,
                    nodes.len()
                );
                return Err(Diagnostic::new(Code::RecoveryCut, message).in_file(&cut.path).into());
            }
        }
        Ok(())
    }
}

/// Modes without rigid motion, and the model with the couplings that they preserve.
pub(super) struct FreeBasis<'m> {
    coupled: CoupledModel<'m>,
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
        self.responses_to(loads.forces.clone(), first, context)
    }

    /// Returns the static responses G F to nodal forces (N x m), in mean axes.
    ///
    /// * `first`: about the first flexible eigenvalue.
    pub(super) fn responses_to(
        &self,
        forces: Mat<f64>,
        first: f64,
        context: &Context<'_>,
    ) -> Result<Mat<f64>> {
        accurate_static_responses(&self.coupled, forces, first, context)
    }

    /// Returns f'G f of each named load, for its `responses` G_r F in mean axes among those to all loads.
    fn compliances(&self, loads: &StaticLoads, responses: &Mat<f64>) -> Vec<f64> {
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
        let beside_rigid = self.beside_rigid(forces);
        [(inertial, &mass), (elastic, &self.stiffness)].map(|(balanced, matrix)| {
            let amplitudes =
                solve(matrix, &modal).expect("mass and stiffness of modes are positive definite");
            // Inner forces of rigid interfaces do not deform the body.
            self.coupled.restrict(&beside_rigid - combine(balanced.as_ref(), amplitudes.as_ref()))
        })
    }

    /// Returns F - M R R'F: nodal forces (N x m) less those that accelerate the body rigidly.
    fn beside_rigid(&self, forces: &Mat<f64>) -> Mat<f64> {
        let resultants = gram(self.rigid.as_ref(), forces.as_ref());
        let inertial = self.coupled.model().pencil().apply_mass(self.rigid.as_ref());
        forces - combine(inertial.as_ref(), resultants.as_ref())
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
    fn static_amplitudes(&self, loads: &StaticLoads, groups: TermGroups) -> Mat<f64> {
        let solved = solve(&self.stiffness, &loads.modal(&self.modes, groups));
        solved.expect("the stiffness of modes with positive eigenvalues is positive definite")
    }

    /// Returns the section forces of one side with the motions T_S (N x 6): in the modes, T_S'M Psi_m m^-1 K_ff, and
    /// under the loads, T_S'(F - M R R'F - M Psi_m m^-1 Psi_m'F) with m = Psi_m'M Psi_m. They are the loads less the
    /// inertia of this side, so that no static solution and no strain enters.
    fn section_forces(
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
        let forces = self.beside_rigid(&loads.forces);
        let modal = accelerations(&loads.modal(&self.modes, groups));
        let columns = gram(side.as_ref(), forces.as_ref()) - combine(of_inertia.as_ref(), modal.as_ref());
        (combine(of_inertia.as_ref(), accelerations(&self.stiffness).as_ref()), columns)
    }
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
        let of_motion = |one: &MotionForces| (one.load, one.load.of_dimension(model.dimension()));
        let kinds = motion.iter().map(of_motion).collect();
        parts.extend(motion.into_iter().map(|one| one.forces));
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
    fn count_for(&self, asked: &ModelRecovery) -> usize {
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
    fn recovery(
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

/// Returns R X for R given by its transpose (N x rows).
fn product(transposed: &CscMatrix, x: &Mat<f64>) -> Mat<f64> {
    let entry = |i: usize, j: usize| -> f64 {
        let (rows, values) = transposed.column(i);
        rows.iter().zip(values).map(|(&row, value)| value * x[(row as usize, j)]).sum()
    };
    Mat::from_fn(transposed.n_cols(), x.ncols(), entry)
}

/// Returns the rows of a recovery of `model` for displacements x of all rows of the model (rows x columns of x), without
/// the values of the undeformed body: R x, and T_S'K x for a cut. `None` for a recovery that is known for some shapes
/// only.
pub fn recovered_rows(model: &FeModel, recovery: &ModelRecovery, x: &Mat<f64>) -> Option<Mat<f64>> {
    match &recovery.operator {
        RecoveryOperator::Rows { transposed, .. } => Some(product(transposed, x)),
        RecoveryOperator::Shapes { .. } => None,
        RecoveryOperator::Cut { nodes, about } => {
            let forces = model.pencil().apply_stiffness(x.as_ref());
            Some(gram(one_side(model, nodes, *about).as_ref(), forces.as_ref()))
        }
    }
}

/// Returns the nodal forces R' of some rows of a recovery (N x rows), whose products with displacements are the values of
/// the rows; `None` for a recovery that is known for some shapes only.
pub fn recovery_loads(model: &FeModel, recovery: &ModelRecovery, rows: &[usize]) -> Option<Mat<f64>> {
    match &recovery.operator {
        RecoveryOperator::Rows { transposed, .. } => {
            let mut loads = Mat::zeros(transposed.n_rows(), rows.len());
            for (at, &row) in rows.iter().enumerate() {
                let (places, values) = transposed.column(row);
                places.iter().zip(values).for_each(|(&place, value)| loads[(place as usize, at)] += value);
            }
            Some(loads)
        }
        RecoveryOperator::Shapes { .. } => None,
        RecoveryOperator::Cut { nodes, about } => {
            let side = one_side(model, nodes, *about);
            let chosen = Mat::from_fn(side.nrows(), rows.len(), |i, at| side[(i, rows[at])]);
            Some(model.pencil().apply_stiffness(chosen.as_ref()))
        }
    }
}

/// Returns T_S (N x 6, in the plane N x 3): rigid motions about a point, of the rows of some nodes alone.
fn one_side(model: &FeModel, side: &[i64], about: [f64; 3]) -> Mat<f64> {
    let members: HashSet<i64> = side.iter().copied().collect();
    let is_member: Vec<bool> = model.nodes().ids.iter().map(|id| members.contains(id)).collect();
    let fields = model.rigid_fields(about, 1.0);
    let (d, rows) = (model.dimension(), model.rows());
    let node_of = |row: usize| match row.checked_sub(rows.displacements()) {
        None => Some(row / d).filter(|node| *node < is_member.len()),
        Some(after) => rows.rotations().get(after).map(|(node, _)| *node as usize),
    };
    let inside: Vec<bool> =
        (0..fields.nrows()).map(|row| node_of(row).is_some_and(|node| is_member[node])).collect();
    Mat::from_fn(fields.nrows(), fields.ncols(), |row, c| if inside[row] { fields[(row, c)] } else { 0.0 })
}

/// Names of the axes of the model.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Returns the labels of section forces: forces, then moments about a point, along the axes of the model.
fn section_labels(model: &FeModel, about: [f64; 3]) -> Vec<RecoveryRow> {
    let units = model.units();
    let point = format!("about {} {}", about.map(|x| significant(x, 6)).join(", "), units.length_name());
    let row = |&component: &usize| {
        let is_force = component < 3;
        RecoveryRow {
            name: COMPONENTS[component].to_owned(),
            quantity: if is_force { Quantity::Force } else { Quantity::Moment },
            component: if is_force {
                AXES[component].to_owned()
            } else {
                format!("{} {point}", AXES[component - 3])
            },
            unit: if is_force { units.force_name() } else { units.moment_name() },
            node: None,
            element: None,
        }
    };
    rigid_axes(model.dimension()).iter().map(row).collect()
}
