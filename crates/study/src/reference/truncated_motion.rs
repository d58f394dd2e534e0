//! Truncated part of a motion, and the errors that it causes in the outputs.

use super::grid::Grid;
use super::residual::{BLOCK, NodalView, SceneLoad};
use super::truncated_equations::{TruncatedAmplitudes, TruncatedDamping, TruncatedEquations};
use super::truncated_responses::TruncatedResponses;
use faer::{Mat, MatRef};
use flexbody_body::convert::recovered_rows;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::symmetric_part;
use flexbody_linalg::{combine, gram, larger, largest, not_negative, side_by_side};
use flexbody_motion::scene::{Instant, OutputErrors, Peak, RecoveryMeasure, Scene, Trace, reaction_errors};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Number of instants at which nodal displacements and reactions are evaluated. With so many samples at arbitrary
/// phase, little of a vibration's peak is missed.
const EVALUATED_INSTANTS: usize = 480;

/// Part of the largest value from which a value counts as large. Several peaks of a vibration are nearly as large as the
/// largest; the first of them does not depend on rounding.
const LARGE: f64 = 0.8;

/// Truncated displacements X y(t) of all rows, with X = [Psi, E]: the modes, which are moved by
/// the truncated part, and the static responses outside the modes.
pub(super) struct TruncatedMotion<'a> {
    view: &'a NodalView<'a>,
    grid: &'a Grid,
    /// The motion of the body at the instants.
    sampled: &'a [Instant],
    /// X (N x (nf + k)).
    columns: Mat<f64>,
    answer: TruncatedAmplitudes,
    /// Indices of the instants at which nodal displacements and reactions are evaluated.
    shown: Vec<usize>,
    /// Stiffness K_ff of the modes and E'K E of the responses.
    modal_stiffness: Mat<f64>,
    energy: Mat<f64>,
}

/// Largest errors over the instants, and the first time of a large elastic energy.
pub(super) struct TruncationErrors {
    pub errors: OutputErrors,
    pub time: f64,
}

impl<'a> TruncatedMotion<'a> {
    /// Computes the truncated part of the motion of `body`, with the damping of its scene.
    pub(super) fn new(
        view: &'a NodalView<'a>,
        body: &FlexBody,
        missed: &TruncatedResponses,
        sampled: &'a [Instant],
        grid: &'a Grid,
        settled: bool,
    ) -> Self {
        let weigh = |x: MatRef<'_, f64>| view.model.pencil().apply_mass(x);
        let (nf, k) = (view.vectors.ncols(), missed.responses.ncols());
        let weighted = weigh(missed.responses.as_ref());
        let modal_stiffness = symmetric_part(body.invariants().modal_stiffness());
        let columns = side_by_side(&[view.vectors.as_ref(), missed.responses.as_ref()]);
        let mass = symmetric_part(&gram(missed.responses.as_ref(), weighted.as_ref()));
        // Assemble the equations of modes and responses.
        let system = TruncatedEquations {
            modal_stiffness: modal_stiffness.clone(),
            modal_mass: view.modal_mass.clone(),
            damping: match view.damped_by_model(columns.as_ref()) {
                Some(damped) => TruncatedDamping::OfModel(gram(columns.as_ref(), damped.as_ref())),
                None => TruncatedDamping::OfModes(view.modal_damping.clone()),
            },
            shared_mass: gram(view.vectors.as_ref(), weighted.as_ref()),
            stiffness: missed.energy.clone(),
            mass: mass.clone(),
        };
        // Without truncated part the answer is zero. If the equations have no solution, the answer is NaN, so that no
        // error appears small.
        let is_nothing = (0..k).all(|j| missed.energy[(j, j)] == 0.0) && missed.in_modes.is_all_finite();
        let unknown = || Mat::full(nf + k, grid.times.len(), if is_nothing { 0.0 } else { f64::NAN });
        let answer = system.amplitudes(&missed.amplitudes, &missed.in_modes, grid, settled);
        let answer = answer.unwrap_or_else(|| TruncatedAmplitudes {
            value: unknown(),
            rate: unknown(),
            acceleration: unknown(),
        });
        // Evaluate outputs where any amplitude or acceleration is largest, besides even steps. Amplitudes count by
        // their energy, accelerations by their inertia.
        let histories = |all: &Mat<f64>, [of_modes, of_responses]: [&Mat<f64>; 2]| -> Vec<Vec<f64>> {
            let weight =
                |row: usize| if row < nf { of_modes[(row, row)] } else { of_responses[(row - nf, row - nf)] };
            let history = |row: usize| {
                let root = not_negative(weight(row)).sqrt();
                (0..all.ncols()).map(|i| root * all[(row, i)]).collect()
            };
            (0..all.nrows()).map(history).collect()
        };
        let energies = histories(&answer.value, [&modal_stiffness, &missed.energy]);
        let inertias = histories(&answer.acceleration, [&view.modal_mass, &mass]);
        let shown = grid.significant_instants(EVALUATED_INSTANTS, &[energies, inertias]);
        Self { view, grid, sampled, columns, answer, shown, modal_stiffness, energy: missed.energy.clone() }
    }

    /// Returns z (k x m), the amplitudes of the responses.
    pub(super) fn of_responses(&self) -> Mat<f64> {
        let nf = self.view.vectors.ncols();
        self.answer.value.as_ref().subrows(nf, self.energy.nrows()).to_owned()
    }

    /// Computes errors relative to the motion of all nodes, which is the `motion` of the body plus its truncated part.
    pub(super) fn errors(
        &self,
        body: &FlexBody,
        scene: &Scene,
        motion: &Trace,
        watched: &[Mat<f64>],
    ) -> TruncationErrors {
        let (stress, time) = self.stress(motion);
        let free = !scene.prescribes();
        let errors = OutputErrors {
            attitude: Some(if free { self.attitude() } else { 0.0 }),
            deflection: self.deflection(motion, watched),
            stress: Some(stress),
            reaction: if free { None } else { self.reaction(scene, motion) },
            recovery: self.recovery(body, scene, motion),
        };
        TruncationErrors { errors, time }
    }

    /// Returns the largest sqrt(V(X y) / max V), with the elastic energy V, and the first time of [`LARGE`] of it. The responses are
    /// K-orthogonal to the modes, so that their energy adds to that of the modes.
    fn stress(&self, motion: &Trace) -> (f64, f64) {
        let nf = self.view.vectors.ncols();
        let y = &self.answer.value;
        let of_responses = quadratics(&self.energy, &self.of_responses());
        let in_modes = y.as_ref().subrows(0, nf).to_owned();
        let of_modes = quadratics(&self.modal_stiffness, &in_modes);
        let whole = Mat::from_fn(nf, y.ncols(), |j, i| in_modes[(j, i)] + self.sampled[i].q[j]);
        let root = |energy: f64| not_negative(0.5 * energy).sqrt();
        let truncated: Vec<f64> = of_modes.iter().zip(&of_responses).map(|(a, b)| root(a + b)).collect();
        let first_large = {
            let most = largest(truncated.iter().copied());
            truncated.iter().position(|value| *value >= LARGE * most).unwrap_or(0)
        };
        let truncated = Peak::of(&self.grid.times, truncated).value;
        let all = quadratics(&self.modal_stiffness, &whole);
        let roots = all.iter().zip(&of_responses).map(|(a, b)| root(a + b));
        let size = Peak::of(&self.grid.times, roots).value;
        (truncated / size.max(motion.resolution.root_energy), self.grid.times[first_large])
    }

    /// Returns the largest displacement X y of the watched points over the largest of Psi q + X y. All nodes count if
    /// no point is watched. Returns `None` if nothing moves.
    fn deflection(&self, motion: &Trace, watched: &[Mat<f64>]) -> Option<f64> {
        let (mut missed, mut whole) = (Vec::new(), Vec::new());
        for block in self.shown.chunks(BLOCK) {
            let truncated = combine(self.columns.as_ref(), columns_at(&self.answer.value, block).as_ref());
            let u = self.view.displacements(&self.motion_at(block), |now| &now.q) + &truncated;
            missed.extend(self.longest(&truncated, watched));
            whole.extend(self.longest(&u, watched));
        }
        let times = self.times_shown();
        let largest = Peak::of(&times, whole).value;
        let scale = largest.max(motion.resolution.deflection);
        (scale > 0.0).then(|| Peak::of(&times, missed).value / scale)
    }

    /// Returns, for every column, the largest displacement of the watched points, or of all nodes if none is watched.
    fn longest(&self, u: &Mat<f64>, watched: &[Mat<f64>]) -> Vec<f64> {
        if watched.is_empty() {
            return (0..u.ncols()).map(|i| self.view.model.longest_displacement(u.col_as_slice(i))).collect();
        }
        let mut longest = vec![0.0; u.ncols()];
        for point in watched {
            let moved = self.view.moved(point.as_ref(), u.as_ref());
            longest
                .iter_mut()
                .zip(moved)
                .for_each(|(longest, moved)| *longest = larger(*longest, moved.norm()));
        }
        longest
    }

    /// Returns the largest error of the recoveries with a limit, relative to it: the rows of X y less what the static
    /// columns of the body hold. `None` if no recovery has a limit, or if one is known for some shapes only.
    fn recovery(&self, body: &FlexBody, scene: &Scene, motion: &Trace) -> Option<f64> {
        let measure = RecoveryMeasure::new(body, scene, motion.recovered.as_ref())?;
        let model = self.view.model;
        let rows = |name: &str| {
            let asked = model.recoveries().iter().find(|recovery| recovery.name == name)?;
            recovered_rows(model, asked, &self.columns)
        };
        let truncated = measure.names().map(rows).collect::<Option<Vec<_>>>()?;
        let differences: Vec<Mat<f64>> =
            truncated.iter().enumerate().map(|(at, rows)| measure.beyond_columns(at, rows)).collect();
        // States: y, and what the static columns depend on.
        let y = &self.answer.value;
        let state = |(i, now): (usize, &'a Instant)| {
            let amplitudes = (0..y.nrows()).map(move |row| y[(row, i)]);
            amplitudes.chain(now.row_state[1 + now.q.len()..].iter().copied())
        };
        let states: Vec<f64> = self.sampled.iter().enumerate().flat_map(state).collect();
        let history = measure.of_differences(&differences, &self.grid.times, &states);
        Some(Peak::of(&self.grid.times, history).value)
    }

    /// Returns the largest angle by which the truncated part rotates a free body.
    fn attitude(&self) -> f64 {
        let turning = Turning::new(self.view, &self.columns);
        Peak::of(&self.grid.times, turning.angles(self.sampled, &self.answer.value)).value
    }

    /// Returns the largest relative difference between the nodal reactions with and without the truncated part.
    fn reaction(&self, scene: &Scene, motion: &Trace) -> Option<f64> {
        let (mut own, mut whole) = (Vec::new(), Vec::new());
        let TruncatedAmplitudes { value, rate, acceleration } = &self.answer;
        let holds = scene.carried.is_some() || scene.spin.as_ref().is_some_and(|spin| spin.hold);
        for block in self.shown.chunks(BLOCK) {
            let moving = self.motion_at(block);
            let amplitudes = [value, rate, acceleration].map(|y| columns_at(y, block));
            let none = Mat::zeros(value.nrows(), block.len());
            let [y, yd, ydd] = amplitudes.each_ref().map(Mat::as_ref);
            for (all, y) in [(&mut whole, [y, yd, ydd]), (&mut own, [none.as_ref(); 3])] {
                let field = self.view.field(&moving, self.columns.as_ref(), y);
                let reactions = self.view.reactions(&moving, &field);
                let given = |(force, torque)| (if holds { force } else { Vector3::zeros() }, torque);
                all.extend(reactions.into_iter().map(given));
            }
        }
        let times = self.times_shown();
        let errors = reaction_errors(&times, [&whole, &own], motion.size, &motion.extremes)?;
        Some(Peak::of(&times, errors).value)
    }

    fn times_shown(&self) -> Vec<f64> {
        self.shown.iter().map(|&i| self.grid.times[i]).collect()
    }

    fn motion_at(&self, instants: &[usize]) -> Vec<Instant> {
        instants.iter().map(|&i| self.sampled[i].clone()).collect()
    }
}

/// Returns the given columns of a matrix.
fn columns_at(a: &Mat<f64>, columns: &[usize]) -> Mat<f64> {
    Mat::from_fn(a.nrows(), columns.len(), |i, j| a[(i, columns[j])])
}

/// Returns x'A x for every column x.
fn quadratics(a: &Mat<f64>, x: &Mat<f64>) -> Vec<f64> {
    let product = combine(a.as_ref(), x.as_ref());
    let of = |i: usize| (0..x.nrows()).map(|k| x[(k, i)] * product[(k, i)]).sum();
    (0..x.ncols()).map(of).collect()
}

/// Returns the root of the largest elastic energy of a motion, at least the resolution of the motion.
pub(super) fn energy_scale(motion: &Trace) -> f64 {
    let roots = motion.elastic.iter().map(|energy| energy.max(0.0).sqrt());
    Peak::of(&motion.time, roots).value.max(motion.resolution.root_energy)
}

// Rotation of a free body by its truncated part: the error of the attitude.

/// Angular momentum of a free body and of the static responses E outside its modes, in body axes. In the plane all
/// entries except those about z are zero.
struct Turning {
    /// Inertia tensor J about the centre of mass.
    inertia: Matrix3<f64>,
    /// First-order change of J by each response.
    changes: Vec<Matrix3<f64>>,
    /// Matrix from the force of each load to the torque that it gains by each response.
    at_loads: Vec<Vec<Matrix3<f64>>>,
    plane: bool,
}

impl Turning {
    /// Computes inertia and its changes. With the rotations R_a = e_a x (x - x_cm) of points (and of directors) about
    /// the axes of the body, J_ab = R_a'M R_b; to first order R_a changes by e_a x u.
    pub(super) fn new(view: &NodalView<'_>, responses: &Mat<f64>) -> Self {
        let plane = view.model.dimension() == 2;
        let turns = central_turns(view);
        let weighted = view.rows.weigh(turns.as_ref());
        let extended = view.rows.extend(responses);
        let square = |own: &Mat<f64>| {
            if plane {
                Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, own[(0, 0)]))
            } else {
                Matrix3::from_fn(|a, b| own[(a, b)])
            }
        };
        // J_ab = R_a'M R_b.
        let inertia = square(&gram(turns.as_ref(), weighted.as_ref()));
        let change = |j: usize| {
            // Change of J_ab: (e_a x u)'M R_b and its transpose.
            let repeated = Mat::from_fn(turns.nrows(), turns.ncols(), |row, _| extended[(row, j)]);
            let mut turned = Mat::<f64>::zeros(turns.nrows(), turns.ncols());
            let axis = |k: usize| view.axes.column(if plane { 2 } else { k }).into_owned();
            view.rows.add_turned(axis, &repeated, &mut turned);
            let half = square(&gram(turned.as_ref(), weighted.as_ref()));
            half + half.transpose()
        };
        let changes = (0..responses.ncols()).map(change).collect();
        let at_load = |load: &SceneLoad| {
            let arms = view.arms(load, responses.as_ref());
            arms.into_iter().map(|arm| view.axes.transpose() * arm * view.axes).collect()
        };
        Self { inertia, changes, at_loads: view.loads.iter().map(at_load).collect(), plane }
    }

    /// Returns the angle theta between the frames of all nodes and of the body at every instant of the `motion`. The
    /// `amplitudes` c belong to the responses. The angular momentum is J omega in both; to first order
    ///
    /// theta' = delta omega - omega x theta,
    /// J delta omega = (J omega) x theta - (delta J) omega + l,
    /// l' = sum of (delta u) x F - omega x l,
    ///
    /// with delta J and the displacements delta u at the loads F linear in c. The coefficients are constant between
    /// instants, and the equations are solved exactly there. Both frames begin with the same omega.
    fn angles(&self, motion: &[Instant], amplitudes: &Mat<f64>) -> Vec<f64> {
        let mut state = SVector::<f64, 7>::zeros();
        let Some(first) = motion.first() else { return Vec::new() };
        let start: Vec<f64> = (0..amplitudes.nrows()).map(|row| amplitudes[(row, 0)]).collect();
        state.fixed_rows_mut::<3>(3).copy_from(&(self.change(&start) * first.omega));
        state[6] = 1.0;
        let mut angles = vec![0.0];
        for (i, pair) in motion.windows(2).enumerate() {
            // Constant coefficients over the step: exact by the matrix exponential.
            let midway = |row: usize| 0.5 * (amplitudes[(row, i)] + amplitudes[(row, i + 1)]);
            let c: Vec<f64> = (0..amplitudes.nrows()).map(midway).collect();
            let step = pair[1].time - pair[0].time;
            state = (self.rates(&pair[0], &pair[1], &c) * step).exp() * state;
            angles.push(state.fixed_rows::<3>(0).norm());
        }
        angles
    }

    /// Returns the matrix of the linear differential equations for (theta, l, 1).
    fn rates(&self, first: &Instant, second: &Instant, c: &[f64]) -> SMatrix<f64, 7, 7> {
        let omega = 0.5 * (first.omega + second.omega);
        let mut torque = Vector3::zeros();
        for (at, moved) in self.at_loads.iter().enumerate() {
            let force = 0.5 * (first.loads[at].0 + second.loads[at].0);
            let shift = moved.iter().zip(c).fold(Matrix3::zeros(), |sum, (own, c)| sum + own * *c);
            torque += shift * force;
        }
        let inverse = self.inverse();
        let turning = omega.cross_matrix();
        let mut rates = SMatrix::<f64, 7, 7>::zeros();
        rates
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&(inverse * (self.inertia * omega).cross_matrix() - turning));
        rates.fixed_view_mut::<3, 3>(0, 3).copy_from(&inverse);
        rates.fixed_view_mut::<3, 1>(0, 6).copy_from(&(-inverse * self.change(c) * omega));
        rates.fixed_view_mut::<3, 3>(3, 3).copy_from(&-turning);
        rates.fixed_view_mut::<3, 1>(3, 6).copy_from(&torque);
        rates
    }

    /// Returns delta J for responses with the amplitudes c.
    fn change(&self, c: &[f64]) -> Matrix3<f64> {
        self.changes.iter().zip(c).fold(Matrix3::zeros(), |sum, (own, c)| sum + own * *c)
    }

    /// Returns the inverse of J; zero if J is singular, as for a body on a line.
    fn inverse(&self) -> Matrix3<f64> {
        if self.plane {
            Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, self.inertia[(2, 2)].recip()))
        } else {
            self.inertia.try_inverse().unwrap_or_else(Matrix3::zeros)
        }
    }
}

/// Returns the rotations about the body axes through the centre of mass, in the rows that inertia acts on: three
/// columns, in the plane one.
fn central_turns(view: &NodalView<'_>) -> Mat<f64> {
    let d = view.model.dimension();
    let (shifts, turns) = view.extended_rigid.as_ref().split_at_col(d);
    let turns = match d {
        2 => turns.to_owned(),
        _ => combine(turns, Mat::from_fn(3, 3, |i, j| view.axes[(i, j)]).as_ref()),
    };
    // Shift the axes to the centre of mass, so that rotations are M-orthogonal to translations.
    let weighted = view.rows.weigh(shifts);
    let mass = gram(shifts, weighted.as_ref())[(0, 0)];
    let moments = gram(weighted.as_ref(), turns.as_ref());
    let offsets = Mat::from_fn(moments.nrows(), moments.ncols(), |i, j| moments[(i, j)] / mass);
    turns - combine(shifts, offsets.as_ref())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn instants(omega: Vector3<f64>, force: Vector3<f64>, steps: usize, step: f64) -> Vec<Instant> {
        let at = |i: usize| Instant {
            time: step * i as f64,
            velocity: Vector3::zeros(),
            velocity_rate: Vector3::zeros(),
            omega,
            omega_rate: Vector3::zeros(),
            q: Vec::new(),
            qd: Vec::new(),
            qdd: Vec::new(),
            gravity: Vector3::zeros(),
            row_state: Vec::new(),
            loads: vec![(force, Vector3::zeros())],
        };
        (0..=steps).map(at).collect()
    }

    fn turning() -> Turning {
        Turning {
            inertia: Matrix3::from_diagonal(&Vector3::new(2.0, 3.0, 4.0)),
            changes: vec![Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 0.04))],
            at_loads: vec![vec![Vector3::new(1e-3, 0.0, 0.0).cross_matrix()]],
            plane: false,
        }
    }

    /// A body whose moment about its axis of spin is 1 % larger turns 1 % slower.
    #[test]
    fn a_larger_moment_of_inertia_slows_the_spin() {
        let omega = Vector3::new(0.0, 0.0, 5.0);
        let grown = Mat::from_fn(1, 9, |_, i| if i == 0 { 0.0 } else { 1.0 });
        let motion = instants(omega, Vector3::zeros(), 8, 0.5);
        for (i, angle) in turning().angles(&motion, &grown).iter().enumerate().skip(1) {
            assert!((angle - 0.05 * 0.5 * (i as f64 - 0.5)).abs() < 1e-12, "{i}: {angle}");
        }
        // A body with the larger moment from the start has the larger angular momentum and does not turn away.
        let steady = turning().angles(&motion, &Mat::full(1, 9, 1.0));
        assert!(steady.iter().all(|angle| *angle < 1e-12), "{steady:?}");
    }

    /// A force at a point displaced by s = 1e-3 turns a body at rest by F s t^2 / 2 J.
    #[test]
    fn a_load_beside_its_place_turns_the_body() {
        let motion = instants(Vector3::zeros(), Vector3::new(0.0, 8.0, 0.0), 4, 0.25);
        let angles = turning().angles(&motion, &Mat::full(1, 5, 1.0));
        assert!((angles[4] - 8e-3 / 8.0).abs() < 1e-15, "{}", angles[4]);
    }
}
