//! What a user reads of a selection: which terms and modes a scene needs, and on what grounds.

use super::Format;
use super::errors_in_words::{errors_in_words, ranges};
use super::lacks::{LackFacts, reference_in_words};
use super::markup::{diagnostics_table, escape, page, section, table, terms};
use super::numbers::significant;
use super::render::json;
use super::run_data::RunData;
use super::selection_cases::{CaseFacts, cases_table};
use super::selection_verdict::SelectionVerdict;
use super::text::{Page, diagnostics_lines};
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::provenance::generator;
use flexbody_body::flex_body::{TermDecision, TermGroup};
use flexbody_motion::scene::{OutputErrors, PerQuantity};
use flexbody_study::selection::{CaseSelection, Ground, Participation, Selection, Trial};
use serde::Serialize;
use std::fmt::Write;

/// Rows of modes that a summary shows.
const MODES_SHOWN: usize = 12;

/// Facts of a selection.
#[derive(Debug, Clone, Serialize)]
pub struct SelectionFacts<'a> {
    generator: String,
    scene: &'a str,
    body: &'a str,
    /// The selection in five lines.
    verdict: SelectionVerdict,
    inputs: Vec<InputFacts<'a>>,
    tolerance: PerQuantity<f64>,
    terms: Vec<TermFacts<'a>>,
    guideline: &'a str,
    modes: ModesFacts<'a>,
    chosen: Option<TrialFacts<'a>>,
    multiplications_before: usize,
    /// What the body, and those before it that were enriched, lack of the model; nothing where only a file is
    /// at hand.
    reference: Vec<LackFacts>,
    significance: Vec<SignificanceFacts>,
    trials: Vec<TrialFacts<'a>>,
    /// What belongs to each load case, where there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    cases: Vec<CaseFacts<'a>>,
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
    /// Part of the tolerance that `limit` is; 1 where there is none.
    budget: f64,
    /// limit / bound.
    slack: f64,
    reason: &'a str,
}

#[derive(Debug, Clone, Serialize)]
struct ModesFacts<'a> {
    of: usize,
    /// Numbers of the modes that are kept, from 1.
    kept: Vec<usize>,
    reason: &'a str,
    static_responses: Vec<ResponseFacts<'a>>,
    shares: Vec<ShareFacts>,
}

#[derive(Debug, Clone, Serialize)]
struct ResponseFacts<'a> {
    load: &'a str,
    /// What the selected modes lack of the response of the body.
    selected_lack: f64,
    /// What the modes of the body lack of the response of the model.
    body_lacks: Option<f64>,
    /// The same without its residual vectors.
    without_residual_vectors: Option<f64>,
}

#[derive(Debug, Clone, Copy, Serialize)]
struct ShareFacts {
    number: usize,
    kept: bool,
    amplitude: f64,
    deflection: f64,
    stress: f64,
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
pub(super) struct TrialFacts<'a> {
    kept: Vec<&'static str>,
    modes: usize,
    multiplications: usize,
    tier: u8,
    errors: Option<OutputErrors>,
    worst: Option<f64>,
    budget: f64,
    passed: bool,
    remark: &'a str,
    /// Of several load cases the one that the errors are of.
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
            selected_lack: participation.selected,
            body_lacks: participation.body.map(|(after, _)| after),
            without_residual_vectors: participation.body.map(|(_, before)| before),
        }
    }
}

impl<'a> TrialFacts<'a> {
    /// Facts of `trial`, which was made in `cases`; none of a scene alone.
    pub(super) fn new(trial: &'a Trial, cases: &'a [CaseSelection]) -> Self {
        let finite = |worst: f64| worst.is_finite().then_some(worst);
        Self {
            case: trial.case.and_then(|at| cases.get(at)).map(|case| case.name.as_str()),
            by_case: trial.by_case.iter().map(|worst| finite(*worst)).collect(),
            kept: TermGroup::ALL
                .into_iter()
                .filter(|group| trial.kept.has(*group))
                .map(TermGroup::name)
                .collect(),
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

    /// The groups as text.
    fn groups(&self) -> String {
        if self.kept.is_empty() { "I0 only".to_owned() } else { format!("I0 {}", self.kept.join(" ")) }
    }
}

impl<'a> SelectionFacts<'a> {
    /// Facts of `selection`, and of the run that made it.
    pub fn new(selection: &'a Selection, run: &'a RunData) -> Self {
        let term = |(decision, ground): (&'a TermDecision, &Option<Ground>)| TermFacts {
            group: decision.group.name(),
            kept: decision.kept,
            tier: decision.tier,
            bound: decision.bound,
            limit: decision.limit,
            budget: ground.map_or(1.0, |ground| ground.budget),
            slack: decision.limit / decision.bound,
            reason: &decision.reason,
        };
        let shares = selection.shares.iter().enumerate().map(|(j, share)| ShareFacts {
            number: j + 1,
            kept: share.kept,
            amplitude: share.amplitude,
            deflection: share.deflection,
            stress: share.stress,
        });
        let significance = selection.significances.iter().map(|one| SignificanceFacts {
            term: one.term,
            beside: one.beside,
            group: one.group.name(),
            guideline: one.guideline,
            formula: one.formula,
            tier_0: one.bound,
            tier_1: one.of_body,
        });
        Self {
            generator: generator(),
            scene: &selection.scene,
            body: &selection.body,
            verdict: SelectionVerdict::new(selection),
            inputs: selection
                .inputs
                .iter()
                .map(|input| InputFacts { name: input.name, value: input.value, source: &input.source })
                .collect(),
            tolerance: selection.tolerance,
            terms: selection.terms.iter().zip(&selection.grounds).map(term).collect(),
            guideline: selection.guideline,
            modes: ModesFacts {
                of: selection.n_modes,
                kept: selection.modes.iter().map(|j| j + 1).collect(),
                reason: &selection.mode_reason,
                static_responses: selection.participations.iter().map(ResponseFacts::new).collect(),
                shares: shares.collect(),
            },
            chosen: selection.chosen.as_ref().map(|trial| TrialFacts::new(trial, &selection.cases)),
            multiplications_before: selection.multiplications,
            reference: selection.lacks.iter().map(LackFacts::new).collect(),
            significance: significance.collect(),
            trials: selection.trials.iter().map(|trial| TrialFacts::new(trial, &selection.cases)).collect(),
            cases: selection.cases.iter().map(CaseFacts::new).collect(),
            diagnostics: &run.diagnostics,
        }
    }

    /// The facts in a format, ending with a line break.
    pub fn render(&self, format: Format) -> String {
        match format {
            Format::Json => json(self),
            Format::Text => self.text(),
            Format::Html => self.html(),
        }
    }

    /// What was decided about a term, in words.
    fn verdict(term: &TermFacts<'_>) -> String {
        let verdict = if term.kept { "keep" } else { "drop" };
        if term.limit > 0.0 {
            let (bound, limit) = (significant(term.bound, 3), significant(term.limit, 3));
            let reach = if term.kept { "without it" } else { "at most" };
            let budget = match term.budget {
                budget if budget < 1.0 => {
                    format!(
                        " ({} % of the tolerance: the rest is for modes left out and the error of the body)",
                        significant(100.0 * budget, 2)
                    )
                }
                _ => String::new(),
            };
            format!(
                "{verdict} (tier {}): {}: {reach} {bound}, allowed {limit}{budget}",
                term.tier, term.reason
            )
        } else {
            format!("{verdict}: {}", term.reason)
        }
    }

    fn tolerance_in_words(&self) -> String {
        errors_in_words(&self.tolerance.map(Some))
    }

    fn modes_in_words(&self) -> String {
        format!("{} of {}: {}", self.modes.kept.len(), self.modes.of, self.modes.reason)
    }

    /// The five lines of the verdict.
    pub fn summary(&self) -> String {
        let mut page = Page(String::new());
        page.entry("Selection", &format!("{}: {}", self.scene, self.body));
        for (label, line) in self.verdict.lines() {
            page.entry(label, line);
        }
        page.0
    }

    fn text(&self) -> String {
        let mut page = Page(self.summary() + "\nDetails\n");
        for term in &self.terms {
            page.entry(term.group, &Self::verdict(term));
        }
        page.entry("Guideline", self.guideline);
        page.entry("Modes", &self.modes_in_words());
        if self.modes.kept.len() < self.modes.of {
            page.entry("", &format!("kept: {}", ranges(&self.modes.kept)));
        }
        if let Some(errors) = self.chosen.as_ref().and_then(|chosen| chosen.errors.as_ref()) {
            page.entry("Errors", &format!("{}, measured against everything", errors_in_words(errors)));
            page.entry("Reference", &reference_in_words(&self.reference));
        }
        for (i, case) in self.cases.iter().enumerate() {
            page.entry(if i == 0 { "Load cases" } else { "" }, &case.in_words());
        }
        for (i, input) in self.inputs.iter().enumerate() {
            let label = if i == 0 { "Inputs" } else { "" };
            page.entry(label, &format!("{} {}: {}", input.name, significant(input.value, 4), input.source));
        }
        page.entry("Allowed", &self.tolerance_in_words());
        diagnostics_lines(&mut page, self.diagnostics);
        page.0
    }

    fn html(&self) -> String {
        let mut html = String::new();
        let [asked, (label, taken), rest @ ..] = self.verdict.lines();
        let class = if self.verdict.holds { "" } else { " open" };
        let _ = writeln!(html, "<p class=\"verdict{class}\"><strong>{label} {}.</strong></p>", escape(taken));
        terms(&mut html, [asked].into_iter().chain(rest).map(|(label, line)| (label, escape(line))));
        section(&mut html, "Decision");
        let decided = self.terms.iter().map(|term| (term.group, escape(&Self::verdict(term))));
        let mut items: Vec<(&str, String)> = decided.collect();
        items.push(("Guideline", escape(self.guideline)));
        items.push(("Modes", escape(&self.modes_in_words())));
        items.push(("Kept", ranges(&self.modes.kept)));
        if let Some(errors) = self.chosen.as_ref().and_then(|chosen| chosen.errors.as_ref()) {
            items.push(("Errors", format!("{}, measured", errors_in_words(errors))));
            items.push(("Reference", escape(&reference_in_words(&self.reference))));
        }
        terms(&mut html, items);
        if !self.cases.is_empty() {
            section(&mut html, "Load cases");
            cases_table(&mut html, &self.cases);
        }
        section(&mut html, "Inputs");
        let inputs = self
            .inputs
            .iter()
            .map(|input| (input.name, format!("{}: {}", significant(input.value, 5), escape(input.source))));
        terms(&mut html, inputs.chain([("Tolerances", self.tolerance_in_words())]));
        section(&mut html, "Sizes of the terms");
        let head = ["Term", "beside", "Group", "Guideline", "Formula", "Tier 0", "Tier 1", "Slack"];
        let rows: Vec<Vec<String>> = self
            .significance
            .iter()
            .map(|one| {
                let own = one.tier_1.map_or_else(String::new, |own| significant(own, 3));
                let slack = one.tier_1.map_or_else(String::new, |own| significant(one.tier_0 / own, 3));
                let (bound, texts) = (significant(one.tier_0, 3), [one.term, one.beside, one.group]);
                let mut row: Vec<String> = texts.map(escape).to_vec();
                row.extend([escape(one.guideline), escape(one.formula), bound, own, slack]);
                row
            })
            .collect();
        let caption = "Bounds at the largest amplitude and angular velocity. Tier 0 follows from I0 and the frequencies, tier 1 has the norms of the invariants; slack is their ratio.";
        table(&mut html, caption, &head.map(str::to_owned), &[1, 2, 3, 4], &rows);
        section(&mut html, "Trials");
        self.trials_table(&mut html);
        if !self.modes.shares.is_empty() {
            section(&mut html, "Modes");
            self.modes_table(&mut html);
        }
        if !self.modes.static_responses.is_empty() {
            section(&mut html, "Static responses");
            self.responses_table(&mut html);
        }
        diagnostics_table(&mut html, self.diagnostics);
        page(self.scene, "Terms and modes that a scene needs", &self.generator, &html)
    }

    fn trials_table(&self, html: &mut String) {
        let head = [
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
        let number = |value: Option<f64>| value.map_or_else(String::new, |value| significant(value, 3));
        let rows: Vec<Vec<String>> = self
            .trials
            .iter()
            .chain(&self.chosen)
            .map(|trial| {
                let errors = trial.errors.unwrap_or_default().named();
                let verdict = match (trial.passed, trial.remark) {
                    (true, _) => "within".to_owned(),
                    (false, "") => "beyond".to_owned(),
                    (false, remark) => escape(remark),
                };
                let verdict = match trial.case {
                    Some(case) => format!("{verdict} (case {})", escape(case)),
                    None => verdict,
                };
                let sizes = [trial.modes, trial.tier.into(), trial.multiplications];
                let mut row = vec![trial.groups()];
                row.extend(sizes.map(|size| size.to_string()));
                row.extend(errors.map(|(_, error)| number(error)));
                row.push(verdict);
                row
            })
            .collect();
        let caption = "Errors of models with fewer terms or modes: guaranteed bounds (tiers 0 and 1) or measured (tier 2). The last row is the selection.";
        table(html, caption, &head.map(str::to_owned), &[8], &rows);
    }

    fn responses_table(&self, html: &mut String) {
        let part = |value: Option<f64>| {
            value.map_or_else(|| "not recorded".to_owned(), |v| significant(100.0 * v, 3))
        };
        let rows: Vec<Vec<String>> = self
            .modes
            .static_responses
            .iter()
            .map(|one| {
                let selected = part(Some(one.selected_lack));
                vec![escape(one.load), selected, part(one.body_lacks), part(one.without_residual_vectors)]
            })
            .collect();
        let head = ["Load", "Selected modes, %", "Body, %", "Body without residual vectors, %"];
        let caption = "What modes lack of the static response, in the norm of K: the selected of that of the body, and the body of that of the model.";
        table(html, caption, &head.map(str::to_owned), &[], &rows);
    }

    fn modes_table(&self, html: &mut String) {
        let mut shares = self.modes.shares.clone();
        shares.sort_by(|a, b| b.stress.max(b.deflection).total_cmp(&a.stress.max(a.deflection)));
        let rows: Vec<Vec<String>> = shares
            .iter()
            .take(MODES_SHOWN)
            .map(|share| {
                vec![
                    share.number.to_string(),
                    significant(share.amplitude, 3),
                    significant(100.0 * share.deflection, 3),
                    significant(100.0 * share.stress, 3),
                    if share.kept { "kept" } else { "dropped" }.to_owned(),
                ]
            })
            .collect();
        let head = ["Mode", "Amplitude", "Deflection, %", "Stress, %", "Verdict"];
        let caption = format!(
            "Largest amplitude of the modes that do most, and what each does alone relative to all together ({} of {}).",
            rows.len(),
            self.modes.of
        );
        table(html, &caption, &head.map(str::to_owned), &[4], &rows);
    }
}
