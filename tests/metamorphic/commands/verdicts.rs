//! Commands `select`, `trade` and `convert --scene`.

use super::{ENRICHED, cases, error, facts, findings};
use crate::outputs::{Output, Outputs};
use crate::subject::{Basis, Subject};
use flexbody_base::error::Result;
use flexbody_linalg::context::Context;
use flexbody_study::recipe::Recipe;
use flexbody_study::reference::ReferenceError;
use flexbody_study::selection::{Selection, select};
use flexbody_study::tailoring::{Tailoring, convert_for};
use flexbody_study::trade::{CandidateKind, Source, TradeRow, TradeSettings, trade};

/// Errors over their tolerances are compared up to this value.
const BEYOND: f64 = 2.0;

/// Returns the outputs of a selection among `modes` modes.
///
/// Bodies that are enriched with responses to residual forces depend on rounding, so that their modes and
/// dependent outputs are open.
fn outputs(subject: &Subject, selection: &Selection, modes: usize) -> Outputs {
    let is_enriched = matches!(subject.basis, Basis::Lowest(count) if modes > count);
    let name = |name: &str| if is_enriched { format!("{name} {ENRICHED}") } else { name.to_owned() };
    let Selection { groups, guideline, chosen, n_modes, .. } = selection;
    let mut all = vec![
        facts(&name("groups"), format!("{groups:?}, {guideline}")),
        facts(&name("verdict"), format!("{}", selection.holds())),
        facts(&name("modes"), format!("{:?} of {n_modes}, at first {modes}", selection.modes)),
    ];
    if let Some(chosen) = chosen {
        all.push(error(&name("errors of the selected body"), vec![chosen.worst]));
    }
    let sizes = selection.significances.iter().flat_map(|one| [Some(one.bound), one.of_body]);
    all.push(error(&name("significances"), sizes.flatten().collect()));
    let told = findings(&selection.diagnostics);
    all.extend(told.into_iter().map(|output| Output { name: name(&output.name), ..output }));
    Outputs { times: Vec::new(), all }
}

/// Runs `select` on a body.
pub fn select_body(subject: &Subject) -> Result<Outputs> {
    let body = subject.body()?;
    let selection = select(&body, &[], &cases(subject)?, &Context::QUIET)?;
    Ok(outputs(subject, &selection, body.n_modes()))
}

fn tailoring(subject: &Subject) -> Tailoring {
    Tailoring { settings: subject.settings(), by_band: false, of_motion: false }
}

/// Runs `select` on a model.
pub fn select_model(subject: &Subject) -> Result<Outputs> {
    let (model, scenes) = (subject.model()?, cases(subject)?);
    let enriched = tailoring(subject).convert(&model, &scenes, &Context::QUIET)?;
    let body = &enriched.made.body;
    let selection = select(body, &enriched.rounds, &scenes, &Context::QUIET)?;
    let mut outputs = outputs(subject, &selection, body.n_modes());
    let first = enriched.rounds.iter().filter_map(|rounds| Some(rounds.first()?.worst.min(BEYOND)));
    outputs.all.push(error("errors of the first body", vec![first.fold(0.0, f64::max)]));
    Ok(outputs)
}

/// Runs `convert --scene`.
pub fn conversion(subject: &Subject) -> Result<Outputs> {
    let (model, scenes) = (subject.model()?, cases(subject)?);
    let (made, selection) = convert_for(&model, &tailoring(subject), &scenes, &Context::QUIET)?;
    let mut outputs = outputs(subject, &selection, made.body.n_modes());
    let told = findings(&made.diagnostics).into_iter();
    outputs.all.extend(
        told.map(|output| Output { name: format!("conversion: {} {ENRICHED}", output.name), ..output }),
    );
    let reference_errors = selection.reference_errors.last().map(ReferenceError::is_reference);
    outputs.all.push(facts(&format!("reference {ENRICHED}"), format!("{reference_errors:?}")));
    Ok(outputs)
}

/// Runs `trade` on a body against the motion of all nodes.
pub fn trading(subject: &Subject) -> Result<Outputs> {
    let (model, scenes) = (subject.model()?, cases(subject)?);
    let settings = TradeSettings { repeat: 1, reserved: &[], varied: None };
    let source = Source::new("body", subject.body()?, Recipe::File, None)?;
    let study = trade(&[source], &scenes, Some(&model), &settings, &Context::QUIET)?;
    // Candidates with rounded numbers differ for a rotated body.
    let exact = |row: &&TradeRow| row.candidate.kind() != CandidateKind::Single;
    let rows: Vec<&TradeRow> = study.rows.iter().filter(exact).collect();
    let labels: Vec<String> = rows
        .iter()
        .map(|row| format!("{:?} {:?} {}", row.candidate.modes, row.candidate.groups, row.outcome.is_ok()))
        .collect();
    let errors =
        rows.iter().filter_map(|row| row.outcome.as_ref().ok()).map(|measured| measured.worst().min(BEYOND));
    let mut all =
        vec![facts("candidates", labels.join("; ")), error("errors of the candidates", errors.collect())];
    let recommended = study.recommended.row().map(|row| &study.rows[row].candidate);
    all.push(facts("recommended", format!("{:?}", recommended.map(|one| (&one.modes, one.groups)))));
    all.extend(findings(&study.diagnostics));
    Ok(Outputs { times: Vec::new(), all })
}
