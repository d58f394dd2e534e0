//! A body as a binary file that real-time programs evaluate in place, and the C99 header that does so.

mod arrays;
mod header;
mod layout;
mod write;

pub use layout::embedded_markdown;
pub(super) use write::Embedded;
