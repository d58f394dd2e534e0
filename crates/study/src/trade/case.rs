//! Reference motion of a load case, against which candidates are measured, and the judgement of candidates on variations
//! of the scene that their bodies were not made for.

use super::progress::Progress;
use super::{
    Candidate, InCase, InVariations, NodalReference, Recommendation, Source, TimedRun, TradeRow, front,
    timing,
};
use crate::reference::ReferenceError;
use crate::selection::stops;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::memory::refuse_beyond;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_linalg::parallel;
use flexbody_linalg::ties::first_largest;
use flexbody_model::FeModel;
use flexbody_motion::dynamics::{EquationsOfMotion, Terms};
use flexbody_motion::scene::{
    FramedScene, LoadCases, Measure, Scene, SceneVariation, Scheme, StressError, Tolerance, Trace,
    ends_a_run, trace, trace_at,
};

/// Scene (a single one or a load case) with the motion of the reference in it.
pub(super) struct StudyCase<'m> {
    /// Name of the load case; `None` for a single scene.
    pub name: Option<String>,
    /// Bodies in the frame of the scene, the reference first.
    pub sources: Vec<Source>,
    pub scene: Scene,
    pub motion: Trace,
    pub nodal: Option<NodalReference<'m>>,
    /// Part of the tolerances that the truncation error of the reference and its missing stress stiffness take.
    pub reserved: f64,
    /// Error of the missing stress stiffness of the spin in the motion of the reference.
    pub stress_error: Option<StressError>,
    /// Warnings and notes about the motion of the reference.
    pub diagnostics: Vec<Diagnostic>,
}

impl<'m> StudyCase<'m> {
    /// Simulates the first of `sources` in `scene`, and all nodes of the model `nodal` if it is given.
    ///
    /// # Errors
    /// The errors of [`trade`](super::trade).
    pub(super) fn new(
        sources: &[Source],
        scene: &Scene,
        name: Option<String>,
        nodal: Option<&'m FeModel>,
        reserved: f64,
        context: &Context<'_>,
    ) -> Result<Self> {
        context.phase("reference");
        let whole = sources[0].body();
        nodal.map(|model| NodalReference::refuse(model, whole, scene, context)).transpose()?;
        let framed = FramedScene::new(whole, scene)?;
        let sources = sources.iter().map(|source| source.in_frame_of(scene)).collect::<Result<Vec<_>>>()?;
        // The candidates decide about the groups, not the scene.
        let mut scene = framed.scene.into_owned();
        scene.run.terms = Terms { geometric_stiffness: scene.run.terms.geometric_stiffness, ..Terms::ALL };
        let (motion, said) = trace(sources[0].body(), &scene, context)?;
        refuse_too_much(&sources, &motion, context.memory)?;
        let nodal = match nodal {
            Some(model) => {
                context.phase("nodal reference");
                Some(NodalReference::new(model, sources[0].body(), &scene, &motion, context)?)
            }
            None => None,
        };
        let stress_error = StressError::of_trace(sources[0].body(), &scene, &motion, context)?;
        let reserved = reserved + (1.0 - reserved) * (1.0 - StressError::left(stress_error.as_ref()));
        let warning = nodal.as_ref().and_then(NodalReference::warning);
        let unstressed = stress_error.as_ref().and_then(|own| own.warning(sources[0].body()));
        let diagnostics =
            [framed.diagnostics, said, warning.into_iter().chain(unstressed).collect()].concat();
        let mut own = Self { name, sources, scene, motion, nodal, reserved, stress_error, diagnostics };
        own.diagnostics =
            std::mem::take(&mut own.diagnostics).into_iter().map(|said| own.about(said)).collect();
        Ok(own)
    }

    /// Returns the diagnostic with the name of the load case, if there are several.
    pub(super) fn about(&self, said: Diagnostic) -> Diagnostic {
        match &self.name {
            Some(name) => said.about(format!("case `{name}`")),
            None => said,
        }
    }

    /// Returns the largest error over its tolerance that a candidate may have.
    pub(super) fn most(&self) -> f64 {
        (1.0 - self.reserved).max(0.0)
    }

    /// Returns the measure of errors relative to the motion of the reference.
    pub(super) fn measure(&self) -> Measure<'_> {
        Measure::new(self.sources[0].body(), &self.scene, &self.motion)
    }

    /// Returns the body of `candidate` in the frame of the case.
    ///
    /// # Errors
    /// The errors of [`Candidate::body`].
    pub(super) fn body(&self, candidate: &Candidate) -> Result<FlexBody> {
        candidate.body(&self.sources[candidate.source])
    }

    /// Returns the errors of `candidate`, whose body is `body`, and the multiplications of an evaluation of its
    /// equations. It is integrated as the reference is.
    pub(super) fn measured(
        &self,
        measure: &Measure<'_>,
        candidate: &Candidate,
        body: &FlexBody,
        context: &Context<'_>,
    ) -> Result<(InCase, usize)> {
        let mut scene = self.own_scene(body, candidate);
        scene.run.scheme = self.motion.scheme;
        let multiplications = EquationsOfMotion::new(body, scene.run.terms).multiplications();
        Ok((self.errors(measure, candidate, body, &scene, context)?, multiplications))
    }

    /// Returns the errors of the run of `candidate`, whose body is `body`, in `scene`.
    fn errors(
        &self,
        measure: &Measure<'_>,
        candidate: &Candidate,
        body: &FlexBody,
        scene: &Scene,
        context: &Context<'_>,
    ) -> Result<InCase> {
        let source = &self.sources[candidate.source];
        let instants = self.nodal.as_ref().map_or(&self.motion.time[..], NodalReference::time);
        let motion = trace_at(body, scene, instants, context)?;
        let history = match &self.nodal {
            Some(nodal) => nodal.errors(body, &motion),
            None => source.errors(measure, body, &candidate.modes, &motion),
        };
        let history = history.ok_or_else(|| {
            let message =
                format!("the modes of {} cannot be compared with those of the reference", source.name());
            Error::from(Diagnostic::new(Code::BodyIncomparable, message))
        })?;
        let tolerance = &scene.requirements.tolerance;
        let errors = history.largest();
        let worst = errors.worst(tolerance);
        let growth = history.growth(&self.motion, tolerance);
        Ok(InCase { errors, worst, growth })
    }

    /// Returns the cheapest run of `candidate` that meets what is left of the tolerances, with its duration, and the
    /// duration of one evaluation of its equations (unit: s). `body` is the body of the candidate, and `accurate` has
    /// its errors with the steps of the reference.
    pub(super) fn time(
        &self,
        measure: &Measure<'_>,
        candidate: &Candidate,
        body: &FlexBody,
        accurate: &InCase,
        repeat: usize,
    ) -> Result<(TimedRun, f64)> {
        let mut scene = self.own_scene(body, candidate);
        let most = timing::allowed(accurate.worst, self.most());
        let duration = scene.run.duration.unwrap_or(0.0);
        let finest = self.motion.scheme;
        // The loosest integration that is accurate enough. A run that stops is not; that of the finest is known.
        let is_enough = |scheme: Scheme| {
            if scheme == finest {
                return Some((scheme, *accurate));
            }
            scene.run.scheme = scheme;
            let errors = self.errors(measure, candidate, body, &scene, &Context::QUIET).ok()?;
            (errors.worst <= most).then_some((scheme, errors))
        };
        let loosest = timing::schemes(finest, duration).into_iter().find_map(is_enough);
        let (scheme, errors) = loosest.unwrap_or((finest, *accurate));
        scene.run.scheme = scheme;
        let (seconds, work) = timing::integration(body, &scene, repeat)?;
        let evaluation = timing::evaluation(body, scene.run.terms)
            .map_err(|reason| Error::from(Diagnostic::new(Code::SimulationStopped, reason.to_string())))?;
        let start = scene.initial.modes;
        Ok((TimedRun { scheme, errors, seconds, work, start }, evaluation))
    }

    fn own_scene(&self, body: &FlexBody, candidate: &Candidate) -> Scene {
        self.sources[candidate.source].scene(&self.scene, body, &candidate.modes, &self.motion.start)
    }
}

/// Refuses a study that needs more than `memory` bytes. Each thread holds a body, its equations and its motion, in
/// addition to those of the reference.
fn refuse_too_much(sources: &[Source], reference: &Trace, memory: Option<u64>) -> Result<()> {
    const DOUBLE: f64 = 8.0;
    /// Number of arrays of size nf x nf: W1 to W3, their panels and copies, and S.
    const SQUARES: f64 = 40.0;
    let most = |count: &dyn Fn(&FlexBody) -> usize| {
        sources.iter().map(|s| count(s.body())).max().unwrap_or(0) as f64
    };
    let (nodes, modes) = (most(&FlexBody::n_nodes), most(&FlexBody::n_modes));
    let body = nodes * (7.0 + 6.0 * modes) + SQUARES * modes * modes;
    let motion = reference.bytes(most(&FlexBody::n_modes) as usize);
    let threads = rayon::current_num_threads() as f64;
    let needed = threads * (DOUBLE * 2.0 * body + motion);
    let what = format!("a trade study on {threads} threads");
    refuse_beyond(memory, needed, &what, "use fewer --threads or modes, or a shorter `duration`")
}

/// Returns the part of the tolerances that the reference takes in each load case, from its enrichment rounds. Zero if
/// the truncation error is too large for a reference, and for the motion of all nodes (`nodal`).
pub fn reserved(reference_errors: &[Vec<ReferenceError>], nodal: bool) -> Vec<f64> {
    let of = |rounds: &Vec<ReferenceError>| {
        rounds.last().filter(|own| !nodal && own.is_reference()).map_or(0.0, |own| own.worst)
    };
    reference_errors.iter().map(of).collect()
}

/// Largest number of candidates that are judged on variations. More cost time where no cheap candidate holds.
const MOST_JUDGED: usize = 8;

/// Bodies and scenes of the variations of a study.
#[derive(Debug, Clone, Default)]
pub struct Varied {
    /// Variations; empty if candidates are judged on the scene alone.
    pub variations: Vec<SceneVariation>,
    /// True if the scene file states the variations; false for the standard ones.
    pub are_stated: bool,
    /// True if a recommended body must hold in the variations: stated ones, or those of a robust scene.
    pub are_required: bool,
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
            are_required: cases.requires_variations(),
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
    /// True if the scene file states the variation; false for a standard one.
    pub is_stated: bool,
    /// True if a recommended body must hold in the variation.
    pub is_required: bool,
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
        let (sources, before) =
            if varied.sources.is_empty() { (sources, 0) } else { (&varied.sources[..], 1) };
        let reserved = reserved(&varied.reference_errors, false);
        let (mut cases, mut variations, mut diagnostics) = (Vec::new(), Vec::new(), Vec::new());
        for (at, one) in varied.variations.iter().enumerate() {
            let reserved = reserved.get(at).copied().unwrap_or(0.0);
            let about = format!("variation `{}`", one.name);
            let case = StudyCase::new(sources, &one.scene, Some(one.name.clone()), None, reserved, context);
            let case = match case {
                Ok(case) => case,
                Err(error) => match stops(&error, one).filter(|_| !varied.are_required) {
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
                is_required: varied.are_required,
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
    /// one, if the scene limits the cost, or if the variations are not required, returns the row that the scene alone
    /// recommends, judged too.
    pub(super) fn recommend(
        &self,
        rows: &mut [TradeRow],
        in_scene: Recommendation,
        context: &Context<'_>,
    ) -> Result<Recommendation> {
        let is_required = self.variations.iter().any(|variation| variation.is_required);
        let (wanted, is_limited) = match in_scene {
            Recommendation::None => return Ok(in_scene),
            Recommendation::MostAccurate(row) => (vec![row], true),
            Recommendation::Cheapest(row) if !is_required => (vec![row], true),
            Recommendation::Cheapest(_) => (front::holding(rows), false),
        };
        // The measures look at all nodes and instants of the references: made once for all candidates.
        let measures: Vec<Measure<'_>> = self.cases.iter().map(StudyCase::measure).collect();
        let most = wanted.len().min(MOST_JUDGED);
        let progress = Progress::new(context, "variations", most * self.cases.len());
        for &row in wanted.iter().take(most) {
            let judged = self.judged(&measures, &rows[row].candidate, &progress)?;
            let holds = judged.beyond == 0;
            if let Ok(measured) = &mut rows[row].outcome {
                measured.varied = Some(judged);
            }
            if holds && !is_limited {
                return Ok(Recommendation::Cheapest(row));
            }
        }
        Ok(in_scene)
    }

    /// Measures a candidate in every variation.
    fn judged(
        &self,
        measures: &[Measure<'_>],
        candidate: &Candidate,
        progress: &Progress<'_>,
    ) -> Result<InVariations> {
        let own = Candidate { source: candidate.source + self.before, ..candidate.clone() };
        let run = |case, measure| progress.follow(1, |context| measured(case, measure, &own, context));
        let measured = |(case, measure)| match run(case, measure) {
            Ok(found) => Ok(Some(found)),
            Err(error) if error.diagnostics().iter().all(|diagnostic| ends_a_run(diagnostic.code())) => {
                Ok(None)
            }
            Err(error) => Err(error),
        };
        let by_variation = parallel::try_map(self.cases.iter().zip(measures), measured)?;
        let worst = |at: usize| by_variation[at].map_or(f64::INFINITY, |own| own.worst);
        let count = by_variation.len();
        let largest = first_largest(0..count, |at| worst(*at)).unwrap_or(0);
        let both = self.variations.iter().zip(&by_variation);
        let beyond = both.filter(|(variation, errors)| !variation.accepts(errors.as_ref())).count();
        Ok(InVariations { worst: worst(largest), variation: largest, beyond, by_variation })
    }
}

fn measured(
    case: &StudyCase<'_>,
    measure: &Measure<'_>,
    candidate: &Candidate,
    context: &Context<'_>,
) -> Result<InCase> {
    let body = case.body(candidate)?;
    Ok(case.measured(measure, candidate, &body, context)?.0)
}
