//! Command `flexbody response`.

use super::arguments::{JobArguments, ResponseArguments};
use super::conversion_request::load_sources;
use super::models::is_model;
use super::outcome::Outcome;
use super::run::Run;
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_input::parse_damping;
use flexbody_model::Damping;
use flexbody_motion::scene::LoadCases;
use flexbody_report::{EnvelopeKind, ResponseFacts, response_csv};
use flexbody_study::response::{Place, ResponseRequest};

pub(super) fn run(arguments: &ResponseArguments) -> Result<Outcome> {
    let ResponseArguments { model, body, scene, csv, rms, .. } = arguments;
    let (request, job) = requested(arguments)?;
    let is_model = is_model(model, &job)?;
    request.check(is_model, body.is_some())?;
    let inputs = [model].into_iter().chain(body).chain(scene).chain(&arguments.psd);
    let mut run =
        Run::begin(arguments.printing, inputs, csv.iter().chain(rms), &arguments.report)?.with_progress();
    let table = csv.as_ref().map(OutputSlot::prepare).transpose()?;
    let kind = rms.as_deref().map(EnvelopeKind::of).transpose()?;
    let rms = rms.as_ref().map(OutputSlot::prepare).transpose()?;
    let single = |path| LoadCases::read_single(path, arguments.case.as_deref());
    let scene = scene.as_ref().map(single).transpose()?;
    run.refuse_read()?;
    let (given, responded) = if is_model {
        let (files, model) = run.read_model(model, &job)?;
        let given = body.as_ref().map(|path| run.read_body(path)).transpose()?;
        let context = run.context(arguments.allow_long);
        let loads = &files.residual_vectors;
        let responded = request.for_model(&model, loads, given.as_ref(), scene.as_ref(), &context)?;
        (given, responded)
    } else {
        let given = run.read_body(model)?;
        let responded = request.for_body(&given, scene.as_ref(), &run.context(arguments.allow_long))?;
        (Some(given), responded)
    };
    run.note(responded.diagnostics);
    let data = run.data()?;
    let (response, settings) = (&responded.response, &responded.settings);
    if let Some(slot) = &table {
        slot.fill(response_csv(response).as_bytes())?;
    }
    let body = responded.made.as_ref().or(given.as_ref());
    if let (Some(kind), Some(slot), Some(random), Some(body)) = (kind, &rms, &response.random, body) {
        slot.fill(&kind.random_bytes(body, random)?)?;
    }
    let facts = ResponseFacts::new(response, settings, &data);
    let holds = response.holds(settings.tolerance);
    run.end(table.into_iter().chain(rms), |format| facts.render(format), holds)
}

/// Returns the request of the command line and the options of the job. A damping ratio, which any body may have, belongs
/// to the request; other damping to the job.
///
/// # Errors
/// FB801 for invalid damping and for unknown loads.
fn requested(arguments: &ResponseArguments) -> Result<(ResponseRequest, JobArguments)> {
    let mut job = arguments.job.clone();
    let damping = match job.damping.as_deref().map(parse_damping).transpose()? {
        Some(Damping::Ratio(ratio)) => {
            job.damping = None;
            Some(ratio)
        }
        _ => None,
    };
    let places = |named: &[String]| named.iter().map(|text| Place::parse(text)).collect();
    let request = ResponseRequest {
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
        basis: arguments.basis,
        modes: arguments.modes.map(|modes| modes as usize),
        residual_vectors: arguments.residual_vectors.as_deref().map(load_sources).transpose()?,
    };
    Ok((request, job))
}
