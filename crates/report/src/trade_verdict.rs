//! Verdict of a trade study in five lines: request, recommendation, reason, error, savings.

use super::errors_in_words::errors_in_words;
use super::lacks::LackFacts;
use super::numbers::{duration, significant};
use super::variations::{VariationFacts, in_words};
use flexbody_study::reference::ReferenceError;
use flexbody_study::trade::{InCase, Measured, Recommendation, Trade, TradeRow};

/// Returns the five lines with their labels. `names` are the names of the rows, `tolerances` the tolerances
/// of the scene in words, `lacking` the error of a reference that deviates too much from its model.
pub(super) fn verdict_lines(
    trade: &Trade,
    names: &[String],
    tolerances: &str,
    lacking: Option<&ReferenceError>,
) -> Vec<(&'static str, String)> {
    let asked = format!("{}: {}", trade.scene, asked(trade, tolerances));
    let Some(at) = trade.recommended.row() else {
        return vec![("Asked", asked), ("Result", nothing(trade))];
    };
    let row = &trade.rows[at];
    let Ok(measured) = &row.outcome else { return vec![("Asked", asked)] };
    let whole = trade.rows.first().and_then(|row| row.outcome.as_ref().ok());
    vec![
        ("Asked", asked),
        ("Take", taken(&names[at], row)),
        ("Why", why(trade, names, measured)),
        ("Error", error(trade, measured, lacking)),
        ("Saves", whole.map_or_else(String::new, |whole| saves(whole, measured))),
    ]
}

fn asked(trade: &Trade, tolerances: &str) -> String {
    match trade.allowed {
        Some(allowed) => format!("the most accurate of at most {allowed} multiplications per evaluation"),
        None if trade.cases.len() > 1 => {
            format!("in {} load cases errors of at most {tolerances} (the least of any)", trade.cases.len())
        }
        None => format!("errors of at most {tolerances}"),
    }
}

fn nothing(trade: &Trade) -> String {
    if trade.allowed.is_some() {
        return "no candidate is as cheap as allowed".to_owned();
    }
    let worst = trade.rows.iter().filter_map(|row| Some(row.outcome.as_ref().ok()?.worst()));
    match worst.fold(f64::INFINITY, f64::min) {
        worst if worst.is_finite() => {
            let worst = significant(worst, 3);
            format!(
                "no candidate is within the tolerances: the best has {worst} times the error that is allowed"
            )
        }
        _ => "no candidate could be simulated".to_owned(),
    }
}

fn taken(name: &str, row: &TradeRow) -> String {
    format!("{} (to {} Hz), of: {}", name, significant(row.last_frequency_hz, 3), row.source)
}

/// Returns the reason in words; the next cheaper row of the front shows the error of a lower cost.
fn why(trade: &Trade, names: &[String], measured: &Measured) -> String {
    let count = trade.rows.len();
    let first = match trade.recommended {
        Recommendation::MostAccurate(_) => {
            format!("the most accurate of {count} candidates that is as cheap as allowed")
        }
        _ => format!("the cheapest of {count} candidates with every error within the tolerances"),
    };
    let cheaper = trade.front.iter().rev().find_map(|&at| {
        let own = trade.rows[at].outcome.as_ref().ok()?;
        (own.multiplications < measured.multiplications).then_some((at, own))
    });
    let Some((at, own)) = cheaper else { return first };
    let case = &trade.cases[own.case];
    let (output, error, allowed) = own.deciding().errors.decisive(&case.tolerance);
    let part = error / allowed;
    let times = significant(part, 2);
    let reference = if part <= 1.0 && case.reserved > 0.0 {
        format!(", beside the {} that the reference itself lacks", significant(case.reserved, 2))
    } else {
        String::new()
    };
    format!(
        "{first}; the next cheaper one, {}, is off in {output} by {times} times what is allowed{}{reference}",
        names[at],
        in_case(trade, own)
    )
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
    let (name, times) = (&trade.variations[varied.variation].name, significant(varied.worst, 2));
    Some(format!(
        "{words}; cheaper, {} holds in the scene and takes {times} times the tolerances where {name}",
        names[row]
    ))
}

/// Returns ` in case braking` if there are several load cases; empty otherwise.
fn in_case(trade: &Trade, measured: &Measured) -> String {
    let name = trade.cases[measured.case].name.as_ref();
    name.map_or_else(String::new, |name| format!(" in case {name}"))
}

fn error(trade: &Trade, measured: &Measured, lacking: Option<&ReferenceError>) -> String {
    let InCase { errors, worst, growth } = measured.deciding();
    let growth = growth.map_or_else(String::new, |growth| {
        format!(
            "; grows with time, {} times more than the motion from the first half to the second",
            significant(growth, 2)
        )
    });
    let worst = significant(100.0 * worst, 2);
    let case = in_case(trade, measured);
    let lacking = lacking.map_or_else(String::new, |own| {
        let parts = LackFacts::new(own).parts();
        format!("; the reference itself lacks {parts} of the FE model (estimated), too much to be measured against")
    });
    format!("{}: {worst} % of what is allowed{case}{growth}{lacking}", errors_in_words(errors))
}

fn saves(whole: &Measured, own: &Measured) -> String {
    let run = if own.by_case.len() > 1 { "the runs of all load cases" } else { "this run" };
    let ratio = |whole: f64, own: f64| significant(whole / own, 2);
    let work = ratio(whole.multiplications as f64, own.multiplications as f64);
    if whole.multiplications == own.multiplications {
        return "nothing: no cheaper candidate is within the tolerances".to_owned();
    }
    let times = whole.timed.zip(own.timed).map(|(before, after)| (before.integration, after.integration));
    let seconds = times.map_or_else(String::new, |(before, after)| {
        let (own, all) = (duration(after), duration(before));
        format!("; {own} instead of {all} for {run} in flexbody, {} times less", ratio(before, after))
    });
    format!("{work} times fewer multiplications per evaluation{seconds}")
}
