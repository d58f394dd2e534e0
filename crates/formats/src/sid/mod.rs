//! SID_FEM text: Standard Input Data of a flexible body after Wallrapp, in the dialects that programs read.
//! The reader follows the description of the format alone and shares no code with the writer.

mod checks;
pub(super) mod import;
mod read;
pub(super) mod write;
