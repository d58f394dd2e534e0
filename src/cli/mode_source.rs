//! Modes that are found outside this program: by SLEPc over MPI in this run, or by a cluster in advance.

use super::arguments::{ConvertArguments, EngineName};
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::{Error, Result};
use flexbody_base::output::code_of;
use flexbody_body::basis::{BasisChoice, ModeSettings};
use flexbody_cluster::{Engine, ModelReference, PrepareSettings, Prepared, prepare, read_found};
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use std::path::{Path, PathBuf};

/// Source of the modes of a conversion.
pub(super) enum ModeSource {
    /// This program.
    Nowhere,
    /// SLEPc over MPI, in a folder that is removed afterwards unless the user named it.
    Slepc { engine: Engine, folder: PathBuf, kept: bool },
    /// A cluster that has worked in this folder. `prove` requests the built-in count in addition to that of the
    /// cluster.
    Cluster { folder: PathBuf, prepared: Box<Prepared>, prove: bool },
}

impl ModeSource {
    /// Returns the source that the command line requests.
    pub(super) fn of(arguments: &ConvertArguments) -> Self {
        let asked = &arguments.engine;
        if asked.engine == EngineName::BuiltIn {
            return Self::Nowhere;
        }
        let variable = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
        let mpiexec = asked.mpiexec.clone().or_else(|| variable("FLEXBODY_MPIEXEC"));
        let named = asked.python.as_ref().map(|python| python.display().to_string());
        let mut beside = arguments.output.clone().into_os_string();
        beside.push(".cluster");
        Self::Slepc {
            engine: Engine {
                mpiexec: mpiexec.map_or_else(
                    || vec!["mpiexec".to_owned()],
                    |words| words.split_whitespace().map(str::to_owned).collect(),
                ),
                python: named.or_else(|| variable("FLEXBODY_PYTHON")),
                ranks: asked.ranks,
                solver: asked.solver,
            },
            folder: asked.cluster_folder.clone().unwrap_or_else(|| beside.into()),
            kept: asked.cluster_folder.is_some(),
        }
    }

    /// Returns the folder in which matrices may be kept instead of in memory: beside the output, for bodies that are
    /// solved elsewhere because of their size.
    pub(super) fn keeps_in(&self, output: &Path) -> Option<PathBuf> {
        (!matches!(self, Self::Nowhere)).then(|| folder_around(output))
    }

    /// Returns the modes of `model`; `None` if this program must find them.
    pub(super) fn modes(
        &self,
        model: &FeModel,
        settings: &ModeSettings,
        context: &Context<'_>,
    ) -> Result<Option<BasisChoice>> {
        let found = match self {
            Self::Nowhere => return Ok(None),
            Self::Cluster { folder, prepared, prove } => {
                context.phase("modes of the cluster");
                read_found(folder, prepared, model, *prove)?
            }
            Self::Slepc { engine, folder, .. } => {
                let python = engine.check()?;
                context.phase("preparing");
                let asked = PrepareSettings {
                    wanted: settings.wanted,
                    accuracy: settings.accuracy,
                    index_bytes: 4,
                    model: ModelReference::default(),
                };
                let prepared = in_made_folder(folder, || prepare(model, &asked, folder)?.keep())?;
                context.phase("SLEPc");
                engine.run(&python, folder)?;
                read_found(folder, &prepared, model, false)?
            }
        };
        Ok(Some(BasisChoice::Solved(found.modes)))
    }

    /// Removes the folder after the work, unless the user named it.
    pub(super) fn tidy(&self) {
        if let Self::Slepc { folder, kept: false, .. } = self {
            // A folder that remains does no harm.
            let _ = std::fs::remove_dir_all(folder);
        }
    }
}

/// Returns the path itself if it is a folder, else its first existing parent folder.
pub(super) fn folder_around(path: &Path) -> PathBuf {
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    whole.ancestors().find(|folder| folder.is_dir()).unwrap_or(Path::new(".")).to_owned()
}

/// Runs work in a folder, which is created if it does not exist, and removed if the work fails.
pub(super) fn in_made_folder<T>(folder: &Path, work: impl FnOnce() -> Result<T>) -> Result<T> {
    let is_new = !folder.exists();
    std::fs::create_dir_all(folder).map_err(|e| {
        let message = format!("cannot make the folder {}: {e}", folder.display());
        Error::from(Diagnostic::new(code_of(&e), message))
    })?;
    let done = work();
    if done.is_err() && is_new {
        // Remove the folder only if it is empty: other content does not belong to this run.
        let _ = std::fs::remove_dir(folder);
    }
    done
}
