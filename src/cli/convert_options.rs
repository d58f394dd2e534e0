//! Option `--like` of `flexbody convert`: takes the settings of an existing body.

use super::arguments::ConvertArguments;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_body::basis::BasisKind;
use flexbody_body::convert::StressLoads;
use flexbody_eigen::Accuracy;
use serde_json::Value;
use std::path::Path;

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
    let stressed = names("stress_stiffness").join(",");
    let stressed = StressLoads::parse(&stressed)
        .map_err(|name| refused(&format!("its stress stiffness `{name}` is not known")))?;
    own.geometric_stiffness = own.geometric_stiffness.or((!stressed.is_empty()).then_some(stressed));
    Ok(own)
}
