//! What pictures of a body share: the points, lines and triangles that are drawn, the names of modes, the
//! motion that is played.

mod drawn;
mod labels;
mod played;

pub(crate) use drawn::Drawn;
pub(crate) use labels::{mode_names, named, printable, rounded};
pub(crate) use played::Played;
