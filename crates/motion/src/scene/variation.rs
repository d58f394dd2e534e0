//! Variations of a scene: motions that a body is judged on and was not made for.

use super::{Drive, Point, Scene, VectorHistory};
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use std::f64::consts::TAU;

/// Factor of the angular velocities in the standard variation of a scene.
const STANDARD_SPEED: f64 = 1.2;

/// Variation of a load case.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneVariation {
    /// Name of the variation.
    pub name: String,
    /// Index of the load case that it varies (from 0).
    pub case: usize,
    /// The varied scene.
    pub scene: Scene,
}

/// Variations that a scene file states for its load cases.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Variations {
    /// None, and the standard ones are not wanted either: a scene that was not read from a file.
    #[default]
    Without,
    /// None: the standard variations are used.
    Standard,
    /// Variations of the file.
    Stated(Vec<SceneVariation>),
}

impl Variations {
    /// Returns the variations of one load case (from 0), which becomes the only one.
    pub(super) fn of_case(self, case: usize) -> Self {
        match self {
            Self::Stated(all) => {
                let of_case = all.into_iter().filter(|one| one.case == case);
                Self::Stated(of_case.map(|one| SceneVariation { case: 0, ..one }).collect())
            }
            other => other,
        }
    }
}

/// Change of a scene.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// Forces and torques are turned, in the axes of each load.
    Turn {
        /// Direction of the axis.
        axis: Unit<Vector3<f64>>,
        /// Angle. Unit: rad.
        angle: f64,
        /// Index of the load (from 0); `None` for all.
        load: Option<usize>,
    },
    /// Forces and torques are multiplied by a factor.
    Scale {
        /// Factor.
        factor: f64,
        /// Index of the load (from 0); `None` for all.
        load: Option<usize>,
    },
    /// A load acts at another point.
    Move {
        /// Index of the load (from 0).
        load: usize,
        /// New point of application.
        to: Point,
    },
    /// All prescribed and initial angular velocities, and the limits of rotation that the scene states, are multiplied by
    /// a factor.
    Speed(f64),
}

impl Scene {
    /// Returns the scene after a change. Indices of loads must exist.
    pub fn changed(&self, change: &Change) -> Self {
        match change {
            Change::Turn { axis, angle, load } => {
                let rotation = Rotation3::from_axis_angle(axis, *angle);
                self.with_loads(*load, |history| history.turned(rotation.matrix()))
            }
            Change::Scale { factor, load } => self.with_loads(*load, |history| history.scaled(*factor)),
            Change::Move { load, to } => {
                let mut scene = self.clone();
                scene.loads[*load].at = to.clone();
                scene
            }
            Change::Speed(factor) => {
                let mut scene = self.turning_faster(*factor);
                scene.initial.angular_velocity *= *factor;
                // A variation may leave the range that the scene states: it is a motion that nobody asked for.
                let motion = &mut scene.requirements.motion;
                for range in [&mut motion.angular_velocity, &mut motion.angular_acceleration] {
                    *range = range.map(|range| range.scaled(factor.abs()));
                }
                scene
            }
        }
    }

    /// Returns the scene with the histories of one load, or of all, replaced by `change` of each.
    fn with_loads(&self, load: Option<usize>, change: impl Fn(&VectorHistory) -> VectorHistory) -> Self {
        let mut scene = self.clone();
        let wanted = |at: usize| load.is_none_or(|load| load == at);
        for (_, load) in scene.loads.iter_mut().enumerate().filter(|(at, _)| wanted(*at)) {
            for history in [&mut load.force, &mut load.torque] {
                if !history.is_nothing() {
                    *history = change(history);
                }
            }
        }
        scene
    }

    /// Returns the standard variations of the scene for a body of 2 or 3 dimensions, each with its name: the loads, or
    /// without loads the prescribed translation, along the other axes, and angular velocities that are 20 % higher.
    ///
    /// In space the loads are turned by 120 and 240 degrees about (1, 1, 1), which takes each axis to the next; in the
    /// plane by 90 degrees.
    pub(super) fn standard_variations(&self, dimension: usize) -> Vec<(String, Scene)> {
        let (axis, turns) = match dimension {
            2 => (Vector3::z_axis(), &[("turned by 90 degrees", 0.25)][..]),
            _ => {
                let diagonal = Unit::new_normalize(Vector3::repeat(1.0));
                (diagonal, &[("turned from x to y", 1.0 / 3.0), ("turned from x to z", 2.0 / 3.0)][..])
            }
        };
        let mut all = Vec::new();
        for (name, turn) in turns {
            let rotation = permuted(Rotation3::from_axis_angle(&axis, TAU * turn).matrix());
            all.extend(
                self.turned_excitation(&rotation).map(|(what, scene)| (format!("{what} {name}"), scene)),
            );
        }
        let is_driven = self.rotation().is_some_and(|history| !history.is_nothing());
        if is_driven || self.initial.angular_velocity != Vector3::zeros() {
            let faster = self.changed(&Change::Speed(STANDARD_SPEED));
            all.push(("20 % faster".to_owned(), faster));
        }
        all
    }

    /// Returns the scene with its loads turned or, without loads, with its prescribed translation turned. Returns `None`
    /// if it has neither.
    fn turned_excitation(&self, rotation: &Matrix3<f64>) -> Option<(&'static str, Scene)> {
        if self.acting().any(|history| !history.is_nothing()) {
            return Some(("loads", self.with_loads(None, |history| history.turned(rotation))));
        }
        let mut scene = self.clone();
        let drive = scene.carried.as_mut()?.translation.as_mut()?;
        match drive {
            Drive::Displacement(way) | Drive::Velocity(way) | Drive::Acceleration(way) => {
                *way = way.turned(rotation);
            }
        }
        Some(("translation", scene))
    }
}

/// Returns a rotation that permutes axes, without the rounding of its angle.
fn permuted(rotation: &Matrix3<f64>) -> Matrix3<f64> {
    rotation.map(f64::round)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn standard_turns_permute_the_axes() {
        let axis = Unit::new_normalize(Vector3::repeat(1.0));
        let turned = |turn: f64| permuted(Rotation3::from_axis_angle(&axis, TAU * turn).matrix());
        assert_eq!(turned(1.0 / 3.0) * Vector3::x(), Vector3::y());
        assert_eq!(turned(2.0 / 3.0) * Vector3::x(), Vector3::z());
        let plane = permuted(Rotation3::from_axis_angle(&Vector3::z_axis(), TAU * 0.25).matrix());
        assert_eq!(plane * Vector3::x(), Vector3::y());
    }
}
