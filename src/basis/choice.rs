//! The bases there are.

use super::{Basis, FreeSurface, ImportedShapes, Loads};
use crate::provenance::SourceFile;

/// Which basis a body gets: every implementation of [`Basis`] has a variant here.
#[derive(Debug, Clone, PartialEq)]
pub enum BasisChoice {
    /// Free-surface modes, with residual vectors where they are wanted.
    Free(FreeSurface),
    /// Shapes that were computed elsewhere.
    Imported(ImportedShapes),
}

impl Default for BasisChoice {
    /// Free-surface modes alone.
    fn default() -> Self {
        Self::Free(FreeSurface::default())
    }
}

impl BasisChoice {
    /// Files that were read for it.
    pub fn sources(&self) -> Vec<&SourceFile> {
        match self {
            Self::Free(free) => free.residual_vectors.iter().filter_map(Loads::source).collect(),
            Self::Imported(shapes) => shapes.source().into_iter().collect(),
        }
    }

    /// The one that is chosen.
    pub fn basis(&self) -> &dyn Basis {
        match self {
            Self::Free(free) => free,
            Self::Imported(shapes) => shapes,
        }
    }
}
