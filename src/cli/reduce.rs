//! Command `flexbody reduce`.

use super::arguments::ReduceArguments;
use super::conversion_request::subset;
use super::outcome::{Outcome, size_of};
use super::run::{Printed, Run};
use super::terminal::body_text;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, Storage, Subset};
use flexbody_body::verification::accept;
use flexbody_motion::dynamics::indefinite_inertia;
use flexbody_report::{Facts, Format, render};

pub(super) fn run(arguments: &ReduceArguments) -> Result<Outcome> {
    let ReduceArguments { terms, keep_modes, fixed_interface_modes, storage, .. } = arguments;
    let subset = subset(terms.as_deref(), keep_modes.as_deref(), fixed_interface_modes.as_deref())?;
    if subset == Subset::default() && terms.is_none() && storage.is_none() {
        let message = "nothing is left out: neither --keep-modes, --fixed-interface-modes, --terms nor --storage is given";
        let help = "name the modes or terms to keep, as in --keep-modes 1,3,5-9 --terms W1";
        return Err(Diagnostic::new(Code::Usage, message).with_help(help).into());
    }
    let mut run = Run::begin(arguments.printing, [&arguments.body], [&arguments.output], &[])?;
    let slot = flexbody_file::prepare_output(&arguments.output)?;
    let body = run.read_body(&arguments.body)?;
    let body = stored(body.subset(&subset)?, arguments.storage)?;
    accept(&body)?;
    run.note(indefinite_inertia(&body));
    let mut data = run.data()?;
    flexbody_file::fill_slot(&body, &slot)?;
    data.output = Some((arguments.output.display().to_string(), size_of(&slot)));
    let facts = Facts::new(&body, &data);
    let text = body_text(&facts, false, arguments.printing);
    let printed = Printed { text, json: render(&facts, Format::Json) };
    run.end_with([slot], |format| render(&facts, format), printed, true)
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
