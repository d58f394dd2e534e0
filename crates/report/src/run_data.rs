//! Data of a run that are never stored in the flex-body file: times, memory, counters, diagnostics.

use flexbody_base::diagnostic::Diagnostic;
use serde::Serialize;

/// One phase of a run.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Phase {
    /// Name: `read`, `modes`, ...
    pub name: String,
    /// Wall time of the phase. Unit: s.
    pub wall_seconds: f64,
    /// Processor time of all threads. Unit: s.
    pub cpu_seconds: f64,
}

/// Modes computed from the lumped mass (question b of theory section 9) of one scheme.
#[derive(Debug, Clone, PartialEq)]
pub struct LumpedModes {
    /// Name of the scheme: `row-sum`, `diagonal-scaling`, `user`.
    pub scheme: String,
    /// Frequencies, ascending; empty if there are none. Unit: Hz.
    pub frequencies_hz: Vec<f64>,
    /// Smallest cosine between the subspaces of corresponding modes.
    pub subspace_cosine: f64,
    /// Error norms of the aligned invariants, by name.
    pub comparison: Vec<(String, f64)>,
    /// Reason why the modes could not be computed (negative masses, for example); empty otherwise.
    pub remark: String,
    /// Reason why the errors of the invariants and the cosine have little meaning (a group of equal
    /// frequencies is cut off, for example); empty otherwise.
    pub caution: String,
}

/// Data of a run. The default stands for the unknown run of a body read from a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RunData {
    /// Phases in order.
    pub phases: Vec<Phase>,
    /// Largest resident memory of the process; `None` if the system does not report it. Unit: bytes.
    pub peak_memory_bytes: Option<u64>,
    /// Estimate of the memory before the run, if one was made. Unit: bytes.
    pub memory_estimate_bytes: Option<u64>,
    /// Number of threads.
    pub threads: usize,
    /// Name of the vector instructions of the kernels, on which last bits depend.
    pub instructions: String,
    /// All diagnostics in the order in which they were found.
    pub diagnostics: Vec<Diagnostic>,
    /// Work counts by name.
    pub counters: Vec<(String, u64)>,
    /// Attempts by which the modes could be searched for, in their order; empty on the dense path.
    pub attempts: Vec<SearchAttempt>,
    /// Accuracy: `fast`, `standard`, `certified`.
    pub accuracy: String,
    /// Loads whose geometric stiffness the body does not have, and the elements of the deck would give; as
    /// `--geometric-stiffness` names them.
    pub offered_stiffness: Vec<&'static str>,
    /// Name and size in bytes of the flex-body file.
    pub output: Option<(String, u64)>,
    /// Modes computed from the lumped masses, if requested.
    pub lumped_modes: Vec<LumpedModes>,
}

/// One attempt to find the modes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SearchAttempt {
    /// Name of the algorithm.
    pub way: String,
    /// Memory that it takes, estimated before the work. Unit: bytes.
    pub bytes: u64,
    /// The reason why it found no modes; `None` for the attempt that found them and for those after it.
    pub failure: Option<String>,
}

impl RunData {
    /// Returns the wall time of all phases. Unit: s.
    pub(super) fn wall_seconds(&self) -> f64 {
        self.phases.iter().map(|phase| phase.wall_seconds).sum()
    }

    /// Returns the processor time of all phases and threads. Unit: s.
    pub(super) fn cpu_seconds(&self) -> f64 {
        self.phases.iter().map(|phase| phase.cpu_seconds).sum()
    }
}
