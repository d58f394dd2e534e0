//! Truncated part of a motion, and the errors that it causes in the outputs.

use super::grid::Grid;
use super::residual::{BLOCK, NodalView};
use super::truncated_equations::{TruncatedAmplitudes, TruncatedDamping, TruncatedEquations};
use super::truncated_responses::TruncatedResponses;
use super::turning::Turning;
use faer::{Mat, MatRef};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::symmetric_part;
use flexbody_linalg::{combine, gram, larger, not_negative, side_by_side};
use flexbody_motion::scene::{Instant, OutputErrors, Peak, Scene, Trace, reaction_errors};
use nalgebra::Vector3;

/// Number of instants at which nodal displacements and reactions are evaluated. With so many samples at arbitrary
/// phase, little of a vibration's peak is missed.
const EVALUATED_INSTANTS: usize = 480;

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

/// Largest errors over the instants, and the time of the largest elastic energy.
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
            mass: symmetric_part(&gram(missed.responses.as_ref(), weighted.as_ref())),
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
        // Evaluate outputs where any amplitude or acceleration is largest, besides even steps.
        let histories = [&answer.value, &answer.acceleration].into_iter().flat_map(|all| {
            (0..all.nrows()).map(move |row| (0..all.ncols()).map(|i| all[(row, i)]).collect::<Vec<f64>>())
        });
        let shown = grid.significant_instants(EVALUATED_INSTANTS, histories);
        Self { view, grid, sampled, columns, answer, shown, modal_stiffness, energy: missed.energy.clone() }
    }

    /// Returns z (k x m), the amplitudes of the responses.
    pub(super) fn of_responses(&self) -> Mat<f64> {
        let nf = self.view.vectors.ncols();
        self.answer.value.as_ref().subrows(nf, self.energy.nrows()).to_owned()
    }

    /// Computes errors relative to the motion of all nodes, which is the `motion` of the body plus its truncated part.
    pub(super) fn errors(&self, scene: &Scene, motion: &Trace, watched: &[Mat<f64>]) -> TruncationErrors {
        let (stress, time) = self.stress(motion);
        let free = !scene.prescribes();
        let errors = OutputErrors {
            attitude: Some(if free { self.attitude() } else { 0.0 }),
            deflection: self.deflection(motion, watched),
            stress: Some(stress),
            reaction: if free { None } else { self.reaction(scene, motion) },
        };
        TruncationErrors { errors, time }
    }

    /// Returns the largest sqrt(V(X y) / max V), with the elastic energy V, and its time. The responses are
    /// K-orthogonal to the modes, so that their energy adds to that of the modes.
    fn stress(&self, motion: &Trace) -> (f64, f64) {
        let nf = self.view.vectors.ncols();
        let y = &self.answer.value;
        let of_responses = quadratics(&self.energy, &self.of_responses());
        let in_modes = y.as_ref().subrows(0, nf).to_owned();
        let of_modes = quadratics(&self.modal_stiffness, &in_modes);
        let whole = Mat::from_fn(nf, y.ncols(), |j, i| in_modes[(j, i)] + self.sampled[i].q[j]);
        let root = |energy: f64| not_negative(0.5 * energy).sqrt();
        let truncated = of_modes.iter().zip(&of_responses).map(|(a, b)| root(a + b));
        let truncated = Peak::of(&self.grid.times, truncated);
        let all = quadratics(&self.modal_stiffness, &whole);
        let roots = all.iter().zip(&of_responses).map(|(a, b)| root(a + b));
        let largest = Peak::of(&self.grid.times, roots).value;
        (truncated.value / largest.max(motion.resolution.root_energy), truncated.time)
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
