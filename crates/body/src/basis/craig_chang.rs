//! Craig-Chang basis: free modes with the attachment modes of the interfaces (Craig and Chang, NASA CR-2781,
//! 1977; theory section 5).

use super::free_surface::free_modes_with;
use super::modal_basis::{Basis, ModalBasis, Task};
use super::{BasisKind, Loads};
use flexbody_base::error::Result;

/// Free-surface modes and inertia-relief attachment modes: the part outside the modes of the static
/// responses of the free body to unit loads at its interfaces.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CraigChang {
    /// Further loads whose static responses are added to the modes.
    pub residual_vectors: Vec<Loads>,
}

impl CraigChang {
    /// Returns all loads.
    fn loads(&self) -> Vec<Loads> {
        let others = self.residual_vectors.iter().filter(|loads| **loads != Loads::Interfaces);
        std::iter::once(Loads::Interfaces).chain(others.cloned()).collect()
    }
}

impl Basis for CraigChang {
    fn kind(&self) -> BasisKind {
        BasisKind::CraigChang
    }

    fn modes(&self, task: &Task<'_>) -> Result<ModalBasis> {
        free_modes_with(&self.loads(), "attachment mode", task)
    }
}
