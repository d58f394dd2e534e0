//! Report on a trade study: facts, verdict, candidates and the plot of error against cost.

use super::errors::{ReferenceErrorFacts, VariationFacts, ranges, reference_in_words, tolerances_in_words};
use super::integration::{NodalFacts, accuracy_key};
use super::trade_cases::{TradeCaseFacts, case_facts, cases_table};
use super::trade_verdict::{varied_line, verdict_lines};
use crate::chart::{Axis, Chart, Mark, Panel, Series};
use crate::document::{Block, Document, Format, Inline, Span, State, Table, Term, cells, heading};
use crate::notation::csv;
use crate::notation::numbers::{bytes, counted, duration, significant, times};
use crate::run_data::RunData;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::provenance::generator;
use flexbody_body::flex_body::Storage;
use flexbody_linalg::ties::first_largest;
use flexbody_motion::scene::{ModeStart, OutputErrors, Scheme, Tolerance};
use flexbody_study::reference::ReferenceError;
use flexbody_study::trade::{
    CandidateKind, InCase, LumpedMass, Measured, ReferenceKind, Timed, TimedRun, Trade, TradeCase, TradeRow,
};
use serde::Serialize;
use std::collections::BTreeMap;

/// Heading of a column, and its cell for a measured candidate.
type Column = (&'static str, fn(&MeasuredFacts<'_>) -> Inline);

/// Error of a body, for the choice among candidates.
const WORST: Column = ("Error / tolerance", |own| significant(own.worst, 3).into());
/// Cost of a body.
const COSTS: [Column; 2] = [
    ("Multiplications", |own| own.multiplications.to_string().into()),
    ("File", |own| bytes(own.file_bytes).into()),
];
/// Errors of a body.
const ERRORS: [Column; 5] = [
    ("Attitude (rad)", |own| number(own.errors.attitude)),
    ("Deflection", |own| number(own.errors.deflection)),
    ("Stress", |own| number(own.errors.stress)),
    ("Reaction", |own| number(own.errors.reaction)),
    (OF_RECOVERIES, |own| number(own.errors.recovery)),
];
/// Errors of recoveries, shown where a scene limits them.
const OF_RECOVERIES: &str = "Recovery / limit";
/// Cheapest run within the tolerances.
const RUN: [Column; 4] = [
    ("Step accuracy", |own| own.accuracy.clone().unwrap_or_else(none).into()),
    ("Simulation", |own| own.seconds.integration.map_or_else(none, duration).into()),
    (OF_THE_RUN, |own| number(own.runs.iter().map(|run| run.worst).max_by(f64::total_cmp))),
    ("Steps", |own| own.steps.map_or_else(none, |steps| steps.to_string()).into()),
];
const OF_THE_RUN: &str = "Error / tolerance of the run";
const PREPROCESSING: Column =
    ("Preprocessing", |own| own.seconds.preprocessing.map_or_else(none, duration).into());
const WORST_CASE: Column = ("Worst case", |own| own.case.unwrap_or_default().to_owned().into());

/// Columns that a page shows and a text does not.
const NOT_IN_TEXT: [&str; 3] = ["Basis", "Up to (Hz)", "Steps"];

/// Returns the sign for a quantity that is not known.
fn none() -> String {
    "\u{2013}".to_owned()
}

fn number(value: Option<f64>) -> Inline {
    value.map_or_else(none, |value| significant(value, 3)).into()
}

/// Meaning of the timed runs.
const RUNS: &str = "errors are those of the body, with the steps of the reference; the candidates of the front are also run \
                    with the cheapest accuracy of the time integration that meets what is left of the tolerances: step \
                    accuracy, time and error are those of this run";

/// Smallest error over tolerance on the plot; smaller errors are drawn at this value. A smaller value adds
/// decades to the axis.
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
    /// Integration of the equations of all nodes, if these are the reference; with several load cases that of
    /// the first case.
    nodal: Option<NodalFacts>,
    /// Errors of the body of row 1, and of its versions before enrichment, relative to the model; empty if
    /// only a body file is available. With several load cases those of the case with the largest error.
    #[serde(rename = "reference_lacks")]
    reference_errors: Vec<ReferenceErrorFacts>,
    /// Tolerance; with several load cases the smallest of each quantity.
    tolerance: Tolerance,
    allowed_multiplications: Option<usize>,
    /// The study in five lines, and the command.
    verdict: Vec<VerdictLine>,
    /// Command that makes exactly the recommended body; `None` if nothing is recommended, or if the inputs are not
    /// known by name.
    #[serde(skip_serializing_if = "Option::is_none")]
    command: Option<String>,
    recommended: Option<usize>,
    front: Vec<usize>,
    rows: Vec<RowFacts<'a>>,
    /// Facts of each load case, if there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    cases: Vec<TradeCaseFacts<'a>>,
    /// Errors of the recommended row in variations of the scene, which its body was not made for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    variations: Vec<VariationFacts<'a>>,
    /// Row that the scene alone would recommend, if that is another one.
    #[serde(skip_serializing_if = "Option::is_none")]
    recommended_in_scene: Option<usize>,
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

/// A candidate of the study.
#[derive(Debug, Clone, Serialize)]
struct RowFacts<'a> {
    number: usize,
    source: &'a str,
    kind: CandidateKind,
    modes: usize,
    /// Numbers of the modes, from 1.
    mode_numbers: Vec<usize>,
    last_frequency_hz: f64,
    groups: Vec<&'static str>,
    /// Scheme by which the mass of the candidate was lumped.
    lumped: Option<&'a str>,
    /// Lumped quantity: the `couplings` alone, or the `whole` mass before the modes were computed.
    lumped_part: Option<&'static str>,
    storage: &'static str,
    failed: Option<&'a Diagnostic>,
    measured: Option<MeasuredFacts<'a>>,
}

#[derive(Debug, Clone, Serialize)]
struct MeasuredFacts<'a> {
    /// Errors; with several load cases those of the case with the largest error relative to its tolerance.
    errors: OutputErrors,
    /// Largest ratio of error to tolerance.
    worst: f64,
    growth: Option<f64>,
    /// Name of the case that `errors` belong to.
    #[serde(skip_serializing_if = "Option::is_none")]
    case: Option<&'a str>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    by_case: Vec<f64>,
    /// Largest ratio of error to tolerance in each variation; `None` where the simulation stopped. Empty if the row was
    /// not judged on variations.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    by_variation: Vec<Option<f64>>,
    multiplications: usize,
    file_bytes: u64,
    /// Cheapest run within the tolerances in every load case; empty for candidates that are not on the front.
    runs: Vec<TimedRunFacts<'a>>,
    /// Number of integration steps of these runs; `None` for candidates that are not on the front.
    steps: Option<u64>,
    /// Accuracy of the integration in words, of the run with the largest ratio of error to tolerance.
    #[serde(skip)]
    accuracy: Option<String>,
    rejected_steps: Option<u64>,
    evaluations: Option<u64>,
    seconds: Seconds,
}

/// Run of a candidate: its integration, and the errors and the time of the same run.
#[derive(Debug, Clone, Serialize)]
struct TimedRunFacts<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    case: Option<&'a str>,
    method: &'static str,
    /// Largest error of a step of the adaptive method, relative to the motion.
    tolerance: Option<f64>,
    /// Step of the conserving method.
    step: Option<f64>,
    errors: OutputErrors,
    /// Largest ratio of error to tolerance.
    worst: f64,
    seconds: f64,
    steps: u64,
    /// Initial values of the modes of the candidate's own body, numbered from 1.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    initial_modes: Vec<ModeStartFacts>,
}

/// Initial value of a mode, as in `[initial]` of a scene.
#[derive(Debug, Clone, Copy, Serialize)]
struct ModeStartFacts {
    number: usize,
    amplitude: f64,
    rate: f64,
}

impl<'a> TimedRunFacts<'a> {
    fn new(run: &TimedRun, case: &'a TradeCase) -> Self {
        let (tolerance, step) = match run.scheme {
            Scheme::Adaptive { tolerance } => (Some(tolerance), None),
            Scheme::Conserving { step, .. } => (None, step),
        };
        let facts = |start: &ModeStart| ModeStartFacts {
            number: start.mode + 1,
            amplitude: start.amplitude,
            rate: start.rate,
        };
        Self {
            case: case.name.as_deref(),
            method: run.scheme.name(),
            tolerance,
            step,
            errors: run.errors.errors,
            worst: run.errors.worst,
            seconds: run.seconds,
            steps: run.work.steps,
            initial_modes: run.start.iter().map(facts).collect(),
        }
    }
}

/// Times of a candidate. Unit: s.
#[derive(Debug, Clone, Copy, Serialize)]
struct Seconds {
    preprocessing: Option<f64>,
    evaluation: Option<f64>,
    integration: Option<f64>,
}

impl<'a> MeasuredFacts<'a> {
    fn new(measured: &Measured, cases: &'a [TradeCase]) -> Self {
        let timed = measured.timed.as_ref();
        let InCase { errors, worst, growth } = *measured.decisive_case();
        let case = cases[measured.case].name.as_deref();
        let ratios = measured.by_case.iter().map(|own| own.worst);
        let work = timed.map(Timed::work);
        let runs = timed.iter().flat_map(|timed| timed.runs.iter().zip(cases));
        Self {
            errors,
            worst,
            growth,
            case,
            by_case: ratios.filter(|_| case.is_some()).collect(),
            by_variation: measured
                .varied
                .iter()
                .flat_map(|own| &own.by_variation)
                .map(|own| Some((*own)?.worst))
                .collect(),
            multiplications: measured.multiplications,
            file_bytes: measured.bytes,
            runs: runs.map(|(run, case)| TimedRunFacts::new(run, case)).collect(),
            accuracy: timed.map(|timed| accuracy_key(timed.decisive().scheme).replace(" = ", " ")),
            steps: work.map(|work| work.steps),
            rejected_steps: work.map(|work| work.rejected),
            evaluations: work.map(|work| work.rates),
            seconds: Seconds {
                preprocessing: measured.preprocessing,
                evaluation: timed.map(|timed| timed.evaluation),
                integration: timed.map(Timed::seconds),
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

    /// Returns the composition of the candidate: `6 modes, W1`, or `5 modes (1, 3-4, 7, 9), W1` if these are not
    /// the lowest modes.
    fn in_words(&self) -> String {
        let numbers =
            if self.lowest() { String::new() } else { format!(" ({})", ranges(&self.mode_numbers)) };
        let mut words = format!("{}{numbers}, {}", counted(self.modes, "mode"), self.groups_in_words());
        if let (Some(scheme), Some(part)) = (self.lumped, self.lumped_part) {
            words.push_str(&format!(", {scheme} {part}"));
        }
        if self.storage == Storage::F32.name() {
            words.push_str(", f32");
        }
        words
    }

    fn groups_in_words(&self) -> String {
        if self.groups.is_empty() { "I0 only".to_owned() } else { self.groups.join(" ") }
    }

    /// Returns true if the candidate has all modes up to its last.
    fn lowest(&self) -> bool {
        self.mode_numbers.last() == Some(&self.modes)
    }
}

impl<'a> TradeFacts<'a> {
    /// Collects the facts of a study and of the run that made it. `reference_errors` holds the errors of the reference
    /// relative to the model for each load case.
    pub fn new(trade: &'a Trade, reference_errors: &[Vec<ReferenceError>], run: &'a RunData) -> Self {
        let row = |(at, row): (usize, &'a TradeRow)| RowFacts::new(at + 1, row, &trade.cases);
        let rows: Vec<RowFacts<'a>> = trade.rows.iter().enumerate().map(row).collect();
        let rounds = worst_reference_errors(reference_errors);
        let mut facts = Self {
            format: "flexbody-trade",
            format_major: 2,
            format_minor: 1,
            generator: generator(),
            scene: &trade.scene,
            body: &trade.body,
            reference: trade.reference,
            nodal: trade.cases[0].nodal.as_ref().map(NodalFacts::new),
            reference_errors: rounds.iter().map(ReferenceErrorFacts::new).collect(),
            tolerance: trade.tolerance,
            allowed_multiplications: trade.allowed,
            verdict: Vec::new(),
            command: None,
            recommended: trade.recommended.row().map(|row| row + 1),
            front: trade.front.iter().map(|row| row + 1).collect(),
            rows,
            cases: case_facts(trade, reference_errors),
            variations: VariationFacts::of_trade(trade),
            recommended_in_scene: trade
                .in_scene
                .row()
                .filter(|_| trade.in_scene != trade.recommended)
                .map(|row| row + 1),
            diagnostics: &run.diagnostics,
            threads: run.threads,
            wall_seconds: run.wall_seconds(),
            cpu_seconds: run.cpu_seconds(),
        };
        let names = facts.names();
        let is_nodal = trade.cases.iter().any(|case| case.nodal.is_some());
        let reference_error = rounds.last().filter(|own| !is_nodal && !own.is_reference());
        let lines = verdict_lines(trade, &names, &facts.tolerances_in_words(), reference_error).into_iter();
        let in_variations = varied_line(trade, &facts.variations, &names).map(|text| ("Variations", text));
        facts.verdict = lines.chain(in_variations).map(|(label, text)| VerdictLine { label, text }).collect();
        facts
    }

    /// Adds the command that makes exactly the recommended body.
    pub fn with_command(mut self, command: String) -> Self {
        self.verdict.push(VerdictLine { label: "Command", text: command.clone() });
        Self { command: Some(command), ..self }
    }

    /// Returns the names of all rows. Candidates that would read alike have their source and, if that is not enough,
    /// the numbers of their modes in their names.
    fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = self.rows.iter().map(RowFacts::in_words).collect();
        let details: [&dyn Fn(&RowFacts<'a>) -> String; 2] =
            [&|row| format!(", of: {}", row.source), &|row| {
                format!(", numbers {}", ranges(&row.mode_numbers))
            }];
        for detail in details {
            let mut count = BTreeMap::<String, usize>::new();
            names.iter().for_each(|name| *count.entry(name.clone()).or_default() += 1);
            for (name, row) in names.iter_mut().zip(&self.rows) {
                if count[name.as_str()] > 1 {
                    name.push_str(&detail(row));
                }
            }
        }
        names
    }

    /// Renders the facts in a format, ending with a line break.
    pub fn render(&self, format: Format) -> String {
        Document::render(self, format, || self.document())
    }

    fn tolerances_in_words(&self) -> String {
        tolerances_in_words(&self.tolerance.errors)
    }

    fn against(&self) -> &'static str {
        match self.reference {
            ReferenceKind::Full => "the whole body",
            ReferenceKind::Nodal => "the motion of all nodes",
        }
    }

    /// Returns the rows of the front and the recommended row, ascending in cost.
    fn shown(&self) -> Vec<&RowFacts<'a>> {
        let mut numbers = self.front.clone();
        // A recommended row of equal cost and error to a row of the front is not on the front itself.
        numbers.extend(self.recommended.filter(|row| !self.front.contains(row)));
        let cost = |row: &RowFacts<'a>| row.measured.as_ref().map(|measured| measured.multiplications);
        let mut rows: Vec<_> = numbers.iter().map(|number| &self.rows[number - 1]).collect();
        rows.sort_by_key(|row| cost(row));
        rows
    }

    fn document(&self) -> Document<'_> {
        let mut blocks = self.verdict();
        let names = self.names();
        let cases = self.cases.iter().map(|case| Term::text("Load cases", case.in_words(&names)));
        blocks.push(Block::Terms(cases.collect()));
        blocks.extend([heading("Comparison"), Block::Terms(self.compared())]);
        if !self.cases.is_empty() {
            blocks.extend([heading("Load cases"), Block::Table(cases_table(&self.cases, &names))]);
        }
        blocks.push(heading("Error against cost"));
        blocks.extend(self.chart().map(Block::Chart));
        let case = (!self.cases.is_empty()).then_some(WORST_CASE);
        let of_runs: Vec<Column> = COSTS.into_iter().chain([WORST]).chain(RUN).chain(case).collect();
        let caption = "Candidates for which no other is both cheaper and more accurate";
        let front = self.table(caption, &self.shown(), &of_runs);
        let front = Block::Table(front.in_text(|head| !NOT_IN_TEXT.contains(&head)));
        blocks.extend([Block::Gap, heading("Pareto front"), front, Block::Gap]);
        // A body read from a file is the only source, and the time of its preprocessing is unknown.
        let preprocessing = self.has_several_sources().then_some(PREPROCESSING);
        let has_limits = self.tolerance.errors.recovery.is_finite();
        let errors = ERRORS.into_iter().filter(|(head, _)| has_limits || *head != OF_RECOVERIES);
        let of_bodies = COSTS.into_iter().chain(preprocessing).chain(errors).chain([WORST]).chain(case);
        let every_row: Vec<_> = self.rows.iter().collect();
        let caption = "All candidates in the order of their simulation";
        let all = self.table(caption, &every_row, &of_bodies.collect::<Vec<_>>());
        blocks.extend([heading("All candidates"), Block::Table(all), Block::Terms(self.work())]);
        blocks.push(Block::Diagnostics(self.diagnostics));
        Document { name: self.scene, kind: "Trade study", generator: &self.generator, blocks }
    }

    /// Returns the verdict. A page omits the recommendation here because its head already shows it.
    fn verdict<'b>(&self) -> Vec<Block<'b>> {
        let count = counted(self.rows.len(), "candidate");
        let title = format!("{}: {}, {count} compared with {}", self.scene, self.body, self.against());
        let mut terms = vec![Term::text("Trade", title)];
        terms.extend(self.verdict.iter().enumerate().map(|(i, line)| match i {
            1 => Term::text(line.label, line.text.as_str()),
            _ => Term::new(line.label, line.text.as_str()),
        }));
        let state = if self.recommended.is_some() { State::Good } else { State::Open };
        let taken = self.verdict.get(1).map(|line| format!("{}: {}.", line.label, line.text));
        let head = taken.map(|head| Block::Verdict { state, head, rest: String::new() });
        head.into_iter().chain([Block::Terms(terms)]).collect()
    }

    fn compared(&self) -> Vec<Term> {
        let reference = match &self.nodal {
            None => Term::page("Reference", self.against()),
            Some(nodal) => {
                let words = nodal.in_words();
                Term::new("Reference", format!("{}: {words}", self.against())).in_text("Nodes", words)
            }
        };
        let candidates =
            format!("{}, each integrated with the method and the step of the reference", self.rows.len());
        vec![
            Term::page("Body", self.body),
            reference,
            Term::new("Whole body", reference_in_words(&self.reference_errors)),
            Term::page("Tolerances", self.tolerances_in_words()),
            Term::page("Candidates", candidates),
            Term::page("Cost", "multiplications of one evaluation of the equations of motion"),
            Term::page("Runs", RUNS),
            Term::page("Time", self.time_in_words()),
        ]
    }

    fn time_in_words(&self) -> String {
        format!("{}, {}", times(self.wall_seconds, self.cpu_seconds), counted(self.threads, "thread"))
    }

    /// Returns the number of failures and the times, at the end of a text.
    fn work(&self) -> Vec<Term> {
        let failed = self.rows.iter().filter(|row| row.failed.is_some()).count();
        let why = format!("{}: see --json or --report for the reasons", counted(failed, "candidate"));
        let failed = (failed > 0).then(|| Term::text("Failed", why));
        failed.into_iter().chain([Term::text("Time", self.time_in_words())]).collect()
    }

    /// Returns the chart of error against cost; `None` if nothing was measured.
    fn chart(&self) -> Option<Chart> {
        let point = |number: usize| {
            let measured = self.rows[number - 1].measured.as_ref()?;
            Some([measured.multiplications as f64, measured.worst.max(NO_ERROR)])
        };
        let of_kind = |(i, kind): (usize, &CandidateKind)| {
            let rows = self.rows.iter().filter(|row| row.kind == *kind);
            let (points, titles) = rows
                .filter_map(|row| Some((point(row.number)?, format!("{}: {}", row.number, row.in_words()))))
                .unzip();
            let mark = [Mark::Disc, Mark::Square, Mark::Triangle, Mark::Circle][i % 4];
            Series { titles, ..Series::new(kind.name(), mark, i, points) }
        };
        let mut series: Vec<Series> = CandidateKind::ALL.iter().enumerate().map(of_kind).collect();
        let measured = || series.iter().flat_map(|own| &own.points);
        let most = self.allowed_multiplications.map(|most| most as f64);
        let costs = measured().map(|point| point[0]).chain(most);
        let x = Axis::decades("multiplications per evaluation", costs, f64::INFINITY)?;
        // The range of the axis always includes the tolerance.
        let errors = measured().map(|point| point[1]).chain([1.0]);
        let y = Axis::decades("largest error / tolerance", errors, f64::INFINITY)?;
        let front = self.front.iter().filter_map(|&number| point(number)).collect();
        let ring = self.recommended.and_then(point).into_iter().collect();
        let allowed = x.ends().map(|cost| [cost, 1.0]).to_vec();
        series.insert(0, Series::new("tolerance", Mark::Line, 1, allowed));
        series.extend(
            most.map(|most| Series::new("", Mark::Line, 1, y.ends().map(|error| [most, error]).to_vec())),
        );
        series.insert(0, Series::new("Pareto front", Mark::Line, 0, front));
        series.push(Series::new("recommended", Mark::Ring, 0, ring));
        let title = "Largest ratio of error to tolerance against multiplications per evaluation".to_owned();
        Some(Chart { title, x, panels: vec![Panel { caption: String::new(), y, height: 330.0, series }] })
    }

    fn has_several_sources(&self) -> bool {
        self.rows.iter().any(|row| row.source != self.rows[0].source)
    }

    fn table(&self, caption: &str, rows: &[&RowFacts<'a>], columns: &[Column]) -> Table {
        let several = self.has_several_sources();
        let mut heads = vec!["No.", "Candidate"];
        heads.extend(several.then_some("Basis"));
        heads.push("Up to (Hz)");
        heads.extend(columns.iter().map(|column| column.0));
        let row = |row: &&RowFacts<'a>| {
            let taken = if self.recommended == Some(row.number) { ">\u{a0}" } else { "" };
            let mut row_cells = cells([format!("{taken}{}", row.number), row.in_words()]);
            row_cells.extend(several.then(|| row.source.into()));
            row_cells.push(significant(row.last_frequency_hz, 5).into());
            match (&row.measured, row.failed) {
                (Some(measured), _) => row_cells.extend(columns.iter().map(|column| (column.1)(measured))),
                (None, failed) => {
                    let message = failed.map_or("", |diagnostic| diagnostic.message());
                    row_cells.push(Span::Error(message.to_owned()).into());
                }
            }
            row_cells.resize(heads.len(), Inline::default());
            row_cells
        };
        let rows = rows.iter().map(row).collect();
        Table::new(caption, heads.iter().copied(), if several { &[0, 1, 2] } else { &[0, 1] }, rows)
    }
}

/// Returns the errors of the reference in the load case with the largest last error.
fn worst_reference_errors(reference_errors: &[Vec<ReferenceError>]) -> &[ReferenceError] {
    let last = |rounds: &&Vec<ReferenceError>| rounds.last().map_or(-1.0, |own| own.worst);
    let worst = first_largest(reference_errors, |rounds| last(rounds));
    worst.map_or(&[], Vec::as_slice)
}

/// Returns the smallest of a quantity of the runs of a candidate.
fn finest(measured: Option<&MeasuredFacts<'_>>, of: fn(&TimedRunFacts<'_>) -> Option<f64>) -> Option<f64> {
    measured?.runs.iter().filter_map(of).min_by(f64::total_cmp)
}

/// Returns the study as comma-separated values with one row per candidate; numbers round-trip.
pub fn trade_csv(trade: &Trade) -> String {
    let mut table = "number,source,kind,modes,last_frequency_hz,groups,lumped,lumped_part,storage,multiplications,evaluation_seconds,\
                   integration_seconds,preprocessing_seconds,steps,run_tolerance,run_step,run_worst,file_bytes,attitude,deflection,stress,reaction,recovery,worst,\
                   case,on_front,recommended,failed\n"
        .to_owned();
    for (at, row) in trade.rows.iter().enumerate() {
        let facts = RowFacts::new(at + 1, row, &trade.cases);
        let m = facts.measured.as_ref();
        let errors = m.map(|m| m.errors).unwrap_or_default();
        let count = |number: fn(&MeasuredFacts<'_>) -> Option<u64>| {
            m.and_then(number).map_or_else(String::new, |value| value.to_string())
        };
        let cells = [
            facts.number.to_string(),
            csv::text(facts.source),
            csv::text(facts.kind.name()),
            facts.modes.to_string(),
            csv::number(facts.last_frequency_hz),
            facts.groups.join(" "),
            csv::text(facts.lumped.unwrap_or_default()),
            facts.lumped_part.unwrap_or_default().to_owned(),
            facts.storage.to_owned(),
            count(|m| Some(m.multiplications as u64)),
            csv::number(m.and_then(|m| m.seconds.evaluation)),
            csv::number(m.and_then(|m| m.seconds.integration)),
            csv::number(m.and_then(|m| m.seconds.preprocessing)),
            count(|m| m.steps),
            csv::number(finest(m, |run| run.tolerance)),
            csv::number(finest(m, |run| run.step)),
            csv::number(m.and_then(|m| m.runs.iter().map(|run| run.worst).max_by(f64::total_cmp))),
            count(|m| Some(m.file_bytes)),
            csv::number(errors.attitude),
            csv::number(errors.deflection),
            csv::number(errors.stress),
            csv::number(errors.reaction),
            csv::number(errors.recovery),
            csv::number(m.map(|m| m.worst)),
            csv::text(m.and_then(|m| m.case).unwrap_or_default()),
            trade.front.contains(&at).to_string(),
            (trade.recommended.row() == Some(at)).to_string(),
            csv::text(facts.failed.map_or("", |failed| failed.message())),
        ];
        csv::push_row(&mut table, cells);
    }
    table
}
