//! The report of a body as one web page: nothing loaded from elsewhere, readable without scripts, on a phone
//! and on paper.

use super::Facts;
use super::glossary::glossary;
use super::heat_map::heat_maps;
use super::html_body::body;
use super::html_lumped::{lumped, lumped_modes};
use super::html_modes::modes;
use super::markup::{Page, diagnostics_table, escape, fold, section, sentence, table, terms, texts};
use super::numbers::{bytes, counted, duration, significant};
use super::picture::Embedded;
use flexbody_base::diagnostic::Severity;

const STYLE: &str = include_str!("picture/embedded.css");

pub(super) fn render(facts: &Facts<'_>) -> String {
    let picture = Embedded::of(facts.flex_body);
    let mut html = String::new();
    verdict(&mut html, facts);
    body(&mut html, facts, picture.as_ref().map(|picture| picture.panel.as_str()));
    // What is to be minded stands before everything that rests on it.
    let urgent = facts.diagnostics.iter().any(|found| found.severity() != Severity::Note);
    if urgent {
        diagnostics_table(&mut html, &facts.diagnostics);
    }
    modes(&mut html, facts);
    lumped(&mut html, facts);
    lumped_modes(&mut html, facts);
    heat_maps(&mut html, facts.flex_body);
    if !urgent {
        diagnostics_table(&mut html, &facts.diagnostics);
    }
    run(&mut html, facts);
    origin(&mut html, facts);
    glossary(&mut html);
    let page = Page { name: &facts.model.name, kind: "Flexible body report", generator: &facts.generator };
    page.with(STYLE, &html, picture.as_ref().map_or("", |picture| picture.scripts.as_str()))
}

fn verdict(html: &mut String, facts: &Facts<'_>) {
    let c = &facts.completeness;
    let class = match c.verdict {
        "proved" => "",
        "given" => " given",
        _ => " open",
    };
    let free = facts.modes.craig_bampton.as_ref().map(|craig_bampton| {
        let holds = craig_bampton.holds(&facts.modes.frequency_hz);
        format!(" {}.", escape(&sentence(&holds)))
    });
    html.push_str(&format!(
        "<p class=\"verdict{class}\"><strong>{}</strong> {} flexible modes, {} to {} Hz. {}.{}</p>\n",
        c.head,
        facts.modes.count,
        facts.modes.frequency_hz.first().map_or_else(String::new, |f| significant(*f, 5)),
        facts.modes.frequency_hz.last().map_or_else(String::new, |f| significant(*f, 5)),
        escape(&sentence(&c.sentence)),
        free.unwrap_or_default(),
    ));
}

fn run(html: &mut String, facts: &Facts<'_>) {
    let Some(run) = &facts.run else { return };
    section(html, "Run");
    let mut items = vec![
        ("Time", format!("{} wall, {} CPU", duration(run.wall_seconds), duration(run.cpu_seconds))),
        ("Threads", run.threads.to_string()),
        ("Peak memory", run.peak_memory_bytes.map_or_else(|| "not known".to_owned(), bytes)),
        ("Memory expected", run.memory_estimate_bytes.map_or_else(|| "not known".to_owned(), bytes)),
        ("Accuracy", escape(&run.accuracy)),
    ];
    if let Some(output) = &run.output {
        items.push(("Flex-body file", format!("{}, {}", escape(&output.name), bytes(output.bytes))));
    }
    terms(html, items);
    if !run.phases.is_empty() {
        let row = |p: &super::Phase| vec![escape(&p.name), duration(p.wall_seconds), duration(p.cpu_seconds)];
        let rows: Vec<_> = run.phases.iter().map(row).collect();
        let mut phases = String::new();
        table(&mut phases, "Phases", &texts(["Phase", "Wall", "CPU"]), &[0], &rows);
        fold(html, "Time of each phase", &phases);
    }
    if !run.counters.is_empty() {
        let rows: Vec<_> = run.counters.iter().map(|(name, n)| vec![escape(name), n.to_string()]).collect();
        let mut work = String::new();
        table(&mut work, "Work", &texts(["Counter", "Count"]), &[0], &rows);
        fold(html, "Work counts", &work);
    }
}

fn origin(html: &mut String, facts: &Facts<'_>) {
    section(html, "How to reproduce");
    let model = &facts.model;
    html.push_str(&format!(
        "<p>{} with {} and these settings gives the same numbers.</p>\n",
        escape(&facts.generator),
        counted(model.files.len(), "input file"),
    ));
    let rows: Vec<_> = model
        .files
        .iter()
        .map(|f| vec![escape(&f.role), escape(&f.name), format!("<code>{}</code>", escape(&f.sha256))])
        .collect();
    if !rows.is_empty() {
        table(html, "Input files", &texts(["Role", "Name", "SHA-256"]), &[0, 1, 2], &rows);
    }
    let settings = serde_json::to_string_pretty(&model.settings).expect("a JSON value is JSON");
    let lines: Vec<String> = settings.lines().map(escape).collect();
    fold(html, "Settings", &format!("<pre>{}</pre>\n", lines.join("\n")));
}
