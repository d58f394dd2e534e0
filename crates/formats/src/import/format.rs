//! Trait of import formats, and the result of reading a file.

use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::text::InputFile;
use flexbody_base::units::UnitSystem;
use flexbody_body::invariants::Numbered;
use flexbody_model::{GeometricStiffness, SurfaceMesh};

/// Result of reading a file of another program.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedFile {
    /// Name of the format.
    pub format: &'static str,
    /// Detected dialect in the terms of the documentation; empty for a format with a single form.
    pub dialect: String,
    /// Reasons for the dialect, and other facts that are no errors, as sentences without a full stop.
    pub notes: Vec<String>,
    /// Checks of the format: redundant arrays, digits, layout. Identities of every body are checked
    /// elsewhere.
    pub checks: Vec<AuditCheck>,
    /// Reasons why no body may be made from the file although it can be read, as sentences without a full
    /// stop. The checks report the same defects.
    pub unsound: Vec<String>,
    /// Body described by the file.
    pub body: ImportedBody,
}

/// A format that can be read.
pub trait ImportFormat: Sync {
    /// Returns the name on the command line.
    fn name(&self) -> &'static str;

    /// Returns true if the file can be of this format, judged by its beginning (for an HDF5 file by its
    /// names).
    fn recognises(&self, file: &InputFile) -> bool;

    /// Reads a file.
    ///
    /// # Errors
    /// [`ForeignUnreadable`](flexbody_base::diagnostic::Code::ForeignUnreadable) with the line,
    /// [`ForeignIncomplete`](flexbody_base::diagnostic::Code::ForeignIncomplete) for a file that does not
    /// even determine the shapes of the arrays.
    fn read(&self, file: &InputFile) -> Result<ImportedFile>;
}

/// A body described by a file of another program. Only array shapes are checked: modes may be arbitrary,
/// matrices asymmetric, numbers not finite.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedBody {
    /// Name of the body; empty if the file has none.
    pub name: String,
    /// Units, if the file states them.
    pub units: Option<UnitSystem>,
    /// Inertia about the origin of the body frame of the file, along its axes.
    pub inertia: Numbered,
    /// Modal stiffness K_ff (nf x nf).
    pub modal_stiffness: Mat<f64>,
    /// Modal damping D (nf x nf); `None` if the file has none.
    pub modal_damping: Option<Mat<f64>>,
    /// Geometric stiffness Psi' K_geo Psi (nf x nf) of unit loads along body axes.
    pub geometric_stiffness: Vec<GeometricStiffness<Mat<f64>>>,
    /// Nodes and frames of the body.
    pub frames: Vec<ImportedFrame>,
    /// Surface on the places of the body, if the file has one.
    pub mesh: Option<SurfaceMesh>,
    /// Data missing in the file or not usable, as fragments of sentences.
    pub omissions: Vec<String>,
}

/// A node or frame of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedFrame {
    /// Label in the file.
    pub label: String,
    /// Name of the interface at the frame, if the file states one.
    pub interface: Option<String>,
    /// Undeformed position in the body frame.
    pub position: [f64; 3],
    /// Displacement of each mode (3 x nf).
    pub translation: Mat<f64>,
    /// Rotation of each mode (3 x nf); `None` if the file has none.
    pub rotation: Option<Mat<f64>>,
}

impl ImportedBody {
    /// Returns the number of modes nf.
    pub fn n_modes(&self) -> usize {
        self.inertia.i8.len()
    }
}

/// A check of a file: its condition, the violation, and the meaning of a failure.
#[derive(Debug, Clone, PartialEq)]
pub struct AuditCheck {
    /// Stable name: `Ge = 2 Cr1` is `ge_is_twice_cr1`.
    pub name: &'static str,
    /// Condition in the names of the format.
    pub formula: &'static str,
    /// Violation relative to the size of the terms; 0 is perfect.
    pub value: f64,
    /// Largest value that passes.
    pub limit: f64,
    /// Code of the finding if the check fails.
    pub code: Code,
    /// Meaning of a failure: a fragment in plain words with its facts, without the value.
    pub meaning: String,
}

impl AuditCheck {
    /// Returns true if `value <= limit`; a NaN never passes.
    pub fn passed(&self) -> bool {
        self.value <= self.limit
    }

    /// Returns the finding of a failed check; `None` if it passed.
    pub fn finding(&self) -> Option<Diagnostic> {
        let message =
            || format!("{} ({}: {:.2e}, limit {:.0e})", self.meaning, self.formula, self.value, self.limit);
        (!self.passed()).then(|| Diagnostic::new(self.code, message()))
    }
}
