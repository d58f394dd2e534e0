//! A search as it is kept, so that another one goes on from there.

use faer::Mat;

/// A search as it stands: (K + tau M)^-1 M V = V Theta + F C with theta = 1 / (lambda + tau). It does not
/// depend on how the factor was made, and a search for more modes, or for the same ones more accurately, goes
/// on from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot {
    /// tau.
    pub shift: f64,
    /// lambda of the k Ritz vectors V, ascending.
    pub eigenvalues: Vec<f64>,
    /// V, then the newest block F (N x (k + b)): M-orthonormal, M-orthogonal to the rigid modes.
    pub basis: Mat<f64>,
    /// C (b x k).
    pub coupling: Mat<f64>,
    /// How many of the Ritz vectors are modes at the accuracy that was asked for.
    pub converged: usize,
}

/// Takes a snapshot whenever modes have converged.
pub type Save<'a> = &'a (dyn Fn(&Snapshot) + Sync);

/// Where a search starts, and who keeps how far it came. Neither changes what a result promises: residuals
/// and completeness are those of the outcome, whatever the start was.
#[derive(Clone, Copy, Default)]
pub struct Resume<'a> {
    /// An earlier search on the same pencil; one that does not fit the pencil is left aside.
    pub start: Option<&'a Snapshot>,
    /// Called in the thread of the search.
    pub save: Option<Save<'a>>,
}

impl std::fmt::Debug for Resume<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let start = self.start.map(|snapshot| snapshot.converged);
        f.debug_struct("Resume").field("start", &start).field("save", &self.save.is_some()).finish()
    }
}

impl Resume<'_> {
    /// Hands a snapshot to whoever keeps them; it is only made where there is somebody.
    pub(super) fn save(&self, snapshot: impl FnOnce() -> Snapshot) {
        if let Some(save) = self.save {
            save(&snapshot());
        }
    }
}
