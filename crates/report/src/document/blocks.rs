//! Tree of a report, built once from the facts and rendered as a text or as a page.

use super::inline::Inline;
use super::table::Table;
use super::terms::Term;
use crate::chart::{Bars, Cells, Chart};
use crate::picture::Fields;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_body::flex_body::FlexBody;

/// A report.
pub(crate) struct Document<'a> {
    /// Name of the body or scene; with the kind of the report it is the head of a page.
    pub name: &'a str,
    pub kind: &'static str,
    pub generator: &'a str,
    pub blocks: Vec<Block<'a>>,
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
