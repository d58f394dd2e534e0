//! Shapes computed elsewhere, in a file or from a motion: checked, reordered to the rows of the model,
//! freed from rigid motion, and M-orthonormalised. Nothing is factored unless eigenvectors are to be proved
//! complete.

use super::BasisKind;
use super::columns::{Given, columns};
use super::failure::explain;
use super::modal_basis::{Basis, ModalBasis, Task, problem_of_span};
use super::nodal_modes::{StatedModes, along_the_model, by_rows};
use super::pseudo_free_surface::independent;
use super::rigid_modes::rigid_modes;
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::provenance::SourceFile;
use flexbody_eigen::{Accuracy, EigenFailure, Proof, Wanted, modes_of_span};
use flexbody_model::{FeModel, RawModes, RawShapes};

/// Shapes in the order of the degrees of freedom of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedShapes {
    /// Shapes by internal rows (N x k).
    shapes: Mat<f64>,
    digits: u8,
    source: Option<SourceFile>,
    origin: Origin,
    /// Data of the modes as stated by the file.
    stated: Option<StatedModes>,
    /// Diagnostics about changes of the shapes.
    notes: Vec<Diagnostic>,
}

/// Origin of imported shapes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Origin {
    /// File given by the user.
    User,
    /// Motion of a body in a scene.
    Motion,
}

/// Decimal digits of shapes computed by this program.
const COMPUTED_DIGITS: u8 = 15;

impl ImportedShapes {
    /// Creates shapes for `model` from values on its matrix rows.
    ///
    /// # Errors
    /// [`ShapesSize`](Code::ShapesSize) if the rows are not those of the matrices;
    /// [`MatrixNotFinite`](Code::MatrixNotFinite) and [`ShapesZero`](Code::ShapesZero), one diagnostic per
    /// finding.
    pub fn new(model: &FeModel, raw: RawShapes) -> Result<Self> {
        let (digits, source) = (raw.digits, raw.source.clone());
        let shapes = columns(model, raw, Given::Shapes)?;
        Ok(Self { shapes, digits, source, origin: Origin::User, stated: None, notes: Vec::new() })
    }

    /// Reads modes of `model` that an FE program wrote by nodes. Missing rows follow from the others by the
    /// equations of motion, and the eigenvalues of the file are compared with K and M.
    ///
    /// # Errors
    /// [`ShapesSize`](Code::ShapesSize) if the nodes are not those of the model, or too few of them;
    /// [`ShapesZero`](Code::ShapesZero) for a zero shape.
    pub fn of_modes(model: &FeModel, raw: RawModes) -> Result<Self> {
        let raw = along_the_model(model, raw)?;
        let (shapes, notes) = by_rows(model, &raw)?;
        let (digits, source, stated) = (raw.digits, Some(raw.source.clone()), Some(StatedModes::of(raw)));
        Ok(Self { shapes, digits, source, origin: Origin::User, stated, notes })
    }

    /// Creates shapes that were derived from a motion (N x k, by the rows of the model).
    pub fn of_motion(shapes: Mat<f64>) -> Self {
        let digits = COMPUTED_DIGITS;
        Self { shapes, digits, source: None, origin: Origin::Motion, stated: None, notes: Vec::new() }
    }

    /// Returns the singular and plural name of the shapes for messages.
    fn names(&self) -> (&'static str, &'static str) {
        match self.origin {
            Origin::User => ("imported shape", "imported shapes"),
            Origin::Motion => ("shape of the motion", "shapes of the motion"),
        }
    }

    /// Returns the file that the shapes were read from, if any.
    pub fn source(&self) -> Option<&SourceFile> {
        self.source.as_ref()
    }

    /// Returns the smallest relative M-norm that a shape must keep after projection against the shapes
    /// before it, given by the digits of its values.
    fn dependent(&self) -> f64 {
        10f64.powi(2 - i32::from(self.digits)).clamp(1e-8, 0.1)
    }
}

impl Basis for ImportedShapes {
    fn kind(&self) -> BasisKind {
        match self.origin {
            Origin::User => BasisKind::Imported,
            Origin::Motion => BasisKind::Scene,
        }
    }

    fn modes(&self, task: &Task<'_>) -> Result<ModalBasis> {
        let Task { model, settings, context } = *task;
        let rigid = rigid_modes(model, &model.pencil())?;
        let problem = problem_of_span(model, rigid.as_ref());
        let criterion = self.dependent();
        let (one, several) = self.names();
        let failed = |failure| explain(model, failure);
        let independent = independent(&problem.pencil, rigid.as_ref(), self.shapes.clone(), criterion)
            .ok_or_else(|| failed(EigenFailure::MassIndefinite))?;
        let notes = independent.notes(several, criterion, |j| format!("shape {}", j + 1));
        if independent.retained.is_empty() {
            let message = format!("none of {} {several} deforms the body", self.shapes.ncols());
            return Err(Error::new([vec![Diagnostic::new(Code::ShapesNone, message)], notes].concat()));
        }
        let solution = modes_of_span(&problem, independent.vectors, settings, context).map_err(failed)?;
        let mut basis = ModalBasis::new(model, &problem, settings, solution, one)?;
        let compared = self
            .stated
            .as_ref()
            .map(|stated| stated.beside(model, self.shapes.as_ref(), &independent.retained, &basis.solution));
        basis.diagnostics.extend(self.notes.iter().cloned().chain(compared.flatten()).chain(notes));
        let given = basis.solution.eigenvalues.len();
        if let Wanted::Lowest(wanted) = settings.wanted
            && wanted > given
            && wanted < usize::MAX
        {
            let message = format!("{wanted} modes were requested, the shapes give {given}");
            basis.diagnostics.push(Diagnostic::new(Code::ModesClamped, message));
        }
        basis.describe_span(settings.accuracy);
        Ok(basis)
    }
}

impl ModalBasis {
    /// Adds notes about the modes of a subspace: the modes that are no eigenvectors, and the completeness
    /// of the others.
    fn describe_span(&mut self, accuracy: Accuracy) {
        let solution = &self.solution;
        let (residuals, completeness) = (&solution.residuals, &solution.completeness);
        let promised = accuracy.residual();
        let worst = residuals.iter().copied().fold(0.0, f64::max);
        let others = solution.residuals.len() - solution.eigenvectors(accuracy);
        if others > 0 {
            let message = format!(
                "{others} of {} modes are not eigenvectors but the best approximations in the span of the shapes: K-residual up to {worst:.0e}, expected at most {promised:.0e}",
                residuals.len()
            );
            self.diagnostics.push(Diagnostic::new(Code::ShapesSpan, message));
        }
        if completeness.proof == Proof::NotProved && others < residuals.len() {
            let message = format!("completeness of the modes is not proved: {}", completeness.remark);
            self.diagnostics.push(Diagnostic::new(Code::CompletenessUnproved, message));
        }
    }
}
