//! How what a body lacks answers to the forces that its motion leaves unbalanced: with inertia of its own.

use super::compressed::principal;
use crate::body::invariants::symmetric_part;
use crate::numerics::linalg::{combine, gram, symmetric_eigen};
use faer::{Mat, MatRef};

/// Part of the trace of E'K E below which a direction is rounding.
const ROUNDING: f64 = 1e-12;

/// The amplitudes z(t) of the static responses E (N x k) in the motion that they make under the forces whose
/// static amplitudes are c(t):
///
/// E'M E z'' + E'K E z = E'K E c(t),
///
/// with c(t) along straight lines between the instants, without damping, and solved exactly: in its own
/// modes, of frequency w, each amplitude is s(t) plus an oscillation, which every kink of s adds to. Where c
/// changes slowly beside w that is s itself; where it changes as fast, or begins with a shock, the static
/// response would be too small.
///
/// * `stiffness`, `mass`: E'K E and E'M E (k x k); `amplitudes`: c (k x m), at `times`.
/// * `settled`: whether it starts in equilibrium, z = c and z' = 0; else at z = z' = 0.
pub(super) fn answered(
    stiffness: &Mat<f64>,
    mass: &Mat<f64>,
    amplitudes: &Mat<f64>,
    times: &[f64],
    settled: bool,
) -> Option<Mat<f64>> {
    let (turned, roots) = principal(stiffness.clone(), ROUNDING, usize::MAX)?;
    // Coordinates w = D^-1 z with D'(E'K E) D = 1.
    let directions = Mat::from_fn(turned.nrows(), roots.len(), |i, j| turned[(i, j)] / roots[j]);
    let inverse = Mat::from_fn(turned.nrows(), roots.len(), |i, j| turned[(i, j)] * roots[j]);
    let seen = gram(directions.as_ref(), combine(mass.as_ref(), directions.as_ref()).as_ref());
    let own = symmetric_eigen(symmetric_part(&seen).as_ref())?;
    let to_own = combine(inverse.as_ref(), own.vectors.as_ref());
    let static_part = gram(to_own.as_ref(), amplitudes.as_ref());
    let mut motion = static_part.clone();
    for (j, square) in own.values.iter().enumerate() {
        // The eigenvalue is one over the square of the circular frequency.
        if *square > 0.0 {
            oscillate(square.sqrt().recip(), static_part.as_ref(), j, times, settled, &mut motion);
        }
    }
    Some(combine(combine(directions.as_ref(), own.vectors.as_ref()).as_ref(), motion.as_ref()))
}

/// Writes into row `j` of `motion` what an oscillator of circular frequency `rate` makes of the static
/// amplitudes in row `j` of `s`.
fn oscillate(rate: f64, s: MatRef<'_, f64>, j: usize, times: &[f64], settled: bool, motion: &mut Mat<f64>) {
    let slope = |i: usize| (s[(j, i + 1)] - s[(j, i)]) / (times[i + 1] - times[i]);
    // Distance from the static amplitude, and its rate.
    let mut away = if settled { 0.0 } else { -s[(j, 0)] };
    let mut speed = 0.0;
    motion[(j, 0)] = s[(j, 0)] + away;
    for i in 0..times.len() - 1 {
        let relative = speed - slope(i);
        let (sin, cos) = (rate * (times[i + 1] - times[i])).sin_cos();
        let before = away;
        away = before * cos + relative / rate * sin;
        speed = relative * cos - before * rate * sin + slope(i);
        motion[(j, i + 1)] = s[(j, i + 1)] + away;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two oscillators that share no coordinate, of circular frequencies 2 and 50, pushed along a ramp and by
    /// a step.
    #[test]
    fn oscillators_follow_ramps_and_steps() {
        let (stiffness, mass) =
            (Mat::from_fn(2, 2, |i, j| if i == j { [4.0, 2500.0][i] } else { 0.0 }), Mat::identity(2, 2));
        let times: Vec<f64> = (0..=60).map(|i| 0.05 * f64::from(i)).collect();
        let c = Mat::from_fn(2, times.len(), |j, i| if j == 0 { times[i] } else { 1.0 });
        let z = answered(&stiffness, &mass, &c, &times, false).expect("a motion");
        for (i, t) in times.iter().enumerate() {
            assert!((z[(0, i)] - (t - (2.0 * t).sin() / 2.0)).abs() < 1e-12, "{t}");
            assert!((z[(1, i)] - (1.0 - (50.0 * t).cos())).abs() < 1e-10, "{t}");
        }
        let z = answered(&stiffness, &mass, &c, &times, true).expect("a motion");
        assert!(
            (0..times.len()).all(|i| (z[(1, i)] - 1.0).abs() < 1e-12),
            "a constant force on what is settled"
        );
    }
}
