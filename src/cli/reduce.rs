//! Command `flexbody reduce`.

use super::arguments::ReduceArguments;
use super::convert::subset;
use super::outcome::{Outcome, refuse_replacing, refuse_warnings};
use super::terminal::body_text;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, Storage};
use flexbody_body::verification::accept;
use flexbody_motion::dynamics::indefinite_inertia;
use flexbody_report::{Facts, Format, RunData, render};

pub(super) fn run(arguments: &ReduceArguments) -> Result<Outcome> {
    let subset = subset(arguments.terms.as_deref(), arguments.keep_modes.as_deref())?;
    if arguments.keep_modes.is_none() && arguments.terms.is_none() && arguments.storage.is_none() {
        let message = "nothing is left out: neither --keep-modes, --terms nor --storage is given";
        let help = "name the modes or terms to keep, as in --keep-modes 1,3,5-9 --terms W1";
        return Err(Diagnostic::new(Code::Usage, message).with_help(help).into());
    }
    refuse_replacing(std::iter::once(&arguments.body), std::iter::once(&arguments.output))?;
    let slot = flexbody_file::prepare_output(&arguments.output)?;
    let (body, mut diagnostics) = flexbody_file::read_with_notes(&arguments.body)?;
    let body = stored(body.subset(&subset)?, arguments.storage)?;
    accept(&body)?;
    diagnostics.extend(indefinite_inertia(&body));
    refuse_warnings(arguments.printing, &diagnostics)?;
    flexbody_file::fill_slot(&body, &slot)?;
    let size = std::fs::metadata(slot.temporary()).map(|meta| meta.len()).unwrap_or(0);
    let output = Some((arguments.output.display().to_string(), size));
    let run = RunData { output, diagnostics: diagnostics.clone(), ..RunData::default() };
    let facts = Facts::new(&body, &run);
    let (text, json) = (body_text(&facts, false, arguments.printing), render(&facts, Format::Json));
    slot.commit()?;
    Ok(Outcome { text, json, diagnostics, passed: true })
}

/// Returns the body with the floats that are asked for.
fn stored(body: FlexBody, storage: Option<Storage>) -> Result<FlexBody> {
    match (storage, body.parts().storage) {
        (Some(Storage::F32), Storage::F64) => body.rounded_to_f32(),
        (Some(Storage::F64), Storage::F32) => {
            let message =
                "--storage f64: the shapes of the file have 7 digits, and f64 cannot restore the others";
            let help = "leave --storage out, or convert the model again";
            Err(Diagnostic::new(Code::Usage, message).with_help(help).into())
        }
        _ => Ok(body),
    }
}
