//! Trade study of accuracy and cost in a scene.

use super::progress::{Listener, heard};
use super::{FlexBody, Model, ReportFormat, Scene, report};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::basis::ModeSettings;
use flexbody_report::{TradeFacts, trade_csv};
use flexbody_study::recipe::{Origin, Recipe};
use flexbody_study::reference::ReferenceError;
use flexbody_study::trade::{
    self, ReferenceChoice, ReferenceKind, Source, TradeSettings, Varied, WantedBodies, conversions,
};

/// Settings of a trade study. By default 20 modes of a model, the whole body as the reference, and the median time of 3
/// simulations of each candidate.
#[derive(Debug, Clone, PartialEq)]
pub struct TradeOptions {
    modes: usize,
    repeat: usize,
    reference: ReferenceChoice,
}

impl Default for TradeOptions {
    fn default() -> Self {
        Self { modes: ModeSettings::DEFAULT_COUNT, repeat: 3, reference: ReferenceChoice::Full }
    }
}

impl TradeOptions {
    /// Sets the number of free modes of the conversions of a model.
    pub fn modes(mut self, count: usize) -> Self {
        self.modes = count;
        self
    }

    /// Sets the number of simulations per candidate, of which the median time counts.
    pub fn repeat(mut self, times: usize) -> Self {
        self.repeat = times.max(1);
        self
    }

    /// Sets the reference motion of the errors. Choices other than [`ReferenceChoice::Full`] need a model.
    pub fn reference(mut self, reference: ReferenceChoice) -> Self {
        self.reference = reference;
        self
    }
}

/// Result of a trade study: candidate bodies for a scene, measured against a reference, and the recommended one.
#[derive(Debug, Clone)]
pub struct Trade {
    study: trade::Trade,
    sources: Vec<Source>,
    /// Truncation errors of the reference in each load case.
    reference_errors: Vec<Vec<ReferenceError>>,
    diagnostics: Vec<Diagnostic>,
}

impl Model {
    /// Measures the cost of accuracy in `scene` for candidates from conversions of the model, like `flexbody trade
    /// model.toml`. Every candidate is measured in each load case, and its worst case counts. All results except times
    /// are independent of the number of threads.
    ///
    /// # Errors
    /// The errors of [`Model::convert`]; FB212 if the scene does not match the body; FB540 if its motion cannot be
    /// integrated; FB605 if the listener stops it.
    pub fn trade(&self, scene: &Scene, options: &TradeOptions, listener: Listener<'_>) -> Result<Trade> {
        heard(listener, |context| {
            let fine = options.reference == ReferenceChoice::Fine;
            let wanted = WantedBodies { modes: options.modes, fine };
            let made = conversions(&self.checked, &scene.0, wanted, context)?;
            let nodal = (options.reference == ReferenceChoice::Nodal).then_some(&self.checked);
            let reserved = trade::reserved(&made.reference_errors, nodal.is_some());
            let settings =
                TradeSettings { repeat: options.repeat, reserved: &reserved, varied: Some(&made.varied) };
            let study = trade::trade(&made.sources, &scene.0, nodal, &settings, context)?;
            let diagnostics = [made.diagnostics, made.varied.diagnostics, study.diagnostics.clone()].concat();
            Ok(Trade { study, sources: made.sources, reference_errors: made.reference_errors, diagnostics })
        })
    }
}

impl FlexBody {
    /// Measures the cost of accuracy in `scene` for parts of this body: fewer modes, fewer groups of terms, 32-bit
    /// numbers, lumped couplings.
    ///
    /// # Errors
    /// FB801 for another reference than the whole body, since a body does not contain the matrices; FB212 if the scene
    /// does not match the body; FB540 if its motion cannot be integrated; FB605 if the listener stops it.
    pub fn trade(&self, scene: &Scene, options: &TradeOptions, listener: Listener<'_>) -> Result<Trade> {
        if options.reference != ReferenceChoice::Full {
            let message = "errors relative to all nodes or to a finer body need the matrices: call the function of the model";
            return Err(Diagnostic::new(Code::Usage, message).into());
        }
        let varied = Varied::of_body(&scene.0, self.dimension());
        let sources = vec![Source::new("file", self.0.clone(), Recipe::File, None)?];
        let settings = TradeSettings { repeat: options.repeat, reserved: &[], varied: Some(&varied) };
        let study = heard(listener, |context| trade::trade(&sources, &scene.0, None, &settings, context))?;
        let diagnostics = study.diagnostics.clone();
        Ok(Trade { study, sources, reference_errors: Vec::new(), diagnostics })
    }
}

impl Trade {
    /// Returns the number of candidates; the first is the whole body of the reference.
    pub fn candidates(&self) -> usize {
        self.study.rows.len()
    }

    /// Returns the index of the recommended candidate (from 0); `None` if none is within the tolerances or as cheap as
    /// allowed.
    pub fn recommended(&self) -> Option<usize> {
        self.study.recommended.row()
    }

    /// Returns the candidates of the Pareto front (from 0), ascending in cost: no other one is both cheaper and as
    /// accurate.
    pub fn front(&self) -> &[usize] {
        &self.study.front
    }

    /// Returns the body of a candidate.
    ///
    /// # Errors
    /// FB804 if there is no such candidate; FB703 if lumped masses give no valid body.
    pub fn body(&self, candidate: usize) -> Result<FlexBody> {
        let Some(row) = self.study.rows.get(candidate) else {
            let message =
                format!("candidate {candidate} does not exist: the study has {}", self.candidates());
            return Err(Diagnostic::new(Code::Argument, message).into());
        };
        row.candidate.body(&self.sources[row.candidate.source]).map(FlexBody)
    }

    /// Returns the command that makes exactly the recommended candidate from the file `input`, the model or the flex-body
    /// file of the study, and the scene file `scene`. Returns `None` if nothing is recommended.
    pub fn command(&self, input: &str, scene: &str) -> Option<String> {
        let candidate = &self.study.rows[self.recommended()?].candidate;
        let origin = Origin { input: vec![input.to_owned()], scene: scene.to_owned(), case: None };
        self.sources[candidate.source].command(candidate, &origin)
    }

    /// Returns true if there is a recommended candidate that holds in the stated variations, and the reference is
    /// accurate enough.
    pub fn holds(&self) -> bool {
        let nodal = self.study.reference == ReferenceKind::Nodal;
        let is_reference =
            |rounds: &Vec<ReferenceError>| rounds.last().is_none_or(ReferenceError::is_reference);
        let is_reference = nodal || self.reference_errors.iter().all(is_reference);
        self.recommended().is_some() && is_reference && self.study.holds_in_stated_variations()
    }

    /// Returns the report of `flexbody trade`.
    pub fn report(&self, format: ReportFormat) -> String {
        let run = report::run(&self.diagnostics);
        TradeFacts::new(&self.study, &self.reference_errors, &run).render(format.inner())
    }

    /// Returns the table of `flexbody trade --csv`: one line per candidate.
    pub fn csv(&self) -> String {
        trade_csv(&self.study)
    }

    /// Returns warnings and notes.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }
}
