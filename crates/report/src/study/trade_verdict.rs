//! Verdict of a trade study in lines: request, recommendation, reason, error, savings, run.

use super::errors::{
    ReferenceErrorFacts, VariationFacts, errors_in_words, groups_in_words, in_words, ranges,
};
use super::integration::accuracy_key;
use crate::notation::numbers::{counted, duration, frequency, significant};
use flexbody_body::flex_body::Storage;
use flexbody_study::reference::ReferenceError;
use flexbody_study::trade::{InCase, InVariations, Measured, Recommendation, Trade, TradeRow};

/// Returns the lines with their labels. `names` are the names of the rows, `tolerances` the tolerances
/// of the scene in words, `reference_error` the error of a reference that deviates too much from its model.
pub(super) fn verdict_lines(
    trade: &Trade,
    names: &[String],
    tolerances: &str,
    reference_error: Option<&ReferenceError>,
) -> Vec<(&'static str, String)> {
    let asked = format!("{}: {}", trade.scene, asked(trade, tolerances));
    let Some(at) = trade.recommended.row() else {
        return vec![("Asked", asked), ("Result", nothing(trade))];
    };
    let row = &trade.rows[at];
    let Ok(measured) = &row.outcome else { return vec![("Asked", asked)] };
    let whole = trade.rows.first().and_then(|row| row.outcome.as_ref().ok());
    let mut lines = vec![
        ("Asked", asked),
        ("Recommended", recommended(row, has_several_sources(trade))),
        ("Why", why(trade, names, measured)),
        ("Error", error(trade, measured, reference_error)),
        ("Saves", whole.map_or_else(String::new, |whole| saves(whole, measured))),
    ];
    lines.extend(run(measured).map(|run| ("Run", run)));
    lines
}

fn asked(trade: &Trade, tolerances: &str) -> String {
    match trade.allowed {
        Some(allowed) => format!("the smallest error with at most {allowed} multiplications per evaluation"),
        None if trade.cases.len() > 1 => {
            format!(
                "in each of {} load cases errors of at most {tolerances} (the smallest tolerances of all cases)",
                trade.cases.len()
            )
        }
        None => format!("errors of at most {tolerances}"),
    }
}

fn nothing(trade: &Trade) -> String {
    if trade.allowed.is_some() {
        return "no candidate needs so few multiplications".to_owned();
    }
    let worst = trade.rows.iter().filter_map(|row| Some(row.outcome.as_ref().ok()?.worst()));
    match worst.fold(f64::INFINITY, f64::min) {
        worst if worst.is_finite() => {
            let worst = significant(worst, 3);
            format!(
                "no candidate is within the tolerances: the smallest error is {worst} times the tolerance"
            )
        }
        _ => "no candidate could be simulated".to_owned(),
    }
}

fn has_several_sources(trade: &Trade) -> bool {
    trade.rows.iter().any(|row| row.source != trade.rows[0].source)
}

/// Returns the recommended candidate in words: `5 modes (1, 3-4, 7, 9; up to 17.1 kHz) with W1, W2 and W3`;
/// with several sources also the modes that it was made from.
fn recommended(row: &TradeRow, names_source: bool) -> String {
    let candidate = &row.candidate;
    let numbers: Vec<usize> = candidate.modes.iter().map(|mode| mode + 1).collect();
    let mut words = format!(
        "{} ({}; up to {}) with {}",
        counted(numbers.len(), "mode"),
        ranges(&numbers),
        frequency(row.last_frequency_hz, 3),
        groups_in_words(&candidate.group_names())
    );
    if let Some(lumped) = &candidate.lumped {
        words.push_str(&format!(", {} {}", lumped.scheme(), lumped.part()));
    }
    if candidate.storage.name() == Storage::F32.name() {
        words.push_str(", stored as 32-bit floats");
    }
    if names_source {
        words.push_str(&format!(", made from {}", row.source));
    }
    words
}

/// Returns the reason in words; the next cheaper row of the front shows the error of a lower cost.
fn why(trade: &Trade, names: &[String], measured: &Measured) -> String {
    let count = trade.rows.len();
    let first = match trade.recommended {
        Recommendation::MostAccurate(_) => {
            format!("the smallest error of the candidates with so few multiplications ({count} compared)")
        }
        _ if trade.in_scene != trade.recommended => {
            format!(
                "the cheapest of {count} candidates with every error within the tolerances, in the scene and in its variations"
            )
        }
        _ => format!("the cheapest of {count} candidates with every error within the tolerances"),
    };
    let cheaper = trade.front.iter().rev().find_map(|&at| {
        let own = trade.rows[at].outcome.as_ref().ok()?;
        (own.multiplications < measured.multiplications).then_some((at, own))
    });
    let Some((at, own)) = cheaper else { return first };
    format!("{first}; the next cheaper one, {}, {}", names[at], against(trade, own))
}

/// Returns what speaks against a candidate that is cheaper than the recommended one.
fn against(trade: &Trade, own: &Measured) -> String {
    let case = &trade.cases[own.case];
    let (output, error, allowed) = own.decisive_case().errors.decisive(&case.tolerance);
    let part = error / allowed;
    let fails = own.varied.as_ref().filter(|varied| varied.beyond > 0);
    if let Some(varied) = fails.filter(|_| part + case.reserved <= 1.0) {
        return format!("holds in the scene and {}", in_variation(trade, varied));
    }
    let reference = if part <= 1.0 && case.reserved > 0.0 {
        format!(
            ", and the error of the reference is another {} times the tolerance",
            significant(case.reserved, 2)
        )
    } else {
        String::new()
    };
    let times = significant(part, 2);
    format!("has an error in {output} of {times} times the tolerance{}{reference}", in_case(trade, own))
}

/// Returns the largest error of a candidate in a variation.
fn in_variation(trade: &Trade, varied: &InVariations) -> String {
    let name = &trade.variations[varied.variation].name;
    if varied.worst <= 1.0 {
        return format!(
            "cannot be judged where {name}: the reference differs too much from the FE model there"
        );
    }
    format!("takes {} times the tolerances where {name}", significant(varied.worst, 2))
}

/// Returns the errors of the recommended row in variations, and a cheaper row that fails there; `None` if no row was
/// judged.
pub(super) fn varied_line(
    trade: &Trade,
    variations: &[VariationFacts<'_>],
    names: &[String],
) -> Option<String> {
    let words = in_words(variations)?;
    let cheaper = trade.in_scene.row().filter(|_| trade.in_scene != trade.recommended);
    let Some((row, varied)) =
        cheaper.and_then(|row| Some((row, trade.rows[row].outcome.as_ref().ok()?.varied.as_ref()?)))
    else {
        return Some(words);
    };
    Some(format!("{words}; cheaper, {} holds in the scene and {}", names[row], in_variation(trade, varied)))
}

/// Returns ` in case braking` if there are several load cases; empty otherwise.
fn in_case(trade: &Trade, measured: &Measured) -> String {
    let name = trade.cases[measured.case].name.as_ref();
    name.map_or_else(String::new, |name| format!(" in case {name}"))
}

fn error(trade: &Trade, measured: &Measured, reference_error: Option<&ReferenceError>) -> String {
    let InCase { errors, worst, growth } = measured.decisive_case();
    let growth = growth.map_or_else(String::new, |growth| {
        format!(
            "; the error grows with time: from the first to the second half of the run {} times more than the motion",
            significant(growth, 2)
        )
    });
    let worst = significant(100.0 * worst, 2);
    let case = in_case(trade, measured);
    let reference_error = reference_error.map_or_else(String::new, |own| {
        let parts = ReferenceErrorFacts::new(own).parts();
        format!("; the reference itself differs from the FE model by {parts} (estimated), too much for a reference")
    });
    format!("{}: {worst} % of the tolerance{case}{growth}{reference_error}", errors_in_words(errors))
}

fn saves(whole: &Measured, candidate: &Measured) -> String {
    let run = if candidate.by_case.len() > 1 { "the runs of all load cases" } else { "this run" };
    let ratio = |before: f64, after: f64| significant(before / after, 2);
    let work = ratio(whole.multiplications as f64, candidate.multiplications as f64);
    if whole.multiplications == candidate.multiplications {
        return "nothing: no cheaper candidate is within the tolerances".to_owned();
    }
    let times = whole
        .timed
        .as_ref()
        .zip(candidate.timed.as_ref())
        .map(|(whole, own)| (whole.seconds(), own.seconds()));
    let seconds = times.map_or_else(String::new, |(before, after)| {
        let (shorter, longer) = (duration(after), duration(before));
        format!(
            "; {shorter} instead of {longer} for {run} in flexbody, {} times faster",
            ratio(before, after)
        )
    });
    format!("{work} times fewer multiplications per evaluation{seconds}")
}

/// Returns the cheapest run of the recommended row within the tolerances: the accuracy of its integration, its error and
/// its time.
fn run(measured: &Measured) -> Option<String> {
    let timed = measured.timed.as_ref()?;
    let key = accuracy_key(timed.decisive().scheme);
    let (worst, seconds) = (significant(100.0 * timed.worst(), 2), duration(timed.seconds()));
    let runs = if timed.runs.len() > 1 { "all load cases together" } else { "the run" };
    Some(format!(
        "with `{key}` in [run] of the scene {runs} takes {seconds}, and the error is {worst} % of the tolerance"
    ))
}
