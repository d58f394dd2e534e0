//! Command `flexbody advise`.

use super::arguments::{AdviseArguments, Deflection};
use super::outcome::Outcome;
use super::run::Run;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_report::AdviceFacts;
use flexbody_study::advice::{AttachedMass, Ranges, advise};

pub(super) fn run(arguments: &AdviseArguments) -> Result<Outcome> {
    let mut run = Run::begin(arguments.printing, [&arguments.body], None, &arguments.report)?.with_progress();
    let attached = arguments.attached.as_deref().map(attached_mass).transpose()?;
    let body = run.read_body(&arguments.body)?;
    let ranges = Ranges {
        spin_hz: arguments.spin,
        deflection: arguments.deflection.map(|deflection| match deflection {
            Deflection::Length(length) => length,
            Deflection::PartOfExtent(part) => part * body.extent(),
        }),
        duration: arguments.duration,
        attached,
        is_rotation_given: arguments.rotation_given,
        limit: arguments.limit,
    };
    let advice = advise(&body, ranges, &run.context(false))?;
    run.note(advice.warning());
    let data = run.data()?;
    let facts = AdviceFacts::new(&advice, &body, &arguments.body.display().to_string(), &data);
    run.end(None, |format| facts.render(format), true)
}

/// Parses an attached mass: `MASS` or `MASS@INTERFACE`.
fn attached_mass(text: &str) -> Result<AttachedMass> {
    let (mass, interface) = match text.split_once('@') {
        Some((mass, interface)) => (mass, Some(interface.to_owned())),
        None => (text, None),
    };
    let mass = mass.trim().parse::<f64>().map_err(|_| {
        let message = format!("--attached {text}: `{mass}` is not a mass");
        let help = "give a mass in the unit of the body, as in 2.5 or 2.5@tool";
        Diagnostic::new(Code::Usage, message).with_help(help)
    })?;
    Ok(AttachedMass { mass, interface })
}
