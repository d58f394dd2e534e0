//! A continuous motion, as errors are measured along it.

use super::extremes::Survey;
use super::prepared::{Finished, PARTS, Prepared, Reaction, Stop, damped};
use super::simulate::remarks;
use super::{Extremes, Resolution, Scene, Scheme, Stage};
use crate::dynamics::{Configuration, EulerParameters, Motion};
use crate::integration::{Failure, Sight, Work};
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_base::memory::refuse_beyond;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use nalgebra::Vector3;

/// The continuous motion of a body: at the ends of the steps of its integration, at both sides of every
/// break, and at places within the steps that are so close that a parabola through three of them finds every
/// extreme. Which instants a scene writes has no part in it. Numbers are in the units of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// How it was integrated; with the step that was taken.
    pub scheme: Scheme,
    /// Where the motion was looked at, ascending.
    pub time: Vec<f64>,
    /// Attitude of the frame.
    pub attitude: Vec<EulerParameters>,
    /// Modal coordinates (nf).
    pub q: Vec<Vec<f64>>,
    /// Elastic energy.
    pub elastic: Vec<f64>,
    /// Force and torque about the origin of the frame, axes of the model, that the prescribed motion takes;
    /// none without.
    pub reactions: Option<Vec<(Vector3<f64>, Vector3<f64>)>>,
    /// Deflections of every watched point from the undeformed body, axes of the model.
    pub deflections: Vec<Vec<Vector3<f64>>>,
    /// The state at the start.
    pub start: Configuration,
    /// The largest of everything.
    pub extremes: Extremes,
    /// Steps and evaluations of the integration.
    pub work: Work,
    /// Mass of the body, and its radius of gyration about the centre of mass, sqrt(tr(I) / 2m).
    pub size: (f64, f64),
    /// What is small enough not to count.
    pub resolution: Resolution,
}

impl Trace {
    /// Bytes of such a motion of a body with `modes` modes.
    pub fn bytes(&self, modes: usize) -> f64 {
        self.time.len() as f64 * Self::bytes_of_instant(modes, self.deflections.len())
    }

    /// Bytes that an instant takes of a body with `modes` modes in a scene with `watched` points.
    fn bytes_of_instant(modes: usize, watched: usize) -> f64 {
        const NUMBER: f64 = 8.0;
        /// Time, attitude, energy, reaction, and the head of the vector of modal coordinates.
        const PLAIN: usize = 1 + 4 + 1 + 6 + 3;
        // Vectors that grow are up to twice as long as what is in them.
        2.0 * NUMBER * (PLAIN + modes + 3 * watched) as f64
    }
}

/// The continuous motion of `body` in `scene`, with warnings and notes about it.
///
/// * `context`: as for [`simulate`](super::simulate).
///
/// # Errors
/// As [`simulate`](super::simulate).
pub fn trace(body: &FlexBody, scene: &Scene, context: &Context<'_>) -> Result<(Trace, Vec<Diagnostic>)> {
    let stage = Stage::new(body, scene)?;
    let body = &*damped(&stage.body, &stage.scene)?;
    let scene = &*stage.scene;
    let run = Prepared::new(body, scene)?;
    let bytes = Trace::bytes_of_instant(body.n_modes(), run.watched.len());
    let most = context.memory.map_or(f64::INFINITY, |memory| memory as f64 / bytes);
    let mut tracer = Tracer::new(&run);
    let mut survey = Survey::new(body, &run.watched);
    let look = |sight: Sight, time: f64, state: &[f64], motion: &mut Motion<'_>| {
        if sight == Sight::Instant {
            return Ok(());
        }
        if tracer.trace.time.len() as f64 >= most {
            return Err(Stop::Memory { time });
        }
        context.fraction(time / run.duration);
        let reaction = run.survey(&mut survey, sight, time, state, motion)?;
        tracer.see(time, state, motion, reaction);
        Ok(())
    };
    let finished = run.integrate(&[0.0, run.duration], PARTS, look)?;
    let extremes = survey.extremes(finished.size, finished.least_energy);
    let found = [stage.found, remarks(body, scene, &extremes)].concat();
    Ok((tracer.finish(finished, extremes), found))
}

/// The motion of `body` in `scene` where another motion was looked at, to be compared with it. Of the
/// extremes there are none.
///
/// * `times`: ascending, from 0 to the end of the scene.
/// * `context`: its memory bounds the motion.
///
/// # Errors
/// As [`simulate`](super::simulate).
pub fn trace_at(body: &FlexBody, scene: &Scene, times: &[f64], context: &Context<'_>) -> Result<Trace> {
    let stage = Stage::new(body, scene)?;
    let body = &*damped(&stage.body, &stage.scene)?;
    let run = Prepared::new(body, &stage.scene)?;
    let needed = times.len() as f64 * Trace::bytes_of_instant(body.n_modes(), run.watched.len());
    refuse_beyond(
        context.memory,
        needed,
        &format!("the motion at {} instants", times.len()),
        "simulate a shorter `duration`",
    )?;
    let mut tracer = Tracer::new(&run);
    let look = |sight: Sight, time: f64, state: &[f64], motion: &mut Motion<'_>| {
        if sight == Sight::Instant {
            let prescribes = stage.scene.prescribes();
            let reaction = if prescribes { Some(motion.evaluate(time, state)?.reaction()) } else { None };
            tracer.see(time, state, motion, reaction);
        }
        Ok::<(), Failure>(())
    };
    let finished = run.integrate(times, 1, look)?;
    Ok(tracer.finish(finished, Extremes::default()))
}

/// Collects a [`Trace`].
struct Tracer<'r> {
    run: &'r Prepared<'r>,
    trace: Trace,
}

impl<'r> Tracer<'r> {
    fn new(run: &'r Prepared<'r>) -> Self {
        let scene = run.scene;
        let trace = Trace {
            scheme: run.scheme,
            time: Vec::new(),
            attitude: Vec::new(),
            q: Vec::new(),
            elastic: Vec::new(),
            reactions: scene.prescribes().then(Vec::new),
            deflections: vec![Vec::new(); run.watched.len()],
            start: run.start.clone(),
            extremes: Extremes::default(),
            work: Work::default(),
            size: (0.0, 0.0),
            resolution: Resolution::new(run.body, scene.requirements.tolerance.least_deflection),
        };
        Self { run, trace }
    }

    /// Keeps the motion at a place.
    fn see(&mut self, time: f64, state: &[f64], motion: &Motion<'_>, reaction: Option<Reaction>) {
        let (attitude, q) = motion.shape(state);
        let trace = &mut self.trace;
        trace.time.push(time);
        trace.attitude.push(attitude);
        trace.q.push(q.to_vec());
        trace.elastic.push(self.run.equations.elastic_energy(q));
        for (path, point) in trace.deflections.iter_mut().zip(&self.run.watched) {
            path.push(point.deflection(q));
        }
        if let Some(reactions) = &mut trace.reactions {
            reactions.extend(reaction);
        }
    }

    fn finish(self, finished: Finished, extremes: Extremes) -> Trace {
        Trace { extremes, work: finished.work, size: finished.size, ..self.trace }
    }
}
