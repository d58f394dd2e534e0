//! Rows of matrices whose files name them, beside tables of nodes that list the nodes in any order.

use super::open_files::OpenFiles;
use crate::matrices::{MatrixRole, MatrixSource, reader_for};
use crate::model_files::{MatrixLocation, ModelFiles, StressStiffnessSource};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::Compression;
use flexbody_model::{Damping, DofLabel};
use std::path::PathBuf;

/// Labels of the rows in the file of a matrix.
pub(super) struct LabelsOfFile {
    role: MatrixRole,
    path: PathBuf,
    pub labels: Vec<DofLabel>,
}

impl LabelsOfFile {
    /// Returns the labels if the file of a matrix can be read and names its rows.
    pub(super) fn of(location: &MatrixLocation, role: MatrixRole, opened: &OpenFiles) -> Option<Self> {
        let file = opened.unread(&location.path).ok()?;
        let compression = Compression::of(file.bytes());
        let group = location.group.as_deref();
        let source = MatrixSource { file, compression, group, role, keep_in: None };
        let labels = reader_for(file, compression).ok()?.labels(&source).ok()??;
        Some(Self { role, path: location.path.clone(), labels })
    }

    /// Returns the labels of all files of matrices beside the stiffness that name their rows: M of tables, damping,
    /// geometric stiffness.
    pub(super) fn of_others(files: &ModelFiles, opened: &OpenFiles) -> Vec<Self> {
        let mass = files.tables().map(|tables| (MatrixRole::Mass, &tables.mass));
        let damping = files.damping.as_ref().and_then(Damping::matrix);
        let damping = damping.map(|location| (MatrixRole::Damping, location));
        // Rows of CalculiX have their labels in a file beside the matrix.
        let is_unlabelled =
            |one: &&StressStiffnessSource| one.with_stress.as_ref().is_none_or(|with| with.dofs.is_none());
        let of_stress =
            files.geometric_stiffness.iter().map(|stiffness| &stiffness.matrix).filter(is_unlabelled);
        let of_stress = of_stress.map(|one| (MatrixRole::GeometricStiffness, &one.location));
        let all = mass.into_iter().chain(damping).chain(of_stress);
        all.filter_map(|(role, location)| Self::of(location, role, opened)).collect()
    }

    /// Returns an error if the file does not name all `rows` of the model of a job, in their order. Between them it may name
    /// rows that the job eliminates.
    pub(super) fn misfit_of_job(&self, rows: &[DofLabel]) -> Option<Diagnostic> {
        let mut named = self.labels.iter();
        let missing = rows.iter().find(|&row| !named.any(|one| one == row))?;
        let message = format!(
            "the file of the {} matrix does not name the row of {missing} where the rows of the job have it",
            self.role.name()
        );
        let help = "write the matrix by the rows of K and M of the job, in their order";
        Some(Diagnostic::new(Code::DofCount, message).in_file(&self.path).with_help(help))
    }

    /// Returns an error if the model has other `rows`.
    pub(super) fn misfit(&self, rows: &[DofLabel]) -> Option<Diagnostic> {
        let row = self.labels.iter().zip(rows).position(|(named, row)| named != row)?;
        let message = format!(
            "row {} of the {} matrix is that of {} in its file, and that of {} in the model",
            row + 1,
            self.role.name(),
            self.labels[row],
            rows[row]
        );
        let help = "give matrices with the same rows, without a table of rows: the files name them";
        Some(Diagnostic::new(Code::DofCount, message).in_file(&self.path).with_help(help))
    }
}
