//! How the process tells its outcome to scripts.

/// Process exit codes, the contract with scripts and CI pipelines (`docs/codes.md`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum ExitCode {
    /// The work was done.
    Done = 0,
    /// A check failed or a tolerance was exceeded; the inputs themselves were readable.
    CheckFailed = 1,
    /// Bad input or usage.
    BadInput = 2,
    /// No trustworthy numerical result: not converged, mechanism, indefinite mass.
    Untrustworthy = 3,
    /// Not enough memory or disk.
    Resources = 4,
    /// A bug of ours.
    Bug = 70,
    /// Interrupted (Ctrl-C), told to end (SIGTERM) or left by its terminal (SIGHUP); no unfinished file is left.
    Interrupted = 130,
}
