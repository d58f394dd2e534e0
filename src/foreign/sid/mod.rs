//! SID_FEM text of any dialect, read from the description of the format alone, and everything that its redundant arrays must fulfil.

mod arrays;
mod body;
mod checks;
mod format;
mod frequencies;
mod head;
mod layout;
mod lines;
mod missing;
mod parse;
mod taylor;

pub use format::SidFile;
