//! Models that are given by their manifest or by the job of an FE program.

use super::arguments::JobArguments;
use super::outcome::{refuse_replacing, refuse_replacing_read};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_input::{
    InterfaceSource, ModelFiles, ModelSource, is_job, parse_damping, read_manifest, read_model,
};
use flexbody_model::{CheckedModel, FeModel};
use flexbody_study::recipe::Origin;
use std::collections::HashSet;
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
    let mut files = ModelFiles::from_job(path, job.format.clone(), Vec::new(), job.units.as_deref())?;
    if let ModelSource::Job(own) = &mut files.source {
        own.matrices = job.matrices.as_deref().map(matrix_names).transpose()?;
    }
    job.state_in(files)
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
    /// Returns the files of a model without a manifest with the dimension, interfaces and damping that the command line
    /// states.
    ///
    /// # Errors
    /// FB801 for an invalid interface or damping, and for two interfaces of one name.
    pub(super) fn state_in(&self, mut files: ModelFiles) -> Result<ModelFiles> {
        files.dimension = self.dimension.unwrap_or(files.dimension);
        let parsed = self.interface.iter().map(|text| InterfaceSource::parse(text, files.dimension));
        files.interfaces = parsed.collect::<Result<Vec<_>>>()?;
        let mut names = HashSet::new();
        if let Some(twice) = files.interfaces.iter().find(|interface| !names.insert(&interface.name)) {
            let message = format!("interface `{}` is given twice", twice.name);
            let help = "give each --interface a name of its own, as in bore=SET_BORE";
            return Err(Diagnostic::new(Code::Usage, message).with_help(help).into());
        }
        files.damping = self.damping.as_deref().map(parse_damping).transpose()?;
        Ok(files)
    }

    /// Returns the given options as words of a command line.
    pub(super) fn words(&self) -> Vec<String> {
        let dimension = self.dimension.map(|dimension| dimension.to_string());
        let single = [
            ("--format", &self.format),
            ("--matrices", &self.matrices),
            ("--units", &self.units),
            ("--dimension", &dimension),
            ("--damping", &self.damping),
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
            (self.damping.is_some(), "--damping"),
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
            "--interface applies to --stiffness and jobs; add [[interface]] to the manifest instead"
        }
        JobArguments { damping: Some(_), .. } => {
            "--damping applies to --stiffness and jobs; add [damping] to the manifest instead"
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
