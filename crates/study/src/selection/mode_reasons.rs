//! Reasons for the modes of a selection: what excites them, and what one more or one fewer would change.

use super::bounds::Variation;
use super::choice::Choice;
use super::demand::Demand;
use super::shapes::Pool;
use super::situation::PointRows;
use super::trial::Trial;
use crate::reference::ReferenceError;
use flexbody_body::flex_body::RigidAccelerations;
use flexbody_linalg::ties::first_largest;
use flexbody_motion::scene::{Load, VectorHistory, carrier_accelerations};
use nalgebra::{DMatrix, Vector3};

/// Number of modes whose excitation is told. The modes of the largest contribution are told.
const TOLD: usize = 3;

/// Error over its tolerance whose source is not told.
const NEGLIGIBLE: f64 = 1e-3;

/// Part of the remaining error from which one source makes most of it.
const MOST: f64 = 0.5;

/// Excitations of the modes of a selection, and the worth of those at its edge.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeReasons {
    /// Excitations of the modes that contribute most, by descending contribution.
    pub excited: Vec<Excitation>,
    /// The selected model without its mode of the smallest contribution; `None` if it was not measured.
    pub without_last: Option<ModeWorth>,
    /// The selected model with the next mode as well; `None` if all modes are kept.
    pub with_next: Option<ModeWorth>,
    /// Source of most of the remaining error; `None` if there is no such source.
    pub rest: Option<ErrorSource>,
}

/// Excitation of some modes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Excitation {
    /// Load or motion with the largest force on these modes.
    pub by: String,
    /// Indices of the modes (from 0), ascending, or of fixed-interface modes if these are picked.
    pub modes: Vec<usize>,
}

/// Error of a model with one mode more or fewer than the selected one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeWorth {
    /// Index of the mode (from 0), or of the fixed-interface mode if these are picked.
    pub mode: usize,
    /// Its frequency. Unit: Hz.
    pub frequency_hz: f64,
    /// Quantity with the largest ratio of error to tolerance.
    pub output: &'static str,
    /// Its error.
    pub error: f64,
}

/// Source of an error of a selected model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorSource {
    /// Modes that are not kept.
    Modes,
    /// Groups of terms that are not kept.
    Groups,
    /// The body itself beside its model.
    Body,
}

impl ModeReasons {
    /// Collects the reasons for `choice` after the `trials`; `None` unless the fewest modes were looked for.
    pub(super) fn of(demands: &[Demand<'_>], choice: &Choice, trials: &[Trial]) -> Option<Self> {
        let (count, ranked) = (choice.modes.len(), &choice.ranked);
        if ranked.is_empty() {
            return None;
        }
        let body = demands[0].body;
        let lambda = demands[0].shapes(choice.pool).eigenvalues();
        let frequency_hz = |mode: usize| body.units().frequency_of(lambda[mode]);
        let worth = |mode: Option<&usize>, trial: Option<&Trial>| -> Option<ModeWorth> {
            let trial = trial?;
            let tolerance = demands[trial.case.unwrap_or(0)].tolerance();
            let (output, error, _) = trial.errors?.decisive(tolerance);
            let mode = *mode?;
            Some(ModeWorth { mode, frequency_hz: frequency_hz(mode), output, error })
        };
        // The search ends between a number of modes that fails and one that passes.
        let others = body.n_modes() - ranked.len();
        let is_fewer = |trial: &&Trial| {
            trial.pool == choice.pool && trial.modes + 1 == others + count && !trial.passed()
        };
        let fewer = trials.iter().rfind(|trial| trial.tier == 2 && is_fewer(trial));
        Some(Self {
            excited: excited(demands, choice.pool, &ranked[..count.min(TOLD)]),
            without_last: worth(count.checked_sub(1).and_then(|last| ranked.get(last)), fewer),
            with_next: worth(ranked.get(count), choice.next.as_ref()),
            rest: error_source(demands, choice, trials),
        })
    }
}

/// Returns the source of most of the error that is left.
fn error_source(demands: &[Demand<'_>], choice: &Choice, trials: &[Trial]) -> Option<ErrorSource> {
    let own = choice.chosen.as_ref()?.worst;
    let of_body = demands.iter().filter_map(|demand| demand.reference_errors.last());
    let of_body = of_body.filter(|error| error.unknown.is_none()).map(|error: &ReferenceError| error.worst);
    let of_body = of_body.fold(0.0, f64::max);
    if own.max(of_body) < NEGLIGIBLE {
        return None;
    }
    if of_body > own {
        return Some(ErrorSource::Body);
    }
    let whole = demands[0].body.n_modes();
    if choice.modes.len() == choice.ranked.len() {
        return Some(ErrorSource::Groups);
    }
    // Error of the groups alone, with all modes: measured or a bound; none if no group was left out.
    let held = demands[0].body.invariants().groups();
    let is_of_groups = |trial: &&Trial| trial.modes == whole && trial.kept == choice.groups;
    let of_groups = match trials.iter().rfind(is_of_groups) {
        _ if choice.groups.and(held) == held => 0.0,
        Some(trial) => trial.worst,
        None => return None,
    };
    Some(if of_groups < MOST * own { ErrorSource::Modes } else { ErrorSource::Groups })
}

/// Returns what excites `modes` of a pool, those with one excitation together.
fn excited(demands: &[Demand<'_>], pool: Pool, modes: &[usize]) -> Vec<Excitation> {
    let forces: Vec<(String, Vec<f64>)> =
        demands.iter().flat_map(|demand| excitations(demand, pool)).collect();
    let mut excited: Vec<Excitation> = Vec::new();
    for &mode in modes {
        let largest = first_largest(&forces, |(_, forces)| forces[mode].abs());
        let Some((by, _)) = largest.filter(|(_, forces)| forces[mode] != 0.0) else { continue };
        match excited.iter_mut().find(|known| known.by == *by) {
            Some(known) => known.modes.push(mode),
            None => excited.push(Excitation { by: by.clone(), modes: vec![mode] }),
        }
    }
    excited.iter_mut().for_each(|own| own.modes.sort_unstable());
    excited
}

/// Returns the largest force on every mode of a pool by each load and motion of a load case.
fn excitations(demand: &Demand<'_>, pool: Pool) -> Vec<(String, Vec<f64>)> {
    let (body, scene, duration) = (demand.body, demand.scene, demand.situation.duration.value);
    let (rows, shapes) = (PointRows::new(body), demand.shapes(pool));
    let mut all = Vec::new();
    let along = |psi: &DMatrix<f64>, history: &VectorHistory| -> Vec<f64> {
        let largest = Variation::of_vector(history, duration).largest;
        let force = |j: usize| match history.direction().and_then(|direction| direction.try_normalize(0.0)) {
            Some(direction) => psi.column(j).dot(&direction) * largest,
            None => psi.column(j).norm() * largest,
        };
        (0..psi.ncols()).map(force).collect()
    };
    for (load, point) in scene.loads.iter().zip(&demand.loads) {
        let Load { at, force, torque, .. } = load;
        if !force.is_nothing() {
            let name = if load.is_named() { at.to_string() } else { format!("the force at {at}") };
            all.push((name, along(&shapes.rows(rows.of(point)), force)));
        }
        if !torque.is_nothing() {
            all.push((format!("the torque at {at}"), along(&shapes.rows(rows.of_rotation(point)), torque)));
        }
    }
    let frame = if scene.prescribes() || scene.carried.is_some() {
        carrier_accelerations(body.frame(), scene)
    } else {
        vec![RigidAccelerations::new(Vector3::zeros(), &scene.initial.angular_velocity, &Vector3::zeros())]
    };
    let modal = frame.iter().filter_map(|motion| motion.modal(body.invariants()));
    let modal: Vec<DMatrix<f64>> =
        modal.map(|forces| shapes.rows(DMatrix::from_row_slice(1, forces.len(), &forces))).collect();
    let largest = |j: usize| modal.iter().map(|forces| forces[(0, j)].abs()).fold(0.0, f64::max);
    let count = shapes.eigenvalues().len();
    let name = if scene.carried.is_some() { "the motion of the carrier" } else { "the rotation" };
    all.push((name.to_owned(), (0..count).map(largest).collect()));
    // A scene that starts modes by their numbers picks from modes.
    let mut start = vec![0.0; count];
    for own in &scene.initial.modes {
        start[own.mode] = own.amplitude * body.modes().eigenvalue[own.mode];
    }
    all.push(("the initial deformation".to_owned(), start));
    all
}
