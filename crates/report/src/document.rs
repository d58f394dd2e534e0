//! Tree of a report, built once from the facts and rendered as a text or as a page.

use crate::chart::{Bars, Cells, Chart};
use crate::picture::Fields;
use crate::render::{Format, json};
use crate::{html, text};
use flexbody_base::diagnostic::Diagnostic;
use flexbody_body::flex_body::FlexBody;
use serde::Serialize;

/// Default maximum of lines of a term in a text.
const MAX_LINES: usize = 4;
/// Number of list entries that a text shows.
const MAX_LISTED: usize = 6;

/// A report.
pub(crate) struct Document<'a> {
    /// Name of the body or scene; with the kind of the report it is the head of a page.
    pub name: &'a str,
    pub kind: &'static str,
    pub generator: &'a str,
    pub blocks: Vec<Block<'a>>,
}

impl<'a> Document<'a> {
    /// Renders `facts`, for which `document` builds the tree, ending with a line break.
    pub(crate) fn render(facts: &impl Serialize, format: Format, document: impl FnOnce() -> Self) -> String {
        match format {
            Format::Json => json(facts),
            Format::Text => text::render(&document().blocks, text::Screen::default()),
            Format::Terminal => text::render_results(&document().blocks, text::Screen::default()),
            Format::Html => html::render(&document()),
        }
    }
}

/// A part of a report.
pub(crate) enum Block<'a> {
    /// Heading of a section of a page.
    Heading(Inline),
    /// The verdict of a page, with its first words emphasised. A text has the verdict among its terms.
    Verdict {
        state: State,
        head: String,
        rest: String,
    },
    /// Names with their values.
    Terms(Vec<Term>),
    Table(Table),
    /// Diagnostics in the order in which they were found: a section of a page, the end of a text.
    Diagnostics(&'a [Diagnostic]),
    /// A line of a text.
    Line(String),
    /// An empty line between two groups of a text.
    Gap,
    /// A paragraph of a page.
    Paragraph(String),
    /// A paragraph of a page in the colour of secondary text.
    Quiet(String),
    /// A limitation of a body, on a page.
    Caution(String),
    /// A list of a page.
    List(Vec<Inline>),
    Chart(Chart),
    Bars(Bars),
    /// Maps side by side on a page, below the scale of their colours; a map without cells shows its text
    /// only.
    Maps(Vec<(Inline, Option<Cells>)>),
    /// Blocks of a page that are shown when the reader clicks their summary, and in print.
    Fold(&'static str, Vec<Block<'a>>),
    /// Text of a page with its own line breaks.
    Preformatted(String),
    /// The picture of a body on a page, if the body has one, with other blocks beside it.
    Picture(&'a FlexBody, Vec<Block<'a>>),
    /// The picture of a body at rest in the colours of stresses, on a page, with the largest of them beside it.
    Coloured(&'a FlexBody, &'a Fields),
}

/// Outcome of the verdict.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum State {
    Good,
    /// The verdict makes no claim that could be proved (shapes as given).
    Given,
    Open,
}

/// Returns the heading of a section of a page.
pub(crate) fn heading<'a>(title: impl Into<Inline>) -> Block<'a> {
    Block::Heading(title.into())
}

/// A text with marked pieces.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Inline(pub Vec<Span>);

/// A piece of a text.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Span {
    Plain(String),
    /// A number with its unit; a page shows exponents raised.
    Quantity(String),
    Strong(String),
    Error(String),
    Warning(String),
    Code(String),
    /// A word with its explanation.
    Word(String, &'static str),
}

impl Span {
    /// Returns the text of the piece.
    pub(crate) fn text(&self) -> &str {
        match self {
            Self::Plain(text) | Self::Quantity(text) | Self::Strong(text) => text,
            Self::Error(text) | Self::Warning(text) | Self::Code(text) | Self::Word(text, _) => text,
        }
    }
}

impl Inline {
    /// Returns the text followed by another piece.
    pub(crate) fn then(mut self, next: impl Into<Self>) -> Self {
        self.0.extend(next.into().0);
        self
    }

    /// Returns the text without marks.
    pub(crate) fn text(&self) -> String {
        self.0.iter().map(Span::text).collect()
    }
}

impl From<Span> for Inline {
    fn from(span: Span) -> Self {
        Self(vec![span])
    }
}

impl From<String> for Inline {
    fn from(text: String) -> Self {
        Span::Plain(text).into()
    }
}

impl From<&str> for Inline {
    fn from(text: &str) -> Self {
        text.to_owned().into()
    }
}

/// Returns a number with its unit as marked text.
pub(crate) fn quantity(text: impl Into<String>) -> Inline {
    Span::Quantity(text.into()).into()
}

/// A name with a value.
pub(crate) struct Term {
    pub label: Inline,
    pub value: Inline,
    pub is_in_page: bool,
    /// Label and value in a text; `None` if the term is in pages only.
    pub text: Option<(String, String)>,
    pub tone: Tone,
    /// Largest number of lines of the term in a text.
    pub lines: usize,
}

/// Meaning of a term, shown by colour on a terminal.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Tone {
    Title,
    Plain,
    Good,
    Warning,
    Bad,
}

impl Term {
    /// Returns a term for texts and pages.
    pub(crate) fn new(label: impl Into<Inline>, value: impl Into<Inline>) -> Self {
        let (label, value) = (label.into(), value.into());
        let text = Some((label.text(), value.text()));
        Self { label, value, is_in_page: true, text, tone: Tone::Plain, lines: MAX_LINES }
    }

    /// Returns a term for pages only.
    pub(crate) fn page(label: impl Into<Inline>, value: impl Into<Inline>) -> Self {
        Self { text: None, ..Self::new(label, value) }
    }

    /// Returns a term for texts only.
    pub(crate) fn text(label: &str, value: impl Into<String>) -> Self {
        Self { is_in_page: false, ..Self::new(label, value.into()) }
    }

    /// Returns the term with another label in a text.
    pub(crate) fn short(self, label: &str) -> Self {
        let value = self.value.text();
        self.in_text(label, value)
    }

    /// Returns the term with another label and value in a text.
    pub(crate) fn in_text(self, label: &str, value: impl Into<String>) -> Self {
        Self { text: Some((label.to_owned(), value.into())), ..self }
    }

    /// Returns the term with a tone and a maximum number of lines.
    pub(crate) fn shown(self, tone: Tone, lines: usize) -> Self {
        Self { tone, lines, ..self }
    }
}

/// Returns the first values of a list as terms of a text, and the number of the others.
pub(crate) fn listed<T>(label: &str, items: &[T], value: impl Fn(&T) -> String) -> Vec<Term> {
    listed_to(MAX_LISTED, label, items, |item| Term::text(label, value(item)))
}

/// Returns the first `most` terms of a list, and the number of the others.
pub(crate) fn listed_to<T>(most: usize, label: &str, items: &[T], term: impl Fn(&T) -> Term) -> Vec<Term> {
    let mut terms: Vec<Term> = items.iter().take(most).map(term).collect();
    terms.extend((items.len() > most).then(|| Term::text(label, format!("and {} more", items.len() - most))));
    terms
}

/// A table; the first cell of a row is its head.
#[derive(Default)]
pub(crate) struct Table {
    pub caption: Inline,
    pub heads: Vec<Inline>,
    /// Indices of the left-aligned columns.
    pub left: Vec<usize>,
    pub rows: Vec<Vec<Inline>>,
    /// Indices of the columns in a text; empty for a table of pages only.
    pub in_text: Vec<usize>,
    /// Index of the column whose cells a text shows below their rows.
    pub below: Option<usize>,
}

impl Table {
    /// Returns a table for pages only.
    pub(crate) fn new<H: Into<Inline>>(
        caption: impl Into<Inline>,
        heads: impl IntoIterator<Item = H>,
        left: &[usize],
        rows: Vec<Vec<Inline>>,
    ) -> Self {
        let heads = heads.into_iter().map(H::into).collect();
        Self { caption: caption.into(), heads, left: left.to_vec(), rows, ..Self::default() }
    }

    /// Returns the table with the columns for a text: those for whose heads `is_shown` returns true.
    pub(crate) fn in_text(mut self, is_shown: impl Fn(&str) -> bool) -> Self {
        self.in_text = (0..self.heads.len()).filter(|&i| is_shown(&self.heads[i].text())).collect();
        self
    }
}

/// Returns texts as cells of a table.
pub(crate) fn cells<const N: usize>(texts: [String; N]) -> Vec<Inline> {
    texts.map(Inline::from).to_vec()
}
