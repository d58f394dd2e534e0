//! Record groups of the `.fem` file, and the body that they describe.

pub(super) mod body;
mod lumped;
pub(super) mod records;
pub(super) mod words;
