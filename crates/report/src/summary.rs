//! The summary of a body that an engineer reads in ten seconds: what it is, whether its modes are all there,
//! what lumped masses would have cost, and everything that limits its use.

use super::Facts;
use super::facts::{InterfaceFacts, RunFacts};
use super::geometric_stiffness::softening_in_words;
use super::lumped_effect::scheme_in_words;
use super::numbers::{bytes, coordinates, counted, duration, plain, significant, triple};
use super::text::{LABEL, WIDTH, entry_lines, first_and_last, own_modes};
use flexbody_base::diagnostic::Severity;
use flexbody_body::flex_body::MassStructure;

/// Entries of a list that are shown.
const LISTED: usize = 4;

/// What the summary is shown on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Screen {
    /// Labels are in colour.
    is_coloured: bool,
    columns: usize,
}

impl Screen {
    /// Columns that a summary can be read in.
    const NARROWEST: usize = 40;
    /// Lines that are longer are hard to read.
    const WIDEST: usize = 100;

    /// With labels in colour, or without.
    pub fn coloured(self, is_coloured: bool) -> Self {
        Self { is_coloured, ..self }
    }

    /// A terminal of so many columns, which the summary fills as far as it can be read.
    pub fn with_columns(self, columns: usize) -> Self {
        Self { columns: columns.clamp(Self::NARROWEST, Self::WIDEST), ..self }
    }
}

impl Default for Screen {
    /// A file, or a terminal that does not say what it is.
    fn default() -> Self {
        Self { is_coloured: false, columns: WIDTH }
    }
}

/// The summary as a screen shows it.
pub fn summary(facts: &Facts<'_>, screen: Screen) -> String {
    let mut summary = Summary { text: String::new(), screen };
    body(&mut summary, facts);
    summary.gap();
    mass_properties(&mut summary, facts);
    summary.gap();
    modes(&mut summary, facts);
    limits(&mut summary, facts);
    summary.gap();
    lumped(&mut summary, facts);
    summary.gap();
    diagnostics(&mut summary, facts);
    summary.gap();
    if let Some(run) = &facts.run {
        output(&mut summary, run);
    }
    summary.text.truncate(summary.text.trim_end().len());
    summary.text + "\n"
}

/// How an entry is to be taken.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Tone {
    Title,
    Plain,
    Good,
    Warning,
    Bad,
}

impl Tone {
    /// Codes of the label and of the text that begin and end them (ECMA-48, SGR).
    fn codes(self) -> [&'static str; 2] {
        match self {
            Self::Title => ["36", "1"],
            Self::Plain => ["36", ""],
            Self::Good => ["32", ""],
            Self::Warning => ["33", ""],
            Self::Bad => ["1;31", "31"],
        }
    }
}

struct Summary {
    text: String,
    screen: Screen,
}

impl Summary {
    /// A text under a label, of at most so many lines where lines have the usual length.
    fn entry(&mut self, tone: Tone, label: &str, text: &str, most: usize) {
        let columns = self.screen.columns;
        let most = most * (WIDTH - LABEL).div_ceil(columns.min(WIDTH) - LABEL);
        for line in entry_lines(label, text, most, columns) {
            let at = line.char_indices().nth(LABEL).map_or(line.len(), |(at, _)| at);
            let (label, text) = line.split_at(at);
            let [of_label, of_text] = tone.codes();
            self.painted(of_label, label);
            self.painted(of_text, text);
            self.text.push('\n');
        }
    }

    fn painted(&mut self, code: &str, text: &str) {
        match self.screen.is_coloured && !code.is_empty() && !text.trim().is_empty() {
            true => self.text.push_str(&format!("\u{1b}[{code}m{text}\u{1b}[0m")),
            false => self.text.push_str(text),
        }
    }

    /// The first entries of a list, the rest counted.
    fn list<T>(&mut self, label: &str, items: &[T], entry: impl Fn(&T) -> (Tone, String)) {
        for (i, item) in items.iter().take(LISTED).enumerate() {
            let (tone, text) = entry(item);
            self.entry(tone, if i == 0 { label } else { "" }, &text, 3);
        }
        if items.len() > LISTED {
            self.entry(Tone::Plain, "", &format!("and {} more", items.len() - LISTED), 1);
        }
    }

    /// An empty line between two groups of entries.
    fn gap(&mut self) {
        if !self.text.is_empty() && !self.text.ends_with("\n\n") {
            self.text.push('\n');
        }
    }
}

fn body(summary: &mut Summary, facts: &Facts<'_>) {
    let model = &facts.model;
    let number = model.body.as_ref().map_or(String::new(), |b| format!(", body {} of {}", b.number, b.of));
    let tone = if model.units.stated { Tone::Title } else { Tone::Warning };
    let title = format!("{}{number} ({})", plain(&model.name), model.units.in_words());
    summary.entry(tone, "body", &title, 2);
    let plane = if model.dimension == 2 { ", PLANE model" } else { "" };
    let lumped = model.mass_structure == MassStructure::Diagonal.name();
    let tone = if lumped || !plane.is_empty() { Tone::Warning } else { Tone::Plain };
    let size = match &model.approximation {
        Some(_) => model.nodes_in_words(),
        None => model.size_in_words(),
    };
    summary.entry(tone, "model", &format!("{size}{plane}"), 3);
    if model.approximation.is_some() {
        let remark = "W1, W2 and W3 keep a part of the mass along the axes of the body; the rest is exact";
        summary.entry(Tone::Warning, "approximate", remark, 2);
    }
    if let Some(rounded) = model.storage_in_words() {
        summary.entry(Tone::Warning, "storage", rounded, 2);
    }
    if !model.interfaces.is_empty() {
        let (size, unit) = (facts.body.size(), model.units.length());
        let all: Vec<String> = model.interfaces.iter().map(|one| interface(one, size, &unit)).collect();
        let bends = model.interfaces.iter().any(InterfaceFacts::breaks_its_word);
        let tone = if bends { Tone::Warning } else { Tone::Plain };
        summary.entry(tone, "interfaces", &all.join("; "), if bends { 6 } else { 4 });
    }
}

/// `bore: 80 nodes, rigid, at 0, 0, 12.5 mm`; the point in model axes.
fn interface(interface: &InterfaceFacts, size: f64, unit: &str) -> String {
    let coupling = interface.coupling.map_or(String::new(), |name| format!(", {name}"));
    let bends = if interface.breaks_its_word() { " but DEFORMS" } else { "" };
    let place = interface.place_in_words(size, unit);
    format!("{}: {}{coupling}{bends}{place}", plain(&interface.name), counted(interface.n_nodes, "node"))
}

fn mass_properties(summary: &mut Summary, facts: &Facts<'_>) {
    let (body, units) = (&facts.body, &facts.model.units);
    let size = body.size();
    let centre = coordinates(&body.centre_of_mass, size, &units.length());
    let inertia = triple(&body.principal_inertia, &units.inertia());
    let mass = format!("{} {} at {centre} (model axes)", significant(body.mass, 6), units.mass());
    summary.entry(Tone::Plain, "mass", &mass, 2);
    summary.entry(Tone::Plain, "inertia", &format!("{inertia} (principal)"), 2);
    if !body.in_mean_axes {
        summary.entry(Tone::Plain, "frame", &body.frame, 3);
    }
}

fn modes(summary: &mut Summary, facts: &Facts<'_>) {
    let (modes, completeness) = (&facts.modes, &facts.completeness);
    let range = match modes.frequency_hz.as_slice() {
        [] => String::new(),
        [only] => format!(", {} Hz", significant(*only, 5)),
        [first, .., last] => format!(", {} to {} Hz", significant(*first, 5), significant(*last, 5)),
    };
    let origins = modes.origins();
    let kinds = match &modes.craig_bampton {
        // Modes of the body are mixtures of fixed-interface modes and motions of the interfaces.
        Some(own) => format!(": {}", own.made_of()),
        None if origins.is_empty() => String::new(),
        None => {
            let kinds = origins.iter().map(|(origin, count)| format!("{count} x {}", plain(origin)));
            format!(" ({})", kinds.collect::<Vec<_>>().join(", "))
        }
    };
    summary.entry(Tone::Plain, "modes", &format!("{} flexible{range}{kinds}", modes.count), 3);
    if let Some(hz) = modes.craig_bampton.as_ref().and_then(|own| own.held_hz()) {
        summary.entry(Tone::Plain, "held", &format!("{} (fixed-interface modes)", first_and_last(hz)), 2);
    }
    let proof = completeness.sentence.strip_prefix("proved: ");
    match (completeness.verdict, proof) {
        ("proved", Some(proof)) => summary.entry(Tone::Good, "proved", proof, 4),
        ("given", _) => summary.entry(Tone::Plain, "complete", &completeness.sentence, 4),
        _ => summary.entry(Tone::Bad, "complete", &completeness.sentence, 4),
    }
    if let Some(guarantee) = &facts.guarantee {
        summary.entry(Tone::Good, "guaranteed", &guarantee.eigenvalues(), 3);
    }
    if let Some(craig_bampton) = &modes.craig_bampton {
        summary.entry(Tone::Plain, "free body", &craig_bampton.holds(&modes.frequency_hz), 3);
    }
}

/// What the body does not hold, or holds only so far.
fn limits(summary: &mut Summary, facts: &Facts<'_>) {
    if let Some(damping) = &facts.modes.damping {
        summary.entry(Tone::Plain, "damping", &damping.in_words(), 2);
    }
    if let Some(inertia) = &facts.modes.inertia_stiffness {
        summary.entry(Tone::Plain, "inertia K", &inertia.in_words(), 3);
    }
    if let Some(hertz) = &facts.modes.softening_hz {
        summary.entry(Tone::Plain, "spin", &softening_in_words(hertz), 2);
    }
    let dropped: Vec<_> = facts.terms.iter().filter(|term| !term.kept).collect();
    summary.list("left out", &dropped, |term| (Tone::Warning, term.in_words()));
}

fn lumped(summary: &mut Summary, facts: &Facts<'_>) {
    summary.list("lumped", &facts.lumped, |lumped| {
        let tone = if lumped.negative_masses > 0 { Tone::Warning } else { Tone::Plain };
        (tone, format!("{}: {}", plain(scheme_in_words(&lumped.scheme)), lumped.in_words(false)))
    });
    summary.list("own modes", &facts.lumped_modes, |lumped| {
        (Tone::Plain, format!("{}: {}", plain(scheme_in_words(&lumped.scheme)), own_modes(lumped)))
    });
}

/// Errors and warnings; notes stand on stderr and in the report.
fn diagnostics(summary: &mut Summary, facts: &Facts<'_>) {
    for (severity, label, tone) in
        [(Severity::Error, "errors", Tone::Bad), (Severity::Warning, "warnings", Tone::Warning)]
    {
        let found: Vec<_> = facts.diagnostics.iter().filter(|d| d.severity() == severity).collect();
        summary.list(label, &found, |d| (tone, format!("{} {}", d.code().id(), plain(d.message()))));
    }
}

fn output(summary: &mut Summary, run: &RunFacts) {
    let took = format!("in {}", duration(run.wall_seconds));
    match &run.output {
        Some(output) => {
            let file = format!("{}, {}, {took}", plain(&output.name), bytes(output.bytes));
            summary.entry(Tone::Plain, "file", &file, 4);
        }
        None => summary.entry(Tone::Plain, "done", &took, 1),
    }
}
