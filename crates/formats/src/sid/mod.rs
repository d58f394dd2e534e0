//! SID_FEM text: Standard Input Data of a flexible body after Wallrapp, in the dialects that programs read.
//! The reader follows the description of the format alone and shares no code with the writer.

#[cfg(feature = "import")]
pub(super) mod read;
mod text;
pub(super) mod write;
