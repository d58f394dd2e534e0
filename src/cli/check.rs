//! Command `flexbody check`.

use super::arguments::CheckArguments;
use super::models::of_manifest_or_job;
use super::outcome::Outcome;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::convert::poor_fits;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::verification::{body_identities, changed_sources, verify};
use flexbody_input::read_model;
use flexbody_model::{FeModel, RawModel};
use flexbody_report::{dropped_text, identities_json, identities_text};

pub(super) fn run(arguments: &CheckArguments) -> Result<Outcome> {
    if let (None, Some(option)) = (&arguments.against, arguments.job.first()) {
        let message = format!("{option} describes the job of --against, but --against is missing");
        return Err(Diagnostic::new(Code::Usage, message).into());
    }
    let (body, mut diagnostics) = flexbody_file::read_with_notes(&arguments.body)?;
    diagnostics.extend(poor_fits(&body));
    let mut checks = body_identities(&body);
    if let Some(path) = &arguments.against {
        let files = of_manifest_or_job(path, &arguments.job)?;
        let model = model_of(&body, read_model(&files)?)?;
        diagnostics.extend(changed_sources(&body, &model));
        checks.extend(verify(&body, &model)?);
    }
    let passed = checks.iter().all(|check| check.passed);
    let text = identities_text(&checks) + &dropped_text(&body);
    let json = format!("{:#}", serde_json::json!({ "identities": identities_json(&checks) }));
    Ok(Outcome { text, json, diagnostics, passed })
}

/// Returns the model that `body` was made of: all of `raw`, or one of the bodies in it.
fn model_of(body: &FlexBody, raw: RawModel) -> Result<FeModel> {
    let Some(number) = body.source().number else { return Ok(FeModel::from_raw(raw)?.model) };
    let bodies = FeModel::bodies_from_raw(raw)?;
    let count = bodies.len();
    let found = bodies.into_iter().map(|checked| checked.model).find(|model| model.number() == Some(number));
    found.ok_or_else(|| {
        let message = format!("the file states {number}, but the matrices of the model hold {count}");
        Diagnostic::new(Code::BodyIncomparable, message).into()
    })
}
