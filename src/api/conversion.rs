//! From a model to a body.

use super::progress::{Listener, NOBODY, heard};
use super::{FlexBody, Model, Scene, Selection};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::basis::{BasisChoice, CraigBampton, CraigChang, FreeSurface};
use flexbody_body::convert::{self, ConvertSettings, Lumping, MeshChoice, convert};
use flexbody_body::invariants::BodyFrame;
use flexbody_body::verification::accept;
use flexbody_eigen::{Resume, Wanted};
use flexbody_motion::scene::LoadCases;
use flexbody_study::tailoring::{Tailoring, convert_for, loads_for, read_loads};

/// Which shapes the body has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Basis {
    /// Free-surface modes, and the residual vectors that the model or the scene asks for.
    #[default]
    Free,
    /// Modes with the interfaces held, and the static responses to motions of these (Craig and Bampton).
    CraigBampton,
    /// Free modes, and the static responses to loads at the interfaces (Craig and Chang).
    CraigChang,
    /// The fewest shapes that the motion of a scene is made of ([`Model::convert_for`]); another motion may
    /// need others.
    Scene,
}

/// How sure the modes are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Accuracy {
    /// Residuals of 1e-6; that no mode is missing is not proved.
    Fast,
    /// Residuals of 1e-9, and an inertia count that proves that no mode is missing.
    #[default]
    Standard,
    /// Guaranteed bounds of eigenvalues and invariants.
    Certified,
}

/// Where the body frame is.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Frame {
    /// At the centre of mass, along the axes of the model.
    #[default]
    CentreOfMass,
    /// At the centre of mass, along the principal axes of inertia, moments ascending.
    Principal,
    /// That of the model.
    Model,
    /// On the reference point of the interface of this name, along the axes of the model. The interface rests in every
    /// mode: the modes are those of the body that is held there.
    Interface(String),
}

/// Settings of a conversion. The default: 20 free-surface modes, proved complete, about the centre of mass along the
/// axes of the model.
#[derive(Debug, Clone, Default)]
pub struct ConvertOptions {
    modes: Option<usize>,
    highest: Option<f64>,
    basis: Basis,
    accuracy: Accuracy,
    frame: Frame,
    without_comparators: bool,
    mesh: MeshChoice,
}

impl ConvertOptions {
    /// The lowest modes, so many.
    pub fn modes(mut self, count: usize) -> Self {
        self.modes = Some(count);
        self
    }

    /// All modes below a frequency. Unit: Hz.
    pub fn below_hz(mut self, frequency: f64) -> Self {
        self.highest = Some(frequency);
        self
    }

    /// Which shapes.
    pub fn basis(mut self, basis: Basis) -> Self {
        self.basis = basis;
        self
    }

    /// How sure.
    pub fn accuracy(mut self, accuracy: Accuracy) -> Self {
        self.accuracy = accuracy;
        self
    }

    /// Which body frame.
    pub fn frame(mut self, frame: Frame) -> Self {
        self.frame = frame;
        self
    }

    /// Does not compute what lumped masses would have given.
    pub fn without_comparators(mut self) -> Self {
        self.without_comparators = true;
        self
    }

    /// Leaves the surface of the model out.
    pub fn without_mesh(mut self) -> Self {
        self.mesh = MeshChoice::Without;
        self
    }

    /// A surface of so many triangles at the most.
    pub fn mesh_triangles(mut self, most: usize) -> Self {
        self.mesh = MeshChoice::AtMost(most);
        self
    }

    fn settings(&self, model: &Model, cases: Option<&LoadCases>) -> Result<ConvertSettings> {
        let loads = match (self.basis, self.accuracy) {
            (Basis::Free | Basis::Scene, Accuracy::Fast | Accuracy::Standard) => {
                loads_for(cases, &model.residual_vectors)
            }
            _ => model.residual_vectors.clone(),
        };
        let residual_vectors = || read_loads(&loads, &model.checked);
        let mut settings = ConvertSettings {
            basis: match self.basis {
                Basis::Free | Basis::Scene => {
                    BasisChoice::Free(FreeSurface { residual_vectors: residual_vectors()? })
                }
                Basis::CraigBampton => BasisChoice::CraigBampton(CraigBampton),
                Basis::CraigChang => {
                    BasisChoice::CraigChang(CraigChang { residual_vectors: residual_vectors()? })
                }
            },
            frame: match self.frame {
                Frame::Principal => BodyFrame::Principal,
                Frame::CentreOfMass => BodyFrame::Com,
                Frame::Model | Frame::Interface(_) => BodyFrame::Model,
            },
            interface_frame: match &self.frame {
                Frame::Interface(name) => Some(name.clone()),
                _ => None,
            },
            mesh: self.mesh,
            ..ConvertSettings::default()
        };
        settings.modes.accuracy = match self.accuracy {
            Accuracy::Fast => flexbody_eigen::Accuracy::Fast,
            Accuracy::Standard => flexbody_eigen::Accuracy::Standard,
            Accuracy::Certified => flexbody_eigen::Accuracy::Certified,
        };
        if let Some(count) = self.modes {
            settings.modes.wanted = Wanted::Lowest(count);
        }
        if let Some(frequency) = self.highest {
            settings.modes.wanted = Wanted::Below(model.checked.units().eigenvalue_of(frequency));
        }
        if self.without_comparators {
            settings.lumped = Vec::<Lumping>::new();
        }
        Ok(settings)
    }
}

/// A body, and what there is to say about it.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Conversion {
    /// The body.
    pub body: FlexBody,
    /// Warnings and notes.
    pub diagnostics: Vec<Diagnostic>,
}

impl Model {
    /// Computes modes and invariants: the body passes every check that `flexbody check` makes.
    ///
    /// # Errors
    /// FB501 to FB506 where the modes cannot be trusted (not converged, not complete, a mechanism), FB512
    /// where there are none, FB514 where the damping feeds energy to them, FB601 where the memory does not
    /// suffice; FB714 where an identity does not hold.
    pub fn convert(&self, options: &ConvertOptions) -> Result<Conversion> {
        self.convert_heard(options, NOBODY)
    }

    /// The same, heard and perhaps stopped by a listener.
    ///
    /// # Errors
    /// As [`Model::convert`]; FB605 where the listener stops it.
    pub fn convert_heard(&self, options: &ConvertOptions, listener: Listener<'_>) -> Result<Conversion> {
        if options.basis == Basis::Scene {
            let message = "a basis made for a scene needs one: `convert_for`";
            return Err(Diagnostic::new(Code::Usage, message).into());
        }
        let settings = options.settings(self, None)?;
        let conversion = heard(listener, |watch| convert(&self.checked, &settings, watch))?;
        accepted(conversion)
    }

    /// Converts with the terms and modes alone that the load cases of `scene` need, and the decision about each.
    ///
    /// # Errors
    /// As [`Model::convert`]; FB212 where the scene does not fit the body.
    pub fn convert_for(&self, scene: &Scene, options: &ConvertOptions) -> Result<(Conversion, Selection)> {
        self.convert_for_heard(scene, options, NOBODY)
    }

    /// Converts as [`Model::convert_for`] does, heard and perhaps stopped by a listener.
    ///
    /// # Errors
    /// As [`Model::convert_for`]; FB605 where the listener stops it.
    pub fn convert_for_heard(
        &self,
        scene: &Scene,
        options: &ConvertOptions,
        listener: Listener<'_>,
    ) -> Result<(Conversion, Selection)> {
        let settings = options.settings(self, Some(&scene.0))?;
        let by_band = options.modes.is_none()
            && options.highest.is_none()
            && matches!(options.basis, Basis::Free | Basis::Scene);
        let tailoring = Tailoring { settings, by_band, of_motion: options.basis == Basis::Scene };
        let (conversion, selection) = heard(listener, |watch| {
            convert_for(&self.checked, &tailoring, &scene.0, Resume::default(), watch)
        })?;
        Ok((accepted(conversion)?, Selection(selection)))
    }
}

/// A finished conversion as users see it, once its body has passed every check.
fn accepted(conversion: convert::Conversion) -> Result<Conversion> {
    accept(&conversion.body)?;
    Ok(Conversion { body: FlexBody(conversion.body), diagnostics: conversion.diagnostics })
}
