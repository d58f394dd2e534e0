//! Modes that SLEPc over MPI finds in this run: `flexbody convert --engine slepc`.

use super::arguments::{ConvertArguments, EngineName};
use super::cluster_folder::in_made_folder;
use super::mode_source::ModeSource;
use flexbody_base::error::Result;
use flexbody_body::basis::{BasisChoice, BasisKind, ModeSettings};
use flexbody_cluster::{Engine, ModelReference, PrepareSettings, prepare, read_found};
use flexbody_eigen::Accuracy;
use flexbody_input::LoadSource;
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_study::conversion::{ConversionRequest, refuse_contradiction};
use std::path::PathBuf;

/// SLEPc over MPI as the source of modes, in a folder that is removed afterwards unless the user named it.
pub(super) struct Slepc {
    engine: Engine,
    folder: PathBuf,
    kept: bool,
}

impl Slepc {
    /// Returns the engine that the command line requests; `None` for the built-in one.
    pub(super) fn of(arguments: &ConvertArguments) -> Option<Self> {
        let asked = &arguments.engine;
        if asked.engine == EngineName::BuiltIn {
            return None;
        }
        let variable = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
        let mpiexec = asked.mpiexec.clone().or_else(|| variable("FLEXBODY_MPIEXEC"));
        let named = asked.python.as_ref().map(|python| python.display().to_string());
        let mut beside = arguments.output.clone().into_os_string();
        beside.push(".cluster");
        Some(Self {
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
        })
    }

    /// Removes the folder after the work, unless the user named it.
    pub(super) fn tidy(&self) {
        if !self.kept {
            // A folder that remains does no harm.
            let _ = std::fs::remove_dir_all(&self.folder);
        }
    }
}

impl ModeSource for Slepc {
    fn refuse(
        &self,
        request: &ConversionRequest,
        loads: &[LoadSource],
        has_scene: bool,
        is_split: bool,
    ) -> Result<()> {
        refuse_contradiction(&[
            (request.basis != BasisKind::Free, "--engine slepc finds free modes: it needs --basis free"),
            (!loads.is_empty(), "residual vectors need the factor of --engine built-in"),
            (has_scene, "--scene needs --engine built-in"),
            (is_split, "--engine slepc converts a single body: leave --split out"),
            (request.accuracy == Accuracy::Certified, "--accuracy certified needs --engine built-in"),
        ])
    }

    fn modes(
        &self,
        model: &FeModel,
        settings: &ModeSettings,
        context: &Context<'_>,
    ) -> Result<Option<BasisChoice>> {
        let python = self.engine.check()?;
        context.phase("preparing");
        let asked = PrepareSettings {
            wanted: settings.wanted,
            accuracy: settings.accuracy,
            index_bytes: 4,
            model: ModelReference::default(),
        };
        let prepared = in_made_folder(&self.folder, || prepare(model, &asked, &self.folder)?.keep())?;
        context.phase("SLEPc");
        self.engine.run(&python, &self.folder)?;
        let found = read_found(&self.folder, &prepared, model, false)?;
        Ok(Some(BasisChoice::Solved(found.modes)))
    }
}
