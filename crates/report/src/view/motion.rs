//! Motion of a simulation for playback in a page.

use crate::numbers::counted;
use crate::picture::Packed;
use flexbody_body::flex_body::FlexBody;
use flexbody_file::RecordedMotion;
use serde::Serialize;

/// Largest count of numbers for all output times of a page; a longer recording is thinned to equal steps.
const MAX_NUMBERS: usize = 400_000;

/// Output times of a motion.
#[derive(Debug, Clone, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct ShownMotion {
    scene: String,
    /// Origin of the frame in model coordinates.
    origin_in_model: [f64; 3],
    /// Largest deflection. Unit: length.
    largest: f64,
    /// Centre of the box around the path of the origin; `reach` is the largest distance of the path from it.
    middle: [f64; 3],
    reach: f64,
    #[serde(skip)]
    written: usize,
    #[serde(skip)]
    time: Vec<f64>,
    #[serde(skip)]
    q: Vec<f64>,
    #[serde(skip)]
    origins: Vec<f64>,
    #[serde(skip)]
    attitudes: Vec<f64>,
}

impl ShownMotion {
    /// Collects the output times of a motion, or some at equal steps including the first and the last.
    pub(super) fn new(motion: &RecordedMotion, body: &FlexBody) -> Self {
        let written = motion.time.len();
        let chosen = motion.some_instants(MAX_NUMBERS / (8 + motion.modes));
        let some = |of: &[f64], width: usize| -> Vec<f64> {
            chosen.iter().flat_map(|&i| &of[i * width..(i + 1) * width]).copied().collect()
        };
        // Box around the path of the origin, and the largest distance of the path from its centre.
        let origins = some(&motion.origins, 3);
        let bound = |k: usize, pick: fn(f64, f64) -> f64, start: f64| {
            origins.iter().skip(k).step_by(3).copied().fold(start, pick)
        };
        let middle = [0, 1, 2]
            .map(|k| 0.5 * (bound(k, f64::min, f64::INFINITY) + bound(k, f64::max, f64::NEG_INFINITY)));
        let middle = middle.map(|x| if x.is_finite() { x } else { 0.0 });
        let distance = |x: &[f64; 3]| (0..3).map(|k| (x[k] - middle[k]).powi(2)).sum::<f64>().sqrt();
        let reach = origins.as_chunks::<3>().0.iter().map(distance).fold(0.0, f64::max);
        Self {
            scene: motion.scene.clone(),
            origin_in_model: motion.origin_in_model,
            largest: motion.largest_deflection * body.extent(),
            middle,
            reach,
            written,
            time: some(&motion.time, 1),
            q: some(&motion.q, motion.modes),
            attitudes: some(&motion.attitudes, 4),
            origins,
        }
    }

    pub(super) fn arrays(&self) -> Vec<Packed> {
        vec![
            Packed::f32("times", &self.time),
            Packed::f32("q", &self.q),
            Packed::f32("origins", &self.origins),
            Packed::f32("attitudes", &self.attitudes),
        ]
    }

    pub(super) fn instants(&self) -> usize {
        self.time.len()
    }

    pub(super) fn scene(&self) -> &str {
        &self.scene
    }

    /// Returns the number of times: `2000 of 100000 instants`.
    pub(super) fn in_words(&self) -> String {
        if self.written == self.time.len() {
            self.written.to_string()
        } else {
            format!("{} of {}", self.time.len(), counted(self.written, "instant"))
        }
    }
}
