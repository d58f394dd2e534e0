//! Error measures: the distance of a motion from a reference motion, in the quantities that have tolerances
//! in a scene.

use super::extremes::{ActiveNodes, Peak, along_principal_directions, longest};
use super::{Extremes, PerQuantity, RecoveryMeasure, Scene, Tolerance, Trace};
use crate::dynamics::EulerParameters;
use faer::MatRef;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::ties::first_largest;
use flexbody_linalg::{larger, not_negative};
use libm::atan2;
use nalgebra::{DMatrix, DVector, Vector3};

/// Part of the centrifugal torque w^2 I, or force w^2 m r, below which reactions are not compared.
pub const LEAST_REACTION: f64 = 1e-3;

/// Part of the largest force times the radius of gyration below which torques are not compared, and of the
/// largest torque over this radius for forces. Example: the torque of a bar that is shaken along its axis
/// is rounding.
const LEAST_BESIDE: f64 = 1e-2;

/// Ratio of the errors in the second half of a run to those in the first, relative to the growth of the
/// motion, above which the errors are reported as growing.
const MIN_REPORTED_GROWTH: f64 = 1.8;

/// Part of the tolerance below which growing errors are not reported.
const MIN_GROWING_ERROR: f64 = 0.1;

/// Force and torque.
type Reaction = (Vector3<f64>, Vector3<f64>);

/// Largest errors over the continuous motion. `None` if the quantity does not occur in the reference; the
/// attitude always occurs.
pub type OutputErrors = PerQuantity<Option<f64>>;

impl OutputErrors {
    /// Returns the largest ratio of error to tolerance.
    pub fn worst(&self, tolerance: &Tolerance) -> f64 {
        let ratio = |(error, allowed): (Option<f64>, f64)| error.map_or(0.0, |error| error / allowed);
        let ratios = self.zip(tolerance.errors).map(ratio).named();
        ratios.into_iter().fold(0.0, |largest, (_, ratio)| larger(largest, ratio))
    }

    /// Returns the quantity with the largest ratio of error to tolerance: its name, the error, and the
    /// tolerance.
    pub fn decisive(&self, tolerance: &Tolerance) -> (&'static str, f64, f64) {
        let all = self.zip(tolerance.errors).named().into_iter();
        let there = all.filter_map(|(name, (error, allowed))| Some((name, error?, allowed)));
        first_largest(there, |(_, error, allowed)| error / allowed).expect("an attitude is always there")
    }

    /// Returns the larger error of two motions for each quantity.
    pub fn larger_of(self, other: Self) -> Self {
        self.zip(other).map(|(a, b)| a.into_iter().chain(b).reduce(larger))
    }

    /// Returns true if every error is within its tolerance.
    pub fn within(&self, tolerance: &Tolerance) -> bool {
        self.worst(tolerance) <= 1.0
    }
}

/// Errors as functions of time; [`OutputErrors`] holds their largest values.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorHistory {
    /// Times at which the motion was sampled.
    pub time: Vec<f64>,
    /// Errors of each quantity at these times.
    pub errors: PerQuantity<Option<Vec<f64>>>,
}

impl ErrorHistory {
    /// Returns the largest errors, including those between the sampled times.
    pub fn largest(&self) -> OutputErrors {
        let peak = |history: &[f64]| Peak::of(&self.time, history.iter().copied()).value;
        self.errors.as_ref().map(|history| history.as_deref().map(peak))
    }

    /// Returns the growth of the errors from the first half of the run to the second, relative to the
    /// growth of `motion`, the reference: about 1 for errors in step with the motion, 2 and more if phases
    /// drift apart. Returns `None` if the growth is too small to report (`MIN_REPORTED_GROWTH`), or if the errors of
    /// the second half are far below their tolerances (`MIN_GROWING_ERROR`).
    pub fn growth(&self, motion: &Trace, tolerance: &Tolerance) -> Option<f64> {
        let growth = |(first, second): (f64, f64), allowed: f64| {
            (first > 0.0 && second > MIN_GROWING_ERROR * allowed).then(|| second / first)
        };
        let energies: Vec<f64> = motion.elastic.iter().map(|energy| not_negative(*energy).sqrt()).collect();
        let motion = growth(self.halves(&energies), 0.0)?;
        // The attitude has no amplitude to compare with: its own growth counts.
        let own = |(errors, allowed): (&Option<Vec<f64>>, f64)| {
            errors.as_ref().and_then(|errors| growth(self.halves(errors), allowed))
        };
        let PerQuantity { attitude, deflection, stress, recovery, .. } =
            self.errors.as_ref().zip(tolerance.errors).map(own);
        let beyond_motion =
            [deflection, stress, recovery].into_iter().flatten().map(|growth| growth / motion.max(1.0));
        let most = beyond_motion.chain(attitude).reduce(f64::max);
        most.filter(|growth| *growth > MIN_REPORTED_GROWTH)
    }

    /// Returns the largest of `values` in the first half of the run, and in the second.
    pub fn halves(&self, values: &[f64]) -> (f64, f64) {
        let end = self.time.last().copied().unwrap_or(0.0);
        let (first, second) = values.split_at(self.time.partition_point(|&time| time <= 0.5 * end));
        (first.iter().copied().fold(0.0, larger), second.iter().copied().fold(0.0, larger))
    }
}

/// Difference of the deformations of two motions, as functions of time.
#[derive(Debug, Clone, PartialEq)]
pub struct DeformationDifference {
    /// Elastic energy of the difference.
    pub energy: Vec<f64>,
    /// Largest difference of the deflections of the compared nodes.
    pub deflection: Vec<f64>,
    /// Largest deflection of the compared nodes in the reference.
    pub largest_deflection: f64,
    /// Errors of recoveries relative to their limits; `None` if none has a limit.
    pub recovery: Option<Vec<f64>>,
}

impl ErrorHistory {
    /// Computes the errors of `candidate`, whose deformation differs by `apart` from that of `reference`.
    /// Node deflections are used if no points are watched.
    ///
    /// # Panics
    /// When the motions were sampled at different times.
    pub fn new(reference: &Trace, candidate: &Trace, apart: DeformationDifference) -> Self {
        assert!(reference.time == candidate.time, "motions that were looked at in the same places");
        let attitudes = reference.attitude.iter().zip(&candidate.attitude);
        let (deflection, scale) = deflections(reference, candidate, &apart);
        let roots = reference.elastic.iter().map(|energy| energy.max(0.0).sqrt());
        let energy = Peak::of(&reference.time, roots).value;
        let stress = apart.energy.iter().map(|energy| energy.sqrt()).collect();
        Self {
            time: reference.time.clone(),
            errors: PerQuantity {
                attitude: Some(attitudes.map(|(a, b)| angle(a, b)).collect()),
                deflection: relative(deflection, scale.max(reference.resolution.deflection)),
                stress: relative(stress, energy.max(reference.resolution.root_energy)),
                reaction: reactions(reference, candidate),
                recovery: apart.recovery,
            },
        }
    }
}

/// Returns `values` relative to `scale`; `None` if the scale is zero.
fn relative(values: Vec<f64>, scale: f64) -> Option<Vec<f64>> {
    (scale > 0.0).then(|| values.into_iter().map(|value| value / scale).collect())
}

/// Returns the differences of deflections over time, and the largest deflection of the reference: for the
/// watched points or, without any, for the nodes compared by `apart`.
fn deflections(reference: &Trace, candidate: &Trace, apart: &DeformationDifference) -> (Vec<f64>, f64) {
    if reference.deflections.is_empty() {
        return (apart.deflection.clone(), apart.largest_deflection);
    }
    let pairs = || reference.deflections.iter().zip(&candidate.deflections);
    let at = |i: usize| pairs().map(|(a, b)| (a[i] - b[i]).norm()).fold(0.0, larger);
    let paths = reference.deflections.iter();
    let largest = paths.map(|path| Peak::of(&reference.time, path.iter().map(|d| d.norm())).value);
    ((0..reference.time.len()).map(at).collect(), largest.fold(0.0, larger))
}

/// Returns the errors of the force and the torque of prescribed motion, the larger of both.
fn reactions(reference: &Trace, candidate: &Trace) -> Option<Vec<f64>> {
    let both = [reference.reactions.as_deref()?, candidate.reactions.as_deref()?];
    reaction_errors(&reference.time, both, reference.size, &reference.extremes)
}

/// Returns the errors of reactions over time. The first reactions are those of the reference, whose mass,
/// radius of gyration and largest motion are given; the second are compared with them.
pub fn reaction_errors(
    time: &[f64],
    [a, b]: [&[Reaction]; 2],
    (mass, radius): (f64, f64),
    extremes: &Extremes,
) -> Option<Vec<f64>> {
    let parts: [fn(&Reaction) -> Vector3<f64>; 2] = [|both| both.0, |both| both.1];
    let largest = parts.map(|part| Peak::of(time, a.iter().map(|a| part(a).norm())).value);
    let levers = [radius, 1.0];
    let of_part = |k: usize| {
        let (part, lever) = (parts[k], levers[k]);
        // Forces below rounding count as zero for any limit.
        if largest[k] <= extremes.rounding() / lever {
            return None;
        }
        // Force and torque in units of torque: each is compared only above a part of the other.
        let beside = LEAST_BESIDE * largest[1 - k] * levers[1 - k];
        let least = (LEAST_REACTION * mass * (extremes.spin * radius).powi(2)).max(beside) / lever;
        let differences = a.iter().zip(b).map(|(a, b)| (part(a) - part(b)).norm()).collect();
        relative(differences, largest[k].max(least))
    };
    match (of_part(0), of_part(1)) {
        (Some(force), Some(torque)) => {
            Some(force.into_iter().zip(torque).map(|(a, b)| larger(a, b)).collect())
        }
        (force, torque) => force.or(torque),
    }
}

/// Returns the angle between two attitudes.
fn angle(a: &EulerParameters, b: &EulerParameters) -> f64 {
    let ([a0, a1, a2, a3], [b0, b1, b2, b3]) = (a.0, b.0);
    let (a, b) = (Vector3::new(a1, a2, a3), Vector3::new(b1, b2, b3));
    let scalar = a0 * b0 + a.dot(&b);
    let vector = b * a0 - a * b0 - a.cross(&b);
    2.0 * atan2(vector.norm(), scalar.abs())
}

/// Reference motion of a body, against which other motions are measured.
#[derive(Debug, Clone)]
pub struct Measure<'r> {
    body: &'r FlexBody,
    trace: &'r Trace,
    /// Nodes to compare if no points are watched.
    nodes: Vec<usize>,
    rows: ActiveNodes,
    largest_deflection: f64,
    recoveries: Option<RecoveryMeasure>,
}

impl<'r> Measure<'r> {
    /// Creates a measure against `trace`, a motion of `body` in `scene`, all in one frame.
    ///
    /// # Panics
    /// When the motion has another number of modes than the body.
    pub fn new(body: &'r FlexBody, scene: &Scene, trace: &'r Trace) -> Self {
        assert!(trace.q.iter().all(|q| q.len() == body.n_modes()), "a motion of the body");
        let nodes = if trace.deflections.is_empty() { along_principal_directions(body) } else { Vec::new() };
        let rows = ActiveNodes::new(body, &nodes);
        let largest_deflection = Peak::of(&trace.time, trace.q.iter().map(|q| rows.longest(q))).value;
        let recoveries = RecoveryMeasure::new(body, scene, trace.recovered.as_ref());
        Self { body, trace, nodes, rows, largest_deflection, recoveries }
    }

    /// Returns the body.
    pub fn body(&self) -> &'r FlexBody {
        self.body
    }

    /// Returns the motion of the reference.
    pub fn trace(&self) -> &'r Trace {
        self.trace
    }

    /// Returns the measure of recoveries with a limit; `None` if none has one.
    pub fn recoveries(&self) -> Option<&RecoveryMeasure> {
        self.recoveries.as_ref()
    }

    /// Returns the errors of the motion of a body that has the modes `kept` (from 0) of the reference, in
    /// this order.
    ///
    /// # Panics
    /// When the reference does not have these modes, or the motions were sampled at different times.
    pub fn of_subset(&self, candidate: &Trace, kept: &[usize]) -> ErrorHistory {
        let energy = self.body.invariants().modal_stiffness();
        let apart = self.apart(candidate, |reference, own| {
            let mut difference: Vec<f64> = reference.iter().map(|q| -q).collect();
            kept.iter().zip(own).for_each(|(&mode, q)| difference[mode] += q);
            let energy = 0.5 * quadratic(energy.as_ref(), &difference);
            (energy, self.rows.longest(&difference))
        });
        ErrorHistory::new(self.trace, candidate, apart)
    }

    /// Returns the errors of the motion of a body with other modes of the same model.
    ///
    /// # Panics
    /// When the motions were sampled at different times.
    pub fn of_other(&self, candidate: &Trace, modes: &OtherModes<'_>) -> ErrorHistory {
        let (energy, rows) =
            (self.body.invariants().modal_stiffness(), ActiveNodes::new(modes.body, &self.nodes));
        let apart = self.apart(candidate, |reference, own| {
            let q = DVector::from_column_slice(own);
            let difference = &modes.map * &q - DVector::from_column_slice(reference);
            let outside = not_negative((&modes.outside * &q).dot(&q));
            let displacements = rows.displacements(own).zip(self.rows.displacements(reference));
            let deflection = longest(displacements.map(|(own, reference)| own - reference));
            (0.5 * (quadratic(energy.as_ref(), difference.as_slice()) + outside), deflection)
        });
        ErrorHistory::new(self.trace, candidate, apart)
    }

    fn apart(
        &self,
        candidate: &Trace,
        difference: impl Fn(&[f64], &[f64]) -> (f64, f64),
    ) -> DeformationDifference {
        let (energy, deflection) =
            self.trace.q.iter().zip(&candidate.q).map(|(a, b)| difference(a, b)).unzip();
        let recovery = self.recoveries.as_ref().zip(self.trace.recovered.as_ref());
        let recovery = recovery.map(|(measure, own)| measure.errors(own, candidate.recovered.as_ref()));
        DeformationDifference { energy, deflection, largest_deflection: self.largest_deflection, recovery }
    }
}

/// Modes of a candidate expressed in those of the reference: with both stiffnesses L_c, L_r and G = Psi_c'K
/// Psi_r
///
/// ```text
/// V(Psi_c q_c - Psi_r q_r) = d'L_r d / 2 + q_c'(L_c - G L_r^-1 G') q_c / 2,    d = L_r^-1 G' q_c - q_r
/// ```
///
/// The first term lies within the span of the reference, the second outside of it; the formula avoids the
/// cancellation of a difference of squares.
#[derive(Debug, Clone)]
pub struct OtherModes<'c> {
    body: &'c FlexBody,
    /// L_r^-1 G' (nr x nc).
    map: DMatrix<f64>,
    /// L_c - G L_r^-1 G' (nc x nc).
    outside: DMatrix<f64>,
}

impl<'c> OtherModes<'c> {
    /// Expresses the modes of `candidate` in those of `reference`, with `shared` = G (nc x nr). Returns
    /// `None` if the bodies do not belong to one model, or if the stiffness of the reference is not
    /// positive definite.
    pub fn new(candidate: &'c FlexBody, reference: &FlexBody, shared: MatRef<'_, f64>) -> Option<Self> {
        let (nc, nr) = (candidate.n_modes(), reference.n_modes());
        // A lumped mass may have another centre of mass, which does not affect deflections.
        let same =
            candidate.n_nodes() == reference.n_nodes() && candidate.frame().axes == reference.frame().axes;
        if !same || (shared.nrows(), shared.ncols()) != (nc, nr) {
            return None;
        }
        let stiffness = |body: &FlexBody| body.invariants().symmetric_stiffness();
        let transposed = DMatrix::from_fn(nr, nc, |i, j| shared[(j, i)]);
        let map = stiffness(reference).cholesky()?.solve(&transposed);
        let outside = stiffness(candidate) - transposed.tr_mul(&map);
        Some(Self { body: candidate, map, outside })
    }
}

/// Returns x'A x of a positive semidefinite matrix.
fn quadratic(a: MatRef<'_, f64>, x: &[f64]) -> f64 {
    let column =
        |(j, xj): (usize, &f64)| xj * x.iter().enumerate().map(|(i, xi)| a[(i, j)] * xi).sum::<f64>();
    not_negative(x.iter().enumerate().map(column).sum::<f64>())
}
