//! Numbers of the bodies in one pair of matrices.

/// Number of a model among several bodies in one pair of matrices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BodyNumber {
    /// Number from 1, in the order of the first node of each body in the node table.
    pub number: usize,
    /// Number of all bodies.
    pub of: usize,
}

impl std::fmt::Display for BodyNumber {
    /// Formats the number as `body 1 of 2`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "body {} of {}", self.number, self.of)
    }
}
