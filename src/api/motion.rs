//! The motion of a body.

use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::units::UnitSystem;
use flexbody_motion::scene::Recording;
use nalgebra::Vector3;

/// The motion of a body in a scene. Units are those of the model.
///
/// The frame that it is told by has its origin at the centre of mass of the undeformed body, or at the
/// reference point of what carries it, and the axes of the model, which turn with the body: modal coordinates
/// are those of the body, positions and attitude not those of its own frame where that is another.
#[derive(Debug, Clone)]
pub struct Motion {
    pub(super) recording: Recording,
    pub(super) units: UnitSystem,
    /// Largest extent of the body.
    pub(super) extent: f64,
    pub(super) diagnostics: Vec<Diagnostic>,
}

/// The path of a watched point. All vectors are one for each instant.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PointPath {
    /// Name of the point: `node 17`, `interface tip`.
    pub name: String,
    /// Places, world axes.
    pub place: Vec<[f64; 3]>,
    /// Deflections from the undeformed body, along the axes of the frame.
    pub deflection: Vec<[f64; 3]>,
    /// Velocities, world axes.
    pub velocity: Vec<[f64; 3]>,
    /// Accelerations, world axes.
    pub acceleration: Vec<[f64; 3]>,
}

impl Motion {
    /// Instants at which the motion is written.
    pub fn times(&self) -> &[f64] {
        &self.recording.time
    }

    /// Modal coordinates at an instant (nf).
    ///
    /// # Panics
    /// Here and below, when there is no such instant.
    pub fn modal_coordinates(&self, instant: usize) -> &[f64] {
        &self.recording.states[instant].q
    }

    /// Their rates at an instant (nf).
    pub fn modal_velocities(&self, instant: usize) -> &[f64] {
        &self.recording.states[instant].qd
    }

    /// Place of the origin of the frame at an instant, world axes.
    pub fn origin(&self, instant: usize) -> Vector3<f64> {
        self.recording.states[instant].origin
    }

    /// Its velocity, world axes.
    pub fn velocity(&self, instant: usize) -> Vector3<f64> {
        self.recording.states[instant].velocity
    }

    /// Attitude of the frame: Euler parameters (p0, p1, p2, p3) of unit length, p0 the cosine of half the
    /// angle.
    pub fn attitude(&self, instant: usize) -> [f64; 4] {
        self.recording.states[instant].attitude.0
    }

    /// Angular velocity of the frame, along its axes.
    pub fn angular_velocity(&self, instant: usize) -> Vector3<f64> {
        self.recording.states[instant].omega
    }

    /// Kinetic energy.
    pub fn kinetic_energy(&self, instant: usize) -> f64 {
        self.recording.balances[instant].kinetic
    }

    /// Elastic energy.
    pub fn elastic_energy(&self, instant: usize) -> f64 {
        self.recording.balances[instant].elastic
    }

    /// Work of forces, damping and prescribed motion since the start.
    pub fn work(&self, instant: usize) -> f64 {
        self.recording.balances[instant].work
    }

    /// Linear momentum, world axes.
    pub fn linear_momentum(&self, instant: usize) -> Vector3<f64> {
        self.recording.balances[instant].linear
    }

    /// Angular momentum about where the origin of the frame was at the start, world axes.
    pub fn angular_momentum(&self, instant: usize) -> Vector3<f64> {
        self.recording.balances[instant].angular
    }

    /// Force and torque about the origin that the prescribed motion takes, along the axes of the frame;
    /// `None` where nothing is prescribed.
    pub fn reaction(&self, instant: usize) -> Option<(Vector3<f64>, Vector3<f64>)> {
        self.recording.reactions.as_ref().map(|reactions| reactions[instant])
    }

    /// Paths of the points that the scene watches.
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

    /// The largest deflection of any node, also between the instants. Unit: length.
    pub fn largest_deflection(&self) -> f64 {
        self.extent * self.recording.extremes.deflection.value
    }

    /// How far energy less work, linear momentum and angular momentum less their impulses drifted, relative
    /// to the largest of the motion.
    pub fn drift(&self) -> [f64; 3] {
        let drift = self.recording.drift();
        [drift.energy, drift.linear, drift.angular]
    }

    /// Steps of the integration.
    pub fn steps(&self) -> u64 {
        self.recording.work.steps
    }

    /// Warnings and notes.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }

    /// Writes the motion to an HDF5 file as `flexbody simulate -o` does (docs/simulate.md): it appears whole
    /// or not at all.
    ///
    /// # Errors
    /// FB104, FB105, FB107 and FB602 when it cannot be written.
    #[cfg(feature = "hdf5")]
    pub fn write(&self, path: impl AsRef<std::path::Path>) -> flexbody_base::error::Result<()> {
        use flexbody_file::{fill_simulation, prepare_output};
        let slot = prepare_output(path)?;
        fill_simulation(&self.recording, &self.units, &slot)?;
        slot.commit()
    }
}
