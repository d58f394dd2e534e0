//! Selection of terms and modes as a user requests it: for a flex-body file, or for a model of which a body is made with
//! everything that the load cases may need.

use crate::conversion::in_scene_file;
use crate::recipe::{Origin, selected_from_file, selected_from_model};
use crate::reference::{Enriched, varied_errors};
use crate::selection::{Selection, select_judged};
use crate::tailoring::{Tailoring, computed_basis, loads_for};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::basis::{BasisKind, ModeSettings};
use flexbody_body::convert::ConvertSettings;
use flexbody_body::flex_body::FlexBody;
use flexbody_eigen::Wanted;
use flexbody_input::LoadSource;
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_motion::scene::LoadCases;
use std::path::PathBuf;

/// Request of a selection.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SelectionRequest {
    /// Number of free modes of the body that is made of a model; `None` for the band of the scene or the default number.
    pub modes: Option<usize>,
    /// File of the scene, which errors name; `None` for a scene that is no file.
    pub scene_file: Option<PathBuf>,
}

/// Result of a request.
#[derive(Debug, Clone)]
pub struct Selected {
    /// Decisions about terms and modes.
    pub selection: Selection,
    /// Diagnostics of the body that was made of a model.
    of_body: Vec<Diagnostic>,
    /// True if the body was made of a model.
    is_of_model: bool,
    /// Number of modes that was requested of the model.
    modes: Option<usize>,
}

impl Selected {
    /// Returns the diagnostics of the body that was made and of the selection.
    pub fn diagnostics(&self) -> Vec<Diagnostic> {
        [self.of_body.clone(), self.selection.diagnostics.clone()].concat()
    }

    /// Returns the command that makes exactly the selected body from the inputs of `origin`.
    pub fn command(&self, origin: &Origin) -> String {
        if self.is_of_model {
            selected_from_model(&self.selection, origin, self.modes)
        } else {
            selected_from_file(&self.selection, origin)
        }
    }
}

impl SelectionRequest {
    /// Refuses a number of modes, which a body file cannot change.
    ///
    /// # Errors
    /// [`Usage`](Code::Usage).
    pub fn refuse_modes(&self) -> Result<()> {
        if self.modes.is_none() {
            return Ok(());
        }
        let message = "--modes applies to a model: the modes of a body file are fixed";
        Err(Diagnostic::new(Code::Usage, message).into())
    }

    /// Selects from the modes and terms of `body`.
    ///
    /// # Errors
    /// [`Usage`](Code::Usage) for a number of modes; the errors of [`select_judged`].
    pub fn for_body(&self, body: &FlexBody, cases: &LoadCases, context: &Context<'_>) -> Result<Selected> {
        self.refuse_modes()?;
        let selection = select_judged(body, &[], &[], cases, context)
            .map_err(|error| in_scene_file(error, self.scene_file.as_deref()))?;
        Ok(Selected { selection, of_body: Vec::new(), is_of_model: false, modes: None })
    }

    /// Makes a body of `model` with everything that the load cases may need, and selects from its modes and terms.
    ///
    /// * `of_manifest`: loads of residual vectors that the manifest of the model states.
    ///
    /// # Errors
    /// The errors of [`Tailoring::convert`], [`varied_errors`] and [`select_judged`].
    pub fn for_model(
        &self,
        model: &FeModel,
        of_manifest: &[LoadSource],
        cases: &LoadCases,
        context: &Context<'_>,
    ) -> Result<Selected> {
        let in_scene = |error| in_scene_file(error, self.scene_file.as_deref());
        let loads = loads_for(Some(cases), of_manifest);
        let wanted = Wanted::Lowest(self.modes.unwrap_or(ModeSettings::DEFAULT_COUNT));
        let settings = ConvertSettings {
            modes: ModeSettings { wanted, ..ModeSettings::default() },
            basis: computed_basis(BasisKind::Free, &loads, model)?,
            lumped: Vec::new(),
            ..ConvertSettings::default()
        };
        let tailoring = Tailoring { settings, by_band: self.modes.is_none(), of_motion: false };
        let Enriched { made, rounds } = tailoring.convert(model, cases, context).map_err(in_scene)?;
        let varied = varied_errors(model, &made.body, cases, context)?;
        let selection = select_judged(&made.body, &rounds, &varied, cases, context).map_err(in_scene)?;
        Ok(Selected { selection, of_body: made.diagnostics, is_of_model: true, modes: self.modes })
    }
}
