//! Commands that judge a motion, called by the functions of the command line.

mod response;
mod simulation;
mod verdicts;

use crate::outputs::{Output, Outputs, Values};
use crate::subject::Subject;
use crate::transformations::Reach;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_motion::scene::{LoadCases, Scheme};
use std::collections::{BTreeMap, BTreeSet};

/// A command with its name.
pub struct Command {
    /// Name of the command.
    pub name: &'static str,
    /// Computes the outputs of a subject.
    pub run: fn(&Subject) -> Result<Outputs>,
    /// Returns true for transformations that the command is crossed with.
    pub meets: fn(Reach) -> bool,
}

/// All commands, `simulate` first.
pub const ALL: [Command; 6] = [
    Command { name: "simulate", run: simulation::simulation, meets: |_| true },
    Command { name: "select a body", run: verdicts::select_body, meets: |reach| reach != Reach::Simulation },
    Command { name: "select a model", run: verdicts::select_model, meets: of_model },
    Command { name: "trade", run: verdicts::trading, meets: |reach| reach != Reach::Simulation },
    Command { name: "convert for the scene", run: verdicts::conversion, meets: of_model },
    Command {
        name: "response",
        run: response::response,
        meets: |reach| matches!(reach, Reach::All | Reach::Body),
    },
];

/// Returns true for transformations that apply to commands that convert a model.
fn of_model(reach: Reach) -> bool {
    matches!(reach, Reach::All | Reach::Scene)
}

/// Tolerance of the integrations of verdicts, that of a scene file.
const TOLERANCE: f64 = 1e-9;

/// Factor of the allowed difference of values found at the evaluated times of an integration. Other steps
/// have other times, and a parabola through three of them gives a largest value to about 1e-4 (measured).
pub const LOOKED_AT: f64 = 1000.0;

/// Factor of the allowed difference of the largest spin, which is evaluated at the ends of steps only.
pub const STEP_ENDS: f64 = 1e4;

/// Factor of the allowed difference of errors between motions, which are found at evaluated times.
const ERRORS: f64 = 1e4;

/// Outputs that are known not to correspond, by a part of their name. Their differences are counted and shown
/// without failing; an entry is removed with its cause.
///
/// * The largest deflection of any node is found among a few evaluated times (to 0.3 %).
/// * Enriched bodies: rounding chooses the responses that join a body if its basis is nearly complete, and a
///   limit of the estimate decides on further rounds. FB548 states the estimate of a body that did not
///   benefit from enrichment.
pub const OPEN: [&str; 3] = ["largest deflection of the body", "percentages of FB548", ENRICHED];

/// Outputs that a transformation changes by definition, by a part of their names.
///
/// * The possible effect of loads on a free body until the end of its motion grows if the motion ends later.
/// * The largest rows of a motion lie between the instants of its table.
/// * Motion between the standard variations and the end lasts longer, too.
pub const CHANGED: [(&str, &str); 6] = [
    ("errors of the selected body", "start later"),
    ("largest of", "recover the table"),
    ("significances", "start later"),
    ("FB542", "start later"),
    ("FB543", "start later"),
    ("findings", "start later"),
];

/// End of the name of outputs that depend on the modes of an enriched body.
const ENRICHED: &str = "of an enriched body";

/// Factor of the allowed difference of percentages in messages, which have two or three digits.
const DIGITS: f64 = 2e5;

/// Returns the load cases of a verdict.
fn cases(subject: &Subject) -> Result<LoadCases> {
    let mut scenes = subject.scenes()?;
    scenes.iter_mut().for_each(|scene| scene.run.scheme = Scheme::Adaptive { tolerance: TOLERANCE });
    Ok(LoadCases::new(scenes).expect("a load case"))
}

/// Returns the distinct codes of findings in order.
pub fn codes(found: &[Diagnostic]) -> String {
    let codes: BTreeSet<&str> = found.iter().map(|one| one.code().id()).collect();
    codes.into_iter().collect::<Vec<_>>().join(" ")
}

/// Returns a decision in words as an output.
pub fn facts(name: &str, facts: String) -> Output {
    let values = Values::Facts(facts);
    Output {
        name: name.to_owned(),
        unit: [0; 3],
        values,
        derivative: None,
        least: 0.0,
        by_instant: false,
        slack: 1.0,
    }
}

/// Returns a number of the whole motion as an output.
pub fn number(name: &str, unit: [i32; 3], value: f64, least: f64) -> Output {
    let values = Values::Numbers(vec![value]);
    Output { values, unit, least, ..facts(name, String::new()) }
}

/// Returns the codes of findings, and the largest percentage in the messages of each code: a load in two parts has two
/// findings.
pub fn findings(found: &[Diagnostic]) -> Vec<Output> {
    let mut outputs = vec![facts("findings", codes(found))];
    let mut largest: BTreeMap<&str, f64> = BTreeMap::new();
    for one in found {
        let words: Vec<&str> = one.message().split_whitespace().collect();
        let numbers = words.windows(2).filter(|pair| pair[1].starts_with('%'));
        for number in numbers.filter_map(|pair| pair[0].parse::<f64>().ok()) {
            let most = largest.entry(one.code().id()).or_insert(number);
            *most = most.max(number);
        }
    }
    outputs.extend(largest.into_iter().map(|(code, number)| Output {
        values: Values::Numbers(vec![number]),
        slack: DIGITS,
        ..facts(&format!("percentages of {code}"), String::new())
    }));
    outputs
}

/// Returns errors over their tolerances as an output.
pub fn error(name: &str, errors: Vec<f64>) -> Output {
    /// Errors below this part of the tolerance are integration errors.
    const LEAST: f64 = 1e-3;
    Output { values: Values::Numbers(errors), least: LEAST, slack: ERRORS, ..facts(name, String::new()) }
}
