//! The modes in the report of a body: whether they are all there, their frequencies, what they lack.

use super::Facts;
use super::facts::ModeFacts;
use super::geometric_stiffness::{GeometricStiffnessFacts, softening_in_words};
use super::glossary::{word, word_as};
use super::guarantee::{GuaranteeFacts, cut};
use super::markup::{escape, section, sentence, table, terms_in_markup, texts};
use super::numbers::{percent, significant};
use flexbody_body::flex_body::Truncation;

/// Everything about the modes.
pub(super) fn modes(html: &mut String, facts: &Facts<'_>) {
    frequencies(html, facts);
    completeness(html, facts);
    let modes = &facts.modes;
    if !modes.truncation.is_empty() {
        // A load of an interface without residual vectors.
        let after =
            |t: &Truncation| if t.before == t.after { "-".to_owned() } else { significant(t.after, 3) };
        let row = |t: &Truncation| vec![escape(&t.load), significant(t.before, 3), after(t)];
        let rows: Vec<_> = modes.truncation.iter().map(row).collect();
        let caption = "Static responses: what the modes lack, in the norm of K";
        table(
            html,
            caption,
            &texts([
                "Load",
                "Free modes alone",
                &format!("With {}", word_as("residual vector", "residual vectors")),
            ]),
            &[0],
            &rows,
        );
    }
    if !modes.geometric_stiffness.is_empty() {
        let row = |g: &GeometricStiffnessFacts| vec![escape(&g.load), significant(g.relative_norm, 3)];
        let rows: Vec<_> = modes.geometric_stiffness.iter().map(row).collect();
        let caption = format!(
            "{}: largest part by which one unit of the load changes the stiffness of a motion",
            word_as("geometric stiffness", "Geometric stiffness")
        );
        table(html, &caption, &texts(["Load (body axes)", "Part"]), &[0], &rows);
    }
    if let Some(guarantee) = &facts.guarantee {
        let row = |(name, digits): &(&str, f64)| vec![escape(name), cut(*digits)];
        let rows: Vec<_> = guarantee.invariant_digits.iter().map(row).collect();
        let caption = "Guaranteed digits of the invariants, worst entry relative to its Cauchy-Schwarz bound";
        table(html, caption, &texts(["Invariant", "Digits"]), &[0], &rows);
    }
}

/// What the proof of completeness rests on: of a Craig-Bampton body with the interfaces held, of others
/// without supports.
fn proof(facts: &Facts<'_>) -> Vec<(String, String)> {
    let (modes, c) = (&facts.modes, &facts.completeness);
    let count = |n: Option<usize>| n.map_or_else(|| "not counted".to_owned(), |n| n.to_string());
    let shift = |hz: Option<f64>| {
        hz.map_or_else(|| "no frequency".to_owned(), |hz| format!("{} Hz", significant(hz, 6)))
    };
    let residual = format!(
        "{} of |K&psi;| + |&lambda;M&psi;|{}",
        significant(modes.worst_residual, 3),
        modes.whose_residual()
    );
    let mut items = match &modes.craig_bampton {
        Some(own) => vec![
            ("Coordinates".to_owned(), escape(&own.made_of())),
            (
                word_as("completeness", "Negative pivots"),
                format!(
                    "{} of K &minus; &sigma;M with the interfaces held, at {}",
                    count(own.counted),
                    shift(own.shift_hz)
                ),
            ),
            ("Free body".to_owned(), escape(&sentence(&own.holds(&modes.frequency_hz)))),
        ],
        None => vec![
            (
                word_as("completeness", "Negative pivots"),
                format!("{} of K &minus; &sigma;M at {}", count(c.negative_pivots), shift(c.shift_hz)),
            ),
            ("Rigid modes".to_owned(), c.rigid_modes.to_string()),
            (
                "Flexible modes proved".to_owned(),
                c.proved_modes.map_or_else(|| "none".to_owned(), |n| n.to_string()),
            ),
        ],
    };
    items.push((word_as("residual", "Worst residual"), residual));
    items.push((
        "Noise of the input".to_owned(),
        format!(
            "rigid eigenvalues {} of the first flexible one; |K R| {} of |K| |R|",
            significant(c.rigid_noise, 3),
            significant(c.rigid_residual, 3)
        ),
    ));
    items
}

/// What is known of the modes as a whole.
fn completeness(html: &mut String, facts: &Facts<'_>) {
    let (modes, c) = (&facts.modes, &facts.completeness);
    section(html, &format!("{} of the modes", word_as("completeness", "Completeness")));
    let mut items = proof(facts);
    if !c.remark.is_empty() {
        items.push(("Remark".to_owned(), escape(&c.remark)));
    }
    if let Some(guarantee) = &facts.guarantee {
        items.push(("Eigenvalues".to_owned(), escape(&sentence(&guarantee.eigenvalues()))));
        items.push(("Invariants".to_owned(), escape(&sentence(&guarantee.invariants()))));
    }
    if let Some(damping) = &modes.damping {
        items.push(("Damping".to_owned(), escape(&sentence(&damping.in_words()))));
    }
    if let Some(inertia) = &modes.inertia_stiffness {
        items.push(("Stiffness of inertia".to_owned(), escape(&sentence(&inertia.in_words()))));
    }
    if let Some(hertz) = &modes.softening_hz {
        items.push((word_as("geometric stiffness", "Spin"), escape(&sentence(&softening_in_words(hertz)))));
    }
    let decided = facts.terms.iter().filter(|term| !term.kept || term.decision.is_some());
    items.extend(decided.map(|term| ("Kinetic energy".to_owned(), escape(&term.in_words()))));
    terms_in_markup(html, items);
}

/// The table of the modes.
fn frequencies(html: &mut String, facts: &Facts<'_>) {
    section(html, "Frequencies");
    let columns = ModeColumns {
        modes: &facts.modes,
        guarantee: facts.guarantee.as_ref(),
        // Without damping a column of zeros would say nothing.
        damped: facts.modes.damping_ratio.iter().any(|&d| d != 0.0),
        origins: !facts.modes.origins().is_empty(),
    };
    let rows: Vec<_> = (0..facts.modes.count).map(|j| columns.row(j)).collect();
    let caption = match facts.modes.craig_bampton {
        Some(_) => {
            "Modes of the reduced body, ascending, and the frequencies of the free body as estimated from what the basis lacks"
        }
        None => "Flexible modes, ascending",
    };
    table(html, caption, &columns.head(&facts.model.units.time), &columns.of_text(), &rows);
    fixed_interface_frequencies(html, &facts.modes);
}

/// The table of the fixed-interface modes of a Craig-Bampton body.
fn fixed_interface_frequencies(html: &mut String, modes: &ModeFacts) {
    let Some(hz) = modes.craig_bampton.as_ref().and_then(|own| own.held_hz()) else { return };
    let rows: Vec<_> = (1..).zip(hz).map(|(j, hz)| vec![format!("{j}"), significant(*hz, 8)]).collect();
    let caption = "Fixed-interface modes that the basis has: natural frequencies with all interfaces held";
    table(html, caption, &texts(["Fixed-interface mode", "Frequency (Hz)"]), &[], &rows);
}

/// The columns that the table of the modes has.
struct ModeColumns<'f> {
    modes: &'f ModeFacts,
    guarantee: Option<&'f GuaranteeFacts>,
    damped: bool,
    origins: bool,
}

impl ModeColumns<'_> {
    fn head(&self, time: &str) -> Vec<String> {
        let eigenvalue = format!("Eigenvalue (1/{}\u{b2})", escape(time));
        let mut head = texts(["Mode", "Frequency (Hz)", &eigenvalue]);
        head.extend(match self.modes.craig_bampton {
            Some(_) => texts(["Free body (Hz)", "Too high by about", "At most"]),
            None => vec![word_as("residual", "Residual")],
        });
        head.extend(self.damped.then(|| "Damping ratio".to_owned()));
        head.extend(self.origins.then(|| "Origin".to_owned()));
        let bounds = ["Lower bound", "Upper bound", "Digits", "Shape error"];
        head.extend(self.guarantee.iter().flat_map(|_| texts(bounds)));
        head
    }

    /// The column of the origins.
    fn of_text(&self) -> Vec<usize> {
        let before = 3 + if self.modes.craig_bampton.is_some() { 3 } else { 1 } + usize::from(self.damped);
        Vec::from_iter(self.origins.then_some(before))
    }

    fn row(&self, j: usize) -> Vec<String> {
        let modes = self.modes;
        let mut cells = vec![
            (j + 1).to_string(),
            significant(modes.frequency_hz[j], 8),
            significant(modes.eigenvalue[j], 8),
        ];
        cells.extend(match &modes.craig_bampton {
            Some(own) => vec![
                significant(own.free_hz[j], 8),
                percent(own.too_high[j]),
                own.too_high_at_most[j].map_or_else(|| "no bound".to_owned(), percent),
            ],
            None => vec![modes.residual_in_words(j)],
        });
        cells.extend(self.damped.then(|| significant(modes.damping_ratio[j], 4)));
        cells.extend(self.origins.then(|| origin(&modes.provenance[j])));
        cells.extend(self.guarantee.iter().flat_map(|g| {
            [
                significant(g.eigenvalue_lower[j], 17),
                significant(g.eigenvalue_upper[j], 17),
                cut(g.eigenvalue_digits[j]),
                significant(g.shape_error[j], 2),
            ]
        }));
        cells
    }
}

/// Where a mode comes from; a kind of shape that needs it with its explanation.
fn origin(provenance: &str) -> String {
    match provenance.split_once(':') {
        Some((kind, rest)) => format!("{}:{}", word(kind), escape(rest)),
        None => word(provenance),
    }
}
