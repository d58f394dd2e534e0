//! What the redundant arrays of a SID file must fulfil.

pub(crate) mod frequencies;
pub(crate) mod missing;
pub(crate) mod redundant;
pub(crate) mod taylor;
