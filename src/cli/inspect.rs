//! `flexbody inspect`.

use super::arguments::InspectArguments;
use super::output::Outcome;
use crate::error::Result;
use crate::report::{Facts, Format, RunData, render};
use crate::store;

pub(super) fn run(arguments: &InspectArguments) -> Result<Outcome> {
    if arguments.structure {
        let structure = format!("{:#}", store::structure(&arguments.body)?);
        return Ok(Outcome {
            text: structure.clone(),
            json: structure,
            diagnostics: Vec::new(),
            passed: true,
        });
    }
    let (body, diagnostics) = store::read_with_notes(&arguments.body)?;
    let facts = Facts::new(&body, &RunData::default());
    let (text, json) = (render(&facts, Format::Text), render(&facts, Format::Json));
    Ok(Outcome { text, json, diagnostics, passed: true })
}
