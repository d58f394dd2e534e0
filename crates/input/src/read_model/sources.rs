//! Files of a model with their roles and fingerprints.

use super::model_matrices::JobFileRead;
use super::open_files::OpenFiles;
use crate::matrices::MatrixRole;
use crate::model_files::{InterfaceNodes, ModelFiles, RecoverySource};
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::provenance::SourceFile;
use flexbody_model::Damping;
use std::path::Path;

/// Returns role and path of every file of the model, in the order of diagnostics and sources.
pub(super) fn roles(files: &ModelFiles) -> Vec<(&'static str, &Path)> {
    let mut roles: Vec<(&'static str, &Path)> = Vec::new();
    roles.extend(files.manifest.as_deref().map(|path| ("manifest", path)));
    if let Some(tables) = files.tables() {
        roles.push((MatrixRole::Stiffness.name(), &tables.stiffness.path));
        roles.push((MatrixRole::Mass.name(), &tables.mass.path));
        roles.push(("nodes", &tables.nodes));
        roles.extend(tables.dofs.as_deref().map(|path| ("dofs", path)));
    }
    roles.extend(files.mesh.as_deref().map(|path| ("mesh", path)));
    roles.extend(files.elements.iter().map(|elements| ("elements", elements.path.as_path())));
    let damping = files.damping.as_ref().and_then(Damping::matrix);
    roles.extend(damping.map(|place| (MatrixRole::Damping.name(), place.path.as_path())));
    let geometric = files.geometric_stiffness.iter().flat_map(|stiffness| stiffness.matrix.files());
    roles.extend(geometric.map(|path| (MatrixRole::GeometricStiffness.name(), path)));
    roles.extend(files.interfaces.iter().filter_map(|interface| match &interface.nodes {
        InterfaceNodes::File(path) => Some(("interface", path.as_path())),
        _ => None,
    }));
    roles.extend(files.named_loads.iter().map(|load| ("named_load", load.vector.path.as_path())));
    roles.extend(files.recoveries.iter().flat_map(RecoverySource::files).map(|path| ("recovery", path)));
    roles
}

/// Returns every file with its fingerprint: the manifest, the files of a job, then the others. Files that were not read
/// completely are read one after the other: a thread that waits for [`Sources`] must not get other work from the pool,
/// which may request the same.
///
/// # Errors
/// FB101 for files that cannot be read, FB132 for files that changed.
pub(super) fn sources(
    files: &ModelFiles,
    job: &[JobFileRead],
    opened: &OpenFiles,
) -> Result<Vec<SourceFile>, Diagnostic> {
    let mut of_tables = Vec::new();
    for (role, path) in roles(files) {
        if let Ok(file) = opened.unread(path) {
            let sha256 = file.sha256()?;
            // The manifest was parsed before the other files were opened.
            if role == "manifest" && files.manifest_sha256.as_ref().is_some_and(|parsed| *parsed != sha256) {
                return Err(file.changed("its text is another one"));
            }
            of_tables.push(SourceFile::new(role, path, sha256));
        }
    }
    let of_job = job.iter().map(|(role, file)| SourceFile::new(role, &file.path, file.sha256.clone()));
    let (manifest, others): (Vec<_>, Vec<_>) =
        of_tables.into_iter().partition(|source| source.role == "manifest");
    Ok(manifest.into_iter().chain(of_job).chain(others).collect())
}
