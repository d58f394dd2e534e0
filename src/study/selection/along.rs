//! What the dropped terms are along a motion without them.

use super::bounds::{Amplitude, LoadSizes};
use super::norms::Norms;
use super::trial::Bench;
use crate::body::flex_body::Groups;
use crate::motion::dynamics::{Configuration, EquationsOfMotion, Evaluation, Terms};
use crate::motion::scene::Recording;
use faer::Mat;
use nalgebra::Vector3;

/// A motion without some terms, and what these would add at its instants: from norms of the terms at tier 0, at tier 1 from the terms.
pub(super) struct Along {
    pub amplitude: Amplitude,
    /// What the balance of modal forces lacks.
    pub load: LoadSizes,
    /// Largest torque that the balance of the frame lacks.
    pub torque: f64,
    /// Largest |Lambda^(1/2) W3' q|.
    pub stiff: f64,
}

/// The motion at one instant.
struct Instant<'r> {
    time: f64,
    state: &'r Configuration,
    /// Angular acceleration.
    alpha: Vector3<f64>,
    /// q'', from the motion at the instants beside.
    acceleration: Vec<f64>,
}

impl Along {
    pub fn new(bench: &Bench<'_>, run: &Recording, kept: Groups, norms: &Norms) -> Self {
        let eigenvalues = &bench.body.modes().eigenvalue;
        let root: Vec<f64> = eigenvalues.iter().map(|l| l.sqrt()).collect();
        let instants = instants(bench, run);
        let most = |of: &dyn Fn(&Instant<'_>) -> f64| instants.iter().map(of).fold(0.0, f64::max);
        let amplitude = Amplitude {
            energy: most(&|i| weighted(&i.state.q, &root)),
            coordinate: most(&|i| norm(&i.state.q)),
            rate: most(&|i| norm(&i.state.qd)),
            acceleration: most(&|i| norm(&i.acceleration)),
            energy_rate: most(&|i| weighted(&i.state.qd, &root)),
        };
        let (load, torque, stiff) = match norms.tier {
            0 => of_norms(&instants, kept.complement(), norms, &root),
            _ => of_terms(bench, &instants, kept, &root),
        };
        Self { amplitude, load, torque, stiff }
    }
}

fn instants<'r>(bench: &Bench<'_>, run: &'r Recording) -> Vec<Instant<'r>> {
    let last = run.time.len() - 1;
    let instant = |i: usize| {
        let time = run.time[i];
        let spin = bench.scene.spin.as_ref();
        Instant {
            time,
            state: &run.states[i],
            alpha: spin.map_or_else(Vector3::zeros, |spin| spin.axis * spin.rate.at(time).1),
            acceleration: acceleration(run, i),
        }
    };
    (0..=last).map(instant).collect()
}

/// q'' at an instant: of the polynomial through q and q' there and beside, of degree five, at the ends of degree three.
fn acceleration(run: &Recording, i: usize) -> Vec<f64> {
    let last = run.time.len() - 1;
    let (before, after) = (i.saturating_sub(1), (i + 1).min(last));
    let h = (run.time[after] - run.time[before]) / (after - before) as f64;
    let (a, now, b) = (&run.states[before], &run.states[i], &run.states[after]);
    let of_mode = |j: usize| {
        let rise = b.q[j] - a.q[j];
        match (i == 0, i == last) {
            (true, _) => (6.0 * rise / h - 4.0 * a.qd[j] - 2.0 * b.qd[j]) / h,
            (_, true) => (2.0 * a.qd[j] + 4.0 * b.qd[j] - 6.0 * rise / h) / h,
            _ => (2.0 * ((b.q[j] - now.q[j]) - (now.q[j] - a.q[j])) / h - 0.5 * (b.qd[j] - a.qd[j])) / h,
        }
    };
    (0..now.q.len()).map(of_mode).collect()
}

/// Bounds of the dropped terms by the norms of theirs.
fn of_norms(instants: &[Instant<'_>], dropped: Groups, norms: &Norms, root: &[f64]) -> (LoadSizes, f64, f64) {
    let count = |group: bool| f64::from(group);
    let (w1, w2, w3) = (count(dropped.w1), count(dropped.w2), norms.coupling * count(dropped.w3));
    let turning = norms.turning * count(dropped.w3);
    let scalars = |i: &Instant<'_>| {
        let (q, qd) = (&i.state.q, &i.state.qd);
        [i.state.omega.norm(), i.alpha.norm(), norm(q), norm(qd), weighted(q, root)]
    };
    let mut sizes = LoadSizes::default();
    let mut torque = 0.0f64;
    let mut before: Option<(&Instant<'_>, f64)> = None;
    for instant in instants {
        let [w, alpha, q, v, energy] = scalars(instant);
        let of_w3 = w3 * (2.0 * w * v + alpha * q);
        let force = w1 * norms.centrifugal * w * w + w2 * norms.spin * w * w * q + of_w3;
        let in_energy = w1 * norms.centrifugal_energy * w * w
            + w2 * norms.softening * w * w * energy
            + of_w3 / norms.first;
        sizes.largest = sizes.largest.max(in_energy);
        let (turn, a) = (alpha + w * w, norm(&instant.acceleration));
        torque = torque.max(
            w1 * norms.inertia * (v * w + q * turn)
                + w2 * (2.0 * q * v * w + q * q * turn)
                + turning * (q * a + w * q * v),
        );
        match before {
            None => sizes.begun = in_energy,
            Some((earlier, force_before)) => {
                // The larger of both ends: what jumps between them is not missed.
                sizes.impulse += force.max(force_before) * (instant.time - earlier.time);
                let [w0, alpha0, q0, v0, energy0] = scalars(earlier);
                let (state, old) = (instant.state, earlier.state);
                let (dw, da) = ((state.omega - old.omega).norm(), (instant.alpha - earlier.alpha).norm());
                let difference =
                    |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>();
                let (dq, dv) = (difference(&state.q, &old.q), difference(&state.qd, &old.qd));
                // Products change by the change of one factor times the other.
                let square = w.max(w0) * w.max(w0);
                let turned = (w + w0) * dw;
                sizes.moved += w1 * norms.centrifugal_energy * turned
                    + w2 * norms.softening * (square * weighted(&dq, root) + turned * energy.max(energy0))
                    + w3 / norms.first
                        * (2.0 * (w.max(w0) * norm(&dv) + dw * v.max(v0))
                            + alpha.max(alpha0) * norm(&dq)
                            + da * q.max(q0));
            }
        }
        before = Some((instant, force));
    }
    let stiff = norms.turning * norms.last * instants.iter().map(|i| norm(&i.state.q)).fold(0.0, f64::max);
    (sizes, torque, stiff)
}

/// The dropped terms themselves: what the balance of forces of the whole body has beyond that of the kept groups.
fn of_terms(
    bench: &Bench<'_>,
    instants: &[Instant<'_>],
    kept: Groups,
    root: &[f64],
) -> (LoadSizes, f64, f64) {
    let invariants = bench.body.invariants();
    let equations =
        [invariants.groups, kept].map(|groups| EquationsOfMotion::new(bench.body, Terms::ALL.held(groups)));
    let mut evaluations = equations.each_ref().map(Evaluation::new);
    let (rigid, nf) = (equations[0].n_rigid(), root.len());
    let axes: &[usize] = if rigid == 3 { &[2] } else { &[0, 1, 2] };
    // Free-surface modes about the centre of mass do not feel how the frame moves along.
    let first = rigid - axes.len();
    let mut velocity = vec![0.0; equations[0].n_velocities()];
    let mut acceleration = velocity.clone();
    let mut lacking = |instant: &Instant<'_>, modal: &[f64]| {
        for (at, &axis) in axes.iter().enumerate() {
            velocity[first + at] = instant.state.omega[axis];
            acceleration[first + at] = instant.alpha[axis];
        }
        velocity[rigid..].copy_from_slice(&instant.state.qd);
        acceleration[rigid..].copy_from_slice(modal);
        let mut forces = [velocity.clone(), velocity.clone()];
        for (evaluation, forces) in evaluations.iter_mut().zip(&mut forces) {
            evaluation.set(&instant.state.q, &velocity);
            evaluation.balance(&acceleration, forces);
        }
        let [whole, own] = forces;
        whole.iter().zip(&own).map(|(a, b)| a - b).collect::<Vec<f64>>()
    };
    let w3 = invariants.w3();
    let stiff_at = |q: &[f64]| {
        let Some(w3) = &w3 else { return 0.0 };
        let product = |a: usize, j: usize| (0..nf).map(|i| w3[(a * nf + i, j)] * q[i]).sum::<f64>();
        let rows = Mat::from_fn(3, nf, |a, j| root[j] * product(a, j));
        rows.norm_l2()
    };
    let (mut sizes, mut torque, mut stiff) = (LoadSizes::default(), 0.0f64, 0.0f64);
    let mut before: Option<(f64, Vec<f64>)> = None;
    for (at, instant) in instants.iter().enumerate() {
        let all = lacking(instant, &instant.acceleration);
        torque = torque.max(norm(&all[first..rigid]));
        let force = all[rigid..].to_vec();
        let of_energy: Vec<f64> = force.iter().zip(root).map(|(f, root)| f / root).collect();
        sizes.largest = sizes.largest.max(norm(&of_energy));
        // W3'q changes slowly beside how often it is looked at.
        if at % COARSE == 0 {
            stiff = stiff.max(stiff_at(&instant.state.q));
        }
        match &before {
            None => sizes.begun = norm(&of_energy),
            Some((then, earlier)) => {
                sizes.impulse += norm(&force).max(norm(earlier)) * (instant.time - then);
                let steps: Vec<f64> =
                    force.iter().zip(earlier).zip(root).map(|((a, b), root)| (a - b) / root).collect();
                sizes.moved += norm(&steps);
            }
        }
        before = Some((instant.time, force));
    }
    (sizes, torque, stiff)
}

/// One of so many instants is looked at where a product with nf^2 entries is not part of the balance.
const COARSE: usize = 4;

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// |Lambda^(1/2) x|.
fn weighted(x: &[f64], root: &[f64]) -> f64 {
    x.iter().zip(root).map(|(x, root)| (x * root).powi(2)).sum::<f64>().sqrt()
}
