//! Conversion of a model to a body.

use super::progress::{Listener, NO_LISTENER, heard};
use super::scene::Subject;
use super::{Basis, FlexBody, Model, Scene, Selection};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::convert::{self, MeshChoice, StressLoads};
use flexbody_body::invariants::FrameChoice;
use flexbody_eigen::Accuracy;
use flexbody_motion::scene::LoadCases;
use flexbody_study::conversion::ConversionRequest;
use flexbody_study::selection;
use flexbody_study::selection_request::SelectionRequest;

/// Settings of a conversion. By default 20 free-surface modes, proved complete, about the centre of mass along the axes
/// of the model.
#[derive(Debug, Clone, Default)]
pub struct ConvertOptions(ConversionRequest);

impl ConvertOptions {
    /// Requests the `count` lowest modes.
    pub fn modes(mut self, count: usize) -> Self {
        self.0.modes = Some(count);
        self
    }

    /// Requests all modes below a frequency. Unit: Hz.
    pub fn below_hz(mut self, frequency: f64) -> Self {
        self.0.max_frequency = Some(frequency);
        self
    }

    /// Sets the basis.
    pub fn basis(mut self, basis: Basis) -> Self {
        self.0.basis = basis;
        self
    }

    /// Sets the accuracy.
    pub fn accuracy(mut self, accuracy: Accuracy) -> Self {
        self.0.accuracy = accuracy;
        self
    }

    /// Sets the body frame.
    pub fn frame(mut self, frame: impl Into<FrameChoice>) -> Self {
        self.0.frame = frame.into();
        self
    }

    /// Disables the comparison with lumped masses.
    pub fn without_comparators(mut self) -> Self {
        self.0.lumped = Vec::new();
        self
    }

    /// Leaves out the surface of the model.
    pub fn without_mesh(mut self) -> Self {
        self.0.mesh = MeshChoice::Without;
        self
    }

    /// Limits the surface to `most` triangles.
    pub fn mesh_triangles(mut self, most: usize) -> Self {
        self.0.mesh = MeshChoice::AtMost(most);
        self
    }

    /// Sets the loads whose stress stiffness is computed from the elements of the deck, which K has to prove.
    pub fn geometric_stiffness(mut self, loads: StressLoads) -> Self {
        self.0.stress_stiffness = Some(loads);
        self
    }

    /// Permits a body for a scene although the selection of its terms and modes does not hold, or cannot be judged.
    pub fn allow_unjudged(mut self) -> Self {
        self.0.allow_unjudged = true;
        self
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
        if options.0.basis == Basis::Scene {
            let message = "a basis made for a scene needs the scene: use `convert_for`";
            return Err(Diagnostic::new(Code::Usage, message).into());
        }
        self.converted(options, None, listener).map(|(conversion, _)| conversion)
    }

    /// Converts with only the terms and modes that the load cases of `scene` need. Returns the decision about each as
    /// well.
    ///
    /// # Errors
    /// The errors of [`Model::convert`]; FB212 if the scene does not match the body; FB557 if the selection does not hold
    /// or cannot be judged, unless [`ConvertOptions::allow_unjudged`] permits it.
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
        let (conversion, selection) = self.converted(options, Some(&scene.0), listener)?;
        let inner = selection.expect("a conversion for a scene selects");
        Ok((conversion, Selection { inner, subject: Subject::Conversion }))
    }

    /// Makes a body with everything that the load cases of `scene` may need, and selects from its terms and modes, like
    /// `flexbody select model.toml`. The body is not kept: [`Selection::command`] and [`Model::convert_for`] make it.
    ///
    /// * `modes`: number of its free modes; `None` for the band of the scene or the default number.
    ///
    /// # Errors
    /// The errors of [`Model::convert`]; FB212 if the scene does not match the body; FB540 if its motion cannot be
    /// integrated.
    pub fn select(&self, scene: &Scene, modes: Option<usize>) -> Result<Selection> {
        self.select_with_progress(scene, modes, NO_LISTENER)
    }

    /// Does the work of [`Model::select`] with a listener, which may stop it.
    ///
    /// # Errors
    /// The errors of [`Model::select`]; FB605 if the listener stops it.
    pub fn select_with_progress(
        &self,
        scene: &Scene,
        modes: Option<usize>,
        listener: Listener<'_>,
    ) -> Result<Selection> {
        let request = SelectionRequest { modes, scene_file: None };
        let loads = &self.residual_vectors;
        let selected = heard(listener, |context| request.for_model(&self.checked, loads, &scene.0, context))?;
        let diagnostics = selected.diagnostics();
        let inner = selection::Selection { diagnostics, ..selected.selection };
        let scene = scene.0[0].source.as_ref().map(|file| file.name.clone());
        Ok(Selection { inner, subject: Subject::Model { modes, scene } })
    }

    fn converted(
        &self,
        options: &ConvertOptions,
        cases: Option<&LoadCases>,
        listener: Listener<'_>,
    ) -> Result<(Conversion, Option<selection::Selection>)> {
        let loads = &self.residual_vectors;
        let made = heard(listener, |context| options.0.convert(&self.checked, loads, cases, None, context))?;
        let convert::Conversion { body, diagnostics, .. } = made.conversion;
        Ok((Conversion { body: FlexBody(body), diagnostics }, made.selection))
    }
}
