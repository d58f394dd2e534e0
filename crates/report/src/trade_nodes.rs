//! Integration of the equations of all nodes in a trade study.

use super::numbers::significant;
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
