//! Trade study of accuracy and cost in a scene.

use super::progress::{Listener, heard};
use super::{FlexBody, Model, ReportFormat, Scene, report};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_report::{TradeFacts, trade_csv};
use flexbody_study::recipe::Origin;
use flexbody_study::trade::{ReferenceChoice, TradeRequest, TradeStudy};

/// Settings of a trade study. By default 20 modes of a model, the whole body as the reference, and the median time of 3
/// simulations of each candidate.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TradeOptions(TradeRequest);

impl TradeOptions {
    /// Sets the number of free modes of the conversions of a model.
    pub fn modes(mut self, count: usize) -> Self {
        self.0.modes = Some(count);
        self
    }

    /// Sets the number of simulations per candidate, of which the median time counts.
    pub fn repeat(mut self, times: usize) -> Self {
        self.0.repeat = times.max(1);
        self
    }

    /// Sets the reference motion of the errors. Choices other than [`ReferenceChoice::Full`] need a model.
    pub fn reference(mut self, reference: ReferenceChoice) -> Self {
        self.0.reference = reference;
        self
    }
}

/// Result of a trade study: candidate bodies for a scene, measured against a reference, and the recommended one.
#[derive(Debug, Clone)]
pub struct Trade {
    study: TradeStudy,
    diagnostics: Vec<Diagnostic>,
}

impl Trade {
    fn new(study: TradeStudy) -> Self {
        let diagnostics = study.diagnostics();
        Self { study, diagnostics }
    }
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
        heard(listener, |context| options.0.for_model(&self.checked, &scene.0, || *context)).map(Trade::new)
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
        heard(listener, |context| options.0.for_body(self.0.clone(), &scene.0, context)).map(Trade::new)
    }
}

impl Trade {
    /// Returns the number of candidates; the first is the whole body of the reference.
    pub fn candidates(&self) -> usize {
        self.study.trade.rows.len()
    }

    /// Returns the index of the recommended candidate (from 0); `None` if none is within the tolerances or as cheap as
    /// allowed.
    pub fn recommended(&self) -> Option<usize> {
        self.study.trade.recommended.row()
    }

    /// Returns the candidates of the Pareto front (from 0), ascending in cost: no other one is both cheaper and as
    /// accurate.
    pub fn front(&self) -> &[usize] {
        &self.study.trade.front
    }

    /// Returns the body of a candidate.
    ///
    /// # Errors
    /// FB804 if there is no such candidate; FB703 if lumped masses give no valid body.
    pub fn body(&self, candidate: usize) -> Result<FlexBody> {
        let Some(row) = self.study.trade.rows.get(candidate) else {
            let message =
                format!("candidate {candidate} does not exist: the study has {}", self.candidates());
            return Err(Diagnostic::new(Code::Argument, message).into());
        };
        row.candidate.body(&self.study.sources[row.candidate.source]).map(FlexBody)
    }

    /// Returns the command that makes exactly the recommended candidate from the file `input`, the model or the flex-body
    /// file of the study, and the scene file `scene`. Returns `None` if nothing is recommended.
    pub fn command(&self, input: &str, scene: &str) -> Option<String> {
        self.study.command(&Origin { input: vec![input.to_owned()], scene: scene.to_owned(), case: None })
    }

    /// Returns true if there is a recommended candidate that holds in the stated variations, and the reference is
    /// accurate enough.
    pub fn holds(&self) -> bool {
        self.study.holds()
    }

    /// Returns the report of `flexbody trade`.
    pub fn report(&self, format: ReportFormat) -> String {
        let run = report::run(&self.diagnostics);
        TradeFacts::new(&self.study.trade, &self.study.reference_errors, &run).render(format.inner())
    }

    /// Returns the table of `flexbody trade --csv`: one line per candidate.
    pub fn csv(&self) -> String {
        trade_csv(&self.study.trade)
    }

    /// Returns warnings and notes.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }
}
