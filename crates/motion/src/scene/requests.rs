//! Simulation of a scene and recovery of a history as a user requests them, with every refusal and remark. The commands, the
//! library and the Python package run by these requests.

use super::description::Scene;
use super::instants::unsettled_rate;
use super::interface_stresses::stresses_at_rigid_interfaces;
use super::recovered::{LoadedHistory, RecoveredMotion};
use super::simulate::{Recording, simulate, simulate_with_envelope};
use super::stress_error::StressError;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;

/// Request of a simulation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SimulationRequest {
    /// True if rows of recoveries are needed.
    pub needs_rows: bool,
    /// True if the largest stresses of every point over the continuous motion are needed.
    pub needs_envelope: bool,
}

/// Motion of a body in a scene.
#[derive(Debug, Clone)]
pub struct Simulated {
    /// Motion at the instants of the output.
    pub recording: Recording,
    /// Warnings and notes.
    pub diagnostics: Vec<Diagnostic>,
}

impl SimulationRequest {
    fn needs_recoveries(self) -> bool {
        self.needs_rows || self.needs_envelope
    }

    /// Refuses a body without recoveries if rows are needed.
    ///
    /// # Errors
    /// [`RecoveryUnknown`](Code::RecoveryUnknown).
    pub fn check(self, body: &FlexBody) -> Result<()> {
        if !self.needs_recoveries() || !body.recoveries().is_empty() {
            return Ok(());
        }
        let message = "the body has no recovery, so there are no rows to write";
        Err(Diagnostic::new(Code::RecoveryUnknown, message).into())
    }

    /// Simulates `body` in `scene`.
    ///
    /// # Errors
    /// The errors of [`SimulationRequest::check`] and of [`simulate`]; [`RecoveryUnknown`](Code::RecoveryUnknown) if
    /// rows are needed and the scene leaves no recovery.
    pub fn run(self, body: &FlexBody, scene: &Scene, context: &Context<'_>) -> Result<Simulated> {
        self.check(body)?;
        context.phase("simulation");
        let simulate = if self.needs_envelope { simulate_with_envelope } else { simulate };
        let (recording, mut diagnostics) = simulate(body, scene, context)?;
        diagnostics.extend(unsettled_rate(body, scene, &recording, context)?);
        let missing_stress = StressError::of_run(body, scene, &recording.extremes, context)?;
        diagnostics.extend(missing_stress.and_then(|error| error.warning(body)));
        if self.needs_recoveries() && recording.recovered.is_none() {
            let message = "no recovery of the body is left in this scene, so there are no rows to write";
            return Err(Diagnostic::new(Code::RecoveryUnknown, message).into());
        }
        Ok(Simulated { recording, diagnostics })
    }
}

/// Request of recoveries over the history of a motion.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RecoveryRequest {
    /// Names of the recoveries; empty for all.
    pub only: Vec<String>,
    /// True if the largest stresses of every point are needed.
    pub needs_envelope: bool,
}

/// Recoveries over a history.
#[derive(Debug, Clone)]
pub struct Recovered {
    /// Rows at the instants of the history.
    pub motion: RecoveredMotion,
    /// Warnings and notes.
    pub diagnostics: Vec<Diagnostic>,
}

impl RecoveryRequest {
    /// Computes the recoveries of `body` over a `history`.
    ///
    /// # Errors
    /// The errors of [`LoadedHistory::recover`].
    pub fn run(&self, body: &FlexBody, history: &LoadedHistory) -> Result<Recovered> {
        let mut motion = history.recover(body, &self.only)?;
        if self.needs_envelope {
            motion = motion.with_envelope();
        }
        let mut diagnostics = Vec::from_iter(history.left_out(body, &self.only));
        diagnostics.extend(stresses_at_rigid_interfaces(body, &motion));
        Ok(Recovered { motion, diagnostics })
    }
}
