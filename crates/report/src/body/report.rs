//! Report of a body.

use super::facts::{Facts, InterfaceFacts, ModelFacts, RunFacts};
use super::glossary::{glossary, word_as};
use super::heat_maps::heat_maps;
use super::lumped::{
    ErrorNorm, Errors, LumpedFacts, LumpedModesFacts, NEGLIGIBLE, distinct, invariant_in_words, judgement,
    scheme_in_words,
};
use super::modes::modes;
use crate::chart::{Axis, Bar, Bars};
use crate::document::text::KEEP;
use crate::document::{
    Block, Document, Format, Inline, Span, State, Table, Term, cells, heading, listed, quantity,
};
use crate::notation::numbers::{
    bytes, coordinates, counted, duration, frequency, frequency_range, percent, sentence, significant, times,
    triple,
};
use crate::run_data::{Phase, SearchAttempt};
use flexbody_base::diagnostic::Severity;
use flexbody_body::flex_body::{FlexBody, MassStructure};
use flexbody_body::invariants::{ERROR_NORMS, LumpedScheme};

/// Product of inertia, relative to the largest moment, that counts as rounding.
const INERTIA_ROUNDING: f64 = 1e-14;

/// Renders the facts in a format, ending with a line break.
pub fn render(facts: &Facts<'_>, format: Format) -> String {
    Document::render(facts, format, || document(facts))
}

/// Builds the report of a body.
fn document<'f>(facts: &'f Facts<'_>) -> Document<'f> {
    // Errors and warnings are shown before the results they affect.
    let is_urgent = facts.diagnostics.iter().any(|found| found.severity() != Severity::Note);
    let diagnostics = |is_here: bool| is_here.then_some(Block::Diagnostics(&facts.diagnostics));
    let mut blocks = vec![verdict(facts)];
    blocks.push(Block::Picture(facts.flex_body, vec![heading("Body"), Block::Terms(properties(facts))]));
    blocks.extend(cautions(&facts.model));
    blocks.extend(interfaces(facts));
    blocks.extend(diagnostics(is_urgent));
    blocks.push(Block::Gap);
    blocks.extend(modes(facts));
    blocks.push(Block::Gap);
    blocks.extend(lumped(facts));
    blocks.extend(heat_maps(facts.flex_body));
    blocks.extend(diagnostics(!is_urgent));
    blocks.push(Block::Gap);
    blocks.extend(facts.run.iter().flat_map(run));
    blocks.extend(origin(facts));
    blocks.extend(glossary());
    Document { name: &facts.model.name, kind: "Flexible body report", generator: &facts.generator, blocks }
}

fn verdict<'a>(facts: &Facts<'_>) -> Block<'a> {
    let (completeness, modes) = (&facts.completeness, &facts.modes);
    let state = match completeness.verdict {
        "proved" => State::Good,
        "given" => State::Given,
        _ => State::Open,
    };
    let range = match modes.frequency_hz.as_slice() {
        [] => String::new(),
        [only] => format!(", {}", frequency(*only, 5)),
        [first, .., last] => format!(", {}", frequency_range([*first, *last], 5)),
    };
    let mass = facts.model.units.mass_of(facts.body.mass, 4);
    let free = modes.craig_bampton.as_ref().and_then(|own| own.holds(&modes.frequency_hz));
    let free = free.map(|holds| format!(" {}.", sentence(&holds)));
    let rest = format!(
        "{mass}; {}{range}. {}.{}",
        counted(modes.count, "flexible mode"),
        sentence(&completeness.sentence),
        free.unwrap_or_default()
    );
    Block::Verdict { state, head: completeness.head.to_owned(), rest }
}

/// Returns the properties of the undeformed body.
fn properties(facts: &Facts<'_>) -> Vec<Term> {
    let (model, body) = (&facts.model, &facts.body);
    let units = &model.units;
    let (length, size) = (units.length(), body.size());
    let plane = if model.dimension == 2 { "; plane model" } else { "" };
    let centre = coordinates(&body.centre_of_mass, size, &length);
    let inertia = triple(&body.principal_inertia, &units.inertia());
    let radii = triple(&body.radii_of_gyration, &length);
    let [x, y, z] = body.frame_axes.map(|row| row.map(|v| significant(v, 6)).join(", "));
    let mut items = vec![
        Term::new("Units", units.in_words())
            .in_text("body", format!("{} ({})", model.name, units.in_words())),
        Term::new("Model", model.size_in_words() + plane).short("model"),
    ];
    items.extend(model.approximation.as_ref().map(|remark| Term::text("", remark)));
    items.extend(model.mesh.as_ref().map(|mesh| Term::new("Surface", mesh.in_words()).short("surface")));
    items.extend(model.storage_in_words().map(|rounded| Term::text("storage", rounded)));
    let number = model.body.as_ref().map(|own| format!("body {} of {} in the matrices", own.number, own.of));
    items.extend(number.map(|number| Term::new("Of several", number).short("")));
    let [mass, exact] =
        [units.mass_of(body.mass, 7), format!("{} {}", significant(body.mass, 7), units.mass())];
    // The value in the unit of the model follows if a prefix was chosen.
    let exact = if mass == exact { String::new() } else { format!(" ({exact})") };
    items.extend([
        Term::new("Mass", Inline::from(Span::Strong(mass)).then(exact.as_str()))
            .in_text("mass", units.mass_of(body.mass, 6) + &exact),
        Term::new("Centre of mass", quantity(format!("{centre} (model axes)")))
            .in_text("centre", format!("{centre} (centre of mass, model axes)")),
        Term::new(
            word_as("principal moments of inertia", "Principal inertia"),
            quantity(format!("{inertia} (about the centre of mass)")),
        )
        .in_text("inertia", format!("{inertia} (principal)")),
        Term::new(
            "Inertia tensor",
            quantity(format!(
                "{} {} (about the centre of mass, model axes; xy is -\u{222b}xy dm)",
                tensor(&body.inertia_model),
                units.inertia()
            )),
        )
        .short("tensor"),
        Term::new(word_as("radius of gyration", "Radii of gyration"), quantity(radii.as_str()))
            .in_text("gyration", format!("{radii} (radii)")),
    ]);
    items.extend(extent(facts.flex_body).map(|extent| {
        let sides = extent.map(|x| significant(x, 4)).join(" × ");
        let largest = significant(facts.flex_body.extent(), 4);
        Term::page(
            "Extent of the nodes",
            format!("{sides} {length} (model axes); largest distance of two nodes {largest} {length}"),
        )
    }));
    let origin = triple(&body.frame_origin, &length);
    items.push(
        Term::new("Body frame", format!("{}; origin {origin}", body.frame))
            .in_text("frame", body.frame.as_str()),
    );
    items.push(Term::page("Body axes", format!("columns of [{x}; {y}; {z}]")));
    items
}

/// Returns the six entries of an inertia tensor: `xx 1, yy 2, zz 3, xy 0, yz 0, xz 0`. Products below the rounding of the
/// moments are zero.
fn tensor(inertia: &[[f64; 3]; 3]) -> String {
    let largest = (0..3).map(|k| inertia[k][k].abs()).fold(0.0, f64::max);
    let entry = |(name, k, l): (&str, usize, usize)| {
        let value = inertia[k][l];
        let value = if value.abs() <= INERTIA_ROUNDING * largest { 0.0 } else { value };
        format!("{name} {}", significant(value, 6))
    };
    [("xx", 0, 0), ("yy", 1, 1), ("zz", 2, 2), ("xy", 0, 1), ("yz", 1, 2), ("xz", 0, 2)].map(entry).join(", ")
}

/// Returns the lengths of the sides of the box around the nodes, along the model axes. Unit: length.
fn extent(body: &FlexBody) -> Option<[f64; 3]> {
    let places = body.nodes().positions.iter().map(|x| body.frame().to_model(*x));
    let (low, high) = places.fold(None, |own: Option<([f64; 3], [f64; 3])>, x| {
        let (low, high) = own.unwrap_or((x, x));
        Some(([0, 1, 2].map(|k| low[k].min(x[k])), [0, 1, 2].map(|k| high[k].max(x[k]))))
    })?;
    Some([0, 1, 2].map(|k| high[k] - low[k]))
}

/// Returns a caution for each approximation in the model, the storage and the units.
fn cautions<'a>(model: &ModelFacts) -> Vec<Block<'a>> {
    let is_lumped = model.mass_structure == MassStructure::Diagonal.name();
    let lumped =
        "The mass matrix of the model is diagonal (lumped): all numbers are exact for this lumped mass only.";
    let assumed = "No units were stated: m, kg, s are assumed.";
    let all = [
        model.approximation.as_ref().map(|remark| format!("Approximation: {remark}.")),
        is_lumped.then(|| lumped.to_owned()),
        model.storage_in_words().map(|rounded| format!("Rounded: {rounded}.")),
        (!model.units.stated).then(|| assumed.to_owned()),
    ];
    all.into_iter().flatten().map(Block::Caution).collect()
}

fn interfaces<'a>(facts: &Facts<'_>) -> Vec<Block<'a>> {
    let interfaces = &facts.model.interfaces;
    if interfaces.is_empty() {
        return Vec::new();
    }
    let (size, unit) = (facts.body.size(), facts.model.units.length());
    let row = |own: &InterfaceFacts| {
        let motion = own.motion_in_words().unwrap_or_else(|| "not known".to_owned());
        let motion = if own.deforms_although_rigid() { Span::Warning(motion) } else { Span::Plain(motion) };
        let point = own.reference_model.map_or_else(|| "none".to_owned(), |x| coordinates(&x, size, &unit));
        let mut row: Vec<Inline> = vec![own.name.as_str().into()];
        row.extend(cells([own.n_nodes.to_string(), own.coupling.unwrap_or("not stated").to_owned(), point]));
        row.push(motion.into());
        row
    };
    let caption = format!("{}, in the order of the file", counted(interfaces.len(), "interface"));
    let heads = ["Name", "Nodes", "Coupling", "Reference point (model axes)", "Motion in the modes"];
    let rows = interfaces.iter().map(row).collect();
    vec![
        heading(word_as("interface", "Interfaces")),
        Block::Table(Table::new(caption, heads, &[0, 2, 3, 4], rows)),
        Block::Terms(listed("interface", interfaces, |own| {
            format!("{}: {}", own.name, own.in_words(size, &unit))
        })),
    ]
}

/// Returns the time and memory of the run.
fn run<'a>(run: &RunFacts) -> Vec<Block<'a>> {
    let times = times(run.wall_seconds, run.cpu_seconds);
    let known = |size: Option<u64>| size.map_or_else(|| "not known".to_owned(), bytes);
    let peak = run.peak_memory_bytes.map(|peak| format!(", peak memory {}", bytes(peak)));
    let expected = run.memory_estimate_bytes.map(|estimate| format!(" ({} expected)", bytes(estimate)));
    let memory = peak.unwrap_or_default() + &expected.unwrap_or_default();
    let threads = counted(run.threads, "thread");
    let phase = |phase: &Phase| {
        let [wall, cpu] = [phase.wall_seconds, phase.cpu_seconds].map(|seconds| significant(seconds, 3));
        format!("{} {wall}/{cpu}", phase.name)
    };
    let phases = run.phases.iter().map(phase).collect::<Vec<_>>().join(", ");
    let mut items: Vec<Term> = Vec::new();
    if !run.phases.is_empty() {
        items.push(Term::text("phases", format!("{phases} s (wall/CPU)")));
    }
    items.extend([
        Term::new("Time", times.as_str()).in_text("total", format!("{times}, {threads}{memory}")),
        Term::page("Threads", run.threads.to_string()),
        Term::page("Instructions", run.instructions.as_str()),
        Term::page("Peak memory", known(run.peak_memory_bytes)),
        Term::page("Memory expected", known(run.memory_estimate_bytes)),
        Term::page("Accuracy", run.accuracy.as_str()),
    ]);
    let output = run.output.as_ref().map(|output| format!("{}, {}", output.name, bytes(output.bytes)));
    items.extend(output.map(|output| Term::new("Flex-body file", output).short("output")));
    let mut blocks = vec![heading("Run"), Block::Terms(items)];
    let mut fold = |summary, caption: &str, heads: &[&str], rows: Vec<Vec<Inline>>| {
        if !rows.is_empty() {
            let table = Table::new(caption, heads.iter().copied(), &[0], rows);
            blocks.push(Block::Fold(summary, vec![Block::Table(table)]));
        }
    };
    let of_phase = |phase: &Phase| {
        cells([phase.name.clone(), duration(phase.wall_seconds), duration(phase.cpu_seconds)])
    };
    fold(
        "Time of each phase",
        "Phases",
        &["Phase", "Wall", "CPU"],
        run.phases.iter().map(of_phase).collect(),
    );
    let counts = run.counters.iter().map(|(name, count)| cells([name.clone(), count.to_string()]));
    fold("Work counts", "Work", &["Counter", "Count"], counts.collect());
    let attempts = attempts(&run.attempts).into_iter().map(cells);
    fold("Attempts to find the modes", "Attempts", &["Algorithm", "Memory", "Outcome"], attempts.collect());
    blocks
}

/// Name, memory and outcome of each attempt: the first that did not fail found the modes, those after it were not made.
fn attempts(attempts: &[SearchAttempt]) -> Vec<[String; 3]> {
    let found = attempts.iter().position(|attempt| attempt.failure.is_none());
    let row = |(at, attempt): (usize, &SearchAttempt)| {
        let outcome = match &attempt.failure {
            Some(failure) => format!("failed: {failure}"),
            None if found == Some(at) => "found the modes".to_owned(),
            None => "not needed".to_owned(),
        };
        [attempt.way.clone(), bytes(attempt.bytes), outcome]
    };
    attempts.iter().enumerate().map(row).collect()
}

/// Returns the inputs and settings of the run.
fn origin<'a>(facts: &Facts<'_>) -> Vec<Block<'a>> {
    let model = &facts.model;
    let files = counted(model.files.len(), "input file");
    let sentence = format!("{} with {files} and these settings gives the same numbers.", facts.generator);
    let mut blocks = vec![heading("How to reproduce"), Block::Paragraph(sentence)];
    if !model.files.is_empty() {
        let row = |file: &flexbody_base::provenance::SourceFile| {
            vec![file.role.as_str().into(), file.name.as_str().into(), Span::Code(file.sha256.clone()).into()]
        };
        let rows = model.files.iter().map(row).collect();
        blocks.push(Block::Table(Table::new("Input files", ["Role", "Name", "SHA-256"], &[0, 1, 2], rows)));
    }
    let settings = serde_json::to_string_pretty(&model.settings).expect("a JSON value is JSON");
    blocks.push(Block::Fold("Settings", vec![Block::Preformatted(settings)]));
    blocks
}

// Lumped masses in the report of a body: their errors in words, as bars, and in all norms.

/// Error at the left end of the bars; smaller errors are negligible. A smaller value adds decades to the
/// axis.
const LOWEST_BAR: f64 = 1e-6;
/// Longest name of a scheme that is aligned with the others in a text.
const LONGEST_SCHEME: usize = 20;

/// Returns the sections about lumped masses.
fn lumped<'a>(facts: &Facts<'_>) -> Vec<Block<'a>> {
    let (lumped, own_modes) = (&facts.lumped, &facts.lumped_modes);
    let mut blocks = Vec::new();
    if !lumped.is_empty() {
        let title = Inline::from("Errors of ").then(word_as("lumped mass", "lumped masses"));
        blocks.push(Block::Heading(title));
        blocks.push(Block::Paragraph(
            "For comparison only: errors that nodal masses instead of the mass matrix would cause in this body, with the same modes:"
                .into(),
        ));
        blocks.push(Block::List(lumped.iter().map(in_words).collect()));
        blocks.extend(judgement(lumped).map(Block::Paragraph));
        blocks.extend(bars(lumped).map(Block::Bars));
        let norms = vec![Block::Table(schemes(lumped)), Block::Table(all_norms(lumped))];
        blocks.push(Block::Fold("All error norms", norms));
        blocks.push(Block::Terms(listed("if lumped", lumped, in_text)));
    }
    if !own_modes.is_empty() {
        blocks.push(heading("Modes computed with lumped masses"));
        blocks.push(Block::Table(lumped_modes(own_modes)));
        let cautions = own_modes.iter().filter(|own| !own.caution.is_empty());
        blocks.extend(cautions.map(|own| Block::Paragraph(format!("{}: {}", own.scheme, own.caution))));
        let longest = own_modes.iter().map(|own| own.scheme.chars().count()).max();
        let column = longest.unwrap_or(0).min(LONGEST_SCHEME);
        blocks.push(Block::Terms(listed("own modes", own_modes, |own| {
            format!("{:column$}  {}", own.scheme, own.in_words())
        })));
    }
    blocks
}

/// Returns the effect of a scheme in words: `Nodal masses from row sums: NEGATIVE masses at 410 nodes, ...`.
fn in_words(lumped: &LumpedFacts) -> Inline {
    let words = scheme_in_words(&lumped.scheme);
    let whose = match LumpedScheme::from_name(&lumped.scheme) {
        Some(LumpedScheme::RowSum) => format!("Nodal masses from {words}:"),
        Some(LumpedScheme::DiagonalScaling) => format!("Nodal masses from the {words}:"),
        Some(LumpedScheme::User) | None => format!("{words}:"),
    };
    let words = lumped.in_words(true);
    let (negative, rest) = match words.split_once(", ") {
        _ if lumped.negative_masses == 0 => ("", words),
        Some((negative, rest)) => (negative, format!(", {rest}")),
        None => (words.as_str(), String::new()),
    };
    let head = Inline::from(Span::Strong(whose)).then(" ");
    let head = if negative.is_empty() { head } else { head.then(Span::Error(negative.to_owned())) };
    head.then(rest + ".")
}

/// Returns the worst norm of every invariant that differs, and the number of negative masses.
fn in_text(lumped: &LumpedFacts) -> String {
    let negative = match lumped.negative_masses {
        0 => String::new(),
        1 => "; NEGATIVE masses of this scheme at 1 node".to_owned(),
        count => format!("; NEGATIVE masses of this scheme at {count} nodes"),
    };
    format!("{}: {}{negative}", lumped.scheme, errors(&lumped.errors))
}

fn errors(errors: &Errors) -> String {
    if errors.worst.is_none() {
        return "not compared".to_owned();
    }
    // NaN, an unknown error, is listed too.
    let listed_norms = errors.worst_by_invariant.iter().filter(|n| n.value.is_nan() || n.value > NEGLIGIBLE);
    let text = |n: &ErrorNorm| format!("{} {}", n.invariant.replace('_', " "), percent(n.value));
    let listed_norms: Vec<String> = listed_norms.map(|n| text(n).replace(' ', KEEP)).collect();
    if listed_norms.is_empty() {
        "no error above 1e-9".to_owned()
    } else {
        format!("errors {}", listed_norms.join(", "))
    }
}

/// Returns bars with the worst norm of each invariant for each scheme; `None` if there are no errors to draw.
fn bars(lumped: &[LumpedFacts]) -> Option<Bars> {
    let norms = || lumped.iter().flat_map(|own| &own.errors.worst_by_invariant);
    let invariants = distinct(norms().map(|norm| norm.invariant.as_str()));
    let values = norms().map(|norm| norm.value).chain([LOWEST_BAR, 1.0]);
    let axis =
        Axis::decades("", values.filter(|value| *value >= LOWEST_BAR), f64::INFINITY)?.with_labels(percent);
    let group = |invariant: &&str| {
        let bar = |(style, own): (usize, &LumpedFacts)| {
            // The last of several norms of one name counts, as in a table by names.
            let norm =
                own.errors.worst_by_invariant.iter().rev().find(|norm| norm.invariant == *invariant)?;
            Some(Bar {
                style,
                value: norm.value,
                label: percent(norm.value),
                name: scheme_in_words(&own.scheme).to_owned(),
            })
        };
        (invariant_in_words(invariant), lumped.iter().enumerate().filter_map(bar).collect())
    };
    (!invariants.is_empty()).then(|| Bars {
        description: "Bar chart of the worst relative error of each invariant; the numbers are in the table below.".to_owned(),
        caption: "Relative errors: the worst norm of each invariant, on a logarithmic axis. Errors below its left end have no bar.".to_owned(),
        axis,
        groups: invariants.iter().map(group).collect(),
    })
}

/// Returns the worst norm of a scheme, and its invariant and kind.
fn worst(errors: &Errors, unknown: &str) -> [String; 2] {
    let worst = errors.worst.as_ref();
    let value = worst.map_or_else(|| unknown.to_owned(), |norm| percent(norm.value));
    [value, worst.map_or_else(String::new, |norm| format!("{}, {}", norm.invariant, norm.kind()))]
}

/// Returns the table of worst errors and negative masses of every scheme.
fn schemes(lumped: &[LumpedFacts]) -> Table {
    let row = |own: &LumpedFacts| {
        let count = own.negative_masses.to_string();
        let negative = if own.negative_masses == 0 { Span::Plain(count) } else { Span::Error(count) };
        let [value, of] = worst(&own.errors, "not compared").map(Inline::from);
        vec![own.scheme.as_str().into(), negative.into(), value, of]
    };
    let heads = ["Scheme", "Negative masses", "Worst error", "Of"];
    Table::new("Schemes", heads, &[0, 3], lumped.iter().map(row).collect())
}

/// Returns the table of every norm of every scheme.
fn all_norms(lumped: &[LumpedFacts]) -> Table {
    let norms = lumped.iter().flat_map(|own| &own.errors.error_norms.0);
    let names = distinct(norms.map(|(name, _)| name.as_str()));
    let schemes = lumped.iter().map(|own| own.scheme.as_str());
    let heads: Vec<&str> =
        std::iter::once("Norm").chain(schemes).chain(["Meaning (X exact, D lumped minus exact)"]).collect();
    let row = |name: &&str| {
        let value = |own: &LumpedFacts| {
            let norm = own.errors.error_norms.0.iter().rev().find(|(known, _)| known == name);
            norm.map_or_else(String::new, |(_, value)| percent(*value)).into()
        };
        let meaning = ERROR_NORMS.iter().find(|(known, _)| known == name).map_or("", |(_, meaning)| meaning);
        std::iter::once((*name).into()).chain(lumped.iter().map(value)).chain([meaning.into()]).collect()
    };
    let rows = names.iter().map(row).collect();
    let last = heads.len() - 1;
    Table::new("All error norms", heads, &[0, last], rows)
}

/// Returns the table of the modes computed from the lumped masses.
fn lumped_modes(lumped: &[LumpedModesFacts]) -> Table {
    let row = |own: &LumpedModesFacts| {
        let none = String::new;
        if !own.done {
            return cells([own.scheme.clone(), none(), none(), none(), own.remark.clone()]);
        }
        let change = own.worst_frequency_change.zip(own.worst_frequency_mode);
        let change = change.map_or_else(none, |(change, mode)| format!("{} (mode {mode})", percent(change)));
        let [value, of] = worst(&own.errors, "");
        cells([own.scheme.clone(), change, significant(own.subspace_cosine, 5), value, of])
    };
    let heads = [
        "Scheme",
        "Worst frequency",
        "Subspace cosine",
        "Worst error",
        "Number of modes, or reason why none",
    ];
    let caption = "Frequencies in ascending order; invariants after alignment of the subspaces";
    Table::new(caption, heads, &[0, 4], lumped.iter().map(row).collect())
}
