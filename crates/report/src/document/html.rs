//! HTML page of a document. The page loads nothing from elsewhere and is readable without scripts, on a phone
//! and on paper.

use super::blocks::{Block, Document, State};
use super::inline::{Inline, Span};
use super::table::Table;
use super::terms::Term;
use crate::chart::{Cells, colour_scale};
use crate::notation::markup::{Plain, raised};
use crate::picture::{EMBEDDED_STYLE, Embedded, Field, Fields};
use flexbody_base::diagnostic::{Diagnostic, Severity};
use flexbody_base::provenance::started;
use maud::{DOCTYPE, Markup, PreEscaped, Render, html};

const STYLE: &str = include_str!("report.css");

/// Script that opens folded blocks before a page is printed.
const UNFOLD: &str = "<script>addEventListener(\"beforeprint\", () => document.querySelectorAll(\"details\").forEach((fold) => (fold.open = true)));</script>\n";

impl Render for Span {
    fn render(&self) -> Markup {
        let text = Plain(self.text());
        html! {
            @match self {
                Self::Plain(_) => (text),
                Self::Quantity(own) => (Plain(&raised(own))),
                Self::Strong(own) => strong { (Plain(&raised(own))) },
                Self::Error(_) => span class="error" { (text) },
                Self::Warning(_) => span class="warning" { (text) },
                Self::Code(_) => code { (text) },
                Self::Word(_, meaning) => abbr title=(meaning) { (text) },
            }
        }
    }
}

impl Render for Inline {
    fn render(&self) -> Markup {
        html! { @for span in &self.0 { (span) } }
    }
}

/// Renders the whole page.
pub(crate) fn render(document: &Document<'_>) -> String {
    let mut page = Page::default();
    let content = page.blocks(&document.blocks);
    // The content security policy allows inline scripts of the page and no external resources.
    let policy = if page.scripts.is_empty() {
        "default-src 'none'; style-src 'unsafe-inline'"
    } else {
        "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
    };
    let name = Plain(document.name);
    let page = html! {
        (DOCTYPE) "\n"
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta http-equiv="Content-Security-Policy" content=(policy);
                title { (name) ": " (document.kind.to_lowercase()) }
                style { (PreEscaped(STYLE)) (PreEscaped(page.style)) }
            }
            body { "\n"
                header { h1 { (name) } p class="quiet" { (document.kind) ", " (document.generator) }
                    @if let Some(started) = started() {
                        p class="quiet" { code { (started.command) } ", " (started.time) }
                    }
                }
                main { "\n" (content) }
                (PreEscaped(page.scripts))
            }
        }
    };
    page.into_string() + "\n"
}

/// Style and scripts that the blocks of a page need in addition to their markup.
#[derive(Default)]
struct Page {
    style: &'static str,
    scripts: String,
}

impl Page {
    fn blocks(&mut self, blocks: &[Block<'_>]) -> Markup {
        html! { @for block in blocks { (self.block(block)) } }
    }

    fn block(&mut self, block: &Block<'_>) -> Markup {
        html! {
            @match block {
                Block::Line(_) | Block::Gap => {},
                Block::Heading(title) => { h2 { (title) } "\n" },
                Block::Verdict { state, head, rest } => (verdict(*state, head, rest)),
                Block::Terms(items) => (terms(items)),
                Block::Table(own) => (table(own)),
                Block::Diagnostics(found) => { h2 { "Diagnostics" } (diagnostics(found)) },
                Block::Paragraph(text) => p { (Plain(text)) },
                Block::Quiet(text) => p class="quiet" { (Plain(text)) },
                Block::Caution(text) => p class="mind" { (Plain(text)) },
                Block::List(items) => ul { @for item in items { li { (item) } } },
                Block::Chart(chart) => (chart),
                Block::Bars(bars) => (bars),
                Block::Maps(own) => (maps(own)),
                Block::Fold(summary, blocks) => (self.fold(summary, blocks)),
                Block::Preformatted(text) => (preformatted(text)),
                Block::Picture(body, blocks) => (self.picture(Embedded::of_modes(body), blocks)),
                Block::Coloured(body, fields) => (self.picture(Embedded::of_fields(body, fields), &colours(fields))),
            }
        }
    }

    fn fold(&mut self, summary: &str, blocks: &[Block<'_>]) -> Markup {
        if !self.scripts.contains(UNFOLD) {
            self.scripts.push_str(UNFOLD);
        }
        html! { details { summary { (summary) } (self.blocks(blocks)) } "\n" }
    }

    fn picture(&mut self, picture: Option<Embedded>, blocks: &[Block<'_>]) -> Markup {
        let Some(Embedded { panel, scripts }) = picture else { return self.blocks(blocks) };
        self.style = EMBEDDED_STYLE;
        self.scripts.push_str(&scripts);
        html! { div class="top" { (PreEscaped(panel)) div class="properties" { (self.blocks(blocks)) } } }
    }
}

/// Returns the largest value of every field of a picture.
fn colours<'b>(fields: &Fields) -> Vec<Block<'b>> {
    let words: Vec<Inline> = fields.drawn.iter().filter_map(Field::in_words).map(Inline::from).collect();
    vec![Block::List(words)]
}

fn verdict(state: State, head: &str, rest: &str) -> Markup {
    let class = match state {
        State::Good => "verdict",
        State::Given => "verdict given",
        State::Open => "verdict open",
    };
    html! { p class=(class) { strong { (Plain(head)) } @if !rest.is_empty() { " " (Plain(rest)) } } "\n" }
}

/// Renders terms; values of one label stand below each other.
pub(crate) fn terms(items: &[Term]) -> Markup {
    let shown: Vec<&Term> = items.iter().filter(|term| term.is_in_page).collect();
    html! {
        @if !shown.is_empty() {
            dl {
                @for own in shown.chunk_by(|a, b| a.label == b.label) {
                    dt { (own[0].label) } @for term in own { dd { (term.value) } } "\n"
                }
            }
        }
    }
}

fn table(table: &Table) -> Markup {
    let class = |i: usize| table.left.contains(&i).then_some("text");
    html! {
        div class="scroll" {
            table {
                caption { (table.caption) }
                thead { tr { @for (i, head) in table.heads.iter().enumerate() { th scope="col" class=[class(i)] { (head) } } } }
                "\n"
                tbody {
                    @for row in &table.rows {
                        tr {
                            th scope="row" { (row[0]) }
                            @for (i, cell) in row.iter().enumerate().skip(1) { td class=[class(i)] { (cell) } }
                        }
                        "\n"
                    }
                }
            }
        }
    }
}

/// Renders diagnostics in the order in which they were found.
fn diagnostics(found: &[Diagnostic]) -> Markup {
    if found.is_empty() {
        return html! { p { "None." } };
    }
    let row = |diagnostic: &Diagnostic| {
        let severity = diagnostic.severity();
        let name = severity.name().to_owned();
        let line = diagnostic.line().map_or_else(String::new, |line| format!(", line {line}"));
        let place = diagnostic.file().map_or_else(String::new, |file| format!(" ({}{line})", file.display()));
        vec![
            diagnostic.code().id().into(),
            match severity {
                Severity::Error => Span::Error(name).into(),
                Severity::Warning => Span::Warning(name).into(),
                Severity::Note => name.into(),
            },
            format!("{}{place}", diagnostic.message()).into(),
            diagnostic.help().into(),
        ]
    };
    let heads = ["Code", "Severity", "Finding", "Help"];
    let caption = "In the order in which they were found";
    table(&Table::new(caption, heads, &[0, 1, 2, 3], found.iter().map(row).collect()))
}

fn preformatted(text: &str) -> Markup {
    html! { pre { @for (i, line) in text.lines().enumerate() { @if i > 0 { "\n" } (Plain(line)) } } }
}

fn maps(maps: &[(Inline, Option<Cells>)]) -> Markup {
    html! {
        (colour_scale())
        div class="maps" {
            @for (caption, cells) in maps {
                @let is_wide = cells.as_ref().is_some_and(|cells| cells.names.is_some());
                figure class={ "map" @if is_wide { " wide" } } { figcaption { (caption) } @if let Some(cells) = cells { (cells) } }
                "\n"
            }
        }
    }
}
