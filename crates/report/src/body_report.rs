//! Report of a body.

use super::body_lumped::lumped;
use super::body_modes::modes;
use super::document::{Block, Document, Inline, Span, State, Table, Term, cells, heading, listed, quantity};
use super::facts::{Facts, InterfaceFacts, ModelFacts, RunFacts};
use super::glossary::{glossary, word_as};
use super::heat_map::heat_maps;
use super::numbers::{
    bytes, coordinates, counted, duration, frequency, frequency_range, sentence, significant, times, triple,
};
use super::run_data::{Phase, SearchAttempt};
use flexbody_base::diagnostic::Severity;
use flexbody_body::flex_body::{FlexBody, MassStructure};

/// Builds the report of a body.
pub(super) fn document<'f>(facts: &'f Facts<'_>) -> Document<'f> {
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
    let free =
        modes.craig_bampton.as_ref().map(|own| format!(" {}.", sentence(&own.holds(&modes.frequency_hz))));
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
        Term::new(word_as("radius of gyration", "Radii of gyration"), quantity(radii.as_str()))
            .in_text("gyration", format!("{radii} (radii)")),
    ]);
    items.extend(extent(facts.flex_body).map(|extent| {
        let sides = extent.map(|x| significant(x, 4)).join(" × ");
        Term::page("Extent of the nodes", format!("{sides} {length} (model axes)"))
    }));
    let origin = triple(&body.frame_origin, &length);
    items.push(
        Term::new("Body frame", format!("{}; origin {origin}", body.frame))
            .in_text("frame", body.frame.as_str()),
    );
    items.push(Term::page("Body axes", format!("columns of [{x}; {y}; {z}]")));
    items
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
