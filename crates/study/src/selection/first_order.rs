//! First-order effect of dropped terms on the motion of the modes: the response of every uncoupled mode.

use super::bounds::{ErrorBound, LoadSizes, TurnedTorques};
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::larger;
use flexbody_motion::integration::free_oscillation;

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
pub(super) struct Oscillators {
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
