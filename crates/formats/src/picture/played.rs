//! A motion for playback in pictures.

use flexbody_file::RecordedMotion;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Selected output times of a motion.
pub(crate) struct Played<'m> {
    motion: &'m RecordedMotion,
    /// Indices of the selected times.
    chosen: Vec<usize>,
}

impl<'m> Played<'m> {
    /// Selects at most `most` output times of a motion.
    pub(crate) fn new(motion: &'m RecordedMotion, most: usize) -> Self {
        Self { motion, chosen: motion.some_instants(most) }
    }

    /// Returns the name of the scene.
    pub(crate) fn scene(&self) -> &'m str {
        &self.motion.scene
    }

    /// Returns the number of selected times.
    pub(crate) fn len(&self) -> usize {
        self.chosen.len()
    }

    /// Returns a selected time.
    pub(crate) fn time(&self, instant: usize) -> f64 {
        self.motion.time[self.chosen[instant]]
    }

    /// Returns the duration from the first to the last selected time.
    pub(crate) fn duration(&self) -> f64 {
        self.len().checked_sub(1).map_or(0.0, |last| self.time(last) - self.time(0))
    }

    /// Returns the modal coordinates at a selected time.
    pub(crate) fn q(&self, instant: usize) -> &'m [f64] {
        let (at, modes) = (self.chosen[instant], self.motion.modes);
        &self.motion.q[at * modes..(at + 1) * modes]
    }

    /// Returns the origin of the frame at a selected time, world axes.
    pub(crate) fn origin(&self, instant: usize) -> Vector3<f64> {
        Vector3::from_column_slice(&self.motion.origins[3 * self.chosen[instant]..][..3])
    }

    /// Returns the rotation from the model axes, which turn with the body, to the world axes.
    pub(crate) fn attitude(&self, instant: usize) -> UnitQuaternion<f64> {
        let [w, i, j, k] = [0, 1, 2, 3].map(|part| self.motion.attitudes[4 * self.chosen[instant] + part]);
        UnitQuaternion::try_new(Quaternion::new(w, i, j, k), 0.0).unwrap_or_default()
    }

    /// Returns the origin of the frame in model coordinates.
    pub(crate) fn origin_in_model(&self) -> Vector3<f64> {
        self.motion.origin_in_model.into()
    }

    /// Returns the positions of points at a selected time, and their deflections from the undeformed body,
    /// both in world axes; `shapes` are the shapes of the modes in the picture.
    pub(crate) fn places(
        &self,
        instant: usize,
        positions: &[[f64; 3]],
        shapes: &[Vec<[f64; 3]>],
    ) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
        let (q, turn, origin) = (self.q(instant), self.attitude(instant), self.origin(instant));
        let deflection = |point: usize| -> Vector3<f64> {
            shapes.iter().zip(q).map(|(shape, q)| Vector3::from(shape[point]) * *q).sum()
        };
        let one = |(point, x): (usize, &[f64; 3])| -> ([f64; 3], [f64; 3]) {
            let u = turn * deflection(point);
            let rigid = origin + turn * (Vector3::from(*x) - self.origin_in_model());
            ((rigid + u).into(), u.into())
        };
        positions.iter().enumerate().map(one).unzip()
    }

    /// Returns the number of times in words: `all 101 instants`, `50 of 101 instants`.
    pub(crate) fn in_words(&self) -> String {
        match (self.len(), self.motion.time.len()) {
            (some, all) if some == all => format!("all {all} instants"),
            (some, all) => format!("{some} of {all} instants"),
        }
    }
}
