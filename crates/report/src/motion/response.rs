//! Report on a frequency response: facts, verdict, errors and plots.

use super::random::RandomFacts;
use crate::chart::{Axis, Chart, Mark, Panel, Scale, Series};
use crate::document::{Block, Document, Format, Inline, State, Table, Term, cells, heading};
use crate::notation::csv;
use crate::notation::numbers::{counted, frequency, frequency_range, percent, significant, times};
use crate::notation::units::UnitFacts;
use crate::run_data::RunData;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::provenance::generator;
use flexbody_base::units::UnitSystem;
use flexbody_linalg::ties::descending;
use flexbody_study::response::{
    At, Complex, Direction, Effectivity, Function, Output, Pair, Response, ResponseSettings, Spacing,
};
use libm::{atan2, hypot};
use serde::Serialize;

/// Number of plots per pair of places: the functions with the largest accelerances. More plots make the page
/// longer.
const PLOTS: usize = 3;

/// Number of pairs that are plotted. More pairs make the page longer.
const PLOTTED_PAIRS: usize = 8;

/// Largest number of decades on a vertical axis; values below the upper decades are cut off.
const MOST_DECADES: f64 = 10.0;

/// Facts of a frequency response.
#[derive(Debug, Clone, Serialize)]
pub struct ResponseFacts<'a> {
    format: &'static str,
    format_major: u8,
    format_minor: u8,
    generator: String,
    body: &'a str,
    units: UnitFacts,
    modes: usize,
    damped: bool,
    band_hz: [f64; 2],
    tolerance: f64,
    verdict: String,
    /// Result of the comparison with the tolerance; `None` if no error is known.
    passed: Option<bool>,
    body_modes_in_band: usize,
    solved: Option<SolvedFacts>,
    /// Effect of the rigid interfaces; `None` if the body has no rigid interface.
    coupling: Option<CouplingFacts<'a>>,
    frequencies_hz: &'a [f64],
    pairs: Vec<PairFacts>,
    /// Root mean squares under random excitation; `None` without spectral densities.
    #[serde(skip_serializing_if = "Option::is_none")]
    random: Option<RandomFacts>,
    diagnostics: &'a [Diagnostic],
    threads: usize,
    wall_seconds: f64,
    cpu_seconds: f64,
    #[serde(skip)]
    logarithmic: bool,
}

/// Size and cost of the solved equations of all nodes.
#[derive(Debug, Clone, Copy, Serialize)]
struct SolvedFacts {
    rows: usize,
    solves: usize,
    flops: f64,
    modes_in_band: usize,
}

/// Rigid interfaces, which are rigid in the compared model as well, and their effect on the response of the
/// model.
#[derive(Debug, Clone, Copy, Serialize)]
struct CouplingFacts<'a> {
    interfaces: &'a [String],
    largest: Option<At>,
}

impl CouplingFacts<'_> {
    fn in_words(&self) -> String {
        let names = self.interfaces.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>();
        let which = match names.as_slice() {
            [one] => format!("interface {one} is"),
            all => format!("interfaces {} are", all.join(", ")),
        };
        let effect = self.largest.map_or_else(
            || "the effect of the coupling is not known".to_owned(),
            |at| {
                format!(
                    "the coupling changes the response of the model by up to {} (at {})",
                    percent(at.value),
                    frequency(at.hertz, 4)
                )
            },
        );
        format!("{which} rigid, in the body and in the model of the comparison; {effect}")
    }
}

/// Facts of the response from one place to another.
#[derive(Debug, Clone, Serialize)]
struct PairFacts {
    from: String,
    to: String,
    unit: String,
    functions: Vec<FunctionFacts>,
    errors: Option<ErrorFacts>,
}

/// A transfer function as pairs of real and imaginary part.
#[derive(Debug, Clone, Serialize)]
struct FunctionFacts {
    from: &'static str,
    to: String,
    reduced: Vec<[f64; 2]>,
    full: Vec<Option<[f64; 2]>>,
}

/// Relative errors of a pair.
#[derive(Debug, Clone, Serialize)]
struct ErrorFacts {
    measured: Vec<Option<f64>>,
    estimated: Vec<f64>,
    largest: Option<At>,
    largest_decibels: Option<At>,
    worst: Option<At>,
    accurate_to_hz: Option<f64>,
    effectivity: Option<Effectivity>,
}

impl PairFacts {
    fn new(pair: &Pair, by_base: bool, units: &UnitSystem) -> Self {
        let parts = |z: Complex<f64>| [z.re, z.im];
        let function = |function: &Function| FunctionFacts {
            from: function.from.name(),
            to: function.to.name().to_owned(),
            reduced: function.reduced.iter().copied().map(parts).collect(),
            full: function.full.iter().map(|z| z.map(parts)).collect(),
        };
        Self {
            from: pair.from.to_string(),
            to: pair.to.to_string(),
            unit: pair.functions.first().map_or_else(String::new, |function| unit(function, by_base, units)),
            functions: pair.functions.iter().map(function).collect(),
            errors: pair.errors.as_ref().map(|errors| ErrorFacts {
                measured: errors.measured.clone(),
                estimated: errors.estimated.clone(),
                largest: errors.largest,
                largest_decibels: errors.decibels,
                worst: errors.worst,
                accurate_to_hz: errors.accurate_to,
                effectivity: errors.effectivity,
            }),
        }
    }

    fn name(&self) -> String {
        format!("{} to {}", self.from, self.to)
    }

    /// Returns the functions with the largest accelerances w^2 |H|, in their original order.
    fn strongest(&self, hertz: &[f64]) -> Vec<&FunctionFacts> {
        let peak = |function: &FunctionFacts| {
            let accelerances = function.reduced.iter().zip(hertz).map(|(z, f)| f * f * hypot(z[0], z[1]));
            accelerances.filter(|a| a.is_finite()).fold(0.0, f64::max)
        };
        let peaks: Vec<f64> = self.functions.iter().map(peak).collect();
        let mut shown: Vec<usize> = descending(&peaks).into_iter().take(PLOTS).collect();
        shown.sort_unstable();
        shown.into_iter().map(|i| &self.functions[i]).collect()
    }
}

/// Returns the unit of a function: `mm/N`, `rad/N`, `mm/(N mm)`, `MPa/(mm s^-2)`. A consistent force unit of one newton is
/// written `N`.
fn unit(function: &Function, by_base: bool, units: &UnitSystem) -> String {
    let [length, mass, time] = [&units.length, &units.mass, &units.time];
    let newton = mass.to_si() * length.to_si() / (time.to_si() * time.to_si());
    let force = match newton {
        n if (n - 1.0).abs() < 1e-9 => "N".to_owned(),
        _ => format!("({} {} {}^-2)", mass.name(), length.name(), time.name()),
    };
    let motion = match &function.to {
        Output::Direction(direction) if direction.turns() => "rad",
        Output::Direction(_) => length.name(),
        Output::Row(row) if row.unit.is_empty() => "1",
        Output::Row(row) => &row.unit,
    };
    if function.from == Direction::Amplitude {
        return motion.to_owned();
    }
    let load = match (by_base, function.from.turns()) {
        (false, false) => force,
        (false, true) => format!("({force} {})", length.name()),
        (true, false) => format!("({} {}^-2)", length.name(), time.name()),
        (true, true) => format!("(rad {}^-2)", time.name()),
    };
    format!("{motion}/{load}")
}

impl<'a> ResponseFacts<'a> {
    /// Collects the facts of `response`, which was computed with `settings` in `run`.
    pub fn new(response: &'a Response, settings: &ResponseSettings, run: &'a RunData) -> Self {
        let pairs: Vec<PairFacts> = response
            .pairs
            .iter()
            .map(|pair| PairFacts::new(pair, response.by_base, &response.units))
            .collect();
        let passed = response.solved.map(|_| response.holds(settings.tolerance));
        Self {
            format: "flexbody-response",
            format_major: 1,
            format_minor: 1,
            generator: generator(),
            body: &response.name,
            units: UnitFacts::new(&response.units),
            modes: response.modes,
            damped: response.damped,
            band_hz: settings.band.ends(),
            tolerance: settings.tolerance,
            verdict: verdict(&pairs, settings, passed),
            passed,
            body_modes_in_band: response.body_modes_in_band,
            solved: response.solved.map(|solved| SolvedFacts {
                rows: solved.rows,
                solves: solved.solves,
                flops: solved.flops,
                modes_in_band: solved.modes_in_band,
            }),
            coupling: response.coupling.as_ref().map(|coupling| CouplingFacts {
                interfaces: &coupling.interfaces,
                largest: coupling.largest,
            }),
            frequencies_hz: &response.frequencies,
            pairs,
            random: response.random.as_ref().map(RandomFacts::new),
            diagnostics: &run.diagnostics,
            threads: run.threads,
            wall_seconds: run.wall_seconds(),
            cpu_seconds: run.cpu_seconds(),
            logarithmic: settings.band.spacing() == Spacing::Logarithmic,
        }
    }

    /// Renders the facts in a format, ending with a line break.
    pub fn render(&self, format: Format) -> String {
        Document::render(self, format, || self.document())
    }

    /// Returns label and sentence of all facts other than the pairs.
    fn entries(&self) -> Vec<(&'static str, String)> {
        let band = frequency_range(self.band_hz, 5);
        let mut entries = vec![
            ("Band", format!("{band}, {} frequencies", self.frequencies_hz.len())),
            ("Modes", self.modes_in_words()),
        ];
        let damping = if self.damped {
            "modal damping, also in the model: D = M Psi C Psi'M"
        } else {
            "none: resonance peaks are unbounded, and errors near them mean little; set modal damping with --damping"
        };
        entries.push(("Damping", damping.to_owned()));
        entries.push(("All nodes", self.solved_in_words()));
        entries.extend(self.coupling.map(|coupling| ("Coupling", coupling.in_words())));
        let times = times(self.wall_seconds, self.cpu_seconds);
        entries.push(("Time", format!("{times}, {}", counted(self.threads, "thread"))));
        entries
    }

    fn modes_in_words(&self) -> String {
        let own = format!("{}, {} of them in the band", self.modes, self.body_modes_in_band);
        match self.solved {
            Some(solved) => format!("{own}; the model has {} in the band", solved.modes_in_band),
            None => own,
        }
    }

    fn solved_in_words(&self) -> String {
        self.solved.map_or_else(
            || "not solved, so that the error is not known: give the model to measure it".to_owned(),
            |solved| {
                let flops = significant(solved.flops, 2);
                format!(
                    "{} rows solved at {}, {flops} operations for each factor",
                    solved.rows,
                    counted(solved.solves, "frequency").replace("frequencys", "frequencies")
                )
            },
        )
    }

    fn document(&self) -> Document<'_> {
        let state = match self.passed {
            Some(true) => State::Good,
            Some(false) => State::Open,
            None => State::Given,
        };
        let head = [Term::text("Response", self.body), Term::text("Verdict", self.verdict.as_str())];
        let entries = self.entries().into_iter().map(|(label, words)| Term::new(label, words));
        let mut blocks = vec![
            Block::Verdict { state, head: format!("{}.", self.verdict), rest: String::new() },
            heading("Comparison"),
            Block::Terms(head.into_iter().chain(entries).collect()),
        ];
        if self.solved.is_some() && !self.pairs.is_empty() {
            blocks.extend([Block::Gap, heading("Errors"), Block::Table(self.errors()), Block::Gap]);
        }
        blocks.extend(self.random.iter().flat_map(RandomFacts::blocks));
        if !self.pairs.is_empty() {
            blocks.push(heading("Transfer functions"));
        }
        if self.pairs.len() > PLOTTED_PAIRS {
            let all = self.pairs.len();
            let some = format!(
                "Plots of the first {PLOTTED_PAIRS} of {all} pairs of places; --csv writes all of them."
            );
            blocks.push(Block::Paragraph(some));
        }
        blocks.extend(self.pairs.iter().take(PLOTTED_PAIRS).flat_map(|pair| self.plots(pair)));
        blocks.push(Block::Diagnostics(self.diagnostics));
        Document { name: self.body, kind: "Frequency response", generator: &self.generator, blocks }
    }

    fn errors(&self) -> Table {
        let heads = [
            "From, to",
            "Error",
            "at (Hz)",
            "Level difference (dB)",
            "at (Hz)",
            "Accurate to (Hz)",
            "Estimate / error",
        ];
        let row = |pair: &PairFacts| {
            let mut row: Vec<Inline> = vec![format!("{} [{}]", pair.name(), pair.unit).into()];
            row.extend(cells(errors_of_pair(pair)));
            row
        };
        let caption = format!(
            "Largest errors and differences at the frequencies that were solved, over all directions of a pair. A pair is accurate up to the frequency below which no error, measured or estimated, exceeds {}",
            percent(self.tolerance)
        );
        let rows = self.pairs.iter().map(row).collect();
        Table { below: Some(0), ..Table::new(caption, heads, &[0], rows).in_text(|head| head != heads[0]) }
    }

    fn plots<'b>(&self, pair: &PairFacts) -> Vec<Block<'b>> {
        let hertz = self.frequencies_hz;
        let scale = if self.logarithmic { Scale::Logarithmic } else { Scale::Linear };
        let ends = hertz.first().zip(hertz.last()).map(|(first, last)| [*first, *last]);
        let Some(x) = ends.and_then(|ends| Axis::between("Hz", scale, ends)) else { return Vec::new() };
        let shown = pair.strongest(hertz);
        let mut blocks = Vec::new();
        for (i, function) in shown.iter().enumerate() {
            let mut panels = vec![amplitude(function, hertz, &pair.unit), phase(function, hertz)];
            let last = i + 1 == shown.len();
            panels.extend(pair.errors.as_ref().filter(|_| last).map(|errors| self.error_panel(errors)));
            let title = format!("{}: {} for {}", pair.name(), function.to, function.from);
            blocks.push(Block::Chart(Chart { title, x: x.clone(), panels }));
        }
        let (some, all) = (shown.len(), pair.functions.len());
        if all > some {
            let words = format!(
                "The {some} of {all} functions of this pair with the largest accelerances; --csv writes all of them."
            );
            blocks.push(Block::Quiet(words));
        }
        blocks
    }

    fn error_panel(&self, errors: &ErrorFacts) -> Panel {
        let hertz = self.frequencies_hz;
        let measured = errors.measured.iter().map(|error| error.unwrap_or(f64::NAN));
        let limit = vec![self.tolerance; hertz.len()];
        let series = vec![
            curve("estimated", Mark::Line, 0, hertz, errors.estimated.iter().copied()),
            curve("measured", Mark::Dot, 1, hertz, measured),
            curve("", Mark::Line, 2, hertz, limit.into_iter()),
        ];
        let caption = "error of all directions, relative; dotted: the tolerance".to_owned();
        Panel { caption, y: decades("", &series), height: 110.0, series }
    }
}

/// Returns the cells of a pair: largest error and its frequency; largest level difference and its frequency;
/// frequency up to which the pair is accurate; estimated over measured error.
fn errors_of_pair(pair: &PairFacts) -> [String; 6] {
    let none = || "-".to_owned();
    let errors = pair.errors.as_ref();
    let at = |at: Option<At>| at.map_or_else(none, |at| significant(at.hertz, 4));
    let largest = errors.and_then(|errors| errors.largest);
    let decibels = errors.and_then(|errors| errors.largest_decibels);
    let effectivity = errors.and_then(|errors| errors.effectivity);
    [
        largest.map_or_else(none, |at| percent(at.value)),
        at(largest),
        decibels.map_or_else(none, |at| significant(at.value, 3)),
        at(decibels),
        errors.and_then(|errors| errors.accurate_to_hz).map_or_else(none, |f| significant(f, 4)),
        effectivity
            .map_or_else(none, |e| format!("{} to {}", significant(e.least, 2), significant(e.most, 2))),
    ]
}

/// Returns a series of values over frequency.
fn curve(name: &str, mark: Mark, style: usize, hertz: &[f64], values: impl Iterator<Item = f64>) -> Series {
    Series::new(name, mark, style, hertz.iter().zip(values).map(|(&hertz, value)| [hertz, value]).collect())
}

/// Returns a logarithmic axis over the highest decades of all series, or over one decade if no value is
/// positive.
fn decades(unit: &str, series: &[Series]) -> Axis {
    let values = || series.iter().flat_map(|series| series.points.iter().map(|point| point[1]));
    let axis = Axis::decades(unit, values(), MOST_DECADES);
    axis.or_else(|| Axis::decades(unit, [0.1, 1.0].into_iter(), 1.0)).expect("both ends are positive")
}

fn amplitude(function: &FunctionFacts, hertz: &[f64], unit: &str) -> Panel {
    let series = curves(function, hertz, Mark::Line, |z| hypot(z[0], z[1]));
    Panel { caption: "amplitude".to_owned(), y: decades(unit, &series), height: 170.0, series }
}

fn phase(function: &FunctionFacts, hertz: &[f64]) -> Panel {
    let series = curves(function, hertz, Mark::Angle, |z| atan2(z[1], z[0]).to_degrees());
    Panel { caption: "phase".to_owned(), y: Axis::degrees(), height: 80.0, series }
}

/// Returns the curves of a function for the reduced body and, if solved, for all nodes.
fn curves(function: &FunctionFacts, hertz: &[f64], mark: Mark, of: fn(&[f64; 2]) -> f64) -> Vec<Series> {
    let mut curves = vec![curve("reduced", mark, 0, hertz, function.reduced.iter().map(of))];
    if function.full.iter().any(Option::is_some) {
        let values = function.full.iter().map(|z| z.as_ref().map_or(f64::NAN, of));
        curves.push(curve("all nodes", Mark::Dot, 1, hertz, values));
    }
    curves
}

/// Returns the result of the response as a sentence without a full stop.
fn verdict(pairs: &[PairFacts], settings: &ResponseSettings, passed: Option<bool>) -> String {
    let tolerance = percent(settings.tolerance);
    let how = |pair: &PairFacts| match pair.errors.as_ref().map(|errors| errors.worst == errors.largest) {
        Some(false) => " (estimated)",
        _ => "",
    };
    let worst = pairs.iter().filter_map(|pair| Some((pair, pair.errors.as_ref()?.worst?)));
    let worst = worst.reduce(|most, next| if next.1.value <= most.1.value { most } else { next });
    match (passed, worst) {
        (Some(true), Some((pair, worst))) => format!(
            "The reduced body agrees with all nodes within {tolerance}: the largest error in the band is {} at {}{}",
            percent(worst.value),
            frequency(worst.hertz, 4),
            how(pair)
        ),
        (Some(_), Some((pair, worst))) => {
            let ends =
                pairs.iter().filter_map(|pair| pair.errors.as_ref()).map(|e| e.accurate_to_hz.unwrap_or(0.0));
            let accurate_to = ends.fold(f64::INFINITY, f64::min);
            let until = if accurate_to > 0.0 {
                format!("it is accurate to {tolerance} only up to {}", frequency(accurate_to, 4))
            } else {
                format!("it is nowhere accurate to {tolerance}")
            };
            format!(
                "The reduced body does not agree with all nodes: {until}; the largest error is {} at {}{}, {}",
                percent(worst.value),
                frequency(worst.hertz, 4),
                how(pair),
                pair.name()
            )
        }
        _ => "The response of the reduced body alone; its error is not known without the model".to_owned(),
    }
}

/// Returns the response as comma-separated values with one row per frequency. Numbers round-trip; cells are
/// empty where the equations of all nodes were not solved.
pub fn response_csv(response: &Response) -> String {
    let mut head = vec!["frequency_hz".to_owned()];
    for pair in &response.pairs {
        for function in &pair.functions {
            let name =
                format!("{} {} to {} {}", pair.from, function.from.name(), pair.to, function.to.name());
            head.extend(
                ["reduced re", "reduced im", "full re", "full im"].map(|part| format!("{name} {part}")),
            );
        }
        if pair.errors.is_some() {
            let turns =
                pair.functions.first().map_or_else(String::new, |function| function.kind(response.by_base));
            head.extend(
                ["error", "estimate"].map(|what| format!("{} to {} {turns} {what}", pair.from, pair.to)),
            );
        }
    }
    let mut table = String::new();
    csv::push_row(&mut table, head.iter().map(|cell| csv::text(cell)));
    for (i, hertz) in response.frequencies.iter().enumerate() {
        let mut cells = vec![csv::number(*hertz)];
        for pair in &response.pairs {
            for function in &pair.functions {
                let (reduced, full) = (function.reduced[i], function.full[i]);
                cells.extend(
                    [Some(reduced.re), Some(reduced.im), full.map(|z| z.re), full.map(|z| z.im)]
                        .map(csv::number),
                );
            }
            if let Some(errors) = &pair.errors {
                cells.extend([errors.measured[i], Some(errors.estimated[i])].map(csv::number));
            }
        }
        csv::push_row(&mut table, cells);
    }
    table
}
