//! What accuracy costs in a scene.

use super::progress::{Listener, heard};
use super::{FlexBody, Model, ReportFormat, Scene, report};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::basis::ModeSettings;
use flexbody_report::{TradeFacts, trade_csv};
use flexbody_study::reference::ReferenceError;
use flexbody_study::trade::{
    self, ReferenceChoice, ReferenceKind, Source, TradeSettings, WantedBodies, conversions,
};

/// What is asked of a trade study. The default: 20 modes of a model, the reference being the body with
/// everything that it has, the median time of 3 simulations of each candidate.
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
    /// Number of free modes of the conversions of a model.
    pub fn modes(mut self, count: usize) -> Self {
        self.modes = count;
        self
    }

    /// Simulations of a candidate whose median time counts.
    pub fn repeat(mut self, times: usize) -> Self {
        self.repeat = times.max(1);
        self
    }

    /// Measures errors against this motion; those other than [`ReferenceChoice::Full`] need a model.
    pub fn reference(mut self, reference: ReferenceChoice) -> Self {
        self.reference = reference;
        self
    }
}

/// Candidate bodies for a scene, measured against a reference, and the best of them.
#[derive(Debug, Clone)]
pub struct Trade {
    study: trade::Trade,
    sources: Vec<Source>,
    /// Of each load case.
    lacks: Vec<Vec<ReferenceError>>,
    diagnostics: Vec<Diagnostic>,
}

impl Model {
    /// Measures what accuracy costs in `scene`: candidates of the conversions of the model, as
    /// `flexbody trade model.toml` does. Every candidate is measured in each load case, and as good as it is in
    /// the worst. All results but the times are the same at any number of threads.
    ///
    /// # Errors
    /// As [`Model::convert`]; FB212 where the scene does not fit the body; FB540 when its motion cannot be
    /// integrated; FB605 where the listener stops it.
    pub fn trade(&self, scene: &Scene, options: &TradeOptions, listener: Listener<'_>) -> Result<Trade> {
        heard(listener, |context| {
            let fine = options.reference == ReferenceChoice::Fine;
            let wanted = WantedBodies { modes: options.modes, fine };
            let made = conversions(&self.checked, &scene.0, wanted, context)?;
            let nodal = (options.reference == ReferenceChoice::Nodal).then_some(&self.checked);
            let reserved = trade::reserved(&made.lacks, nodal.is_some());
            let settings = TradeSettings { repeat: options.repeat, reserved: &reserved };
            let study = trade::trade(&made.sources, &scene.0, nodal, &settings, context)?;
            let diagnostics = [made.diagnostics, study.diagnostics.clone()].concat();
            Ok(Trade { study, sources: made.sources, lacks: made.lacks, diagnostics })
        })
    }
}

impl FlexBody {
    /// Measures what accuracy costs in `scene` as [`Model::trade`] does, for parts of this body: fewer modes, fewer
    /// groups of terms, 32-bit numbers, lumped couplings.
    ///
    /// # Errors
    /// FB801 for errors against all nodes, of which a body knows nothing; FB212 and FB540 as there; FB605
    /// where the listener stops it.
    pub fn trade(&self, scene: &Scene, options: &TradeOptions, listener: Listener<'_>) -> Result<Trade> {
        if options.reference != ReferenceChoice::Full {
            let message =
                "errors against all nodes, or a finer body, need the matrices: ask the model, not the body";
            return Err(Diagnostic::new(Code::Usage, message).into());
        }
        let sources = vec![Source::new("file", self.0.clone(), None)?];
        let settings = TradeSettings { repeat: options.repeat, reserved: &[] };
        let study = heard(listener, |context| trade::trade(&sources, &scene.0, None, &settings, context))?;
        let diagnostics = study.diagnostics.clone();
        Ok(Trade { study, sources, lacks: Vec::new(), diagnostics })
    }
}

impl Trade {
    /// Number of candidates; the first is the whole body of the reference.
    pub fn candidates(&self) -> usize {
        self.study.rows.len()
    }

    /// The candidate to take (from 0); `None` where none holds the tolerances or is as cheap as allowed.
    pub fn recommended(&self) -> Option<usize> {
        self.study.recommended.row()
    }

    /// The candidates that no other is cheaper than and as accurate as (from 0), ascending in cost.
    pub fn front(&self) -> &[usize] {
        &self.study.front
    }

    /// The body of a candidate.
    ///
    /// # Errors
    /// FB801 when there is no such candidate; FB703 where lumped masses give no body.
    pub fn body(&self, candidate: usize) -> Result<FlexBody> {
        let Some(row) = self.study.rows.get(candidate) else {
            let message = format!("there is no candidate {candidate} of {}", self.candidates());
            return Err(Diagnostic::new(Code::Usage, message).into());
        };
        row.candidate.body(&self.sources[row.candidate.source]).map(FlexBody)
    }

    /// Whether there is a candidate to take, and what it was measured against can be trusted.
    pub fn holds(&self) -> bool {
        let nodal = self.study.reference == ReferenceKind::Nodal;
        let is_reference =
            |rounds: &Vec<ReferenceError>| rounds.last().is_none_or(ReferenceError::is_reference);
        self.recommended().is_some() && (nodal || self.lacks.iter().all(is_reference))
    }

    /// The report of `flexbody trade`.
    pub fn report(&self, format: ReportFormat) -> String {
        let run = report::run(&self.diagnostics);
        TradeFacts::new(&self.study, &self.lacks, &run).render(format.inner())
    }

    /// The table of `flexbody trade --csv`: a line for each candidate.
    pub fn csv(&self) -> String {
        trade_csv(&self.study)
    }

    /// Warnings and notes.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }
}
