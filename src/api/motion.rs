//! Motion of a body.

use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::units::UnitSystem;
use flexbody_motion::scene::Recording;
use nalgebra::Vector3;

/// Motion of a body in a scene, in the units of the model.
///
/// The frame has its origin at the centre of mass of the undeformed body, or at the reference point that carries it,
/// and the axes of the model, which turn with the body. Modal coordinates are those of the body; positions and attitude
/// may differ from those of the body's own frame. The functions of an `instant` panic when the motion has no such
/// instant.
#[derive(Debug, Clone)]
pub struct Motion {
    pub(super) recording: Recording,
    pub(super) units: UnitSystem,
    /// Largest extent of the body.
    pub(super) extent: f64,
    pub(super) diagnostics: Vec<Diagnostic>,
}

/// Path of a watched point. All vectors have one entry per instant.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PointPath {
    /// Name of the point: `node 17`, `interface tip`.
    pub name: String,
    /// Positions, world axes.
    pub place: Vec<[f64; 3]>,
    /// Deflections from the undeformed body, along the axes of the frame.
    pub deflection: Vec<[f64; 3]>,
    /// Velocities, world axes.
    pub velocity: Vec<[f64; 3]>,
    /// Accelerations, world axes.
    pub acceleration: Vec<[f64; 3]>,
}

impl Motion {
    /// Returns the instants of the output.
    pub fn times(&self) -> &[f64] {
        &self.recording.time
    }

    /// Returns the modal coordinates at an instant (nf).
    ///
    /// # Panics
    /// If there is no such instant.
    pub fn modal_coordinates(&self, instant: usize) -> &[f64] {
        &self.recording.states[instant].q
    }

    /// Returns the rates of the modal coordinates at an instant (nf).
    pub fn modal_velocities(&self, instant: usize) -> &[f64] {
        &self.recording.states[instant].qd
    }

    /// Returns the position of the origin of the frame at an instant, world axes.
    pub fn origin(&self, instant: usize) -> Vector3<f64> {
        self.recording.states[instant].origin
    }

    /// Returns the velocity of the origin of the frame, world axes.
    pub fn velocity(&self, instant: usize) -> Vector3<f64> {
        self.recording.states[instant].velocity
    }

    /// Returns the attitude of the frame as Euler parameters (p0, p1, p2, p3) of unit length, where p0 is the cosine of
    /// half the angle.
    pub fn attitude(&self, instant: usize) -> [f64; 4] {
        self.recording.states[instant].attitude.0
    }

    /// Returns the angular velocity of the frame, along its axes.
    pub fn angular_velocity(&self, instant: usize) -> Vector3<f64> {
        self.recording.states[instant].omega
    }

    /// Returns the kinetic energy.
    pub fn kinetic_energy(&self, instant: usize) -> f64 {
        self.recording.balances[instant].kinetic
    }

    /// Returns the elastic energy.
    pub fn elastic_energy(&self, instant: usize) -> f64 {
        self.recording.balances[instant].elastic
    }

    /// Returns the work of forces, damping and prescribed motion since the start.
    pub fn work(&self, instant: usize) -> f64 {
        self.recording.balances[instant].work
    }

    /// Returns the linear momentum, world axes.
    pub fn linear_momentum(&self, instant: usize) -> Vector3<f64> {
        self.recording.balances[instant].linear
    }

    /// Returns the angular momentum about the initial position of the frame's origin, world axes.
    pub fn angular_momentum(&self, instant: usize) -> Vector3<f64> {
        self.recording.balances[instant].angular
    }

    /// Returns the force and the torque about the origin that the prescribed motion requires, along the axes of the
    /// frame; `None` without prescribed motion.
    pub fn reaction(&self, instant: usize) -> Option<(Vector3<f64>, Vector3<f64>)> {
        self.recording.reactions.as_ref().map(|reactions| reactions[instant])
    }

    /// Returns the paths of the points that the scene watches.
    pub fn paths(&self) -> Vec<PointPath> {
        let all = |vectors: &[Vector3<f64>]| vectors.iter().map(|vector| (*vector).into()).collect();
        let paths = self.recording.paths.iter();
        paths
            .map(|path| PointPath {
                name: path.name.clone(),
                place: all(&path.place),
                deflection: all(&path.deflection),
                velocity: all(&path.velocity),
                acceleration: all(&path.acceleration),
            })
            .collect()
    }

    /// Returns the largest deflection of any node, also between the instants. Unit: length.
    pub fn largest_deflection(&self) -> f64 {
        self.extent * self.recording.extremes.deflection.value
    }

    /// Returns the drift of energy minus work, and of linear and angular momentum minus their impulses, each relative
    /// to the largest value of the motion.
    pub fn drift(&self) -> [f64; 3] {
        let drift = self.recording.drift();
        [drift.energy, drift.linear, drift.angular]
    }

    /// Returns the number of integration steps.
    pub fn steps(&self) -> u64 {
        self.recording.work.steps
    }

    /// Returns warnings and notes.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }

    /// Writes the motion to an HDF5 file in the format of `flexbody simulate -o` (docs/reference/simulate.md). The
    /// file appears whole or not at all.
    ///
    /// # Errors
    /// FB104, FB105, FB107 and FB602 if the file cannot be written.
    #[cfg(feature = "hdf5")]
    pub fn write(&self, path: impl AsRef<std::path::Path>) -> flexbody_base::error::Result<()> {
        use flexbody_file::{fill_simulation, prepare_output};
        let slot = prepare_output(path)?;
        fill_simulation(&self.recording, &self.units, &slot)?;
        slot.commit()
    }
}
