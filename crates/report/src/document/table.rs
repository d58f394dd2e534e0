//! Tables of a document.

use super::inline::Inline;

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
