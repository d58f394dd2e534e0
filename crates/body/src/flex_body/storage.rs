//! Storage precision of the large arrays of a body, and the rounding of a body to 32-bit floats, as a file holds it.

use super::{Certificate, FlexBody, Modes};
use faer::Mat;
use flexbody_base::error::Result;

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
    /// All choices, in the order of the documentation.
    pub const ALL: [Storage; 2] = [Self::F64, Self::F32];

    /// Returns the name in files, reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::F64 => "f64",
            Self::F32 => "f32",
        }
    }

    /// Returns the storage with the given name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|known| known.name() == name)
    }

    /// Returns the additional rounding error of sums of array entries relative to their Cauchy-Schwarz
    /// bounds; zero for 64-bit floats, whose rounding all limits include.
    pub fn rounding(self) -> f64 {
        match self {
            Self::F64 => 0.0,
            Self::F32 => 8.0 * f64::from(f32::EPSILON),
        }
    }

    /// Returns the rounding unit of this storage in units of the rounding unit of 64-bit floats.
    pub fn roundings(self) -> f64 {
        match self {
            Self::F64 => 1.0,
            Self::F32 => f64::from(f32::EPSILON) / f64::EPSILON,
        }
    }
}

impl FlexBody {
    /// Returns the body as a file of 32-bit floats holds it: shapes, rotations, internal rows, Ibar, S, W0
    /// and W3 are rounded to the nearest value, also in the lumped comparators. C1, K_ff, eigenvalues and
    /// all rigid-body data do not change. The bounds of accuracy `certified`, which hold for the unrounded
    /// data, are dropped.
    ///
    /// # Errors
    /// [`BodySchema`](flexbody_base::diagnostic::Code::BodySchema) if a number is too large for a 32-bit
    /// float.
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

/// Returns the nearest 32-bit float.
fn nearest_f32(value: f64) -> f64 {
    #[allow(clippy::cast_possible_truncation)] // rounding is the purpose
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
