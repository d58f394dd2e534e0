//! Guaranteed bounds of the change of motion by dropped terms, for a body whose rotation is given (theory section 7).
//!
//! With the angular velocity w(t) of the frame given, the modes obey linear equations,
//!
//! ```text
//! q'' + D q' + 2 G(w) q' + (Lambda - E(w, w) + G(w')) q = Q(t) + W1'w w / 2,    G skew, E symmetric, 0 <= E <= |w|^2
//! ```
//!
//! and the error of a model without some of the terms obeys these equations with the dropped terms, evaluated along its
//! own motion, as load. The energy H = (|q'|^2 + q'(Lambda - E) q) / 2 gives two bounds of the response to a load F:
//! sqrt(2 H) grows by at most |F|; and, relative to the static response, by at most the total variation of that.
//! Damping only reduces the response and is neglected.

use super::norms::Norms;
use flexbody_body::flex_body::TermGroups;
use flexbody_motion::scene::{History, Sizes, VectorHistory};
use libm::exp;
use std::f64::consts::TAU;

/// Modal load: a direction times a function of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModalLoad {
    /// Length of the load, |Q|.
    pub force: f64,
    /// Length in the norm of flexibility, |Lambda^(-1/2) Q|.
    pub energy: f64,
    /// Function of time that multiplies the direction.
    pub factor: Variation,
}

impl ModalLoad {
    fn sizes(&self, duration: f64) -> LoadSizes {
        let ModalLoad { force, energy, factor } = self;
        LoadSizes {
            impulse: product(force * factor.largest, duration),
            begun: energy * factor.start,
            moved: product(*energy, factor.total),
            largest: energy * factor.largest,
        }
    }
}

/// Quantities of a modal load that the bounds use, over the duration.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LoadSizes {
    /// Integral of |F|.
    pub impulse: f64,
    /// |Lambda^(-1/2) F| at the start.
    pub begun: f64,
    /// Total variation of Lambda^(-1/2) F.
    pub moved: f64,
    /// Largest |Lambda^(-1/2) F|.
    pub largest: f64,
}

/// Motion of a body whose rotation is given.
#[derive(Debug, Clone, PartialEq)]
pub struct Driven {
    /// Rotation of the frame.
    pub rotation: Rotation,
    /// Loads on the modes.
    pub loads: Vec<ModalLoad>,
    /// Initial state of the modes.
    pub start: Start,
    /// True if the deformation starts in equilibrium with the loads.
    pub settled: bool,
    /// Change of the modal forces of torques by the deformation.
    pub turned: TurnedTorques,
    /// Norm of the modal damping, |D|.
    pub damping: f64,
}

/// Change of the modal forces of torques, for a change of |Lambda^(1/2) q| by one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TurnedTorques {
    /// Change |F| at the largest torque.
    pub force: f64,
    /// Rate of change |F'| where the torque changes fastest, without the rotation of world axes.
    pub rate: f64,
}

/// Modal energies at time zero.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Start {
    /// sqrt(|q'|^2 + q'Lambda q).
    pub energy: f64,
    /// sqrt(|q''|^2 + |Lambda^(1/2) q'|^2), with q'' without loads.
    pub rate_energy: f64,
}

/// Bounds of modal motion, over the duration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Amplitude {
    /// Bound of |Lambda^(1/2) q|, the root of twice the elastic energy.
    pub energy: f64,
    /// Bound of |q|.
    pub coordinate: f64,
    /// Bound of |q'|.
    pub rate: f64,
    /// Bound of |q''|; infinite if unknown.
    pub acceleration: f64,
    /// Bound of |Lambda^(1/2) q'|; infinite if unknown.
    pub energy_rate: f64,
}

/// Bounds of the error e of modal motion, over the duration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorBound {
    /// Bound of |Lambda^(1/2) e|.
    pub energy: f64,
    /// Bound of |e|.
    pub coordinate: f64,
    /// Bound of |e'|.
    pub rate: f64,
    /// Bound of |e'' + Lambda e|.
    pub acceleration_without_stiffness: f64,
}

/// Bounds of the modal equations with the terms that are kept.
struct Operator {
    /// Largest margin with Lambda - E >= margin Lambda.
    margin: f64,
    /// Factor by which free motion may grow because the rotation changes.
    growth: f64,
    softening: f64,
    coupling: f64,
    first: f64,
    /// Force of turned torques for |Lambda^(1/2) q| = 1.
    turned: f64,
    rotation: Rotation,
    /// True if responses start in equilibrium with the load.
    settled: bool,
}

impl Operator {
    /// Returns the bounds; `None` if the spin may remove all stiffness of some motion.
    fn new(kept: TermGroups, norms: &Norms, driven: &Driven) -> Option<Self> {
        let rotation = &driven.rotation;
        let softening = if kept.w2 { norms.softening } else { 0.0 };
        let coupling = if kept.w3 { norms.coupling } else { 0.0 };
        let margin = 1.0 - rotation.largest.powi(2) * softening;
        if margin.is_nan() || margin <= 0.0 {
            return None;
        }
        let growth = coupling / (margin.sqrt() * norms.first) + rotation.largest * softening / margin;
        let turned = driven.turned.force;
        let growth = exp(rotation.variation * growth + product(turned, rotation.duration) / margin.sqrt());
        let (first, settled) = (norms.first, driven.settled);
        Some(Self { margin, growth, softening, coupling, first, turned, rotation: *rotation, settled })
    }

    /// Returns the bound of sqrt(2 H) of the response to a load, from rest without deformation. If the motion starts at
    /// the static response, only the bound by variation holds.
    fn response(&self, load: &LoadSizes) -> f64 {
        let (m, r) = (self.margin, &self.rotation);
        let impulse = product(self.growth, load.impulse);
        // The static response (Lambda - E)^-1 F changes with the load and with E.
        let moved = load.moved + 2.0 * r.largest * r.variation * self.softening * load.largest / m;
        let swept = r.variation * self.coupling * load.largest / (m * self.first)
            + product(self.turned * r.duration, load.largest) / m;
        let varied = product(self.growth, (load.begun + moved) / m.sqrt() + swept) + load.largest / m.sqrt();
        if self.settled { varied } else { impulse.min(varied) }
    }
}

impl Driven {
    /// Returns the centrifugal load of W1.
    fn centrifugal(&self, norms: &Norms) -> ModalLoad {
        let rate = self.rotation.rate();
        ModalLoad { force: norms.centrifugal, energy: norms.centrifugal_energy, factor: rate.times(&rate) }
    }

    /// Returns bounds of the motion of the body with the kept groups; `None` if the spin may remove all stiffness of
    /// some motion.
    pub fn amplitude(&self, kept: TermGroups, norms: &Norms) -> Option<Amplitude> {
        let operator = Operator::new(kept, norms, self)?;
        let mut loads = self.loads.clone();
        if kept.w1 {
            loads.push(self.centrifugal(norms));
        }
        let sum = |start: f64, loads: &mut dyn Iterator<Item = ModalLoad>| {
            product(operator.growth, start)
                + loads.map(|load| operator.response(&load.sizes(self.rotation.duration))).sum::<f64>()
        };
        let energy = sum(self.start.energy, &mut loads.iter().copied());
        let root = operator.margin.sqrt();
        let coordinate = energy / (root * norms.first);
        let (rate, acceleration, energy_rate) = if kept.w2 || kept.w3 {
            (energy, f64::INFINITY, f64::INFINITY)
        } else {
            // Without W2 and W3 the equations are constant: the rates obey them too, with the rates of the loads and
            // initial values that contain the loads.
            let begun: f64 = loads.iter().map(|load| load.force * load.factor.start).sum();
            let torques = self.turned.rate + self.turned.force * self.rotation.largest;
            let torques = product(torques * self.rotation.duration, energy / root);
            let rates = sum(
                self.start.rate_energy + begun + torques,
                &mut loads.iter().map(|load| {
                    let Variation { rate, rate_total, .. } = load.factor;
                    let factor = Variation {
                        start: rate,
                        largest: rate,
                        total: rate_total,
                        rate: 0.0,
                        rate_total: 0.0,
                    };
                    ModalLoad { factor, ..*load }
                }),
            );
            (energy.min(rates / norms.first), rates, rates)
        };
        Some(Amplitude { energy: energy / root, coordinate, rate, acceleration, energy_rate })
    }

    /// Returns the load on the error that the `dropped` groups cause, for motion within `amplitude`.
    pub fn residual(&self, dropped: TermGroups, norms: &Norms, amplitude: &Amplitude) -> Vec<LoadSizes> {
        let r = &self.rotation;
        let mut loads = Vec::new();
        if dropped.w1 {
            loads.push(self.centrifugal(norms).sizes(r.duration));
        }
        // Adds a load that may take any value between zero and `force`.
        let mut push = |force: f64, energy: f64, moved: f64| {
            loads.push(LoadSizes {
                impulse: product(force, r.duration),
                begun: energy,
                moved,
                largest: energy,
            });
        };
        if dropped.w2 {
            // Load of W2: E(w, w) q.
            let (w2, turned) = (r.largest.powi(2), 2.0 * r.largest * r.variation);
            let moved = product(w2 * r.duration, amplitude.energy_rate) + turned * amplitude.energy;
            let energy = norms.softening * w2 * amplitude.energy;
            push(norms.spin * w2 * amplitude.coordinate, energy, norms.softening * moved);
        }
        if dropped.w3 {
            // Loads of W3: 2 G(w) q', and G(w') q.
            let per_rate = norms.coupling / norms.first;
            let moved =
                product(r.largest * r.duration, amplitude.acceleration) + r.variation * amplitude.rate;
            let force = 2.0 * norms.coupling * r.largest * amplitude.rate;
            push(force, force / norms.first, 2.0 * per_rate * moved);
            let moved = product(r.jerk, amplitude.coordinate) + r.variation * amplitude.rate;
            let force = norms.coupling * r.acceleration * amplitude.coordinate;
            push(force, force / norms.first, per_rate * moved);
        }
        loads
    }

    /// Returns bounds of the error of a motion relative to that of the whole body, for the loads `residual` on the
    /// error. Returns `None` if the spin may remove all stiffness of some motion.
    pub fn error(&self, norms: &Norms, residual: &[LoadSizes]) -> Option<ErrorBound> {
        let operator = Operator::new(TermGroups::ALL, norms, self)?;
        let r = &self.rotation;
        let energy: f64 = residual.iter().map(|load| operator.response(load)).sum();
        let root = operator.margin.sqrt();
        let coordinate = energy / (root * norms.first);
        let of_loads: f64 = residual.iter().map(|load| load.largest * norms.last).sum();
        Some(ErrorBound {
            energy: energy / root,
            coordinate,
            rate: energy,
            acceleration_without_stiffness: of_loads
                + (2.0 * r.largest + self.damping) * energy
                + (r.largest.powi(2) + r.acceleration) * coordinate
                + product(self.turned.force, energy / root),
        })
    }

    /// Returns the missing torque without the `dropped` groups, for motion within `amplitude`.
    pub fn torque_defect(&self, dropped: TermGroups, norms: &Norms, amplitude: &Amplitude) -> TorqueDefect {
        let (w, turn) = (self.rotation.largest, self.rotation.acceleration + self.rotation.largest.powi(2));
        let (q, v, a) = (amplitude.coordinate, amplitude.rate, amplitude.acceleration);
        let there = |group: bool, torque: f64| if group { torque } else { 0.0 };
        let torque = there(dropped.w1, norms.inertia * (v * w + q * turn))
            + there(dropped.w2, 2.0 * q * v * w + q * q * turn)
            + there(dropped.w3, product(norms.turning, product(q, a) + w * q * v));
        TorqueDefect { torque, stiff: product(norms.turning * norms.last, q) }
    }

    /// Returns the bound of the error of the driving torque, without the lever arms of loads: the missing torque, and
    /// the torque of the whole body for the `error` of a motion within `amplitude`.
    pub fn torque_error(
        &self,
        norms: &Norms,
        amplitude: &Amplitude,
        error: &ErrorBound,
        defect: &TorqueDefect,
    ) -> f64 {
        let r = &self.rotation;
        let (w, turn) = (r.largest, r.acceleration + r.largest.powi(2));
        let (dq, dv) = (error.coordinate, error.rate);
        let (q, v) = (amplitude.coordinate + dq, amplitude.rate + dv);
        let linear = norms.inertia * (dv * w + dq * turn);
        let quadratic = 2.0 * (q * dv + v * dq) * w + 2.0 * q * dq * turn;
        // q'W3 e'' with e'' from the equations of motion; the part Lambda e multiplies W3'q in the norm of stiffness.
        let stiff = product(defect.stiff + product(norms.turning * norms.last, dq), error.energy);
        let rest = product(product(norms.turning, q), error.acceleration_without_stiffness);
        let coupled = stiff
            + rest
            + product(norms.turning, product(dq, amplitude.acceleration) + w * (q * dv + dq * v));
        defect.torque + linear + quadratic + coupled
    }
}

/// Missing torque in the balance without some groups.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueDefect {
    /// Largest torque.
    pub torque: f64,
    /// Largest |Lambda^(1/2) W3' q|.
    pub stiff: f64,
}

/// Product that is zero if either factor is zero, even if the other is infinite.
fn product(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 { 0.0 } else { a * b }
}

// Bounds of a function of time, as the bounds of responses need them.

/// Bounds of a continuous function h of time over the duration of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variation {
    /// |h(0)|.
    pub start: f64,
    /// Largest |h|.
    pub largest: f64,
    /// Total variation of h.
    pub total: f64,
    /// Largest |h'|.
    pub rate: f64,
    /// Total variation of h', jumps included; infinite if unknown.
    pub rate_total: f64,
}

impl Variation {
    /// Returns the bounds of a constant.
    pub fn constant(value: f64) -> Self {
        Self { start: value.abs(), largest: value.abs(), total: 0.0, rate: 0.0, rate_total: 0.0 }
    }

    /// Returns the bounds of a history from time 0 to `duration`.
    pub fn of(history: &History, duration: f64) -> Self {
        let start = history.at(0.0).0.abs();
        match history {
            History::Constant(value) => Self::constant(*value),
            History::Table { times, .. } => {
                let inner = times.iter().copied().filter(|&time| time > 0.0 && time < duration);
                let instants: Vec<f64> = [0.0].into_iter().chain(inner).chain([duration]).collect();
                let values: Vec<f64> = instants.iter().map(|&time| history.at(time).0).collect();
                let slopes: Vec<f64> = instants
                    .windows(2)
                    .zip(values.windows(2))
                    .map(|(time, value)| (value[1] - value[0]) / (time[1] - time[0]))
                    .collect();
                Self {
                    start,
                    largest: values.iter().map(|v| v.abs()).fold(0.0, f64::max),
                    total: values.windows(2).map(|v| (v[1] - v[0]).abs()).sum(),
                    rate: slopes.iter().map(|v| v.abs()).fold(0.0, f64::max),
                    rate_total: slopes.windows(2).map(|v| (v[1] - v[0]).abs()).sum(),
                }
            }
            History::Sine { amplitude, frequency, .. } => {
                let (size, rate) = (amplitude.abs(), TAU * frequency);
                // |h'| and |h''| are at most the amplitudes of the derivatives.
                Self {
                    start,
                    largest: size,
                    total: size * rate * duration,
                    rate: size * rate,
                    rate_total: size * rate * rate * duration,
                }
            }
            History::Ramp { from, to, duration: length, .. } => {
                let step = (to - from).abs();
                // h' = step (1 - cos(2 pi x)) / length rises to twice the mean and falls again.
                Self {
                    start,
                    largest: from.abs().max(to.abs()),
                    total: step,
                    rate: 2.0 * step / length,
                    rate_total: 4.0 * step / length,
                }
            }
            History::Samples(samples) => samples.sizes_until(duration).into(),
        }
    }

    /// Returns the bounds of the length of a vector from time 0 to `duration`.
    pub fn of_vector(history: &VectorHistory, duration: f64) -> Self {
        match history {
            VectorHistory::Along { direction, factor } => {
                Self::of(factor, duration).times(&Self::constant(direction.norm()))
            }
            VectorHistory::Columns(columns) => columns.sizes_until(duration).into(),
        }
    }

    /// Returns the bounds of a unit vector that is fixed in space, seen from a frame that turns with `rotation`.
    pub fn direction(rotation: &Rotation) -> Self {
        Self {
            start: 1.0,
            largest: 1.0,
            total: rotation.largest * rotation.duration,
            rate: rotation.largest,
            rate_total: rotation.largest.powi(2) * rotation.duration + rotation.variation,
        }
    }

    /// Returns the bounds of the product with another function.
    pub fn times(&self, other: &Self) -> Self {
        let (a, b) = (self, other);
        let sum = |x: f64, y: f64| if x == 0.0 || y == 0.0 { 0.0 } else { x * y };
        Self {
            start: a.start * b.start,
            largest: a.largest * b.largest,
            total: sum(a.largest, b.total) + sum(b.largest, a.total),
            rate: sum(a.largest, b.rate) + sum(b.largest, a.rate),
            rate_total: sum(a.rate, b.total)
                + sum(b.rate, a.total)
                + sum(a.largest, b.rate_total)
                + sum(b.largest, a.rate_total),
        }
    }
}

impl From<Sizes> for Variation {
    fn from(Sizes { start, largest, total, rate, rate_total }: Sizes) -> Self {
        Self { start, largest, total, rate, rate_total }
    }
}

/// Bounds of the angular velocity of a frame with given rotation, over the duration of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rotation {
    /// Axis of rotation, body axes; `None` if it changes or is unknown.
    pub axis: Option<nalgebra::Vector3<f64>>,
    /// True if the rotation is that of the run; false if it may be any within these bounds.
    pub of_run: bool,
    /// Largest |omega|.
    pub largest: f64,
    /// |omega| at the start.
    pub start: f64,
    /// Integral of |alpha|.
    pub variation: f64,
    /// Largest |alpha|.
    pub acceleration: f64,
    /// Total variation of alpha; infinite if unknown.
    pub jerk: f64,
    /// Duration.
    pub duration: f64,
}

impl Rotation {
    /// Returns the bounds of |omega| as a function of time.
    pub fn rate(&self) -> Variation {
        Variation {
            start: self.start,
            largest: self.largest,
            total: self.variation,
            rate: self.acceleration,
            rate_total: self.jerk,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flexbody_motion::scene::Interpolation;

    /// Sampled functions never exceed their bounds, and the bounds of a single history are at most twice as large.
    #[test]
    fn sampled_variation_stays_below_the_bounds() {
        let histories = [
            History::Constant(-2.0),
            History::Table { times: vec![-1.0, 0.5, 1.0, 9.0], values: vec![1.0, 3.0, -2.0, 5.0] },
            History::Sine { amplitude: -3.0, frequency: 0.7, phase: 0.3 },
            History::Ramp { from: 1.0, to: -2.0, start: 0.5, duration: 2.0 },
            History::samples(
                vec![-1.0, 0.5, 1.0, 3.0, 9.0],
                &[1.0, 3.0, -2.0, 5.0, 0.0],
                Interpolation::Cubic,
                false,
            ),
            History::samples(vec![0.5, 1.0, 3.0], &[3.0, -2.0, 5.0], Interpolation::Linear, true),
        ];
        let duration = 4.0;
        let count = 40_000;
        let sampled = |value: &dyn Fn(f64) -> (f64, f64)| {
            let samples: Vec<(f64, f64)> =
                (0..=count).map(|i| value(duration * f64::from(i) / f64::from(count))).collect();
            let largest = |size: &dyn Fn(&(f64, f64)) -> f64| samples.iter().map(size).fold(0.0, f64::max);
            let total = |size: &dyn Fn(&(f64, f64)) -> f64| {
                samples.windows(2).map(|pair| (size(&pair[1]) - size(&pair[0])).abs()).sum::<f64>()
            };
            Variation {
                start: samples[0].0.abs(),
                largest: largest(&|s| s.0.abs()),
                total: total(&|s| s.0),
                rate: largest(&|s| s.1.abs()),
                rate_total: total(&|s| s.1),
            }
        };
        let fields = |v: &Variation| [v.start, v.largest, v.total, v.rate, v.rate_total];
        for a in &histories {
            for b in &histories {
                let bound = Variation::of(a, duration).times(&Variation::of(b, duration));
                let product = |time: f64| {
                    let ((x, dx), (y, dy)) = (a.at(time), b.at(time));
                    (x * y, dx * y + x * dy)
                };
                for (real, bound) in fields(&sampled(&product)).into_iter().zip(fields(&bound)) {
                    assert!(real <= bound * (1.0 + 1e-9) + 1e-12, "{a:?} {b:?}: {real} above {bound}");
                }
            }
            let (real, bound) = (sampled(&|time| a.at(time)), Variation::of(a, duration));
            for (real, bound) in fields(&real).into_iter().zip(fields(&bound)) {
                assert!(real <= bound * (1.0 + 1e-9) && bound <= 2.0 * real + 1e-12, "{a:?}");
            }
        }
    }
}
