//! Trade study: every candidate is simulated, its errors are measured, then its times.

use super::candidate::{ladder, whole_candidates};
use super::case::{Judge, StudyCase};
use super::progress::Progress;
use super::{
    Candidate, Failed, InCase, Measured, NodalIntegration, NodalReference, Recommendation, Source, Timed,
    TradeRow, TradeVariation, Varied, front,
};
use crate::selection::{fewest, first_of, most_excited_modes};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_body::flex_body::{FlexBody, Storage, TermGroups};
use flexbody_linalg::context::Context;
use flexbody_linalg::parallel;
use flexbody_linalg::ties::first_largest;
use flexbody_model::FeModel;
use flexbody_motion::scene::{LoadCases, Measure, Scene, StressError, Tolerance, ends_a_run};

/// Settings of a trade study.
#[derive(Debug, Clone, Copy)]
pub struct TradeSettings<'s> {
    /// Number of integrations per candidate, of which the median time counts. Fewer if an integration takes long.
    pub repeat: usize,
    /// Part of the tolerances that the truncation error of the reference takes, in each load case: candidates get the
    /// rest. Cases beyond its length count as zero.
    pub reserved: &'s [f64],
    /// Variations of the scene that the cheapest candidates are judged on; `None` to judge on the scene alone.
    pub varied: Option<&'s Varied>,
}

/// Requested reference motion for the errors of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, strum::IntoStaticStr, strum::VariantArray)]
#[strum(serialize_all = "lowercase")]
pub enum ReferenceChoice {
    /// Motion of the body with all its modes and groups.
    #[default]
    Full,
    /// Motion of a body that is enriched until its estimated truncation error is at most one hundredth of the
    /// tolerances: suitable for large models and long scenes. A warning is given if this is not reached.
    Fine,
    /// Motion of all nodes of the model.
    Nodal,
}

impl ReferenceChoice {
    /// Every choice, in the order of the documentation.
    pub const ALL: &'static [Self] = <Self as strum::VariantArray>::VARIANTS;

    /// Returns the name on the command line.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// Reference motion of the errors of a study: of a body (also a fine one), or of all nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ReferenceKind {
    /// Motion of the first source with all its modes and groups.
    Full,
    /// Unreduced equations of all nodes.
    Nodal,
}

/// Result of a trade study.
#[derive(Debug, Clone, PartialEq)]
pub struct Trade {
    /// Name of the scene.
    pub scene: String,
    /// Name of the model of the body.
    pub body: String,
    /// Reference motion of the errors.
    pub reference: ReferenceKind,
    /// Load cases; one for a scene without load cases.
    pub cases: Vec<TradeCase>,
    /// Smallest tolerances of all load cases.
    pub tolerance: Tolerance,
    /// Multiplications that the scene allows; `None` if tolerances decide.
    pub allowed: Option<usize>,
    /// All candidates; the first is the whole body of the reference.
    pub rows: Vec<TradeRow>,
    /// Rows of the Pareto front, ascending in cost.
    pub front: Vec<usize>,
    /// Recommended row: the cheapest that holds in the scene and in the variations that it requires or, without one, in the
    /// scene alone.
    pub recommended: Recommendation,
    /// Row that the scene alone would recommend.
    pub in_scene: Recommendation,
    /// Variations that candidates were judged on.
    pub variations: Vec<TradeVariation>,
    /// Warnings and notes about the motion of the reference.
    pub diagnostics: Vec<Diagnostic>,
}

/// Load case of a study, or its single scene.
#[derive(Debug, Clone, PartialEq)]
pub struct TradeCase {
    /// Name of the load case; `None` for a single scene.
    pub name: Option<String>,
    /// Tolerances of the load case.
    pub tolerance: Tolerance,
    /// Part of the tolerances that the truncation error of the reference and its missing stress stiffness take: candidates
    /// get the rest.
    pub reserved: f64,
    /// Error of the missing stress stiffness of the spin in the motion of the reference; `None` if nothing is missing, or if
    /// the error is a small part of the tolerances.
    pub stress_error: Option<StressError>,
    /// Integration of the equations of all nodes; `None` if they are not the reference.
    pub nodal: Option<NodalIntegration>,
    /// Recommended row if this were the only load case.
    pub alone: Recommendation,
    /// Number of candidates that are cheaper than the recommended one and exceed the tolerances in this case.
    pub ruled_out: usize,
    /// Number of these candidates that no other case rules out.
    pub ruled_out_alone: usize,
}

impl Trade {
    /// Returns true if the stress stiffness that the reference does not have leaves at least half of the tolerances in every
    /// load case.
    pub fn is_stressed(&self) -> bool {
        self.cases.iter().filter_map(|case| case.stress_error.as_ref()).all(StressError::is_small)
    }

    /// Returns true if the recommended row holds in all required variations.
    pub fn holds_in_required_variations(&self) -> bool {
        let recommended = self.recommended.row().and_then(|row| self.rows[row].outcome.as_ref().ok());
        let are_required = self.variations.iter().any(|variation| variation.is_required);
        !are_required || recommended.is_none_or(Measured::holds_in_variations)
    }

    /// Returns the tolerances of a load case (from 0).
    pub fn tolerance(&self, case: usize) -> &Tolerance {
        &self.cases[case].tolerance
    }
}

/// Measures every candidate of `sources` in each load case. One body must serve all cases, so that the worst case
/// counts. The first source is the reference; others must be related to it by [`Source::beside`].
///
/// Errors are those of the model: all candidates are integrated with the method and the step of the reference, in
/// parallel. Afterwards the candidates that may be chosen are timed one after the other, with the simulations of all
/// cases together. All results except times are independent of the number of threads.
///
/// * `nodal`: the model, if errors are measured against the motion of all its nodes.
///
/// # Errors
/// The errors of [`trace`](flexbody_motion::scene::trace) and [`NodalReference::new`] for the reference; FB601 for too
/// little memory; errors of writing a file to the temporary folder.
pub fn trade(
    sources: &[Source],
    cases: &LoadCases,
    nodal: Option<&FeModel>,
    settings: &TradeSettings<'_>,
    context: &Context<'_>,
) -> Result<Trade> {
    let Some(source) = sources.first() else {
        return Err(Diagnostic::new(Code::Usage, "no candidate can be compared").into());
    };
    let studied = |(at, scene): (usize, &Scene)| {
        let taken = settings.reserved.get(at).copied().unwrap_or(0.0);
        let name = cases.case_name(at).map(str::to_owned);
        StudyCase::new(sources, scene, name, nodal, taken, context).map_err(|error| cases.about(at, error))
    };
    // One body serves all load cases, so that the strictest limits apply.
    let allowed = cases.iter().filter_map(|scene| scene.requirements.multiplications).min();
    let (scene, tolerance) = (cases.name().to_owned(), cases.least_tolerance());
    let cases = cases.iter().enumerate().map(studied).collect::<Result<Vec<_>>>()?;
    let measures = cases.iter().map(StudyCase::measure).collect();
    let job = Job { cases: &cases, measures, allowed };
    let mut rows = job.rows(context)?;
    // Judge the cheapest candidates on motions that their bodies were not made for.
    let in_scene = Recommendation::new(&rows, allowed);
    let judge = settings.varied.filter(|varied| !varied.variations.is_empty()).map(|varied| {
        let names: Vec<Option<String>> = cases.iter().map(|case| case.name.clone()).collect();
        Judge::new(varied, sources, &names, context)
    });
    let judge = judge.transpose()?;
    let recommended = match &judge {
        Some(judge) if !judge.variations().is_empty() => judge.recommend(&mut rows, in_scene, context)?,
        _ => in_scene,
    };
    job.time_what_is_worth_it(&mut rows, recommended, settings.repeat, context)?;
    let of_variations = judge.as_ref().map_or(&[][..], Judge::diagnostics);
    let diagnostics = cases.iter().flat_map(|case| &case.diagnostics).chain(of_variations);
    let seen = |at: usize| TradeCase::new(at, &cases[at], &rows, recommended);
    Ok(Trade {
        scene,
        tolerance,
        body: source.body().description().name.clone(),
        reference: if nodal.is_some() { ReferenceKind::Nodal } else { ReferenceKind::Full },
        allowed,
        front: front(&rows),
        recommended,
        in_scene,
        variations: judge.as_ref().map_or_else(Vec::new, |judge| judge.variations().to_vec()),
        cases: (0..cases.len()).map(seen).collect(),
        rows,
        diagnostics: diagnostics.cloned().collect(),
    })
}

impl TradeCase {
    fn new(at: usize, case: &StudyCase<'_>, rows: &[TradeRow], recommended: Recommendation) -> Self {
        let is_within = |measured: &Measured, at: usize, most: f64| measured.by_case[at].worst <= most;
        let most = case.most();
        let taken = recommended.row().and_then(|row| rows[row].outcome.as_ref().ok());
        let is_cheaper =
            |own: &&Measured| taken.is_none_or(|taken| own.multiplications < taken.multiplications);
        let exact = rows.iter().filter(|row| row.candidate.lumped.is_none());
        let cheaper = exact.filter_map(|row| row.outcome.as_ref().ok()).filter(is_cheaper);
        let ruled_out: Vec<&Measured> = cheaper.filter(|own| !is_within(own, at, most)).collect();
        Self {
            name: case.name.clone(),
            tolerance: case.scene.requirements.tolerance,
            reserved: case.reserved,
            stress_error: case.stress_error.clone(),
            nodal: case.nodal.as_ref().map(NodalReference::integration),
            alone: Recommendation::cheapest(rows, |measured| is_within(measured, at, most)),
            ruled_out_alone: ruled_out.iter().filter(|own| own.beyond == 1).count(),
            ruled_out: ruled_out.len(),
        }
    }
}

/// Common data of all candidates.
struct Job<'j> {
    cases: &'j [StudyCase<'j>],
    /// Measure of each load case.
    measures: Vec<Measure<'j>>,
    /// Multiplications that the scene allows; `None` if tolerances decide.
    allowed: Option<usize>,
}

impl Job<'_> {
    /// Returns the bodies from which candidates are made, in the frame of the first case.
    fn sources(&self) -> &[Source] {
        &self.cases[0].sources
    }

    /// Measures every candidate in parallel.
    fn rows(&self, context: &Context<'_>) -> Result<Vec<TradeRow>> {
        let carried = self.cases.iter().any(|case| case.scene.carried.is_some());
        let whole = whole_candidates(self.sources(), carried);
        let mut rows = self.errors(whole, "errors of whole bodies", context)?;
        // Sets of groups that are hopeless with all modes are not combined with fewer.
        let worst_of = |groups: TermGroups| {
            let has_groups = |row: &&TradeRow| {
                let own = &row.candidate;
                own.source == 0 && own.groups == groups && own.lumped.is_none() && own.storage == Storage::F64
            };
            let measured = rows.iter().find(has_groups).and_then(|row| row.outcome.as_ref().ok());
            measured.map_or(f64::INFINITY, Measured::worst)
        };
        let motions = self.cases.iter().map(|case| (case.sources[0].body(), &case.scene, &case.motion));
        let most_excited = most_excited_modes(&motions.collect::<Vec<_>>())?;
        let some_modes = ladder(self.sources(), &most_excited, carried, worst_of);
        rows.extend(self.errors(some_modes, "errors of fewer modes", context)?);
        // Refine the number of modes near the tolerance.
        self.refine(&most_excited, &mut rows, context)?;
        Ok(rows)
    }

    /// Bisects the number of modes between the cheapest candidate that holds and the largest smaller one that does not,
    /// as a selection does.
    fn refine(&self, most_excited: &[usize], rows: &mut Vec<TradeRow>, context: &Context<'_>) -> Result<()> {
        if self.allowed.is_some() {
            return Ok(());
        }
        let is_exact =
            |own: &Candidate| own.source == 0 && own.lumped.is_none() && own.storage == Storage::F64;
        let enough = rows.iter().filter(|row| is_exact(&row.candidate)).filter_map(|row| {
            let measured = row.outcome.as_ref().ok().filter(|measured| measured.holds())?;
            Some((measured.multiplications, &row.candidate))
        });
        // Cheapest candidate that holds, and the order in which its modes were taken.
        let Some((_, best)) = enough.min_by_key(|own| own.0) else { return Ok(()) };
        let best = best.clone();
        let count = best.modes.len();
        let lowest: Vec<usize> = (0..most_excited.len()).collect();
        let by_frequency = count < lowest.len() && best.modes == lowest[..count];
        let order = if by_frequency { &lowest[..] } else { most_excited };
        if first_of(order, count) != best.modes {
            return Ok(());
        }
        let with = |count: usize| Candidate { modes: first_of(order, count), ..best.clone() };
        // Largest measured number of modes in this order that does not hold.
        let is_rung = |row: &&TradeRow| row.candidate == with(row.candidate.modes.len());
        let fewer = rows.iter().filter(|row| row.candidate.modes.len() < count).filter(is_rung);
        let too_few = fewer.map(|row| row.candidate.modes.len()).max().unwrap_or(0);
        context.phase("number of modes");
        // The limits were checked before the first candidate.
        let unlimited = Context { memory: None, ..*context };
        fewest(too_few, count, |count| {
            let row = self.measure(with(count), &unlimited)?;
            let passed = row.outcome.as_ref().is_ok_and(|measured| measured.holds());
            rows.push(row);
            Ok(passed)
        })?;
        Ok(())
    }

    /// Times the candidates that may be chosen, one after the other.
    fn time_what_is_worth_it(
        &self,
        rows: &mut [TradeRow],
        recommended: Recommendation,
        repeat: usize,
        context: &Context<'_>,
    ) -> Result<()> {
        let recommended = recommended.row();
        let mut worth_it: Vec<usize> = front(rows).into_iter().chain(recommended).chain([0]).collect();
        worth_it.sort_unstable();
        worth_it.dedup();
        let progress = Progress::new(context, "times", worth_it.len());
        for at in worth_it {
            self.time(&mut rows[at], repeat)?;
            progress.step();
        }
        Ok(())
    }

    /// Returns the rows of candidates, without times.
    fn errors(
        &self,
        all: Vec<Candidate>,
        phase: &'static str,
        context: &Context<'_>,
    ) -> Result<Vec<TradeRow>> {
        let progress = Progress::new(context, phase, all.len());
        parallel::try_map(all, |candidate| {
            progress.follow(self.cases.len(), |context| self.measure(candidate, context))
        })
    }

    /// Measures a candidate, without times. An error that ends its simulation becomes the outcome of the row.
    fn measure(&self, candidate: Candidate, context: &Context<'_>) -> Result<TradeRow> {
        let source = &self.sources()[candidate.source];
        let last = candidate.modes.last().copied().unwrap_or(0);
        let outcome = match self.measured(&candidate, context) {
            Ok(measured) => Ok(measured),
            // A lumped mass matrix may be unphysical: its error becomes the outcome of the row.
            Err(error)
                if candidate.lumped.is_some() || error.diagnostics().iter().all(|d| ends_a_run(d.code())) =>
            {
                Err(Failed(error.first_error().clone()))
            }
            Err(error) => return Err(error),
        };
        Ok(TradeRow {
            source: source.name().to_owned(),
            last_frequency_hz: source.body().frequencies_hz()[last],
            candidate,
            outcome,
        })
    }

    fn measured(&self, candidate: &Candidate, context: &Context<'_>) -> Result<Measured> {
        let (mut by_case, mut multiplications, mut bytes) = (Vec::new(), 0, 0);
        for (case, measure) in self.cases.iter().zip(&self.measures) {
            let body = case.body(candidate)?;
            if by_case.is_empty() {
                bytes = file_size(&body)?;
            }
            let (own, cost) = case.measured(measure, candidate, &body, context).map_err(|error| {
                Error::new(error.diagnostics().iter().cloned().map(|said| case.about(said)).collect())
            })?;
            multiplications = multiplications.max(cost);
            by_case.push(own);
        }
        let worst = |at: &usize| by_case[*at].worst;
        let largest = first_largest(0..by_case.len(), worst);
        let within = |(own, case): (&InCase, &StudyCase<'_>)| own.worst <= case.most();
        let beyond = by_case.iter().zip(self.cases).filter(|pair| !within(*pair)).count();
        Ok(Measured {
            case: largest.expect("a load case"),
            beyond,
            by_case,
            multiplications,
            bytes,
            preprocessing: self.sources()[candidate.source].preprocessing(),
            varied: None,
            timed: None,
        })
    }

    /// Times the cheapest run of a row within the tolerances in every load case.
    fn time(&self, row: &mut TradeRow, repeat: usize) -> Result<()> {
        let Ok(measured) = &mut row.outcome else { return Ok(()) };
        let mut all = Timed { evaluation: 0.0, runs: Vec::new() };
        for ((case, measure), accurate) in self.cases.iter().zip(&self.measures).zip(&measured.by_case) {
            let body = case.body(&row.candidate)?;
            match case.time(measure, &row.candidate, &body, accurate, repeat) {
                Ok((run, evaluation)) => {
                    all.runs.push(run);
                    all.evaluation = all.evaluation.max(evaluation);
                }
                Err(error) => {
                    row.outcome = Err(Failed(case.about(error.first_error().clone())));
                    return Ok(());
                }
            }
        }
        measured.timed = Some(all);
        Ok(())
    }
}

/// Returns the size of the file of `body` in bytes, which is written to the temporary folder and removed.
fn file_size(body: &FlexBody) -> Result<u64> {
    let name = format!("flexbody-trade-{}.flex.h5", std::process::id());
    let slot = flexbody_file::prepare_output(std::env::temp_dir().join(name))?;
    flexbody_file::fill_slot(body, &slot)?;
    Ok(std::fs::metadata(slot.temporary()).map_or(0, |meta| meta.len()))
}
