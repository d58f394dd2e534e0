//! How fast the modes move that count in a motion.

use super::{Scene, Trace};
use flexbody_body::flex_body::FlexBody;

/// Distances of places that differ by more than this are not of one stretch: the places stand at a break.
const UNEVEN: f64 = 8.0;

/// The largest circular frequency of the modes that count in the motion, whose root of the elastic energy is
/// not below this `part` of the tolerances; those of a body that is carried are not above those of the free
/// body. A mode that follows slow forces has no motion of its own, however high it is: what counts is the
/// amplitude q'' / omega^2 that its acceleration has at its own frequency.
pub fn liveliest_rate(body: &FlexBody, scene: &Scene, motion: &Trace, part: f64) -> f64 {
    let rates: Vec<f64> = body.modes().eigenvalue.iter().map(|lambda| lambda.sqrt()).collect();
    let roots = rates.iter().zip(&motion.extremes.amplitudes).map(|(rate, amplitude)| rate * amplitude.abs());
    let tolerance = &scene.requirements.tolerance.errors;
    let least = part * tolerance.stress.min(tolerance.deflection) * roots.fold(0.0, f64::max);
    let own = accelerations(motion, rates.len());
    let counts = |j: &usize| own[*j] > 0.0 && own[*j] / rates[*j] >= least;
    (0..rates.len()).rev().find(counts).map_or(0.0, |last| rates[last])
}

/// The largest |q''| of every mode, by differences between places that are about as far from each other.
fn accelerations(motion: &Trace, modes: usize) -> Vec<f64> {
    let mut largest = vec![0.0f64; modes];
    for (times, q) in motion.time.windows(3).zip(motion.q.windows(3)) {
        let (before, after) = (times[1] - times[0], times[2] - times[1]);
        if !(before > 0.0 && after > 0.0 && before < UNEVEN * after && after < UNEVEN * before) {
            continue;
        }
        for (j, largest) in largest.iter_mut().enumerate() {
            let slopes = [(q[1][j] - q[0][j]) / before, (q[2][j] - q[1][j]) / after];
            *largest = largest.max(2.0 * (slopes[1] - slopes[0]).abs() / (before + after));
        }
    }
    largest
}
