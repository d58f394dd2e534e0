//! Pictures of a body: selection of the drawn parts, data and script of an interactive picture, and a still
//! picture.

mod drawing;
mod embedded;
mod field;
mod initial_view;
mod packed;
mod principal_axes;
mod shown_body;
mod still;

pub(crate) use embedded::{EMBEDDED_STYLE, Embedded};
pub(crate) use field::{Field, Fields};

// Parts of the page that shows a body in motion.
#[cfg(feature = "hdf5")]
pub(crate) use {
    drawing::{Drawing, HALF_STEP},
    packed::{Packed, script},
    shown_body::{SCRIPT, ShownBody},
};
