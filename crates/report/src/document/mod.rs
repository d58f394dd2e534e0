//! Documents: the tree of a report, and its renderings as a text, as JSON and as a page.

mod blocks;
mod format;
pub(crate) mod html;
mod inline;
mod rendering;
mod table;
mod terms;
pub(crate) mod text;

pub(crate) use blocks::{Block, Document, State, heading};
pub use format::Format;
pub(crate) use format::json;
pub(crate) use inline::{Inline, Span, quantity};
pub(crate) use table::{Table, cells};
pub(crate) use terms::{Term, Tone, listed, listed_to};
