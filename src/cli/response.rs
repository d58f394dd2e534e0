//! Command `flexbody response`.

use super::arguments::{JobArguments, ResponseArguments};
use super::convert::RESIDUALS_NEED_FREE_MODES;
use super::convert::load_sources;
use super::models::{is_model, read_checked};
use super::outcome::{Outcome, format_of, refuse_replacing, refuse_replacing_read, refuse_warnings};
use super::resources::{context, use_threads};
use super::terminal::Watcher;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_body::basis::BasisKind;
use flexbody_body::flex_body::FlexBody;
use flexbody_input::{LoadSource, parse_damping};
use flexbody_linalg::context::{Event, Watch};
use flexbody_model::{Damping, FeModel};
use flexbody_motion::scene::LoadCases;
use flexbody_report::{EnvelopeKind, Format, ResponseFacts, RunData, response_csv};
use flexbody_study::response::{Place, ResponseRequest, converted_for_response};
use std::path::PathBuf;

pub(super) fn run(arguments: &ResponseArguments) -> Result<Outcome> {
    let formats = arguments.report.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
    let inputs = || {
        std::iter::once(&arguments.model).chain(&arguments.body).chain(&arguments.scene).chain(&arguments.psd)
    };
    refuse_replacing(inputs(), outputs(arguments))?;
    let damping = Stated::of(arguments)?;
    let is_model = is_model(&arguments.model, &damping.job)?;
    refuse_contradictions(arguments, is_model)?;
    let table = arguments.csv.as_ref().map(OutputSlot::prepare).transpose()?;
    let kind = arguments.rms.as_deref().map(EnvelopeKind::of).transpose()?;
    let rms = arguments.rms.as_ref().map(OutputSlot::prepare).transpose()?;
    let reports = arguments.report.iter().map(OutputSlot::prepare).collect::<Result<Vec<_>>>()?;
    let threads = use_threads(arguments.threads);

    let watcher = Watcher::new(arguments.printing.quiet || arguments.printing.json, "reading");
    let watch = |event: Event<'_>| watcher.hear(event);
    let single = |path| LoadCases::read_single(path, arguments.case.as_deref());
    let scene = arguments.scene.as_ref().map(single).transpose()?;
    refuse_replacing_read(outputs(arguments))?;
    let asked = arguments.residual_vectors.as_deref().map(load_sources).transpose()?;
    let (model, body, diagnostics) = if is_model {
        let (model, body, diagnostics) = model_and_body(arguments, &damping.job, asked, &watch)?;
        (Some(model), body, diagnostics)
    } else {
        let (body, notes) = flexbody_file::read_with_notes(&arguments.model)?;
        (None, body, notes)
    };
    let context = context(None, arguments.allow_long, &watch);
    let (response, settings) =
        request(arguments, damping.ratio).respond(model.as_ref(), &body, scene.as_ref(), &context)?;
    let diagnostics = [diagnostics, response.diagnostics.clone()].concat();
    let run = RunData { phases: watcher.finish(), diagnostics, threads, ..RunData::default() };
    refuse_warnings(arguments.printing, &run.diagnostics)?;
    let facts = ResponseFacts::new(&response, &settings, &run);
    if let Some(slot) = &table {
        slot.fill(response_csv(&response).as_bytes())?;
    }
    if let (Some(kind), Some(slot), Some(random)) = (kind, &rms, &response.random) {
        slot.fill(&kind.random_bytes(&body, random)?)?;
    }
    for (slot, format) in reports.iter().zip(formats) {
        slot.fill(facts.render(format).as_bytes())?;
    }
    // No file appears before everything is done.
    OutputSlot::commit_all(table.into_iter().chain(rms).chain(reports))?;
    Ok(Outcome {
        text: facts.render(Format::Terminal),
        json: facts.render(Format::Json),
        diagnostics: run.diagnostics.clone(),
        passed: response.holds(settings.tolerance),
    })
}

/// Damping that the command line states: a ratio of the modes, which any body may have, or a part of the job.
struct Stated {
    ratio: Option<f64>,
    job: JobArguments,
}

impl Stated {
    /// Reads `--damping`. A ratio is taken out of the job.
    ///
    /// # Errors
    /// FB801 for invalid damping.
    fn of(arguments: &ResponseArguments) -> Result<Self> {
        let job = arguments.job.clone();
        let damping = job.damping.as_deref().map(parse_damping).transpose()?;
        Ok(match damping {
            Some(Damping::Ratio(ratio)) => {
                Self { ratio: Some(ratio), job: JobArguments { damping: None, ..job } }
            }
            _ => Self { ratio: None, job },
        })
    }
}

/// Returns the request of the command line. `damping` is the ratio of the modes.
fn request(arguments: &ResponseArguments, damping: Option<f64>) -> ResponseRequest {
    let places = |named: &[String]| named.iter().map(|text| Place::parse(text)).collect();
    ResponseRequest {
        from: places(&arguments.from),
        base: arguments.base.as_deref().map(Place::parse),
        rows: arguments.rows.clone(),
        densities: arguments.psd.clone(),
        to: places(&arguments.to),
        band: arguments.band,
        damping,
        tolerance: arguments.tolerance,
        points: arguments.points as usize,
        solves: arguments.solves as usize,
    }
}

fn outputs(arguments: &ResponseArguments) -> impl Iterator<Item = &PathBuf> + Clone {
    arguments.csv.iter().chain(&arguments.rms).chain(&arguments.report)
}

/// Refuses contradictory options.
fn refuse_contradictions(arguments: &ResponseArguments, is_model: bool) -> Result<()> {
    let converts =
        arguments.modes.is_some() || arguments.basis.is_some() || arguments.residual_vectors.is_some();
    let message = match arguments {
        ResponseArguments { body: Some(_), .. } if !is_model => {
            "give the model first (a manifest or a job), then the body that was made from it"
        }
        _ if converts && !(is_model && arguments.body.is_none()) => {
            "--modes, --basis and --residual-vectors apply to a model without a body: the modes of a body file are fixed"
        }
        ResponseArguments { basis: Some(BasisKind::Scene), .. } => {
            "--basis scene works only in convert: convert the model first, then give the body after the model"
        }
        ResponseArguments { basis: Some(BasisKind::Imported), .. } => {
            "--basis imported works only in convert: convert the model first, then give the body after the model"
        }
        ResponseArguments { basis: Some(BasisKind::CraigBampton), residual_vectors: Some(_), .. } => {
            RESIDUALS_NEED_FREE_MODES
        }
        _ => return Ok(()),
    };
    Err(Diagnostic::new(Code::Usage, message).into())
}

/// Returns the model with the given body, or with a body that is converted now.
fn model_and_body(
    arguments: &ResponseArguments,
    job: &JobArguments,
    asked: Option<Vec<LoadSource>>,
    watch: Watch<'_>,
) -> Result<(FeModel, FlexBody, Vec<Diagnostic>)> {
    let (files, checked) = read_checked(&arguments.model, job, outputs(arguments))?;
    let (model, mut diagnostics) = (checked.model, checked.diagnostics);
    if let Some(path) = &arguments.body {
        let (body, notes) = flexbody_file::read_with_notes(path)?;
        diagnostics.extend(notes);
        return Ok((model, body, diagnostics));
    }
    let loads = asked.unwrap_or_else(|| files.residual_vectors.clone());
    // Created after the model was read, which takes memory too.
    let context = context(None, arguments.allow_long, watch);
    let modes = arguments.modes.map(|modes| modes as usize);
    let basis = arguments.basis.unwrap_or_default();
    let made = converted_for_response(&model, basis, &loads, modes, &context)?;
    diagnostics.extend(made.diagnostics);
    Ok((model, made.body, diagnostics))
}
