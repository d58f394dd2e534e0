//! `flexbody check`.

use super::arguments::CheckArguments;
use super::output::{Outcome, tell};
use crate::diagnostic::{Code, Diagnostic};
use crate::error::Result;
use crate::flex_body::FlexBody;
use crate::input::{read_manifest, read_model};
use crate::invariants::BodyFrame;
use crate::model::{FeModel, RawModel};
use crate::report::{dropped_text, identities_json, identities_text};
use crate::store;
use crate::verification::{changed_sources, verify};

pub(super) fn run(arguments: &CheckArguments) -> Result<Outcome> {
    let body = store::read(&arguments.body)?;
    let mut checks = body.identities(frame_of(&body));
    if let Some(manifest) = &arguments.against {
        let model = model_of(&body, read_model(&read_manifest(manifest)?)?)?;
        tell(arguments.printing, &changed_sources(&body, &model));
        checks.extend(verify(&body, &model)?);
    }
    let passed = checks.iter().all(|check| check.passed);
    let text = identities_text(&checks) + &dropped_text(&body);
    Ok(Outcome { text, json: format!("{:#}", identities_json(&checks)), passed })
}

/// The model that `body` was made of: all of `raw`, or one of the bodies in it.
fn model_of(body: &FlexBody, raw: RawModel) -> Result<FeModel> {
    let Some(number) = body.source().number else { return Ok(FeModel::from_raw(raw)?.model) };
    let bodies = FeModel::bodies_from_raw(raw)?;
    let of = bodies.len();
    let found = bodies.into_iter().map(|checked| checked.model).find(|model| model.number() == Some(number));
    found.ok_or_else(|| {
        let message = format!("the file holds {number}, the model has {of}");
        Diagnostic::new(Code::BodyIncomparable, message).into()
    })
}

/// What the frame of `body` was meant to be.
fn frame_of(body: &FlexBody) -> BodyFrame {
    let name = body.source().settings["frame"].as_str();
    BodyFrame::ALL.into_iter().find(|frame| Some(frame.name()) == name).unwrap_or(BodyFrame::Model)
}
