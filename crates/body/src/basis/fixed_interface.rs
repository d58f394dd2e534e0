//! Composition of a Craig-Bampton body, its proof of completeness, and its range of frequency.

/// Fixed-interface modes of a Craig-Bampton basis, and estimates of the free body.
#[derive(Debug, Clone, PartialEq)]
pub struct FixedInterface {
    /// Number of fixed-interface modes in the basis; 0: static condensation.
    pub modes: usize,
    /// Number of motions of the interfaces (constraint modes).
    pub interface_motions: usize,
    /// Number of fixed-interface modes below `shift` by the inertia count of T'(K - sigma M)T; `None`: not
    /// counted.
    pub counted: Option<usize>,
    /// Shift sigma of the count. Unit: 1/time^2.
    pub shift: f64,
    /// Eigenvalue of the first truncated mode, if it was computed. Unit: 1/time^2.
    pub next: Option<f64>,
    /// Largest relative residual of a fixed-interface mode; 0 without any.
    pub residual: f64,
    /// Estimated eigenvalue of the free body for each mode of the reduced body, an upper bound of the exact
    /// one. Unit: 1/time^2.
    pub free_estimate: Vec<f64>,
    /// Lower bounds of the eigenvalues of the free body, up to rounding; 0: none. Unit: 1/time^2.
    pub free_lower: Vec<f64>,
}

impl FixedInterface {
    /// Returns the estimated relative error by which the frequency of mode `j`, with eigenvalue `theta` in
    /// the reduced body, is too high.
    ///
    /// # Panics
    /// When `j` is not below the number of modes.
    pub fn excess(&self, j: usize, theta: f64) -> f64 {
        ((theta / self.free_estimate[j]).sqrt() - 1.0).max(0.0)
    }

    /// Returns the upper bound of the relative error by which the frequency of mode `j`, with eigenvalue
    /// `theta` in the reduced body, is too high; `None` without a bound.
    ///
    /// # Panics
    /// When `j` is not below the number of modes.
    pub fn largest_excess(&self, j: usize, theta: f64) -> Option<f64> {
        let lower = self.free_lower[j];
        (lower > 0.0).then(|| ((theta / lower).sqrt() - 1.0).max(0.0))
    }

    /// Returns the number of lowest modes, with eigenvalues `theta` in the reduced body, whose frequencies
    /// are too high by at most the part `within`: by the bound, or by the estimate if there is no bound.
    pub fn holding(&self, theta: &[f64], within: f64) -> usize {
        let excess = |j: usize| self.largest_excess(j, theta[j]).unwrap_or_else(|| self.excess(j, theta[j]));
        (0..theta.len()).take_while(|&j| excess(j) <= within).count()
    }

    /// Returns true if the inertia count proves that no fixed-interface mode is missing below the highest
    /// one in the basis.
    pub fn is_proved(&self) -> bool {
        self.counted.is_some_and(|counted| counted >= self.modes)
    }
}
