//! The bases there are.

use super::{Basis, FreeSurface, ImportedShapes};
use crate::provenance::SourceFile;

/// Which basis a body gets: every implementation of [`Basis`] has a variant here.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum BasisChoice {
    /// Free-surface modes.
    #[default]
    Free,
    /// Shapes that were computed elsewhere.
    Imported(ImportedShapes),
}

impl BasisChoice {
    /// Files that were read for it.
    pub fn sources(&self) -> Option<&SourceFile> {
        match self {
            Self::Free => None,
            Self::Imported(shapes) => shapes.source(),
        }
    }

    /// The one that is chosen.
    pub fn basis(&self) -> &dyn Basis {
        match self {
            Self::Free => &FreeSurface,
            Self::Imported(shapes) => shapes,
        }
    }
}
