//! Command `flexbody explain`.

use super::arguments::ExplainArguments;
use super::outcome::Outcome;
use flexbody_base::diagnostic::{Code, Explanation, Severity};
use flexbody_base::error::Result;
use serde_json::Value;

pub(super) fn run(arguments: &ExplainArguments) -> Result<Outcome> {
    let explanation = Explanation::of(arguments.code.as_deref())?;
    let codes: Vec<Value> = explanation.codes().into_iter().map(explained).collect();
    let json = serde_json::json!({ "codes": codes });
    let text = explanation.to_string();
    Ok(Outcome { text, json: format!("{json:#}"), diagnostics: Vec::new(), passed: true })
}

/// Returns a code as a member of the JSON output.
fn explained(code: Code) -> Value {
    let exit_code = (code.severity() == Severity::Error).then_some(code.exit_code() as u8);
    serde_json::json!({
        "code": code.id(),
        "severity": code.severity(),
        "exit_code": exit_code,
        "meaning": code.title(),
        "cause": code.cause(),
        "help": code.help(),
    })
}
