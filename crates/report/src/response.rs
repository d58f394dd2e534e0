//! What a user reads of a frequency response: facts, the compact summary, the table and the page with the
//! plots.

use super::Format;
use super::facts::UnitFacts;
use super::frequency_chart::{Curve, FrequencyAxis, Panel, Scale, frequency_chart};
use super::markup::{diagnostics_table, escape, page, section, table, terms, texts};
use super::numbers::{counted, duration, percent, plain, significant};
use super::render::json;
use super::run_data::RunData;
use super::text::{Page, diagnostics_lines};
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::provenance::generator;
use flexbody_base::units::UnitSystem;
use flexbody_study::response::{
    At, Complex, Effectivity, Function, Pair, Response, ResponseSettings, Spacing,
};
use serde::Serialize;
use std::fmt::Write;

/// Plots of each pair of places: the functions with the largest accelerances.
const PLOTS: usize = 3;

/// Pairs that are plotted.
const PLOTTED_PAIRS: usize = 8;

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
    /// `None` where no error is known.
    passed: Option<bool>,
    body_modes_in_band: usize,
    solved: Option<SolvedFacts>,
    /// `None` where no interface of the body is rigid.
    coupling: Option<CouplingFacts<'a>>,
    frequencies_hz: &'a [f64],
    pairs: Vec<PairFacts>,
    diagnostics: &'a [Diagnostic],
    threads: usize,
    wall_seconds: f64,
    cpu_seconds: f64,
    #[serde(skip)]
    logarithmic: bool,
}

/// The equations of all nodes.
#[derive(Debug, Clone, Copy, Serialize)]
struct SolvedFacts {
    rows: usize,
    solves: usize,
    flops: f64,
    modes_in_band: usize,
}

/// Rigid interfaces, which the model has in the comparison as well, and their effect on its response.
#[derive(Debug, Clone, Copy, Serialize)]
struct CouplingFacts<'a> {
    interfaces: &'a [String],
    largest: Option<At>,
}

impl CouplingFacts<'_> {
    fn in_words(&self) -> String {
        let names = self.interfaces.iter().map(|name| format!("`{}`", plain(name))).collect::<Vec<_>>();
        let which = match names.as_slice() {
            [one] => format!("interface {one} is"),
            all => format!("interfaces {} are", all.join(", ")),
        };
        let effect = self.largest.map_or_else(
            || "the effect of the coupling is not known".to_owned(),
            |at| {
                let hertz = significant(at.hertz, 4);
                format!(
                    "the coupling changes the response of the model by up to {} (at {hertz} Hz)",
                    percent(at.value)
                )
            },
        );
        format!("{which} rigid, in the body and in the model it is compared with; {effect}")
    }
}

/// From one place to another.
#[derive(Debug, Clone, Serialize)]
struct PairFacts {
    from: String,
    to: String,
    unit: String,
    functions: Vec<FunctionFacts>,
    errors: Option<ErrorFacts>,
}

/// A transfer function; real and imaginary parts.
#[derive(Debug, Clone, Serialize)]
struct FunctionFacts {
    from: &'static str,
    to: &'static str,
    reduced: Vec<[f64; 2]>,
    full: Vec<Option<[f64; 2]>>,
}

/// Errors of a pair; relative.
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
    fn new(pair: &Pair, units: &UnitSystem) -> Self {
        let parts = |z: Complex<f64>| [z.re, z.im];
        let function = |function: &Function| FunctionFacts {
            from: function.from.name(),
            to: function.to.name(),
            reduced: function.reduced.iter().copied().map(parts).collect(),
            full: function.full.iter().map(|z| z.map(parts)).collect(),
        };
        Self {
            from: pair.from.to_string(),
            to: pair.to.to_string(),
            unit: pair.functions.first().map_or_else(String::new, |function| unit(function, units)),
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
        format!("{} to {}", plain(&self.from), plain(&self.to))
    }

    /// The functions with the largest accelerances w^2 |H|, in their order.
    fn strongest(&self, hertz: &[f64]) -> Vec<&FunctionFacts> {
        let peak = |function: &FunctionFacts| {
            let accelerances = function.reduced.iter().zip(hertz).map(|(z, f)| f * f * z[0].hypot(z[1]));
            accelerances.filter(|a| a.is_finite()).fold(0.0, f64::max)
        };
        let mut by_peak: Vec<(usize, f64)> = self.functions.iter().map(peak).enumerate().collect();
        by_peak.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut shown: Vec<usize> = by_peak.into_iter().take(PLOTS).map(|(i, _)| i).collect();
        shown.sort_unstable();
        shown.into_iter().map(|i| &self.functions[i]).collect()
    }
}

/// `mm/N`, `rad/N`, `mm/(N mm)`: where the units make newtons these are named.
fn unit(function: &Function, units: &UnitSystem) -> String {
    let [length, mass, time] = [&units.length, &units.mass, &units.time];
    let newton = mass.to_si() * length.to_si() / (time.to_si() * time.to_si());
    let force = match newton {
        n if (n - 1.0).abs() < 1e-9 => "N".to_owned(),
        _ => format!("({} {} {}^-2)", mass.name(), length.name(), time.name()),
    };
    let motion = if function.to.turns() { "rad" } else { length.name() };
    let load = if function.from.turns() { format!("({force} {})", length.name()) } else { force };
    format!("{motion}/{load}")
}

impl<'a> ResponseFacts<'a> {
    /// Facts of `response`, made with `settings` in `run`.
    pub fn new(response: &'a Response, settings: &ResponseSettings, run: &'a RunData) -> Self {
        let pairs: Vec<PairFacts> =
            response.pairs.iter().map(|pair| PairFacts::new(pair, &response.units)).collect();
        let passed = response.solved.map(|_| response.holds(settings.tolerance));
        Self {
            format: "flexbody-response",
            format_major: 1,
            format_minor: 0,
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
            diagnostics: &run.diagnostics,
            threads: run.threads,
            wall_seconds: run.phases.iter().map(|phase| phase.wall_seconds).sum(),
            cpu_seconds: run.phases.iter().map(|phase| phase.cpu_seconds).sum(),
            logarithmic: settings.band.spacing() == Spacing::Logarithmic,
        }
    }

    /// As text, JSON or HTML, ending with a line break.
    pub fn render(&self, format: Format) -> String {
        match format {
            Format::Json => json(self),
            Format::Text => self.text(),
            Format::Html => self.html(),
        }
    }

    /// Label and sentence of everything that is known beside the pairs.
    fn entries(&self) -> Vec<(&'static str, String)> {
        let [low, high] = self.band_hz.map(|f| significant(f, 5));
        let mut entries = vec![
            ("Band", format!("{low} to {high} Hz, {} frequencies", self.frequencies_hz.len())),
            ("Modes", self.modes_in_words()),
        ];
        let damping = match self.damped {
            true => "that of the modes, in the model the same: D = M Psi C Psi'M",
            false => {
                "none: peaks have no height, and errors near them say little; --damping gives the modes some"
            }
        };
        entries.push(("Damping", damping.to_owned()));
        entries.push(("All nodes", self.solved_in_words()));
        entries.extend(self.coupling.map(|coupling| ("Coupling", coupling.in_words())));
        let (wall, cpu) = (duration(self.wall_seconds), duration(self.cpu_seconds));
        entries.push(("Time", format!("{wall} wall, {cpu} CPU, {}", counted(self.threads, "thread"))));
        entries
    }

    fn modes_in_words(&self) -> String {
        let own = format!("{}, {} of them in the band", self.modes, self.body_modes_in_band);
        match self.solved {
            Some(solved) => format!("{own}; the model has {} there", solved.modes_in_band),
            None => own,
        }
    }

    fn solved_in_words(&self) -> String {
        self.solved.map_or_else(
            || "not solved: the error is not known; give the model to have it measured".to_owned(),
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

    fn text(&self) -> String {
        let mut page = Page(String::new());
        page.entry("Response", plain(self.body).as_str());
        page.entry("Verdict", &self.verdict);
        for (label, text) in self.entries() {
            page.entry(label, &text);
        }
        if self.solved.is_some() {
            page.0.push_str(
                "\n  error      at Hz     level dB   at Hz     accurate to  estimate/error    pair\n",
            );
            for pair in &self.pairs {
                let [error, at, level, level_at, to, effectivity] = cells(pair, "-");
                let _ = writeln!(
                    page.0,
                    "  {error:<9}  {at:<8}  {level:<9}  {level_at:<8}  {to:<11}  {effectivity:<16}  {}",
                    pair.name()
                );
            }
            page.0.push('\n');
        }
        diagnostics_lines(&mut page, self.diagnostics);
        page.0
    }

    fn html(&self) -> String {
        let mut html = String::new();
        let class = match self.passed {
            Some(true) => "",
            Some(false) => " open",
            None => " given",
        };
        let verdict = escape(&self.verdict);
        let _ = writeln!(html, "<p class=\"verdict{class}\"><strong>{verdict}.</strong></p>");
        section(&mut html, "What is compared");
        terms(&mut html, self.entries().into_iter().map(|(label, text)| (label, escape(&text))));
        if self.solved.is_some() {
            section(&mut html, "Errors");
            self.table(&mut html);
        }
        section(&mut html, "Transfer functions");
        if self.pairs.len() > PLOTTED_PAIRS {
            let _ = writeln!(
                html,
                "<p>The first {PLOTTED_PAIRS} of {} pairs of places; the table of --csv has all.</p>",
                self.pairs.len()
            );
        }
        for pair in self.pairs.iter().take(PLOTTED_PAIRS) {
            self.plots(&mut html, pair);
        }
        diagnostics_table(&mut html, self.diagnostics);
        page(self.body, "Frequency response", &self.generator, &html)
    }

    fn table(&self, html: &mut String) {
        let head = texts([
            "From, to",
            "Largest error",
            "at (Hz)",
            "Largest level difference (dB)",
            "at (Hz)",
            "Accurate to (Hz)",
            "Estimate / error",
        ]);
        let row = |pair: &PairFacts| {
            let mut row = vec![escape(&format!("{} [{}]", pair.name(), pair.unit))];
            row.extend(cells(pair, "&ndash;"));
            row
        };
        let rows: Vec<_> = self.pairs.iter().map(row).collect();
        let caption = format!(
            "Measured at the frequencies that were solved, over all directions of a pair; accurate to where no error, measured or estimated, is above {}",
            percent(self.tolerance)
        );
        table(html, &caption, &head, &[0], &rows);
    }

    fn plots(&self, html: &mut String, pair: &PairFacts) {
        let axis = FrequencyAxis { hertz: self.frequencies_hz, logarithmic: self.logarithmic };
        let shown = pair.strongest(self.frequencies_hz);
        for (i, function) in shown.iter().enumerate() {
            let mut panels = vec![amplitude(function, &pair.unit), phase(function)];
            let last = i + 1 == shown.len();
            panels.extend(pair.errors.as_ref().filter(|_| last).map(|errors| self.error_panel(errors)));
            let title = format!("{}: {} for {}", pair.name(), function.to, function.from);
            html.push_str(&frequency_chart(&title, &axis, &panels));
        }
        if pair.functions.len() > shown.len() {
            let _ = writeln!(
                html,
                "<p class=\"quiet\">{} of {} functions of this pair, those with the largest accelerances; the table of --csv has all.</p>",
                shown.len(),
                pair.functions.len()
            );
        }
    }

    fn error_panel(&self, errors: &ErrorFacts) -> Panel {
        let measured = errors.measured.iter().map(|error| error.unwrap_or(f64::NAN)).collect();
        Panel {
            caption: "error of all directions, relative; dotted: the tolerance".to_owned(),
            scale: Scale::Logarithmic,
            height: 110.0,
            curves: vec![
                Curve { name: "estimated", values: errors.estimated.clone(), dots: false },
                Curve { name: "measured", values: measured, dots: true },
            ],
            limit: Some(self.tolerance),
        }
    }
}

/// Error, where; level difference, where; accurate to; estimate over error.
fn cells(pair: &PairFacts, nothing: &str) -> [String; 6] {
    let none = || nothing.to_owned();
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

fn amplitude(function: &FunctionFacts, unit: &str) -> Panel {
    let size = |z: &[f64; 2]| z[0].hypot(z[1]);
    curves(function, size, format!("amplitude [{unit}]"), Scale::Logarithmic, 170.0)
}

fn phase(function: &FunctionFacts) -> Panel {
    let angle = |z: &[f64; 2]| z[1].atan2(z[0]).to_degrees();
    curves(function, angle, "phase [degrees]".to_owned(), Scale::Degrees, 80.0)
}

/// A panel of something of a function, reduced and full.
fn curves(
    function: &FunctionFacts,
    of: fn(&[f64; 2]) -> f64,
    caption: String,
    scale: Scale,
    height: f64,
) -> Panel {
    let mut curves =
        vec![Curve { name: "reduced", values: function.reduced.iter().map(of).collect(), dots: false }];
    if function.full.iter().any(Option::is_some) {
        let values = function.full.iter().map(|z| z.as_ref().map_or(f64::NAN, of)).collect();
        curves.push(Curve { name: "all nodes", values, dots: true });
    }
    Panel { caption, scale, height, curves, limit: None }
}

/// What came out, as a sentence without a full stop.
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
            "The reduced body answers as all nodes do, within {tolerance}: the largest error in the band is {} at {} Hz{}",
            percent(worst.value),
            significant(worst.hertz, 4),
            how(pair)
        ),
        (Some(_), Some((pair, worst))) => {
            let ends =
                pairs.iter().filter_map(|pair| pair.errors.as_ref()).map(|e| e.accurate_to_hz.unwrap_or(0.0));
            let accurate_to = ends.fold(f64::INFINITY, f64::min);
            let until = match accurate_to > 0.0 {
                true => {
                    format!("it is accurate to {tolerance} up to {} Hz only", significant(accurate_to, 4))
                }
                false => format!("it is nowhere accurate to {tolerance}"),
            };
            format!(
                "The reduced body does not answer as all nodes do: {until}, and off by {} at {} Hz{}, {}",
                percent(worst.value),
                significant(worst.hertz, 4),
                how(pair),
                pair.name()
            )
        }
        _ => "The response of the reduced body alone; its error is not known without the model".to_owned(),
    }
}

/// The response as a table of comma-separated values, a row for every frequency; numbers round-trip, cells
/// are empty where nothing was solved.
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
            let turns = pair.functions.first().map_or("", |function| function.kind());
            head.extend(
                ["error", "estimate"].map(|what| format!("{} to {} {turns} {what}", pair.from, pair.to)),
            );
        }
    }
    let mut out = head.iter().map(|cell| super::simulation::csv_cell(cell)).collect::<Vec<_>>().join(",");
    out.push('\n');
    let optional = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:e}"));
    for (i, hertz) in response.frequencies.iter().enumerate() {
        let mut cells = vec![format!("{hertz:e}")];
        for pair in &response.pairs {
            for function in &pair.functions {
                let (reduced, full) = (function.reduced[i], function.full[i]);
                cells.extend(
                    [Some(reduced.re), Some(reduced.im), full.map(|z| z.re), full.map(|z| z.im)]
                        .map(optional),
                );
            }
            if let Some(errors) = &pair.errors {
                cells.extend([errors.measured[i], Some(errors.estimated[i])].map(optional));
            }
        }
        out.push_str(&cells.join(","));
        out.push('\n');
    }
    out
}
