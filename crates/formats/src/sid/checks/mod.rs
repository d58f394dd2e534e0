//! What the redundant arrays of a SID file must fulfil.

mod digits;
mod frames;
mod frequencies;
mod missed;
mod missing;
mod redundant;

pub(crate) use redundant::checks;
