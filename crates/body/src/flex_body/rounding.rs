//! Rounding of a body to 32-bit floats, as a file holds it.

use super::{Certificate, FlexBody, Modes, Storage};
use faer::Mat;
use flexbody_base::error::Result;

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
