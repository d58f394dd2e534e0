//! What a file of another program says of a body, in one form for all of them.

use faer::Mat;
use flexbody_base::units::UnitSystem;
use flexbody_body::invariants::Numbered;
use flexbody_model::{GeometricStiffness, SurfaceMesh};

/// A body as a file of another program describes it. Nothing of it is checked beyond its shapes: modes may be
/// any, matrices not symmetric, numbers not finite.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedBody {
    /// Name, where the file has one.
    pub name: String,
    /// Units, where the file states them.
    pub units: Option<UnitSystem>,
    /// Inertia about the origin of the file's body frame, along its axes.
    pub inertia: Numbered,
    /// K_ff (nf x nf).
    pub modal_stiffness: Mat<f64>,
    /// D (nf x nf), where the file has damping.
    pub modal_damping: Option<Mat<f64>>,
    /// Psi' K_geo Psi (nf x nf) of unit loads along body axes.
    pub geometric_stiffness: Vec<GeometricStiffness<Mat<f64>>>,
    /// Places of the body.
    pub frames: Vec<ImportedFrame>,
    /// Surface on the places of the body, if the file has one.
    pub mesh: Option<SurfaceMesh>,
    /// What the file lacks of a body, or what of it cannot be taken, as fragments of sentences.
    pub lacks: Vec<String>,
}

/// A node or frame of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedFrame {
    /// Label in the file.
    pub label: String,
    /// Name of the interface that it is, where the file says so.
    pub interface: Option<String>,
    /// Undeformed position in the body frame.
    pub position: [f64; 3],
    /// Displacement of each mode (3 x nf).
    pub translation: Mat<f64>,
    /// Rotation of each mode (3 x nf), where the file has it.
    pub rotation: Option<Mat<f64>>,
}

impl ImportedBody {
    /// Number of modes nf.
    pub fn n_modes(&self) -> usize {
        self.inertia.i8.len()
    }
}
