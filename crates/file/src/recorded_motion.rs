//! The motion of a simulation as needed for pictures: the motion of the frame and of the modes.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::{Carrier, FlexBody};
use flexbody_motion::scene::Recording;

/// Motion of a body as the file of the simulation holds it: T instants, in the frame of the scene, whose axes are those
/// of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedMotion {
    /// Name of the scene.
    pub scene: String,
    /// Name of the body's model.
    pub body: String,
    /// Carrier of the body; `None` in mean axes.
    pub carrier: Option<Carrier>,
    /// Origin of the frame in model coordinates.
    pub origin_in_model: [f64; 3],
    /// Instants (T), in the unit of time.
    pub time: Vec<f64>,
    /// Number of modes nf.
    pub modes: usize,
    /// Modal coordinates (T x nf).
    pub q: Vec<f64>,
    /// Origin of the frame in the world (T x 3).
    pub origins: Vec<f64>,
    /// Euler parameters of the rotation from the axes of the frame to those of the world (T x 4).
    pub attitudes: Vec<f64>,
    /// Largest deflection of a node from the undeformed body, also between the instants, relative to the largest extent
    /// of the body along an axis of the model.
    pub largest_deflection: f64,
}

impl RecordedMotion {
    /// Returns the motion of a recording.
    pub fn of(recording: &Recording) -> Self {
        let states = &recording.states;
        Self {
            scene: recording.scene.clone(),
            body: recording.body.clone(),
            carrier: recording.setting.carrier.as_deref().and_then(Carrier::from_words),
            origin_in_model: recording.setting.origin.into(),
            time: recording.time.clone(),
            modes: states.first().map_or(0, |state| state.q.len()),
            q: states.iter().flat_map(|state| state.q.iter().copied()).collect(),
            origins: states.iter().flat_map(|state| <[f64; 3]>::from(state.origin)).collect(),
            attitudes: states.iter().flat_map(|state| state.attitude.0).collect(),
            largest_deflection: recording.extremes.deflection.value,
        }
    }

    /// Returns the body in the frame of the motion: carried by the carrier of the motion, or in mean axes.
    ///
    /// # Errors
    /// FB735 for the motion of another body; the errors of [`FlexBody::carried`].
    pub fn body_in_frame(&self, body: &FlexBody) -> Result<FlexBody> {
        let foreign = |what: String| Err(Diagnostic::new(Code::MotionForeign, what).into());
        if self.body != body.description().name {
            return foreign(format!(
                "the motion belongs to the body `{}`, not to `{}`",
                self.body,
                body.description().name
            ));
        }
        let body_in_frame = match &self.carrier {
            Some(carrier) => body.carried(carrier)?,
            None => body.in_mean_axes()?.into_owned(),
        };
        if self.modes != body_in_frame.n_modes() {
            return foreign(format!("the motion has {} modes, the body has {}", self.modes, body.n_modes()));
        }
        if self.time.is_empty() {
            return foreign("the motion has no instant".to_owned());
        }
        Ok(body_in_frame)
    }

    /// Returns the indices of at most `most` instants (two at least) at equal steps, including the first and the last.
    pub fn some_instants(&self, most: usize) -> Vec<usize> {
        let written = self.time.len();
        match written.min(most.max(2)) {
            count @ (0 | 1) => (0..count).collect(),
            count => (0..count).map(|i| i * (written - 1) / (count - 1)).collect(),
        }
    }
}
