//! Parts of web pages that all reports have in common: the page, headings, lists of terms, tables.

use super::numbers::plain;
use flexbody_base::diagnostic::{Diagnostic, Severity};

const STYLE: &str = include_str!("report.css");

/// Opens what is folded before a page is printed.
const UNFOLD: &str = "<script>addEventListener(\"beforeprint\", () => document.querySelectorAll(\"details\").forEach((fold) => (fold.open = true)));</script>\n";

/// What a page is about.
pub(super) struct Page<'a> {
    pub name: &'a str,
    pub kind: &'a str,
    pub generator: &'a str,
}

impl Page<'_> {
    /// The whole page; `content` and `scripts` are markup, `style` is for this page alone.
    pub(crate) fn with(&self, style: &str, content: &str, scripts: &str) -> String {
        let (name, generator) = (escape(self.name), escape(self.generator));
        let (kind, lower) = (self.kind, self.kind.to_lowercase());
        // A page may run what it brings, and load nothing.
        let unfold = if content.contains("<details>") { UNFOLD } else { "" };
        let policy = match scripts.is_empty() && unfold.is_empty() {
            true => "",
            false => "; script-src 'unsafe-inline'",
        };
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'{policy}\">\n<title>{name}: {lower}</title>\n<style>\n{STYLE}{style}</style>\n</head>\n<body>\n<header>\n<h1>{name}</h1>\n<p class=\"quiet\">{kind}, {generator}</p>\n</header>\n<main>\n{content}</main>\n{scripts}{unfold}</body>\n</html>\n"
        )
    }
}

/// A whole page about `name`; `content` is markup.
pub(super) fn page(name: &str, kind: &str, generator: &str, content: &str) -> String {
    Page { name, kind, generator }.with("", content, "")
}

/// Text for element content and quoted attributes.
pub(super) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in plain(text).chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            c => escaped.push(c),
        }
    }
    escaped
}

/// A text with units as they are printed: the 2 of `t mm^2` raised.
pub(super) fn printed(text: &str) -> String {
    escape(text).replace("^2", "\u{b2}").replace("^3", "\u{b3}")
}

/// A fragment as a sentence begins.
pub(super) fn sentence(fragment: &str) -> String {
    let mut characters = fragment.chars();
    characters.next().map_or_else(String::new, |first| first.to_uppercase().chain(characters).collect())
}

/// What is folded under a line until it is asked for, or printed; `content` is markup.
pub(super) fn fold(html: &mut String, summary: &str, content: &str) {
    html.push_str(&format!("<details>\n<summary>{summary}</summary>\n{content}</details>\n"));
}

/// A heading; `title` is markup.
pub(super) fn section(html: &mut String, title: &str) {
    html.push_str(&format!("<h2>{title}</h2>\n"));
}

/// A list of terms; the values are markup.
pub(super) fn terms<'a>(html: &mut String, items: impl IntoIterator<Item = (&'a str, String)>) {
    terms_in_markup(html, items.into_iter().map(|(term, value)| (escape(term), value)));
}

/// A list of terms that are markup, as their values.
pub(super) fn terms_in_markup(html: &mut String, items: impl IntoIterator<Item = (String, String)>) {
    html.push_str("<dl>\n");
    for (term, value) in items {
        html.push_str(&format!("<dt>{term}</dt><dd>{value}</dd>\n"));
    }
    html.push_str("</dl>\n");
}

/// A table: head cells, then rows whose first cell is their head; cells are markup, `text` columns are
/// left-aligned.
pub(super) fn table(html: &mut String, caption: &str, head: &[String], text: &[usize], rows: &[Vec<String>]) {
    let class = |column: usize| if text.contains(&column) { " class=\"text\"" } else { "" };
    html.push_str(&format!("<div class=\"scroll\"><table>\n<caption>{caption}</caption>\n<thead><tr>"));
    for (i, cell) in head.iter().enumerate() {
        html.push_str(&format!("<th scope=\"col\"{}>{cell}</th>", class(i)));
    }
    html.push_str("</tr></thead>\n<tbody>\n");
    for row in rows {
        html.push_str("<tr>");
        for (i, cell) in row.iter().enumerate() {
            if i == 0 {
                html.push_str(&format!("<th scope=\"row\">{cell}</th>"));
            } else {
                html.push_str(&format!("<td{}>{cell}</td>", class(i)));
            }
        }
        html.push_str("</tr>\n");
    }
    html.push_str("</tbody>\n</table></div>\n");
}

/// Cells that are markup already.
pub(super) fn texts<const N: usize>(cells: [&str; N]) -> Vec<String> {
    cells.map(str::to_owned).to_vec()
}

/// A section with the diagnostics in the order in which they were found.
pub(super) fn diagnostics_table(html: &mut String, found: &[Diagnostic]) {
    section(html, "Diagnostics");
    if found.is_empty() {
        html.push_str("<p>None.</p>\n");
        return;
    }
    let rows: Vec<_> = found
        .iter()
        .map(|d| {
            let severity = match d.severity() {
                Severity::Error => "<span class=\"error\">error</span>",
                Severity::Warning => "<span class=\"warning\">warning</span>",
                Severity::Note => "note",
            };
            let line = d.line().map_or_else(String::new, |line| format!(", line {line}"));
            let place = d.file().map_or_else(String::new, |f| format!(" ({}{line})", f.display()));
            vec![
                d.code().id().to_owned(),
                severity.to_owned(),
                escape(&format!("{}{place}", d.message())),
                escape(d.help()),
            ]
        })
        .collect();
    table(
        html,
        "In the order in which they were found",
        &texts(["Code", "Severity", "Finding", "Help"]),
        &[0, 1, 2, 3],
        &rows,
    );
}
