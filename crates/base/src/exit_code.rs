//! Exit codes of the process.

/// Process exit codes, the contract with scripts and CI pipelines (`docs/reference/codes.md`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum ExitCode {
    /// Success.
    Done = 0,
    /// A check failed or a tolerance was exceeded; the inputs were readable.
    CheckFailed = 1,
    /// Bad input or usage.
    BadInput = 2,
    /// No trustworthy numerical result: not converged, mechanism, indefinite mass.
    Untrustworthy = 3,
    /// Not enough memory or disk, or an output that may not be written.
    Resources = 4,
    /// Internal error.
    Bug = 70,
    /// Interruption by Ctrl-C, SIGTERM or SIGHUP; no unfinished file is left.
    Interrupted = 130,
}
