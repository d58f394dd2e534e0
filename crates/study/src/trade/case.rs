//! Reference motion of a load case, against which candidates are measured.

use super::{Candidate, InCase, NodalReference, Source, TimedRun, timing};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::memory::refuse_beyond;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use flexbody_motion::dynamics::{EquationsOfMotion, Terms};
use flexbody_motion::scene::{FramedScene, Measure, Scene, Scheme, Trace, trace, trace_at};

/// Scene (a single one or a load case) with the motion of the reference in it.
pub(super) struct StudyCase<'m> {
    /// Name of the load case; `None` for a single scene.
    pub name: Option<String>,
    /// Bodies in the frame of the scene, the reference first.
    pub sources: Vec<Source>,
    pub scene: Scene,
    pub motion: Trace,
    pub nodal: Option<NodalReference<'m>>,
    /// Part of the tolerances that the truncation error of the reference takes.
    pub reserved: f64,
    /// Warnings and notes about the motion of the reference.
    pub found: Vec<Diagnostic>,
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
        let sources = sources.iter().map(|one| one.in_frame_of(scene)).collect::<Result<Vec<_>>>()?;
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
        let warning = nodal.as_ref().and_then(NodalReference::warning);
        let found = [framed.found, said, Vec::from_iter(warning)].concat();
        let mut own = Self { name, sources, scene, motion, nodal, reserved, found };
        own.found = std::mem::take(&mut own.found).into_iter().map(|said| own.about(said)).collect();
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
        Measure::new(self.sources[0].body(), &self.motion)
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
    ) -> Result<(InCase, usize)> {
        let mut scene = self.own_scene(body, candidate);
        scene.run.scheme = self.motion.scheme;
        let multiplications = EquationsOfMotion::new(body, scene.run.terms).multiplications();
        Ok((self.errors(measure, candidate, body, &scene)?, multiplications))
    }

    /// Returns the errors of the run of `candidate`, whose body is `body`, in `scene`.
    fn errors(
        &self,
        measure: &Measure<'_>,
        candidate: &Candidate,
        body: &FlexBody,
        scene: &Scene,
    ) -> Result<InCase> {
        let source = &self.sources[candidate.source];
        let instants = self.nodal.as_ref().map_or(&self.motion.time[..], NodalReference::time);
        let motion = trace_at(body, scene, instants, &Context::QUIET)?;
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
            let errors = self.errors(measure, candidate, body, &scene).ok()?;
            (errors.worst <= most).then_some((scheme, errors))
        };
        let loosest = timing::schemes(finest, duration).into_iter().find_map(is_enough);
        let (scheme, errors) = loosest.unwrap_or((finest, *accurate));
        scene.run.scheme = scheme;
        let (seconds, work) = timing::integration(body, &scene, repeat)?;
        let evaluation = timing::evaluation(body, scene.run.terms)
            .map_err(|reason| Error::from(Diagnostic::new(Code::SimulationStopped, reason.to_string())))?;
        Ok((TimedRun { scheme, errors, seconds, work }, evaluation))
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
