//! Rendering of a document in every format.

use super::blocks::Document;
use super::format::{Format, json};
use super::{html, text};
use serde::Serialize;

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
