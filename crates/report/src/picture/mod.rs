//! Pictures of a body: what of it is drawn, the numbers and the script that move it in a page, and a still
//! picture.

mod arrays;
mod drawing;
mod embedded;
mod shown;
mod still;

pub(super) use embedded::Embedded;
#[cfg(feature = "hdf5")]
pub(super) use {
    arrays::{Packed, script},
    drawing::{Drawing, HALF_STEP},
    shown::{SCRIPT, ShownBody},
};
