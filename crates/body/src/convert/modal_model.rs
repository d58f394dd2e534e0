//! First stages of a conversion: a model with its modes, in the frame of its body, and the condensation of the mass into
//! invariants, in one or two steps.

use super::body_modes::{self, reduced, reduced_in_twice_the_precision};
use super::soft_rotations::effect_of_soft_rotations;
use super::stress_estimate::estimated_stiffness;
use super::stress_stiffness::{StressedModes, stress_stiffness};
use super::{BodyModes, ConvertSettings, NodesInFrame, modal_geometric_stiffness, rigid_mass};
use crate::basis::{BasisChoice, ModalBasis, Task};
use crate::flex_body::{Guarantee, Interface, RotatedStiffness, TermDecision, TermGroup, TermGroups};
use crate::invariants::{
    BodyFrame, Frame, FrameChoice, InertiaStiffness, Invariants, LumpedMasses, MassProperties, choose_frame,
    choose_general_frame, choose_plane_frame, condense_certified,
};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_eigen::Accuracy;
use flexbody_linalg::context::{Context, Work, WorkCounter};
use flexbody_model::{FeModel, GeometricStiffness, LoadKind, Nodes};
use nalgebra::Vector3;

/// Checked model and its modes in body axes; the mass is not condensed yet.
pub struct ModalModel<'m> {
    pub(super) model: &'m FeModel,
    pub(super) settings: &'m ConvertSettings,
    /// Requested comparators.
    pub(super) schemes: Vec<LumpedMasses>,
    /// Data of the modes; their vectors are stored in `modes`.
    pub(super) found: ModalBasis,
    pub(super) mass_properties: MassProperties,
    pub(super) place: NodesInFrame,
    pub(super) modes: BodyModes,
    /// Psi' K Psi.
    pub(super) modal_stiffness: Mat<f64>,
    /// Psi' K_geo Psi of unit loads along the body axes.
    pub(super) geometric_stiffness: Vec<GeometricStiffness<Mat<f64>>>,
    pub(super) rotated_stiffness: Vec<RotatedStiffness>,
    /// Estimate of the geometric stiffness of spin that the model does not have.
    pub(super) estimated_stiffness: Vec<GeometricStiffness<Mat<f64>>>,
    pub(super) inertia_stiffness: Option<InertiaStiffness>,
    pub(super) nodes: Nodes,
    pub(super) interfaces: Vec<Interface>,
    /// Work of the search for modes.
    pub(super) work: Work,
}

impl<'m> ModalModel<'m> {
    /// Finds the modes and chooses the frame.
    ///
    /// # Errors
    /// The errors of [`free_surface`](crate::basis::free_surface) and [`choose_frame`];
    /// [`LumpedMassTable`](Code::LumpedMassTable) if user masses do not fit the nodes (checked before any
    /// work).
    pub fn find(model: &'m FeModel, settings: &'m ConvertSettings, context: &Context<'_>) -> Result<Self> {
        // Settings that the model cannot fulfil are refused before any work.
        refuse_uncertifiable(model, settings.modes.accuracy)?;
        let schemes =
            settings.lumped.iter().map(|lumping| lumping.masses(model)).collect::<Result<Vec<_>>>()?;
        let given_frame = given_frame(model, settings)?;
        // Modes of the basis.
        let counter = WorkCounter::default();
        let task = Task { model, settings: &settings.modes, context: &context.with_counter(&counter) };
        let mut found = settings.basis.basis().modes(&task)?;
        let released = effect_of_soft_rotations(model, &found);
        found.diagnostics.extend(released);
        context.phase("invariants");
        // Body frame: requested one in mean axes, or the one on an interface, which then constrains the modes.
        let (frame, mass_properties) = body_frame(model, &settings.frame)?;
        let frame = given_frame.unwrap_or(frame);
        let place = NodesInFrame::new(model, frame);
        let coupled = matches!(settings.basis, BasisChoice::CraigBampton(_) | BasisChoice::CraigChang(_));
        if let Some(name) = settings.frame.interface() {
            body_modes::constrain(model, &place, name, coupled, &mut found)?;
        }
        // Modes with canonical signs along the body axes.
        let modes = BodyModes::new(model, &place, std::mem::replace(&mut found.solution.vectors, Mat::new()));
        // Accuracy `certified` computes its own K_ff.
        let twice = found.solution.is_noisy() && settings.modes.accuracy == Accuracy::Standard;
        let reduced = if twice { reduced_in_twice_the_precision } else { reduced };
        let modal_stiffness = reduced(model.stiffness(), modes.vectors.as_ref());
        // Stiffness of the modes under unit loads, and of their inertia.
        let shift = match given_frame {
            Some(frame) => frame.origin - mass_properties.centre_of_mass,
            None => Vector3::zeros(),
        };
        let first = found.solution.eigenvalues.first().copied().unwrap_or(1.0);
        let of = StressedModes {
            modes: &modes.vectors,
            modal_stiffness: &modal_stiffness,
            lowest: first,
            frame: &frame,
        };
        let computed = stress_stiffness(model, settings.stress_stiffness, &of, context)?;
        let (geometric_stiffness, rotated_stiffness) =
            modal_geometric_stiffness(model, &modes.vectors, computed, &frame, &shift)?;
        let has_spin = geometric_stiffness.iter().any(|stiffness| stiffness.load.kind == LoadKind::Spin);
        let estimated_stiffness = if given_frame.is_some() || has_spin {
            Vec::new()
        } else {
            estimated_stiffness(model, &modes.vectors, first, &frame, &context.without_counter())?
        };
        let inertia_stiffness = modes.inertia_stiffness(model, &frame);
        let all = model.nodes_of_body();
        let nodes = Nodes { ids: all.ids.clone(), positions: frame.to_body(&all.positions) };
        let interfaces = body_modes::interfaces_in_frame(model, &frame, coupled);
        Ok(Self {
            model,
            settings,
            schemes,
            found,
            mass_properties,
            place,
            modes,
            modal_stiffness,
            geometric_stiffness,
            rotated_stiffness,
            estimated_stiffness,
            inertia_stiffness,
            nodes,
            interfaces,
            work: counter.total(),
        })
    }

    /// Returns the number of modes.
    pub(super) fn n_modes(&self) -> usize {
        self.modes.vectors.ncols()
    }
}

/// Returns an error for accuracy `certified` if a row is no displacement, since the double-double
/// condensation covers displacements only, or if the stored mass differs along x, y and z, since the bounds
/// would cover the mean.
fn refuse_uncertifiable(model: &FeModel, accuracy: Accuracy) -> Result<()> {
    if accuracy == Accuracy::Certified && model.scalar_mass().is_some() && !model.has_exact_scalar_mass() {
        let message = format!(
            "accuracy certified bounds the matrices as they are stored, and the mass matrix differs along x, y and z by {:.1e} of its diagonal",
            model.mass_deviation()
        );
        let help = "use --accuracy standard, which takes the mean, or write the same mass along all axes";
        return Err(Diagnostic::new(Code::Usage, message).with_help(help).into());
    }
    let plain = model.scalar_mass().is_some() && model.rows().len() == model.rows().displacements();
    if accuracy == Accuracy::Certified && !plain {
        let message = "accuracy certified covers displacements whose mass commutes with rotations";
        return Err(Diagnostic::new(Code::Usage, message).with_help("use --accuracy standard").into());
    }
    Ok(())
}

/// Returns the frame on an interface, if requested.
///
/// # Errors
/// [`Usage`](Code::Usage) together with settings that need free modes; the errors of
/// [`frame_of_interface`](body_modes::frame_of_interface).
fn given_frame(model: &FeModel, settings: &ConvertSettings) -> Result<Option<Frame>> {
    let Some(name) = settings.frame.interface() else { return Ok(None) };
    let refuse = |message: &str, help: &str| {
        Err(Diagnostic::new(Code::Usage, message.to_owned()).with_help(help.to_owned()).into())
    };
    if settings.modes.accuracy == Accuracy::Certified {
        let message = "accuracy certified bounds the modes of the free body; it has no bounds for modes relative to a frame that is fixed to an interface";
        return refuse(message, "use --accuracy standard, or a frame at the centre of mass");
    }
    if settings.lumped_modes {
        let message = "--lumped-modes compares modes of the free body; it cannot compare modes relative to a frame that is fixed to an interface";
        return refuse(message, "leave --lumped-modes out, or use a frame at the centre of mass");
    }
    body_modes::frame_of_interface(model, name).map(Some)
}

/// Returns the requested body frame, and the mass properties in model axes.
fn body_frame(model: &FeModel, wanted: &FrameChoice) -> Result<(Frame, MassProperties)> {
    let wanted = match wanted {
        FrameChoice::Mean(frame) => *frame,
        FrameChoice::Interface(_) => BodyFrame::Model,
    };
    let positions = &model.nodes().positions;
    match (model.scalar_mass(), model.dimension()) {
        (Some(mass), 2) => choose_plane_frame(mass, positions, wanted),
        (Some(mass), _) => choose_frame(mass, positions, wanted),
        (None, d) => choose_general_frame(|about| rigid_mass(model, &about), positions, d, wanted),
    }
}

/// Mass of a model condensed on its modes: the invariants, their guaranteed digits, and the dropped groups.
///
/// Without W2 and W3, M is multiplied by rigid motion only, and for solids no nf x nf arrays except K_ff
/// and m_ff are formed (theory section 4).
#[derive(Debug, Clone)]
pub struct Condensation {
    pub(super) invariants: Invariants,
    /// Guaranteed bounds of accuracy `certified`.
    pub(super) guarantee: Option<Guarantee>,
    /// Reason for keeping or dropping each group; empty if no selection was made.
    pub(super) terms: Vec<TermDecision>,
    /// Number of columns multiplied by M.
    pub(super) columns: u64,
}

impl ModalModel<'_> {
    /// Condenses I0 and W1, enough for a scene to decide about the groups W2 and W3.
    pub fn condense_linear(&self) -> Condensation {
        let stiffness = self.modal_stiffness.clone();
        let invariants = self.modes.condensed_linear(self.model, &self.place, stiffness);
        Condensation {
            terms: invariants.groups().dropped().map(not_computed).collect(),
            invariants,
            guarantee: None,
            columns: self.modes.condensed_columns(self.model, true),
        }
    }

    /// Condenses all groups.
    pub fn condense(&self) -> Condensation {
        let columns = self.modes.condensed_columns(self.model, false);
        let (invariants, guarantee) = match self.certified() {
            Some((invariants, guarantee)) => (invariants, Some(guarantee)),
            None => {
                let stiffness = self.modal_stiffness.clone();
                (self.modes.condensed(self.model, &self.place, stiffness), None)
            }
        };
        Condensation { invariants, guarantee, terms: Vec::new(), columns }
    }

    /// Condenses the groups that `terms` keep; `linear` holds the data already known. Accuracy `certified`
    /// condenses everything first, since its digits refer to all data.
    pub fn condense_selected(&self, linear: Condensation, terms: Vec<TermDecision>) -> Condensation {
        let dropped = terms.iter().filter(|term| !term.kept);
        let groups =
            dropped.fold(TermGroups::ALL, |groups, term| groups.and(TermGroups::without(term.group)));
        let is_enough = !groups.w2 && !groups.w3 && self.found.solution.bounds.is_none();
        let condensed = if is_enough {
            linear
        } else {
            let whole = self.condense();
            Condensation { columns: linear.columns + whole.columns, ..whole }
        };
        Condensation { invariants: condensed.invariants.with_groups(groups), terms, ..condensed }
    }

    /// Returns the invariants in double-double arithmetic with guaranteed digits, if the modes have
    /// guaranteed bounds.
    fn certified(&self) -> Option<(Invariants, Guarantee)> {
        let (bounds, mass) = (self.found.solution.bounds.as_ref()?, self.model.scalar_mass()?);
        let shapes = self.modes.displacements.as_ref();
        let (positions, axes) = (&self.place.positions, &self.place.frame.axes);
        let certified = condense_certified(mass, positions, shapes, self.model.stiffness(), axes);
        let guarantee = Guarantee {
            shift_below: bounds.shift_below,
            pivots_below: bounds.pivots_below,
            eigenvalue_lower: bounds.lower.clone(),
            eigenvalue_upper: bounds.upper.clone(),
            shape_error: bounds.shape_error.clone(),
            digits: certified.digits,
        };
        Some((certified.invariants, guarantee))
    }
}

/// Returns the placeholder decision about a group that is not computed yet.
fn not_computed(group: TermGroup) -> TermDecision {
    let reason = "not computed yet".to_owned();
    TermDecision { group, kept: false, tier: 0, bound: 0.0, limit: 0.0, reason }
}
