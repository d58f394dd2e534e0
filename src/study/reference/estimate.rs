//! What a body lacks of the model that it was made of, estimated along its motion in a scene.

use super::answered::answered;
use super::compressed::{Compressed, principal};
use super::residual::NodalView;
use super::turning::Turning;
use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::Result;
use crate::body::basis::free_static_responses;
use crate::body::flex_body::FlexBody;
use crate::body::invariants::symmetric_part;
use crate::model::FeModel;
use crate::motion::scene::{OutputErrors, Peak, Point, Scene, Stage, Trace, instants, nodal_point, trace};
use crate::numerics::linalg::{combine, gram, larger, not_negative, subtract_combination};
use faer::{Mat, MatRef};

/// Part of the tolerances that the reference of a study may lack of the model without a word.
pub const PART_OF_REFERENCE: f64 = 0.1;

/// Part of the tolerances that a body may lack of the model and still be a reference: others get the rest.
const MOST_LACKING: f64 = 0.5;

/// Instants that the motion is looked at.
const INSTANTS: usize = 120;

/// The elastic energy of what the body lacks, after so many responses of the motion joined it, is below this
/// part of what is allowed.
const PART_OF_RESPONSES: f64 = 0.1;

/// Responses that may join the body at once.
const MOST_RESPONSES: usize = 12;

/// What a body lacks of the model that it was made of, in a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceError {
    /// Number of modes of the body.
    pub modes: usize,
    /// Its errors against the motion of all nodes, estimated: the responses, with their inertia, to what the
    /// equations of all nodes leave unbalanced along its motion, and how these turn a free body. Nothing is
    /// estimated of reactions.
    pub errors: OutputErrors,
    /// The largest of them over its tolerance.
    pub worst: f64,
    /// When the estimate of the elastic energy is largest.
    pub time: f64,
}

impl ReferenceError {
    /// Whether others may be measured against the body: against what is left of the tolerances.
    pub fn is_reference(&self) -> bool {
        self.worst <= MOST_LACKING
    }

    /// The warning about a body that lacks what counts.
    pub fn warning(&self, scene: &Scene) -> Option<Diagnostic> {
        if self.worst <= PART_OF_REFERENCE {
            return None;
        }
        let message = format!(
            "the body of {} modes that everything is measured against lacks {:.0} % of the tolerances itself, most at t = {:.3e}",
            self.modes,
            100.0 * self.worst,
            self.time
        );
        let warning = Diagnostic::new(Code::ReferenceLacks, message);
        let begins_with_shock = scene.acting().any(|history| history.at(0.0).0.norm() != 0.0);
        Some(match begins_with_shock && !scene.initial.settled {
            true => warning.with_help(
                "loads that act at time 0 begin with a shock: start with [initial] deformation = \"static\", or with loads that begin at zero",
            ),
            false => warning,
        })
    }
}

/// An estimate, and what would improve the body.
pub(super) struct Estimate {
    pub error: ReferenceError,
    /// Nodal forces (N x k) whose static responses the body lacks most, so many as it takes to come within
    /// what is allowed.
    pub missing: Mat<f64>,
}

impl Estimate {
    /// Estimates what `body`, made of `model`, lacks in `scene`. `allowed` is the part of the tolerances that
    /// it may lack. `None` where nothing can be said: for a scene without a duration, and a body that is
    /// carried.
    ///
    /// # Errors
    /// Those of [`trace`] and [`free_static_responses`].
    pub fn new(
        model: &FeModel,
        body: &FlexBody,
        scene: &Scene,
        allowed: f64,
        memory: Option<u64>,
    ) -> Result<Option<Self>> {
        let Some(duration) = scene.run.duration.filter(|_| scene.carried.is_none()) else { return Ok(None) };
        let stage = Stage::new(body, scene)?;
        let (body, scene) = (&*stage.body, &*stage.scene);
        let at = |point: &Point| Ok(nodal_point(model, point)?.unit_loads(model));
        let loads = scene.loads.iter().map(|load| at(&load.at)).collect::<Result<Vec<_>>>()?;
        let watched = scene.watched.iter().map(at).collect::<Result<Vec<_>>>()?;
        let Some(view) = NodalView::new(model, body, loads) else { return Ok(None) };
        let (motion, _) = trace(body, scene, memory, |_| ())?;
        let times: Vec<f64> = (0..=INSTANTS).map(|i| duration * (i as f64 / INSTANTS as f64)).collect();
        let mut same_steps = scene.clone();
        same_steps.run.scheme = motion.scheme;
        let looked_at = instants(body, &same_steps, &times)?;
        let residual = view.residual(&looked_at);
        let missed = Missed::new(&view, body, residual)?.moving(&view, &times, scene.initial.settled);
        let energies = missed.root_energies();
        let largest = (0..energies.len()).fold(0, |at, i| if energies[i] > energies[at] { i } else { at });
        let mut errors = missed.errors(&view, body, &energies, &motion, &watched, &times);
        if scene.spin.is_none() {
            let turning = Turning::new(&view, &missed.responses);
            errors.attitude = Peak::of(&times, turning.angles(&looked_at, &missed.forces.amplitudes)).value;
        }
        let tolerance = &scene.requirements.tolerance;
        let error = ReferenceError {
            modes: body.n_modes(),
            worst: errors.worst(tolerance),
            time: times[largest],
            errors,
        };
        let enough = PART_OF_RESPONSES * allowed * tolerance.stress.min(tolerance.deflection);
        let missing = missed.dominant(enough * energy_scale(&motion));
        Ok(Some(Self { error, missing }))
    }
}

/// Root of the largest elastic energy of a motion, or the least that counts.
fn energy_scale(motion: &Trace) -> f64 {
    let roots = motion.elastic.iter().map(|energy| energy.max(0.0).sqrt());
    Peak::of(&motion.time, roots).value.max(motion.resolution.root_energy)
}

/// The motion E c(t) that a body lacks, of static responses E.
struct Missed {
    /// Compressed residual; its amplitudes are those of the responses.
    forces: Compressed,
    /// E = K^+ B (N x k), beside the modes.
    responses: Mat<f64>,
    /// E'K E.
    energy: Mat<f64>,
}

impl Missed {
    fn new(view: &NodalView<'_>, body: &FlexBody, residual: Mat<f64>) -> Result<Self> {
        let model = view.model;
        let nothing = || Compressed {
            basis: Mat::zeros(residual.nrows(), 0),
            amplitudes: Mat::zeros(0, residual.ncols()),
        };
        let forces = Compressed::new(model, &residual).unwrap_or_else(nothing);
        if forces.basis.ncols() == 0 {
            return Ok(Self { responses: forces.basis.clone(), energy: Mat::zeros(0, 0), forces });
        }
        let mut responses = free_static_responses(model, forces.basis.clone(), body.modes().eigenvalue[0])?;
        // The part in the modes is that of rounding.
        let weighted = model.pencil().apply_stiffness(view.vectors.as_ref());
        let shared = gram(weighted.as_ref(), responses.as_ref());
        let amplitudes =
            Mat::from_fn(shared.nrows(), shared.ncols(), |p, j| shared[(p, j)] / body.modes().eigenvalue[p]);
        subtract_combination(responses.as_mut(), view.vectors.as_ref(), amplitudes.as_ref());
        let energy = gram(responses.as_ref(), model.pencil().apply_stiffness(responses.as_ref()).as_ref());
        let energy = symmetric_part(&energy);
        Ok(Self { forces, responses, energy })
    }

    /// The same with the inertia of what is missed: it need not follow the forces as if they were static.
    fn moving(mut self, view: &NodalView<'_>, times: &[f64], settled: bool) -> Self {
        let inertia =
            gram(self.responses.as_ref(), view.model.pencil().apply_mass(self.responses.as_ref()).as_ref());
        let inertia = symmetric_part(&inertia);
        let moving = answered(&self.energy, &inertia, &self.forces.amplitudes, times, settled);
        self.forces.amplitudes = moving.unwrap_or(self.forces.amplitudes);
        self
    }

    /// The root of the elastic energy of what is missed, at every instant.
    fn root_energies(&self) -> Vec<f64> {
        let c = &self.forces.amplitudes;
        let product = combine(self.energy.as_ref(), c.as_ref());
        let square = |i: usize| (0..c.nrows()).map(|k| c[(k, i)] * product[(k, i)]).sum::<f64>();
        (0..c.ncols()).map(|i| not_negative(0.5 * square(i)).sqrt()).collect()
    }

    /// Errors relative to the motion, in the elastic energy that of all nodes: what is missed is K-orthogonal
    /// to the modes and adds to it. `energies` are those of [`Missed::root_energies`].
    fn errors(
        &self,
        view: &NodalView<'_>,
        body: &FlexBody,
        energies: &[f64],
        motion: &Trace,
        watched: &[Mat<f64>],
        times: &[f64],
    ) -> OutputErrors {
        let c = &self.forces.amplitudes;
        let missed = Peak::of(times, energies.iter().copied()).value;
        let stress = missed / missed.hypot(energy_scale(motion));
        let moved = match watched {
            [] => {
                let u = combine(self.responses.as_ref(), c.as_ref());
                (0..u.ncols()).map(|i| view.model.longest_displacement(u.col_as_slice(i))).collect()
            }
            points => longest_of_points(view.model, points, self.responses.as_ref(), c.as_ref()),
        };
        let largest = match motion.deflections.is_empty() {
            true => motion.extremes.deflection.value * body.extent(),
            false => {
                let norms =
                    |path: &Vec<_>| Peak::of(&motion.time, path.iter().map(nalgebra::Vector3::norm)).value;
                motion.deflections.iter().map(norms).fold(0.0, larger)
            }
        };
        let scale = largest.max(motion.resolution.deflection);
        OutputErrors {
            attitude: 0.0,
            deflection: (scale > 0.0).then(|| Peak::of(times, moved).value / scale),
            stress: Some(stress),
            reaction: None,
        }
    }

    /// The fewest forces B y (N x p) whose responses leave, at every instant, no more than `enough` of the
    /// root of the elastic energy.
    fn dominant(&self, enough: f64) -> Mat<f64> {
        let none = || Mat::zeros(self.forces.basis.nrows(), 0);
        let Some((turned, roots)) = principal(self.energy.clone(), 0.0, usize::MAX) else { return none() };
        // z = T'c with E'K E = T T': the elastic energy is |z|^2 / 2.
        let z = |k: usize, i: usize| -> f64 {
            roots[k]
                * (0..turned.nrows())
                    .map(|row| turned[(row, k)] * self.forces.amplitudes[(row, i)])
                    .sum::<f64>()
        };
        let z = Mat::from_fn(roots.len(), self.forces.amplitudes.ncols(), z);
        let covariance = combine(z.as_ref(), z.transpose().to_owned().as_ref());
        let Some((directions, _)) = principal(covariance, 0.0, MOST_RESPONSES) else { return none() };
        let along = gram(directions.as_ref(), z.as_ref());
        let left = |count: usize, i: usize| -> f64 {
            let whole: f64 = (0..z.nrows()).map(|k| z[(k, i)].powi(2)).sum();
            let taken: f64 = (0..count).map(|k| along[(k, i)].powi(2)).sum();
            not_negative(0.5 * (whole - taken)).sqrt()
        };
        let worst = |count: &usize| (0..z.ncols()).map(|i| left(*count, i)).fold(0.0, larger);
        let count =
            (0..directions.ncols()).find(|count| worst(count) <= enough).unwrap_or(directions.ncols());
        let y = Mat::from_fn(turned.nrows(), count, |row, p| {
            (0..roots.len()).map(|k| turned[(row, k)] / roots[k] * directions[(k, p)]).sum()
        });
        combine(self.forces.basis.as_ref(), y.as_ref())
    }
}

/// Length of the longest displacement of the watched points, at every instant.
fn longest_of_points(
    model: &FeModel,
    points: &[Mat<f64>],
    responses: MatRef<'_, f64>,
    amplitudes: MatRef<'_, f64>,
) -> Vec<f64> {
    let d = model.dimension();
    let mut longest = vec![0.0; amplitudes.ncols()];
    for point in points {
        let moved = combine(gram(point.as_ref().subcols(0, d), responses).as_ref(), amplitudes);
        for (i, longest) in longest.iter_mut().enumerate() {
            *longest = larger(*longest, (0..d).map(|k| moved[(k, i)].powi(2)).sum::<f64>().sqrt());
        }
    }
    longest
}
