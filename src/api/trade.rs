//! What accuracy costs in a scene, or in several load cases.

use super::progress::{Listener, heard};
use super::{FlexBody, Model, ReportFormat, Scene, report};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::basis::ModeSettings;
use flexbody_linalg::progress::Watch;
use flexbody_report::{TradeFacts, trade_csv};
use flexbody_study::reference::ReferenceError;
use flexbody_study::trade::{
    self, Allowed, ReferenceKind, Source, TradeSettings, WantedBodies, conversions_for_cases,
};

/// What is asked of a trade study. The default: 20 modes of a model, the reference being the body with
/// everything that it has, the median time of 3 simulations of each candidate.
#[derive(Debug, Clone, PartialEq)]
pub struct TradeOptions {
    modes: usize,
    repeat: usize,
    reference: Against,
}

/// What errors are measured against.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Against {
    Body,
    FineBody,
    Nodes,
}

impl Default for TradeOptions {
    fn default() -> Self {
        Self { modes: ModeSettings::DEFAULT_COUNT, repeat: 3, reference: Against::Body }
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

    /// Measures errors against the motion of all nodes of the model.
    pub fn against_all_nodes(mut self) -> Self {
        self.reference = Against::Nodes;
        self
    }

    /// Measures errors against a body that is enriched until what it lacks of the motion of all nodes is
    /// estimated at no more than a hundredth of the tolerances: what can be had of large models and long
    /// scenes. Where that is not reached a warning says so.
    pub fn against_a_fine_body(mut self) -> Self {
        self.reference = Against::FineBody;
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
    /// `flexbody trade model.toml` does. All results but the times are the same at any number of threads.
    ///
    /// # Errors
    /// As [`Model::convert`]; FB212 where the scene does not fit the body; FB540 when its motion cannot be
    /// integrated; FB605 where the listener stops it.
    pub fn trade(&self, scene: &Scene, options: &TradeOptions, listener: Listener<'_>) -> Result<Trade> {
        self.trade_for_cases(std::slice::from_ref(scene), options, listener)
    }

    /// The same for several load cases: every candidate is measured in each, and as good as it is in the
    /// worst.
    ///
    /// # Errors
    /// As [`Model::trade`]; FB801 when there is no case.
    pub fn trade_for_cases(
        &self,
        cases: &[Scene],
        options: &TradeOptions,
        listener: Listener<'_>,
    ) -> Result<Trade> {
        let scenes: Vec<_> = cases.iter().map(|case| case.0.clone()).collect();
        heard(listener, |watch| {
            let fine = options.reference == Against::FineBody;
            let wanted = WantedBodies { modes: options.modes, fine };
            let made = conversions_for_cases(&self.checked, &scenes, wanted, Allowed::default(), watch)?;
            let nodal = (options.reference == Against::Nodes).then_some(&self.checked);
            let reserved = trade::reserved(&made.lacks, nodal.is_some());
            let settings =
                TradeSettings { repeat: options.repeat, memory: None, reserved: &reserved, longest: None };
            let study = trade::trade_for_cases(&made.sources, &scenes, nodal, &settings, watch)?;
            let diagnostics = [made.diagnostics, study.diagnostics.clone()].concat();
            Ok(Trade { study, sources: made.sources, lacks: made.lacks, diagnostics })
        })
    }
}

impl FlexBody {
    /// The same for parts of this body: fewer modes, fewer groups of terms, 32-bit numbers, lumped couplings.
    ///
    /// # Errors
    /// FB801 for errors against all nodes, of which a body knows nothing; FB212 and FB540 as there; FB605
    /// where the listener stops it.
    pub fn trade(&self, scene: &Scene, options: &TradeOptions, listener: Listener<'_>) -> Result<Trade> {
        self.trade_for_cases(std::slice::from_ref(scene), options, listener)
    }

    /// The same for several load cases, as [`Model::trade_for_cases`].
    ///
    /// # Errors
    /// As [`FlexBody::trade`]; FB801 when there is no case.
    pub fn trade_for_cases(
        &self,
        cases: &[Scene],
        options: &TradeOptions,
        listener: Listener<'_>,
    ) -> Result<Trade> {
        if options.reference != Against::Body {
            let message =
                "errors against all nodes, or a finer body, need the matrices: ask the model, not the body";
            return Err(Diagnostic::new(Code::Usage, message).into());
        }
        let scenes: Vec<_> = cases.iter().map(|case| case.0.clone()).collect();
        let sources = vec![Source::new("file", self.0.clone(), None)?];
        let settings = TradeSettings { repeat: options.repeat, memory: None, reserved: &[], longest: None };
        let measure = |watch: Watch<'_>| trade::trade_for_cases(&sources, &scenes, None, &settings, watch);
        let study = heard(listener, measure)?;
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
