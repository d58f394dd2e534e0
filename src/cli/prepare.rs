//! Command `flexbody prepare`.

use super::arguments::PrepareArguments;
use super::cluster_folder::{folder_around, in_made_folder};
use super::models::of_manifest_or_job;
use super::outcome::{Outcome, refuse_warnings};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::basis::ModeSettings;
use flexbody_cluster::{ModelReference, PrepareSettings, Prepared, prepare};
use flexbody_eigen::{Accuracy, Wanted};
use flexbody_input::read_model;
use flexbody_model::{CheckedModel, FeModel};

pub(super) fn run(arguments: &PrepareArguments) -> Result<Outcome> {
    if arguments.accuracy == Accuracy::Certified {
        return Err(usage("modes of a cluster cannot be certified: use --accuracy standard"));
    }
    let mut files = of_manifest_or_job(&arguments.model, &arguments.job)?;
    let accepted = arguments.allow_implausible.unwrap_or_default();
    files.allow_implausible = files.allow_implausible.and(accepted);
    files.keep_soft_rotations |= arguments.keep_soft_rotations;
    files.keep_in = Some(folder_around(&arguments.output));
    if !files.residual_vectors.is_empty() {
        return Err(usage(
            "the manifest requests residual vectors, which need the built-in solver: remove them from [basis]",
        ));
    }
    let CheckedModel { model, diagnostics, .. } = FeModel::from_raw(read_model(&files)?)?;
    refuse_warnings(arguments.printing, &diagnostics)?;
    let wanted = match arguments.max_frequency {
        Some(hertz) => Wanted::Below(model.units().eigenvalue_of(hertz)),
        None => Wanted::Lowest(arguments.modes.map_or(ModeSettings::DEFAULT_COUNT, |modes| modes as usize)),
    };
    let path = std::path::absolute(&arguments.model).unwrap_or_else(|_| arguments.model.clone());
    let settings = PrepareSettings {
        wanted,
        accuracy: arguments.accuracy,
        index_bytes: if arguments.indices == "64" { 8 } else { 4 },
        model: ModelReference {
            path: Some(path),
            format: arguments.job.format.clone(),
            units: arguments.job.units.clone(),
            matrices: arguments.job.matrices.clone(),
            dimension: arguments.job.dimension,
            interfaces: arguments.job.interface.clone(),
            damping: arguments.job.damping.clone(),
            allow_implausible: accepted.codes().into(),
            keep_soft_rotations: arguments.keep_soft_rotations,
        },
    };
    let (prepared, bytes) = in_made_folder(&arguments.output, || {
        let preparation = prepare(&model, &settings, &arguments.output)?;
        let bytes = preparation.bytes;
        Ok((preparation.commit()?, bytes))
    })?;
    let text = text(arguments, &prepared, bytes);
    let json = serde_json::json!({ "folder": arguments.output.display().to_string(), "bytes": bytes, "prepared": prepared });
    Ok(Outcome { text, json: json.to_string(), diagnostics, passed: true })
}

fn usage(message: &str) -> flexbody_base::error::Error {
    Diagnostic::new(Code::Usage, message).into()
}

fn text(arguments: &PrepareArguments, prepared: &Prepared, bytes: u64) -> String {
    let folder = arguments.output.display();
    let wanted = match arguments.max_frequency {
        Some(hertz) => format!("all flexible modes up to {hertz} Hz"),
        None => format!("{} flexible modes", prepared.wanted.modes.unwrap_or(0)),
    };
    let lines = [
        ("folder", format!("{folder}, {:.3} GB", bytes as f64 * 1e-9)),
        ("model", format!("{}, {} rows", prepared.name, prepared.rows)),
        ("entries", format!("{} of K, {} of M", prepared.entries[0], prepared.entries[1])),
        ("wanted", wanted),
        ("next", format!("mpiexec -n N python3 {folder}/driver.py {folder}")),
        ("then", format!("flexbody assemble {folder} -o BODY.flex.h5")),
    ];
    lines.iter().map(|(label, text)| format!("{label:10}{text}\n")).collect()
}
