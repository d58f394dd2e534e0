//! The bases there are.

use super::{Basis, CraigBampton, CraigChang, FreeSurface, ImportedShapes, Loads, SolvedModes};
use faer::Mat;
use flexbody_base::provenance::SourceFile;

/// Which basis a body gets: every implementation of [`Basis`] has a variant here.
#[derive(Debug, Clone, PartialEq)]
pub enum BasisChoice {
    /// Free-surface modes, with residual vectors where they are wanted.
    Free(FreeSurface),
    /// Shapes that were computed elsewhere.
    Imported(ImportedShapes),
    /// Free-surface modes that another eigen-solver found.
    Solved(SolvedModes),
    /// Modes with the interfaces held, and constraint modes.
    CraigBampton(CraigBampton),
    /// Free-surface modes, and attachment modes of the interfaces.
    CraigChang(CraigChang),
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
            Self::Imported(shapes) => shapes.source().into_iter().collect(),
            Self::Solved(modes) => vec![&modes.source],
            _ => self.residual_vectors().iter().filter_map(Loads::source).collect(),
        }
    }

    /// The one that is chosen.
    pub fn basis(&self) -> &dyn Basis {
        match self {
            Self::Free(free) => free,
            Self::Imported(shapes) => shapes,
            Self::Solved(modes) => modes,
            Self::CraigBampton(fixed) => fixed,
            Self::CraigChang(free) => free,
        }
    }

    /// The same basis with the static responses to what a motion leaves unbalanced at the nodes (N x m)
    /// beside its modes; `None` for a basis that takes none.
    pub fn with_motion(&self, loads: &Mat<f64>) -> Option<Self> {
        let mut own = self.clone();
        let residual_vectors = match &mut own {
            Self::Free(FreeSurface { residual_vectors })
            | Self::CraigChang(CraigChang { residual_vectors }) => residual_vectors,
            Self::Imported(_) | Self::Solved(_) | Self::CraigBampton(_) => return None,
        };
        if loads.ncols() > 0 {
            residual_vectors.push(Loads::Motion(loads.clone()));
        }
        Some(own)
    }

    /// The eigen-solver that found the modes, where it is not the one of this program.
    pub fn engine(&self) -> Option<&str> {
        match self {
            Self::Solved(modes) => Some(&modes.engine),
            _ => None,
        }
    }

    /// Loads, named by the user, whose static responses join the modes.
    pub fn residual_vectors(&self) -> &[Loads] {
        match self {
            Self::Free(FreeSurface { residual_vectors })
            | Self::CraigChang(CraigChang { residual_vectors }) => residual_vectors,
            Self::Imported(_) | Self::Solved(_) | Self::CraigBampton(_) => &[],
        }
    }
}
