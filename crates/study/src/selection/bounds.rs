//! Guaranteed bounds of what dropped terms change of the motion of a body whose rotation is given (theory
//! section 7).
//!
//! With the angular velocity w(t) of the frame given, the modes move by linear equations,
//!
//! ```text
//! q'' + D q' + 2 G(w) q' + (Lambda - E(w, w) + G(w')) q = Q(t) + W1'w w / 2,    G skew, E symmetric, 0 <= E <= |w|^2
//! ```
//!
//! and the error of a model without some of the terms obeys the same equations with these terms of its own
//! motion as load. The energy H = (|q'|^2 + q'(Lambda - E) q) / 2 bounds the response to a load F twice:
//! sqrt(2 H) grows by no more than |F|; and against the static response, by no more than the total variation
//! of that. Damping only helps, and is not counted on.

use super::norms::Norms;
use super::variation::{Rotation, Variation};
use flexbody_body::flex_body::TermGroups;

/// A load on the modes that is a direction times a function of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModalLoad {
    /// |Q|.
    pub force: f64,
    /// |Lambda^(-1/2) Q|.
    pub energy: f64,
    /// The function of time that the direction is multiplied by.
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

/// What bounds need to know of a load on the modes, over the duration.
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

/// The motion of a body of given rotation.
#[derive(Debug, Clone, PartialEq)]
pub struct Driven {
    /// Rotation of the frame.
    pub rotation: Rotation,
    /// Loads on the modes.
    pub loads: Vec<ModalLoad>,
    /// Modes at the start.
    pub start: Start,
    /// Whether the deformation starts in equilibrium with the loads.
    pub settled: bool,
    /// How torques act on the deformed body.
    pub turned: TurnedTorques,
    /// |D|.
    pub damping: f64,
}

/// By how much torques change their modal forces, for a change of |Lambda^(1/2) q| by one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TurnedTorques {
    /// |F|, at the largest torque.
    pub force: f64,
    /// |F'| where the torque changes fastest; world axes turn besides.
    pub rate: f64,
}

/// Modes at time zero.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Start {
    /// sqrt(|q'|^2 + q'Lambda q).
    pub energy: f64,
    /// The same of the rates (q', q'') without loads.
    pub rate_energy: f64,
}

/// Bounds of modal motion, over the duration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Amplitude {
    /// |Lambda^(1/2) q|: the root of twice the elastic energy.
    pub energy: f64,
    /// |q|.
    pub coordinate: f64,
    /// |q'|.
    pub rate: f64,
    /// |q''|; infinite where it is not known.
    pub acceleration: f64,
    /// |Lambda^(1/2) q'|; likewise.
    pub energy_rate: f64,
}

/// Bounds of the error e of modal motion, over the duration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorBound {
    /// |Lambda^(1/2) e|.
    pub energy: f64,
    /// |e|.
    pub coordinate: f64,
    /// |e'|.
    pub rate: f64,
    /// |e'' + Lambda e|.
    pub acceleration_without_stiffness: f64,
}

/// How loads act on modes under the terms that are kept.
struct Operator {
    /// Lambda - E >= margin Lambda.
    margin: f64,
    /// exp of how much motion may grow by itself because the rotation changes.
    growth: f64,
    softening: f64,
    coupling: f64,
    first: f64,
    /// Force of turned torques for |Lambda^(1/2) q| = 1.
    turned: f64,
    rotation: Rotation,
    /// Whether responses start in equilibrium with the load.
    settled: bool,
}

impl Operator {
    /// `None` where the spin takes all stiffness of some motion.
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
        let growth = (rotation.variation * growth + product(turned, rotation.duration) / margin.sqrt()).exp();
        let (first, settled) = (norms.first, driven.settled);
        Some(Self { margin, growth, softening, coupling, first, turned, rotation: *rotation, settled })
    }

    /// sqrt(2 H) of the response to a load, from rest without deformation; or from its static response, about
    /// which it then moves by what is not more, but of which an impulse says nothing.
    fn response(&self, load: &LoadSizes) -> f64 {
        let (m, r) = (self.margin, &self.rotation);
        let impulse = product(self.growth, load.impulse);
        // The static response (Lambda - E)^-1 F moves with the load and with E.
        let moved = load.moved + 2.0 * r.largest * r.variation * self.softening * load.largest / m;
        let swept = r.variation * self.coupling * load.largest / (m * self.first)
            + product(self.turned * r.duration, load.largest) / m;
        let varied = product(self.growth, (load.begun + moved) / m.sqrt() + swept) + load.largest / m.sqrt();
        if self.settled { varied } else { impulse.min(varied) }
    }
}

impl Driven {
    /// The centrifugal load of W1.
    fn centrifugal(&self, norms: &Norms) -> ModalLoad {
        let rate = self.rotation.rate();
        ModalLoad { force: norms.centrifugal, energy: norms.centrifugal_energy, factor: rate.times(&rate) }
    }

    /// Bounds of the motion of the body with the groups that are kept. `None` where the spin takes all
    /// stiffness of some motion.
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
            // The rates are moved by the rates of the loads, and start with the loads.
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

    /// The load that the groups `dropped` are to the error, at motion within `own`.
    pub fn residual(&self, dropped: TermGroups, norms: &Norms, own: &Amplitude) -> Vec<LoadSizes> {
        let r = &self.rotation;
        let mut loads = Vec::new();
        if dropped.w1 {
            loads.push(self.centrifugal(norms).sizes(r.duration));
        }
        // A force that may be anywhere between zero and `force`.
        let mut push = |force: f64, energy: f64, moved: f64| {
            loads.push(LoadSizes {
                impulse: product(force, r.duration),
                begun: energy,
                moved,
                largest: energy,
            });
        };
        if dropped.w2 {
            // E(w, w) q.
            let (w2, turned) = (r.largest.powi(2), 2.0 * r.largest * r.variation);
            let moved = product(w2 * r.duration, own.energy_rate) + turned * own.energy;
            let energy = norms.softening * w2 * own.energy;
            push(norms.spin * w2 * own.coordinate, energy, norms.softening * moved);
        }
        if dropped.w3 {
            // 2 G(w) q', and G(w') q.
            let per_rate = norms.coupling / norms.first;
            let moved = product(r.largest * r.duration, own.acceleration) + r.variation * own.rate;
            let force = 2.0 * norms.coupling * r.largest * own.rate;
            push(force, force / norms.first, 2.0 * per_rate * moved);
            let moved = product(r.jerk, own.coordinate) + r.variation * own.rate;
            let force = norms.coupling * r.acceleration * own.coordinate;
            push(force, force / norms.first, per_rate * moved);
        }
        loads
    }

    /// Bounds of how far a motion moves from that of the whole body to whose error `residual` are the loads.
    /// `None` where the spin may take all stiffness of some motion.
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

    /// What the torque lacks without the groups `dropped`, at motion within `own`.
    pub fn torque_defect(&self, dropped: TermGroups, norms: &Norms, own: &Amplitude) -> TorqueDefect {
        let (w, turn) = (self.rotation.largest, self.rotation.acceleration + self.rotation.largest.powi(2));
        let (q, v, a) = (own.coordinate, own.rate, own.acceleration);
        let there = |group: bool, torque: f64| if group { torque } else { 0.0 };
        let torque = there(dropped.w1, norms.inertia * (v * w + q * turn))
            + there(dropped.w2, 2.0 * q * v * w + q * q * turn)
            + there(dropped.w3, product(norms.turning, product(q, a) + w * q * v));
        TorqueDefect { torque, stiff: product(norms.turning * norms.last, q) }
    }

    /// Bound of the error of the torque that the rotation takes, without that of the levers of loads: what it
    /// lacks, and what the whole body makes of the `error` of a motion within `own`.
    pub fn torque_error(
        &self,
        norms: &Norms,
        own: &Amplitude,
        error: &ErrorBound,
        defect: &TorqueDefect,
    ) -> f64 {
        let r = &self.rotation;
        let (w, turn) = (r.largest, r.acceleration + r.largest.powi(2));
        let (dq, dv) = (error.coordinate, error.rate);
        let (q, v) = (own.coordinate + dq, own.rate + dv);
        let linear = norms.inertia * (dv * w + dq * turn);
        let quadratic = 2.0 * (q * dv + v * dq) * w + 2.0 * q * dq * turn;
        // q'W3 e'' with e'' of the equations of motion, whose part Lambda e meets W3'q in the norm of
        // stiffness.
        let stiff = product(defect.stiff + product(norms.turning * norms.last, dq), error.energy);
        let rest = product(product(norms.turning, q), error.acceleration_without_stiffness);
        let coupled =
            stiff + rest + product(norms.turning, product(dq, own.acceleration) + w * (q * dv + dq * v));
        defect.torque + linear + quadratic + coupled
    }
}

/// What the balance of torques lacks without some groups.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueDefect {
    /// Largest torque.
    pub torque: f64,
    /// Largest |Lambda^(1/2) W3' q|.
    pub stiff: f64,
}

/// What is zero is zero, however large the other.
fn product(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 { 0.0 } else { a * b }
}
