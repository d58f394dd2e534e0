//! Lumped masses in the report of a body: their errors in words, as bars, and in all norms.

use super::chart::{Axis, Bar, Bars};
use super::document::{Block, Inline, Span, Table, cells, heading, listed};
use super::facts::Facts;
use super::glossary::word_as;
use super::lumped::{ErrorNorm, Errors, LumpedFacts, LumpedModesFacts, distinct};
use super::lumped_effect::{NEGLIGIBLE, scheme_in_words};
use super::numbers::{percent, significant};
use super::text::KEEP;
use flexbody_body::invariants::{ERROR_NORMS, LumpedScheme};

/// Error at the left end of the bars; smaller errors are negligible. A smaller value adds decades to the
/// axis.
const LOWEST_BAR: f64 = 1e-6;
/// Longest name of a scheme that is aligned with the others in a text.
const LONGEST_SCHEME: usize = 20;

/// Returns the sections about lumped masses.
pub(super) fn lumped<'a>(facts: &Facts<'_>) -> Vec<Block<'a>> {
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

/// Returns the effect of a scheme in words: `Nodal masses from row sums: 410 NEGATIVE masses, ...`.
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
        1 => "; 1 NEGATIVE mass".to_owned(),
        count => format!("; {count} NEGATIVE masses"),
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
            Some(Bar { style, value: norm.value, label: percent(norm.value), name: own.scheme.clone() })
        };
        ((*invariant).to_owned(), lumped.iter().enumerate().filter_map(bar).collect())
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
