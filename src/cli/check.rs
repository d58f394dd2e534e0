//! `flexbody check`.

use super::arguments::CheckArguments;
use super::output::{Outcome, tell};
use crate::error::Result;
use crate::flex_body::FlexBody;
use crate::input::{read_manifest, read_model};
use crate::invariants::{BodyFrame, Expected, IdentityCheck, identities};
use crate::model::FeModel;
use crate::report::{identities_json, identities_text};
use crate::store;
use crate::verification::{changed_sources, verify};

pub(super) fn run(arguments: &CheckArguments) -> Result<Outcome> {
    let body = store::read(&arguments.body)?;
    let mut checks = own_identities(&body);
    if let Some(manifest) = &arguments.against {
        let checked = FeModel::from_raw(read_model(&read_manifest(manifest)?)?)?;
        tell(arguments.printing, &changed_sources(&body, &checked.model));
        checks.extend(verify(&body, &checked.model)?);
    }
    let passed = checks.iter().all(|check| check.passed);
    Ok(Outcome { text: identities_text(&checks), json: format!("{:#}", identities_json(&checks)), passed })
}

fn own_identities(body: &FlexBody) -> Vec<IdentityCheck> {
    let name = body.source().settings["frame"].as_str();
    let frame =
        BodyFrame::ALL.into_iter().find(|frame| Some(frame.name()) == name).unwrap_or(BodyFrame::Model);
    let expected = Expected {
        mass_normalised: true,
        free_surface: true,
        frame,
        origin: body.frame().origin,
        eigenvalues: Some(&body.modes().eigenvalue),
        eigenvalue_noise: body.certificate().rigid_noise,
    };
    identities(body.invariants(), &expected)
}
