//! Ranking of modes by their contribution to a motion.

use super::trial::ModeShare;
use flexbody_base::error::Result;
use flexbody_linalg::ties::descending;
use flexbody_motion::scene::Tolerance;

/// Returns the contribution of each mode relative to the tolerances: the largest of deflection, stress and recoveries.
pub(super) fn weights(shares: &[ModeShare], tolerance: &Tolerance) -> Vec<f64> {
    let weight = |share: &ModeShare| {
        let plain =
            (share.deflection / tolerance.errors.deflection).max(share.stress / tolerance.errors.stress);
        share.recovery.map_or(plain, |recovery| plain.max(recovery))
    };
    shares.iter().map(weight).collect()
}

/// Contribution of a mode relative to the tolerances up to which it counts as zero: the error of the integration, not
/// the motion, ranks such modes. A larger value ranks small contributions by frequency.
const NEGLIGIBLE_WEIGHT: f64 = 1e-4;

/// Returns the modes by descending weight, modes of equal or negligible weight by frequency.
pub(super) fn by_weight(weights: &[f64]) -> Vec<usize> {
    let counted: Vec<f64> =
        weights.iter().map(|&weight| if weight < NEGLIGIBLE_WEIGHT { 0.0 } else { weight }).collect();
    descending(&counted)
}

/// Returns the first `count` modes of an order, ascending.
pub(crate) fn first_of(order: &[usize], count: usize) -> Vec<usize> {
    let mut modes = order[..count].to_vec();
    modes.sort_unstable();
    modes
}

/// Returns the smallest number above `too_few`, up to `enough`, that passes: by bisection, since errors nearly always decrease
/// with more modes. `enough` itself is not tried.
///
/// # Errors
/// The errors of `passes`.
pub(crate) fn fewest(
    mut too_few: usize,
    mut enough: usize,
    mut passes: impl FnMut(usize) -> Result<bool>,
) -> Result<usize> {
    while too_few + 1 < enough {
        let count = too_few.midpoint(enough);
        if passes(count)? { enough = count } else { too_few = count }
    }
    Ok(enough)
}
