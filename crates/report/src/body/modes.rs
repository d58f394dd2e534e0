//! Modes in the report of a body: frequencies, completeness, truncation errors.

use super::completeness::{Completeness, GuaranteeFacts, cut};
use super::craig_bampton::CraigBamptonFacts;
use super::facts::{Facts, ModeFacts};
use super::glossary::{word, word_as};
use super::held::HeldFacts;
use crate::document::{Block, Inline, Table, Term, cells, heading, listed, quantity};
use crate::notation::numbers::{counted, frequencies as frequencies_of, frequency, percent, significant};
use flexbody_body::basis::BasisKind;
use flexbody_body::flex_body::Truncation;

/// Returns the section about the modes.
pub(super) fn modes<'a>(facts: &Facts<'_>) -> Vec<Block<'a>> {
    let modes = &facts.modes;
    let mut blocks =
        vec![Block::Terms(in_short(facts)), heading("Frequencies"), Block::Table(frequencies(facts))];
    blocks.extend(modes.craig_bampton.as_ref().and_then(CraigBamptonFacts::held_hz).map(held_frequencies));
    blocks.extend(modes.held.iter().map(HeldFacts::block));
    blocks.extend(truncation(&modes.truncation));
    blocks.push(Block::Heading(Inline::from(word_as("completeness", "Completeness")).then(" of the modes")));
    blocks.push(Block::Terms(completeness(facts)));
    if !modes.geometric_stiffness.is_empty() {
        let rows = modes
            .geometric_stiffness
            .iter()
            .map(|g| cells([g.load.clone(), significant(g.relative_norm, 3)]));
        let caption = Inline::from(word_as("geometric stiffness", "Geometric stiffness"))
            .then(": largest relative change of the stiffness of a motion by one unit of the load");
        blocks.push(Block::Table(Table::new(caption, ["Load (body axes)", "Part"], &[0], rows.collect())));
    }
    if let Some(guarantee) = &facts.guarantee {
        let rows =
            guarantee.invariant_digits.iter().map(|(name, digits)| cells([(*name).to_owned(), cut(*digits)]));
        let caption = "Guaranteed digits of the invariants, worst entry relative to its Cauchy-Schwarz bound";
        blocks.push(Block::Table(Table::new(caption, ["Invariant", "Digits"], &[0], rows.collect())));
    }
    blocks
}

/// Returns all frequencies: `812.5 812.5 1204 1890.2 Hz`.
fn all_of(hz: &[f64]) -> String {
    let (all, unit) = frequencies_of(hz, 5);
    format!("{} {unit}", all.join(" "))
}

/// Returns the terms about the modes in a text.
fn in_short(facts: &Facts<'_>) -> Vec<Term> {
    let modes = &facts.modes;
    let accuracy = facts.run.as_ref().map(|run| run.accuracy.as_str()).filter(|name| !name.is_empty());
    let accuracy = accuracy.map_or(String::new(), |name| format!(", {name} accuracy"));
    let residual = significant(modes.worst_residual, 2) + modes.residual_remark();
    let mut items = vec![
        Term::text("modes", format!("{} flexible, worst residual {residual}{accuracy}", modes.count)),
        Term::text("frequency", all_of(&modes.frequency_hz)),
    ];
    let (body, reduced) = (facts.flex_body, modes.craig_bampton.as_ref());
    if let Some(basis) = body.basis_name().filter(|_| body.basis() != Some(BasisKind::Free)) {
        let made_of = reduced.map_or(String::new(), |own| format!(": {}", own.made_of()));
        items.push(Term::text("basis", format!("{basis}{made_of}")));
    }
    let held = reduced.and_then(CraigBamptonFacts::held_hz);
    items.extend(held.map(|hz| Term::text("held", all_of(hz) + " (fixed-interface modes)")));
    // The modes of a Craig-Bampton body are combinations of several kinds of shapes.
    let share = if reduced.is_some() { " with the largest share of a " } else { ": " };
    items.extend(listed("origin", &modes.origins(), |(origin, count)| {
        format!("{}{share}{origin}", counted(*count, "mode"))
    }));
    items
}

/// Returns the table of the modes.
fn frequencies(facts: &Facts<'_>) -> Table {
    let modes = &facts.modes;
    let caption = match &modes.craig_bampton {
        Some(own) if own.free.is_none() => {
            "Modes of the reduced body, held at the interface of the frame, ascending"
        }
        Some(_) => "Modes of the reduced body, ascending, with the estimated frequencies of the free body",
        None => "Flexible modes, ascending",
    };
    // Without damping the column would hold zeros only.
    let is_damped = modes.damping_ratio.iter().any(|&ratio| ratio != 0.0);
    let has_origins = !modes.origins().is_empty();
    let mut heads: Vec<Inline> = vec!["Mode".into(), "Frequency (Hz)".into()];
    heads.push(quantity(format!("Eigenvalue (1/{}^2)", facts.model.units.time)));
    match &modes.craig_bampton {
        // The modes are no eigenvectors of the FE model, of which a residual would tell.
        Some(own) if own.free.is_none() => {}
        Some(_) => heads.extend(["Free body (Hz)", "Too high by about", "At most"].map(Inline::from)),
        None => heads.push(word_as("residual", "Residual").into()),
    }
    heads.extend(is_damped.then(|| "Damping ratio".into()));
    let origins = heads.len();
    heads.extend(has_origins.then(|| "Origin".into()));
    if facts.guarantee.is_some() {
        heads.extend(["Lower bound", "Upper bound", "Digits", "Shape error"].map(Inline::from));
    }
    let row = |j: usize| {
        let mut row = cells([
            (j + 1).to_string(),
            significant(modes.frequency_hz[j], 8),
            significant(modes.eigenvalue[j], 8),
        ]);
        row.extend(accuracy_of_mode(modes, j));
        row.extend(is_damped.then(|| significant(modes.damping_ratio[j], 4).into()));
        row.extend(has_origins.then(|| origin(&modes.provenance[j])));
        row.extend(facts.guarantee.iter().flat_map(|guarantee| bounds(guarantee, j)));
        row
    };
    let words = if has_origins { &[origins][..] } else { &[] };
    Table::new(caption, heads, words, (0..modes.count).map(row).collect())
}

/// Returns the cells of the residual of a mode or, for a Craig-Bampton body, of its frequency error relative
/// to the free body.
fn accuracy_of_mode(modes: &ModeFacts, j: usize) -> Vec<Inline> {
    match modes.craig_bampton.as_ref().map(|own| &own.free) {
        Some(Some(free)) => cells([
            significant(free.free_hz[j], 8),
            percent(free.too_high[j]),
            free.too_high_at_most[j].map_or_else(|| "no bound".to_owned(), percent),
        ]),
        Some(None) => Vec::new(),
        None => cells([modes.residual_in_words(j)]),
    }
}

fn bounds(guarantee: &GuaranteeFacts, j: usize) -> Vec<Inline> {
    cells([
        significant(guarantee.eigenvalue_lower[j], 17),
        significant(guarantee.eigenvalue_upper[j], 17),
        cut(guarantee.eigenvalue_digits[j]),
        significant(guarantee.shape_error[j], 2),
    ])
}

/// Returns the origin of a mode; a kind of shape in the glossary carries its explanation.
fn origin(provenance: &str) -> Inline {
    match provenance.split_once(':') {
        Some((kind, rest)) => Inline::from(word(kind)).then(format!(":{rest}")),
        None => word(provenance).into(),
    }
}

/// Returns the table of the fixed-interface modes of a Craig-Bampton body.
fn held_frequencies<'a>(hz: &[f64]) -> Block<'a> {
    let rows = (1..).zip(hz).map(|(j, hz)| cells([format!("{j}"), significant(*hz, 8)])).collect();
    let caption = "Fixed-interface modes of the basis: natural frequencies with all interfaces held";
    Block::Table(Table::new(caption, ["Fixed-interface mode", "Frequency (Hz)"], &[], rows))
}

/// Returns the truncation errors of the static responses of the modes.
fn truncation<'a>(loads: &[Truncation]) -> Vec<Block<'a>> {
    if loads.is_empty() {
        return Vec::new();
    }
    // Equal errors before and after belong to a load of an interface without residual vectors.
    let has_none = |t: &Truncation| t.before == t.after;
    let after = |t: &Truncation| if has_none(t) { "-".to_owned() } else { significant(t.after, 3) };
    let rows = loads.iter().map(|t| cells([t.load.clone(), significant(t.before, 3), after(t)])).collect();
    let with = Inline::from("With ").then(word_as("residual vector", "residual vectors"));
    let heads = ["Load".into(), "Free modes alone".into(), with];
    let listed = listed("static", loads, |t| {
        let with = format!(", {} with residual vectors", significant(t.after, 2));
        let with = if has_none(t) { "" } else { &with };
        format!("{}: relative error {} with free modes alone{with}", t.load, significant(t.before, 2))
    });
    let caption = "Static responses: relative error with the modes, in the norm of K; its square is the missing part of the compliance";
    vec![Block::Table(Table::new(caption, heads, &[0], rows)), Block::Terms(listed)]
}

/// Returns the properties of the modes as a whole.
fn completeness(facts: &Facts<'_>) -> Vec<Term> {
    let (modes, completeness) = (&facts.modes, &facts.completeness);
    let mut items = proof(facts);
    items.extend(
        modes.damping.as_ref().map(|damping| Term::new("Damping", damping.in_words()).short("damping")),
    );
    items.extend(listed("geometric", &modes.geometric_stiffness, |one| one.in_words()));
    let inertia = modes.inertia_stiffness.as_ref();
    items.extend(inertia.map(|own| Term::new("Stiffness of inertia", own.in_words()).short("inertia K")));
    items.extend(
        modes
            .missing_stiffness
            .as_ref()
            .map(|words| Term::new(word_as("geometric stiffness", "Spin"), words.as_str()).short("spin")),
    );
    let stressed = modes.stress_stiffness.as_ref();
    items.extend(stressed.map(|own| {
        Term::new(word_as("geometric stiffness", "Stress stiffness"), own.as_str()).short("stress K")
    }));
    let decided: Vec<_> = facts.terms.iter().filter(|term| !term.kept || term.decision.is_some()).collect();
    items.extend(decided.iter().map(|term| Term::page("Kinetic energy", term.in_words())));
    items.extend(listed("terms", &decided, |term| term.in_words()));
    items.push(Term::text("complete", completeness.sentence.as_str()));
    items.extend(remark(completeness));
    let free = modes.craig_bampton.as_ref().and_then(|own| own.holds(&modes.frequency_hz));
    items.extend(free.map(|holds| Term::new("Free body", holds).short("free body")));
    if let Some(guarantee) = &facts.guarantee {
        items.push(Term::new("Eigenvalues", guarantee.eigenvalues()).short("guaranteed"));
        items.push(Term::new("Invariants", guarantee.invariants()).short(""));
    }
    let [noise, residual] = [2, 3].map(|digits| {
        [completeness.rigid_noise, completeness.rigid_residual].map(|v| significant(v, digits))
    });
    let noise_of_input = format!(
        "rigid eigenvalues {} of the first flexible one; |K R| {} of |K| |R|",
        residual[0], residual[1]
    );
    items.push(Term::new("Noise of the input", noise_of_input).in_text(
        "noise",
        format!("rigid eigenvalues {} of the first flexible one; |K R| {} of |K| |R|", noise[0], noise[1]),
    ));
    items
}

/// Returns the remark of the certificate; in a text without a count the sentence already holds the remark.
fn remark(completeness: &Completeness) -> Option<Term> {
    let remark = completeness.remark.as_str();
    let term = match completeness.proved_modes {
        Some(_) => Term::new("Remark", remark).short(""),
        None => Term::page("Remark", remark),
    };
    (!remark.is_empty()).then_some(term)
}

/// Returns the facts behind the proof of completeness: for a Craig-Bampton body with the interfaces held, for
/// other bodies without supports.
fn proof(facts: &Facts<'_>) -> Vec<Term> {
    let (modes, c) = (&facts.modes, &facts.completeness);
    let pivots = |count: Option<usize>, held: &str, shift: Option<f64>| {
        let count = count.map_or_else(|| "not counted".to_owned(), |n| n.to_string());
        let shift = shift.map_or_else(|| "no frequency".to_owned(), |hz| frequency(hz, 6));
        Term::page(word_as("completeness", "Negative pivots"), format!("{count} of K − σM{held} at {shift}"))
    };
    let residual =
        format!("{} of |Kψ| + |λMψ|{}", significant(modes.worst_residual, 3), modes.residual_remark());
    let mut items = match &modes.craig_bampton {
        Some(own) => vec![
            Term::page("Coordinates", own.made_of()),
            pivots(own.counted, " with the interfaces held,", own.shift_hz),
        ],
        None => vec![
            pivots(c.negative_pivots, "", c.shift_hz),
            Term::page("Rigid modes", c.rigid_modes.to_string()),
            Term::page(
                "Flexible modes proved",
                c.proved_modes.map_or_else(|| "none".to_owned(), |n| n.to_string()),
            ),
        ],
    };
    items.push(Term::page(word_as("residual", "Worst residual"), residual));
    items
}
