//! Motions sampled from ranges, and what the terms change in them.

use super::ranges::Ranges;
use crate::selection::{Case, Trial, sets_in};
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, TermGroups};
use flexbody_linalg::context::Context;
use flexbody_linalg::ties::first_largest;
use flexbody_motion::dynamics::Terms;
use flexbody_motion::scene::{
    Axes, FramedScene, History, Initial, Measure, ModeStart, OutputErrors, PerQuantity, Requirements, Run,
    Scene, Scheme, Spin, Tolerance, Trace, VectorHistory, ends_a_run,
};
use libm::sincos;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Number of sampled motions, and of those of a plane body, which turns about its normal only.
const MOTIONS: usize = 12;
const MOTIONS_IN_PLANE: usize = 4;

/// Duration of the motions where none is stated, in revolutions; without rotation in periods of the first mode.
const REVOLUTIONS: f64 = 5.0;

/// Tolerance of the steps, far below the errors that are asked for.
const TOLERANCE: f64 = 1e-6;

/// Longest duration that is not stated, in periods of the first mode, of motions that vibrate: parts with some per cent of damping
/// are at rest by then.
const PERIODS: f64 = 30.0;

/// Longest duration that is not stated, in periods of the first mode.
const MOST_PERIODS: f64 = 1e5;

/// Tilt of the first axes of rotation against the axes of the body frame, about which a term may not act.
const TILT: f64 = 0.1;

/// Number of the lowest modes that vibrate in a motion.
const VIBRATING: usize = 6;

/// Smallest deflection that is compared, relative to the extent of the body.
const LEAST_DEFLECTION: f64 = 1e-9;

/// Errors of the motions without some terms.
#[derive(Debug, Clone, PartialEq)]
pub struct SampledSet {
    /// Groups that are kept.
    pub groups: TermGroups,
    /// Largest errors of any motion; `None` if a motion could not be integrated.
    pub errors: Option<OutputErrors>,
    /// Largest error over the limit.
    pub worst: f64,
    /// Index (from 0) of the motion with this error.
    pub motion: usize,
    /// Reason why there are no errors; empty if there are errors.
    pub remark: String,
}

impl SampledSet {
    /// Collects the largest errors of the motions with `groups`.
    fn new(groups: TermGroups, trials: &[Trial]) -> Self {
        let errors: Option<Vec<OutputErrors>> = trials.iter().map(|trial| trial.errors).collect();
        let motion = first_largest(0..trials.len(), |at| trials[*at].worst).unwrap_or(0);
        let failed = trials.iter().find(|trial| !trial.remark.is_empty());
        Self {
            groups,
            errors: errors.and_then(|errors| errors.into_iter().reduce(OutputErrors::larger_of)),
            worst: trials.get(motion).map_or(0.0, |trial| trial.worst),
            motion,
            remark: failed.map_or_else(String::new, |trial| trial.remark.clone()),
        }
    }

    /// Returns true if all errors are within the limit.
    pub fn holds(&self) -> bool {
        self.worst <= 1.0
    }
}

/// Motions of a body within its ranges, and the errors of leaving terms out.
#[derive(Debug, Clone, PartialEq)]
pub struct SampledMotions {
    /// Number of motions.
    pub count: usize,
    /// Duration of each motion, in the unit of time of the body.
    pub duration: f64,
    /// Largest deflection of a node in any motion, in the unit of length of the body.
    pub deflection: f64,
    /// Sets of terms that were tried, cheapest first. Only the last one may hold.
    pub sets: Vec<SampledSet>,
    /// Groups of the cheapest set that holds; all groups of the body if none does.
    pub groups: TermGroups,
}

/// Reason why no motions were sampled.
pub type NotSampled = String;

/// Samples motions of `body` from `ranges`, and measures each with fewer and fewer terms left out.
///
/// * A free body turns at the largest rate about axes near those of its frame and about evenly spread ones. It starts
///   with the deflection that the rotation causes, or with vibrations of the stated deflection in its lowest modes.
/// * A prescribed rotation runs up to the largest rate, or oscillates with it so that its angular acceleration is the square
///   of the rate.
///
/// # Errors
/// The errors of [`trace`](flexbody_motion::scene::trace) but for those that end a run, which are the reason why there are no
/// motions.
pub(super) fn sampled(
    body: &FlexBody,
    ranges: &Ranges,
    context: &Context<'_>,
) -> Result<std::result::Result<SampledMotions, NotSampled>> {
    if ranges.attached.is_some() && !ranges.is_rotation_given {
        return Ok(Err(
            "the motion of a free body with an attached mass needs a multibody program".to_owned()
        ));
    }
    let Some(duration) = duration(body, ranges) else {
        return Ok(Err(
            "neither a rotation rate nor a deflection is stated, so that nothing moves".to_owned()
        ));
    };
    let scenes = scenes(body, ranges, duration);
    let framed: Vec<FramedScene<'_>> =
        scenes.iter().map(|scene| FramedScene::new(body, scene)).collect::<Result<_>>()?;
    let motions: Vec<Case<'_>> =
        framed.iter().map(|own| Case::new(&own.body, &own.scene, context)).collect::<Result<_>>()?;
    context.phase("motions of the whole body");
    context.runs(motions.len());
    let traces: Result<Vec<(Trace, _)>> =
        motions.par_iter().map(|motion| motion.runs().motion(body.groups())).collect();
    let references: Vec<Trace> = match traces {
        Ok(traces) => traces.into_iter().map(|(trace, _)| trace).collect(),
        Err(error) if error.diagnostics().iter().all(|diagnostic| ends_a_run(diagnostic.code())) => {
            return Ok(Err(format!(
                "a motion in these ranges cannot be simulated: {}",
                error.first_error().message()
            )));
        }
        Err(error) => return Err(error),
    };
    context.phase("motions without terms");
    measured(body, &motions, &references, duration).map(Ok)
}

/// Measures the motions with sets of terms, cheapest first, up to the first one that holds.
fn measured(
    body: &FlexBody,
    motions: &[Case<'_>],
    references: &[Trace],
    duration: f64,
) -> Result<SampledMotions> {
    let held = body.groups();
    let measures: Vec<Measure<'_>> = motions
        .iter()
        .zip(references)
        .map(|(motion, trace)| Measure::new(motion.body, motion.scene, trace))
        .collect();
    let all_modes: Vec<usize> = (0..body.n_modes()).collect();
    let mut sets = Vec::new();
    let smaller = sets_in(false).filter(|set| *set != held && set.and(held) == *set);
    for groups in smaller {
        let trials: Vec<Trial> = motions
            .par_iter()
            .zip(&measures)
            .map(|(motion, measure)| Ok(motion.runs().measured(measure, &all_modes, groups, 1.0)?.0))
            .collect::<Result<_>>()?;
        let set = SampledSet::new(groups, &trials);
        let holds = set.holds();
        sets.push(set);
        if holds {
            break;
        }
    }
    let largest = references.iter().map(|trace| trace.extremes.deflection.value).fold(0.0, f64::max);
    Ok(SampledMotions {
        count: motions.len(),
        duration,
        deflection: largest * body.extent(),
        groups: sets.last().filter(|set| set.holds()).map_or(held, |set| set.groups),
        sets,
    })
}

/// Returns the duration of the motions; `None` if nothing moves.
fn duration(body: &FlexBody, ranges: &Ranges) -> Option<f64> {
    if ranges.spin_hz == 0.0 && ranges.deflection.is_none() {
        return None;
    }
    let softest = body.modes().eigenvalue.iter().copied().fold(f64::INFINITY, f64::min);
    let first_period = TAU / softest.sqrt();
    let longest = first_period * if ranges.deflection.is_some() { PERIODS } else { MOST_PERIODS };
    let turning = match ranges.spin_hz {
        0.0 => REVOLUTIONS * first_period,
        spin => REVOLUTIONS * TAU / body.units().eigenvalue_of(spin).sqrt(),
    };
    Some(ranges.duration.unwrap_or(turning.min(longest)))
}

/// Returns a run with all terms, in which errors of the steps are below `tolerance`.
pub(super) fn run(duration: Option<f64>, tolerance: f64) -> Run {
    let (scheme, terms) = (Scheme::Adaptive { tolerance }, Terms::ALL);
    Run { duration, outputs: 1, most_steps: Run::MOST_STEPS, scheme, terms }
}

fn scenes(body: &FlexBody, ranges: &Ranges, duration: f64) -> Vec<Scene> {
    let rate = body.units().eigenvalue_of(ranges.spin_hz).sqrt();
    let run = run(Some(duration), TOLERANCE);
    let errors =
        PerQuantity { reaction: f64::INFINITY, recovery: f64::INFINITY, ..PerQuantity::all(ranges.limit) };
    let least_deflection = Some(LEAST_DEFLECTION * body.extent());
    let requirements =
        Requirements { tolerance: Tolerance { errors, least_deflection }, ..Requirements::default() };
    let scene = |(at, axis): (usize, Vector3<f64>)| {
        let modes = ranges.deflection.map_or_else(Vec::new, |deflection| vibration(body, at, deflection));
        let mut initial =
            Initial { settled: modes.is_empty(), modes, axes: Axes::Body, ..Initial::default() };
        let spin = ranges.is_rotation_given.then(|| Spin {
            velocity: VectorHistory::Along { direction: axis, factor: turning(at, rate, duration) },
            axes: Axes::Body,
            start: None,
            hold: true,
        });
        if spin.is_none() {
            initial.angular_velocity = axis * rate;
        }
        let requirements = requirements.clone();
        Scene { initial, spin, requirements, ..Scene::new(format!("motion {}", at + 1), run.clone()) }
    };
    axes(body.dimension()).into_iter().enumerate().map(scene).collect()
}

/// Returns the axes of rotation: near those of the body frame, then evenly spread (a spiral on the sphere).
fn axes(dimension: usize) -> Vec<Vector3<f64>> {
    if dimension == 2 {
        return (0..MOTIONS_IN_PLANE)
            .map(|at| if at % 2 == 0 { Vector3::z() } else { -Vector3::z() })
            .collect();
    }
    let near = (0..3).map(|k| (Vector3::ith(k, 1.0) + Vector3::ith((k + 1) % 3, TILT)).normalize());
    let spread = MOTIONS - 3;
    let golden = PI * (3.0 - 5f64.sqrt());
    let spiral = (0..spread).map(|at| {
        let height = 1.0 - (2.0 * at as f64 + 1.0) / spread as f64;
        let (sin, cos) = sincos(golden * at as f64);
        let radius = (1.0 - height * height).sqrt();
        Vector3::new(radius * cos, radius * sin, height)
    });
    near.chain(spiral).collect()
}

/// Returns the prescribed rate of a motion: in turns a run-up in a quarter of the duration, and an oscillation whose angular
/// acceleration is the square of its rate.
fn turning(at: usize, rate: f64, duration: f64) -> History {
    if at.is_multiple_of(2) {
        History::Ramp { from: 0.0, to: rate, start: 0.0, duration: 0.25 * duration }
    } else {
        History::Sine { amplitude: rate, frequency: rate / TAU, phase: 0.0 }
    }
}

/// Returns the start of a vibration that moves a node by `deflection`: in every third motion one of the lowest modes, else the
/// lowest modes with equal energies and signs that differ between the motions.
fn vibration(body: &FlexBody, at: usize, deflection: f64) -> Vec<ModeStart> {
    let roots: Vec<f64> = body.modes().eigenvalue.iter().map(|lambda| lambda.sqrt()).collect();
    let few = VIBRATING.min(roots.len());
    let alone = at / 3 % few;
    let amplitude = |mode: usize| match at % 3 {
        0 => f64::from(mode == alone),
        _ => (if at >> (mode % 4) & 1 == 0 { 1.0 } else { -1.0 }) * roots[0] / roots[mode],
    };
    let amplitudes: Vec<f64> = (0..few).map(amplitude).collect();
    let shape = &body.modes().shape;
    let moved = |node: usize| {
        let along = |k: usize| {
            amplitudes.iter().enumerate().map(|(mode, q)| q * shape[(3 * node + k, mode)]).sum::<f64>()
        };
        Vector3::from([along(0), along(1), along(2)]).norm()
    };
    let largest = (0..body.n_nodes()).map(moved).fold(0.0, f64::max);
    let start = |(mode, q): (usize, &f64)| ModeStart { mode, amplitude: q * deflection / largest, rate: 0.0 };
    amplitudes.iter().enumerate().filter(|(_, q)| **q != 0.0).map(start).collect()
}
