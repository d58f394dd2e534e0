//! Files of elements of a model, and elasticities as users state them.

use flexbody_elements::Elasticity;
use nalgebra::Matrix6;
use std::path::PathBuf;

/// File of elements of which K is assembled: a deck with its materials, or a mesh with a stated elasticity.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementSource {
    /// Deck or mesh.
    pub path: PathBuf,
    /// Element set of a deck, or node set whose elements are meant; `None` for all solid elements.
    pub set: Option<String>,
    /// Type of the elements; `None` for the types of a deck, and `SOLID` for other meshes.
    pub kind: Option<String>,
    /// Elasticity of the elements, along the axes of the model; `None` for the materials of a deck.
    pub elasticity: Option<Elasticity>,
}

/// Number of constants of an anisotropic material.
pub(super) const ANISOTROPIC_CONSTANTS: usize = 21;

/// Rows and columns, in the order xx yy zz xy yz xz, of the components 11 22 33 12 13 23 of a deck.
const FROM_DECK: [usize; 6] = [0, 1, 2, 3, 5, 4];

/// Returns the elasticity by its 21 constants in the order of Abaqus and CalculiX: D1111, D1122, D2222, D1133, D2233,
/// D3333, D1112, D2212, D3312, D1212, D1113, D2213, D3313, D1213, D1313, D1123, D2223, D3323, D1223, D1323, D2323.
/// Returns `None` unless it is positive definite.
pub(super) fn anisotropic(constants: &[f64]) -> Option<Elasticity> {
    let mut matrix = Matrix6::zeros();
    let mut rest = constants.iter();
    // The upper triangle, column by column.
    for (column, &j) in FROM_DECK.iter().enumerate() {
        for &i in &FROM_DECK[..=column] {
            matrix[(i, j)] = *rest.next()?;
            matrix[(j, i)] = matrix[(i, j)];
        }
    }
    Elasticity::definite(matrix)
}

/// Returns true if a material has the same elasticity along all axes, to rounding.
pub(super) fn is_isotropic(elasticity: &Elasticity) -> bool {
    let mean = |entries: [(usize, usize); 3]| entries.iter().map(|at| elasticity.0[*at]).sum::<f64>() / 3.0;
    let (lambda, mu) = (mean([(0, 1), (1, 2), (0, 2)]), mean([(3, 3), (4, 4), (5, 5)]));
    (elasticity.0 - Elasticity::of_lame(lambda, mu).0).amax() <= 1e-14 * elasticity.0.amax()
}
