//! Places of the frame in the state of the nodal equations.

use crate::dynamics::EulerParameters;

/// First index of each part but the first in a state y = (G, D, e, P, L, u, w).
pub(super) const OFFSET: usize = 3;
pub(super) const ATTITUDE: usize = 6;
pub(super) const LINEAR: usize = 10;
pub(super) const ANGULAR: usize = 13;
pub(super) const DISPLACEMENTS: usize = 16;

/// Returns the Euler parameters of a state.
pub(super) fn attitude(frame: &[f64]) -> EulerParameters {
    EulerParameters([frame[ATTITUDE], frame[ATTITUDE + 1], frame[ATTITUDE + 2], frame[ATTITUDE + 3]])
}
