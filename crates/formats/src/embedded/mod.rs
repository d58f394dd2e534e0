//! A body as a binary file that real-time programs evaluate in place, with a C99 header that evaluates it.

mod arrays;
mod header;
mod layout;
mod write;

pub use layout::embedded_markdown;
pub(super) use write::Embedded;
