//! Data of a run that are never stored in the flex-body file: times, memory, counters, diagnostics.

use flexbody_base::diagnostic::Diagnostic;
use serde::Serialize;

/// One phase of a run.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Phase {
    /// Name: `read`, `modes`, ...
    pub name: String,
    /// Time that passed. Unit: s.
    pub wall_seconds: f64,
    /// Processor time of all threads. Unit: s.
    pub cpu_seconds: f64,
}

/// Modes that the lumped mass gives by itself (question b of theory section 9), for one scheme.
#[derive(Debug, Clone, PartialEq)]
pub struct LumpedModes {
    /// `row-sum`, `diagonal-scaling`, `user`.
    pub scheme: String,
    /// Frequencies in hertz, ascending; empty when there are none.
    pub frequencies_hz: Vec<f64>,
    /// Smallest cosine between the subspaces of corresponding modes.
    pub subspace_cosine: f64,
    /// Error norms of the aligned invariants, by name.
    pub comparison: Vec<(String, f64)>,
    /// Why it could not be done (negative masses, for example); empty when it could.
    pub remark: String,
    /// Why errors of the invariants and the cosine say little (the count cuts a group of equal frequencies, for
    /// example); empty when they do not.
    pub caution: String,
}

/// Data of one run. The default stands for a body read from a file, of whose run nothing is known.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RunData {
    /// Phases in order.
    pub phases: Vec<Phase>,
    /// Largest resident memory of the process, where the system tells it.
    pub peak_memory_bytes: Option<u64>,
    /// Memory that was expected before the work, if it was estimated.
    pub memory_estimate_bytes: Option<u64>,
    /// Number of threads.
    pub threads: usize,
    /// Everything that was found, in order.
    pub diagnostics: Vec<Diagnostic>,
    /// Work counts by name.
    pub counters: Vec<(String, u64)>,
    /// Attempts by which the modes could be searched for, in their order; empty on the dense path.
    pub attempts: Vec<SearchAttempt>,
    /// `fast`, `standard`, `certified`.
    pub accuracy: String,
    /// Name and size in bytes of the flex-body file.
    pub output: Option<(String, u64)>,
    /// Modes from the lumped masses too, where asked for.
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
    /// Time of all phases. Unit: s.
    pub(super) fn wall_seconds(&self) -> f64 {
        self.phases.iter().map(|phase| phase.wall_seconds).sum()
    }

    /// Processor time of all phases and threads. Unit: s.
    pub(super) fn cpu_seconds(&self) -> f64 {
        self.phases.iter().map(|phase| phase.cpu_seconds).sum()
    }
}
