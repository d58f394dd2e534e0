//! Trade study as a user requests it: of a model, or of a flex-body file.

use super::candidate::Source;
use super::case::{Varied, reserved};
use super::conversions::{WantedBodies, conversions};
use super::study::{ReferenceChoice, ReferenceKind, Trade, TradeSettings, trade};
use crate::conversion::in_scene_file;
use crate::recipe::{Origin, Recipe};
use crate::reference::ReferenceError;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::basis::ModeSettings;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_motion::scene::LoadCases;
use std::path::PathBuf;

/// Request of a trade study.
#[derive(Debug, Clone, PartialEq)]
pub struct TradeRequest {
    /// Number of free modes of the conversions of a model; `None` for the default number.
    pub modes: Option<usize>,
    /// Number of simulations per candidate, of which the median time counts.
    pub repeat: usize,
    /// Reference motion of the errors.
    pub reference: ReferenceChoice,
    /// File of the scene, which errors name; `None` for a scene that is no file.
    pub scene_file: Option<PathBuf>,
}

impl Default for TradeRequest {
    fn default() -> Self {
        Self { modes: None, repeat: 3, reference: ReferenceChoice::Full, scene_file: None }
    }
}

/// Trade study with the bodies of its candidates.
#[derive(Debug, Clone)]
pub struct TradeStudy {
    /// Candidates and recommendation.
    pub trade: Trade,
    /// Bodies of the candidates, the reference first.
    pub sources: Vec<Source>,
    /// Truncation errors of the reference in each load case; empty for a flex-body file.
    pub reference_errors: Vec<Vec<ReferenceError>>,
    /// Diagnostics about the bodies.
    of_bodies: Vec<Diagnostic>,
}

impl TradeStudy {
    /// Returns the diagnostics about the bodies and the study.
    pub fn diagnostics(&self) -> Vec<Diagnostic> {
        [self.of_bodies.clone(), self.trade.diagnostics.clone()].concat()
    }

    /// Returns true if there is a recommended candidate that holds in the stated variations, and the reference is
    /// accurate enough.
    pub fn holds(&self) -> bool {
        let is_nodal = self.trade.reference == ReferenceKind::Nodal;
        let is_reference =
            |rounds: &Vec<ReferenceError>| rounds.last().is_none_or(ReferenceError::is_reference);
        let is_reference =
            (is_nodal || self.reference_errors.iter().all(is_reference)) && self.trade.is_stressed();
        self.trade.recommended.row().is_some() && is_reference && self.trade.holds_in_required_variations()
    }

    /// Returns the command that makes exactly the recommended candidate from the inputs of `origin`; `None` if nothing is
    /// recommended.
    pub fn command(&self, origin: &Origin) -> Option<String> {
        let candidate = &self.trade.rows[self.trade.recommended.row()?].candidate;
        self.sources[candidate.source].command(candidate, origin)
    }
}

impl TradeRequest {
    /// Refuses what a flex-body file cannot serve.
    ///
    /// # Errors
    /// [`Usage`](Code::Usage) for a number of modes, and for a reference that needs the matrices.
    pub fn check_for_body(&self) -> Result<()> {
        let message = match self {
            Self { reference: ReferenceChoice::Nodal, .. } => {
                "--reference nodal needs the matrices: give the model"
            }
            Self { reference: ReferenceChoice::Fine, .. } => {
                "--reference fine needs the matrices: give the model"
            }
            Self { modes: Some(_), .. } => "--modes applies to a model: give the model",
            _ => return Ok(()),
        };
        Err(Diagnostic::new(Code::Usage, message).into())
    }

    /// Measures candidates from conversions of `model`. `context` is called for each part of the work, since the bodies
    /// of the first part take memory.
    ///
    /// # Errors
    /// The errors of [`conversions`] and [`trade`].
    pub fn for_model<'c>(
        &self,
        model: &FeModel,
        cases: &LoadCases,
        context: impl Fn() -> Context<'c>,
    ) -> Result<TradeStudy> {
        let in_scene = |error| in_scene_file(error, self.scene_file.as_deref());
        let modes = self.modes.unwrap_or(ModeSettings::DEFAULT_COUNT);
        let wanted = WantedBodies { modes, fine: self.reference == ReferenceChoice::Fine };
        let made = conversions(model, cases, wanted, &context()).map_err(in_scene)?;
        let nodal = (self.reference == ReferenceChoice::Nodal).then_some(model);
        let reserved = reserved(&made.reference_errors, nodal.is_some());
        let settings = TradeSettings { repeat: self.repeat, reserved: &reserved, varied: Some(&made.varied) };
        let trade = trade(&made.sources, cases, nodal, &settings, &context()).map_err(in_scene)?;
        let of_bodies = [made.diagnostics, made.varied.diagnostics].concat();
        Ok(TradeStudy { trade, sources: made.sources, reference_errors: made.reference_errors, of_bodies })
    }

    /// Measures parts of `body`.
    ///
    /// # Errors
    /// The errors of [`TradeRequest::check_for_body`] and [`trade`].
    pub fn for_body(&self, body: FlexBody, cases: &LoadCases, context: &Context<'_>) -> Result<TradeStudy> {
        self.check_for_body()?;
        let varied = Varied::of_body(cases, body.dimension());
        let sources = vec![Source::new("file", body, Recipe::File, None)?];
        let settings = TradeSettings { repeat: self.repeat, reserved: &[], varied: Some(&varied) };
        let trade = trade(&sources, cases, None, &settings, context)
            .map_err(|error| in_scene_file(error, self.scene_file.as_deref()))?;
        Ok(TradeStudy { trade, sources, reference_errors: Vec::new(), of_bodies: Vec::new() })
    }
}
