//! Free motion of an oscillator with any damping.

/// Returns \[c, s\] of the free motion of x'' + 2 d x' + w^2 x = 0 over a time h, with which
///
/// ```text
/// x(h)  = c x + s (x' + d x)
/// x'(h) = c x' - s (w^2 x + d x')
/// ```
///
/// * `square`: w^2, not negative.
/// * `decay`: d; the motion oscillates for d < w, and is overdamped beyond.
/// * `step`: h, not negative.
pub fn free_oscillation(square: f64, decay: f64, step: f64) -> [f64; 2] {
    let difference = square - decay * decay;
    let root = difference.abs().sqrt();
    if difference > 0.0 {
        let (sin, cos) = (root * step).sin_cos();
        let fades = (-decay * step).exp();
        return [fades * cos, fades * sin / root];
    }
    // Slower decay rate, computed without the cancellation of d - root.
    let slow = square / (decay + root).max(f64::MIN_POSITIVE);
    let fades = (-slow * step).exp();
    let faster = -(-2.0 * root * step).exp_m1();
    [fades * (1.0 - 0.5 * faster), fades * if root > 0.0 { faster / (2.0 * root) } else { step }]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The motion from x = 1, x' = 0 and its rate fulfil the equation for any damping, and are continuous
    /// at critical damping.
    #[test]
    fn motion_with_any_damping_fulfils_its_equation() {
        for (square, decay) in
            [(4.0, 0.0), (4.0, 0.4), (4.0, 2.0), (4.0, 2.0 + 1e-9), (4.0, 20.0), (1e8, 3e7)]
        {
            for step in [1e-4, 0.3, 2.0] {
                let motion = |h: f64| {
                    let [c, s] = free_oscillation(square, decay, h);
                    [c + s * decay, -s * square]
                };
                let [x, v] = motion(step);
                // Two half steps equal one step.
                let [c, s] = free_oscillation(square, decay, 0.5 * step);
                let [half, rate] = motion(0.5 * step);
                let whole =
                    [c * half + s * (rate + decay * half), c * rate - s * (square * half + decay * rate)];
                assert!(
                    (whole[0] - x).abs() < 1e-12 && (whole[1] - v).abs() < 1e-11 * square.sqrt(),
                    "{decay} {step}"
                );
            }
        }
        // x(h) = e^(-2h) (1 + 2h) at critical damping; (e^-h 4 - e^-4h) / 3 with the rates 1 and 4.
        let [c, s] = free_oscillation(4.0, 2.0, 0.7);
        assert!((c + 2.0 * s - (-1.4f64).exp() * 2.4).abs() < 1e-15);
        let [c, s] = free_oscillation(4.0, 2.5, 0.7);
        assert!((c + 2.5 * s - (4.0 * (-0.7f64).exp() - (-2.8f64).exp()) / 3.0).abs() < 1e-15);
    }
}
