//! All that is known of a body, as text for a terminal.

use super::Facts;
use super::facts::RunFacts;
use super::geometric_stiffness::softening_in_words;
use super::lumped::{ErrorNorm, Errors, LumpedModesFacts};
use super::numbers::{bytes, coordinates, counted, duration, percent, plain, significant, triple};
use flexbody_base::diagnostic::{Diagnostic, Severity};
use flexbody_body::basis::BasisKind;

/// Columns of a terminal that every terminal has.
pub(super) const WIDTH: usize = 80;
/// Columns of the labels.
pub(super) const LABEL: usize = 12;
/// Stands for a space at which a line must not end.
const KEEP: &str = "\u{a0}";
/// Lines that one entry may take: long names end in an ellipsis.
const LINES: usize = 4;
/// Frequencies shown before the last.
const FIRST_FREQUENCIES: usize = 6;
/// Entries of a list that are shown.
const LISTED: usize = 6;
/// Errors up to this are rounding.
const NEGLIGIBLE: f64 = 1e-9;

pub(super) fn render(facts: &Facts<'_>) -> String {
    let mut page = Page(String::new());
    heading(&mut page, facts);
    page.gap();
    modes(&mut page, facts);
    page.gap();
    lumped(&mut page, facts);
    page.gap();
    if let Some(run) = &facts.run {
        timing(&mut page, run);
    }
    diagnostics_lines(&mut page, &facts.diagnostics);
    page.0.truncate(page.0.trim_end().len());
    page.0 + "\n"
}

/// Lines of a label and its text.
pub(super) struct Page(pub String);

impl Page {
    /// Adds a text under a label, wrapped at spaces.
    pub(crate) fn entry(&mut self, label: &str, text: &str) {
        for line in entry_lines(label, text, LINES, WIDTH) {
            self.0.push_str(&line);
            self.0.push('\n');
        }
    }

    /// Adds an empty line between two groups of entries.
    fn gap(&mut self) {
        if !self.0.is_empty() && !self.0.ends_with("\n\n") {
            self.0.push('\n');
        }
    }

    /// Adds a list, its rest counted.
    fn list<T>(&mut self, label: &str, items: &[T], text: impl Fn(&T) -> String) {
        for (i, item) in items.iter().take(LISTED).enumerate() {
            self.entry(if i == 0 { label } else { "" }, &text(item));
        }
        if items.len() > LISTED {
            self.entry("", &format!("and {} more", items.len() - LISTED));
        }
    }
}

/// The lines of a text under a label, each of so many `columns`, and `most` of them at the most.
pub(super) fn entry_lines(label: &str, text: &str, most: usize, columns: usize) -> Vec<String> {
    let mut lines = wrapped(text, columns - LABEL);
    if lines.len() > most {
        lines.truncate(most);
        if let Some(last) = lines.last_mut() {
            *last = last.chars().take(columns - LABEL - 2).collect::<String>() + " …";
        }
    }
    let labels = std::iter::once(label).chain(std::iter::repeat(""));
    let line = |(label, line): (&str, String)| {
        format!("{label:LABEL$}{line}").replace(KEEP, " ").trim_end().to_owned()
    };
    labels.zip(lines).map(line).collect()
}

/// Lines of at most `width` characters; words that are longer are broken.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    let mut used = 0;
    for word in text.split(' ') {
        let characters: Vec<char> = word.chars().collect();
        let chunks: Vec<&[char]> =
            if characters.is_empty() { vec![&[]] } else { characters.chunks(width).collect() };
        for chunk in chunks {
            let gap = usize::from(used > 0);
            if used + gap + chunk.len() > width {
                lines.push(String::new());
                used = 0;
            }
            let line = lines.last_mut().expect("never empty");
            if used > 0 {
                line.push(' ');
                used += 1;
            }
            line.extend(chunk);
            used += chunk.len();
        }
    }
    lines
}

fn heading(page: &mut Page, facts: &Facts<'_>) {
    let (model, body) = (&facts.model, &facts.body);
    let units = &model.units;
    page.entry("body", &format!("{} ({})", plain(&model.name), units.in_words()));
    page.entry("model", &model.size_in_words());
    if let Some(remark) = &model.approximation {
        page.entry("", remark);
    }
    if let Some(mesh) = &model.mesh {
        page.entry("surface", &mesh.in_words());
    }
    if let Some(rounded) = model.storage_in_words() {
        page.entry("storage", rounded);
    }
    if let Some(body) = &model.body {
        page.entry("", &format!("body {} of {} in the matrices", body.number, body.of));
    }
    page.entry("mass", &format!("{} {}", significant(body.mass, 6), units.mass()));
    let size = body.size();
    let centre = coordinates(&body.centre_of_mass, size, &units.length());
    page.entry("centre", &format!("{centre} (of mass, model axes)"));
    page.entry("inertia", &format!("{} (principal)", triple(&body.principal_inertia, &units.inertia())));
    page.entry("gyration", &format!("{} (radii)", triple(&body.radii_of_gyration, &units.length())));
    page.entry("frame", &body.frame);
    let length = units.length();
    page.list("interface", &model.interfaces, |i| {
        format!("{}: {}", plain(&i.name), i.in_words(size, &length))
    });
}

/// `812.5 812.5 1204 1890.2 2411 3020 ... 4412.5 Hz`.
pub(super) fn first_and_last(hz: &[f64]) -> String {
    let shown: Vec<String> = hz.iter().take(FIRST_FREQUENCIES).map(|f| significant(*f, 5)).collect();
    let last = hz.last().filter(|_| hz.len() > FIRST_FREQUENCIES);
    let dots = if hz.len() > FIRST_FREQUENCIES + 1 { " ..." } else { "" };
    let last = last.map_or(String::new(), |f| format!("{dots} {}", significant(*f, 5)));
    format!("{}{last} Hz", shown.join(" "))
}

fn modes(page: &mut Page, facts: &Facts<'_>) {
    let modes = &facts.modes;
    let hz = &modes.frequency_hz;
    let accuracy = facts.run.as_ref().map(|run| plain(&run.accuracy)).filter(|name| !name.is_empty());
    let accuracy = accuracy.map_or(String::new(), |name| format!(", {name} accuracy"));
    let residual = significant(modes.worst_residual, 2);
    let whose = modes.whose_residual();
    page.entry("modes", &format!("{} flexible, worst residual {residual}{whose}{accuracy}", modes.count));
    page.entry("frequency", &first_and_last(hz));
    let body = facts.flex_body;
    if let Some(basis) = body.basis_name().filter(|_| body.basis() != Some(BasisKind::Free)) {
        let made_of = modes.craig_bampton.as_ref().map_or(String::new(), |cb| format!(": {}", cb.made_of()));
        page.entry("basis", &format!("{}{made_of}", plain(basis)));
    }
    if let Some(hz) = modes.craig_bampton.as_ref().and_then(|own| own.held_hz()) {
        page.entry("held", &format!("{} (fixed-interface modes)", first_and_last(hz)));
    }
    let origins = modes.origins();
    page.list("origin", &origins, |(origin, count)| match modes.craig_bampton {
        // The modes of the body are mixtures.
        Some(_) => format!("{} with the largest share of a {}", counted(*count, "mode"), plain(origin)),
        None => format!("{}: {}", counted(*count, "mode"), plain(origin)),
    });
    page.list("static", &modes.truncation, |t| {
        let (load, before, after) = (plain(&t.load), significant(t.before, 2), significant(t.after, 2));
        if t.before == t.after {
            return format!("{load}: error {before} with free modes alone");
        }
        format!("{load}: error {before} with free modes alone, {after} with residual vectors")
    });
    if let Some(damping) = &modes.damping {
        page.entry("damping", &damping.in_words());
    }
    page.list("geometric", &modes.geometric_stiffness, |one| plain(&one.in_words()));
    if let Some(inertia) = &modes.inertia_stiffness {
        page.entry("inertia K", &inertia.in_words());
    }
    if let Some(hertz) = &modes.softening_hz {
        page.entry("spin", &softening_in_words(hertz));
    }
    let decided: Vec<_> = facts.terms.iter().filter(|term| !term.kept || term.decision.is_some()).collect();
    page.list("terms", &decided, |term| term.in_words());
    let completeness = &facts.completeness;
    page.entry("complete", &completeness.sentence);
    if completeness.proved_modes.is_some() && !completeness.remark.is_empty() {
        page.entry("", &plain(&completeness.remark));
    }
    if let Some(craig_bampton) = &modes.craig_bampton {
        page.entry("free body", &craig_bampton.holds(hz));
    }
    if let Some(guarantee) = &facts.guarantee {
        page.entry("guaranteed", &guarantee.eigenvalues());
        page.entry("", &guarantee.invariants());
    }
    let noise = significant(completeness.rigid_noise, 2);
    let residual = significant(completeness.rigid_residual, 2);
    page.entry("noise", &format!("rigid modes at {noise} of the first eigenvalue; K R {residual}"));
}

fn lumped(page: &mut Page, facts: &Facts<'_>) {
    page.list("lumped", &facts.lumped, |l| {
        let negative = match l.negative_masses {
            0 => String::new(),
            1 => "; 1 NEGATIVE mass".to_owned(),
            count => format!("; {count} NEGATIVE masses"),
        };
        format!("{}: {}{negative}", plain(&l.scheme), errors(&l.errors))
    });
    let column = facts.lumped_modes.iter().map(|l| l.scheme.chars().count()).max().unwrap_or(0).min(20);
    page.list("own modes", &facts.lumped_modes, |l| {
        format!("{:column$}  {}", plain(&l.scheme), own_modes(l))
    });
}

/// The worst norm of every invariant that differs.
fn errors(errors: &Errors) -> String {
    if errors.worst.is_none() {
        return "not compared".to_owned();
    }
    // NaN, an error that is not known, is told too.
    let told = errors.worst_by_invariant.iter().filter(|n| n.value.is_nan() || n.value > NEGLIGIBLE);
    let text = |n: &ErrorNorm| format!("{} {}", plain(&n.invariant).replace('_', " "), percent(n.value));
    let told: Vec<String> = told.map(|n| text(n).replace(' ', KEEP)).collect();
    if told.is_empty() { "no error above 1e-9".to_owned() } else { format!("errors {}", told.join(", ")) }
}

pub(super) fn own_modes(lumped: &LumpedModesFacts) -> String {
    if !lumped.done {
        return format!("not done: {}", plain(&lumped.remark));
    }
    let (Some(change), Some(mode)) = (lumped.worst_frequency_change, lumped.worst_frequency_mode) else {
        return "no modes".to_owned();
    };
    let cosine = significant(lumped.subspace_cosine, 4);
    let caution =
        if lumped.caution.is_empty() { String::new() } else { format!("; {}", plain(&lumped.caution)) };
    format!("frequency {mode} off by {}, subspace cosine {cosine}{caution}", percent(change))
}

fn timing(page: &mut Page, run: &RunFacts) {
    let phase = |p: &super::Phase| {
        format!("{} {}/{}", plain(&p.name), significant(p.wall_seconds, 3), significant(p.cpu_seconds, 3))
    };
    if !run.phases.is_empty() {
        let phases: Vec<String> = run.phases.iter().map(phase).collect();
        page.entry("phases", &format!("{} s (wall/CPU)", phases.join(", ")));
    }
    let mut memory = run.peak_memory_bytes.map_or(String::new(), |m| format!(", peak memory {}", bytes(m)));
    if let Some(estimate) = run.memory_estimate_bytes {
        memory.push_str(&format!(" ({} expected)", bytes(estimate)));
    }
    let (wall, cpu) = (duration(run.wall_seconds), duration(run.cpu_seconds));
    let threads = counted(run.threads, "thread");
    page.entry("total", &format!("{wall} wall, {cpu} CPU, {threads}{memory}"));
    if let Some(output) = &run.output {
        page.entry("output", &format!("{}, {}", plain(&output.name), bytes(output.bytes)));
    }
}

pub(super) fn diagnostics_lines(page: &mut Page, found: &[Diagnostic]) {
    for (severity, label) in
        [(Severity::Error, "errors"), (Severity::Warning, "warnings"), (Severity::Note, "notes")]
    {
        let of_severity: Vec<_> = found.iter().filter(|d| d.severity() == severity).collect();
        page.list(label, &of_severity, |d| format!("{} {}", d.code().id(), plain(d.message())));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_wrap_and_long_words_break() {
        assert_eq!(wrapped("ab cd efghijklm", 5), ["ab cd", "efghi", "jklm"]);
        assert_eq!(wrapped("a   b", 80), ["a   b"], "columns of a table stay");
        assert_eq!(wrapped("", 5), [""]);
    }
}
