//! Summary of a body on one screen: properties, completeness of the modes, errors of lumped masses. Warnings and notes
//! are printed apart.

use super::craig_bampton::CraigBamptonFacts;
use super::facts::{Facts, InterfaceFacts, RecoveryFacts, RunFacts};
use super::lumped::{LumpedFacts, LumpedModesFacts, scheme_in_words};
use super::named_loads::NamedLoadFacts;
use crate::document::text::{self, Screen};
use crate::document::{Block, Term, Tone, html, listed_to};
use crate::notation::numbers::{
    bytes, coordinates, counted, duration, frequencies, frequency, frequency_range, triple,
};
use flexbody_body::flex_body::MassStructure;

/// Number of list entries that are shown.
const MAX_LISTED: usize = 4;

/// Number of frequencies shown before the last.
const FIRST_FREQUENCIES: usize = 6;

/// Renders the summary for a screen.
pub fn summary(facts: &Facts<'_>, screen: Screen) -> String {
    let groups = [body, mass_properties, modes, lumped, output];
    let blocks: Vec<Block<'_>> =
        groups.iter().flat_map(|group| [Block::Terms(group(facts)), Block::Gap]).collect();
    text::render(&blocks, screen)
}

/// Renders the summary as a fragment of a page, without scripts and styles, as a notebook shows it.
pub fn summary_html(facts: &Facts<'_>) -> String {
    let groups = [body, mass_properties, modes, lumped];
    let shown = groups.iter().flat_map(|group| group(facts));
    let items: Vec<Term> = shown.map(|term| Term { is_in_page: true, ..term }).collect();
    html::terms(&items).into_string()
}

fn entry(tone: Tone, label: &str, value: impl Into<String>, lines: usize) -> Term {
    Term::text(label, value).shown(tone, lines)
}

fn body(facts: &Facts<'_>) -> Vec<Term> {
    let model = &facts.model;
    let warned_if = |is_unusual: bool| if is_unusual { Tone::Warning } else { Tone::Plain };
    let number = model.body.as_ref().map_or(String::new(), |b| format!(", body {} of {}", b.number, b.of));
    let tone = if model.units.stated { Tone::Title } else { Tone::Warning };
    let title = format!("{}{number} ({})", model.name, model.units.in_words());
    let plane = if model.dimension == 2 { ", PLANE model" } else { "" };
    let is_lumped = model.mass_structure == MassStructure::Diagonal.name();
    let size = match &model.approximation {
        Some(_) => model.nodes_in_words(),
        None => model.size_in_words(),
    };
    let size = entry(warned_if(is_lumped || !plane.is_empty()), "model", size + plane, 3);
    let mut items = vec![entry(tone, "body", title, 2), size];
    if model.approximation.is_some() {
        let remark = "W1, W2 and W3 take a part of the mass as fixed to the axes of the body; everything else is exact";
        items.push(entry(Tone::Warning, "approximate", remark, 2));
    }
    items.extend(model.storage_in_words().map(|rounded| entry(Tone::Warning, "storage", rounded, 2)));
    if !model.interfaces.is_empty() {
        let (size, unit) = (facts.body.size(), model.units.length());
        let all: Vec<String> = model.interfaces.iter().map(|one| interface(one, size, &unit)).collect();
        let bends = model.interfaces.iter().any(InterfaceFacts::deforms_although_rigid);
        items.push(entry(warned_if(bends), "interfaces", all.join("; "), if bends { 6 } else { 4 }));
    }
    if !model.recoveries.is_empty() {
        let all: Vec<String> = model.recoveries.iter().map(RecoveryFacts::in_words).collect();
        items.push(entry(Tone::Plain, "recovery", all.join("; "), 4));
    }
    if !model.named_loads.is_empty() {
        let all: Vec<String> = model.named_loads.iter().map(NamedLoadFacts::in_words).collect();
        items.push(entry(Tone::Plain, "loads", all.join("; "), 4));
    }
    items
}

/// Returns an interface in words, `bore: 80 nodes, rigid, at 0, 0, 12.5 mm`; the point is in model axes.
fn interface(interface: &InterfaceFacts, size: f64, unit: &str) -> String {
    let coupling = interface.coupling.map_or(String::new(), |name| format!(", {name}"));
    let bends = if interface.deforms_although_rigid() { " but DEFORMS" } else { "" };
    let place = interface.place_in_words(size, unit);
    format!("{}: {}{coupling}{bends}{place}", interface.name, counted(interface.n_nodes, "node"))
}

fn mass_properties(facts: &Facts<'_>) -> Vec<Term> {
    let (body, units) = (&facts.body, &facts.model.units);
    let centre = coordinates(&body.centre_of_mass, body.size(), &units.length());
    let inertia = triple(&body.principal_inertia, &units.inertia());
    let mass = format!("{} at {centre} (model axes)", units.mass_of(body.mass, 6));
    let mut items = vec![
        entry(Tone::Plain, "mass", mass, 2),
        entry(Tone::Plain, "inertia", format!("{inertia} (principal)"), 2),
    ];
    items.extend((!body.in_mean_axes).then(|| entry(Tone::Plain, "frame", body.frame.as_str(), 3)));
    items
}

fn modes(facts: &Facts<'_>) -> Vec<Term> {
    let (modes, completeness) = (&facts.modes, &facts.completeness);
    let range = match modes.frequency_hz.as_slice() {
        [] => String::new(),
        [only] => format!(", {}", frequency(*only, 5)),
        [first, .., last] => format!(", {}", frequency_range([*first, *last], 5)),
    };
    let reduced = modes.craig_bampton.as_ref();
    let origins = modes.origins();
    let kinds = match reduced {
        // The modes of a Craig-Bampton body are combinations of fixed-interface modes and interface motions.
        Some(own) => format!(": {}", own.made_of()),
        None if origins.is_empty() => String::new(),
        None => {
            let kinds = origins.iter().map(|(origin, count)| format!("{count} x {origin}"));
            format!(" ({})", kinds.collect::<Vec<_>>().join(", "))
        }
    };
    let mut items = vec![entry(Tone::Plain, "modes", format!("{} flexible{range}{kinds}", modes.count), 3)];
    let held = reduced.and_then(CraigBamptonFacts::held_hz);
    let held = held.map(|hz| first_and_last(hz) + " (fixed-interface modes)");
    items.extend(held.map(|held| entry(Tone::Plain, "held", held, 2)));
    let sentence = completeness.sentence.as_str();
    items.push(match (completeness.verdict, sentence.strip_prefix("proved: ")) {
        ("proved", Some(proof)) => entry(Tone::Good, "proved", proof, 4),
        ("given", _) => entry(Tone::Plain, "complete", sentence, 4),
        _ => entry(Tone::Bad, "complete", sentence, 4),
    });
    items.extend(facts.guarantee.as_ref().map(|own| entry(Tone::Good, "guaranteed", own.eigenvalues(), 3)));
    let free = reduced.and_then(|own| own.holds(&modes.frequency_hz));
    items.extend(free.map(|holds| entry(Tone::Plain, "free body", holds, 3)));
    items.extend(modes.damping.as_ref().map(|own| entry(Tone::Plain, "damping", own.in_words(), 2)));
    items.extend(
        modes.inertia_stiffness.as_ref().map(|own| entry(Tone::Plain, "inertia K", own.in_words(), 3)),
    );
    items.extend(modes.missing_stiffness.as_ref().map(|words| entry(Tone::Plain, "spin", words.as_str(), 4)));
    items.extend(modes.stress_stiffness.as_ref().map(|own| entry(Tone::Good, "stress K", own.as_str(), 3)));
    let dropped: Vec<_> = facts.terms.iter().filter(|term| !term.kept).collect();
    items.extend(listed_to(MAX_LISTED, "left out", &dropped, |term| {
        entry(Tone::Warning, "left out", term.in_words(), 3)
    }));
    items
}

fn lumped(facts: &Facts<'_>) -> Vec<Term> {
    let mut items = listed_to(MAX_LISTED, "if lumped", &facts.lumped, |lumped: &LumpedFacts| {
        let tone = if lumped.negative_masses > 0 { Tone::Warning } else { Tone::Plain };
        let words = format!("{}: {}", scheme_in_words(&lumped.scheme), lumped.in_words(false));
        entry(tone, "if lumped", words, 3)
    });
    items.extend(listed_to(MAX_LISTED, "own modes", &facts.lumped_modes, |lumped: &LumpedModesFacts| {
        let words = format!("{}: {}", scheme_in_words(&lumped.scheme), lumped.in_words());
        entry(Tone::Plain, "own modes", words, 3)
    }));
    items
}

fn output(facts: &Facts<'_>) -> Vec<Term> {
    let written = |run: &RunFacts| {
        let took = format!("in {}", duration(run.wall_seconds));
        match &run.output {
            Some(output) => {
                let mut file = format!("{}, {}", output.name, bytes(output.bytes));
                // Commands without phases measure no time.
                if run.wall_seconds > 0.0 {
                    file = format!("{file}, {took}");
                }
                entry(Tone::Plain, "file", file, 4)
            }
            None => entry(Tone::Plain, "done", took, 1),
        }
    };
    facts.run.iter().map(written).collect()
}

/// Returns the first frequencies and the last: `812.5 812.5 1204 1890.2 2411 3020 ... 4412.5 Hz`.
fn first_and_last(hz: &[f64]) -> String {
    let (all, unit) = frequencies(hz, 5);
    let last = all.last().filter(|_| hz.len() > FIRST_FREQUENCIES);
    let dots = if hz.len() > FIRST_FREQUENCIES + 1 { " ..." } else { "" };
    let last = last.map_or(String::new(), |last| format!("{dots} {last}"));
    format!("{}{last} {unit}", all[..all.len().min(FIRST_FREQUENCIES)].join(" "))
}
