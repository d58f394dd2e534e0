//! Continuous motion along which errors are measured.

use super::extremes::Survey;
use super::pace::Pace;
use super::prepared::{Finished, PARTS, Prepared, Reaction, Stop, damped};
use super::recovery_errors::TracedRecoveries;
use super::row_states::RowSampler;
use super::simulate::remarks;
use super::{Extremes, FramedScene, Resolution, Scene, Scheme};
use crate::dynamics::{BodyPoint, Configuration, EulerParameters, Motion};
use crate::integration::{Failure, ObserverEvent, Work};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::memory::refuse_beyond;
use flexbody_base::text::InputFile;
use flexbody_base::text::series::{ColumnKey, Series, has_column, read_series};
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::context::Context;
use nalgebra::Vector3;
use std::path::{Path, PathBuf};

/// Continuous motion of a body: sampled at the ends of the integration steps, at both sides of every break,
/// and at points within the steps that are close enough for a parabola through three of them to find every
/// extreme. The samples do not depend on the output times of the scene. Numbers are in the units of the
/// body.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Integration scheme, with the actual step length.
    pub scheme: Scheme,
    /// Sample times, ascending.
    pub time: Vec<f64>,
    /// Attitude of the frame.
    pub attitude: Vec<EulerParameters>,
    /// Modal coordinates (nf).
    pub q: Vec<Vec<f64>>,
    /// Elastic energy.
    pub elastic: Vec<f64>,
    /// Force and torque of the prescribed motion about the origin of the frame, axes of the model; `None`
    /// without prescribed motion.
    pub reactions: Option<Vec<(Vector3<f64>, Vector3<f64>)>>,
    /// Deflections of every watched point from the undeformed body, axes of the model.
    pub deflections: Vec<Vec<Vector3<f64>>>,
    /// Recoveries with a limit in the scene; `None` without.
    pub recovered: Option<TracedRecoveries>,
    /// State at the start.
    pub start: Configuration,
    /// Extremes of the motion.
    pub extremes: Extremes,
    /// Steps and evaluations of the integration.
    pub work: Work,
    /// Mass of the body, and its radius of gyration about the centre of mass, sqrt(tr(I) / 2m).
    pub size: (f64, f64),
    /// Smallest deformation that is compared.
    pub resolution: Resolution,
}

impl Trace {
    /// Returns the motion of `body` in `scene` that another program computed, for comparison with a reference. It has no
    /// reactions and no extremes; without attitudes in the history those of `fallback`, sampled at the same times, stand
    /// in.
    ///
    /// # Errors
    /// The errors of [`FramedScene::new`]; FB707 for a body whose modal coordinates in the scene are not those of its
    /// file.
    pub fn of_history(
        body: &FlexBody,
        scene: &Scene,
        history: &MotionHistory,
        fallback: &Trace,
    ) -> Result<Self> {
        refuse_other_coordinates(body, scene)?;
        let framed = FramedScene::new(body, scene)?;
        let run = Prepared::new(&framed.body, &framed.scene)?;
        let mut trace = Tracer::new(&run)?.trace;
        let same =
            |own: TracedRecoveries| Some(fallback.recovered.as_ref()?.with_coordinates(own, &history.q));
        trace.recovered = trace.recovered.and_then(same);
        trace.time.clone_from(&history.time);
        trace.attitude.clone_from(history.attitude.as_ref().unwrap_or(&fallback.attitude));
        trace.q.clone_from(&history.q);
        trace.elastic = history.q.iter().map(|q| run.equations.elastic_energy(q)).collect();
        let path = |point: &BodyPoint| history.q.iter().map(|q| point.deflection(q)).collect();
        trace.deflections = run.watched.iter().map(path).collect();
        trace.reactions = None;
        Ok(trace)
    }

    /// Returns the motion of parabolas through the instants of this one, three at a time, at other `times`: what a table of
    /// these instants tells of the motion between them.
    pub fn through_parabolas(&self, times: &[f64]) -> MotionHistory {
        let interpolated = |time: f64| {
            let nodes = self.nearest(time);
            let weights = lagrange(&self.time[nodes.clone()], time);
            let sum = |value: &dyn Fn(usize) -> f64| -> f64 {
                nodes.clone().zip(&weights).map(|(i, weight)| weight * value(i)).sum()
            };
            let q = (0..self.q.first().map_or(0, Vec::len)).map(|j| sum(&|i| self.q[i][j])).collect();
            let turn: [f64; 4] = std::array::from_fn(|k| sum(&|i| self.attitude[i].0[k]));
            let length = turn.iter().map(|v| v * v).sum::<f64>().sqrt();
            (EulerParameters(turn.map(|v| v / length)), q)
        };
        let (attitude, q) = times.iter().map(|&time| interpolated(time)).unzip();
        MotionHistory { path: PathBuf::new(), time: times.to_vec(), attitude: Some(attitude), q }
    }

    /// Returns the instants, at most three, whose parabola stands for the motion at `time`.
    fn nearest(&self, time: f64) -> std::ops::Range<usize> {
        let count = self.time.len();
        let after = self.time.partition_point(|own| *own <= time).clamp(1, count.saturating_sub(1).max(1));
        // The third instant is the nearer one of those beside the interval.
        let distance = |at: Option<usize>| match at.and_then(|at| self.time.get(at)) {
            Some(own) => (own - time).abs(),
            None => f64::INFINITY,
        };
        let first =
            if distance(after.checked_sub(2)) < distance(Some(after + 1)) { after - 2 } else { after - 1 };
        first..(first + 3).min(count)
    }

    /// Returns the number of bytes of this motion for a body with `modes` modes.
    pub fn bytes(&self, modes: usize) -> f64 {
        self.time.len() as f64 * self.bytes_of_instant(modes)
    }

    /// Returns the number of bytes per sample for a body with `modes` modes.
    fn bytes_of_instant(&self, modes: usize) -> f64 {
        const NUMBER: f64 = 8.0;
        /// Number of values besides q and deflections: time, attitude, energy, reaction, and the header of
        /// the vector of modal coordinates.
        const PLAIN: usize = 1 + 4 + 1 + 6 + 3;
        // Growing vectors reserve up to twice their length.
        let rows = self.recovered.as_ref().map_or(0, TracedRecoveries::bytes_of_instant);
        2.0 * (NUMBER * (PLAIN + modes + 3 * self.deflections.len()) as f64 + rows as f64)
    }
}

/// Computes the continuous motion of `body` in `scene`, with warnings and notes about it.
///
/// * `context`: limits and observers, with the meaning of [`simulate`](super::simulate).
///
/// # Errors
/// The errors of [`simulate`](super::simulate).
pub fn trace(body: &FlexBody, scene: &Scene, context: &Context<'_>) -> Result<(Trace, Vec<Diagnostic>)> {
    let framed = FramedScene::new(body, scene)?;
    let body = &*damped(&framed.body, &framed.scene)?;
    let scene = &*framed.scene;
    let run = Prepared::new(body, scene)?;
    // Samples at steps and within them until the memory is full; the extremes are surveyed there too.
    let mut tracer = Tracer::new(&run)?;
    let bytes = tracer.trace.bytes_of_instant(body.n_modes());
    let most = context.memory.map_or(f64::INFINITY, |memory| memory as f64 / bytes);
    let mut survey = Survey::new(body, &run.watched);
    let mut pace = Pace::new(&run, context);
    let look = |event: ObserverEvent, time: f64, state: &[f64], motion: &mut Motion<'_>| {
        if event == ObserverEvent::Instant {
            return Ok(());
        }
        if tracer.trace.time.len() as f64 >= most {
            return Err(Stop::Memory { time });
        }
        pace.see(time);
        let reaction = run.survey(&mut survey, event, time, state, motion)?;
        tracer.see(time, state, motion, reaction)?;
        Ok(())
    };
    let finished = run.integrate(&[0.0, run.duration], PARTS, look)?;
    // Remarks about motions beyond the range of the model.
    let extremes = survey.extremes(finished.size, finished.least_energy);
    let found = [framed.diagnostics, remarks(body, &extremes)].concat();
    Ok((tracer.finish(finished, extremes), found))
}

/// Computes the motion of `body` in `scene` at the sample times of another motion, for comparison with it.
/// Extremes are not computed.
///
/// * `times`: sample times, ascending, from 0 to the end of the scene.
/// * `context`: its memory limits the motion; its listener gets the finished fraction of the duration.
///
/// # Errors
/// The errors of [`simulate`](super::simulate).
pub fn trace_at(body: &FlexBody, scene: &Scene, times: &[f64], context: &Context<'_>) -> Result<Trace> {
    let framed = FramedScene::new(body, scene)?;
    let body = &*damped(&framed.body, &framed.scene)?;
    let run = Prepared::new(body, &framed.scene)?;
    let mut tracer = Tracer::new(&run)?;
    let needed = times.len() as f64 * tracer.trace.bytes_of_instant(body.n_modes());
    refuse_beyond(
        context.memory,
        needed,
        &format!("the motion at {} instants", times.len()),
        "simulate a shorter `duration`",
    )?;
    let mut pace = Pace::new(&run, context);
    let look = |event: ObserverEvent, time: f64, state: &[f64], motion: &mut Motion<'_>| {
        pace.see(time);
        if event == ObserverEvent::Instant {
            let prescribes = framed.scene.prescribes();
            let reaction = if prescribes { Some(motion.evaluate(time, state)?.reaction()) } else { None };
            tracer.see(time, state, motion, reaction)?;
        }
        Ok::<(), Failure>(())
    };
    let finished = run.integrate(times, 1, look)?;
    Ok(tracer.finish(finished, Extremes::default()))
}

/// Refuses a body with other modal coordinates in the scene than in its file: one that is carried, or whose frame is not
/// in mean axes.
fn refuse_other_coordinates(body: &FlexBody, scene: &Scene) -> Result<()> {
    if scene.carried.is_none() && body.conditions().is_mean() {
        return Ok(());
    }
    let message = "in this scene the body has other modal coordinates than in its file, so that those of another program cannot be compared";
    let help = "compare in a scene without [carried], with a body that was converted with --frame com";
    Err(Diagnostic::new(Code::BodyIncomparable, message).with_help(help).into())
}

/// Observer that collects a [`Trace`].
struct Tracer<'r> {
    run: &'r Prepared<'r>,
    trace: Trace,
    /// States of recoveries with a limit; `None` without.
    sampler: Option<RowSampler>,
}

impl<'r> Tracer<'r> {
    fn new(run: &'r Prepared<'r>) -> Result<Self> {
        let scene = run.scene;
        let (recovered, sampler) = TracedRecoveries::new(run.body, scene)?.unzip();
        let trace = Trace {
            scheme: run.scheme,
            time: Vec::new(),
            attitude: Vec::new(),
            q: Vec::new(),
            elastic: Vec::new(),
            reactions: scene.prescribes().then(Vec::new),
            deflections: vec![Vec::new(); run.watched.len()],
            recovered,
            start: run.start.clone(),
            extremes: Extremes::default(),
            work: Work::default(),
            size: (0.0, 0.0),
            resolution: Resolution::new(run.body, scene.requirements.tolerance.least_deflection),
        };
        Ok(Self { run, trace, sampler })
    }

    /// Stores a sample of the motion.
    fn see(
        &mut self,
        time: f64,
        state: &[f64],
        motion: &mut Motion<'_>,
        reaction: Option<Reaction>,
    ) -> std::result::Result<(), Failure> {
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
        if let (Some(recovered), Some(sampler)) = (&mut trace.recovered, &self.sampler) {
            let z = sampler.state(time, state, motion, &self.run.forces)?;
            recovered.states.push(time, &z);
        }
        Ok(())
    }

    fn finish(self, finished: Finished, extremes: Extremes) -> Trace {
        Trace { extremes, work: finished.work, size: finished.size, ..self.trace }
    }
}

/// Returns the weights of Lagrange's polynomial through `nodes` at `time`.
fn lagrange(nodes: &[f64], time: f64) -> Vec<f64> {
    let factor = |i: usize, j: usize| if i == j { 1.0 } else { (time - nodes[j]) / (nodes[i] - nodes[j]) };
    (0..nodes.len()).map(|i| (0..nodes.len()).map(|j| factor(i, j)).product()).collect()
}

// Motions that another program computed.

/// Time by which a history may begin after 0 or end beside the scene, relative to the duration: times are often written
/// with about six digits.
const ROUNDING: f64 = 1e-6;
/// Largest difference of the length of Euler parameters from 1 that counts as rounding of their digits.
const NOT_UNIT: f64 = 1e-2;

/// Motion of a body, computed by another program, at its own instants.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionHistory {
    /// File of the history.
    pub path: PathBuf,
    /// Times, ascending.
    pub time: Vec<f64>,
    /// Attitude of the axes of the model in the world; `None` if the file does not have it.
    pub attitude: Option<Vec<EulerParameters>>,
    /// Modal coordinates of the body at each time.
    pub q: Vec<Vec<f64>>,
}

impl MotionHistory {
    /// Reads the columns `time`, `q_1` to `q_n` for `n_modes` modes and, if there is one of them, `attitude_0` to
    /// `attitude_3`, which are those of `simulate --csv`. Other columns are ignored.
    ///
    /// # Errors
    /// FB215 for missing columns; FB216 for rows that cannot be read, for times that do not ascend and for Euler
    /// parameters whose length is not 1; the errors of [`InputFile::open`].
    pub fn read(path: &Path, n_modes: usize) -> Result<Self> {
        let file = InputFile::open(path)?;
        let named = |prefix: &str, first: usize, count: usize| -> Vec<ColumnKey> {
            (first..first + count).map(|k| ColumnKey::Name(format!("{prefix}{k}"))).collect()
        };
        // The attitude is in the file if any of its columns is; then all must be.
        let has_attitude = (0..4).any(|k| has_column(&file, &format!("attitude_{k}")));
        let mut keys = named("q_", 1, n_modes);
        keys.extend(has_attitude.then(|| named("attitude_", 0, 4)).into_iter().flatten());
        let time = ColumnKey::Name("time".to_owned());
        let all = read_series(&file, &time, &keys).map_err(Error::new)?;
        let row = |i: usize, columns: &[Vec<f64>]| columns.iter().map(|column| column[i]).collect::<Vec<_>>();
        let (modal, attitude) = all.columns.split_at(n_modes);
        let rows = 0..all.times.len();
        let q = rows.clone().map(|i| row(i, modal)).collect();
        let attitude = if has_attitude {
            Some(rows.map(|i| unit(&row(i, attitude), &all, i, path)).collect::<Result<Vec<_>>>()?)
        } else {
            None
        };
        Ok(Self { path: path.to_owned(), time: all.times, attitude, q })
    }

    /// Returns the history with its first and last time at 0 and `duration`, from which they may differ by rounding.
    ///
    /// # Errors
    /// FB217 if the history does not cover the time of the scene, or goes beyond it.
    pub fn covering(mut self, duration: f64) -> Result<Self> {
        let (first, last) =
            (self.time.first().copied().unwrap_or(0.0), self.time.last().copied().unwrap_or(0.0));
        let rounding = ROUNDING * duration;
        if first.abs() > rounding || (last - duration).abs() > rounding {
            let message = format!(
                "the history covers the times {first} to {last}, but the scene those from 0 to {duration}"
            );
            let help = if last > duration && first.abs() <= rounding {
                format!(
                    "set duration = {last} in [run] of the scene if its loads go on until then, or cut the table after {duration}"
                )
            } else {
                "write the whole run, from 0 to `duration` of [run], with the time in the unit of the body"
                    .to_owned()
            };
            let uncovered = Diagnostic::new(Code::SeriesRange, message).in_file(&self.path);
            return Err(uncovered.with_help(help).into());
        }
        if let Some(first) = self.time.first_mut() {
            *first = 0.0;
        }
        if let Some(last) = self.time.last_mut() {
            *last = duration;
        }
        Ok(self)
    }
}

/// Returns Euler parameters of row `i` with length 1.
fn unit(values: &[f64], all: &Series, i: usize, path: &Path) -> Result<EulerParameters> {
    let length = values.iter().map(|value| value * value).sum::<f64>().sqrt();
    if (length - 1.0).abs() > NOT_UNIT {
        let message =
            format!("the Euler parameters attitude_0 to attitude_3 have the length {length}, not 1");
        let help =
            "write the four Euler parameters of the axes of the model, the cosine of half the angle first";
        let at = Diagnostic::new(Code::SeriesRow, message).in_file(path).at_line(all.lines[i]);
        return Err(at.with_help(help).into());
    }
    Ok(EulerParameters(std::array::from_fn(|k| values[k] / length)))
}
