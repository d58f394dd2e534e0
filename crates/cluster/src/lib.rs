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

mod batch_list;
mod condensed;
mod engine;
mod found;
mod ledger;
mod petsc;
mod prepare;
mod prepared;
mod row_order;
mod schedule;
mod sealed;

pub use batch_list::{BatchBody, BatchList, read_batch_list};
pub use engine::{Engine, Solver};
pub use found::{ClusterModes, read_found};
pub use ledger::{DoneBody, Ledger, inputs_fingerprint};
pub use prepare::{Preparation, PrepareSettings, prepare};
pub use prepared::{ModelReference, Prepared, WantedModes, read_prepared};
pub use schedule::{Budget, conversion_bytes};
