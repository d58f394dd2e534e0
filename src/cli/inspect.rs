//! `flexbody inspect`.

use super::arguments::InspectArguments;
use super::outcome::Outcome;
use super::terminal::body_text;
use crate::base::error::Result;
use crate::formats::flex_body_file;
use crate::report::{Facts, Format, RunData, render};

pub(super) fn run(arguments: &InspectArguments) -> Result<Outcome> {
    if arguments.structure {
        let structure = format!("{:#}", flex_body_file::structure(&arguments.body)?);
        return Ok(Outcome {
            text: structure.clone(),
            json: structure,
            diagnostics: Vec::new(),
            passed: true,
        });
    }
    let (body, diagnostics) = flex_body_file::read_with_notes(&arguments.body)?;
    let facts = Facts::new(&body, &RunData::default());
    let text = body_text(&facts, arguments.verbose, arguments.printing);
    let json = render(&facts, Format::Json);
    Ok(Outcome { text, json, diagnostics, passed: true })
}
