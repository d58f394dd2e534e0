//! Choice of the basis of a body among all kinds of bases.

use super::modal_basis::Basis;
use super::{CraigBampton, CraigChang, FreeSurface, ImportedShapes, Loads, SolvedModes};
use faer::Mat;
use flexbody_base::provenance::SourceFile;

/// Choice of the basis of a body: every implementation of [`Basis`] has a variant here.
#[derive(Debug, Clone, PartialEq)]
pub enum BasisChoice {
    /// Free-surface modes, with residual vectors if requested.
    Free(FreeSurface),
    /// Shapes computed elsewhere.
    Imported(ImportedShapes),
    /// Free-surface modes found by another eigen-solver.
    Solved(SolvedModes),
    /// Modes with the interfaces held, and constraint modes.
    CraigBampton(CraigBampton),
    /// Free-surface modes, and attachment modes of the interfaces.
    CraigChang(CraigChang),
}

impl Default for BasisChoice {
    /// Returns free-surface modes without residual vectors.
    fn default() -> Self {
        Self::Free(FreeSurface::default())
    }
}

impl BasisChoice {
    /// Returns the files that were read for the basis.
    pub fn sources(&self) -> Vec<&SourceFile> {
        match self {
            Self::Imported(shapes) => shapes.source().into_iter().collect(),
            Self::Solved(modes) => vec![&modes.source],
            _ => self.residual_vectors().iter().filter_map(Loads::source).collect(),
        }
    }

    /// Returns the chosen basis.
    pub fn basis(&self) -> &dyn Basis {
        match self {
            Self::Free(free) => free,
            Self::Imported(shapes) => shapes,
            Self::Solved(modes) => modes,
            Self::CraigBampton(fixed) => fixed,
            Self::CraigChang(free) => free,
        }
    }

    /// Returns this basis with residual vectors for the forces that a motion leaves unbalanced at the nodes
    /// (N x m); `None` for a basis without residual vectors.
    pub fn with_motion(&self, loads: &Mat<f64>) -> Option<Self> {
        let mut choice = self.clone();
        let residual_vectors = match &mut choice {
            Self::Free(FreeSurface { residual_vectors })
            | Self::CraigChang(CraigChang { residual_vectors }) => residual_vectors,
            Self::Imported(_) | Self::Solved(_) | Self::CraigBampton(_) => return None,
        };
        if loads.ncols() > 0 {
            residual_vectors.push(Loads::Motion(loads.clone()));
        }
        Some(choice)
    }

    /// Returns the eigen-solver that found the modes, if it was not this program.
    pub fn engine(&self) -> Option<&str> {
        match self {
            Self::Solved(modes) => Some(&modes.engine),
            _ => None,
        }
    }

    /// Returns the loads requested by the user whose responses are added to the modes.
    pub fn residual_vectors(&self) -> &[Loads] {
        match self {
            Self::Free(FreeSurface { residual_vectors })
            | Self::CraigChang(CraigChang { residual_vectors }) => residual_vectors,
            Self::Imported(_) | Self::Solved(_) | Self::CraigBampton(_) => &[],
        }
    }
}
