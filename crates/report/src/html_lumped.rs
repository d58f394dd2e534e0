//! What lumped masses would have cost, in the report of a body: in plain words, as bars, and in all norms.

use super::Facts;
use super::bar_chart::bar_chart;
use super::glossary::word_as;
use super::lumped::{LumpedFacts, distinct};
use super::lumped_effect::scheme_in_words;
use super::markup::{escape, fold, section, table, texts};
use super::numbers::{percent, significant};
use flexbody_body::invariants::{ERROR_NORMS, LumpedScheme};
use std::collections::HashMap;

/// The section about lumped masses; nothing without any.
pub(super) fn lumped(html: &mut String, facts: &Facts<'_>) {
    if facts.lumped.is_empty() {
        return;
    }
    section(html, &format!("What {} would have cost", word_as("lumped mass", "lumped masses")));
    html.push_str("<p>The same modes with nodal masses instead of the mass matrix:</p>\n<ul>\n");
    for lumped in &facts.lumped {
        html.push_str(&format!("<li>{}</li>\n", in_words(lumped)));
    }
    html.push_str("</ul>\n");
    let chart = bar_chart(&facts.lumped);
    if !chart.is_empty() {
        html.push_str(&format!(
            "<figure>\n{chart}<figcaption>Relative errors, the worst norm of each invariant. Logarithmic axis; errors below its left end have no bar.</figcaption>\n</figure>\n"
        ));
    }
    let mut norms = String::new();
    schemes(&mut norms, &facts.lumped);
    all_norms(&mut norms, &facts.lumped);
    fold(html, "All error norms", &norms);
}

/// `Nodal masses from row sums: 410 NEGATIVE masses, ...`.
fn in_words(lumped: &LumpedFacts) -> String {
    let words = scheme_in_words(&lumped.scheme);
    let whose = match LumpedScheme::from_name(&lumped.scheme) {
        Some(LumpedScheme::RowSum) => format!("Nodal masses from {words}"),
        Some(LumpedScheme::DiagonalScaling) => format!("Nodal masses from the {words}"),
        Some(LumpedScheme::User) | None => words.to_owned(),
    };
    let words = escape(&lumped.in_words(true));
    let words = match (lumped.negative_masses, words.split_once(", ")) {
        (0, _) => words,
        (_, Some((negative, rest))) => format!("<span class=\"error\">{negative}</span>, {rest}"),
        (_, None) => format!("<span class=\"error\">{words}</span>"),
    };
    format!("<strong>{}:</strong> {words}.", escape(&whose))
}

/// Worst error and negative masses of every scheme.
fn schemes(html: &mut String, lumped: &[LumpedFacts]) {
    let row = |l: &LumpedFacts| {
        let worst = l.errors.worst.as_ref();
        let negative = match l.negative_masses {
            0 => "0".to_owned(),
            count => format!("<span class=\"error\">{count}</span>"),
        };
        vec![
            escape(&l.scheme),
            negative,
            worst.map_or_else(|| "not compared".to_owned(), |n| percent(n.value)),
            worst.map_or_else(String::new, |n| escape(&format!("{}, {}", n.invariant, n.kind()))),
        ]
    };
    let rows: Vec<_> = lumped.iter().map(row).collect();
    table(html, "Schemes", &texts(["Scheme", "Negative masses", "Worst error", "Of"]), &[0, 3], &rows);
}

/// Every norm of every scheme.
fn all_norms(html: &mut String, lumped: &[LumpedFacts]) {
    let norms: Vec<HashMap<&str, f64>> = lumped
        .iter()
        .map(|l| l.errors.error_norms.0.iter().map(|(name, value)| (name.as_str(), *value)).collect())
        .collect();
    let names = distinct(lumped.iter().flat_map(|l| &l.errors.error_norms.0).map(|(name, _)| name.as_str()));
    let head: Vec<String> = std::iter::once("Norm".to_owned())
        .chain(lumped.iter().map(|l| escape(&l.scheme)))
        .chain(["Meaning (X exact, D lumped minus exact)".to_owned()])
        .collect();
    let row = |name: &&str| {
        let value = |norms: &HashMap<&str, f64>| norms.get(name).map_or_else(String::new, |v| percent(*v));
        let meaning = ERROR_NORMS.iter().find(|(known, _)| known == name).map_or("", |(_, meaning)| meaning);
        std::iter::once(escape(name)).chain(norms.iter().map(value)).chain([escape(meaning)]).collect()
    };
    let rows: Vec<Vec<String>> = names.iter().map(row).collect();
    table(html, "All error norms", &head, &[0, head.len() - 1], &rows);
}

/// Modes from the lumped masses, where they were asked for.
pub(super) fn lumped_modes(html: &mut String, facts: &Facts<'_>) {
    if facts.lumped_modes.is_empty() {
        return;
    }
    section(html, "Modes from the lumped masses too");
    let rows: Vec<_> = facts
        .lumped_modes
        .iter()
        .map(|l| {
            if !l.done {
                return vec![
                    escape(&l.scheme),
                    String::new(),
                    String::new(),
                    String::new(),
                    escape(&l.remark),
                ];
            }
            let change = l.worst_frequency_change.zip(l.worst_frequency_mode);
            vec![
                escape(&l.scheme),
                change.map_or_else(String::new, |(c, mode)| format!("{} (mode {mode})", percent(c))),
                significant(l.subspace_cosine, 5),
                l.errors.worst.as_ref().map_or_else(String::new, |n| percent(n.value)),
                l.errors
                    .worst
                    .as_ref()
                    .map_or_else(String::new, |n| escape(&format!("{}, {}", n.invariant, n.kind()))),
            ]
        })
        .collect();
    let head = ["Scheme", "Worst frequency", "Subspace cosine", "Worst error", "Of, or why not done"];
    table(
        html,
        "Frequencies in ascending order; invariants after alignment of the subspaces",
        &texts(head),
        &[0, 4],
        &rows,
    );
    for lumped in facts.lumped_modes.iter().filter(|lumped| !lumped.caution.is_empty()) {
        html.push_str(&format!("<p>{}: {}</p>\n", escape(&lumped.scheme), escape(&lumped.caution)));
    }
}
