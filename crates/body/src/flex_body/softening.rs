//! Loss of stiffness by centrifugal terms that geometric stiffness does not compensate (theory section 7).

use super::FlexBody;
use faer::{Mat, Scale};
use flexbody_model::LoadKind;
use nalgebra::{Matrix3, Vector3};

/// Part of the stiffness of a motion above which the centrifugal term is significant.
pub const SOFTENING: f64 = 0.01;

/// Limit of the steps of the search for the worst axis.
const MAX_AXIS_STEPS: usize = 40;
/// Relative growth of the softened part below which the search ends.
const MIN_GROWTH: f64 = 1e-9;

impl FlexBody {
    /// Returns the largest part of the stiffness that any motion loses by the centrifugal terms at the
    /// angular velocity `omega` (body axes), including the stiffness of inertia. Returns `None` if K_ff is
    /// not positive definite, or if the body does not hold W2.
    pub fn softening(&self, omega: &Vector3<f64>) -> Option<f64> {
        Some(self.softest_motion(omega)?.0)
    }

    /// Returns the spin rate about axis `axis` of the model at which the centrifugal terms take 1 % of the
    /// stiffness of the most softened motion: the root of 0.01 over the [part](FlexBody::softening) at unit
    /// spin. Returns `None` if nothing moves across the axis. Unit: 1/time.
    ///
    /// # Panics
    /// When `axis` is not below 3.
    pub fn softening_rate(&self, axis: usize) -> Option<f64> {
        let omega_body = self.frame().axes.transpose() * Vector3::ith(axis, 1.0);
        let part = self.softening(&omega_body)?;
        (part > 0.0).then(|| (SOFTENING / part).sqrt())
    }

    /// Returns the spin axis with the largest softening (axes of the model, unit length, largest component
    /// positive) and the part of the stiffness lost at unit spin. The search alternates: the motion most
    /// softened by a spin gives the axis that softens this motion most. It starts from each of the three
    /// axes. For a plane body the axis is the normal.
    pub fn worst_spin(&self) -> Option<(Vector3<f64>, f64)> {
        if self.dimension() == 2 {
            return Some((Vector3::z(), self.softening(&Vector3::z())?));
        }
        let from_axis = |axis: usize| -> Option<(Vector3<f64>, f64)> {
            let mut omega = Vector3::ith(axis, 1.0);
            let (mut part, mut motion) = self.softest_motion(&omega)?;
            for _ in 0..MAX_AXIS_STEPS {
                // Spin axis that softens the present motion most, then the motion that it softens most.
                let next = largest_direction(&self.softening_of(&motion)?);
                let (greater, other) = self.softest_motion(&next)?;
                // A growth within rounding would move to another of equally soft axes.
                if greater <= part * (1.0 + MIN_GROWTH) {
                    break;
                }
                (omega, part, motion) = (next, greater, other);
            }
            Some((omega, part))
        };
        // The best of the three searches.
        let all = (0..3).map(from_axis).collect::<Option<Vec<_>>>()?;
        let (omega, part) =
            all.into_iter().reduce(|a, b| if b.1 > a.1 * (1.0 + MIN_GROWTH) { b } else { a })?;
        let omega = self.frame().axes * omega;
        Some((if omega[omega.iamax()] < 0.0 { -omega } else { omega }, part))
    }

    /// Returns the softened part at `omega`, and the most softened motion, scaled to unit stiffness.
    fn softest_motion(&self, omega: &Vector3<f64>) -> Option<(f64, Vec<f64>)> {
        // Stiffness of inertia at this spin, from its six components.
        let inertia = self.inertia_stiffness().into_iter().flat_map(|inertia| &inertia.stiffness);
        let spins = inertia.filter(|stiffness| stiffness.load.kind == LoadKind::Spin);
        let of_inertia = spins.fold(None, |sum: Option<Mat<f64>>, one| {
            let (k, l) = LoadKind::SPIN[one.load.component];
            let term = &one.matrix * Scale(omega[k] * omega[l]);
            Some(match sum {
                Some(sum) => sum + term,
                None => term,
            })
        });
        self.invariants().softening(omega, of_inertia.as_ref())
    }

    /// Returns S with w'S w the part of the stiffness of `motion` (of unit stiffness) lost at a spin w.
    fn softening_of(&self, motion: &[f64]) -> Option<Matrix3<f64>> {
        let (nf, w2) = (self.n_modes(), self.invariants().w2()?);
        let quadratic = |entry: &dyn Fn(usize, usize) -> f64| -> f64 {
            (0..nf).map(|i| motion[i] * (0..nf).map(|j| entry(i, j) * motion[j]).sum::<f64>()).sum()
        };
        // W2 contributes w_a w_b q'W2_ab q, the stiffness of inertia is subtracted.
        let mut parts = Matrix3::from_fn(|a, b| quadratic(&|i, j| w2[(a * nf + i, b * nf + j)]));
        for stiffness in self.inertia_stiffness().into_iter().flat_map(|inertia| &inertia.stiffness) {
            if stiffness.load.kind == LoadKind::Spin {
                let (k, l) = LoadKind::SPIN[stiffness.load.component];
                parts[(k, l)] -= quadratic(&|i, j| stiffness.matrix[(i, j)]);
            }
        }
        Some((parts + parts.transpose()) * 0.5)
    }
}

/// Cosine of the angle to a coordinate axis above which a direction gets the name of that axis.
const AXIS_COSINE: f64 = 1.0 - 1e-9;

/// Returns `z` for a coordinate axis, or `(0.707, 0.707, 0)` for another direction.
pub fn axis_in_words(axis: &Vector3<f64>) -> String {
    let unit = axis.normalize();
    match (0..3).find(|&k| unit[k].abs() >= AXIS_COSINE) {
        Some(k) => ["x", "y", "z"][k].to_owned(),
        None => {
            let [x, y, z] = [0, 1, 2].map(|k| format!("{:.3}", unit[k] + 0.0));
            format!("({x}, {y}, {z})")
        }
    }
}

/// Returns the eigenvector of the largest eigenvalue.
fn largest_direction(s: &Matrix3<f64>) -> Vector3<f64> {
    let eigen = s.symmetric_eigen();
    eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned()
}
