//! The tree of a report: built once from the facts, rendered as a text or as a page.

use super::chart::{Bars, Cells, Chart};
use super::render::{Format, json};
use super::{html, text};
use flexbody_base::diagnostic::Diagnostic;
use flexbody_body::flex_body::FlexBody;
use serde::Serialize;

/// Lines of a text that a term takes at most.
const LINES: usize = 4;
/// Entries of a list that a text shows.
const LISTED: usize = 6;

/// A report.
pub(crate) struct Document<'a> {
    /// Name of the body or scene, and kind of the report: the head of a page.
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
            Format::Html => html::render(&document()),
        }
    }
}

/// A part of a report.
pub(crate) enum Block<'a> {
    /// Heading of a section of a page.
    Heading(Inline),
    /// The verdict of a page, its first words emphasised. A text has the verdict among its terms.
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
    /// A paragraph of a page in the colour of what matters less.
    Quiet(String),
    /// A limit of the use of a body, on a page.
    Caution(String),
    /// A list of a page.
    List(Vec<Inline>),
    Chart(Chart),
    Bars(Bars),
    /// Maps of a page beside each other, below the scale of their colours; a map without cells has its words only.
    Maps(Vec<(Inline, Option<Cells>)>),
    /// Blocks of a page that are shown when their summary is clicked, and printed.
    Fold(&'static str, Vec<Block<'a>>),
    /// Text of a page with its own line breaks.
    Preformatted(String),
    /// The picture of a body on a page, if it has one, with other blocks beside it.
    Picture(&'a FlexBody, Vec<Block<'a>>),
}

/// Outcome of the verdict.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum State {
    Good,
    /// Nothing was to be proved.
    Given,
    Open,
}

/// A heading of a page.
pub(crate) fn heading<'a>(title: impl Into<Inline>) -> Block<'a> {
    Block::Heading(title.into())
}

/// A text, with pieces that a page marks.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Inline(pub Vec<Span>);

/// A piece of a text.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Span {
    Plain(String),
    /// A number with its unit, whose exponents a page raises.
    Quantity(String),
    Strong(String),
    Error(String),
    Warning(String),
    Code(String),
    /// A word with its explanation.
    Word(String, &'static str),
}

impl Span {
    /// The text of the piece.
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

    /// The text without marks.
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

/// A number with its unit.
pub(crate) fn quantity(text: impl Into<String>) -> Inline {
    Span::Quantity(text.into()).into()
}

/// A name with a value.
pub(crate) struct Term {
    pub label: Inline,
    pub value: Inline,
    pub is_in_page: bool,
    /// Label and value in a text; `None`: the term is not in a text.
    pub text: Option<(String, String)>,
    pub tone: Tone,
    /// Lines of a text that the term takes at most.
    pub lines: usize,
}

/// Meaning of a term, which a terminal shows by its colour.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Tone {
    Title,
    Plain,
    Good,
    Warning,
    Bad,
}

impl Term {
    /// A term of texts and pages.
    pub(crate) fn new(label: impl Into<Inline>, value: impl Into<Inline>) -> Self {
        let (label, value) = (label.into(), value.into());
        let text = Some((label.text(), value.text()));
        Self { label, value, is_in_page: true, text, tone: Tone::Plain, lines: LINES }
    }

    /// A term of pages only.
    pub(crate) fn page(label: impl Into<Inline>, value: impl Into<Inline>) -> Self {
        Self { text: None, ..Self::new(label, value) }
    }

    /// A term of texts only.
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

    /// Returns the term with a meaning and a limit of its lines.
    pub(crate) fn shown(self, tone: Tone, lines: usize) -> Self {
        Self { tone, lines, ..self }
    }
}

/// The first values of a list as terms of a text, with the number of the others.
pub(crate) fn listed<T>(label: &str, items: &[T], value: impl Fn(&T) -> String) -> Vec<Term> {
    listed_to(LISTED, label, items, |item| Term::text(label, value(item)))
}

/// The first `most` terms of a list, with the number of the others.
pub(crate) fn listed_to<T>(most: usize, label: &str, items: &[T], term: impl Fn(&T) -> Term) -> Vec<Term> {
    let mut terms: Vec<Term> = items.iter().take(most).map(term).collect();
    terms.extend((items.len() > most).then(|| Term::text(label, format!("and {} more", items.len() - most))));
    terms
}

/// A table, in which the first cell of a row is its head.
#[derive(Default)]
pub(crate) struct Table {
    pub caption: Inline,
    pub heads: Vec<Inline>,
    /// Columns that are left-aligned.
    pub left: Vec<usize>,
    pub rows: Vec<Vec<Inline>>,
    /// Columns that a text shows; empty for a table of pages only.
    pub in_text: Vec<usize>,
    /// Column whose cells a text shows below their rows.
    pub below: Option<usize>,
}

impl Table {
    /// A table of pages.
    pub(crate) fn new<H: Into<Inline>>(
        caption: impl Into<Inline>,
        heads: impl IntoIterator<Item = H>,
        left: &[usize],
        rows: Vec<Vec<Inline>>,
    ) -> Self {
        let heads = heads.into_iter().map(H::into).collect();
        Self { caption: caption.into(), heads, left: left.to_vec(), rows, ..Self::default() }
    }

    /// Returns the table, in a text with the columns for whose heads `is_shown` returns true.
    pub(crate) fn in_text(mut self, is_shown: impl Fn(&str) -> bool) -> Self {
        self.in_text = (0..self.heads.len()).filter(|&i| is_shown(&self.heads[i].text())).collect();
        self
    }
}

/// Texts as cells of a table.
pub(crate) fn cells<const N: usize>(texts: [String; N]) -> Vec<Inline> {
    texts.map(Inline::from).to_vec()
}
