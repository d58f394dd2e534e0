//! Command `flexbody assemble`: a conversion with modes that a cluster has found.

use super::arguments::{AssembleArguments, ConvertArguments, EngineArguments, JobArguments, StatedArguments};
use super::convert::run_with;
use super::mode_source::ModeSource;
use super::outcome::Outcome;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::basis::BasisKind;
use flexbody_cluster::{Prepared, read_prepared};
use flexbody_eigen::FactorChoice;

pub(super) fn run(arguments: &AssembleArguments) -> Result<Outcome> {
    let prepared = read_prepared(&arguments.folder)?;
    let converted = as_conversion(arguments, &prepared)?;
    let (folder, prove) = (arguments.folder.clone(), arguments.prove);
    run_with(&converted, &ModeSource::Cluster { folder, prepared: Box::new(prepared), prove })
}

/// Returns the corresponding arguments of `convert`.
fn as_conversion(arguments: &AssembleArguments, prepared: &Prepared) -> Result<ConvertArguments> {
    let model = arguments.model.clone().or_else(|| prepared.model.path.clone()).ok_or_else(|| {
        Diagnostic::new(Code::Usage, "the folder does not state the path of its model")
            .with_help("give the path with --model")
    })?;
    let hertz = |lambda: f64| lambda.sqrt() / std::f64::consts::TAU * prepared.hertz;
    let modes = prepared.wanted.modes.and_then(|count| u32::try_from(count).ok());
    Ok(ConvertArguments {
        model: Some(model),
        from: None,
        job: JobArguments {
            matrices: prepared.model.matrices.clone(),
            dimension: prepared.model.dimension,
            format: prepared.model.format.clone(),
            units: prepared.model.units.clone(),
            interface: prepared.model.interfaces.clone(),
            damping: prepared.model.damping.clone(),
        },
        stiffness: None,
        mass: None,
        nodes: None,
        dofs: None,
        allow_implausible: prepared.model.allow_implausible,
        keep_soft_rotations: prepared.model.keep_soft_rotations,
        output: arguments.output.clone(),
        modes: arguments.modes.or(modes),
        max_frequency: prepared.wanted.below.filter(|_| arguments.modes.is_none()).map(hertz),
        basis: BasisKind::Free,
        shapes: None,
        residual_vectors: Some(String::new()),
        accuracy: prepared.accuracy(),
        factor: FactorChoice::Auto,
        storage: arguments.storage,
        memory_limit: arguments.memory_limit,
        allow_long: true,
        frame: arguments.frame.clone(),
        lumped: arguments.lumped.clone(),
        lumped_modes: false,
        mesh_triangles: None,
        no_mesh: arguments.no_mesh,
        scene: None,
        case: None,
        allow_unjudged: false,
        like: None,
        stated: StatedArguments::default(),
        report: arguments.report.clone(),
        split: false,
        engine: EngineArguments::default(),
        threads: arguments.threads,
        verbose: arguments.verbose,
        printing: arguments.printing,
    })
}
