//! `flexbody inspect`.

use super::arguments::InspectArguments;
use super::output::Outcome;
use crate::error::Result;
use crate::report::{Facts, Format, RunData, render};
use crate::store;

pub(super) fn run(arguments: &InspectArguments) -> Result<Outcome> {
    if arguments.structure {
        let structure = format!("{:#}", store::structure(&arguments.body)?);
        return Ok(Outcome { text: structure.clone(), json: structure, passed: true });
    }
    let body = store::read(&arguments.body)?;
    let facts = Facts::new(&body, &RunData::default());
    Ok(Outcome { text: render(&facts, Format::Text), json: render(&facts, Format::Json), passed: true })
}
