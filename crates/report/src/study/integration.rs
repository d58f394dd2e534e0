//! Time integrations of a trade study: that of all nodes, and the accuracy as the key of a scene.

use crate::notation::numbers::significant;
use flexbody_motion::scene::Scheme;
use flexbody_study::trade::NodalIntegration;
use serde::Serialize;

/// Integration of the equations of all nodes.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct NodalFacts {
    rows: usize,
    /// Order of a fixed-step method; `None` for the method of order 8 with error control.
    order: Option<usize>,
    tolerance: Option<f64>,
    step: Option<f64>,
    steps: u64,
    error: Option<f64>,
}

impl NodalFacts {
    pub(crate) fn new(nodal: &NodalIntegration) -> Self {
        let (order, tolerance, step) = match nodal.scheme {
            Scheme::Adaptive { tolerance } => (None, Some(tolerance), None),
            Scheme::Conserving { order, step } => (Some(order), None, step),
        };
        Self { rows: nodal.rows, order, tolerance, step, steps: nodal.steps, error: nodal.error }
    }

    pub(crate) fn in_words(&self) -> String {
        let how = match (self.order, self.step, self.tolerance) {
            (Some(order), Some(step), _) => {
                format!("implicit steps of order {order}, at most {} long", significant(step, 3))
            }
            (_, _, tolerance) => {
                format!("explicit steps, tolerance {}", significant(tolerance.unwrap_or(0.0), 2))
            }
        };
        let worth = match self.error {
            Some(error) => {
                let part = significant(100.0 * error, 2);
                format!("; twice the step changes the motion by {part} % of the tolerances")
            }
            None => String::new(),
        };
        format!("{} rows, {} {how}{worth}", self.rows, self.steps)
    }
}

/// Returns the accuracy of a time integration as the key of a scene: `tolerance = 1e-4` or `step = 0.002`.
pub(super) fn accuracy_key(scheme: Scheme) -> String {
    // All digits, without an exponent where that is short.
    let exact =
        |value: f64| if (1e-3..1e6).contains(&value) { format!("{value}") } else { format!("{value:e}") };
    match scheme {
        Scheme::Adaptive { tolerance } => format!("tolerance = {}", exact(tolerance)),
        Scheme::Conserving { step, .. } => format!("step = {}", exact(step.unwrap_or_default())),
    }
}
