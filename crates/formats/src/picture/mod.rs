//! Shared code of pictures of a body: the drawn points, lines and triangles, the names of modes, the played
//! motion.

mod drawn;
mod labels;
mod played;

pub(crate) use drawn::Drawn;
pub(crate) use labels::{mode_names, named, printable, rounded};
pub(crate) use played::Played;
