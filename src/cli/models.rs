//! Models that are given by their manifest or by the job of an FE program.

use super::arguments::JobArguments;
use super::outcome::{refuse_replacing, refuse_replacing_read};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_input::{
    InterfaceNodes, InterfaceSource, ModelFiles, ModelSource, is_job, read_manifest, read_model,
};
use flexbody_model::{CheckedModel, Coupling, FeModel, Reference};
use flexbody_study::recipe::Origin;
use std::path::{Path, PathBuf};

/// Returns true if `path`, of a model or of a flex-body file, is that of a model.
///
/// # Errors
/// FB801 for a flex-body file with options of a job.
pub(super) fn is_model(path: &Path, job: &JobArguments) -> Result<bool> {
    if is_manifest(path) || job.format.is_some() || is_job(path) {
        return Ok(true);
    }
    match job.first() {
        Some(option) => {
            let message = format!(
                "{option} applies to the jobs of FE programs, and {} is not a known job",
                path.display()
            );
            Err(Diagnostic::new(Code::Usage, message)
                .with_help("a flex-body file states its own units and interfaces")
                .into())
        }
        None => Ok(false),
    }
}

/// Returns the files of a model that is given by its manifest or by the job of an FE program.
///
/// # Errors
/// The errors of [`read_manifest`]; FB801 for options that the manifest states itself, or that are invalid.
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

/// Reads and checks a model. Refuses `outputs` that would replace one of its files.
pub(super) fn read_checked<'p>(
    path: &Path,
    job: &JobArguments,
    outputs: impl Iterator<Item = &'p PathBuf> + Clone,
) -> Result<(ModelFiles, CheckedModel)> {
    let files = of_manifest_or_job(path, job)?;
    refuse_replacing(files.paths().iter(), outputs.clone())?;
    let raw = read_model(&files)?;
    refuse_replacing_read(outputs)?;
    Ok((files, FeModel::from_raw(raw)?))
}

/// Returns the inputs of a study as the command line named them.
pub(super) fn origin(path: &Path, job: &JobArguments, scene: &Path, case: &Option<String>) -> Origin {
    let input = std::iter::once(path.display().to_string()).chain(job.words()).collect();
    Origin { input, scene: scene.display().to_string(), case: case.clone() }
}

impl JobArguments {
    /// Returns the given options as words of a command line.
    pub(super) fn words(&self) -> Vec<String> {
        let dimension = self.dimension.map(|dimension| dimension.to_string());
        let single = [
            ("--format", &self.format),
            ("--matrices", &self.matrices),
            ("--units", &self.units),
            ("--dimension", &dimension),
        ];
        let single = single.into_iter().filter_map(|(option, value)| Some((option, value.as_ref()?)));
        let interfaces = self.interface.iter().map(|interface| ("--interface", interface));
        single.chain(interfaces).flat_map(|(option, value)| [option.to_owned(), value.clone()]).collect()
    }

    /// Returns the first option that is given.
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

/// Returns true if a path is that of a manifest.
fn is_manifest(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "toml")
}

/// Refuses options that a manifest states itself.
fn refuse_for_manifest(job: &JobArguments) -> Result<()> {
    let message = match job {
        JobArguments { format: Some(_), .. } => {
            "--format applies to jobs; set `program` in [files] of the manifest instead"
        }
        JobArguments { matrices: Some(_), .. } => {
            "--matrices applies to jobs; set `matrices` in [files] of the manifest instead"
        }
        JobArguments { units: Some(_), .. } => {
            "--units applies to --stiffness, --from and jobs; set the units in the manifest instead"
        }
        JobArguments { dimension: Some(_), .. } => {
            "--dimension applies to --stiffness and jobs; set `dimension` in [model] of the manifest instead"
        }
        JobArguments { interface, .. } if !interface.is_empty() => {
            "--interface applies to jobs; add [[interface]] to the manifest instead"
        }
        _ => return Ok(()),
    };
    Err(Diagnostic::new(Code::Usage, message).into())
}

/// Parses the names of stiffness and mass matrix: `KGG,MGG`.
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

/// Parses the interface of `--interface`: `NAME=SET` or `SET`, then a coupling, a reference point or both, each after a
/// comma.
///
/// # Errors
/// FB801 for an unknown coupling, a point that does not have three coordinates, or an empty name.
fn interface_source(text: &str) -> Result<InterfaceSource> {
    let refused = |why: String, help: String| {
        Error::from(Diagnostic::new(Code::Usage, format!("--interface {text}: {why}")).with_help(help))
    };
    let mut names = text;
    let mut reference = Reference::Centre;
    if let Some((before, last)) = names.rsplit_once(',').filter(|(_, last)| last.contains('/')) {
        let point = point(last).ok_or_else(|| {
            let help =
                "write the point as X/Y/Z in model axes and the unit of length of the nodes".to_owned();
            refused(format!("`{last}` is not a point"), help)
        })?;
        (names, reference) = (before, Reference::Point(point));
    }
    let mut coupling = None;
    if let Some((before, last)) = names.rsplit_once(',') {
        let known = Coupling::from_name(last.trim());
        let help = || format!("use one of the couplings {}", Coupling::ALL.map(Coupling::name).join(", "));
        coupling =
            Some(known.ok_or_else(|| refused(format!("`{}` is not a coupling", last.trim()), help()))?);
        names = before;
    }
    let (name, set) = names.split_once('=').unwrap_or((names, names));
    if name.is_empty() || set.is_empty() || name.chars().any(char::is_control) {
        let message = "expected NAME=SET, NAME=SET,COUPLING or NAME=SET,COUPLING,X/Y/Z".to_owned();
        let help = "name a node set of the job, as in --interface bore=SET_BORE,rigid,0/0/12.5".to_owned();
        return Err(refused(message, help));
    }
    let nodes = InterfaceNodes::Set(set.to_owned());
    Ok(InterfaceSource { name: name.to_owned(), nodes, coupling, reference })
}

/// Parses the point `X/Y/Z`.
fn point(text: &str) -> Option<[f64; 3]> {
    let numbers: Option<Vec<f64>> = text.split('/').map(|number| number.trim().parse().ok()).collect();
    numbers?.try_into().ok()
}
