//! Change of the reference conditions of a body: to mean axes, or to a frame on an interface.

use super::modal_change::{ModalChange, diagonal_eigenvalues, reduced_residuals};
use super::rotated_stiffness::{split, transformed};
use super::stated_damping::diagonal_ratios;
use super::{
    Carrier, Certificate, FixedInterface, FlexBody, InternalRows, LoadKind, LumpedBody, Modes, Parts,
    Recovery, ReferenceConditions,
};
use crate::invariants::{BodyFrame, FrameChoice, Invariants, TermGroups, error_norms, principal_axes};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_model::GeometricStiffness;
use nalgebra::Matrix3;
use std::borrow::Cow;

impl FlexBody {
    /// Returns the body in mean axes: rigid motion is removed from the modes, which are normalised again
    /// (theory 5.2). A body already in mean axes is returned unchanged.
    ///
    /// # Errors
    /// [`CarrierImpossible`](Code::CarrierImpossible) for a body without all groups of the kinetic energy,
    /// with geometric stiffness of forces or accelerations but not that of rotations, or with rows that belong to no
    /// node: their change is unknown without the FE model.
    pub fn in_mean_axes(&self) -> Result<Cow<'_, Self>> {
        if self.conditions().is_mean() {
            return Ok(Cow::Borrowed(self));
        }
        let knows_stiffness = !self.parts().rotated_stiffness.is_empty();
        self.refuse_changed_frame("mean axes", knows_stiffness)?;
        let change = ModalChange::to_mean_axes(self.invariants(), self.dimension())
            .map_err(|reason| impossible(format!("the body has no mean axes: {reason}")))?;
        self.changed(&change, ReferenceConditions::MeanAxes).map(Cow::Owned)
    }

    /// Returns the body in mean axes with its frame at `at`; `Model` keeps origin and axes.
    ///
    /// # Errors
    /// The errors of [`FlexBody::in_mean_axes`].
    pub fn in_mean_axes_at(&self, at: BodyFrame) -> Result<Self> {
        let body = self.in_mean_axes()?.into_owned();
        let invariants = body.invariants();
        let centre = invariants.first_moment() / invariants.mass();
        let placed = match at {
            BodyFrame::Model => body,
            BodyFrame::Com => body.in_frame(centre, Matrix3::identity())?,
            BodyFrame::Principal => {
                let axes = principal_axes(&invariants.shifted(centre).inertia());
                body.in_frame(centre, axes)?
            }
        };
        let mut parts = placed.into_parts();
        parts.source.settings["frame"] = FrameChoice::Mean(at).text().into();
        Self::new(parts)
    }

    /// Returns the body with its frame on the interface `name`: origin at its reference point, axes of the
    /// model, and the modes of the body held there (constrained modes in the span of frame and modes).
    ///
    /// # Errors
    /// The errors of [`FlexBody::carried`] and [`FlexBody::in_mean_axes`].
    pub fn on_interface(&self, name: &str) -> Result<Self> {
        let conditions = ReferenceConditions::Interface(name.to_owned());
        if *self.conditions() == conditions {
            return Ok(self.clone());
        }
        // The geometric stiffness of a carried body has that of the reaction, which a file does not have.
        self.refuse_changed_frame(&format!("the frame on interface `{name}`"), false)?;
        let carried = self.carried(&Carrier::Interface(name.to_owned()))?;
        let change = ModalChange::in_present_frame(carried.invariants(), carried.dimension())
            .map_err(|reason| impossible(format!("no frame can stand on interface `{name}`: {reason}")))?;
        let mut parts = carried.changed(&change, conditions)?.into_parts();
        parts.source.settings["frame"] = FrameChoice::Interface(name.to_owned()).text().into();
        // The carried body has no interface coordinates, which hold the eigenvalues of the fixed-interface modes.
        parts.certificate.fixed_interface = self.parts().fixed_interface_of_other_modes();
        Self::new(parts)
    }

    /// Returns an error if the body is not in mean axes, for a `task` (`select`, `trade`) that decides
    /// about free modes.
    ///
    /// # Errors
    /// [`SceneBody`](Code::SceneBody) for a body with other reference conditions.
    pub fn require_mean_axes(&self, task: &str) -> Result<()> {
        if self.conditions().is_mean() {
            return Ok(());
        }
        let message = format!("{}: {task} decides about modes of bodies in mean axes", self.conditions());
        let help = "convert with --frame com";
        Err(Diagnostic::new(Code::SceneBody, message).with_help(help).into())
    }

    /// Returns an error if the change of the reference conditions to `wanted` would leave a part of the
    /// body unknown.
    ///
    /// * `knows_stiffness`: true if the change of the geometric stiffness of motion and loads is known.
    fn refuse_changed_frame(&self, wanted: &str, knows_stiffness: bool) -> Result<()> {
        let conditions = self.conditions();
        let refuse = |what: &str, help: &str| {
            let message = format!("{conditions}: for {wanted} {what}");
            Err(Diagnostic::new(Code::CarrierImpossible, message).with_help(help.to_owned()).into())
        };
        if self.groups() != TermGroups::ALL {
            let dropped: Vec<&str> = self.groups().dropped().map(|group| group.name()).collect();
            return refuse(
                &format!("{} are needed, which the body does not have", dropped.join(", ")),
                "use a body with all terms",
            );
        }
        let convert = "convert the FE model with the frame that is needed (--frame)";
        let is_of_motion =
            |stiffness: &GeometricStiffness<Mat<f64>>| !matches!(stiffness.load.kind, LoadKind::Named(_));
        if !knows_stiffness && self.geometric_stiffness().iter().any(is_of_motion) {
            return refuse("the geometric stiffness of the rigid motion in the modes is not known", convert);
        }
        if self.modes().internal.is_some() {
            return refuse("the rigid motion of rows that belong to no node is not known", convert);
        }
        Ok(())
    }

    /// Returns the body after a change of its modes.
    pub(super) fn changed(&self, change: &ModalChange, conditions: ReferenceConditions) -> Result<Self> {
        let mut parts = self.parts().clone();
        let invariants = change.invariants(&parts.invariants);
        parts.modes = self.changed_modes(change, &invariants);
        parts.inertia_stiffness = match (&parts.inertia_stiffness, &parts.modes.rotation) {
            (Some(inertia), Some(rotation)) => {
                Some(inertia.with_rotations(rotation.as_ref(), parts.dimension))
            }
            _ => None,
        };
        let stiffness = |stiffness: &GeometricStiffness<Mat<f64>>| GeometricStiffness {
            load: stiffness.load.clone(),
            matrix: change.congruent(&stiffness.matrix),
        };
        (parts.geometric_stiffness, parts.rotated_stiffness) = match self.stiffness_with_rotation() {
            Some(all) => split(transformed(all, &change.beside_rotations())),
            None => (parts.geometric_stiffness.iter().map(stiffness).collect(), Vec::new()),
        };
        // The estimate of modes with rigid motion is not known.
        parts.estimated_stiffness = match change.taken() {
            Some(_) => Vec::new(),
            None => parts.estimated_stiffness.iter().map(stiffness).collect(),
        };
        parts.lumped =
            parts.lumped.iter().map(|lumped| changed_lumped(lumped, change, &invariants)).collect();
        // Rows that rigid motion changes are known only relative to the former frame.
        parts.recoveries.retain(Recovery::ignores_rigid_motion);
        parts.recoveries = parts.recoveries.iter().map(|recovery| recovery.with_modes(change)).collect();
        parts.named_loads =
            parts.named_loads.iter().map(|named_load| named_load.with_modes(change)).collect();
        parts.certificate = unproved(&parts);
        (parts.invariants, parts.conditions, parts.coordinates) = (invariants, conditions, None);
        Self::new(parts)
    }

    fn changed_modes(&self, change: &ModalChange, invariants: &Invariants) -> Modes {
        let (old, positions) = (self.modes(), &self.nodes().positions);
        let eigenvalue = diagonal_eigenvalues(invariants);
        let damping = self.damping();
        let (modal_damping, damping_ratio) = match self.stated_damping() {
            _ if damping.norm_max() == 0.0 => (None, vec![0.0; eigenvalue.len()]),
            Some(law) => {
                let (damping, ratios) = law.of_modes(&eigenvalue, |lambda| self.units().frequency_of(lambda));
                (Some(damping), ratios)
            }
            None => {
                let damping = change.congruent(&damping);
                let ratios = diagonal_ratios(&damping, &eigenvalue);
                (Some(damping), ratios)
            }
        };
        Modes {
            residual: reduced_residuals(invariants, &eigenvalue),
            provenance: vec!["combination of modes".to_owned(); eigenvalue.len()],
            truncation: old.truncation.clone(),
            damping_ratio,
            modal_damping,
            shape: change.shapes(&old.shape, positions),
            rotation: old.rotation.as_ref().map(|rotation| change.rotations(rotation, &old.shape)),
            // A change that takes rigid motion is refused for rows that belong to no node.
            internal: old.internal.as_ref().map(|internal| InternalRows {
                dofs: internal.dofs.clone(),
                shape: change.combined(&internal.shape),
            }),
            eigenvalue,
        }
    }
}

impl Parts {
    /// Returns the facts about the fixed-interface modes for other modes of the same span, without interface
    /// coordinates.
    fn fixed_interface_of_other_modes(&self) -> Option<FixedInterface> {
        let fixed = self.certificate.fixed_interface.as_ref()?;
        Some(fixed.with_other_modes(self.coordinates.as_ref()))
    }
}

fn impossible(message: String) -> Error {
    Diagnostic::new(Code::CarrierImpossible, message).into()
}

/// Applies the change of modes to lumped invariants and compares them again.
fn changed_lumped(lumped: &LumpedBody, change: &ModalChange, exact: &Invariants) -> LumpedBody {
    let invariants = change.invariants(&lumped.invariants);
    LumpedBody { comparison: error_norms(exact, &invariants), invariants, ..lumped.clone() }
}

/// Returns the certificate of a body whose modes are combinations of modes with a proof. The proof about the modes
/// does not carry over; the facts about the fixed-interface modes do, since they state the span of the modes.
fn unproved(parts: &Parts) -> Certificate {
    let certificate = &parts.certificate;
    let about = "combinations of the modes of a body with other reference conditions";
    let remark = if certificate.remark.is_empty() {
        about.to_owned()
    } else {
        format!("{about}; {}", certificate.remark)
    };
    Certificate {
        proved_modes: None,
        negative_pivots: None,
        guarantee: None,
        fixed_interface: parts.fixed_interface_of_other_modes(),
        remark,
        ..certificate.clone()
    }
}
