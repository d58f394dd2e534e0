//! What a Craig-Bampton body is made of, what is proved of it, and how far it goes.

/// The fixed-interface modes of a Craig-Bampton basis, and the free body beside the reduced one.
#[derive(Debug, Clone, PartialEq)]
pub struct FixedInterface {
    /// Fixed-interface modes that the basis has; none: static condensation.
    pub modes: usize,
    /// Motions of the interfaces: constraint modes.
    pub interface_motions: usize,
    /// Fixed-interface modes below `shift` by the inertia count of T'(K - sigma M)T; `None`: not counted.
    pub counted: Option<usize>,
    /// Shift sigma of that count. Unit: 1/time^2.
    pub shift: f64,
    /// Eigenvalue of the first mode that the basis leaves out, where it was computed. Unit: 1/time^2.
    pub next: Option<f64>,
    /// Largest residual of a fixed-interface mode, relative as those of modes; 0 without any.
    pub residual: f64,
    /// For each mode of the reduced body the eigenvalue of the free body as estimated, which is an upper
    /// bound of it. Unit: 1/time^2.
    pub free_estimate: Vec<f64>,
    /// Lower bounds of these, to rounding; 0: none. Unit: 1/time^2.
    pub free_lower: Vec<f64>,
}

impl FixedInterface {
    /// Part by which the frequency of mode `j`, whose eigenvalue in the reduced body is `theta`, is too high,
    /// as estimated.
    ///
    /// # Panics
    /// When `j` is not below the number of modes.
    pub fn excess(&self, j: usize, theta: f64) -> f64 {
        ((theta / self.free_estimate[j]).sqrt() - 1.0).max(0.0)
    }

    /// The same at most; `None`: without a bound.
    ///
    /// # Panics
    /// When `j` is not below the number of modes.
    pub fn largest_excess(&self, j: usize, theta: f64) -> Option<f64> {
        let lower = self.free_lower[j];
        (lower > 0.0).then(|| ((theta / lower).sqrt() - 1.0).max(0.0))
    }

    /// How many of the lowest modes, with the eigenvalues `theta` in the reduced body, have frequencies that
    /// are at most the part `within` too high: by the bound, or the estimate where there is none.
    pub fn holding(&self, theta: &[f64], within: f64) -> usize {
        let excess = |j: usize| self.largest_excess(j, theta[j]).unwrap_or_else(|| self.excess(j, theta[j]));
        (0..theta.len()).take_while(|&j| excess(j) <= within).count()
    }

    /// Whether the inertia count proves that no fixed-interface mode is missing below the highest that the
    /// basis has.
    pub fn is_proved(&self) -> bool {
        self.counted.is_some_and(|counted| counted >= self.modes)
    }
}
