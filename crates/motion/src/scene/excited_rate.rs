//! Frequency of the modes that contribute to a motion.

use super::{Scene, Trace};
use flexbody_body::flex_body::FlexBody;

/// Ratio of neighbouring intervals above which differences are not taken: the samples are at a break.
const MAX_INTERVAL_RATIO: f64 = 8.0;

/// Returns the largest circular frequency of the modes that contribute to the motion: modes whose root of
/// the elastic energy is at least this `part` of the tolerances. For a carried body the frequencies are not
/// above those of the free body. A mode that merely follows slow forces does not oscillate at its natural frequency
/// omega; the criterion is therefore the amplitude q'' / omega^2 that its acceleration q'' would have there.
pub fn highest_excited_rate(body: &FlexBody, scene: &Scene, motion: &Trace, part: f64) -> f64 {
    let rates: Vec<f64> = body.modes().eigenvalue.iter().map(|lambda| lambda.sqrt()).collect();
    let roots = rates.iter().zip(&motion.extremes.amplitudes).map(|(rate, amplitude)| rate * amplitude.abs());
    let tolerance = &scene.requirements.tolerance.errors;
    let least = part * tolerance.stress.min(tolerance.deflection) * roots.fold(0.0, f64::max);
    let largest_accelerations = accelerations(motion, rates.len());
    let counts =
        |j: &usize| largest_accelerations[*j] > 0.0 && largest_accelerations[*j] / rates[*j] >= least;
    (0..rates.len()).rev().find(counts).map_or(0.0, |last| rates[last])
}

/// Returns the largest |q''| of every mode, by differences between samples with similar spacing.
fn accelerations(motion: &Trace, modes: usize) -> Vec<f64> {
    let mut largest = vec![0.0f64; modes];
    for (times, q) in motion.time.windows(3).zip(motion.q.windows(3)) {
        let (before, after) = (times[1] - times[0], times[2] - times[1]);
        if !(before > 0.0
            && after > 0.0
            && before < MAX_INTERVAL_RATIO * after
            && after < MAX_INTERVAL_RATIO * before)
        {
            continue;
        }
        for (j, largest) in largest.iter_mut().enumerate() {
            let slopes = [(q[1][j] - q[0][j]) / before, (q[2][j] - q[1][j]) / after];
            *largest = largest.max(2.0 * (slopes[1] - slopes[0]).abs() / (before + after));
        }
    }
    largest
}
