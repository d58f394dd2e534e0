//! Largest values of all quantities over a continuous motion.

use crate::dynamics::{Balance, BodyPoint};
use crate::integration::ObserverEvent;
use faer::MatRef;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::{larger, not_negative};
use nalgebra::{Matrix3, Vector3};

/// Number of roundings of the largest total energy below which differences of energies count as rounding.
const ROUNDINGS: f64 = 16.0;

/// Torque, or force times a length, relative to the internal energy, below which it counts as rounding.
const NO_TORQUE: f64 = 1e-10;

/// Largest values of all quantities over a continuous motion: at the steps of the integration, at points
/// within them, and between these points. The values do not depend on the output times of the scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Extremes {
    /// Largest deflection of any node, relative to the largest extent of the body, and its time.
    pub deflection: Peak,
    /// Largest deflection of each watched point, and its time. Unit: length.
    pub watched: Vec<Peak>,
    /// Largest |q| of every mode.
    pub amplitudes: Vec<f64>,
    /// Largest elastic energy.
    pub elastic: f64,
    /// Largest internal energy: kinetic energy without that of translation, plus elastic energy.
    pub internal: f64,
    /// Largest energy with that of translation.
    pub total: f64,
    /// Largest angular velocity |omega|.
    pub spin: f64,
    /// Largest components |omega_k| of the angular velocity along the body axes.
    pub spin_body: Vector3<f64>,
    /// Largest angular velocities about distinct axes, body axes.
    pub spins: Vec<Vector3<f64>>,
    /// Largest force and torque of the prescribed motion; zero without.
    pub reaction: (f64, f64),
    /// Drift of conserved quantities.
    pub drift: Drift,
}

impl Extremes {
    /// Returns the torque, or force times a length, that counts as rounding: a carrier in pure translation exerts nothing else.
    pub fn rounding(&self) -> f64 {
        NO_TORQUE * self.internal + ROUNDINGS * f64::EPSILON * self.total
    }
}

/// Drift of conserved quantities: largest differences over the motion, dimensionless.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Drift {
    /// Drift of energy minus work, relative to the largest internal energy E (without that of translation)
    /// or work.
    pub energy: f64,
    /// Drift of linear momentum minus impulse, relative to the largest of both and of sqrt(2 m E).
    pub linear: f64,
    /// Drift of angular momentum minus angular impulse, relative to the largest of both and of r sqrt(2 m
    /// E), where r is the radius of gyration.
    pub angular: f64,
}

/// Observer that collects the extremes of a motion.
pub(super) struct Survey<'b> {
    body: &'b FlexBody,
    watched: &'b [BodyPoint],
    nodes: ActiveNodes,
    /// Deflection among `nodes`, and the time of its largest value.
    deflection: Peak,
    largest_deformations: LargestDeformations,
    paths: Vec<Peak>,
    amplitudes: Vec<Peak>,
    /// Roots of the energies, which grow like displacements.
    elastic: Peak,
    internal: Peak,
    spin: Peak,
    spin_body: [Peak; 3],
    spins: Spins,
    reaction: [Peak; 2],
    differences: Differences,
}

impl<'b> Survey<'b> {
    pub(super) fn new(body: &'b FlexBody, watched: &'b [BodyPoint]) -> Self {
        Self {
            body,
            watched,
            nodes: ActiveNodes::of_modes(body),
            deflection: Peak::default(),
            largest_deformations: LargestDeformations::default(),
            paths: vec![Peak::default(); watched.len()],
            amplitudes: vec![Peak::default(); body.n_modes()],
            elastic: Peak::default(),
            internal: Peak::default(),
            spin: Peak::default(),
            spin_body: [Peak::default(); 3],
            spins: Spins::default(),
            reaction: [Peak::default(); 2],
            differences: Differences::default(),
        }
    }

    /// Takes the deformation at a time of the motion.
    pub(super) fn see_shape(&mut self, time: f64, q: &[f64], elastic: f64) {
        let deflection = self.nodes.longest(q);
        self.deflection.see(time, deflection);
        self.largest_deformations.see(time, deflection, q);
        self.elastic.see(time, elastic.max(0.0).sqrt());
        for (peak, point) in self.paths.iter_mut().zip(self.watched) {
            peak.see(time, point.deflection(q).norm());
        }
        self.amplitudes.iter_mut().zip(q).for_each(|(peak, q)| peak.see(time, q.abs()));
    }

    /// Takes force and torque of the prescribed motion.
    pub(super) fn see_reaction(&mut self, time: f64, (force, torque): &(Vector3<f64>, Vector3<f64>)) {
        self.reaction[0].see(time, force.norm());
        self.reaction[1].see(time, torque.norm());
    }

    /// Takes energies and momenta at the end of a step, or between the ends of a long one: drift is that of the ends.
    pub(super) fn see_balance(
        &mut self,
        time: f64,
        balance: &Balance,
        omega: &Vector3<f64>,
        event: ObserverEvent,
    ) {
        let internal = balance.kinetic - balance.flight + balance.elastic;
        self.internal.see(time, internal.max(0.0).sqrt());
        self.spin.see(time, omega.norm());
        self.spin_body.iter_mut().zip(omega.iter()).for_each(|(peak, w)| peak.see(time, w.abs()));
        self.spins.see(omega);
        if event != ObserverEvent::Between {
            self.differences.see(balance);
        }
    }

    /// Returns the extremes.
    ///
    /// * `size`: mass and radius of gyration of the body.
    /// * `least_energy`: energy below which energies count as rounding.
    pub(super) fn extremes(self, size: (f64, f64), least_energy: f64) -> Extremes {
        let deflection = self.largest_deformations.largest(self.body, self.deflection.value);
        let internal = self.internal.value.powi(2);
        Extremes {
            deflection,
            watched: self.paths,
            amplitudes: self.amplitudes.iter().map(|peak| peak.value).collect(),
            elastic: self.elastic.value.powi(2),
            internal,
            total: self.differences.total,
            spin: self.spin.value,
            spin_body: Vector3::from(self.spin_body.map(|peak| peak.value)),
            spins: self.spins.0,
            reaction: (self.reaction[0].value, self.reaction[1].value),
            drift: self.differences.drift(internal, size, least_energy),
        }
    }
}

/// Largest number of stored angular velocities.
const AXES: usize = 32;
/// Cosine between two axes from which on they count as one axis.
const SAME_AXIS: f64 = 0.95;

/// Largest angular velocities about distinct axes.
#[derive(Debug, Clone, Default)]
struct Spins(Vec<Vector3<f64>>);

impl Spins {
    fn see(&mut self, omega: &Vector3<f64>) {
        let size = omega.norm();
        let is_near = |other: &Vector3<f64>| other.dot(omega).abs() >= SAME_AXIS * other.norm() * size;
        if size == 0.0 || self.0.iter().any(|other| is_near(other) && other.norm() >= size) {
            return;
        }
        self.0.retain(|other| !is_near(other));
        if self.0.len() < AXES {
            self.0.push(*omega);
        }
    }
}

/// Number of deformations that are kept to evaluate all nodes at the end. A larger number finds the largest
/// deflection more reliably and takes more memory.
const KEPT: usize = 16;

/// Deformations with the largest deflections among the nodes that the modes move most. Another node may
/// deflect more then, or at another of these times.
#[derive(Debug, Clone, Default)]
struct LargestDeformations {
    /// Time, deflection and modal coordinates; the largest deflection first.
    kept: Vec<(f64, f64, Vec<f64>)>,
    /// Last deformation.
    last: (f64, f64, Vec<f64>),
    /// True if the deflection grew up to the last deformation.
    grows: bool,
}

impl LargestDeformations {
    fn see(&mut self, time: f64, deflection: f64, q: &[f64]) {
        if deflection < self.last.1 {
            self.keep_last();
        }
        // Comparisons with NaN are false: treat NaN as growth.
        self.grows = self.last.2.is_empty() || deflection.is_nan() || deflection >= self.last.1;
        (self.last.0, self.last.1) = (time, deflection);
        self.last.2.clear();
        self.last.2.extend_from_slice(q);
    }

    /// Keeps the last deformation if the deflection grew up to it and it is one of the largest.
    fn keep_last(&mut self) {
        let at = self.kept.partition_point(|kept| kept.1 >= self.last.1);
        if self.grows && at < KEPT {
            self.kept.insert(at, self.last.clone());
            self.kept.truncate(KEPT);
        }
    }

    /// Returns the largest deflection of any node relative to the extent of `body`. The ratio of the
    /// interpolated peak to the largest sampled value, known for the nodes that the modes move most, is
    /// applied to all nodes.
    fn largest(mut self, body: &FlexBody, peak: f64) -> Peak {
        self.keep_last();
        let seen = self.kept.first().map_or(0.0, |kept| kept.1);
        let beyond = if seen > 0.0 { peak / seen } else { 1.0 };
        let shape = body.modes().shape.as_ref();
        let mut largest = Peak::default();
        for (time, _, q) in &self.kept {
            let value = longest_of_all(shape, q) * beyond / body.extent();
            if value > largest.value || value.is_nan() {
                largest = Peak::at(*time, value);
            }
        }
        largest
    }
}

/// Largest differences of conserved quantities.
#[derive(Debug, Clone, Copy, Default)]
struct Differences {
    first: Option<Balance>,
    energy: f64,
    linear: f64,
    angular: f64,
    /// Largest total energy, work, momenta and impulses.
    total: f64,
    work: f64,
    most_linear: f64,
    most_angular: f64,
}

impl Differences {
    fn see(&mut self, now: &Balance) {
        let first = *self.first.get_or_insert(*now);
        let total = |balance: &Balance| balance.kinetic + balance.elastic;
        let raise = |most: &mut f64, value: f64| *most = larger(*most, value);
        raise(&mut self.energy, (total(now) - total(&first) - now.work).abs());
        raise(&mut self.linear, (now.linear - first.linear - now.impulse).norm());
        raise(&mut self.angular, (now.angular - first.angular - now.angular_impulse).norm());
        raise(&mut self.total, total(now).abs());
        raise(&mut self.work, now.work.abs());
        raise(&mut self.most_linear, now.linear.norm().max(now.impulse.norm()));
        raise(&mut self.most_angular, now.angular.norm().max(now.angular_impulse.norm()));
    }

    fn drift(&self, internal: f64, (mass, radius): (f64, f64), least_energy: f64) -> Drift {
        let energy = internal.max(self.work).max(least_energy);
        let momentum = (2.0 * mass * energy).sqrt();
        // A body at rest, or in pure translation, has no internal energy as reference for rounding.
        let difference = not_negative(self.energy - ROUNDINGS * f64::EPSILON * self.total);
        Drift {
            energy: difference / energy,
            linear: self.linear / self.most_linear.max(momentum),
            angular: self.angular / self.most_angular.max(momentum * radius),
        }
    }
}

// Largest value of a smooth function sampled at some times.

/// Ratio of neighbouring intervals above which no parabola is fitted: the samples are at a break.
const MAX_INTERVAL_RATIO: f64 = 8.0;

/// Largest value of a function f >= 0 of time sampled at ascending times, and its time.
///
/// Between the samples f^2 is approximated by the parabola through a largest value and its neighbours,
/// since vector lengths have smooth squares. With twenty samples per period of a vibration a peak is found
/// within 9e-4, with sixty within 1.2e-5. At the stability limit of the explicit method a mode has six and
/// a half samples per period (error 0.06); error control keeps the motion of such a mode small.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Peak {
    /// Largest value.
    pub value: f64,
    /// Time of the largest value.
    pub time: f64,
    /// Times and squares of the last two samples, the earlier first.
    last: [Option<(f64, f64)>; 2],
}

impl Peak {
    /// Takes the sample `value` at `time`.
    pub fn see(&mut self, time: f64, value: f64) {
        self.offer(time, value);
        let now = (time, value * value);
        if let [Some(before), Some(middle)] = self.last
            && let Some((time, square)) = vertex(before, middle, now)
        {
            self.offer(time, square.sqrt());
        }
        self.last = [self.last[1], Some(now)];
    }

    /// Keeps the larger value; NaN counts as the largest of all.
    fn offer(&mut self, time: f64, value: f64) {
        if value > self.value || value.is_nan() {
            (self.value, self.time) = (value, time);
        }
    }

    /// Creates a known peak.
    pub fn at(time: f64, value: f64) -> Self {
        Self { value, time, ..Self::default() }
    }

    /// Returns the peak of `values` at `times`.
    pub fn of(times: &[f64], values: impl IntoIterator<Item = f64>) -> Self {
        let mut peak = Self::default();
        times.iter().zip(values).for_each(|(&time, value)| peak.see(time, value));
        peak
    }
}

/// Returns time and value of the maximum of the parabola through three points, if the middle one is the
/// largest of them.
fn vertex(a: (f64, f64), b: (f64, f64), c: (f64, f64)) -> Option<(f64, f64)> {
    let (before, after) = (b.0 - a.0, c.0 - b.0);
    let (largest, even) = (
        b.1 >= a.1 && b.1 >= c.1,
        before < MAX_INTERVAL_RATIO * after && after < MAX_INTERVAL_RATIO * before,
    );
    if !largest || !even {
        return None;
    }
    let (rise, fall) = ((b.1 - a.1) / before, (c.1 - b.1) / after);
    let bend = (rise - fall) / (before + after);
    let slope = (rise * after + fall * before) / (before + after);
    (bend > 0.0).then(|| (b.0 + 0.5 * slope / bend, b.1 + 0.25 * slope * slope / bend))
}

// Nodes with the largest displacements, which suffice to find the deflection of a body.

/// Nodes of a body, and their rows of the modes: three per node, each with nf entries.
#[derive(Debug, Clone)]
pub(super) struct ActiveNodes {
    rows: Vec<f64>,
    nf: usize,
}

impl ActiveNodes {
    /// Takes the given nodes (from 0).
    pub(super) fn new(body: &FlexBody, nodes: &[usize]) -> Self {
        let nf = body.n_modes();
        let rows = nodes.iter().flat_map(|i| 3 * i..3 * i + 3);
        let row = |row: usize| (0..nf).map(move |j| body.modes().shape[(row, j)]);
        Self { rows: rows.flat_map(row).collect(), nf }
    }

    /// Takes the node that moves most in each mode.
    pub(super) fn of_modes(body: &FlexBody) -> Self {
        let shape = body.modes().shape.as_ref();
        let square = |i: usize, j: usize| (0..3).map(|k| shape[(3 * i + k, j)].powi(2)).sum::<f64>();
        let most = (0..body.n_modes()).map(|j| largest_of(body.n_nodes(), |i| square(i, j)));
        Self::new(body, &distinct(most.collect()))
    }

    /// Returns the displacements of the nodes.
    pub(super) fn displacements<'s>(&'s self, q: &'s [f64]) -> impl Iterator<Item = Vector3<f64>> + 's {
        let product = move |row: &[f64]| row.iter().zip(q).map(|(a, q)| a * q).sum::<f64>();
        let displacement = move |rows: &[f64]| {
            let mut rows = rows.chunks_exact(q.len());
            Vector3::from_fn(|_, _| rows.next().map_or(0.0, product))
        };
        self.rows.chunks_exact(3 * self.nf.max(1)).map(displacement)
    }

    /// Returns the longest displacement.
    pub(super) fn longest(&self, q: &[f64]) -> f64 {
        longest(self.displacements(q))
    }
}

/// Returns, for every mode, the nodes that move most along the principal directions of its displacements,
/// which are the eigenvectors of sum_i psi_i psi_i' and turn with the body. Ascending, without duplicates.
pub(super) fn along_principal_directions(body: &FlexBody) -> Vec<usize> {
    let shape = &body.modes().shape;
    let of_mode = |j: usize| {
        let displacement = |i: usize| Vector3::from_fn(|k, _| shape[(3 * i + k, j)]);
        let sum = (0..body.n_nodes()).fold(Matrix3::zeros(), |sum: Matrix3<f64>, i| {
            sum + displacement(i) * displacement(i).transpose()
        });
        let directions = sum.symmetric_eigen().eigenvectors;
        [0, 1, 2].map(|k| largest_of(body.n_nodes(), |i| directions.column(k).dot(&displacement(i)).abs()))
    };
    distinct((0..body.n_modes()).flat_map(of_mode).collect())
}

/// Returns the first index of the largest value.
fn largest_of(count: usize, value: impl Fn(usize) -> f64) -> usize {
    (1..count).fold(0, |best, i| if value(i) > value(best) { i } else { best })
}

fn distinct(mut nodes: Vec<usize>) -> Vec<usize> {
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// Returns the length of the longest displacement.
pub(super) fn longest(displacements: impl Iterator<Item = Vector3<f64>>) -> f64 {
    displacements.map(|d| d.norm()).fold(0.0, larger)
}

/// Returns the longest displacement of any node for the modal coordinates `q`.
fn longest_of_all(shape: MatRef<'_, f64>, q: &[f64]) -> f64 {
    let component = |row: usize| -> f64 { q.iter().enumerate().map(|(j, q)| shape[(row, j)] * q).sum() };
    longest((0..shape.nrows() / 3).map(|i| Vector3::from_fn(|k, _| component(3 * i + k))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_between_instants_is_found() {
        for (per_period, error) in [(6.5, 0.062), (20.0, 9e-4), (60.0, 1.2e-5)] {
            for phase in 0..40 {
                let wave = |t: f64| (t + 0.1 * f64::from(phase)).sin().abs();
                let times: Vec<f64> =
                    (0..200).map(|i| f64::from(i) * std::f64::consts::TAU / per_period).collect();
                let peak = Peak::of(&times, times.iter().map(|&t| wave(t)));
                assert!((peak.value - 1.0).abs() < error, "{per_period} {phase}: {peak:?}");
                assert!(wave(peak.time) > 1.0 - 4.0 * error, "{peak:?}");
            }
        }
    }

    #[test]
    fn a_parabola_is_exact_at_uneven_instants() {
        let times = [0.0, 0.5, 1.7, 2.1];
        let peak = Peak::of(&times, times.iter().map(|t| (4.0 - (t - 1.3) * (t - 1.3)).sqrt()));
        assert!((peak.value - 2.0).abs() < 1e-14 && (peak.time - 1.3).abs() < 1e-14, "{peak:?}");
    }

    #[test]
    fn jumps_and_numbers_that_are_none_are_not_smoothed() {
        let jump = Peak::of(&[0.0, 1.0, 1.0 + 1e-15, 2.0], [1.0, 2.0, 0.5, 0.5]);
        assert_eq!((jump.value, jump.time), (2.0, 1.0));
        assert!(Peak::of(&[0.0, 1.0, 2.0], [1.0, f64::NAN, 0.5]).value.is_nan());
        assert!(Peak::of(&[0.0, 1.0, 2.0], [0.0; 3]).value == 0.0);
    }
}
