//! Computations on a cluster and batches: the files that a cluster needs to find the modes of a model (`prepare`), its
//! results (`found`, `condensed`), the program that runs there (`driver.py`), its local start (`engine`), and lists of
//! bodies (`batch`).

#![deny(
    clippy::exit,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::too_many_lines,
    clippy::unwrap_used
)]

mod batch;
mod engine;
mod found;
mod petsc;
mod prepare;
mod sealed;

pub use batch::{
    BatchBody, BatchList, Budget, DoneBody, Ledger, conversion_bytes, inputs_fingerprint, read_batch_list,
};
pub use engine::{Engine, Solver};
pub use found::{ClusterModes, read_found};
pub use prepare::{
    ModelReference, Preparation, PrepareSettings, Prepared, WantedModes, prepare, read_prepared,
};
