//! Warnings about a selection whose errors are within the tolerances.

use super::rows::PointRows;
use super::trial::TrialRuns;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_motion::scene::{Axes, History, Measure, VectorHistory};
use std::f64::consts::TAU;

/// Relative distance from a mode's frequency within which a load is resonant. Three half widths of the resonance count
/// if these are larger.
const RESONANCE_DISTANCE: f64 = 0.1;

/// Returns the warning that the errors of the selected model grow `growth` times faster than its motion.
pub(super) fn phase_drifts(growth: f64) -> Diagnostic {
    let message = format!(
        "from the first half of the run to the second, the errors of the selected model grow {growth:.1} times more than the motion"
    );
    Diagnostic::new(Code::PhaseDrifts, message)
}

/// Returns warnings about dropped modes that a load excites near their frequency.
pub(super) fn resonances(runs: &TrialRuns<'_>, measure: &Measure<'_>, modes: &[usize]) -> Vec<Diagnostic> {
    let (body, scene) = (runs.body, runs.scene);
    let rows = PointRows::new(body);
    let spin = measure.trace().extremes.spin;
    let mut found = Vec::new();
    for (load, point) in scene.loads.iter().zip(runs.loads) {
        // Seen from the body, a force that is fixed in space turns backwards with the spin.
        let turning = if load.axes == Axes::World { spin } else { 0.0 };
        let rates: Vec<f64> = match &load.force {
            VectorHistory::Along { factor: History::Sine { frequency, .. }, .. } => {
                [-1.0, 0.0, 1.0].iter().map(|sign| (TAU * frequency + sign * turning).abs()).collect()
            }
            _ => vec![turning],
        };
        let modal = rows.of(point);
        for (j, lambda) in body.modes().eigenvalue.iter().enumerate() {
            let moved =
                modal.column(j).norm() * load.force.main_direction().map_or(0.0, |along| along.norm());
            let near = |rate: &&f64| {
                let width = RESONANCE_DISTANCE.max(3.0 * body.modes().damping_ratio[j]);
                (*rate / lambda.sqrt() - 1.0).abs() < width
            };
            if moved == 0.0 || modes.binary_search(&j).is_ok() {
                continue;
            }
            if let Some(rate) = rates.iter().find(near) {
                let message = format!(
                    "mode {} of frequency {:.4e} is dropped, but the load at {} excites it at {:.4e} (oscillations per unit of time)",
                    j + 1,
                    lambda.sqrt() / TAU,
                    load.at,
                    rate / TAU
                );
                found.push(Diagnostic::new(Code::ResonanceDropped, message));
            }
        }
    }
    found
}
