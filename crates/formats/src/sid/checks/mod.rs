//! Checks of the redundant arrays of a SID file.

mod digits;
mod frames;
mod frequencies;
mod missed;
mod missing;
mod redundant;

pub(crate) use redundant::checks;
