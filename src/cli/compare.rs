//! `flexbody compare`.

use super::arguments::CompareArguments;
use super::outcome::Outcome;
use crate::base::error::Result;
use crate::formats::flex_body_file;
use crate::report::{Tolerances, compare, compare_common};

pub(super) fn run(arguments: &CompareArguments) -> Result<Outcome> {
    let (a, mut diagnostics) = flex_body_file::read_with_notes(&arguments.a)?;
    let (b, of_b) = flex_body_file::read_with_notes(&arguments.b)?;
    diagnostics.extend(of_b);
    let usual = Tolerances::default();
    let tolerances = Tolerances {
        frequency: arguments.frequency.unwrap_or(usual.frequency),
        mass: arguments.mass.unwrap_or(usual.mass),
        centre_of_mass: arguments.centre_of_mass.unwrap_or(usual.centre_of_mass),
        inertia: arguments.inertia.unwrap_or(usual.inertia),
        invariants: arguments.invariants.unwrap_or(usual.invariants),
    };
    let compare = if arguments.common { compare_common } else { compare };
    let comparison = compare(&a, &b, &tolerances)?;
    Ok(Outcome {
        text: comparison.text(),
        json: format!("{:#}", comparison.json()),
        diagnostics,
        passed: comparison.passed(),
    })
}
