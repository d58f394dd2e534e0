//! Command `flexbody compare`.

use super::arguments::CompareArguments;
use super::outcome::Outcome;
use super::run::{Printed, Run};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_report::{ComparisonFormat, ComparisonReport, Tolerances, compare, compare_common};
use std::path::Path;

pub(super) fn run(arguments: &CompareArguments) -> Result<Outcome> {
    let CompareArguments { a, b, report, .. } = arguments;
    let formats = report.iter().map(|path| format_of(path)).collect::<Result<Vec<_>>>()?;
    let mut run = Run::begin(arguments.printing, [a, b], report, &[])?;
    let reports = report.iter().map(OutputSlot::prepare).collect::<Result<Vec<_>>>()?;
    let (first, second) = (run.read_body(a)?, run.read_body(b)?);
    let compare = if arguments.common { compare_common } else { compare };
    let comparison = compare(&first, &second, &tolerances(arguments))?;
    if !reports.is_empty() {
        run.data()?;
    }
    let (a, b) = (a.display().to_string(), b.display().to_string());
    let facts = ComparisonReport { comparison: &comparison, a: &a, b: &b };
    for (slot, format) in reports.iter().zip(formats) {
        slot.fill(facts.render(format).as_bytes())?;
    }
    let printed = Printed { text: comparison.text(), json: format!("{:#}", comparison.json()) };
    run.end_with(reports, |_| String::new(), printed, comparison.passed())
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
