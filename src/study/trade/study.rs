//! The study: every candidate simulated, its errors measured, then its times.

use super::candidate::{first_of, ladder, whole_candidates};
use super::{
    Allowed, Candidate, Failed, Measured, NodalIntegration, NodalReference, Recommendation, Row, Source,
    Timed, front, timing,
};
use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::{Error, Result};
use crate::base::memory::refuse_beyond;
use crate::base::progress::{Event, Watch};
use crate::body::flex_body::{FlexBody, Groups, Storage};
use crate::formats::flex_body_file;
use crate::model::FeModel;
use crate::motion::dynamics::{EquationsOfMotion, Terms};
use crate::motion::scene::{Measure, Scene, Stage, Tolerance, Trace, ends_a_run, trace, trace_at};
use crate::study::selection::liveliest_modes;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The motion that errors are measured against.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ReferenceKind {
    /// The motion of the first source, with everything that it has.
    Full,
    /// The unreduced equations of all nodes.
    Nodal,
}

impl ReferenceKind {
    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Nodal => "nodal",
        }
    }
}

/// Settings of a study.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Integrations whose median time counts; of those that take long, fewer.
    pub repeat: usize,
    /// Bytes that there are; `None` where it is not known.
    pub memory: Option<u64>,
    /// Part of the tolerances that the reference lacks of its model itself: candidates get the rest.
    pub reserved: f64,
    /// Seconds that the motion of all nodes may take by its estimate; `None`: any.
    pub longest: Option<f64>,
}

/// A finished study.
#[derive(Debug, Clone, PartialEq)]
pub struct Trade {
    /// Name of the scene.
    pub scene: String,
    /// Name of the body's model.
    pub body: String,
    /// The motion that errors are measured against.
    pub reference: ReferenceKind,
    /// How the equations of all nodes were integrated, where they are the reference.
    pub nodal: Option<NodalIntegration>,
    /// Tolerances of the scene.
    pub tolerance: Tolerance,
    /// Part of them that the reference lacks of its model itself: candidates get the rest.
    pub reserved: f64,
    /// Multiplications that the scene allows instead.
    pub allowed: Option<usize>,
    /// All candidates; the first is the whole body of the reference.
    pub rows: Vec<Row>,
    /// Rows of the Pareto front, ascending in cost.
    pub front: Vec<usize>,
    /// The row to take.
    pub recommended: Recommendation,
    /// Warnings and notes about the motion of the reference.
    pub diagnostics: Vec<Diagnostic>,
}

/// Measures every candidate of `sources` in `scene`. The first source is the reference; others are
/// [`Source::beside`] it.
///
/// Errors are those of the model: all candidates are integrated with the method and the step of the
/// reference. They are found on all threads; the times of those that somebody may take afterwards, one after
/// the other. Everything but the times is the same at any number of threads.
///
/// * `nodal`: the model, where errors are to be measured against the motion of all its nodes.
///
/// # Errors
/// Those of [`trace`] and [`NodalReference::new`] for the reference; FB601 when memory is short; those of
/// writing a file to the temporary folder.
pub fn trade(
    sources: &[Source],
    scene: &Scene,
    nodal: Option<&FeModel>,
    settings: &Settings,
    watch: Watch<'_>,
) -> Result<Trade> {
    let Some(source) = sources.first() else {
        return Err(Diagnostic::new(Code::Usage, "there is nothing to compare").into());
    };
    watch(Event::Phase("reference"));
    nodal.map(|model| NodalReference::refuse(model, source.body(), scene, settings.longest)).transpose()?;
    let stage = Stage::new(source.body(), scene)?;
    let staged = sources.iter().map(|one| one.staged(scene)).collect::<Result<Vec<_>>>()?;
    let (sources, source) = (&staged[..], &staged[0]);
    // Groups are what candidates differ in.
    let mut scene = stage.scene.into_owned();
    scene.run.terms = Terms { geometric_stiffness: scene.run.terms.geometric_stiffness, ..Terms::ALL };
    let full = |part| watch(Event::Fraction(part));
    let (motion, said) = trace(source.body(), &scene, settings.memory, full)?;
    refuse_too_much(sources, &motion, settings.memory)?;
    let nodal = match nodal {
        Some(model) => {
            watch(Event::Phase("nodal reference"));
            let allowed = Allowed { memory: settings.memory, longest: settings.longest };
            Some(NodalReference::new(model, source.body(), &scene, &motion, allowed, watch)?)
        }
        None => None,
    };
    let warning = nodal.as_ref().and_then(NodalReference::warning);
    let diagnostics = [stage.found, said, Vec::from_iter(warning)].concat();
    let measure = Measure::new(source.body(), &motion);
    let most = (1.0 - settings.reserved).max(0.0);
    let job = Job { sources, scene: &scene, motion: &motion, measure: &measure, nodal: nodal.as_ref(), most };
    let rows = job.rows(settings.repeat, watch)?;
    let allowed = scene.requirements.multiplications;
    Ok(Trade {
        scene: scene.name.clone(),
        body: source.body().source().name.clone(),
        reference: if nodal.is_some() { ReferenceKind::Nodal } else { ReferenceKind::Full },
        nodal: nodal.as_ref().map(NodalReference::integration),
        tolerance: scene.requirements.tolerance,
        reserved: settings.reserved,
        allowed,
        front: front(&rows),
        recommended: Recommendation::new(&rows, most, allowed),
        rows,
        diagnostics,
    })
}

/// Candidates that are done, told as the fraction of all.
struct Progress<'w> {
    watch: Watch<'w>,
    count: f64,
    done: AtomicUsize,
}

impl<'w> Progress<'w> {
    fn new(watch: Watch<'w>, phase: &'static str, count: usize) -> Self {
        watch(Event::Phase(phase));
        Self { watch, count: count as f64, done: AtomicUsize::new(0) }
    }

    fn step(&self) {
        let finished = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        (self.watch)(Event::Fraction(finished as f64 / self.count));
    }
}

/// What all candidates have in common.
struct Job<'j> {
    sources: &'j [Source],
    scene: &'j Scene,
    motion: &'j Trace,
    measure: &'j Measure<'j>,
    nodal: Option<&'j NodalReference<'j>>,
    /// Largest error over its tolerance that a candidate may have.
    most: f64,
}

impl Job<'_> {
    /// Every candidate: what can be found on all threads, then the times of those that somebody may take, one
    /// after the other.
    fn rows(&self, repeat: usize, watch: Watch<'_>) -> Result<Vec<Row>> {
        let carried = self.scene.carried.is_some();
        let whole = whole_candidates(self.sources, carried);
        let mut rows = self.errors(whole, "errors of whole bodies", watch)?;
        let worst_of = |groups: Groups| {
            let has_groups = |row: &&Row| {
                let own = &row.candidate;
                own.source == 0 && own.groups == groups && own.lumped.is_none() && own.storage == Storage::F64
            };
            let measured = rows.iter().find(has_groups).and_then(|row| row.outcome.as_ref().ok());
            measured.map_or(f64::INFINITY, |measured| measured.worst)
        };
        let liveliest = liveliest_modes(self.sources[0].body(), self.scene, self.motion)?;
        let some_modes = ladder(self.sources, &liveliest, carried, worst_of);
        rows.extend(self.errors(some_modes, "errors of fewer modes", watch)?);
        self.refine(&liveliest, &mut rows)?;
        self.time_what_is_worth_it(&mut rows, repeat, watch)?;
        Ok(rows)
    }

    /// Bisects between the cheapest rung of the ladder that is good enough and the highest one below it that
    /// is not, as a selection does.
    fn refine(&self, liveliest: &[usize], rows: &mut Vec<Row>) -> Result<()> {
        if self.scene.requirements.multiplications.is_some() {
            return Ok(());
        }
        let is_exact =
            |own: &Candidate| own.source == 0 && own.lumped.is_none() && own.storage == Storage::F64;
        let enough = rows.iter().filter(|row| is_exact(&row.candidate)).filter_map(|row| {
            let measured = row.outcome.as_ref().ok().filter(|measured| measured.worst <= self.most)?;
            Some((measured.multiplications, &row.candidate))
        });
        let Some((_, best)) = enough.min_by_key(|own| own.0) else { return Ok(()) };
        let best = best.clone();
        let count = best.modes.len();
        let lowest: Vec<usize> = (0..liveliest.len()).collect();
        let by_frequency = count < lowest.len() && best.modes == lowest[..count];
        let order = if by_frequency { &lowest[..] } else { liveliest };
        if first_of(order, count) != best.modes {
            return Ok(());
        }
        let with = |count: usize| Candidate { modes: first_of(order, count), ..best.clone() };
        let is_rung = |row: &&Row| row.candidate == with(row.candidate.modes.len());
        let fewer = rows.iter().filter(|row| row.candidate.modes.len() < count).filter(is_rung);
        let (mut too_few, mut enough) =
            (fewer.map(|row| row.candidate.modes.len()).max().unwrap_or(0), count);
        while too_few + 1 < enough {
            let count = too_few.midpoint(enough);
            let row = self.measure(with(count))?;
            let passed = row.outcome.as_ref().is_ok_and(|measured| measured.worst <= self.most);
            if passed {
                enough = count
            } else {
                too_few = count
            }
            rows.push(row);
        }
        Ok(())
    }

    fn recommended(&self, rows: &[Row]) -> Recommendation {
        Recommendation::new(rows, self.most, self.scene.requirements.multiplications)
    }

    fn time_what_is_worth_it(&self, rows: &mut [Row], repeat: usize, watch: Watch<'_>) -> Result<()> {
        let recommended = self.recommended(rows).row();
        let mut worth_it: Vec<usize> = front(rows).into_iter().chain(recommended).chain([0]).collect();
        worth_it.sort_unstable();
        worth_it.dedup();
        let progress = Progress::new(watch, "times", worth_it.len());
        for at in worth_it {
            self.time(&mut rows[at], repeat)?;
            progress.step();
        }
        Ok(())
    }

    /// The rows of candidates, without times.
    fn errors(&self, all: Vec<Candidate>, phase: &'static str, watch: Watch<'_>) -> Result<Vec<Row>> {
        let progress = Progress::new(watch, phase, all.len());
        let measured = |candidate| {
            let row = self.measure(candidate);
            progress.step();
            row
        };
        all.into_par_iter().map(measured).collect()
    }

    /// Everything but the times. What keeps the motion of a candidate from being computed belongs to its row.
    fn measure(&self, candidate: Candidate) -> Result<Row> {
        let source = &self.sources[candidate.source];
        let last = candidate.modes.last().copied().unwrap_or(0);
        let outcome = match self.measured(source, &candidate) {
            Ok(measured) => Ok(measured),
            // A lumped mass need not be the mass of anything: that is what the row says then.
            Err(error)
                if candidate.lumped.is_some() || error.diagnostics().iter().all(|d| ends_a_run(d.code())) =>
            {
                Err(Failed(error.diagnostics()[0].clone()))
            }
            Err(error) => return Err(error),
        };
        Ok(Row {
            source: source.name().to_owned(),
            last_frequency_hz: source.body().frequencies_hz()[last],
            candidate,
            outcome,
        })
    }

    fn measured(&self, source: &Source, candidate: &Candidate) -> Result<Measured> {
        let body = candidate.body(source)?;
        let mut scene = self.own_scene(source, &body, candidate);
        scene.run.scheme = self.motion.scheme;
        let instants = self.nodal.map_or(&self.motion.time[..], NodalReference::time);
        let motion = trace_at(&body, &scene, instants, None)?;
        let history = match self.nodal {
            Some(nodal) => nodal.errors(&body, &motion),
            None => source.errors(self.measure, &body, &candidate.modes, &motion),
        };
        let history = history.ok_or_else(|| {
            let message =
                format!("the modes of {} cannot be compared with those of the reference", source.name());
            Error::from(Diagnostic::new(Code::BodyIncomparable, message))
        })?;
        let errors = history.largest();
        Ok(Measured {
            errors,
            worst: errors.worst(&scene.requirements.tolerance),
            growth: history.growth(self.motion, &scene.requirements.tolerance),
            multiplications: EquationsOfMotion::new(&body, scene.run.terms).multiplications(),
            bytes: file_size(&body)?,
            preprocessing: source.preprocessing(),
            timed: None,
        })
    }

    fn time(&self, row: &mut Row, repeat: usize) -> Result<()> {
        let Ok(measured) = &mut row.outcome else { return Ok(()) };
        let source = &self.sources[row.candidate.source];
        let body = row.candidate.body(source)?;
        let scene = self.own_scene(source, &body, &row.candidate);
        let timed = timing::integration(&body, &scene, repeat);
        match (timed, timing::evaluation(&body, scene.run.terms)) {
            (Ok((integration, work)), Ok(evaluation)) => {
                measured.timed = Some(Timed { evaluation, integration, work });
            }
            (Err(error), _) => row.outcome = Err(Failed(error.diagnostics()[0].clone())),
            (_, Err(reason)) => {
                row.outcome = Err(Failed(Diagnostic::new(Code::SimulationStopped, reason.to_string())));
            }
        }
        Ok(())
    }

    fn own_scene(&self, source: &Source, body: &FlexBody, candidate: &Candidate) -> Scene {
        source.scene(self.scene, body, &candidate.modes, &self.motion.start)
    }
}

/// Size of the file of `body`, written to the temporary folder and removed.
fn file_size(body: &FlexBody) -> Result<u64> {
    let name = format!("flexbody-trade-{}.flex.h5", std::process::id());
    let slot = flex_body_file::prepare_output(std::env::temp_dir().join(name))?;
    flex_body_file::fill_slot(body, &slot)?;
    Ok(std::fs::metadata(slot.temporary()).map_or(0, |meta| meta.len()))
}

/// Every thread has a body, its equations and its motion, beside that of the reference, which is there.
fn refuse_too_much(sources: &[Source], reference: &Trace, memory: Option<u64>) -> Result<()> {
    const DOUBLE: f64 = 8.0;
    /// W1 to W3, their panels and copies, and S: squares of the modes.
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
