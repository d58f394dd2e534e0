//! Command `flexbody compare`.

use super::arguments::CompareArguments;
use super::outcome::{Outcome, refuse_replacing, refuse_warnings};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_report::{ComparisonFormat, ComparisonReport, Tolerances, compare, compare_common};
use std::path::Path;

pub(super) fn run(arguments: &CompareArguments) -> Result<Outcome> {
    let formats = arguments.report.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
    refuse_replacing([&arguments.a, &arguments.b].into_iter(), arguments.report.iter())?;
    let reports = arguments.report.iter().map(OutputSlot::prepare).collect::<Result<Vec<_>>>()?;
    let (a, mut diagnostics) = flexbody_file::read_with_notes(&arguments.a)?;
    let (b, of_b) = flexbody_file::read_with_notes(&arguments.b)?;
    diagnostics.extend(of_b);
    let compare = if arguments.common { compare_common } else { compare };
    let comparison = compare(&a, &b, &tolerances(arguments))?;
    if !reports.is_empty() {
        refuse_warnings(arguments.printing, &diagnostics)?;
    }
    let (a, b) = (arguments.a.display().to_string(), arguments.b.display().to_string());
    let report = ComparisonReport { comparison: &comparison, a: &a, b: &b };
    for (slot, format) in reports.iter().zip(formats) {
        slot.fill(report.render(format).as_bytes())?;
    }
    OutputSlot::commit_all(reports)?;
    Ok(Outcome {
        text: comparison.text(),
        json: format!("{:#}", comparison.json()),
        diagnostics,
        passed: comparison.passed(),
    })
}

fn tolerances(arguments: &CompareArguments) -> Tolerances {
    let usual = Tolerances::default();
    Tolerances {
        frequency: arguments.frequency.unwrap_or(usual.frequency),
        mass: arguments.mass.unwrap_or(usual.mass),
        centre_of_mass: arguments.centre_of_mass.unwrap_or(usual.centre_of_mass),
        inertia: arguments.inertia.unwrap_or(usual.inertia),
        invariants: arguments.invariants.unwrap_or(usual.invariants),
    }
}

fn format_of(path: &Path) -> Result<ComparisonFormat> {
    ComparisonFormat::from_path(path).ok_or_else(|| {
        let message = format!("report {} has no known extension", path.display());
        Diagnostic::new(Code::Usage, message)
            .with_help("give it the extension .html, .json, .txt, .md (Markdown) or .xml (JUnit)")
            .into()
    })
}
