//! Lumped comparators: invariants from nodal masses, as multibody programs import them, on the modes of the
//! body.

use super::Invariants;
use super::condense::{SolidColumns, condense_with, of_rigid_products};
use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::numbers::significant;
use flexbody_linalg::{SymmetricMatrix, gram};
use strum::{EnumString, IntoStaticStr, VariantArray};

/// Masses below this part of the largest mass count as zero: cancelling row sums leave rounding of either
/// sign.
const ZERO_MASS: f64 = 1e-14;

/// Scheme that derives nodal masses from the consistent mass matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, EnumString, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum LumpedScheme {
    /// Row sums of Ms: preserve mass and centre of mass; negative at the corners of quadratic elements.
    RowSum,
    /// Diagonal of Ms scaled to the total mass: HRZ lumping as far as the assembled matrix allows.
    DiagonalScaling,
    /// Nodal masses given by the user.
    User,
}

impl LumpedScheme {
    /// All schemes, in the order of the documentation.
    pub const ALL: &'static [Self] = Self::VARIANTS;

    /// Returns the name in files, reports and on the command line.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Returns the scheme with the given name.
    pub fn from_name(name: &str) -> Option<Self> {
        name.parse().ok()
    }
}

/// Nodal masses of one lumping scheme, in node order.
#[derive(Debug, Clone, PartialEq)]
pub struct LumpedMasses {
    scheme: LumpedScheme,
    masses: Vec<f64>,
}

impl LumpedMasses {
    /// Computes the row sums m_i = sum_j Ms_ij.
    pub fn row_sum(mass: &SymmetricMatrix) -> Self {
        let masses = (0..mass.n()).map(|i| mass.row(i).1.iter().sum()).collect();
        Self { scheme: LumpedScheme::RowSum, masses }
    }

    /// Scales the diagonal: m_i = Ms_ii m / sum_j Ms_jj, with m the sum of all entries.
    ///
    /// # Errors
    /// `MassNotPositive` if the diagonal has no positive finite sum.
    pub fn diagonal_scaling(mass: &SymmetricMatrix) -> Result<Self> {
        let diagonal = mass.diagonal();
        let total: f64 = Self::row_sum(mass).masses.iter().sum();
        let sum: f64 = diagonal.iter().sum();
        if !(sum > 0.0 && sum.is_finite()) {
            let message = format!(
                "the diagonal of the mass matrix sums to {}: it cannot be scaled to the mass",
                significant(sum, 6)
            );
            return Err(Diagnostic::new(Code::MassNotPositive, message).into());
        }
        let masses = diagonal.iter().map(|d| d * (total / sum)).collect();
        Ok(Self { scheme: LumpedScheme::DiagonalScaling, masses })
    }

    /// Takes masses given by the user, one per node in node order. Unit: mass.
    ///
    /// # Errors
    /// `LumpedMassTable` if their number is not `n_nodes`, one is not finite, or their sum is not positive.
    pub fn user(masses: Vec<f64>, n_nodes: usize) -> Result<Self> {
        let refuse = |message: String| Err(Diagnostic::new(Code::LumpedMassTable, message).into());
        if masses.len() != n_nodes {
            return refuse(format!("{} nodal masses for {n_nodes} nodes", masses.len()));
        }
        if let Some(i) = masses.iter().position(|m| !m.is_finite()) {
            return refuse(format!("nodal mass {} (from 1) is {}", i + 1, masses[i]));
        }
        let total: f64 = masses.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return refuse(format!("nodal masses sum to {}", significant(total, 6)));
        }
        Ok(Self { scheme: LumpedScheme::User, masses })
    }

    /// Returns the lumping scheme.
    pub fn scheme(&self) -> LumpedScheme {
        self.scheme
    }

    /// Returns the masses by node. Unit: mass.
    pub fn masses(&self) -> &[f64] {
        &self.masses
    }

    /// Returns the number of nodes with a negative mass.
    pub fn negative(&self) -> usize {
        let zero = self.zero_bound();
        self.masses.iter().filter(|&&m| m < -zero).count()
    }

    /// Returns the number of nodes without mass: magnitude below 1e-14 of the largest mass, the rounding of
    /// cancelling sums.
    pub fn zero(&self) -> usize {
        let zero = self.zero_bound();
        self.masses.iter().filter(|m| m.abs() <= zero).count()
    }

    fn zero_bound(&self) -> f64 {
        ZERO_MASS * self.masses.iter().fold(0.0, |largest: f64, m| largest.max(m.abs()))
    }
}

/// Condenses lumped masses with the given modes in the given frame: [`super::condense`] with Ms =
/// diag(masses). A shifted centre of mass appears as first moment.
///
/// # Panics
/// When the sizes disagree.
pub fn condense_lumped(
    masses: &LumpedMasses,
    positions: &[[f64; 3]],
    shapes: MatRef<'_, f64>,
    modal_stiffness: Mat<f64>,
) -> Invariants {
    assert_eq!(masses.masses.len(), positions.len(), "nodal masses and positions");
    condense_with(masses.masses.as_slice(), positions, shapes, modal_stiffness)
}

/// Condenses lumped masses without W2 and W3 (see [`condense_lumped`]). m_ff, which is no identity for lumped
/// masses, is computed.
///
/// # Panics
/// When the sizes disagree.
pub fn condense_lumped_linear(
    masses: &LumpedMasses,
    positions: &[[f64; 3]],
    shapes: MatRef<'_, f64>,
    modal_stiffness: Mat<f64>,
) -> Invariants {
    let m = masses.masses();
    assert_eq!(m.len(), positions.len(), "nodal masses and positions");
    let weighted = Mat::from_fn(shapes.nrows(), shapes.ncols(), |row, p| m[row / 3] * shapes[(row, p)]);
    let product = gram(shapes, weighted.as_ref());
    let modal_mass =
        Mat::from_fn(shapes.ncols(), shapes.ncols(), |p, q| 0.5 * (product[(p, q)] + product[(q, p)]));
    of_rigid_products(m, SolidColumns { positions, shapes }, modal_stiffness, &modal_mass)
}
