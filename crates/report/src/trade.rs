//! What a user reads of a trade study: facts, the compact summary, the table and the page with the plot.

use super::Format;
use super::errors_in_words::errors_in_words;
use super::lacks::{LackFacts, reference_in_words};
use super::markup::{diagnostics_table, escape, page, section, table, terms};
use super::numbers::{bytes, counted, duration, plain, significant};
use super::render::json;
use super::run_data::RunData;
use super::scatter_chart::{Chart, Series, scatter_chart};
use super::text::{Page, diagnostics_lines};
use super::trade_cases::{TradeCaseFacts, case_facts, cases_table};
use super::trade_nodes::NodalFacts;
use super::trade_verdict::verdict_lines;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::provenance::generator;
use flexbody_body::flex_body::Storage;
use flexbody_motion::scene::{OutputErrors, Tolerance};
use flexbody_study::reference::ReferenceError;
use flexbody_study::trade::{
    CandidateKind, InCase, LumpedMass, Measured, ReferenceKind, Trade, TradeCase, TradeRow,
};
use serde::Serialize;
use std::fmt::Write;

/// Errors below this part of the tolerance are none on the plot.
const NO_ERROR: f64 = 1e-6;

/// Facts of a trade study.
#[derive(Debug, Clone, Serialize)]
pub struct TradeFacts<'a> {
    format: &'static str,
    format_major: u8,
    format_minor: u8,
    generator: String,
    scene: &'a str,
    body: &'a str,
    reference: ReferenceKind,
    /// How the equations of all nodes were integrated, where they are the reference; of several load cases in
    /// the first.
    nodal: Option<NodalFacts>,
    /// What the body of row 1, and those before it that were enriched, lack of the model; nothing where only
    /// a file is at hand. Of several load cases in that where it is most.
    reference_lacks: Vec<LackFacts>,
    /// Of several load cases the least of any.
    tolerance: Tolerance,
    allowed_multiplications: Option<usize>,
    /// The study in five lines.
    verdict: Vec<VerdictLine>,
    recommended: Option<usize>,
    front: Vec<usize>,
    rows: Vec<RowFacts<'a>>,
    /// What belongs to each load case, where there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    cases: Vec<TradeCaseFacts<'a>>,
    diagnostics: &'a [Diagnostic],
    threads: usize,
    wall_seconds: f64,
    cpu_seconds: f64,
}

/// A line of the verdict.
#[derive(Debug, Clone, Serialize)]
struct VerdictLine {
    label: &'static str,
    text: String,
}

/// A candidate.
#[derive(Debug, Clone, Serialize)]
struct RowFacts<'a> {
    number: usize,
    source: &'a str,
    kind: CandidateKind,
    modes: usize,
    /// From 1.
    mode_numbers: Vec<usize>,
    last_frequency_hz: f64,
    groups: Vec<&'static str>,
    /// Scheme by which its mass was lumped.
    lumped: Option<&'a str>,
    /// What was lumped: the `couplings`, or the `whole` mass before the modes were computed.
    lumped_part: Option<&'static str>,
    storage: &'static str,
    failed: Option<&'a Diagnostic>,
    measured: Option<MeasuredFacts<'a>>,
}

#[derive(Debug, Clone, Serialize)]
struct MeasuredFacts<'a> {
    /// Of several load cases in that where they are largest beside the tolerances.
    errors: OutputErrors,
    /// Largest ratio of error to tolerance.
    worst: f64,
    growth: Option<f64>,
    /// This case, and the largest ratio in each.
    #[serde(skip_serializing_if = "Option::is_none")]
    case: Option<&'a str>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    by_case: Vec<f64>,
    multiplications: usize,
    file_bytes: u64,
    /// Nothing of candidates that are not on the front.
    steps: Option<u64>,
    rejected_steps: Option<u64>,
    evaluations: Option<u64>,
    seconds: Seconds,
}

/// Unit: s.
#[derive(Debug, Clone, Copy, Serialize)]
struct Seconds {
    preprocessing: Option<f64>,
    evaluation: Option<f64>,
    integration: Option<f64>,
}

impl<'a> MeasuredFacts<'a> {
    fn new(measured: &Measured, cases: &'a [TradeCase]) -> Self {
        let timed = measured.timed.as_ref();
        let InCase { errors, worst, growth } = *measured.deciding();
        let case = cases[measured.case].name.as_deref();
        let ratios = measured.by_case.iter().map(|own| own.worst);
        Self {
            errors,
            worst,
            growth,
            case,
            by_case: ratios.filter(|_| case.is_some()).collect(),
            multiplications: measured.multiplications,
            file_bytes: measured.bytes,
            steps: timed.map(|timed| timed.work.steps),
            rejected_steps: timed.map(|timed| timed.work.rejected),
            evaluations: timed.map(|timed| timed.work.rates),
            seconds: Seconds {
                preprocessing: measured.preprocessing,
                evaluation: timed.map(|timed| timed.evaluation),
                integration: timed.map(|timed| timed.integration),
            },
        }
    }
}

impl<'a> RowFacts<'a> {
    fn new(number: usize, row: &'a TradeRow, cases: &'a [TradeCase]) -> Self {
        let candidate = &row.candidate;
        Self {
            number,
            source: &row.source,
            kind: candidate.kind(),
            modes: candidate.modes.len(),
            mode_numbers: candidate.modes.iter().map(|mode| mode + 1).collect(),
            last_frequency_hz: row.last_frequency_hz,
            groups: candidate.group_names(),
            lumped: candidate.lumped.as_ref().map(LumpedMass::scheme),
            lumped_part: candidate.lumped.as_ref().map(LumpedMass::part),
            storage: candidate.storage.name(),
            failed: row.outcome.as_ref().err().map(|failed| &failed.0),
            measured: row.outcome.as_ref().ok().map(|measured| MeasuredFacts::new(measured, cases)),
        }
    }

    /// `6 modes, W1`: what it has, in words.
    fn in_words(&self) -> String {
        let mut words = format!("{}, {}", counted(self.modes, "mode"), self.groups_in_words());
        if !self.lowest() {
            words.push_str(", not the lowest");
        }
        if let (Some(scheme), Some(part)) = (self.lumped, self.lumped_part) {
            let _ = write!(words, ", {} {part}", plain(scheme));
        }
        if self.storage == Storage::F32.name() {
            words.push_str(", f32");
        }
        words
    }

    fn groups_in_words(&self) -> String {
        if self.groups.is_empty() { "no group".to_owned() } else { self.groups.join(" ") }
    }

    /// Whether it has all modes up to its last.
    fn lowest(&self) -> bool {
        self.mode_numbers.last() == Some(&self.modes)
    }
}

impl<'a> TradeFacts<'a> {
    /// Facts of a study whose reference `lacks` something of the model in each load case, and of the run that
    /// made it.
    pub fn new(trade: &'a Trade, lacks: &[Vec<ReferenceError>], run: &'a RunData) -> Self {
        let row = |(at, row): (usize, &'a TradeRow)| RowFacts::new(at + 1, row, &trade.cases);
        let rows: Vec<RowFacts<'a>> = trade.rows.iter().enumerate().map(row).collect();
        let rounds = worst_lacks(lacks);
        let mut facts = Self {
            format: "flexbody-trade",
            format_major: 2,
            format_minor: 0,
            generator: generator(),
            scene: &trade.scene,
            body: &trade.body,
            reference: trade.reference,
            nodal: trade.cases[0].nodal.as_ref().map(NodalFacts::new),
            reference_lacks: rounds.iter().map(LackFacts::new).collect(),
            tolerance: trade.tolerance,
            allowed_multiplications: trade.allowed,
            verdict: Vec::new(),
            recommended: trade.recommended.row().map(|row| row + 1),
            front: trade.front.iter().map(|row| row + 1).collect(),
            rows,
            cases: case_facts(trade, lacks),
            diagnostics: &run.diagnostics,
            threads: run.threads,
            wall_seconds: run.phases.iter().map(|phase| phase.wall_seconds).sum(),
            cpu_seconds: run.phases.iter().map(|phase| phase.cpu_seconds).sum(),
        };
        let names = facts.names();
        let is_nodal = trade.cases.iter().any(|case| case.nodal.is_some());
        let lacking = rounds.last().filter(|own| !is_nodal && !own.is_reference());
        let lines = verdict_lines(trade, &names, &facts.tolerances_in_words(), lacking).into_iter();
        facts.verdict = lines.map(|(label, text)| VerdictLine { label, text }).collect();
        facts
    }

    fn names(&self) -> Vec<String> {
        self.rows.iter().map(RowFacts::in_words).collect()
    }

    /// The facts in a format, ending with a line break.
    pub fn render(&self, format: Format) -> String {
        match format {
            Format::Json => json(self),
            Format::Text => self.text(),
            Format::Html => self.html(),
        }
    }

    fn tolerances_in_words(&self) -> String {
        errors_in_words(&self.tolerance.errors.map(Some))
    }

    fn against(&self) -> &'static str {
        match self.reference {
            ReferenceKind::Full => "the whole body",
            ReferenceKind::Nodal => "the motion of all nodes",
        }
    }

    fn reference_told(&self) -> String {
        match &self.nodal {
            None => self.against().to_owned(),
            Some(nodal) => format!("{}: {}", self.against(), nodal.in_words()),
        }
    }

    /// Rows of the front, and the recommended one, ascending in cost.
    fn shown(&self) -> Vec<&RowFacts<'a>> {
        let mut numbers = self.front.clone();
        // One that is as cheap and as good as a row of the front is not on it.
        numbers.extend(self.recommended.filter(|row| !self.front.contains(row)));
        let cost = |row: &RowFacts<'a>| row.measured.as_ref().map(|measured| measured.multiplications);
        let mut rows: Vec<_> = numbers.iter().map(|number| &self.rows[number - 1]).collect();
        rows.sort_by_key(|row| cost(row));
        rows
    }

    fn text(&self) -> String {
        let mut page = Page(String::new());
        let count = counted(self.rows.len(), "candidate");
        page.entry(
            "Trade",
            &format!("{}: {}, {count} against {}", plain(self.scene), plain(self.body), self.against()),
        );
        for line in &self.verdict {
            page.entry(line.label, &line.text);
        }
        let names = self.names();
        for (i, case) in self.cases.iter().enumerate() {
            page.entry(if i == 0 { "Load cases" } else { "" }, &case.in_words(&names));
        }
        if let Some(nodal) = &self.nodal {
            page.entry("Nodes", &nodal.in_words());
        }
        page.entry("Whole body", &reference_in_words(&self.reference_lacks));
        page.0.push_str("\n  multiplications  evaluation  simulation      file  error/tol  what\n");
        for row in self.shown() {
            let Some(measured) = &row.measured else { continue };
            let taken = if self.recommended == Some(row.number) { '>' } else { ' ' };
            let _ = writeln!(
                page.0,
                "{taken} {:>15}  {:>10}  {:>10}  {:>8}  {:>9}  {}",
                measured.multiplications,
                measured.seconds.evaluation.map_or_else(String::new, short),
                measured.seconds.integration.map_or_else(String::new, duration),
                bytes(measured.file_bytes),
                significant(measured.worst, 3),
                row.in_words()
            );
        }
        page.0.push('\n');
        let failed = self.rows.iter().filter(|row| row.failed.is_some()).count();
        if failed > 0 {
            page.entry("Failed", &format!("{}: --json and --report say why", counted(failed, "candidate")));
        }
        let (wall, cpu) = (duration(self.wall_seconds), duration(self.cpu_seconds));
        page.entry("Time", &format!("{wall} wall, {cpu} CPU, {}", counted(self.threads, "thread")));
        diagnostics_lines(&mut page, self.diagnostics);
        page.0
    }

    fn html(&self) -> String {
        let mut html = String::new();
        let class = if self.recommended.is_some() { "" } else { " open" };
        let [asked, taken, rest @ ..] = &self.verdict[..] else { return html };
        let _ = writeln!(
            html,
            "<p class=\"verdict{class}\"><strong>{}: {}.</strong></p>",
            taken.label,
            escape(&taken.text)
        );
        terms(&mut html, [asked].into_iter().chain(rest).map(|line| (line.label, escape(&line.text))));
        section(&mut html, "What is compared");
        terms(
            &mut html,
            [
                ("Body", escape(self.body)),
                ("Reference", self.reference_told()),
                ("Whole body", escape(&reference_in_words(&self.reference_lacks))),
                ("Tolerances", escape(&self.tolerances_in_words())),
                (
                    "Candidates",
                    format!(
                        "{}, each integrated with the method and the step of the reference",
                        self.rows.len()
                    ),
                ),
                ("Cost", "multiplications of one evaluation of the equations of motion".to_owned()),
                (
                    "Time",
                    format!(
                        "{} wall, {} CPU, {}",
                        duration(self.wall_seconds),
                        duration(self.cpu_seconds),
                        counted(self.threads, "thread")
                    ),
                ),
            ],
        );
        if !self.cases.is_empty() {
            section(&mut html, "Load cases");
            cases_table(&mut html, &self.cases, &self.names());
        }
        section(&mut html, "Error against cost");
        html.push_str(&self.chart());
        section(&mut html, "Pareto front");
        self.table(&mut html, "No other candidate is as cheap and as accurate", &self.shown());
        section(&mut html, "All candidates");
        self.table(&mut html, "In the order in which they were tried", &self.rows.iter().collect::<Vec<_>>());
        diagnostics_table(&mut html, self.diagnostics);
        page(self.scene, "Trade study", &self.generator, &html)
    }

    fn chart(&self) -> String {
        let point = |number: usize| {
            let measured = self.rows[number - 1].measured.as_ref()?;
            Some((measured.multiplications as f64, measured.worst))
        };
        let series = |kind: CandidateKind| {
            let rows = self.rows.iter().filter(move |row| row.kind == kind);
            let named = rows.filter_map(|row| {
                let (cost, error) = point(row.number)?;
                Some((format!("{}: {}", row.number, row.in_words()), cost, error))
            });
            Series { name: kind.name(), points: named.collect() }
        };
        let chart = Chart {
            title: "Largest ratio of error to tolerance against multiplications per evaluation",
            x: "multiplications per evaluation",
            y: "largest error / tolerance",
            front: self.front.iter().filter_map(|&number| point(number)).collect(),
            ring: self.recommended.and_then(point),
            most: self.allowed_multiplications.map(|most| most as f64),
            floor: NO_ERROR,
        };
        scatter_chart(&chart, &CandidateKind::ALL.map(series))
    }

    fn table(&self, html: &mut String, caption: &str, rows: &[&RowFacts<'a>]) {
        // A body alone is one source, and nobody knows how long it took to make.
        let several = self.rows.iter().any(|row| row.source != self.rows[0].source);
        let none = || "&ndash;".to_owned();
        let optional = |value: Option<f64>| value.map_or_else(none, |v| significant(v, 3));
        let made_in = |m: &MeasuredFacts<'_>| m.seconds.preprocessing.map_or_else(none, duration);
        let mut head = vec!["No.", "What"];
        head.extend(several.then_some("Of"));
        head.extend(["To (Hz)", "Multiplications", "Evaluation", "Simulation", "Steps", "File"]);
        head.extend(several.then_some("Made in"));
        head.extend(["Attitude (rad)", "Deflection", "Stress", "Reaction", "Error / tolerance"]);
        head.extend((!self.cases.is_empty()).then_some("Worst case"));
        let cells = |row: &&RowFacts<'a>| {
            let take = if self.recommended == Some(row.number) { "&#9654;&nbsp;" } else { "" };
            let mut cells =
                vec![format!("{take}{}", row.number), escape(&row.in_words()).replace(' ', "&nbsp;")];
            cells.extend(several.then(|| escape(row.source)));
            cells.push(significant(row.last_frequency_hz, 5));
            match (&row.measured, row.failed) {
                (Some(m), _) => {
                    cells.extend([
                        m.multiplications.to_string(),
                        m.seconds.evaluation.map_or_else(none, short),
                        m.seconds.integration.map_or_else(none, duration),
                        m.steps.map_or_else(none, |steps| steps.to_string()),
                        bytes(m.file_bytes),
                    ]);
                    cells.extend(several.then(|| made_in(m)));
                    cells.extend(m.errors.named().map(|(_, error)| optional(error)));
                    cells.push(significant(m.worst, 3));
                    cells.extend(m.case.map(escape));
                }
                (None, failed) => {
                    let message = failed.map_or("", |diagnostic| diagnostic.message());
                    cells.push(format!("<span class=\"error\">{}</span>", escape(message)));
                    cells.extend(std::iter::repeat_n(String::new(), head.len() - cells.len()));
                }
            }
            cells
        };
        let rows: Vec<Vec<String>> = rows.iter().map(cells).collect();
        let head: Vec<String> = head.iter().map(|cell| (*cell).to_owned()).collect();
        table(html, caption, &head, if several { &[1, 2] } else { &[1] }, &rows);
    }
}

/// What the reference lacks in the load case where it lacks most at last.
fn worst_lacks(lacks: &[Vec<ReferenceError>]) -> &[ReferenceError] {
    let last = |rounds: &&Vec<ReferenceError>| rounds.last().map_or(-1.0, |own| own.worst);
    // The first of equals.
    let worst = lacks.iter().rev().max_by(|a, b| last(a).total_cmp(&last(b)));
    worst.map_or(&[], Vec::as_slice)
}

/// A short time.
fn short(seconds: f64) -> String {
    if seconds < 1e-6 {
        format!("{} ns", significant(1e9 * seconds, 3))
    } else {
        format!("{} us", significant(1e6 * seconds, 3))
    }
}

/// The study as a table of comma-separated values, a row for every candidate; numbers round-trip.
pub fn trade_csv(trade: &Trade) -> String {
    let mut out = "number,source,kind,modes,last_frequency_hz,groups,lumped,lumped_part,storage,multiplications,evaluation_seconds,\
                   integration_seconds,preprocessing_seconds,steps,file_bytes,attitude,deflection,stress,reaction,worst,\
                   case,on_front,recommended,failed\n"
        .to_owned();
    for (at, row) in trade.rows.iter().enumerate() {
        let facts = RowFacts::new(at + 1, row, &trade.cases);
        let text = |text: &str| super::simulation::csv_cell(text);
        let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:e}"));
        let m = facts.measured.as_ref();
        let errors = m.map(|m| m.errors).unwrap_or_default();
        let count = |number: fn(&MeasuredFacts<'_>) -> Option<u64>| {
            m.and_then(number).map_or_else(String::new, |value| value.to_string())
        };
        let cells = [
            facts.number.to_string(),
            text(facts.source),
            text(facts.kind.name()),
            facts.modes.to_string(),
            number(Some(facts.last_frequency_hz)),
            facts.groups.join(" "),
            text(facts.lumped.unwrap_or_default()),
            facts.lumped_part.unwrap_or_default().to_owned(),
            facts.storage.to_owned(),
            count(|m| Some(m.multiplications as u64)),
            number(m.and_then(|m| m.seconds.evaluation)),
            number(m.and_then(|m| m.seconds.integration)),
            number(m.and_then(|m| m.seconds.preprocessing)),
            count(|m| m.steps),
            count(|m| Some(m.file_bytes)),
            number(errors.attitude),
            number(errors.deflection),
            number(errors.stress),
            number(errors.reaction),
            number(m.map(|m| m.worst)),
            text(m.and_then(|m| m.case).unwrap_or_default()),
            trade.front.contains(&at).to_string(),
            (trade.recommended.row() == Some(at)).to_string(),
            text(facts.failed.map_or("", |failed| failed.message())),
        ];
        out.push_str(&cells.join(","));
        out.push('\n');
    }
    out
}
