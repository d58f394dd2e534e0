//! The number of a body among several in the same matrices.

/// Which of several bodies in the same matrices a model is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BodyNumber {
    /// From 1, in the order of the first node of each body in the node table.
    pub number: usize,
    /// How many bodies there are.
    pub of: usize,
}

impl std::fmt::Display for BodyNumber {
    /// `body 1 of 2`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "body {} of {}", self.number, self.of)
    }
}
