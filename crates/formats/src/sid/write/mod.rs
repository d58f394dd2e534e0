//! SID_FEM text: Standard Input Data of a flexible body after Wallrapp, in the dialects that programs read.

mod arrays;
mod dialect;
mod format;
mod text;

pub(crate) use format::Sid;
