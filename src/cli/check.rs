//! Command `flexbody check`.

use super::arguments::CheckArguments;
use super::models::of_manifest_or_job;
use super::outcome::Outcome;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::convert::StressLoads;
use flexbody_body::verification::{Checks, model_of};
use flexbody_input::read_model;
use flexbody_report::{checks_json, checks_text};

pub(super) fn run(arguments: &CheckArguments) -> Result<Outcome> {
    if let (None, Some(option)) = (&arguments.against, arguments.job.first()) {
        let message = format!("{option} describes the job of --against, but --against is missing");
        return Err(Diagnostic::new(Code::Usage, message).into());
    }
    let (body, mut diagnostics) = flexbody_file::read_with_notes(&arguments.body)?;
    let model = match &arguments.against {
        Some(path) => {
            let mut files = of_manifest_or_job(path, &arguments.job)?;
            files.describe_elements |= !StressLoads::recorded(&body.source().settings).is_empty();
            Some(model_of(&body, read_model(&files)?)?.model)
        }
        None => None,
    };
    let checks = Checks::of(&body, model.as_ref())?;
    let passed = checks.passed();
    let (text, json) = (checks_text(&body, &checks), checks_json(&checks));
    diagnostics.extend(checks.diagnostics);
    Ok(Outcome { text, json, diagnostics, passed })
}
