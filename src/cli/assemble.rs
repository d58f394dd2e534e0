//! Command `flexbody assemble`: a conversion with modes that a cluster has found.

use super::arguments::{AssembleArguments, JobArguments};
use super::cluster_folder::folder_around;
use super::conversion_request::lumping_schemes;
use super::convert::ConversionRun;
use super::mode_source::ModeSource;
use super::models::of_manifest_or_job;
use super::outcome::Outcome;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::basis::{BasisChoice, ModeSettings};
use flexbody_body::convert::{MeshChoice, StressLoads};
use flexbody_cluster::{Prepared, read_found, read_prepared};
use flexbody_input::{LoadSource, ModelFiles};
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_study::conversion::ConversionRequest;
use std::path::Path;

pub(super) fn run(arguments: &AssembleArguments) -> Result<Outcome> {
    let prepared = read_prepared(&arguments.folder)?;
    let conversion = conversion(arguments, &prepared)?;
    conversion.run(&Cluster { folder: &arguments.folder, prepared: &prepared, prove: arguments.prove })
}

/// Cluster that has found modes in a folder, as their source.
struct Cluster<'a> {
    folder: &'a Path,
    prepared: &'a Prepared,
    /// True if the built-in count is made in addition to that of the cluster.
    prove: bool,
}

impl ModeSource for Cluster<'_> {
    /// Refuses nothing: [`conversion`] requests what the modes serve.
    fn refuse(&self, _: &ConversionRequest, _: &[LoadSource], _: bool, _: bool) -> Result<()> {
        Ok(())
    }

    fn modes(&self, model: &FeModel, _: &ModeSettings, context: &Context<'_>) -> Result<Option<BasisChoice>> {
        context.phase("modes of the cluster");
        let found = read_found(self.folder, self.prepared, model, self.prove)?;
        Ok(Some(BasisChoice::Solved(found.modes)))
    }
}

/// Returns the conversion of the model that was prepared.
fn conversion(arguments: &AssembleArguments, prepared: &Prepared) -> Result<ConversionRun> {
    let stated = &prepared.model;
    let model = arguments.model.clone().or_else(|| stated.path.clone()).ok_or_else(|| {
        Diagnostic::new(Code::Usage, "the folder does not state the path of its model")
            .with_help("give the path with --model")
    })?;
    let job = JobArguments {
        matrices: stated.matrices.clone(),
        dimension: stated.dimension,
        format: stated.format.clone(),
        units: stated.units.clone(),
        interface: stated.interfaces.clone(),
        damping: stated.damping.clone(),
    };
    let mut files = of_manifest_or_job(&model, &job)?;
    files.allow_implausible = files.allow_implausible.and(stated.allow_implausible.accepted());
    files.keep_soft_rotations |= stated.keep_soft_rotations;
    let hertz = |lambda: f64| lambda.sqrt() / std::f64::consts::TAU * prepared.hertz;
    let request = ConversionRequest {
        modes: arguments.modes.map(u64::from).or(prepared.wanted.modes).map(|modes| modes as usize),
        max_frequency: prepared.wanted.below.filter(|_| arguments.modes.is_none()).map(hertz),
        residual_vectors: Some(Vec::new()),
        // The command has no option for it.
        stress_stiffness: Some(StressLoads::default()),
        accuracy: prepared.accuracy(),
        storage: arguments.storage,
        frame: arguments.frame.clone().unwrap_or_default(),
        mesh: if arguments.no_mesh { MeshChoice::Without } else { MeshChoice::Whole },
        ..ConversionRequest::default()
    };
    Ok(ConversionRun {
        request,
        schemes: lumping_schemes(&arguments.lumped)?,
        files: ModelFiles { keep_in: Some(folder_around(&arguments.output)), ..files },
        cases: None,
        also_read: Vec::new(),
        output: arguments.output.clone(),
        reports: arguments.report.clone(),
        split: false,
        memory_limit: arguments.memory_limit,
        allow_long: true,
        verbose: arguments.verbose,
        printing: arguments.printing,
    })
}
