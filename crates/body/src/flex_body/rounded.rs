//! The body that a file of 32-bit floats holds.

use super::{Certificate, FlexBody, Modes, Storage};
use faer::Mat;
use flexbody_base::error::Result;

impl FlexBody {
    /// The body that a file of 32-bit floats holds: shapes, rotations, internal rows, Ibar, S, W0 and W3
    /// rounded to the nearest, the lumped comparators too. C1, K_ff, eigenvalues and everything rigid stay.
    /// The bounds of accuracy `certified`, which are about what was rounded, are left out.
    ///
    /// # Errors
    /// [`BodySchema`](flexbody_base::diagnostic::Code::BodySchema) when a number is too large for a 32-bit
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
