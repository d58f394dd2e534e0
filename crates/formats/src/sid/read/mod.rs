//! SID_FEM text of any dialect, read from the description of the format alone.

pub(crate) mod arrays;
pub(crate) mod body;
pub(crate) mod head;
pub(crate) mod layout;
pub(crate) mod lines;
pub(crate) mod parse;
pub(crate) mod taylor;
