//! `flexbody convert`.

use super::arguments::{AccuracyName, ConvertArguments, FactorName, FrameName};
use super::checkpoint::{CheckpointFile, resume};
use super::output::{Outcome, tell};
use super::resources::{memory_left, peak_memory_bytes, resident_bytes};
use super::watcher::Watcher;
use crate::basis::ModeSettings;
use crate::convert::{Conversion, ConvertSettings, Lumping, convert_resumed};
use crate::diagnostic::{Code, Diagnostic};
use crate::eigen::{Accuracy, FactorChoice, Method, Precision, Snapshot, Wanted};
use crate::error::Result;
use crate::input::{InterfaceNodes, ModelFiles, read_manifest, read_model, read_nodal_masses};
use crate::invariants::BodyFrame;
use crate::model::FeModel;
use crate::output::OutputSlot;
use crate::progress::Event;
use crate::report::{Facts, Format, LumpedModes, Phase, RunData, render};
use crate::store;
use crate::units::UnitSystem;
use std::path::Path;

pub(super) fn run(arguments: &ConvertArguments) -> Result<Outcome> {
    let formats = arguments.report.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
    let schemes = lumping_schemes(&arguments.lumped)?;
    let files = model_files(arguments)?;
    refuse_overwriting(arguments, &files, &schemes)?;
    let slot = store::prepare_output(&arguments.output)?;
    let report_slots = arguments.report.iter().map(OutputSlot::prepare).collect::<Result<Vec<_>>>()?;
    let checkpoint = arguments.checkpoint.as_deref().map(CheckpointFile::open).transpose()?;
    let threads = use_threads(arguments.threads);

    let watcher = Watcher::new(arguments.printing.quiet || arguments.printing.json, "reading");
    let lumped = schemes.into_iter().map(|scheme| scheme.read()).collect::<Result<Vec<_>>>()?;
    let raw = read_model(&files)?;
    watcher.hear(Event::Phase("checks"));
    let checked = FeModel::from_raw(raw)?;
    let model = checked.model;
    let checkpoint = checkpoint.map(|file| file.for_model(&files, &model)).transpose()?;
    let settings = ConvertSettings {
        modes: ModeSettings {
            wanted: wanted(arguments, model.units()),
            accuracy: match arguments.accuracy {
                AccuracyName::Fast => Accuracy::Fast,
                AccuracyName::Standard => Accuracy::Standard,
                AccuracyName::Certified => Accuracy::Certified,
            },
            method: Method::Auto,
            factor: match arguments.factor {
                FactorName::Auto => FactorChoice::Auto,
                FactorName::F64 => FactorChoice::Always(Precision::Double),
                FactorName::F32 => FactorChoice::Always(Precision::Single),
            },
            memory: memory_left(arguments.memory_limit),
            ..ModeSettings::default()
        },
        frame: match arguments.frame {
            FrameName::Principal => BodyFrame::Principal,
            FrameName::Com => BodyFrame::Com,
            FrameName::Model => BodyFrame::Model,
        },
        lumped,
        lumped_modes: arguments.lumped_modes,
    };
    let (resident, peak) = (resident_bytes(), peak_memory_bytes());
    let save = |snapshot: &Snapshot| checkpoint.iter().for_each(|file| file.save(snapshot));
    let resume = resume(checkpoint.as_ref(), &save);
    let conversion =
        convert_resumed(&model, &settings, resume, &|event| watcher.hear(event)).inspect_err(|_| {
            watcher.clear();
            tell(arguments.printing, &checked.diagnostics);
        })?;
    watcher.hear(Event::Phase("writing"));
    store::write_to(&conversion.body, slot)?;
    let phases = watcher.finish();
    let mut diagnostics = checked.diagnostics;
    diagnostics.extend(conversion.diagnostics.iter().cloned());
    let taken_up = conversion.counters.taken_up;
    diagnostics.extend(checkpoint.into_iter().flat_map(|file| file.diagnostics(taken_up)));
    tell(arguments.printing, &diagnostics);
    let mut run = run_data(arguments, &conversion, diagnostics, phases, threads);
    // Reading may have taken more than the work will.
    run.memory_estimate_bytes = conversion.plan.map(|plan| peak.unwrap_or(0).max(resident + plan.bytes));
    let facts = Facts::new(&conversion.body, &run);
    for (slot, format) in report_slots.into_iter().zip(&formats) {
        slot.write(render(&facts, *format).as_bytes())?;
    }
    Ok(Outcome { text: render(&facts, Format::Text), json: render(&facts, Format::Json), passed: true })
}

/// A lumping scheme as named on the command line.
enum Scheme {
    Ready(Lumping),
    User(std::path::PathBuf),
}

impl Scheme {
    fn read(self) -> Result<Lumping> {
        match self {
            Self::Ready(lumping) => Ok(lumping),
            Self::User(path) => read_nodal_masses(&path).map(Lumping::User),
        }
    }
}

fn lumping_schemes(text: &str) -> Result<Vec<Scheme>> {
    let mut schemes = Vec::new();
    for name in text.split(',').map(str::trim).filter(|name| *name != "none") {
        schemes.push(match name {
            "row-sum" => Scheme::Ready(Lumping::RowSum),
            "diagonal-scaling" => Scheme::Ready(Lumping::DiagonalScaling),
            _ => match name.strip_prefix("user=") {
                Some(path) if !path.is_empty() => Scheme::User(path.into()),
                _ => {
                    let message = format!("`{name}` is not a lumping scheme");
                    return Err(Diagnostic::new(Code::LumpedScheme, message).into());
                }
            },
        });
    }
    let mut names: Vec<&str> =
        text.split(',').map(|name| name.split('=').next().unwrap_or(name).trim()).collect();
    names.sort_unstable();
    if names.windows(2).any(|pair| pair[0] == pair[1]) {
        let message = format!("a lumping scheme is named twice in `{text}`");
        return Err(Diagnostic::new(Code::LumpedScheme, message).into());
    }
    Ok(schemes)
}

fn format_of(path: &Path) -> Result<Format> {
    Format::from_path(path).ok_or_else(|| {
        let message = format!("report {} has no known extension", path.display());
        Diagnostic::new(Code::Usage, message).with_help("name it .html, .json or .txt").into()
    })
}

fn model_files(arguments: &ConvertArguments) -> Result<ModelFiles> {
    match (&arguments.model, &arguments.stiffness, &arguments.mass, &arguments.nodes) {
        (Some(manifest), ..) => read_manifest(manifest),
        (None, Some(stiffness), Some(mass), Some(nodes)) => ModelFiles::from_arguments(
            stiffness,
            mass,
            nodes,
            arguments.dofs.clone(),
            arguments.units.as_deref(),
        )
        .map(|files| ModelFiles { dimension: arguments.dimension.unwrap_or(files.dimension), ..files }),
        _ => Err(Diagnostic::new(Code::Usage, "give a manifest, or --stiffness, --mass and --nodes").into()),
    }
}

/// No output may replace an input or another output.
fn refuse_overwriting(arguments: &ConvertArguments, files: &ModelFiles, schemes: &[Scheme]) -> Result<()> {
    let matrices = [Some(&files.stiffness.path), Some(&files.mass.path)];
    let tables = [Some(&files.nodes), files.dofs.as_ref(), files.manifest.as_ref()];
    let masses = schemes.iter().map(|scheme| match scheme {
        Scheme::User(path) => Some(path),
        Scheme::Ready(_) => None,
    });
    let interfaces = files.interfaces.iter().map(|interface| match &interface.nodes {
        InterfaceNodes::File(path) => Some(path),
        InterfaceNodes::Listed(_) => None,
    });
    let inputs = matrices.into_iter().chain(tables).chain(masses).chain(interfaces);
    let place = |path: &Path| {
        std::fs::canonicalize(path)
            .unwrap_or_else(|_| std::path::absolute(path).unwrap_or_else(|_| path.into()))
    };
    let mut taken: Vec<_> = inputs.flatten().map(|path| place(path)).collect();
    for output in std::iter::once(&arguments.output).chain(&arguments.report).chain(&arguments.checkpoint) {
        let path = place(output);
        if taken.contains(&path) {
            let message = format!("output {} is an input or another output of this run", output.display());
            return Err(Diagnostic::new(Code::Usage, message).with_help("choose another output name").into());
        }
        taken.push(path);
    }
    Ok(())
}

/// Sets the number of threads for the whole process; the number in force.
fn use_threads(asked: Option<u16>) -> usize {
    if let Some(threads) = asked {
        // Fails only when a pool exists already, which then stays as it is: results are the same.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(usize::from(threads)).build_global();
    }
    rayon::current_num_threads()
}

fn wanted(arguments: &ConvertArguments, units: &UnitSystem) -> Wanted {
    match arguments.max_frequency {
        Some(hertz) => Wanted::Below(units.eigenvalue_of(hertz)),
        None => Wanted::Lowest(arguments.modes as usize),
    }
}

fn run_data(
    arguments: &ConvertArguments,
    conversion: &Conversion,
    diagnostics: Vec<Diagnostic>,
    phases: Vec<Phase>,
    threads: usize,
) -> RunData {
    let work = &conversion.counters;
    let counters = [
        ("factorizations", work.factorizations),
        ("solved_columns", work.solved_columns),
        ("stiffness_columns", work.stiffness_columns),
        ("mass_columns", work.mass_columns),
        ("restarts", work.restarts),
        ("factor_len", work.factor_len),
        ("factor_flops", work.factor_flops),
        ("factor_bytes", work.factor_bytes),
    ];
    let lumped_modes = conversion
        .lumped_modes
        .iter()
        .map(|pipeline| LumpedModes {
            scheme: pipeline.scheme.clone(),
            frequencies_hz: pipeline
                .eigenvalues
                .iter()
                .map(|&lambda| conversion.body.units().frequency_of(lambda))
                .collect(),
            subspace_cosine: pipeline.subspace_cosine,
            comparison: pipeline.comparison.clone(),
            remark: pipeline.remark.clone(),
        })
        .collect();
    let size = std::fs::metadata(&arguments.output).map(|meta| meta.len()).unwrap_or(0);
    RunData {
        phases,
        peak_memory_bytes: peak_memory_bytes(),
        memory_estimate_bytes: None,
        threads,
        diagnostics,
        counters: counters.iter().map(|&(name, count)| (name.to_owned(), count)).collect(),
        accuracy: conversion.body.source().settings["accuracy"].as_str().unwrap_or_default().to_owned(),
        output: Some((arguments.output.display().to_string(), size)),
        lumped_modes,
    }
}
