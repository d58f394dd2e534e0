//! Reads all files of a model and collects all their problems.

mod described;
mod diagnostics;
mod interfaces;
mod labels_of_file;
mod mapping;
mod matrix;
mod model_matrices;
mod open_files;
mod parsed;
mod recoveries;
mod recovery_files;
mod rows_of_model;
mod sources;
mod with_stress;

use super::mesh::MeshReading;
use super::model_files::{ModelFiles, ModelSource, NamedLoadSource};
use super::node_file::NodeFile;
use described::{DescribedFiles, described_of_files};
use diagnostics::{collect, take};
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic, Severity};
use flexbody_base::error::{Error, Result};
use flexbody_base::provenance::Sources;
use flexbody_base::text::quotes::without_foreign_quotes;
use flexbody_model::{
    GeometricStiffness, GivenRows, ModelData, ModelLoad, NodeSet, RawMatrix, RawModel, SurfaceMesh, UnitLoad,
};
use interfaces::NodeLookup;
use labels_of_file::LabelsOfFile;
use model_matrices::{JobFileRead, ModelMatrices};
use open_files::OpenFiles;
use parsed::{Matrices, Parsed};
use recoveries::{nodal_stresses, recoveries};
use recovery_files::read_forces;
use rows_of_model::by_rows_of_model;
use sources::{roles, sources};
use std::sync::Arc;
use with_stress::{StressMatrix, difference_note};

pub use interfaces::interface_in_memory;
pub use matrix::read_matrix;

/// Number of significant digits below which a matrix gets a warning.
const FEW_DIGITS: u8 = 10;

/// Reads all files of a model and computes their fingerprints. The model is parsed, not checked: sizes, symmetry and
/// mechanics are checked by [`flexbody_model`].
///
/// # Errors
/// Every diagnostic of every file, in the order manifest, stiffness, mass, nodes, dofs, damping, geometric stiffness,
/// interfaces, mesh; FB132 for files that changed during reading, in place of other errors.
pub fn read_model(files: &ModelFiles) -> Result<RawModel> {
    let mut opened = OpenFiles::new(roles(files).into_iter().map(|(_, path)| path));
    let read = read_opened_files(files, &opened);
    opened.refuse_changed()?;
    let (model, of_job) = read.map_err(|error| without_outside_quotes(files, error))?;
    of_job.iter().try_for_each(|(_, file)| file.refuse_changed())?;
    opened.forget_bytes();
    let given = files.clone();
    let sources = Sources::later(move || sources(&given, &of_job, &opened));
    Ok(model.with(|data| data.sources = sources))
}

/// Returns errors for files that name other rows than those of the model.
fn misfits(named: &[LabelsOfFile], matrices: &ModelMatrices, files: &ModelFiles) -> Vec<Diagnostic> {
    let rows = matrices.plain(files.dimension).labels;
    let misfit = |one: &LabelsOfFile| match files.source {
        ModelSource::Job(_) => one.misfit_of_job(&rows),
        ModelSource::Tables(_) => one.misfit(&rows),
    };
    named.iter().filter_map(misfit).collect()
}

/// Returns the error without quotes from files that the manifest or the deck names outside the model.
fn without_outside_quotes(files: &ModelFiles, error: Error) -> Error {
    let main = match (&files.manifest, &files.source) {
        (Some(manifest), _) => manifest,
        (None, ModelSource::Job(job)) => &job.path,
        (None, ModelSource::Tables(_)) => return error,
    };
    let diagnostics = error.into_diagnostics().into_iter();
    Error::new(diagnostics.map(|diagnostic| without_foreign_quotes(diagnostic, main)).collect())
}

/// Reads the files of a model, and the files of its job.
fn read_opened_files(files: &ModelFiles, opened: &OpenFiles) -> Result<(RawModel, Vec<JobFileRead>)> {
    let parsed = Parsed::of(files, opened);
    let mut diagnostics = Vec::new();
    if let Some(path) = &files.manifest {
        opened.get(path).map(|_| ()).unwrap_or_else(|found| collect(&mut diagnostics, found));
    }
    let matrices = match parsed.matrices {
        Matrices::Tables(tables) => tables.taken(files, &mut diagnostics),
        Matrices::Job(job) => take(&mut diagnostics, *job),
    };
    diagnostics.extend(matrices.iter().flat_map(|matrices| misfits(&parsed.labels, matrices, files)));
    // Damping and geometric stiffness follow K and M to the rows of the model.
    let no_rows = GivenRows::default();
    let rows = matrices.as_ref().map_or(&no_rows, |matrices| &matrices.given_rows);
    let damping = parsed.damping.and_then(|damping| {
        let damping = take(&mut diagnostics, damping)?;
        take(&mut diagnostics, damping.try_map(|raw| by_rows_of_model(raw, rows)))
    });
    let (geometric_stiffness, differences) =
        of_stress(parsed.geometric_stiffness, matrices.as_ref(), files.dimension, &mut diagnostics);
    // Interfaces and surface refer to the nodes.
    let places = NodeLookup::of(matrices.as_ref(), files.dimension);
    let interfaces: Vec<NodeSet> = files
        .interfaces
        .iter()
        .filter_map(|interface| take(&mut diagnostics, places.interface(interface, opened, files)))
        .collect();
    let recoveries = recoveries(&places, opened, files, &mut diagnostics);
    let nodal_stresses = nodal_stresses(&places, opened, files, &mut diagnostics);
    let named_loads = read_loads(opened, files, &mut diagnostics);
    let mesh = surface(parsed.mesh, matrices.as_ref(), files, &mut diagnostics);
    diagnostics.extend(matrices.as_ref().and_then(|matrices| few_digits(&matrices.stiffness)));
    let described = matrices.as_ref().filter(|_| !files.elements.is_empty()).and_then(|matrices| {
        let labels = matrices.plain(files.dimension).labels;
        take(&mut diagnostics, described_of_files(&files.elements, opened, &labels))
    });
    // Errors end here, with all diagnostics that were found.
    let (Some(matrices), false) = (matrices, diagnostics.iter().any(|d| d.severity() == Severity::Error))
    else {
        return Err(Error::new(diagnostics));
    };
    diagnostics.extend(matrices.diagnostics);
    diagnostics.extend(difference_note(&differences));
    let (mesh, partly) = mesh.unwrap_or_default();
    diagnostics.extend(partly);
    let DescribedFiles { elements, files: more_files } = described.unwrap_or_default();
    let data = ModelData {
        description: files.description.clone(),
        interfaces,
        mesh,
        damping,
        geometric_stiffness,
        recoveries,
        nodal_stresses,
        named_loads,
        elements: elements.or(matrices.described).map(Arc::new),
        sources: Sources::default(),
    };
    let model = RawModel {
        data,
        dimension: files.dimension,
        stiffness: matrices.stiffness,
        mass: matrices.mass,
        nodes: matrices.nodes,
        nodes_path: matrices.nodes_path,
        dofs: matrices.dofs,
        dofs_path: matrices.dofs_path,
        given_rows: matrices.given_rows,
        followers: matrices.followers,
        allow_implausible: files.allow_implausible,
        keep_soft_rotations: files.keep_soft_rotations,
        diagnostics,
    };
    Ok((model, matrices.files.into_iter().chain(more_files).collect()))
}

/// Returns the surface of the model with the notes about it; adds errors.
fn surface(
    mesh: Option<Diagnosed<NodeFile>>,
    matrices: Option<&ModelMatrices>,
    files: &ModelFiles,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<(Option<SurfaceMesh>, Vec<Diagnostic>)> {
    let mesh_file = mesh.and_then(|mesh| take(diagnostics, mesh));
    let ModelMatrices { nodes, elements, nodes_path, .. } = matrices?;
    let from = mesh_file.as_ref().zip(files.mesh.as_deref());
    take(diagnostics, MeshReading { nodes, elements, path: nodes_path }.mesh(from))
}

/// Returns the geometric stiffness of every load that could be read; adds errors. Also returns the number of digits that
/// are left of each that is a difference of matrices, with its load.
fn of_stress(
    read: Vec<Diagnosed<GeometricStiffness<StressMatrix>>>,
    matrices: Option<&ModelMatrices>,
    dimension: u8,
    diagnostics: &mut Vec<Diagnostic>,
) -> (Vec<GeometricStiffness<RawMatrix>>, Vec<(f64, UnitLoad)>) {
    let (mut geometric_stiffness, mut differences) = (Vec::new(), Vec::new());
    for one in read {
        let (Some(one), Some(matrices)) = (take(diagnostics, one), matrices) else { continue };
        let GeometricStiffness { load, matrix } = one;
        let found = matrix.of_stress(matrices.plain(dimension), &matrices.given_rows);
        let Some(found) = take(diagnostics, found) else { continue };
        differences.extend(found.digits_left.map(|digits| (digits, load.clone())));
        geometric_stiffness.push(GeometricStiffness { load, matrix: found.matrix });
    }
    (geometric_stiffness, differences)
}

/// Returns the named loads of the model, by the rows of their files; adds errors.
fn read_loads(opened: &OpenFiles, files: &ModelFiles, diagnostics: &mut Vec<Diagnostic>) -> Vec<ModelLoad> {
    let read = |load: &NamedLoadSource| {
        let forces = read_forces(opened.get(&load.vector.path)?, load.vector.group.as_deref())?;
        let path = load.vector.path.clone();
        Ok(ModelLoad { name: load.name.clone(), forces, preload: load.preload, path })
    };
    files.named_loads.iter().filter_map(|load| take(diagnostics, read(load))).collect()
}

/// Returns a warning if the stiffness matrix has few digits. Its digits decide how well rigid motion and bending can be
/// distinguished. Those of the mass matrix enter results unchanged, and exact short numbers are common there.
fn few_digits(stiffness: &RawMatrix) -> Option<Diagnostic> {
    (stiffness.digits < FEW_DIGITS).then(|| {
        let message =
            format!("values of the stiffness matrix carry only {} significant digits", stiffness.digits);
        Diagnostic::new(Code::MatrixDigits, message).in_file(&stiffness.path)
    })
}
