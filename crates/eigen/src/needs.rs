//! The memory and time of an attempt, estimated before the work from the symbolic analysis.

use super::failure::EigenFailure;
use super::problem::{EigenProblem, Task};
use super::refine::COLUMNS_PER_PRODUCT;
use super::settings::{Accuracy, Precision};

/// Memory and time of an attempt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Needs {
    /// Largest number of bytes by which the process grows.
    pub bytes: u64,
    /// Bytes of the factor used by the search; 0 without a factor.
    pub factor_bytes: u64,
    /// Estimated time of the search on one processor, in seconds, without the factorisation.
    pub seconds: f64,
}

/// Reason why an attempt is not made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Unusable {
    /// Another attempt is better, or was requested.
    Unsuited,
    /// The attempt takes more memory than is available.
    Memory(Needs),
    /// The attempt takes longer than the limit of the context.
    Time(Needs),
}

impl Unusable {
    /// Returns the failure of a search that has no other attempt; `None` if another attempt was preferred.
    pub(super) fn failure(self, task: &Task<'_>, wanted: usize) -> Option<EigenFailure> {
        match self {
            Self::Unsuited => None,
            Self::Memory(Needs { bytes, .. }) => {
                Some(EigenFailure::Memory { bytes, available: task.context.available() })
            }
            Self::Time(Needs { bytes, seconds, .. }) => {
                Some(EigenFailure::TooLong { wanted, seconds, bytes })
            }
        }
    }
}

impl Needs {
    /// Returns these needs if they are within the limits of the context.
    ///
    /// # Errors
    /// The limit that they exceed: [`Unusable::Memory`] or [`Unusable::Time`].
    pub(super) fn within_limits(self, task: &Task<'_>) -> Result<Self, Unusable> {
        if self.bytes > task.context.available() {
            return Err(Unusable::Memory(self));
        }
        if task.context.longest.is_some_and(|longest| self.seconds > longest) {
            return Err(Unusable::Time(self));
        }
        Ok(self)
    }
}

/// Operations per second that time estimates assume, for one processor and the mixed work of a search.
const OPERATIONS_PER_SECOND: f64 = 4e9;

/// Returns the needs of a search with a factor of this precision.
pub(super) fn factor_needs(task: &Task<'_>, wanted: usize, precision: Precision) -> Result<Needs, Unusable> {
    let Task { problem, analysis, peaks, .. } = task;
    let n = problem.pencil.n();
    let size = precision.bytes();
    let found = (size * peaks.cholesky).max(size * peaks.factor + vector_bytes(problem, wanted, precision));
    let needs = Needs {
        bytes: resident(with_bounds(task, wanted, found.max(made_of_modes(n, wanted)))),
        factor_bytes: size * peaks.factor,
        seconds: search_seconds(n, wanted, analysis.factor_len() as u64),
    };
    needs.within_limits(task)
}

/// Returns `bytes` increased by the memory for the bounds of [`Accuracy::Certified`], which factor another matrix
/// beside the modes.
pub(super) fn with_bounds(task: &Task<'_>, wanted: usize, bytes: u64) -> u64 {
    if task.settings.accuracy != Accuracy::Certified {
        return bytes;
    }
    let entries = task.problem.pencil.stiffness().as_csc().nnz() as u64;
    bytes.max(count_bytes(task, wanted)) + 12 * entries
}

/// Returns the number of columns of the Krylov basis. Measured: five for each wanted mode.
pub(super) fn basis_columns(wanted: usize) -> usize {
    (5 * wanted + 16).min(2 * wanted + 128)
}

/// Returns the bytes of a search beside the factor: Krylov basis, blocks in use, modes with products of some of them,
/// and corrections.
pub(super) fn vector_bytes(problem: &EigenProblem<'_>, wanted: usize, precision: Precision) -> u64 {
    let basis = basis_columns(wanted);
    let found = wanted + 3 * wanted.min(COLUMNS_PER_PRODUCT) + 24;
    let columns = match precision {
        Precision::Double => basis + found,
        // A span of three times its first size (1.5 for each wanted mode and 16) with its products with K and M, and
        // forces and vectors in use.
        Precision::Single => (basis + found + 2 * wanted).max(17 * wanted + 180),
    };
    8 * (problem.pencil.n() * columns) as u64
}

/// Returns the bytes that a caller needs beside `wanted` modes: a copy of them, and tables with numbers for each pair
/// of modes.
pub(super) fn made_of_modes(n: usize, wanted: usize) -> u64 {
    let (n, wanted) = (n as u64, wanted as u64);
    8 * (80 * wanted * wanted + 3 * n * wanted)
}

/// Estimates the seconds of an iterative search: solutions with a factor of `factor` numbers, orthogonalisation against
/// the basis, restarts, and the products of all pairs of modes.
pub(super) fn search_seconds(n: usize, wanted: usize, factor: u64) -> f64 {
    let (rows, modes) = (n as f64, wanted as f64);
    let (basis, columns) = (basis_columns(wanted) as f64, 3.0 * modes + 100.0);
    let search = columns * (4.0 * factor as f64 + 8.0 * rows * basis) + 6.0 * rows * basis * modes;
    (search + 20.0 * rows * modes * modes) / OPERATIONS_PER_SECOND
}

/// Estimates the seconds of the dense path: two decompositions, and the products of all pairs of modes.
pub(super) fn dense_seconds(n: usize, wanted: usize) -> f64 {
    let (rows, modes) = (n as f64, wanted as f64);
    (30.0 * rows.powi(3) + 20.0 * rows * modes * modes) / OPERATIONS_PER_SECOND
}

/// Returns the bytes by which a process grows that uses `bytes`. In addition to memory in use the allocator holds
/// released blocks (measured: 8 to 16 %), and partly used pages of every size. Each thread has its own allocator pages,
/// and buffers of the dense products (measured on models of 18 000 degrees of freedom: 14 to 20 MB on one thread, 34 to
/// 48 MB on two).
pub(super) fn resident(bytes: u64) -> u64 {
    bytes + bytes / 8 + 8_000_000 + 20_000_000 * rayon::current_num_threads() as u64
}

/// Returns the bytes of an inertia count in double precision, with the modes and their products.
pub(super) fn count_bytes(task: &Task<'_>, modes: usize) -> u64 {
    8 * (task.peaks.inertia + (3 * modes * task.problem.pencil.n()) as u64)
}

/// Returns the bytes by which the process grows for an inertia count in double precision beside `found` modes.
pub(super) fn resident_for_count(task: &Task<'_>, found: usize) -> u64 {
    resident(count_bytes(task, found))
}

/// Returns bytes as a text in GB, or in MB below one GB.
pub(super) fn gigabytes(bytes: u64) -> String {
    if bytes < 1_000_000_000 {
        format!("{:.0} MB", bytes as f64 * 1e-6)
    } else {
        format!("{:.3} GB", bytes as f64 * 1e-9)
    }
}
