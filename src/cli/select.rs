//! Command `flexbody select`.

use super::arguments::SelectArguments;
use super::models::{is_model, read_checked};
use super::outcome::{Outcome, refuse_warnings};
use super::places::{format_of, refuse_replacing, refuse_replacing_read};
use super::resources::{context, use_threads};
use super::watcher::Watcher;
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
use flexbody_study::reference::{Enriched, ReferenceError};
use flexbody_study::selection::select;
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
    let (body, reference_errors, mut diagnostics) = if is_model {
        converted(arguments, &cases, &watch)?
    } else {
        refuse_modes(arguments)?;
        let (body, notes) = flexbody_file::read_with_notes(&arguments.body)?;
        (body, Vec::new(), notes)
    };
    let selection = select(&body, &reference_errors, &cases, &context(None, arguments.allow_long, &watch))
        .map_err(|error| error.in_file(&arguments.scene))?;
    diagnostics.extend(selection.diagnostics.iter().cloned());
    let run = RunData { phases: watcher.finish(), diagnostics, threads, ..RunData::default() };
    refuse_warnings(arguments.printing, &run.diagnostics)?;
    let facts = SelectionFacts::new(&selection, &run);
    for (slot, format) in reports.iter().zip(formats) {
        slot.fill(facts.render(format).as_bytes())?;
    }
    OutputSlot::commit_all(reports)?;
    Ok(Outcome {
        text: facts.render(Format::Text),
        json: facts.render(Format::Json),
        diagnostics: run.diagnostics.clone(),
        passed: selection.holds(),
    })
}

/// Returns the body of a model with everything that the load cases may need, and its truncation errors.
fn converted(
    arguments: &SelectArguments,
    cases: &LoadCases,
    watch: Watch<'_>,
) -> Result<(FlexBody, Vec<Vec<ReferenceError>>, Vec<Diagnostic>)> {
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
    Ok((made.body, rounds, diagnostics))
}

fn refuse_modes(arguments: &SelectArguments) -> Result<()> {
    if arguments.modes.is_some() {
        let message = "--modes applies to a model: the modes of a body file are fixed";
        return Err(Diagnostic::new(Code::Usage, message).into());
    }
    Ok(())
}
