//! Recoveries of a body: the rows of its model in the modes, and their static columns outside the modes (theory
//! section 12).

use super::answered::{Targets, mapped_answers};
use super::free_basis::{FreeBasis, StaticLoads};
use super::{BodyModes, ModalModel, NodesInFrame};
use crate::basis::{CoupledModel, interface_loads};
use crate::flex_body::{LOAD_COMPONENTS, NamedLoad, Recovery, TermGroups};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::numbers::significant;
use flexbody_linalg::context::Context;
use flexbody_linalg::{CscMatrix, combine, gram, subtract_combination};
use flexbody_model::{FeModel, ModelRecovery, Quantity, RecoveryOperator, RecoveryRow, rigid_axes};
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
        let is_cut = |recovery: &ModelRecovery| matches!(recovery.operator, RecoveryOperator::Cut { .. });
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
        let one = |recovery: &ModelRecovery| match &recovery.operator {
            RecoveryOperator::Rows { transposed, labels, offset } => {
                let modes = product(transposed, &self.modes.vectors);
                let columns = product(transposed, &responses);
                let offset = offset.clone().unwrap_or_else(|| vec![0.0; labels.len()]);
                Ok(loads.recovery(recovery, labels.clone(), offset, modes, &columns))
            }
            RecoveryOperator::Shapes { shapes, labels } => {
                let responses = responses.as_ref().subcols(0, loads.count_for(recovery)).to_owned();
                let targets = Targets {
                    modes: &basis.modes,
                    responses: &responses,
                    sizes: sizes[..responses.ncols()].to_vec(),
                    names: loads.names(),
                };
                let mapped = mapped_answers(self.model, recovery, shapes, &targets)?;
                diagnostics.extend(mapped.diagnostics);
                let offset = vec![0.0; labels.len()];
                Ok(loads.recovery(recovery, labels.clone(), offset, mapped.modes, &mapped.columns))
            }
            RecoveryOperator::Cut { nodes, about } => {
                self.refuse_divided_interface(recovery, nodes, &basis.coupled)?;
                let side = one_side(self.model, nodes, *about);
                let (modes, columns) = basis.section_forces(self.model, &side, &loads, groups);
                let labels = section_labels(self.model, *about);
                let offset = vec![0.0; labels.len()];
                Ok(loads.recovery(recovery, labels, offset, modes, &columns))
            }
        };
        let along_model = asked.iter().map(one).collect::<Result<Vec<Recovery>>>()?;
        let turned = |recovery: &Recovery| recovery.in_axes(&self.place.frame.axes);
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
