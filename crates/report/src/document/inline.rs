//! Texts with marked pieces.

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
