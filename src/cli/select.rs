//! Command `flexbody select`.

use super::arguments::SelectArguments;
use super::models::{is_model, origin, read_checked};
use super::outcome::{Outcome, format_of, refuse_replacing, refuse_replacing_read, refuse_warnings};
use super::resources::{context, use_threads};
use super::terminal::Watcher;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_body::basis::{BasisKind, ModeSettings};
use flexbody_body::convert::ConvertSettings;
use flexbody_body::flex_body::FlexBody;
use flexbody_eigen::Wanted;
use flexbody_linalg::context::{Event, Watch};
use flexbody_model::CheckedModel;
use flexbody_motion::scene::LoadCases;
use flexbody_report::{Format, RunData, SelectionFacts};
use flexbody_study::recipe::{selected_from_file, selected_from_model};
use flexbody_study::reference::{Enriched, ReferenceError, varied_errors};
use flexbody_study::selection::select_judged;
use flexbody_study::tailoring::{Tailoring, computed_basis, loads_for};

pub(super) fn run(arguments: &SelectArguments) -> Result<Outcome> {
    let formats = arguments.report.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
    refuse_replacing([&arguments.body, &arguments.scene].into_iter(), arguments.report.iter())?;
    let is_model = is_model(&arguments.body, &arguments.job)?;
    let reports = arguments.report.iter().map(OutputSlot::prepare).collect::<Result<Vec<_>>>()?;
    let threads = use_threads(arguments.threads);

    let watcher = Watcher::new(arguments.printing.quiet || arguments.printing.json, "reading");
    let cases = LoadCases::read(&arguments.scene, arguments.case.as_deref())?;
    let series = cases.iter().flat_map(|scene| &scene.series).map(|file| &file.path);
    refuse_replacing(series, arguments.report.iter())?;
    refuse_replacing_read(arguments.report.iter())?;
    let watch = |event: Event<'_>| watcher.hear(event);
    let Judged { body, reference_errors, varied_reference_errors, mut diagnostics } = if is_model {
        converted(arguments, &cases, &watch)?
    } else {
        refuse_modes(arguments)?;
        let (body, notes) = flexbody_file::read_with_notes(&arguments.body)?;
        Judged { body, reference_errors: Vec::new(), varied_reference_errors: Vec::new(), diagnostics: notes }
    };
    let limits = context(None, arguments.allow_long, &watch);
    let selection = select_judged(&body, &reference_errors, &varied_reference_errors, &cases, &limits)
        .map_err(|error| error.in_file(&arguments.scene))?;
    diagnostics.extend(selection.diagnostics.iter().cloned());
    let run = RunData { phases: watcher.finish(), diagnostics, threads, ..RunData::default() };
    refuse_warnings(arguments.printing, &run.diagnostics)?;
    let origin = origin(&arguments.body, &arguments.job, &arguments.scene, &arguments.case);
    let command = match is_model {
        true => selected_from_model(&selection, &origin, arguments.modes.map(|modes| modes as usize)),
        false => selected_from_file(&selection, &origin),
    };
    let facts = SelectionFacts::new(&selection, &run).with_command(command);
    for (slot, format) in reports.iter().zip(formats) {
        slot.fill(facts.render(format).as_bytes())?;
    }
    OutputSlot::commit_all(reports)?;
    Ok(Outcome {
        text: facts.render(Format::Terminal),
        json: facts.render(Format::Json),
        diagnostics: run.diagnostics.clone(),
        passed: selection.holds(),
    })
}

/// Body to select from, with its truncation errors.
struct Judged {
    body: FlexBody,
    /// Truncation errors in each load case; empty if no model is at hand.
    reference_errors: Vec<Vec<ReferenceError>>,
    /// Truncation errors in each variation.
    varied_reference_errors: Vec<Vec<ReferenceError>>,
    diagnostics: Vec<Diagnostic>,
}

/// Returns the body of a model with everything that the load cases may need, and its truncation errors.
fn converted(arguments: &SelectArguments, cases: &LoadCases, watch: Watch<'_>) -> Result<Judged> {
    let (files, checked) = read_checked(&arguments.body, &arguments.job, arguments.report.iter())?;
    let CheckedModel { model, mut diagnostics, .. } = checked;
    let loads = loads_for(Some(cases), &files.residual_vectors);
    let wanted = arguments.modes.map_or(ModeSettings::DEFAULT_COUNT, |modes| modes as usize);
    let settings = ConvertSettings {
        modes: ModeSettings { wanted: Wanted::Lowest(wanted), ..ModeSettings::default() },
        basis: computed_basis(BasisKind::Free, &loads, &model)?,
        lumped: Vec::new(),
        ..ConvertSettings::default()
    };
    let tailoring = Tailoring { settings, by_band: arguments.modes.is_none(), of_motion: false };
    // Created after the model was read, which takes memory too.
    let context = context(None, arguments.allow_long, watch);
    let Enriched { made, rounds } =
        tailoring.convert(&model, cases, &context).map_err(|error| error.in_file(&arguments.scene))?;
    diagnostics.extend(made.diagnostics);
    let varied_reference_errors = varied_errors(&model, &made.body, cases, &context)?;
    Ok(Judged { body: made.body, reference_errors: rounds, varied_reference_errors, diagnostics })
}

fn refuse_modes(arguments: &SelectArguments) -> Result<()> {
    if arguments.modes.is_some() {
        let message = "--modes applies to a model: the modes of a body file are fixed";
        return Err(Diagnostic::new(Code::Usage, message).into());
    }
    Ok(())
}
