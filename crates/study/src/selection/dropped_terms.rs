//! Contributions of the dropped terms along the motion of a model without them.

use super::bounds::{Amplitude, ErrorBound, LoadSizes, TorqueDefect, TurnedTorques};
use super::norms::Norms;
use faer::Mat;
use flexbody_body::flex_body::{FlexBody, TermGroup, TermGroups};
use flexbody_linalg::larger;
use flexbody_motion::dynamics::{EquationsOfMotion, Evaluation, Orientation, Terms};
use flexbody_motion::integration::free_oscillation;
use flexbody_motion::scene::{Recording, Scene};
use nalgebra::Vector3;

/// Motion without some terms, and the contributions of the dropped terms at its instants: from norms of the terms at
/// tier 0, from the terms themselves at tier 1.
pub(super) struct DroppedTerms {
    pub amplitude: Amplitude,
    /// Missing part of the modal forces.
    pub load: LoadSizes,
    /// Missing part of the torque.
    pub defect: TorqueDefect,
    /// First-order error; `None` if only norms of the terms are known.
    pub first_order: Option<FirstOrder>,
}

/// Motion at one instant.
struct Instant<'r> {
    time: f64,
    /// Angular velocity and acceleration.
    omega: Vector3<f64>,
    alpha: Vector3<f64>,
    q: &'r [f64],
    qd: &'r [f64],
    /// Modal accelerations q'', from the motion at the neighbouring instants.
    acceleration: Vec<f64>,
}

impl DroppedTerms {
    /// Evaluates the dropped terms along the motion `run` of `body` in `scene` with the groups `kept`.
    pub(super) fn new(
        body: &FlexBody,
        scene: &Scene,
        run: &Recording,
        kept: TermGroups,
        norms: &Norms,
    ) -> Self {
        let eigenvalues = &body.modes().eigenvalue;
        let root: Vec<f64> = eigenvalues.iter().map(|l| l.sqrt()).collect();
        let instants = instants(scene, run);
        let most = |size: &dyn Fn(&Instant<'_>) -> f64| instants.iter().map(size).fold(0.0, larger);
        let amplitude = Amplitude {
            energy: most(&|i| weighted(i.q, &root)),
            coordinate: most(&|i| norm(i.q)),
            rate: most(&|i| norm(i.qd)),
            acceleration: most(&|i| norm(&i.acceleration)),
            energy_rate: most(&|i| weighted(i.qd, &root)),
        };
        if norms.tier == 0 {
            let (load, defect) = by_norms(&instants, kept.complement(), norms, &root);
            return Self { amplitude, load, defect, first_order: None };
        }
        let (load, defect, forces) = by_terms(body, &instants, kept, &root);
        let first_order = first_order(body, scene, &instants, &forces, norms);
        Self { amplitude, load, defect, first_order }
    }
}

/// Computes the response of every uncoupled mode to the `forces` of the dropped terms. The coupling terms along this
/// response are left to bounds.
fn first_order(
    body: &FlexBody,
    scene: &Scene,
    instants: &[Instant<'_>],
    forces: &[Vec<f64>],
    norms: &Norms,
) -> Option<FirstOrder> {
    let times: Vec<f64> = instants.iter().map(|instant| instant.time).collect();
    // Response of the uncoupled modes, then the load of the coupling terms along it.
    let oscillators = Oscillators::new(body, &times)?;
    let (errors, mut first) = oscillators.respond(forces, scene.initial.settled);
    let along: Vec<Instant<'_>> =
        instants.iter().zip(&errors).map(|(instant, error)| instant.of_error(error)).collect();
    let coupling = TermGroups::NONE.with(TermGroup::W2).with(TermGroup::W3);
    let (rest, _) = by_norms(&along, coupling, norms, oscillators.root());
    first.rest.impulse += rest.impulse;
    first.rest.begun += rest.begun;
    first.rest.moved += rest.moved;
    first.rest.largest += rest.largest;
    Some(first)
}

impl<'r> Instant<'r> {
    /// Returns the instant with an error of the modes in place of their motion.
    fn of_error<'e>(&self, error: &'e ModalState) -> Instant<'e> {
        let Self { time, omega, alpha, .. } = *self;
        Instant { time, omega, alpha, q: &error.q, qd: &error.qd, acceleration: Vec::new() }
    }
}

/// Returns the product |q|_m |q''|_m at every instant of the motion `run` of a carried body, with the modal mass m: it bounds
/// the torque of W3 about a carrier that does not rotate, the integral of u x u'' over the mass.
pub(super) fn torques_of_w3(body: &FlexBody, scene: &Scene, run: &Recording) -> Vec<f64> {
    let mass = body.invariants().modal_mass();
    let length = |x: &[f64]| {
        let x = Mat::from_fn(x.len(), 1, |j, _| x[j]);
        (x.transpose() * &mass * &x)[(0, 0)].max(0.0).sqrt()
    };
    instants(scene, run).iter().map(|instant| length(instant.q) * length(&instant.acceleration)).collect()
}

fn instants<'r>(scene: &Scene, run: &'r Recording) -> Vec<Instant<'r>> {
    let instant = |i: usize| {
        let time = run.time[i];
        Instant {
            time,
            omega: run.states[i].omega,
            q: &run.states[i].q,
            qd: &run.states[i].qd,
            alpha: scene
                .spin
                .as_ref()
                .map_or_else(Vector3::zeros, |spin| spin.at(time, &run.states[i].attitude.axes()).1),
            acceleration: acceleration(run, i),
        }
    };
    (0..run.time.len()).map(instant).collect()
}

/// Returns q'' at an instant, from the polynomial of degree five through q and q' at the instant and its neighbours; at
/// the ends, of degree three.
fn acceleration(run: &Recording, i: usize) -> Vec<f64> {
    let last = run.time.len() - 1;
    let (before, after) = (i.saturating_sub(1), (i + 1).min(last));
    let h = (run.time[after] - run.time[before]) / (after - before) as f64;
    let (a, now, b) = (&run.states[before], &run.states[i], &run.states[after]);
    let acceleration = |j: usize| {
        let rise = b.q[j] - a.q[j];
        match (i == 0, i == last) {
            (true, _) => (6.0 * rise / h - 4.0 * a.qd[j] - 2.0 * b.qd[j]) / h,
            (_, true) => (2.0 * a.qd[j] + 4.0 * b.qd[j] - 6.0 * rise / h) / h,
            _ => (2.0 * ((b.q[j] - now.q[j]) - (now.q[j] - a.q[j])) / h - 0.5 * (b.qd[j] - a.qd[j])) / h,
        }
    };
    (0..now.q.len()).map(acceleration).collect()
}

/// Contributions of the dropped terms, accumulated over the instants.
#[derive(Default)]
struct Collected {
    load: LoadSizes,
    torque: f64,
    stiff: f64,
}

impl Collected {
    fn finish(self) -> (LoadSizes, TorqueDefect) {
        (self.load, TorqueDefect { torque: self.torque, stiff: self.stiff })
    }
}

/// Norms of the state at an instant.
struct Scalars<'i> {
    instant: &'i Instant<'i>,
    /// |omega| and |omega'|.
    w: f64,
    alpha: f64,
    /// |q|, |q'| and |Lambda^(1/2) q|.
    q: f64,
    v: f64,
    energy: f64,
}

/// Norms of the dropped terms, for bounds.
struct TermNorms<'n> {
    /// Factors of W1 and W2: 1 if the group is dropped, else 0.
    w1: f64,
    w2: f64,
    /// Norms of W3; zero if W3 is kept.
    w3: f64,
    turning: f64,
    norms: &'n Norms,
    /// sqrt(Lambda).
    root: &'n [f64],
}

/// Bounds the contributions of the dropped groups by norms of the terms.
fn by_norms(
    instants: &[Instant<'_>],
    dropped: TermGroups,
    norms: &Norms,
    root: &[f64],
) -> (LoadSizes, TorqueDefect) {
    let count = |group: bool| f64::from(group);
    let terms = TermNorms {
        w1: count(dropped.w1),
        w2: count(dropped.w2),
        w3: norms.coupling * count(dropped.w3),
        turning: norms.turning * count(dropped.w3),
        norms,
        root,
    };
    let mut found = Collected::default();
    let mut before: Option<(Scalars<'_>, f64)> = None;
    for instant in instants {
        // Largest values at the instants; impulse and variation between them.
        let now = terms.scalars(instant);
        let (force, in_energy) = terms.load(&now);
        found.load.largest = larger(found.load.largest, in_energy);
        found.torque = larger(found.torque, terms.torque(&now));
        match &before {
            None => found.load.begun = in_energy,
            Some((earlier, force_before)) => {
                // Take the larger of both ends, so that a jump between instants is included.
                found.load.impulse += larger(force, *force_before) * (instant.time - earlier.instant.time);
                found.load.moved += terms.moved(earlier, &now);
            }
        }
        before = Some((now, force));
    }
    let largest = instants.iter().map(|i| norm(i.q)).fold(0.0, larger);
    found.stiff = norms.turning * norms.last * largest;
    found.finish()
}

impl TermNorms<'_> {
    fn scalars<'i>(&self, instant: &'i Instant<'i>) -> Scalars<'i> {
        let (q, qd) = (instant.q, instant.qd);
        Scalars {
            instant,
            w: instant.omega.norm(),
            alpha: instant.alpha.norm(),
            q: norm(q),
            v: norm(qd),
            energy: weighted(q, self.root),
        }
    }

    /// Returns the norm of the load on the modes, and of Lambda^(-1/2) times the load.
    fn load(&self, now: &Scalars<'_>) -> (f64, f64) {
        let (norms, &Scalars { w, alpha, q, v, energy, .. }) = (self.norms, now);
        let coupled = self.w3 * (2.0 * w * v + alpha * q);
        let force = self.w1 * norms.centrifugal * w * w + self.w2 * norms.spin * w * w * q + coupled;
        let in_energy = self.w1 * norms.centrifugal_energy * w * w
            + self.w2 * norms.softening * w * w * energy
            + coupled / norms.first;
        (force, in_energy)
    }

    fn torque(&self, now: &Scalars<'_>) -> f64 {
        let &Scalars { w, alpha, q, v, .. } = now;
        let (turn, a) = (alpha + w * w, norm(&now.instant.acceleration));
        self.w1 * self.norms.inertia * (v * w + q * turn)
            + self.w2 * (2.0 * q * v * w + q * q * turn)
            + self.turning * (q * a + w * q * v)
    }

    /// Returns a bound of the change of Lambda^(-1/2) times the load between two instants: a product changes by the
    /// change of one factor times the other.
    fn moved(&self, earlier: &Scalars<'_>, now: &Scalars<'_>) -> f64 {
        let (norms, root) = (self.norms, self.root);
        let (state, old) = (now.instant, earlier.instant);
        let dw = (state.omega - old.omega).norm();
        let da = (now.instant.alpha - earlier.instant.alpha).norm();
        let difference = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>();
        let (dq, dv) = (difference(state.q, old.q), difference(state.qd, old.qd));
        let w = larger(now.w, earlier.w);
        let square = w * w;
        let turned = (now.w + earlier.w) * dw;
        self.w1 * norms.centrifugal_energy * turned
            + self.w2
                * norms.softening
                * (square * weighted(&dq, root) + turned * larger(now.energy, earlier.energy))
            + self.w3 / norms.first
                * (2.0 * (w * norm(&dv) + dw * larger(now.v, earlier.v))
                    + larger(now.alpha, earlier.alpha) * norm(&dq)
                    + da * larger(now.q, earlier.q))
    }
}

/// Computes the dropped terms as the difference between the force balances of the whole body and of the kept groups.
/// The last result holds the modal forces at every instant.
fn by_terms(
    body: &FlexBody,
    instants: &[Instant<'_>],
    kept: TermGroups,
    root: &[f64],
) -> (LoadSizes, TorqueDefect, Vec<Vec<f64>>) {
    let groups = body.invariants().groups();
    let equations = [groups, kept].map(|groups| EquationsOfMotion::new(body, Terms::ALL.held(groups)));
    let mut balances = Balances::new(&equations);
    let w3 = body.invariants().w3();
    let stiff_at = |q: &[f64]| {
        let Some(w3) = &w3 else { return 0.0 };
        let nf = root.len();
        let product = |a: usize, j: usize| (0..nf).map(|i| w3[(a * nf + i, j)] * q[i]).sum::<f64>();
        let rows = Mat::from_fn(3, nf, |a, j| root[j] * product(a, j));
        rows.norm_l2()
    };
    let mut found = Collected::default();
    let mut forces: Vec<Vec<f64>> = Vec::with_capacity(instants.len());
    for (at, instant) in instants.iter().enumerate() {
        // Largest values at the instants; impulse and variation between them.
        let (torque, force) = balances.difference(instant);
        found.torque = larger(found.torque, norm(&torque));
        let in_energy: Vec<f64> = force.iter().zip(root).map(|(f, root)| f / root).collect();
        found.load.largest = larger(found.load.largest, norm(&in_energy));
        // W3'q changes slowly compared with the spacing of the instants: evaluate it at some of them.
        if at % COARSE_STRIDE == 0 {
            found.stiff = larger(found.stiff, stiff_at(instant.q));
        }
        match forces.last() {
            None => found.load.begun = norm(&in_energy),
            Some(earlier) => {
                found.load.impulse +=
                    larger(norm(&force), norm(earlier)) * (instant.time - instants[at - 1].time);
                let steps: Vec<f64> =
                    force.iter().zip(earlier).zip(root).map(|((a, b), root)| (a - b) / root).collect();
                found.load.moved += norm(&steps);
            }
        }
        forces.push(force);
    }
    let (load, defect) = found.finish();
    (load, defect, forces)
}

/// Force balances of the whole body and of the kept groups, for the same motion.
struct Balances<'e> {
    evaluations: [Evaluation<'e>; 2],
    /// Number of rigid motions.
    rigid: usize,
    /// Axes of rotation of the body.
    axes: &'static [usize],
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
}

impl<'e> Balances<'e> {
    fn new(equations: &'e [EquationsOfMotion; 2]) -> Self {
        let rigid = equations[0].n_rigid();
        let velocity = vec![0.0; equations[0].n_velocities()];
        Self {
            evaluations: equations.each_ref().map(Evaluation::new),
            rigid,
            axes: if rigid == 3 { &[2] } else { &[0, 1, 2] },
            acceleration: velocity.clone(),
            velocity,
        }
    }

    /// Returns torque and modal forces of the whole body minus those of the kept groups.
    fn difference(&mut self, instant: &Instant<'_>) -> (Vec<f64>, Vec<f64>) {
        // Translation of the frame does not act on free-surface modes about the centre of mass.
        let first = self.rigid - self.axes.len();
        for (at, &axis) in self.axes.iter().enumerate() {
            self.velocity[first + at] = instant.omega[axis];
            self.acceleration[first + at] = instant.alpha[axis];
        }
        self.velocity[self.rigid..].copy_from_slice(instant.qd);
        self.acceleration[self.rigid..].copy_from_slice(&instant.acceleration);
        let mut forces = [self.velocity.clone(), self.velocity.clone()];
        for (evaluation, forces) in self.evaluations.iter_mut().zip(&mut forces) {
            evaluation.set(instant.q, &self.velocity);
            evaluation.balance(&self.acceleration, forces);
        }
        let [whole, own] = forces;
        let all: Vec<f64> = whole.iter().zip(&own).map(|(a, b)| a - b).collect();
        (all[first..self.rigid].to_vec(), all[self.rigid..].to_vec())
    }
}

/// Stride of the instants at which a product with nf^2 entries is evaluated outside the balance.
const COARSE_STRIDE: usize = 4;

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Returns |Lambda^(1/2) x|.
fn weighted(x: &[f64], root: &[f64]) -> f64 {
    x.iter().zip(root).map(|(x, root)| (x * root).powi(2)).sum::<f64>().sqrt()
}

// First-order effect of dropped terms on the motion of the modes: the response of every uncoupled mode.

/// Largest deviation of the instants from even spacing, relative to the spacing.
const SPACING_ROUNDING: f64 = 1e-6;

/// Modal coordinates and their rates.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ModalState {
    pub q: Vec<f64>,
    pub qd: Vec<f64>,
}

/// Norms of the response e of the uncoupled modes, e'' + D e' + Lambda e = F, to the load F of the dropped terms.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct FirstOrder {
    /// Largest |Lambda^(1/2) e|.
    energy: f64,
    /// Largest |e|.
    coordinate: f64,
    /// Largest |e'|.
    rate: f64,
    /// Largest |e'' + Lambda e|.
    without_stiffness: f64,
    /// Loads that the response e does not contain: the terms that couple the modes, along e, and the deviation of F
    /// from linear interpolation between the instants.
    pub rest: LoadSizes,
}

impl FirstOrder {
    /// Adds to the rest the load of torques on the deformed body, for the motion e over `duration`.
    pub(super) fn leave_torques(&mut self, turned: &TurnedTorques, duration: f64) {
        if turned.force > 0.0 {
            let force = turned.force * self.energy;
            self.rest.impulse += force * duration;
            // The change of this load over time is unknown.
            self.rest.moved = f64::INFINITY;
        }
    }

    /// Returns the total error. `rest` is the bound of the response to the loads in [`FirstOrder::rest`].
    pub(super) fn with(&self, rest: &ErrorBound) -> ErrorBound {
        ErrorBound {
            energy: self.energy + rest.energy,
            coordinate: self.coordinate + rest.coordinate,
            rate: self.rate + rest.rate,
            acceleration_without_stiffness: self.without_stiffness + rest.acceleration_without_stiffness,
        }
    }
}

/// Modes of a body as oscillators x'' + d x' + lambda x = f at evenly spaced instants. With a load that is linear
/// between the instants, a step is exact.
struct Oscillators {
    /// Time between two instants.
    step: f64,
    root: Vec<f64>,
    decay: Vec<f64>,
    /// Norm |D| if the damping couples the modes; the damping forces are then part of the rest.
    damping_left: f64,
    /// Free motion of every mode over one step, see [`free_oscillation`].
    turns: Vec<[f64; 2]>,
}

impl Oscillators {
    /// Prepares the steps. Returns `None` if `times` are not evenly spaced.
    pub(super) fn new(body: &FlexBody, times: &[f64]) -> Option<Self> {
        let (&first, &last) = (times.first()?, times.last()?);
        let step = (last - first) / (times.len() - 1) as f64;
        let even = times.windows(2).all(|pair| (pair[1] - pair[0] - step).abs() <= SPACING_ROUNDING * step);
        let modes = body.modes();
        let root: Vec<f64> = modes.eigenvalue.iter().map(|lambda| lambda.sqrt()).collect();
        let (decay, damping_left) = match &modes.modal_damping {
            None => {
                (root.iter().zip(&modes.damping_ratio).map(|(root, ratio)| 2.0 * ratio * root).collect(), 0.0)
            }
            Some(damping) => (vec![0.0; root.len()], damping.norm_l2()),
        };
        let free = |(root, decay): (&f64, &f64)| free_oscillation(root * root, 0.5 * decay, step);
        let turns = root.iter().zip(&decay).map(free).collect();
        (even && step > 0.0).then_some(Self { step, root, decay, damping_left, turns })
    }

    /// Returns sqrt(Lambda).
    pub(super) fn root(&self) -> &[f64] {
        &self.root
    }

    /// Returns the response at every instant, and its norms. The motion starts from rest without deformation or, if
    /// `settled`, from the static response. `loads` holds the modal loads at every instant.
    pub(super) fn respond(&self, loads: &[Vec<f64>], settled: bool) -> (Vec<ModalState>, FirstOrder) {
        let modes = self.root.len();
        let mut now = ModalState { q: vec![0.0; modes], qd: vec![0.0; modes] };
        if settled {
            now.q = loads[0].iter().zip(&self.root).map(|(f, root)| f / (root * root)).collect();
        }
        let mut sizes = FirstOrder::default();
        let mut states = Vec::with_capacity(loads.len());
        for (at, load) in loads.iter().enumerate() {
            if at > 0 {
                (0..modes).for_each(|j| self.advance(&mut now, j, loads[at - 1][j], load[j]));
            }
            self.measure(&now, load, &mut sizes);
            states.push(now.clone());
        }
        self.leave(loads, &mut sizes);
        (states, sizes)
    }

    /// Advances mode j to the next instant, under a load that changes linearly from f to g.
    fn advance(&self, state: &mut ModalState, j: usize, f: f64, g: f64) {
        let (lambda, d) = (self.root[j] * self.root[j], self.decay[j]);
        let slope = (g - f) / self.step;
        // Split into the linear particular solution and the free motion about it.
        let (rate, place) = (slope / lambda, (f - d * slope / lambda) / lambda);
        let (x, v) = (state.q[j] - place, state.qd[j] - rate);
        let [cosine, sine] = self.turns[j];
        let swing = v + 0.5 * d * x;
        state.q[j] = cosine * x + sine * swing + place + rate * self.step;
        state.qd[j] = cosine * v - sine * (lambda * x + 0.5 * d * v) + rate;
    }

    fn measure(&self, state: &ModalState, load: &[f64], sizes: &mut FirstOrder) {
        let norm = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
        let weighted = state.q.iter().zip(&self.root).map(|(q, root)| (q * root).powi(2)).sum::<f64>().sqrt();
        let accelerated = load.iter().zip(&state.qd).zip(&self.decay).map(|((f, v), d)| (f - d * v).powi(2));
        sizes.energy = larger(sizes.energy, weighted);
        sizes.coordinate = larger(sizes.coordinate, norm(&state.q));
        sizes.rate = larger(sizes.rate, norm(&state.qd));
        sizes.without_stiffness = larger(sizes.without_stiffness, accelerated.sum::<f64>().sqrt());
        sizes.rest.impulse += self.damping_left * norm(&state.qd) * self.step;
    }

    /// Adds the deviation of the loads from linear interpolation, estimated from second differences.
    fn leave(&self, loads: &[Vec<f64>], sizes: &mut FirstOrder) {
        for three in loads.windows(3) {
            let bend = |j: usize| three[0][j] - 2.0 * three[1][j] + three[2][j];
            let (mut force, mut energy) = (0.0, 0.0);
            for (j, root) in self.root.iter().enumerate() {
                force += bend(j).powi(2);
                energy += (bend(j) / root).powi(2);
            }
            // The parabola through three instants deviates from its chords by an eighth of the second difference.
            let (force, energy) = (force.sqrt() / 8.0, energy.sqrt() / 8.0);
            sizes.rest.impulse += force * self.step;
            sizes.rest.largest = larger(sizes.rest.largest, energy);
            sizes.rest.moved += 2.0 * energy;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn oscillator(lambda: f64, decay: f64, step: f64) -> Oscillators {
        let w = (lambda - 0.25 * decay * decay).sqrt();
        let left = (-0.5 * decay * step).exp();
        let turns = vec![[left * (w * step).cos(), left * (w * step).sin() / w]];
        Oscillators { step, root: vec![lambda.sqrt()], decay: vec![decay], damping_left: 0.0, turns }
    }

    #[test]
    fn a_ramp_moves_a_damped_oscillator_as_its_closed_form_says() {
        let (lambda, d, slope, h) = (9.0, 0.4, 2.0, 0.05);
        let loads: Vec<Vec<f64>> = (0..200).map(|i| vec![slope * h * f64::from(i)]).collect();
        let (states, sizes) = oscillator(lambda, d, h).respond(&loads, false);
        let w = (lambda - 0.25 * d * d).sqrt();
        let (place, rate) = (-d * slope / (lambda * lambda), slope / lambda);
        let swing = (-rate - 0.5 * d * place) / w;
        for (i, state) in states.iter().enumerate() {
            let t = h * i as f64;
            let free = (-0.5 * d * t).exp() * (-place * (w * t).cos() + swing * (w * t).sin());
            assert!((state.q[0] - (place + rate * t + free)).abs() < 1e-13, "at {t}");
        }
        assert!(sizes.rest.impulse < 1e-12 && sizes.rest.largest < 1e-12, "{:?}", sizes.rest);
    }

    #[test]
    fn a_settled_response_to_a_load_that_stays_stays() {
        let loads = vec![vec![3.0]; 50];
        let (states, sizes) = oscillator(4.0, 0.1, 0.3).respond(&loads, true);
        assert!(states.iter().all(|state| (state.q[0] - 0.75).abs() < 1e-14 && state.qd[0].abs() < 1e-14));
        assert!((sizes.energy - 1.5).abs() < 1e-14);
    }
}
