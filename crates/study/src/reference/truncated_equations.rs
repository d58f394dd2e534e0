//! Dynamic response of the truncated part of the model to the forces that the reduced motion leaves unbalanced, with
//! the inertia of the static responses and their coupling to the modes of the body.

use super::grid::Grid;
use faer::Mat;
use flexbody_body::invariants::symmetric_part;
use flexbody_linalg::{
    add_combination, combine, dense_cholesky, gram, larger, solve_lower, solve_upper, symmetric_eigen,
};
use flexbody_motion::integration::free_oscillation;
use flexbody_motion::scene::{Interpolation, Sample, Samples};
use nalgebra::Vector1;
use std::ops::Range;

/// Part of the elastic energy of a response at or below which what it does not have in common with others is rounding. A
/// larger value drops directions that differ little.
const ROUNDING: f64 = 1e-10;

/// Returns T (k x p) that makes E T K-orthonormal, for responses E with the stiffness E'K E (k x k), in the order of the
/// responses: each without what it has in common with those before it, unless the rest is [`ROUNDING`]. Returns `None` if
/// the responses are zero or not finite.
pub(super) fn of_unit_energy(stiffness: &Mat<f64>) -> Option<Mat<f64>> {
    let k = stiffness.nrows();
    // Responses of one size: they differ as their forces do, which says nothing about dependence.
    let sizes: Vec<f64> = (0..k).map(|i| stiffness[(i, i)].max(0.0).sqrt()).collect();
    let largest = sizes.iter().copied().fold(0.0, larger);
    if !(largest.is_finite() && largest > 0.0) {
        return None;
    }
    // Gram and Schmidt in the product of E'K E. A direction has the same components whatever rounding is in the others.
    let mut columns: Vec<Vec<f64>> = Vec::new();
    for (j, size) in sizes.iter().enumerate().filter(|(_, size)| **size > ROUNDING * largest) {
        let mut column = vec![0.0; k];
        column[j] = size.recip();
        for _ in 0..2 {
            let weighted = weighted(stiffness, &column);
            let shared: Vec<f64> = columns.iter().map(|known| product(known, &weighted)).collect();
            for (known, shared) in columns.iter().zip(shared) {
                column.iter_mut().zip(known).for_each(|(own, known)| *own -= shared * known);
            }
        }
        let rest = product(&column, &weighted(stiffness, &column));
        if rest > ROUNDING {
            column.iter_mut().for_each(|own| *own /= rest.sqrt());
            columns.push(column);
        }
    }
    Some(Mat::from_fn(k, columns.len(), |i, j| columns[j][i]))
}

fn weighted(stiffness: &Mat<f64>, column: &[f64]) -> Vec<f64> {
    (0..stiffness.nrows()).map(|i| (0..column.len()).map(|j| stiffness[(i, j)] * column[j]).sum()).collect()
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Equations of motion of the displacements Psi y + E z. Psi are the modes of a body and E static responses that are
/// K-orthogonal to the modes. The loads are the forces whose static responses are E c(t), and the forces M Psi m_ff^-1
/// g(t), whose modal forces are g.
pub(super) struct TruncatedEquations {
    /// Stiffness K_ff and mass m_ff of the modes that respond (nf x nf). Both are 0 x 0 if no mode responds.
    pub modal_stiffness: Mat<f64>,
    pub modal_mass: Mat<f64>,
    pub damping: TruncatedDamping,
    /// Coupling mass Psi'M E of modes and responses (nf x k).
    pub shared_mass: Mat<f64>,
    /// Stiffness E'K E and mass E'M E of the responses (k x k).
    pub stiffness: Mat<f64>,
    pub mass: Mat<f64>,
}

/// Damping in the equations of all nodes.
pub(super) enum TruncatedDamping {
    /// Damping of the modes of the body, D_ff (nf x nf): D = M Psi m_ff^-1 D_ff m_ff^-1 Psi'M.
    OfModes(Mat<f64>),
    /// Damping of the model, projected on modes and responses: [Psi, E]'D [Psi, E] (nf + k square).
    OfModel(Mat<f64>),
}

/// Amplitudes at all instants, with rates and accelerations. Each matrix is (nf + k) x m: y of the modes, then z of the
/// responses.
pub(super) struct TruncatedAmplitudes {
    pub value: Mat<f64>,
    pub rate: Mat<f64>,
    pub acceleration: Mat<f64>,
}

/// Eigenmode of the system of modes and responses: an oscillator of unit stiffness with one natural frequency.
#[derive(Debug, Clone, Copy)]
struct Oscillator {
    /// Inverse square of the circular natural frequency.
    inertia: f64,
    /// Twice the damping ratio over the circular natural frequency.
    damping: f64,
}

impl TruncatedEquations {
    /// Integrates the equations of motion
    ///
    /// ```text
    /// [m_ff, Psi'M E; E'M Psi, E'M E] (y'', z'') + D (y', z') + (K_ff y, E'K E z)
    ///     = (g, E'K E c + E'M Psi m_ff^-1 g)
    /// ```
    ///
    /// with c(t) and g(t) along cubic splines between the instants of `grid`. D is the damping of the equations of all
    /// nodes; only its diagonal in the eigenmodes of the system is used. Each eigenmode is integrated exactly. If c
    /// changes slowly compared with the natural frequency, the result is the static response. If c changes as fast or
    /// begins with a shock, the static response would be too small. The truncated part also moves modes that are not
    /// eigenvectors, through the coupling mass.
    ///
    /// * `amplitudes`: c (k x m).
    /// * `in_modes`: g (nf x m).
    /// * `settled`: true if the motion starts in equilibrium, z = c; false if it starts from zero.
    ///
    /// Returns `None` if a decomposition fails.
    pub(super) fn amplitudes(
        &self,
        amplitudes: &Mat<f64>,
        in_modes: &Mat<f64>,
        grid: &Grid,
        settled: bool,
    ) -> Option<TruncatedAmplitudes> {
        let (shapes, inertias) = self.eigenmodes()?;
        let seen = self.seen_by_modes(&shapes)?;
        let dampings = self.dampings(&shapes, &seen);
        let (nf, k) = (self.modal_mass.nrows(), self.mass.nrows());
        // Modal forces of the eigenmodes: x'(E'K E c) from the responses, seen'g from the modes.
        let of_responses = shapes.as_ref().subrows(nf, k).to_owned();
        let forces = combine(self.stiffness.as_ref(), amplitudes.as_ref());
        let mut static_part = gram(of_responses.as_ref(), forces.as_ref());
        static_part += gram(seen.as_ref(), in_modes.as_ref());
        let zeros = || Mat::<f64>::zeros(shapes.ncols(), grid.times.len());
        let (mut value, mut rate, mut acceleration) = (zeros(), zeros(), zeros());
        // Integrate each eigenmode, then transform back to y and z.
        for j in 0..shapes.ncols() {
            let own = Oscillator { inertia: inertias[j], damping: dampings[j] };
            let force: Vec<f64> = (0..grid.times.len()).map(|i| static_part[(j, i)]).collect();
            for (i, motion) in own.follow(&force, grid, settled).into_iter().enumerate() {
                [value[(j, i)], rate[(j, i)], acceleration[(j, i)]] = motion;
            }
        }
        let back = |own: Mat<f64>| combine(shapes.as_ref(), own.as_ref());
        Some(TruncatedAmplitudes { value: back(value), rate: back(rate), acceleration: back(acceleration) })
    }

    /// Returns the eigenmodes, scaled to unit stiffness, in columns, and their inertias (inverse squares of the
    /// circular frequencies).
    fn eigenmodes(&self) -> Option<(Mat<f64>, Vec<f64>)> {
        let (nf, k) = (self.modal_mass.nrows(), self.mass.nrows());
        // A basis of unit stiffness: L'^-1 for the modes (K_ff = L L'), K-orthonormal combinations of the responses.
        let of_responses = of_unit_energy(&self.stiffness)?;
        let lower = dense_cholesky(self.modal_stiffness.clone())?;
        let of_modes = solve_upper(&lower, &Mat::identity(nf, nf));
        let unit = Mat::from_fn(nf + k, nf + of_responses.ncols(), |i, j| match (i < nf, j < nf) {
            (true, true) => of_modes[(i, j)],
            (false, false) => of_responses[(i - nf, j - nf)],
            _ => 0.0,
        });
        // The eigenvectors of the mass in that basis decouple both matrices.
        let mass = Mat::from_fn(nf + k, nf + k, |i, j| match (i < nf, j < nf) {
            (true, true) => self.modal_mass[(i, j)],
            (true, false) => self.shared_mass[(i, j - nf)],
            (false, true) => self.shared_mass[(j, i - nf)],
            (false, false) => self.mass[(i - nf, j - nf)],
        });
        let seen = gram(unit.as_ref(), combine(mass.as_ref(), unit.as_ref()).as_ref());
        let own = symmetric_eigen(symmetric_part(&seen).as_ref())?;
        Some((combine(unit.as_ref(), own.vectors.as_ref()), own.values))
    }

    /// Returns the part of each eigenmode x in the modes, m_ff^-1 Psi'M x.
    fn seen_by_modes(&self, shapes: &Mat<f64>) -> Option<Mat<f64>> {
        let (nf, k) = (self.modal_mass.nrows(), self.mass.nrows());
        let lower = dense_cholesky(self.modal_mass.clone())?;
        let carried_over = solve_upper(&lower, &solve_lower(&lower, &self.shared_mass));
        let mut seen = shapes.as_ref().subrows(0, nf).to_owned();
        let of_responses = shapes.as_ref().subrows(nf, k).to_owned();
        add_combination(seen.as_mut(), carried_over.as_ref(), of_responses.as_ref());
        Some(seen)
    }

    /// Returns the modal damping x'D x of each eigenmode x. Damping of the modes acts on `seen`, the part of x in the
    /// modes.
    fn dampings(&self, shapes: &Mat<f64>, seen: &Mat<f64>) -> Vec<f64> {
        let (damping, parts) = match &self.damping {
            TruncatedDamping::OfModes(damping) => (damping, seen),
            TruncatedDamping::OfModel(damping) => (damping, shapes),
        };
        let product = combine(damping.as_ref(), parts.as_ref());
        let of = |j: usize| (0..parts.nrows()).map(|i| parts[(i, j)] * product[(i, j)]).sum();
        (0..parts.ncols()).map(of).collect()
    }
}

impl Oscillator {
    /// Returns value, rate and acceleration at every instant of the solution of inertia x'' + damping x' + x = s(t).
    fn follow(self, force: &[f64], grid: &Grid, settled: bool) -> Vec<[f64; 3]> {
        let mut seen = Vec::with_capacity(force.len());
        let mut state = [if settled { force[0] } else { 0.0 }, 0.0];
        for piece in &grid.pieces {
            self.follow_piece(force, &grid.times, piece.clone(), &mut state, &mut seen);
        }
        seen
    }

    fn follow_piece(
        self,
        force: &[f64],
        times: &[f64],
        piece: Range<usize>,
        state: &mut [f64; 2],
        seen: &mut Vec<[f64; 3]>,
    ) {
        let values: Vec<Vector1<f64>> = piece.clone().map(|i| Vector1::new(force[i])).collect();
        let spline = Samples::<1>::new(times[piece.clone()].to_vec(), &values, Interpolation::Cubic, false);
        let at = |i: usize| {
            let Sample { rate, second, .. } = spline.at(times[i]);
            [force[i], rate[0], second[0]]
        };
        let mut now = at(piece.start);
        let mut third = 0.0;
        for i in piece.start..piece.end - 1 {
            let (next, step) = (at(i + 1), times[i + 1] - times[i]);
            third = (next[2] - now[2]) / step;
            seen.push(self.motion(now, third, state));
            *state = self.after(now, next, third, step, *state);
            now = next;
        }
        seen.push(self.motion(now, third, state));
    }

    /// Returns true if the oscillator has inertia.
    fn moves(self) -> bool {
        self.inertia > 0.0
    }

    /// Returns the particular solution, with its two derivatives, for a cubic force: a polynomial. `force` holds value,
    /// first and second derivative; `third` is the third derivative.
    fn steady(self, force: [f64; 3], third: f64) -> [f64; 3] {
        let Self { inertia: b, damping: a } = self;
        let [s, s1, s2] = force;
        let square = a * a - b;
        [
            s - a * s1 + square * s2 + (2.0 * a * b - a * a * a) * third,
            s1 - a * s2 + square * third,
            s2 - a * third,
        ]
    }

    /// Returns the decay rate of a free oscillation: half the damping over the inertia.
    fn decay(self) -> f64 {
        0.5 * self.damping / self.inertia
    }

    /// Returns value, rate and acceleration of the oscillator in the given state.
    fn motion(self, force: [f64; 3], third: f64, state: &[f64; 2]) -> [f64; 3] {
        if !self.moves() {
            return force;
        }
        let steady = self.steady(force, third);
        let decay = self.decay();
        let [away, speed] = [state[0] - steady[0], state[1] - steady[1]];
        [state[0], state[1], steady[2] - 2.0 * decay * speed - away / self.inertia]
    }

    /// Returns value and rate after a step in which the third derivative of the force is constant.
    fn after(self, now: [f64; 3], next: [f64; 3], third: f64, step: f64, state: [f64; 2]) -> [f64; 2] {
        if !self.moves() {
            return [next[0], next[1]];
        }
        let (first, last) = (self.steady(now, third), self.steady(next, third));
        let [away, speed] = [state[0] - first[0], state[1] - first[1]];
        let (decay, square) = (self.decay(), self.inertia.recip());
        let [c, s] = free_oscillation(square, decay, step);
        [
            last[0] + c * away + s * (speed + decay * away),
            last[1] + c * speed - s * (decay * speed + square * away),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(times: Vec<f64>) -> Grid {
        let whole = 0..times.len();
        Grid { at_finest: times.len(), times, pieces: Vec::from([whole]) }
    }

    /// Returns modal forces that are zero.
    fn none(system: &TruncatedEquations, grid: &Grid) -> Mat<f64> {
        Mat::zeros(system.modal_mass.nrows(), grid.times.len())
    }

    fn alone(stiffness: [f64; 2]) -> TruncatedEquations {
        let none = || Mat::zeros(0, 0);
        TruncatedEquations {
            modal_stiffness: none(),
            modal_mass: none(),
            damping: TruncatedDamping::OfModes(none()),
            shared_mass: Mat::zeros(0, 2),
            stiffness: Mat::from_fn(2, 2, |i, j| if i == j { stiffness[i] } else { 0.0 }),
            mass: Mat::identity(2, 2),
        }
    }

    /// Two uncoupled oscillators of circular frequencies 2 and 50, loaded by a ramp and by a step.
    #[test]
    fn oscillators_follow_ramps_and_steps() {
        let system = alone([4.0, 2500.0]);
        let grid = grid((0..=60).map(|i| 0.05 * f64::from(i)).collect());
        let c = Mat::from_fn(2, grid.times.len(), |j, i| if j == 0 { grid.times[i] } else { 1.0 });
        let TruncatedAmplitudes { value, rate, acceleration } =
            system.amplitudes(&c, &none(&system, &grid), &grid, false).expect("a motion");
        for (i, t) in grid.times.iter().enumerate() {
            let (sin, cos) = (2.0 * t).sin_cos();
            assert!((value[(0, i)] - (t - sin / 2.0)).abs() < 1e-12, "{t}");
            assert!((rate[(0, i)] - (1.0 - cos)).abs() < 1e-12, "{t}");
            assert!((acceleration[(0, i)] - 2.0 * sin).abs() < 1e-11, "{t}");
            assert!((value[(1, i)] - (1.0 - (50.0 * t).cos())).abs() < 1e-10, "{t}");
            assert!((acceleration[(1, i)] - 2500.0 * (50.0 * t).cos()).abs() < 1e-6, "{t}");
        }
        let settled = system.amplitudes(&c, &none(&system, &grid), &grid, true).expect("a motion").value;
        assert!(
            (0..grid.times.len()).all(|i| (settled[(1, i)] - 1.0).abs() < 1e-12),
            "a constant force on what is settled"
        );
    }

    /// The force oscillates slowly compared with the natural frequencies. The response has the acceleration of the
    /// force's spline and does not ring.
    #[test]
    fn a_slow_swing_has_the_acceleration_of_a_swing() {
        let system = alone([1e4, 1e6]);
        let grid = grid((0..=240).map(|i| 0.05 * f64::from(i)).collect());
        let c = Mat::from_fn(2, grid.times.len(), |_, i| grid.times[i] - grid.times[i].sin());
        let TruncatedAmplitudes { acceleration, .. } =
            system.amplitudes(&c, &none(&system, &grid), &grid, true).expect("a motion");
        for (i, t) in grid.times.iter().enumerate() {
            for j in 0..2 {
                assert!(
                    (acceleration[(j, i)] - t.sin()).abs() < 0.02,
                    "{j} at {t}: {}",
                    acceleration[(j, i)]
                );
            }
        }
    }

    /// A mode of mass 1 is coupled to a response by their common mass. Finite differences of the motion satisfy the
    /// equations.
    #[test]
    fn what_is_missed_moves_the_modes_by_its_inertia() {
        let one = |value: f64| Mat::full(1, 1, value);
        let system = TruncatedEquations {
            modal_stiffness: one(9.0),
            modal_mass: one(1.0),
            damping: TruncatedDamping::OfModes(one(0.0)),
            shared_mass: one(0.3),
            stiffness: one(100.0),
            mass: one(0.5),
        };
        let step = 1e-3;
        let grid = grid((0..=5000).map(|i| step * f64::from(i)).collect());
        let force = |t: f64| (1.7 * t).sin();
        let c = Mat::from_fn(1, grid.times.len(), |_, i| force(grid.times[i]));
        let on_modes = |t: f64| 2.0 * t.cos();
        let g = Mat::from_fn(1, grid.times.len(), |_, i| on_modes(grid.times[i]));
        let TruncatedAmplitudes { value, acceleration, .. } =
            system.amplitudes(&c, &g, &grid, false).expect("a motion");
        for i in 1..grid.times.len() - 1 {
            let second =
                |j: usize| (value[(j, i + 1)] - 2.0 * value[(j, i)] + value[(j, i - 1)]) / step.powi(2);
            let (y, z) = (second(0), second(1));
            assert!((y - acceleration[(0, i)]).abs() < 1e-2 && (z - acceleration[(1, i)]).abs() < 5e-2);
            let (y, z) = (acceleration[(0, i)], acceleration[(1, i)]);
            let balance = [
                y + 0.3 * z + 9.0 * value[(0, i)] - on_modes(grid.times[i]),
                0.3 * y + 0.5 * z + 100.0 * (value[(1, i)] - force(grid.times[i]))
                    - 0.3 * on_modes(grid.times[i]),
            ];
            assert!(balance.iter().all(|left| left.abs() < 1e-5), "{i}: {balance:?}");
        }
        assert!((0..grid.times.len()).any(|i| value[(0, i)].abs() > 0.01), "the mode moves");
        // The reference values with damping come from a Runge-Kutta method of order 4.
        let damped = TruncatedEquations { damping: TruncatedDamping::OfModes(one(0.4)), ..system };
        let steady = Mat::full(1, grid.times.len(), 1.0);
        let pushed = damped.amplitudes(&steady, &none(&damped, &grid), &grid, false).expect("a motion").value;
        let largest = |from: usize| (from..from + 1000).map(|i| pushed[(0, i)].abs()).fold(0.0, f64::max);
        assert!((largest(0) - 0.5659).abs() < 2e-3 && (largest(4000) - 0.4415).abs() < 2e-3);
    }
}
