//! Terms of a document: names with their values.

use super::inline::Inline;

/// Default maximum of lines of a term in a text.
const MAX_LINES: usize = 4;

/// Number of list entries that a text shows.
const MAX_LISTED: usize = 6;

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
