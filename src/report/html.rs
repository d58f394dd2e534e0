//! The report as one web page: no scripts, nothing loaded from elsewhere, readable on screen and on paper.

use super::Facts;
use super::bar_chart::bar_chart;
use super::facts::ModeFacts;
use super::geometric_stiffness::{GeometricStiffnessFacts, softening_in_words};
use super::guarantee::{GuaranteeFacts, cut};
use super::lumped::distinct;
use super::markup::{diagnostics_table, escape, page, section, table, terms, texts};
use super::numbers::{bytes, counted, duration, percent, significant};
use crate::body::flex_body::Truncation;
use crate::body::invariants::ERROR_NORMS;
use std::collections::HashMap;

pub(super) fn render(facts: &Facts) -> String {
    let mut html = String::new();
    verdict(&mut html, facts);
    body(&mut html, facts);
    modes(&mut html, facts);
    lumped(&mut html, facts);
    lumped_modes(&mut html, facts);
    diagnostics_table(&mut html, &facts.diagnostics);
    run(&mut html, facts);
    origin(&mut html, facts);
    page(&facts.model.name, "Flexible body report", &facts.generator, &html)
}

fn verdict(html: &mut String, facts: &Facts) {
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

fn sentence(fragment: &str) -> String {
    let mut characters = fragment.chars();
    characters.next().map_or_else(String::new, |first| first.to_uppercase().chain(characters).collect())
}

fn body(html: &mut String, facts: &Facts) {
    let (model, body) = (&facts.model, &facts.body);
    let units = &model.units;
    let triple = |values: &[f64; 3], unit: &str| {
        let [x, y, z] = values.map(|v| significant(v, 7));
        format!("{x}, &ensp;{y}, &ensp;{z} {}", escape(&unit.replace("^2", "\u{b2}")))
    };
    let [x, y, z] = body.frame_axes.map(|row| row.map(|v| significant(v, 6)).join(", "));
    section(html, "Body");
    terms(
        html,
        [
            ("Mass", format!("{} {}", significant(body.mass, 7), escape(&units.mass()))),
            ("Centre of mass", format!("{} (model axes)", triple(&body.centre_of_mass, &units.length()))),
            (
                "Principal inertia",
                format!("{} (about the centre of mass)", triple(&body.principal_inertia, &units.inertia())),
            ),
            ("Radii of gyration", triple(&body.radii_of_gyration, &units.length())),
            (
                "Body frame",
                format!("{}; origin {}", escape(&body.frame), triple(&body.frame_origin, &units.length())),
            ),
            ("Body axes", format!("columns of [{x}; {y}; {z}]")),
            (
                "Model",
                format!(
                    "{}{}{}",
                    model.size_in_words(),
                    model.body.as_ref().map_or(String::new(), |b| format!(
                        "; body {} of {} in the matrices",
                        b.number, b.of
                    )),
                    model.storage_in_words().map_or(String::new(), |rounded| format!("; {rounded}"))
                ),
            ),
            ("Units", escape(&units.in_words())),
        ],
    );
    if let Some(remark) = model.approximation {
        html.push_str(&format!(
            "<p>The mass matrix does not commute with rotations: {}.</p>\n",
            escape(remark)
        ));
    }
    if !model.interfaces.is_empty() {
        let rows: Vec<_> =
            model.interfaces.iter().map(|i| vec![escape(&i.name), escape(&i.in_words())]).collect();
        table(html, "Interfaces", &texts(["Name", "Nodes and coupling"]), &[0, 1], &rows);
    }
}

/// What the proof of completeness rests on: of a Craig-Bampton body with the interfaces held, of others
/// without supports.
fn proof(facts: &Facts) -> Vec<(&'static str, String)> {
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
            ("Coordinates", escape(&own.made_of())),
            (
                "Negative pivots",
                format!(
                    "{} of K &minus; &sigma;M with the interfaces held, at {}",
                    count(own.counted),
                    shift(own.shift_hz)
                ),
            ),
            ("Free body", escape(&sentence(&own.holds(&modes.frequency_hz)))),
        ],
        None => vec![
            (
                "Negative pivots",
                format!("{} of K &minus; &sigma;M at {}", count(c.negative_pivots), shift(c.shift_hz)),
            ),
            ("Rigid modes", c.rigid_modes.to_string()),
            ("Flexible modes proved", c.proved_modes.map_or_else(|| "none".to_owned(), |n| n.to_string())),
        ],
    };
    items.push(("Worst residual", residual));
    items.push((
        "Noise of the input",
        format!(
            "rigid eigenvalues {} of the first flexible one; |K R| {} of |K| |R|",
            significant(c.rigid_noise, 3),
            significant(c.rigid_residual, 3)
        ),
    ));
    items
}

fn modes(html: &mut String, facts: &Facts) {
    completeness(html, facts);
    frequencies(html, facts);
    let modes = &facts.modes;
    if !modes.truncation.is_empty() {
        let row = |t: &Truncation| vec![escape(&t.load), significant(t.before, 3), significant(t.after, 3)];
        let rows: Vec<_> = modes.truncation.iter().map(row).collect();
        let caption = "Static responses: what the modes lack, in the norm of K";
        table(html, caption, &texts(["Load", "Free modes alone", "With residual vectors"]), &[0], &rows);
    }
    if !modes.geometric_stiffness.is_empty() {
        let row = |g: &GeometricStiffnessFacts| vec![escape(&g.load), significant(g.relative_norm, 3)];
        let rows: Vec<_> = modes.geometric_stiffness.iter().map(row).collect();
        let caption = "Geometric stiffness: largest part by which one unit of the load changes the stiffness of a motion";
        table(html, caption, &texts(["Load (body axes)", "Part"]), &[0], &rows);
    }
    if let Some(guarantee) = &facts.guarantee {
        let row = |(name, digits): &(&str, f64)| vec![escape(name), cut(*digits)];
        let rows: Vec<_> = guarantee.invariant_digits.iter().map(row).collect();
        let caption = "Guaranteed digits of the invariants, worst entry relative to its Cauchy-Schwarz bound";
        table(html, caption, &texts(["Invariant", "Digits"]), &[0], &rows);
    }
}

/// What is known of the modes as a whole.
fn completeness(html: &mut String, facts: &Facts) {
    let (modes, c) = (&facts.modes, &facts.completeness);
    section(html, "Completeness of the modes");
    let mut items = proof(facts);
    if !c.remark.is_empty() {
        items.push(("Remark", escape(&c.remark)));
    }
    if let Some(guarantee) = &facts.guarantee {
        items.push(("Eigenvalues", escape(&sentence(&guarantee.eigenvalues()))));
        items.push(("Invariants", escape(&sentence(&guarantee.invariants()))));
    }
    if let Some(damping) = &modes.damping {
        items.push(("Damping", escape(&sentence(&damping.in_words()))));
    }
    if let Some(hertz) = &modes.softening_hz {
        items.push(("Spin", escape(&sentence(&softening_in_words(hertz)))));
    }
    let decided = facts.terms.iter().filter(|term| !term.kept || term.decision.is_some());
    items.extend(decided.map(|term| ("Kinetic energy", escape(&term.in_words()))));
    terms(html, items);
}

/// The table of the modes.
fn frequencies(html: &mut String, facts: &Facts) {
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
    table(html, caption, &columns.head(&facts.model.units.time), &[], &rows);
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
            None => texts(["Residual"]),
        });
        head.extend(self.damped.then(|| "Damping ratio".to_owned()));
        head.extend(self.origins.then(|| "Origin".to_owned()));
        let bounds = ["Lower bound", "Upper bound", "Digits", "Shape error"];
        head.extend(self.guarantee.iter().flat_map(|_| texts(bounds)));
        head
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
        cells.extend(self.origins.then(|| escape(&modes.provenance[j])));
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

fn lumped(html: &mut String, facts: &Facts) {
    if facts.lumped.is_empty() {
        return;
    }
    section(html, "What lumped masses would have cost");
    html.push_str("<p>The same modes with nodal masses instead of the mass matrix: relative errors of the inertia invariants, the worst norm of each.</p>\n");
    let chart = bar_chart(&facts.lumped);
    if !chart.is_empty() {
        html.push_str(&format!(
            "<figure>\n{chart}<figcaption>Logarithmic axis; errors below its left end have no bar.</figcaption>\n</figure>\n"
        ));
    }
    let rows: Vec<_> = facts
        .lumped
        .iter()
        .map(|l| {
            let worst = l.errors.worst.as_ref();
            vec![
                escape(&l.scheme),
                if l.negative_masses > 0 {
                    format!("<span class=\"error\">{}</span>", l.negative_masses)
                } else {
                    "0".to_owned()
                },
                worst.map_or_else(|| "not compared".to_owned(), |n| percent(n.value)),
                worst.map_or_else(String::new, |n| escape(&format!("{}, {}", n.invariant, n.kind()))),
            ]
        })
        .collect();
    table(html, "Schemes", &texts(["Scheme", "Negative masses", "Worst error", "Of"]), &[0, 3], &rows);

    let norms: Vec<HashMap<&str, f64>> = facts
        .lumped
        .iter()
        .map(|l| l.errors.error_norms.0.iter().map(|(name, value)| (name.as_str(), *value)).collect())
        .collect();
    let names =
        distinct(facts.lumped.iter().flat_map(|l| &l.errors.error_norms.0).map(|(name, _)| name.as_str()));
    let head: Vec<String> = std::iter::once("Norm".to_owned())
        .chain(facts.lumped.iter().map(|l| escape(&l.scheme)))
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

fn lumped_modes(html: &mut String, facts: &Facts) {
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
}

fn run(html: &mut String, facts: &Facts) {
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
        table(html, "Phases", &texts(["Phase", "Wall", "CPU"]), &[0], &rows);
    }
    if !run.counters.is_empty() {
        let rows: Vec<_> = run.counters.iter().map(|(name, n)| vec![escape(name), n.to_string()]).collect();
        table(html, "Work", &texts(["Counter", "Count"]), &[0], &rows);
    }
}

fn origin(html: &mut String, facts: &Facts) {
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
    html.push_str(&format!("<p>Settings:</p>\n<pre>{}</pre>\n", lines.join("\n")));
}
