//! What may go wrong in a scene although the tolerances hold.

use super::rows::PointRows;
use super::trial::Bench;
use crate::diagnostic::{Code, Diagnostic};
use crate::scene::{Axes, ErrorHistory, History, Measure};
use std::f64::consts::TAU;

/// Errors of the second half of a run over those of the first from which on they are said to grow.
const GROWING: f64 = 1.8;

/// Errors below this part of their tolerance do not matter yet, though they grow.
const MATTERS: f64 = 0.01;

/// How near the frequency of a load is to that of a mode where that resonates, relative: or three half widths of its resonance.
const NEAR: f64 = 0.1;

/// Warnings about the model with `modes` whose errors are `history`.
pub(super) fn warnings(
    bench: &Bench<'_>,
    measure: &Measure<'_>,
    modes: &[usize],
    history: Option<&ErrorHistory>,
) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    let tolerance = &bench.scene.requirements.tolerance;
    if let Some(history) = history
        && let Some(growth) = history.growth().filter(|growth| *growth > GROWING)
        && history.largest().worst(tolerance) > MATTERS
    {
        let message = format!(
            "errors of the selected model are {growth:.1} times as large in the second half of the run as in the first"
        );
        found.push(Diagnostic::new(Code::PhaseDrifts, message));
    }
    found.extend(resonances(bench, measure, modes));
    found
}

/// Modes that are dropped and that a load drives near their frequency.
fn resonances(bench: &Bench<'_>, measure: &Measure<'_>, modes: &[usize]) -> Vec<Diagnostic> {
    let (body, scene) = (bench.body, bench.scene);
    let rows = PointRows::new(body);
    let spin = measure.recording().states.iter().map(|state| state.omega.norm()).fold(0.0, f64::max);
    let mut found = Vec::new();
    for (load, point) in scene.loads.iter().zip(bench.loads) {
        // Seen from the body a force that is fixed in space turns the other way round.
        let turning = if load.axes == Axes::World { spin } else { 0.0 };
        let rates: Vec<f64> = match &load.history {
            History::Sine { frequency, .. } => {
                [-1.0, 0.0, 1.0].iter().map(|sign| (TAU * frequency + sign * turning).abs()).collect()
            }
            _ => vec![turning],
        };
        let modal = rows.of(point);
        for (j, lambda) in body.modes().eigenvalue.iter().enumerate() {
            let moved = modal.column(j).norm() * load.force.norm();
            let near = |rate: &&f64| {
                let width = NEAR.max(3.0 * body.modes().damping_ratio[j]);
                (*rate / lambda.sqrt() - 1.0).abs() < width
            };
            if moved == 0.0 || modes.binary_search(&j).is_ok() {
                continue;
            }
            if let Some(rate) = rates.iter().find(near) {
                let message = format!(
                    "mode {} of frequency {:.4e} is dropped, and the load at {} drives it at {:.4e} (oscillations per time)",
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
