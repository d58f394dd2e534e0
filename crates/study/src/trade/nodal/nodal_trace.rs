//! Motion of all nodes in the form in which errors are measured against it.

use faer::{Mat, MatRef};
use flexbody_linalg::{combine, larger, multiply, not_negative};
use flexbody_model::FeModel;
use flexbody_motion::dynamics::{NodalEvaluation, NodalMotion, NodalPoint};
use flexbody_motion::integration::{Failure, Work};
use flexbody_motion::scene::{DeformationDifference, ErrorHistory, Extremes, Peak, Scheme, Trace};

/// Number of instants whose errors are computed together.
const BLOCK: usize = 256;

/// Displacements of all rows, with the data of a [`Trace`].
#[derive(Debug, Clone)]
pub(super) struct NodalTrace {
    /// Displacements (N x instants), in rows and axes of the model.
    displacements: Vec<f64>,
    rows: usize,
    /// Trace without modal coordinates.
    pub trace: Trace,
    spin: Peak,
    internal: Peak,
}

impl NodalTrace {
    /// Creates an empty motion of `rows` rows with the layout of `motion`, the trace of a body.
    pub(super) fn new(rows: usize, motion: &Trace) -> Self {
        let trace = Trace {
            scheme: motion.scheme,
            time: Vec::new(),
            attitude: Vec::new(),
            q: Vec::new(),
            elastic: Vec::new(),
            reactions: motion.reactions.as_ref().map(|_| Vec::new()),
            deflections: vec![Vec::new(); motion.deflections.len()],
            start: motion.start.clone(),
            extremes: Extremes::default(),
            work: Work::default(),
            size: motion.size,
            resolution: motion.resolution,
        };
        Self { displacements: Vec::new(), rows, trace, spin: Peak::default(), internal: Peak::default() }
    }

    /// Records the state at a time, and the displacements of the `watched` points. `workspace` is scratch space of N
    /// entries.
    pub(super) fn see<'e, L: FnMut(f64, &mut NodalEvaluation<'e>)>(
        &mut self,
        time: f64,
        state: &[f64],
        motion: &mut NodalMotion<'e, L>,
        watched: &[NodalPoint],
        workspace: &mut [f64],
    ) -> Result<(), Failure> {
        let trace = &mut self.trace;
        // Only reactions need the accelerations.
        match &mut trace.reactions {
            Some(reactions) => {
                motion.accelerations(time, state, workspace)?;
                reactions.push(motion.evaluation().driving_force());
            }
            None => drop(motion.evaluate(time, state)?),
        }
        let u = motion.loaded_displacements();
        self.displacements.extend_from_slice(u);
        let u = &self.displacements[self.displacements.len() - self.rows..];
        let evaluation = motion.evaluation();
        let to_frame = evaluation.equations().frame().axes.transpose();
        for (path, point) in trace.deflections.iter_mut().zip(watched) {
            path.push(to_frame * point.displacement(u));
        }
        let now = evaluation.configuration();
        // Internal energy: total energy without that of the centre of mass, P^2 / (2m).
        let flight = 0.5 * evaluation.momenta().0.norm_squared() / trace.size.0;
        let energy = evaluation.equations().elastic_energy(u);
        self.spin.see(time, now.omega.norm());
        self.internal.see(time, (evaluation.kinetic_energy() - flight + energy).max(0.0).sqrt());
        trace.time.push(time);
        trace.attitude.push(now.attitude);
        trace.elastic.push(energy);
        Ok(())
    }

    /// Completes the motion with its scheme, work and extremes.
    pub(super) fn finish(&mut self, scheme: Scheme, work: Work) {
        let extremes =
            Extremes { spin: self.spin.value, internal: self.internal.value.powi(2), ..Extremes::default() };
        self.trace = Trace { scheme, work, extremes, ..self.trace.clone() };
    }

    /// Returns the displacements (N x instants).
    pub(super) fn displacements(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.displacements, self.rows, self.trace.time.len())
    }

    /// Returns the largest displacement of any node at any instant.
    pub(super) fn largest_deflection(&self, model: &FeModel) -> f64 {
        let lengths = self.displacements.chunks_exact(self.rows).map(|u| longest(model, u));
        Peak::of(&self.trace.time, lengths).value
    }

    /// Returns the errors of `candidate` relative to this motion. `of` receives the first instant and a count, and
    /// returns the displacements of the candidate there (N x count).
    pub(super) fn errors(
        &self,
        model: &FeModel,
        candidate: &Trace,
        largest_deflection: f64,
        of: impl Fn(usize, usize) -> Mat<f64>,
    ) -> ErrorHistory {
        let (mut energy, mut deflection) = (Vec::new(), Vec::new());
        let instants = self.trace.time.len();
        for first in (0..instants).step_by(BLOCK) {
            let count = BLOCK.min(instants - first);
            // Elastic energy and largest displacement of the difference.
            let difference = of(first, count) - self.displacements().subcols(first, count);
            let mut forces = Mat::zeros(difference.nrows(), count);
            multiply(model.stiffness(), 1, difference.as_ref(), forces.as_mut());
            let product = |i: usize| {
                let pairs = difference.col_as_slice(i).iter().zip(forces.col_as_slice(i));
                0.5 * pairs.map(|(u, f)| u * f).sum::<f64>()
            };
            energy.extend((0..count).map(|i| not_negative(product(i))));
            deflection.extend((0..count).map(|i| longest(model, difference.col_as_slice(i))));
        }
        ErrorHistory::new(
            &self.trace,
            candidate,
            &DeformationDifference { energy, deflection, largest_deflection },
        )
    }

    /// Returns the displacements of a body with the shapes `vectors` (N x nf), at `count` instants of a motion from
    /// `first` on.
    pub(super) fn of_modes(vectors: MatRef<'_, f64>, motion: &Trace, first: usize, count: usize) -> Mat<f64> {
        let q = Mat::from_fn(vectors.ncols(), count, |j, i| motion.q[first + i][j]);
        combine(vectors, q.as_ref())
    }
}

/// Returns the largest displacement of a node.
fn longest(model: &FeModel, u: &[f64]) -> f64 {
    let d = model.dimension();
    let squares = u[..d * model.nodes().len()].chunks_exact(d).map(|u| u.iter().map(|u| u * u).sum::<f64>());
    squares.fold(0.0, larger).sqrt()
}
