//! Command `flexbody measure`.

use super::arguments::{JobArguments, MeasureArguments};
use super::outcome::Outcome;
use super::run::Run;
use flexbody_base::error::Result;
use flexbody_motion::scene::{LoadCases, MotionHistory};
use flexbody_report::MeasuredRunFacts;
use flexbody_study::measured_run::measured_run;

pub(super) fn run(arguments: &MeasureArguments) -> Result<Outcome> {
    let MeasureArguments { body, scene, history, reference, model, .. } = arguments;
    let inputs = [body, scene, history].into_iter().chain(reference).chain(model);
    let mut run = Run::begin(arguments.printing, inputs, None, &arguments.report)?.with_progress();
    let cases = LoadCases::read(scene, arguments.case.as_deref())?;
    let case = cases.single()?;
    let body = run.read_body(body)?;
    let motion = MotionHistory::read(history, body.n_modes())?;
    let reference = match reference.as_ref().zip(model.as_ref()) {
        Some((reference, model)) => {
            let whole = run.read_body(reference)?;
            let (_, model) = run.read_model(model, &JobArguments::default())?;
            Some((whole, model))
        }
        None => None,
    };
    let reference = reference.as_ref().map(|(whole, model)| (whole, model));
    let (measured, found) = measured_run(&body, motion, case, reference, &run.context(false))
        .map_err(|error| error.in_file(scene))?;
    run.note(found);
    let data = run.data()?;
    let history = history.display().to_string();
    let facts = MeasuredRunFacts::new(&measured, &body.description().name, history, &data);
    run.end(None, |format| facts.render(format), measured.holds())
}
