//! Modal damping by ratios, and damping that the settings of a conversion state as a law, which holds in every frame of
//! an analysis.
//!
//! Ratios are those of the modes of the body as an analysis holds it: free in mean axes, or at rest at its carrier.
//! Damping in proportion to mass and stiffness is alpha m_ff + beta K_ff, with the mass of the modes relative to the same
//! frame: alpha damps the motion relative to mean axes, or to the carrier, and not that of the whole body. A matrix that
//! the user gave, and ratios of other sources, stay the matrix that they are in the modes of the file.

use super::{FlexBody, MotionColumns, MotionLoad, Recovery};
use crate::invariants::Invariants;
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_model::{DampingBand, DampingRatios};
use serde_json::Value;

/// Deviation of the damping of the modes from a stated law, relative to its largest entry, that counts as rounding.
const MAX_DEVIATION: f64 = 1e-9;

/// Damping stated by the settings of a conversion.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum StatedDamping {
    /// Ratios of modes by their frequencies.
    Ratios(DampingRatios),
    /// D = alpha M + beta K. Units: 1/time and time.
    Rayleigh { alpha: f64, beta: f64 },
}

impl StatedDamping {
    /// Returns the law in the settings of a conversion; `None` for other damping and for none.
    fn of(settings: &Value) -> Option<Self> {
        let stated = &settings["damping"];
        let of_band = |band: &Value| {
            let to_hz = if band["to_hz"].is_null() { f64::INFINITY } else { band["to_hz"].as_f64()? };
            Some(DampingBand { to_hz, ratio: band["ratio"].as_f64()? })
        };
        if let Some(ratio) = stated["ratio"].as_f64() {
            return Some(Self::Ratios(ratio.into()));
        }
        if let Some(bands) = stated["bands"].as_array() {
            let bands = bands.iter().map(of_band).collect::<Option<_>>()?;
            return DampingRatios::new(bands).ok().map(Self::Ratios);
        }
        let rayleigh = &stated["rayleigh"];
        Some(Self::Rayleigh { alpha: rayleigh["alpha"].as_f64()?, beta: rayleigh["beta"].as_f64()? })
    }

    /// Returns D (nf x nf) and the ratios of its diagonal for modes with unit modal mass and these eigenvalues.
    ///
    /// * `hertz`: returns the frequency of an eigenvalue.
    pub(super) fn of_modes(&self, eigenvalues: &[f64], hertz: impl Fn(f64) -> f64) -> (Mat<f64>, Vec<f64>) {
        let ratio = |&lambda: &f64| match self {
            Self::Ratios(ratios) => ratios.at(hertz(lambda)),
            Self::Rayleigh { alpha, beta } => (0.5 * (alpha + beta * lambda) / lambda.sqrt()).max(0.0),
        };
        let ratios: Vec<f64> = eigenvalues.iter().map(ratio).collect();
        let n = eigenvalues.len();
        let entry = |i: usize, j: usize| if i == j { 2.0 * ratios[j] * eigenvalues[j].sqrt() } else { 0.0 };
        (Mat::from_fn(n, n, entry), ratios)
    }
}

/// Returns the damping ratios of the diagonal of D, D_jj / (2 sqrt(lambda_j)); negative entries are rounding.
pub fn diagonal_ratios(damping: &Mat<f64>, eigenvalues: &[f64]) -> Vec<f64> {
    let ratio = |(j, lambda): (usize, &f64)| (0.5 * damping[(j, j)] / lambda.sqrt()).max(0.0);
    eigenvalues.iter().enumerate().map(ratio).collect()
}

/// Returns alpha m_ff + beta K_ff.
pub(crate) fn proportional_damping(invariants: &Invariants, alpha: f64, beta: f64) -> Mat<f64> {
    let (mass, stiffness) = (invariants.modal_mass(), invariants.modal_stiffness());
    Mat::from_fn(mass.nrows(), mass.ncols(), |i, j| alpha * mass[(i, j)] + beta * stiffness[(i, j)])
}

impl FlexBody {
    /// Returns the law that the settings of the conversion state, if the modes of this body have its damping; `None` for
    /// other damping, such as a matrix or the ratios of a scene.
    pub(super) fn stated_damping(&self) -> Option<StatedDamping> {
        let law = StatedDamping::of(&self.source().settings)?;
        let modes = self.modes();
        let has = match &law {
            StatedDamping::Ratios(ratios) => {
                let at = |lambda: f64| ratios.at(self.units().frequency_of(lambda));
                modes.eigenvalue.iter().zip(&modes.damping_ratio).all(|(&lambda, &own)| at(lambda) == own)
            }
            StatedDamping::Rayleigh { alpha, beta } => {
                let (own, stated) = (self.damping(), proportional_damping(self.invariants(), *alpha, *beta));
                (&own - &stated).norm_max() <= MAX_DEVIATION * stated.norm_max()
            }
        };
        has.then_some(law)
    }

    /// Returns beta of the damping alpha M + beta K that the settings of the conversion state and the modes of this body
    /// have; 0 for other damping. What the modes leave out has the part beta K as well. Unit: time.
    pub fn stiffness_damping(&self) -> f64 {
        match self.stated_damping() {
            Some(StatedDamping::Rayleigh { beta, .. }) => beta,
            _ => 0.0,
        }
    }

    /// Sets modal damping: each eigenpair in the frame of the body gets the ratio of `ratios` at its
    /// frequency, D = m_ff X diag(2 ratio omega) X' m_ff. For a body of free modes the eigenpairs are the
    /// modes. Static columns of other damping forces are left out of recoveries.
    ///
    /// # Errors
    /// The errors of [`FlexBody::new`].
    pub fn with_damping_ratios(&self, ratios: &DampingRatios) -> Result<Self> {
        let mut parts = self.clone().into_parts();
        let ratio = |eigenvalue: f64| ratios.at(self.units().frequency_of(eigenvalue.max(0.0)));
        parts.modes.damping_ratio = self.modes().eigenvalue.iter().map(|&lambda| ratio(lambda)).collect();
        parts.modes.modal_damping = None;
        parts.recoveries.iter_mut().for_each(Recovery::remove_damping);
        let mass = self.invariants().modal_mass();
        let apart = |i: usize, j: usize| (mass[(i, j)] - f64::from(i == j)).abs();
        let nf = self.n_modes();
        let normalised = (0..nf).all(|i| (0..nf).all(|j| apart(i, j) < 1e-6));
        if let Some((values, vectors)) = (!normalised).then(|| self.eigenpairs_in_frame()).flatten() {
            let moved = &mass * &vectors;
            let rate = |p: usize| 2.0 * ratio(values[p]) * values[p].max(0.0).sqrt();
            let entry = |i: usize, j: usize| (0..nf).map(|p| moved[(i, p)] * rate(p) * moved[(j, p)]).sum();
            parts.modes.modal_damping = Some(Mat::from_fn(nf, nf, entry));
        }
        Self::new(parts)
    }

    /// Returns this body with the damping of a law in its own frame; itself without a law.
    pub(super) fn with_stated_damping(self, law: Option<StatedDamping>) -> Result<Self> {
        match law {
            None => Ok(self),
            Some(StatedDamping::Ratios(ratios)) => self.with_damping_ratios(&ratios),
            Some(StatedDamping::Rayleigh { alpha, beta }) => {
                let damping = proportional_damping(self.invariants(), alpha, beta);
                let mut parts = self.into_parts();
                let modes = &mut parts.modes;
                modes.damping_ratio = diagonal_ratios(&damping, &modes.eigenvalue);
                modes.modal_damping = Some(damping);
                Self::new(parts)
            }
        }
    }

    /// Returns this body with the damping of `held`, the same body in the frame of a carrier: the modal coordinates are
    /// those of both, and so are the forces of D on them.
    ///
    /// # Errors
    /// The errors of [`FlexBody::new`].
    pub fn with_damping_of(&self, held: &Self) -> Result<Self> {
        let mut parts = self.clone().into_parts();
        parts.modes.damping_ratio.clone_from(&held.modes().damping_ratio);
        parts.modes.modal_damping.clone_from(&held.modes().modal_damping);
        // A body with ratios has no static columns of damping forces.
        let is_of_damping = |columns: &MotionColumns| columns.load == MotionLoad::Damping;
        if !held.recoveries().iter().flat_map(|recovery| &recovery.motion).any(is_of_damping) {
            parts.recoveries.iter_mut().for_each(Recovery::remove_damping);
        }
        Self::new(parts)
    }
}
