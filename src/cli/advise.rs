//! Command `flexbody advise`.

use super::arguments::{AdviseArguments, Deflection};
use super::outcome::{Outcome, format_of, refuse_replacing, refuse_warnings};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_report::{AdviceFacts, Format, RunData};
use flexbody_study::advice::{AttachedMass, Ranges, advise};

pub(super) fn run(arguments: &AdviseArguments) -> Result<Outcome> {
    let formats = arguments.report.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
    refuse_replacing(std::iter::once(&arguments.body), arguments.report.iter())?;
    let attached = arguments.attached.as_deref().map(attached_mass).transpose()?;
    let reports = arguments.report.iter().map(OutputSlot::prepare).collect::<Result<Vec<_>>>()?;
    let (body, diagnostics) = flexbody_file::read_with_notes(&arguments.body)?;
    let ranges = Ranges {
        spin_hz: arguments.spin,
        deflection: arguments.deflection.map(|deflection| match deflection {
            Deflection::Length(length) => length,
            Deflection::PartOfExtent(part) => part * body.extent(),
        }),
        attached,
        is_rotation_given: arguments.rotation_given,
        limit: arguments.limit,
    };
    let advice = advise(&body, ranges)?;
    let run = RunData { diagnostics, ..RunData::default() };
    refuse_warnings(arguments.printing, &run.diagnostics)?;
    let facts = AdviceFacts::new(&advice, &body, &arguments.body.display().to_string(), &run);
    for (slot, format) in reports.iter().zip(formats) {
        slot.fill(facts.render(format).as_bytes())?;
    }
    OutputSlot::commit_all(reports)?;
    let (text, json) = (facts.render(Format::Terminal), facts.render(Format::Json));
    Ok(Outcome { text, json, diagnostics: run.diagnostics.clone(), passed: true })
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
