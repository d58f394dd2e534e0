//! First stage of a conversion: a model with its modes, in the frame of its body.

use super::body_modes::{reduced, reduced_in_twice_the_precision};
use super::{
    BodyModes, ConvertSettings, NodesInFrame, interface_frame, modal_geometric_stiffness, rigid_mass,
};
use crate::basis::{BasisChoice, ModalBasis, Task};
use crate::flex_body::Interface;
use crate::invariants::{
    BodyFrame, Frame, FrameChoice, InertiaStiffness, LumpedMasses, MassProperties, choose_frame,
    choose_general_frame, choose_plane_frame,
};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_eigen::Accuracy;
use flexbody_linalg::context::{Context, Work, WorkCounter};
use flexbody_model::{FeModel, GeometricStiffness, Nodes};
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
        context.phase("invariants");
        // Body frame: requested one in mean axes, or the one on an interface, which then constrains the modes.
        let (frame, mass_properties) = body_frame(model, &settings.frame)?;
        let frame = given_frame.unwrap_or(frame);
        let place = NodesInFrame::new(model, frame);
        let coupled = matches!(settings.basis, BasisChoice::CraigBampton(_) | BasisChoice::CraigChang(_));
        if let Some(name) = settings.frame.interface() {
            interface_frame::constrain(model, &place, name, coupled, &mut found)?;
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
        let geometric_stiffness =
            modal_geometric_stiffness(model, modes.vectors.as_ref(), &frame.axes, &shift)?;
        let inertia_stiffness = modes.inertia_stiffness(model, &frame);
        let nodes = Nodes { ids: model.nodes().ids.clone(), positions: place.positions.clone() };
        let interfaces = interface_frame::interfaces_in_frame(model, &frame, coupled);
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
/// [`frame_of_interface`](interface_frame::frame_of_interface).
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
    interface_frame::frame_of_interface(model, name).map(Some)
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
