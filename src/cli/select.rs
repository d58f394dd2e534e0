//! Command `flexbody select`.

use super::arguments::SelectArguments;
use super::models::{is_model, origin};
use super::outcome::Outcome;
use super::run::Run;
use flexbody_base::error::Result;
use flexbody_report::SelectionFacts;
use flexbody_study::selection_request::SelectionRequest;

pub(super) fn run(arguments: &SelectArguments) -> Result<Outcome> {
    let SelectArguments { body, scene, .. } = arguments;
    let is_model = is_model(body, &arguments.job)?;
    let mut run = Run::begin(arguments.printing, [body, scene], None, &arguments.report)?.with_progress();
    let cases = run.read_cases(scene, arguments.case.as_deref())?.robust_if(arguments.robust);
    let request = SelectionRequest {
        modes: arguments.modes.map(|modes| modes as usize),
        scene_file: Some(scene.clone()),
    };
    let selected = if is_model {
        let (files, model) = run.read_model(body, &arguments.job)?;
        request.for_model(&model, &files.residual_vectors, &cases, &run.context(arguments.allow_long))?
    } else {
        request.refuse_modes()?;
        let body = run.read_body(body)?;
        request.for_body(&body, &cases, &run.context(arguments.allow_long))?
    };
    run.note(selected.diagnostics());
    let data = run.data()?;
    let origin = origin(body, &arguments.job, scene, &arguments.case);
    let facts = SelectionFacts::new(&selected.selection, &data).with_command(selected.command(&origin));
    run.end(None, |format| facts.render(format), selected.selection.holds())
}
