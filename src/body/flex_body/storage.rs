//! How precisely a body keeps its large arrays.

use super::{Certificate, FlexBody, Modes};
use crate::base::error::Result;
use crate::body::invariants::IdentityCheck;
use faer::Mat;

/// Precision of the shapes and of the inertia of the modes, in memory and in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Storage {
    /// 64-bit floats.
    #[default]
    F64,
    /// Rounded to 32-bit floats.
    F32,
}

impl Storage {
    /// Every choice, in the order of the documentation.
    pub const ALL: [Storage; 2] = [Self::F64, Self::F32];

    /// Name in files, reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::F64 => "f64",
            Self::F32 => "f32",
        }
    }

    /// What rounding of the arrays may add to sums of entries that are relative to their Cauchy-Schwarz bounds; zero for 64-bit floats,
    /// whose rounding every limit knows.
    pub fn rounding(self) -> f64 {
        match self {
            Self::F64 => 0.0,
            Self::F32 => 8.0 * f64::from(f32::EPSILON),
        }
    }

    /// How many roundings of 64-bit floats one of these is.
    pub fn roundings(self) -> f64 {
        match self {
            Self::F64 => 1.0,
            Self::F32 => f64::from(f32::EPSILON) / f64::EPSILON,
        }
    }
}

impl FlexBody {
    /// The body that a file of 32-bit floats holds: shapes, rotations, internal rows, Ibar, S, W0 and W3 rounded to the nearest, the lumped
    /// comparators too. C1, K_ff, eigenvalues and everything rigid stay. The bounds of accuracy `certified`, which are about what was rounded,
    /// are left out.
    ///
    /// # Errors
    /// [`BodySchema`](crate::base::diagnostic::Code::BodySchema) when a number is too large for a 32-bit float.
    pub fn rounded_to_f32(&self) -> Result<Self> {
        let mut parts = self.parts().clone();
        parts.storage = Storage::F32;
        parts.modes = rounded_modes(parts.modes);
        parts.invariants = parts.invariants.rounded(nearest_f32);
        for lumped in &mut parts.lumped {
            lumped.invariants = lumped.invariants.rounded(nearest_f32);
        }
        parts.certificate = without_guarantee(parts.certificate);
        Self::new(parts)
    }
}

/// The nearest 32-bit float.
fn nearest_f32(value: f64) -> f64 {
    #[allow(clippy::cast_possible_truncation)] // what it is for
    let rounded = value as f32;
    f64::from(rounded)
}

fn round_matrix(a: &mut Mat<f64>) {
    *a = Mat::from_fn(a.nrows(), a.ncols(), |i, j| nearest_f32(a[(i, j)]));
}

fn rounded_modes(mut modes: Modes) -> Modes {
    round_matrix(&mut modes.shape);
    modes.rotation.iter_mut().for_each(round_matrix);
    modes.internal.iter_mut().for_each(|internal| round_matrix(&mut internal.shape));
    modes
}

fn without_guarantee(certificate: Certificate) -> Certificate {
    Certificate { guarantee: None, ..certificate }
}

/// Limits of identities of a body whose arrays are rounded, which adds `rounding` to what rounding of 64-bit floats leaves.
pub(super) fn relaxed(mut checks: Vec<IdentityCheck>, rounding: f64) -> Vec<IdentityCheck> {
    // What has no tolerance, as being finite, does not get any.
    for check in checks.iter_mut().filter(|check| check.limit > 0.0) {
        check.limit += rounding;
        check.passed = check.value <= check.limit;
    }
    checks
}
