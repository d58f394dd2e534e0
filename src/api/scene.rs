//! What a body is to do, what it does, and what it needs for that.

use crate::base::diagnostic::Diagnostic;
use crate::base::error::Result;
use crate::motion::scene::{self, Recording, read_scene};
use crate::study::selection;
use nalgebra::Vector3;
use std::path::Path;

/// What a body is to do: gravity, loads, prescribed motion, duration, tolerances (docs/simulate.md).
#[derive(Debug, Clone)]
pub struct Scene(pub(super) scene::Scene);

impl Scene {
    /// Reads a scene file.
    ///
    /// # Errors
    /// FB101, FB106 when it or a file of its histories cannot be read; FB211, FB213 for what is wrong in it and FB215 to FB217 in these files, all of
    /// it.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        read_scene(path).map(Self)
    }

    /// Name.
    pub fn name(&self) -> &str {
        &self.0.name
    }
}

/// The motion of a body in a scene. Units are those of the model.
#[derive(Debug, Clone)]
pub struct Motion {
    pub(super) recording: Recording,
    pub(super) diagnostics: Vec<Diagnostic>,
}

impl Motion {
    /// Instants at which the motion is written.
    pub fn times(&self) -> &[f64] {
        &self.recording.time
    }

    /// Modal coordinates at an instant (nf).
    ///
    /// # Panics
    /// When there is no such instant.
    pub fn modal_coordinates(&self, instant: usize) -> &[f64] {
        &self.recording.states[instant].q
    }

    /// Place of the origin of the frame at an instant, world axes.
    ///
    /// # Panics
    /// When there is no such instant.
    pub fn origin(&self, instant: usize) -> Vector3<f64> {
        self.recording.states[instant].origin
    }

    /// The largest deflection of any node, also between the instants. Unit: length.
    pub fn largest_deflection(&self) -> f64 {
        self.recording.extremes.deflection.value
    }

    /// Warnings and notes.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }
}

/// Which terms and modes a body needs in a scene.
#[derive(Debug, Clone)]
pub struct Selection(pub(super) selection::Selection);

impl Selection {
    /// The modes that are kept (from 0).
    pub fn modes(&self) -> &[usize] {
        &self.0.modes
    }

    /// Names of the groups of the kinetic energy with the reason why each is kept or not.
    pub fn groups(&self) -> Vec<(&'static str, bool, &str)> {
        self.0.terms.iter().map(|term| (term.group.name(), term.kept, term.reason.as_str())).collect()
    }

    /// Whether the tolerances of the scene hold, as far as they were measured.
    pub fn holds(&self) -> bool {
        self.0.holds()
    }
}
