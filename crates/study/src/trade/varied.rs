//! Judgement of candidates on variations of the scene that their bodies were not made for.

use super::case::StudyCase;
use super::{Candidate, InCase, Measured, Recommendation, Source, TradeRow, front, reserved};
use crate::reference::ReferenceError;
use crate::selection::stops;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_linalg::context::Context;
use flexbody_linalg::parallel;
use flexbody_motion::scene::{LoadCases, Measure, SceneVariation, Tolerance, ends_a_run};

/// Largest number of candidates that are judged on variations. More cost time where no cheap candidate holds.
const MOST_JUDGED: usize = 8;

/// Bodies and scenes of the variations of a study.
#[derive(Debug, Clone, Default)]
pub struct Varied {
    /// Variations; empty if candidates are judged on the scene alone.
    pub variations: Vec<SceneVariation>,
    /// True if the scene file states the variations; false for the standard ones.
    pub are_stated: bool,
    /// Reference of the variations, made for them, followed by every source of the study related to it. Empty if the
    /// sources of the study serve as they are, as those of a flex-body file do.
    pub sources: Vec<Source>,
    /// Truncation errors of this reference in each variation.
    pub reference_errors: Vec<Vec<ReferenceError>>,
    /// Diagnostics about this reference.
    pub diagnostics: Vec<Diagnostic>,
}

impl Varied {
    /// Returns the variations of `cases` for a body of a flex-body file, which is its own reference in them.
    pub fn of_body(cases: &LoadCases, dimension: usize) -> Self {
        Self {
            variations: cases.variations(dimension),
            are_stated: cases.states_variations(),
            ..Self::default()
        }
    }
}

/// Variation of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct TradeVariation {
    /// Name of the variation.
    pub name: String,
    /// Name of the load case that it varies; `None` for a single scene.
    pub case: Option<String>,
    /// True if the scene file states the variation, so that a recommended body must hold in it; false for a standard one.
    pub is_stated: bool,
    /// Tolerances.
    pub tolerance: Tolerance,
    /// Part of the tolerances that the truncation error of the reference takes.
    pub reserved: f64,
    /// Truncation error of the reference; `None` if unknown.
    pub reference: Option<ReferenceError>,
}

impl TradeVariation {
    /// Returns true if these errors are within the tolerances that the reference leaves, and it is a reference. False if
    /// the simulation stopped.
    pub fn accepts(&self, errors: Option<&InCase>) -> bool {
        let is_reference = self.reference.as_ref().is_none_or(ReferenceError::is_reference);
        is_reference && errors.is_some_and(|own| own.worst <= 1.0 - self.reserved)
    }
}

/// Errors of a candidate in the variations of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct InVariations {
    /// Errors in each variation; `None` where its simulation stopped.
    pub by_variation: Vec<Option<InCase>>,
    /// Index of the variation with the largest ratio of error to tolerance.
    pub variation: usize,
    /// Largest ratio of error to tolerance; infinite if a simulation stopped.
    pub worst: f64,
    /// Number of variations whose errors exceed the tolerances that the reference leaves.
    pub beyond: usize,
}

/// Variations with the motion of their reference.
pub(super) struct Judge<'j> {
    cases: Vec<StudyCase<'j>>,
    variations: Vec<TradeVariation>,
    /// Notes about variations that cannot be simulated.
    diagnostics: Vec<Diagnostic>,
    /// Number of sources before the first source of the study.
    before: usize,
}

impl<'j> Judge<'j> {
    /// Simulates the reference in every variation. `names` are the names of the load cases. A standard variation whose
    /// simulation stops is left out.
    ///
    /// # Errors
    /// The errors of [`trade`](super::trade).
    pub(super) fn new(
        varied: &Varied,
        sources: &[Source],
        names: &[Option<String>],
        context: &Context<'_>,
    ) -> Result<Self> {
        let (sources, before) = match varied.sources.is_empty() {
            true => (sources, 0),
            false => (&varied.sources[..], 1),
        };
        let reserved = reserved(&varied.reference_errors, false);
        let (mut cases, mut variations, mut diagnostics) = (Vec::new(), Vec::new(), Vec::new());
        for (at, one) in varied.variations.iter().enumerate() {
            let reserved = reserved.get(at).copied().unwrap_or(0.0);
            let about = format!("variation `{}`", one.name);
            let case = StudyCase::new(sources, &one.scene, Some(one.name.clone()), None, reserved, context);
            let case = match case {
                Ok(case) => case,
                Err(error) => match stops(&error, one).filter(|_| !varied.are_stated) {
                    Some(note) => {
                        diagnostics.push(note);
                        continue;
                    }
                    None => return Err(error.about(about)),
                },
            };
            variations.push(TradeVariation {
                name: one.name.clone(),
                case: names.get(one.case).cloned().flatten(),
                is_stated: varied.are_stated,
                tolerance: case.scene.requirements.tolerance,
                reserved,
                reference: varied.reference_errors.get(at).and_then(|rounds| rounds.last()).cloned(),
            });
            cases.push(case);
        }
        Ok(Self { cases, variations, diagnostics, before })
    }

    /// Returns notes about standard variations that cannot be simulated.
    pub(super) fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }

    /// Returns the variations.
    pub(super) fn variations(&self) -> &[TradeVariation] {
        &self.variations
    }

    /// Judges rows until one holds in the scene and in all variations, the cheapest first, and returns that row. Without
    /// one, or if the scene limits the cost, returns the row that the scene alone recommends.
    pub(super) fn recommend(
        &self,
        rows: &mut [TradeRow],
        in_scene: Recommendation,
        context: &Context<'_>,
    ) -> Result<Recommendation> {
        context.phase("variations");
        let (wanted, is_limited) = match in_scene {
            Recommendation::None => return Ok(in_scene),
            Recommendation::MostAccurate(row) => (vec![row], true),
            Recommendation::Cheapest(_) => (front::holding(rows), false),
        };
        // The measures look at all nodes and instants of the references: made once for all candidates.
        let measures: Vec<Measure<'_>> = self.cases.iter().map(StudyCase::measure).collect();
        let most = wanted.len().min(MOST_JUDGED);
        for (done, &row) in wanted.iter().take(most).enumerate() {
            let judged = self.judged(&measures, &rows[row].candidate)?;
            let holds = judged.beyond == 0;
            if let Ok(measured) = &mut rows[row].outcome {
                measured.varied = Some(judged);
            }
            context.fraction((done + 1) as f64 / most as f64);
            if holds && !is_limited {
                return Ok(Recommendation::Cheapest(row));
            }
        }
        Ok(in_scene)
    }

    /// Measures a candidate in every variation.
    fn judged(&self, measures: &[Measure<'_>], candidate: &Candidate) -> Result<InVariations> {
        let own = Candidate { source: candidate.source + self.before, ..candidate.clone() };
        let measured = |(case, measure)| match measured(case, measure, &own) {
            Ok(found) => Ok(Some(found)),
            Err(error) if error.diagnostics().iter().all(|one| ends_a_run(one.code())) => Ok(None),
            Err(error) => Err(error),
        };
        let by_variation = parallel::try_map(self.cases.iter().zip(measures), measured)?;
        let worst = |at: usize| by_variation[at].map_or(f64::INFINITY, |own| own.worst);
        let count = by_variation.len();
        let largest = (0..count).rev().max_by(|a, b| worst(*a).total_cmp(&worst(*b))).unwrap_or(0);
        let both = self.variations.iter().zip(&by_variation);
        let beyond = both.filter(|(variation, errors)| !variation.accepts(errors.as_ref())).count();
        Ok(InVariations { worst: worst(largest), variation: largest, beyond, by_variation })
    }
}

fn measured(case: &StudyCase<'_>, measure: &Measure<'_>, candidate: &Candidate) -> Result<InCase> {
    let body = case.body(candidate)?;
    Ok(case.measured(measure, candidate, &body)?.0)
}

impl Measured {
    /// Returns true if the errors of every variation are within the tolerances, or if none was judged.
    pub fn holds_in_variations(&self) -> bool {
        self.varied.as_ref().is_none_or(|varied| varied.beyond == 0)
    }
}
