//! Models that are given by their manifest or by the job of an FE program.

use super::arguments::JobArguments;
use super::places::refuse_replacing;
use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::Result;
use crate::input::{
    InterfaceNodes, InterfaceSource, ModelFiles, ModelSource, is_job, read_manifest, read_model,
};
use crate::model::{CheckedModel, Coupling, FeModel, Reference};
use std::path::{Path, PathBuf};

/// Whether `path`, of a model or of a flex-body file, is that of a model.
///
/// # Errors
/// FB801 for a flex-body file with options that say something of a job.
pub(super) fn is_model(path: &Path, job: &JobArguments) -> Result<bool> {
    if is_manifest(path) || job.format.is_some() || is_job(path) {
        return Ok(true);
    }
    match job.first() {
        Some(option) => {
            let message = format!("{option} is for jobs, and {} is no job that is read", path.display());
            Err(Diagnostic::new(Code::Usage, message)
                .with_help("a flex-body file states its own units and interfaces")
                .into())
        }
        None => Ok(false),
    }
}

/// The files of a model, told by its manifest or by the job of an FE program.
///
/// # Errors
/// Those of [`read_manifest`]; FB801 for options that the manifest says itself or that are not understood.
pub(super) fn of_manifest_or_job(path: &Path, job: &JobArguments) -> Result<ModelFiles> {
    if is_manifest(path) {
        refuse_for_manifest(job)?;
        return read_manifest(path);
    }
    let interfaces = job.interface.iter().map(|text| interface_source(text)).collect::<Result<Vec<_>>>()?;
    let mut files = ModelFiles::from_job(path, job.format.clone(), interfaces, job.units.as_deref())?;
    if let ModelSource::Job(own) = &mut files.source {
        own.matrices = job.matrices.as_deref().map(matrix_names).transpose()?;
    }
    files.dimension = job.dimension.unwrap_or(files.dimension);
    Ok(files)
}

/// The files of a model and the model that they are, checked; none of `outputs` replaces one of them.
pub(super) fn read_checked<'p>(
    path: &Path,
    job: &JobArguments,
    outputs: impl Iterator<Item = &'p PathBuf>,
) -> Result<(ModelFiles, CheckedModel)> {
    let files = of_manifest_or_job(path, job)?;
    refuse_replacing(files.paths().iter(), outputs)?;
    let checked = FeModel::from_raw(read_model(&files)?)?;
    Ok((files, checked))
}

impl JobArguments {
    /// The first option that is given.
    pub(super) fn first(&self) -> Option<&'static str> {
        let given = [
            (self.format.is_some(), "--format"),
            (self.matrices.is_some(), "--matrices"),
            (self.units.is_some(), "--units"),
            (self.dimension.is_some(), "--dimension"),
            (!self.interface.is_empty(), "--interface"),
        ];
        given.iter().find(|(given, _)| *given).map(|(_, option)| *option)
    }
}

/// Whether a path is that of a manifest.
fn is_manifest(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "toml")
}

/// Options that a manifest says itself.
fn refuse_for_manifest(job: &JobArguments) -> Result<()> {
    let message = match job {
        JobArguments { format: Some(_), .. } => "--format is for jobs: a manifest says `program` in [files]",
        JobArguments { matrices: Some(_), .. } => {
            "--matrices is for jobs: a manifest says `matrices` in [files]"
        }
        JobArguments { units: Some(_), .. } => {
            "--units are for --stiffness, --from and jobs: a manifest states its own"
        }
        JobArguments { dimension: Some(_), .. } => {
            "--dimension is for --stiffness and jobs: a manifest says `dimension` in [model]"
        }
        JobArguments { interface, .. } if !interface.is_empty() => {
            "--interface is for jobs: a manifest has [[interface]]"
        }
        _ => return Ok(()),
    };
    Err(Diagnostic::new(Code::Usage, message).into())
}

/// The names of stiffness and mass matrix: `KGG,MGG`.
fn matrix_names(text: &str) -> Result<[String; 2]> {
    let names: Vec<&str> = text.split(',').map(str::trim).filter(|name| !name.is_empty()).collect();
    match names.as_slice() {
        [k, m] => Ok([(*k).to_owned(), (*m).to_owned()]),
        _ => {
            let message = format!("--matrices {text}: expected two names, as in KGG,MGG");
            Err(Diagnostic::new(Code::Usage, message).into())
        }
    }
}

/// An interface as named on the command line: `NAME=SET`, `SET`, each with `,COUPLING`.
fn interface_source(text: &str) -> Result<InterfaceSource> {
    let (names, coupling) = match text.rsplit_once(',') {
        Some((names, coupling)) => (names, Some(coupling.trim())),
        None => (text, None),
    };
    let coupling = coupling.map(|name| {
        Coupling::ALL.into_iter().find(|coupling| coupling.name() == name).ok_or_else(|| {
            let known = Coupling::ALL.map(Coupling::name).join(", ");
            let message = format!("--interface {text}: `{name}` is no coupling");
            Diagnostic::new(Code::Usage, message).with_help(format!("couplings: {known}"))
        })
    });
    let coupling = coupling.transpose()?;
    let (name, set) = names.split_once('=').unwrap_or((names, names));
    if name.is_empty() || set.is_empty() || name.chars().any(char::is_control) {
        let message = format!("--interface {text}: expected NAME=SET, or NAME=SET,COUPLING");
        return Err(Diagnostic::new(Code::Usage, message).into());
    }
    let nodes = InterfaceNodes::Set(set.to_owned());
    Ok(InterfaceSource { name: name.to_owned(), nodes, coupling, reference: Reference::Mean })
}
