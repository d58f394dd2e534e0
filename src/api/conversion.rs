//! Conversion of a model to a body.

use super::progress::{Listener, NO_LISTENER, heard};
use super::{Basis, FlexBody, Model, Scene, Selection};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::convert::{self, ConvertSettings, Lumping, MeshChoice, convert};
use flexbody_body::invariants::FrameChoice;
use flexbody_body::verification::accept;
use flexbody_eigen::{Accuracy, Wanted};
use flexbody_motion::scene::LoadCases;
use flexbody_study::tailoring::{Tailoring, computed_basis, convert_for, loads_for};

/// Settings of a conversion. By default 20 free-surface modes, proved complete, about the centre of mass along the axes
/// of the model.
#[derive(Debug, Clone, Default)]
pub struct ConvertOptions {
    modes: Option<usize>,
    highest: Option<f64>,
    basis: Basis,
    accuracy: Accuracy,
    frame: FrameChoice,
    without_comparators: bool,
    mesh: MeshChoice,
}

impl ConvertOptions {
    /// Requests the `count` lowest modes.
    pub fn modes(mut self, count: usize) -> Self {
        self.modes = Some(count);
        self
    }

    /// Requests all modes below a frequency. Unit: Hz.
    pub fn below_hz(mut self, frequency: f64) -> Self {
        self.highest = Some(frequency);
        self
    }

    /// Sets the basis.
    pub fn basis(mut self, basis: Basis) -> Self {
        self.basis = basis;
        self
    }

    /// Sets the accuracy.
    pub fn accuracy(mut self, accuracy: Accuracy) -> Self {
        self.accuracy = accuracy;
        self
    }

    /// Sets the body frame.
    pub fn frame(mut self, frame: impl Into<FrameChoice>) -> Self {
        self.frame = frame.into();
        self
    }

    /// Disables the comparison with lumped masses.
    pub fn without_comparators(mut self) -> Self {
        self.without_comparators = true;
        self
    }

    /// Leaves out the surface of the model.
    pub fn without_mesh(mut self) -> Self {
        self.mesh = MeshChoice::Without;
        self
    }

    /// Limits the surface to `most` triangles.
    pub fn mesh_triangles(mut self, most: usize) -> Self {
        self.mesh = MeshChoice::AtMost(most);
        self
    }

    fn settings(&self, model: &Model, cases: Option<&LoadCases>) -> Result<ConvertSettings> {
        let followed = self.basis.follows_scene() && self.accuracy != Accuracy::Certified;
        let loads = loads_for(cases.filter(|_| followed), &model.residual_vectors);
        let mut settings = ConvertSettings {
            basis: computed_basis(self.basis, &loads, &model.checked)?,
            frame: self.frame.clone(),
            mesh: self.mesh,
            ..ConvertSettings::default()
        };
        settings.modes.accuracy = self.accuracy;
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

/// Result of a conversion.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Conversion {
    /// Body that was made.
    pub body: FlexBody,
    /// Warnings and notes.
    pub diagnostics: Vec<Diagnostic>,
}

impl Model {
    /// Computes modes and invariants. The body passes every check of `flexbody check`.
    ///
    /// # Errors
    /// FB501 to FB506 if the modes cannot be trusted (not converged, not complete, a mechanism), FB512 if there are
    /// none, FB514 if the damping feeds energy into them, FB601 if the memory is insufficient; FB714 if an identity
    /// does not hold.
    pub fn convert(&self, options: &ConvertOptions) -> Result<Conversion> {
        self.convert_with_progress(options, NO_LISTENER)
    }

    /// Does the work of [`Model::convert`] with a listener, which may stop it.
    ///
    /// # Errors
    /// The errors of [`Model::convert`]; FB605 if the listener stops it.
    pub fn convert_with_progress(
        &self,
        options: &ConvertOptions,
        listener: Listener<'_>,
    ) -> Result<Conversion> {
        if options.basis == Basis::Scene {
            let message = "a basis made for a scene needs the scene: use `convert_for`";
            return Err(Diagnostic::new(Code::Usage, message).into());
        }
        let settings = options.settings(self, None)?;
        let conversion = heard(listener, |context| convert(&self.checked, &settings, context))?;
        accepted(conversion)
    }

    /// Converts with only the terms and modes that the load cases of `scene` need. Returns the decision about each as
    /// well.
    ///
    /// # Errors
    /// The errors of [`Model::convert`]; FB212 if the scene does not match the body.
    pub fn convert_for(&self, scene: &Scene, options: &ConvertOptions) -> Result<(Conversion, Selection)> {
        self.convert_for_with_progress(scene, options, NO_LISTENER)
    }

    /// Does the work of [`Model::convert_for`] with a listener, which may stop it.
    ///
    /// # Errors
    /// The errors of [`Model::convert_for`]; FB605 if the listener stops it.
    pub fn convert_for_with_progress(
        &self,
        scene: &Scene,
        options: &ConvertOptions,
        listener: Listener<'_>,
    ) -> Result<(Conversion, Selection)> {
        let settings = options.settings(self, Some(&scene.0))?;
        let by_band = options.modes.is_none() && options.highest.is_none() && options.basis.follows_scene();
        let tailoring = Tailoring { settings, by_band, of_motion: options.basis == Basis::Scene };
        let (conversion, selection) =
            heard(listener, |context| convert_for(&self.checked, &tailoring, &scene.0, context))?;
        Ok((accepted(conversion)?, Selection { inner: selection, is_of_body: false }))
    }
}

/// Returns a finished conversion in the types of this library, once its body has passed every check.
fn accepted(conversion: convert::Conversion) -> Result<Conversion> {
    accept(&conversion.body)?;
    Ok(Conversion { body: FlexBody(conversion.body), diagnostics: conversion.diagnostics })
}
