//! Options of `flexbody convert` with work of their own: `--from` converts a body in a file of another program, `--like`
//! takes the settings of an existing body, `--allow-unjudged` permits a file whose selection does not hold.

use super::arguments::ConvertArguments;
use super::outcome::{Outcome, format_of, refuse_replacing, refuse_warnings};
use super::terminal::body_text;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::output::OutputSlot;
use flexbody_body::basis::BasisKind;
use flexbody_eigen::Accuracy;
use flexbody_formats::{find_import_format, import_file};
use flexbody_input::parse_units;
use flexbody_report::{Facts, Format, RunData, render};
use flexbody_study::reference::ReferenceError;
use flexbody_study::selection::Selection;
use serde_json::Value;
use std::path::Path;

pub(super) fn convert_foreign(arguments: &ConvertArguments, from: &str) -> Result<Outcome> {
    find_import_format(from)?;
    let Some(path) = &arguments.model else {
        let message = format!("--from {from} needs the path of the file to convert");
        return Err(Diagnostic::new(Code::Usage, message).into());
    };
    let units = arguments.job.units.as_deref().map(parse_units).transpose()?;
    let formats = arguments.report.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
    let outputs = std::iter::once(&arguments.output).chain(&arguments.report);
    refuse_replacing(std::iter::once(path), outputs)?;
    let slot = flexbody_file::prepare_output(&arguments.output)?;
    let reports = arguments.report.iter().map(OutputSlot::prepare).collect::<Result<Vec<_>>>()?;

    let imported = import_file(path, from, units, arguments.frame.as_ref(), arguments.storage)?;
    refuse_warnings(arguments.printing, &imported.diagnostics)?;
    flexbody_file::fill_slot(&imported.body, &slot)?;
    let run = RunData { diagnostics: imported.diagnostics, ..RunData::default() };
    let facts = Facts::new(&imported.body, &run);
    for (slot, format) in reports.iter().zip(formats) {
        slot.fill(render(&facts, format).as_bytes())?;
    }
    OutputSlot::commit_all(std::iter::once(slot).chain(reports))?;
    let text = body_text(&facts, arguments.verbose, arguments.printing);
    let json = render(&facts, Format::Json);
    Ok(Outcome { text, json, diagnostics: run.diagnostics.clone(), passed: true })
}

/// Returns the arguments with the basis, modes, accuracy, residual vectors, frame, comparators and storage of the body in
/// `path`, as its file records them.
///
/// # Errors
/// The errors of reading the body; FB801 if its basis cannot be computed from the model alone.
pub(super) fn with_settings_of(arguments: &ConvertArguments, path: &Path) -> Result<ConvertArguments> {
    let (body, _) = flexbody_file::read_with_notes(path)?;
    let settings = &body.source().settings;
    let refused = |what: &str| {
        let message = format!("--like {}: {what}", path.display());
        let help = "state the settings of the conversion instead of --like";
        Error::from(Diagnostic::new(Code::Usage, message).with_help(help))
    };
    let text = |key: &str| settings[key].as_str().map(str::to_owned);
    let names = |key: &str| -> Vec<&str> {
        settings[key].as_array().into_iter().flatten().filter_map(Value::as_str).collect()
    };
    let basis = text("basis").and_then(|name| BasisKind::from_name(&name));
    let accuracy = text("accuracy").and_then(|name| Accuracy::from_name(&name));
    let (Some(basis), Some(accuracy), Some(frame)) = (basis, accuracy, text("frame")) else {
        return Err(refused("the body does not record the settings of its conversion"));
    };
    if matches!(basis, BasisKind::Imported | BasisKind::Scene) {
        return Err(refused("the shapes of the body are not computed from the model alone"));
    }
    let frame = frame.parse().map_err(|_| refused(&format!("its frame `{frame}` is not known")))?;
    let hertz = settings["max_eigenvalue"].as_f64().map(|lambda| body.units().frequency_of(lambda));
    let lumped = names("lumped").join(",");
    let mut own = arguments.clone();
    own.modes = settings["modes"].as_u64().and_then(|count| u32::try_from(count).ok());
    own.max_frequency = hertz;
    (own.basis, own.accuracy, own.frame) = (basis, accuracy, Some(frame));
    own.residual_vectors = Some(names("residual_vectors").join(","));
    own.lumped = if lumped.is_empty() { "none".to_owned() } else { lumped };
    own.storage = body.storage();
    Ok(own)
}

// Conversions for a scene whose selection does not hold: nothing is written unless the user allows it.

/// Ends a conversion whose `selection` does not hold, unless `--allow-unjudged` is set. `found` are the diagnostics of
/// the conversion, which state the reason.
///
/// # Errors
/// [`SelectionUnjudged`](Code::SelectionUnjudged) after `found`.
pub(super) fn refuse_unjudged(
    arguments: &ConvertArguments,
    selection: Option<&Selection>,
    found: &[Diagnostic],
) -> Result<()> {
    let Some(selection) = selection.filter(|selection| !selection.holds()) else { return Ok(()) };
    if arguments.allow_unjudged {
        return Ok(());
    }
    let message = match selection.reference_errors.last().filter(|own| !ReferenceError::is_reference(own)) {
        Some(own) => {
            let error = match own.unknown {
                Some(reason) => format!("not known ({reason})"),
                None => format!("about {} of the tolerances, more than half", own.part_of_tolerances()),
            };
            format!(
                "no file was written: the error of the reference body of {} modes is {error}, so that the selection cannot be judged",
                own.modes
            )
        }
        None => "no file was written: the selected modes and terms do not meet the tolerances of the scene"
            .to_owned(),
    };
    let refused = Error::from(Diagnostic::new(Code::SelectionUnjudged, message));
    Err(refused.after(found.to_vec()))
}
