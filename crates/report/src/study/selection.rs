//! Report on a selection: the terms and modes that a scene needs, and the reasons for the decision.

use super::errors::{
    ReferenceErrorFacts, VariationFacts, errors_in_words, in_words, part_in_words, ranges,
    reference_in_words, tolerances_in_words,
};
use super::selection_verdict::SelectionVerdict;
use crate::document::text::{self, Screen};
use crate::document::{Block, Document, Format, Inline, State, Table, Term, cells, heading};
use crate::notation::numbers::{percent, significant};
use crate::run_data::RunData;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::provenance::generator;
use flexbody_body::flex_body::{TermDecision, TermGroup};
use flexbody_linalg::ties::sort_descending;
use flexbody_motion::scene::{OutputErrors, PerQuantity};
use flexbody_study::selection::{
    CaseSelection, DecisiveError, ErrorSource, Excitation, ModeReasons, ModeWorth, Participation, Selection,
    Trial,
};
use serde::Serialize;

/// Number of modes that a summary lists.
const MODES_SHOWN: usize = 12;

/// Facts of a selection.
#[derive(Debug, Clone, Serialize)]
pub struct SelectionFacts<'a> {
    generator: String,
    scene: &'a str,
    body: &'a str,
    /// The selection in five lines.
    verdict: SelectionVerdict,
    /// Command that makes exactly the recommended body; `None` if the inputs are not known by name.
    #[serde(skip_serializing_if = "Option::is_none")]
    command: Option<String>,
    inputs: Vec<InputFacts<'a>>,
    tolerance: PerQuantity<f64>,
    terms: Vec<TermFacts<'a>>,
    guideline: &'a str,
    modes: ModesFacts<'a>,
    chosen: Option<TrialFacts<'a>>,
    multiplications_before: usize,
    /// Errors of the body, and of its versions before enrichment, relative to the model; empty if only a body
    /// file is available.
    reference: Vec<ReferenceErrorFacts>,
    significance: Vec<SignificanceFacts>,
    trials: Vec<TrialFacts<'a>>,
    /// Facts of each load case, if there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    cases: Vec<CaseFacts<'a>>,
    /// Errors of the selected model in variations of the scene, which did not choose it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    variations: Vec<VariationFacts<'a>>,
    diagnostics: &'a [Diagnostic],
}

#[derive(Debug, Clone, Serialize)]
struct InputFacts<'a> {
    name: &'a str,
    value: f64,
    source: &'a str,
}

#[derive(Debug, Clone, Serialize)]
struct TermFacts<'a> {
    group: &'a str,
    kept: bool,
    tier: u8,
    bound: f64,
    limit: f64,
    /// Ratio of `limit` to the tolerance; 1 if no error was compared with a tolerance.
    budget: f64,
    /// Ratio limit / bound.
    slack: f64,
    reason: &'a str,
}

#[derive(Debug, Clone, Serialize)]
struct ModesFacts<'a> {
    /// Fixed-interface modes that a Craig-Bampton body keeps; `None` if the selection picks modes.
    fixed_interface: Option<FixedInterfaceFacts>,
    of: usize,
    /// Numbers of the kept modes, from 1.
    kept: Vec<usize>,
    reason: &'a str,
    /// Excitations of the modes and the worth of those at the edge; `None` unless the fewest modes were looked for.
    reasons: Option<ModeReasonFacts<'a>>,
    static_responses: Vec<ResponseFacts<'a>>,
    shares: Vec<ShareFacts>,
}

#[derive(Debug, Clone, Serialize)]
struct FixedInterfaceFacts {
    of: usize,
    /// Numbers of the kept ones, from 1.
    kept: Vec<usize>,
}

#[derive(Debug, Clone, Serialize)]
struct ModeReasonFacts<'a> {
    excited: Vec<ExcitationFacts<'a>>,
    without_last: Option<ModeWorthFacts>,
    with_next: Option<ModeWorthFacts>,
    /// Source of most of the remaining error: `modes`, `terms` or `body`.
    remaining_error: Option<&'static str>,
}

#[derive(Debug, Clone, Serialize)]
struct ExcitationFacts<'a> {
    by: &'a str,
    /// Numbers from 1.
    modes: Vec<usize>,
}

#[derive(Debug, Clone, Serialize)]
struct ModeWorthFacts {
    /// Number from 1.
    mode: usize,
    output: &'static str,
    error: f64,
}

impl<'a> ModeReasonFacts<'a> {
    fn new(reasons: &'a ModeReasons) -> Self {
        let excitation = |own: &'a Excitation| ExcitationFacts {
            by: &own.by,
            modes: own.modes.iter().map(|mode| mode + 1).collect(),
        };
        let worth =
            |own: ModeWorth| ModeWorthFacts { mode: own.mode + 1, output: own.output, error: own.error };
        Self {
            excited: reasons.excited.iter().map(excitation).collect(),
            without_last: reasons.without_last.map(worth),
            with_next: reasons.with_next.map(worth),
            remaining_error: reasons.rest.map(|source| match source {
                ErrorSource::Modes => "modes",
                ErrorSource::Groups => "terms",
                ErrorSource::Body => "body",
            }),
        }
    }
}

#[derive(Debug, Clone, Serialize)]
struct ResponseFacts<'a> {
    load: &'a str,
    /// Error of the selected modes relative to the response of the body.
    #[serde(rename = "selected_lack")]
    selected_error: f64,
    /// Error of the modes of the body relative to the response of the model.
    #[serde(rename = "body_lacks")]
    body_error: Option<f64>,
    /// Error of the modes of the body without its residual vectors.
    without_residual_vectors: Option<f64>,
}

#[derive(Debug, Clone, Copy, Serialize)]
struct ShareFacts {
    number: usize,
    kept: bool,
    amplitude: f64,
    deflection: f64,
    stress: f64,
    /// Contribution to a recovery over its limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    recovery: Option<f64>,
}

#[derive(Debug, Clone, Serialize)]
struct SignificanceFacts {
    term: &'static str,
    beside: &'static str,
    group: &'static str,
    guideline: &'static str,
    formula: &'static str,
    tier_0: f64,
    tier_1: Option<f64>,
}

#[derive(Debug, Clone, Serialize)]
struct TrialFacts<'a> {
    kept: Vec<&'static str>,
    modes: usize,
    multiplications: usize,
    tier: u8,
    errors: Option<OutputErrors>,
    worst: Option<f64>,
    budget: f64,
    passed: bool,
    remark: &'a str,
    /// Load case with the reported errors, if there are several cases.
    #[serde(skip_serializing_if = "Option::is_none")]
    case: Option<&'a str>,
    /// Largest error over its tolerance in each load case.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    by_case: Vec<Option<f64>>,
}

impl<'a> ResponseFacts<'a> {
    fn new(participation: &'a Participation) -> Self {
        Self {
            load: &participation.load,
            selected_error: participation.selected,
            body_error: participation.body.map(|(after, _)| after),
            without_residual_vectors: participation.body.map(|(_, before)| before),
        }
    }
}

impl<'a> TrialFacts<'a> {
    /// Collects the facts of `trial`, which was run in `cases` (empty for a scene without load cases).
    pub(super) fn new(trial: &'a Trial, cases: &'a [CaseSelection]) -> Self {
        let finite = |worst: f64| worst.is_finite().then_some(worst);
        Self {
            case: trial.case.and_then(|at| cases.get(at)).map(|case| case.name.as_str()),
            by_case: trial.by_case.iter().map(|worst| finite(*worst)).collect(),
            kept: trial.kept.kept().map(TermGroup::name).collect(),
            modes: trial.modes,
            multiplications: trial.multiplications,
            tier: trial.tier,
            errors: trial.errors,
            worst: finite(trial.worst),
            budget: trial.budget,
            passed: trial.passed(),
            remark: &trial.remark,
        }
    }

    /// Returns the groups of the trial as text.
    fn groups(&self) -> String {
        if self.kept.is_empty() { "I0 only".to_owned() } else { format!("I0 {}", self.kept.join(" ")) }
    }
}

impl<'a> SelectionFacts<'a> {
    /// Collects the facts of `selection` and of the run that made it.
    pub fn new(selection: &'a Selection, run: &'a RunData) -> Self {
        let term = |(decision, decisive_error): (&'a TermDecision, &Option<DecisiveError>)| TermFacts {
            group: decision.group.name(),
            kept: decision.kept,
            tier: decision.tier,
            bound: decision.bound,
            limit: decision.limit,
            budget: decisive_error.map_or(1.0, |decisive_error| decisive_error.budget),
            slack: decision.limit / decision.bound,
            reason: &decision.reason,
        };
        let shares = selection.shares.iter().enumerate().map(|(j, share)| ShareFacts {
            number: j + 1,
            kept: share.kept,
            amplitude: share.amplitude,
            deflection: share.deflection,
            stress: share.stress,
            recovery: share.recovery,
        });
        let significance = selection.significances.iter().map(|significance| SignificanceFacts {
            term: significance.term,
            beside: significance.beside,
            group: significance.group.name(),
            guideline: significance.guideline,
            formula: significance.formula,
            tier_0: significance.bound,
            tier_1: significance.of_body,
        });
        Self {
            generator: generator(),
            scene: &selection.scene,
            body: &selection.body,
            verdict: SelectionVerdict::new(selection),
            command: None,
            inputs: selection
                .inputs
                .iter()
                .map(|input| InputFacts { name: input.name, value: input.value, source: &input.source })
                .collect(),
            tolerance: selection.tolerance,
            terms: selection.terms.iter().zip(&selection.decisive_errors).map(term).collect(),
            guideline: selection.guideline,
            modes: ModesFacts {
                fixed_interface: selection.fixed_interface.as_ref().map(|choice| FixedInterfaceFacts {
                    of: choice.of,
                    kept: choice.kept.iter().map(|j| j + 1).collect(),
                }),
                of: selection.n_modes,
                kept: selection.modes.iter().map(|j| j + 1).collect(),
                reason: &selection.mode_reason,
                reasons: selection.mode_reasons.as_ref().map(ModeReasonFacts::new),
                static_responses: selection.participations.iter().map(ResponseFacts::new).collect(),
                shares: shares.collect(),
            },
            chosen: selection.chosen.as_ref().map(|trial| TrialFacts::new(trial, &selection.cases)),
            multiplications_before: selection.multiplications,
            reference: selection.reference_errors.iter().map(ReferenceErrorFacts::new).collect(),
            significance: significance.collect(),
            trials: selection.trials.iter().map(|trial| TrialFacts::new(trial, &selection.cases)).collect(),
            cases: selection.cases.iter().map(CaseFacts::new).collect(),
            variations: selection.varied.iter().map(VariationFacts::of_selection).collect(),
            diagnostics: &run.diagnostics,
        }
    }

    /// Adds the command that makes exactly the recommended body.
    pub fn with_command(self, command: String) -> Self {
        Self { command: Some(command), ..self }
    }

    /// Renders the facts in a format, ending with a line break.
    pub fn render(&self, format: Format) -> String {
        Document::render(self, format, || self.document())
    }

    /// Returns the decision about a term in words.
    fn verdict(term: &TermFacts<'_>) -> String {
        let verdict = if term.kept { "keep" } else { "drop" };
        if term.limit > 0.0 {
            let (bound, limit) = (significant(term.bound, 3), significant(term.limit, 3));
            let reach = if term.kept { "error without it" } else { "error without it at most" };
            let budget = match term.budget {
                budget if budget < 1.0 => {
                    format!(
                        " ({} of the stated tolerance; the rest is reserved for dropped modes and the error of the body)",
                        percent(budget)
                    )
                }
                _ => String::new(),
            };
            format!(
                "{verdict} (tier {}): {}; {reach} {bound}, tolerance {limit}{budget}",
                term.tier, term.reason
            )
        } else {
            format!("{verdict}: {}", term.reason)
        }
    }

    /// Renders the lines of the verdict.
    pub fn summary(&self) -> String {
        text::render(&[Block::Terms(self.head())], Screen::default())
    }

    /// Returns the verdict. A page omits the recommendation here because its head already shows it.
    fn head(&self) -> Vec<Term> {
        let [asked, (label, taken), rest @ ..] = self.verdict.lines();
        let mut terms = vec![Term::text("Selection", format!("{}: {}", self.scene, self.body))];
        terms.extend([Term::new(asked.0, asked.1), Term::text(label, taken)]);
        let told = rest.into_iter().filter(|(_, line)| !line.is_empty());
        terms.extend(told.map(|(label, line)| Term::new(label, line)));
        terms.extend(in_words(&self.variations).map(|words| Term::new("Variations", words)));
        terms.extend(self.command.as_ref().map(|command| Term::new("Command", command.as_str())));
        terms
    }

    fn document(&self) -> Document<'_> {
        let [_, (label, taken), ..] = self.verdict.lines();
        let state = if self.verdict.holds { State::Good } else { State::Open };
        let mut blocks = vec![
            Block::Verdict { state, head: format!("{label}: {taken}."), rest: String::new() },
            Block::Terms(self.head()),
            Block::Gap,
            Block::Line("Details".to_owned()),
            heading("Decision"),
            Block::Terms(self.decision()),
        ];
        if !self.cases.is_empty() {
            let cases = self.cases.iter().map(|case| Term::text("Load cases", case.in_words()));
            blocks.extend([
                heading("Load cases"),
                Block::Terms(cases.collect()),
                Block::Table(cases_table(&self.cases)),
            ]);
        }
        let tolerances = tolerances_in_words(&self.tolerance);
        let input = |input: &InputFacts<'_>| {
            let value = significant(input.value, 4);
            Term::new(input.name, format!("{}: {}", significant(input.value, 5), input.source))
                .in_text("Inputs", format!("{} {value}: {}", input.name, input.source))
        };
        let units = "units of the body, angles in radians";
        let units = Term::new("Units", units).in_text("Inputs", format!("in {units}"));
        let inputs = std::iter::once(units).chain(self.inputs.iter().map(input));
        let inputs = inputs.chain([Term::new("Tolerances", tolerances).short("Tolerances")]).collect();
        blocks.extend([heading("Inputs"), Block::Terms(inputs)]);
        blocks.extend([heading("Sizes of the terms"), Block::Table(self.sizes())]);
        blocks.extend([heading("Trials"), Block::Table(self.trials())]);
        if !self.modes.shares.is_empty() {
            blocks.extend([heading("Modes"), Block::Table(self.shares())]);
        }
        if !self.modes.static_responses.is_empty() {
            blocks.extend([heading("Static responses"), Block::Table(self.responses())]);
        }
        blocks.push(Block::Diagnostics(self.diagnostics));
        let (name, kind) = (self.scene, "Selection of terms and modes");
        Document { name, kind, generator: &self.generator, blocks }
    }

    fn decision(&self) -> Vec<Term> {
        let mut terms: Vec<Term> =
            self.terms.iter().map(|term| Term::new(term.group, Self::verdict(term))).collect();
        terms.push(Term::new("Guideline", self.guideline));
        let modes = &self.modes;
        terms.push(Term::new("Modes", format!("{} of {}: {}", modes.kept.len(), modes.of, modes.reason)));
        let kept = ranges(&modes.kept);
        terms.push(if modes.kept.len() < modes.of {
            Term::new("Kept", kept.as_str()).in_text("", format!("kept: {kept}"))
        } else {
            Term::page("Kept", kept)
        });
        if let Some(errors) = self.chosen.as_ref().and_then(|chosen| chosen.errors.as_ref()) {
            terms.push(Term::new(
                "Errors",
                format!("{}, compared with the body with all its terms and modes", errors_in_words(errors)),
            ));
            terms.push(Term::new("Reference", reference_in_words(&self.reference)));
        }
        terms
    }

    fn sizes(&self) -> Table {
        let heads = ["Term", "beside", "Group", "Guideline", "Formula", "Tier 0", "Tier 1", "Slack"];
        let row = |one: &SignificanceFacts| {
            let words = [one.term, one.beside, one.group, one.guideline, one.formula].map(Inline::from);
            let numbers = [Some(one.tier_0), one.tier_1, one.tier_1.map(|own| one.tier_0 / own)];
            words.into_iter().chain(cells(numbers.map(known))).collect()
        };
        let caption = "Bounds at the largest amplitude and angular velocity. Tier 0 follows from I0 and the frequencies, tier 1 uses the norms of the invariants; slack is the ratio of both.";
        Table::new(caption, heads, &[1, 2, 3, 4], self.significance.iter().map(row).collect())
    }

    fn trials(&self) -> Table {
        let heads = [
            "Terms",
            "Modes",
            "Tier",
            "Multiplications",
            "Attitude",
            "Deflection",
            "Stress",
            "Reaction",
            "Verdict",
        ];
        let row = |trial: &TrialFacts<'_>| {
            let verdict = match (trial.passed, trial.remark) {
                (true, _) => "within",
                (false, "") => "beyond",
                (false, remark) => remark,
            };
            let case = trial.case.map_or_else(String::new, |case| format!(" (case {case})"));
            let sizes = [trial.modes, trial.tier.into(), trial.multiplications].map(|size| size.to_string());
            let errors = trial.errors.unwrap_or_default().named().map(|(_, error)| known(error));
            let mut row: Vec<Inline> = vec![trial.groups().into()];
            row.extend(cells(sizes).into_iter().chain(cells(errors)));
            row.push(format!("{verdict}{case}").into());
            row
        };
        let caption = "Errors of models with fewer terms or modes: guaranteed bounds (tiers 0 and 1) or measured (tier 2). The last row is the selection.";
        Table::new(caption, heads, &[8], self.trials.iter().chain(&self.chosen).map(row).collect())
    }

    fn responses(&self) -> Table {
        let part = |value: Option<f64>| {
            value.map_or_else(|| "not recorded".to_owned(), |v| significant(100.0 * v, 3))
        };
        let row = |one: &ResponseFacts<'_>| {
            let errors = [Some(one.selected_error), one.body_error, one.without_residual_vectors].map(part);
            std::iter::once(one.load.into()).chain(cells(errors)).collect()
        };
        let heads = ["Load", "Selected modes, %", "Body, %", "Body without residual vectors, %"];
        let caption = "Errors of static responses, in the norm of K: of the selected modes relative to the body, and of the body relative to the model.";
        Table::new(caption, heads, &[], self.modes.static_responses.iter().map(row).collect())
    }

    fn shares(&self) -> Table {
        let mut shares = self.modes.shares.clone();
        let size = |one: &ShareFacts| one.recovery.unwrap_or_else(|| one.stress.max(one.deflection));
        sort_descending(&mut shares, size);
        let with_recoveries = shares.iter().any(|share| share.recovery.is_some());
        shares.truncate(MODES_SHOWN);
        let row = |share: &ShareFacts| {
            let verdict = if share.kept { "kept" } else { "dropped" };
            let [deflection, stress] =
                [share.deflection, share.stress].map(|part| significant(100.0 * part, 3));
            let amplitude = significant(share.amplitude, 3);
            let recovery = share.recovery.map(|part| significant(100.0 * part, 3));
            let numbers = [share.number.to_string(), amplitude, deflection, stress];
            numbers.into_iter().chain(recovery).chain([verdict.to_owned()]).map(Inline::from).collect()
        };
        let recovery = with_recoveries.then_some("Recovery, % of limit");
        let heads: Vec<&str> = ["Mode", "Amplitude", "Deflection, %", "Stress, %"]
            .into_iter()
            .chain(recovery)
            .chain(["Verdict"])
            .collect();
        let of_recovery =
            if with_recoveries { "; contribution to the recoveries, over their limits" } else { "" };
        let noun = if self.modes.fixed_interface.is_some() { "Fixed-interface modes" } else { "Modes" };
        let caption = format!(
            "{noun} with the largest contributions ({} of {}): largest amplitude, and deflection and stress of the mode alone relative to all modes together{of_recovery}.",
            shares.len(),
            self.modes.shares.len()
        );
        let text = [heads.len() - 1];
        Table::new(caption, heads, &text, shares.iter().map(row).collect())
    }
}

/// Returns a number with three digits; empty if it is unknown.
fn known(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| significant(value, 3))
}

// Facts of a selection for each of several load cases.

/// Facts of a load case.
#[derive(Debug, Clone, Serialize)]
struct CaseFacts<'a> {
    name: &'a str,
    tolerance: PerQuantity<f64>,
    /// Errors of the selected model.
    errors: Option<OutputErrors>,
    /// Largest error of the selected model over its tolerance.
    worst: Option<f64>,
    /// Output with that largest error.
    output: Option<&'static str>,
    /// Fraction of the tolerances left by the reference.
    budget: Option<f64>,
    passed: bool,
    /// Parts of the selection that this case decides, because it needs them most: groups, and `modes`.
    binds: Vec<&'static str>,
    /// Errors of the body, and of its versions before enrichment, relative to the model in this case.
    reference: Vec<ReferenceErrorFacts>,
}

impl<'a> CaseFacts<'a> {
    pub(crate) fn new(case: &'a CaseSelection) -> Self {
        let tolerance = &case.tolerance;
        let chosen = case.chosen.as_ref();
        let errors = chosen.and_then(|trial| trial.errors);
        let groups = case.binds_groups.iter().copied().map(TermGroup::name);
        Self {
            name: &case.name,
            tolerance: tolerance.errors,
            errors,
            worst: chosen.map(|trial| trial.worst).filter(|worst| worst.is_finite()),
            output: errors.map(|errors| errors.decisive(tolerance).0),
            budget: chosen.map(|trial| trial.budget),
            passed: chosen.is_none_or(|trial| trial.passed()),
            binds: groups.chain(case.binds_modes.then_some("modes")).collect(),
            reference: case.reference_errors.iter().map(ReferenceErrorFacts::new).collect(),
        }
    }

    fn binds_in_words(&self) -> String {
        if self.binds.is_empty() { "nothing".to_owned() } else { self.binds.join(", ") }
    }

    fn reference_error_in_words(&self) -> String {
        self.reference.last().map_or_else(|| "not known".to_owned(), ReferenceErrorFacts::parts)
    }

    /// Returns the case in words: `braking: stress 1.2 %, 60 % of what is allowed; decides W1, modes`.
    pub(crate) fn in_words(&self) -> String {
        let binds = if self.binds.is_empty() {
            "decides nothing".to_owned()
        } else {
            format!("decides {}", self.binds_in_words())
        };
        match &self.errors {
            Some(errors) => {
                let beyond = if self.passed { "" } else { ", exceeded" };
                let errors = errors_in_words(errors);
                format!(
                    "{}: {errors}: {} of the tolerance{beyond}; {binds}",
                    self.name,
                    part_in_words(self.worst)
                )
            }
            None => format!("{}: {binds}", self.name),
        }
    }
}

/// Returns the table of the errors of the selected model in every load case, and of the effect of each case
/// on the selection.
fn cases_table(cases: &[CaseFacts<'_>]) -> Table {
    let heads = ["Load case", "Errors", "Error / tolerance", "Decides", "Error of the body (estimated)"];
    let row = |case: &CaseFacts<'_>| {
        let errors = case.errors.as_ref().map_or_else(|| "not measured".to_owned(), errors_in_words);
        cells([
            case.name.to_owned(),
            errors,
            part_in_words(case.worst),
            case.binds_in_words(),
            case.reference_error_in_words(),
        ])
    };
    let caption = "The selected model in each load case, compared with the body with all its terms and modes. A case decides a group or the number of modes if it is the case in which the model without them exceeds the tolerances most.";
    Table::new(caption, heads, &[1, 3, 4], cases.iter().map(row).collect())
}
