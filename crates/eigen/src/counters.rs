//! The work of a search in counts.

/// Work done, independent of the machine: snapshotted in tests, so that a slower algorithm fails without
/// timing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counters {
    /// Numeric factorisations (Cholesky and inertia counts).
    pub factorizations: u64,
    /// Columns solved with the factor.
    pub solved_columns: u64,
    /// Columns multiplied by K.
    pub stiffness_columns: u64,
    /// Columns multiplied by M.
    pub mass_columns: u64,
    /// Thick restarts.
    pub restarts: u64,
    /// Ritz vectors taken from an earlier search.
    pub taken_up: u64,
    /// Numbers in one factor.
    pub factor_len: u64,
    /// Multiplications and additions of one factorisation.
    pub factor_flops: u64,
    /// Bytes of the factor that the modes were found with (0 for the dense path).
    pub factor_bytes: u64,
}
