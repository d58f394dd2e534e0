//! Project Chrono: matrices for `ChModalAssembly::DoModalReduction(M, K, Cq, ...)` and
//! `ChModalDampingReductionR(R)` as Matrix Market files.
//!
//! These calls take the matrices of boundary nodes, then of internal nodes, six coordinates each. The
//! boundary nodes are the frames; [`assembly`] defines the internal nodes.

mod assembly;
mod format;

pub(crate) use format::Chrono;
