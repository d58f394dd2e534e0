//! Pictures of a body: selection of the drawn parts, data and script of an interactive picture, and a still
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
