//! Static responses that the body does not contain along its motion, and the selection of the most important ones.

use super::compressed::{Compressed, Projected, UnbalancedAmplitudes};
use super::grid::Grid;
use super::principal::{principal, principal_directions};
use super::residual::{Held, NodalView};
use super::resonances::{ResonanceCriteria, resonances};
use super::truncated_equations::of_unit_energy;
use faer::{ColRef, Mat, MatRef};
use flexbody_base::error::Result;
use flexbody_body::basis::{free_static_responses_twice, oscillating_responses};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::symmetric_part;
use flexbody_linalg::{combine, gram, larger, not_negative, side_by_side, subtract_combination};
use flexbody_motion::scene::Instant;

/// Largest number of responses that are added to a body in one round.
const MOST_RESPONSES: usize = 12;

/// Part of the elastic energy of the responses, summed over the motion, whose inertia forces may be left without a
/// response.
const INERTIA_LEFT_OUT: f64 = 1e-9;
/// Largest number of combinations of responses whose inertia forces get a response.
const MAX_INERTIA_RESPONSES: usize = 8;

/// Factors applied to a frequency at which a harmonic response is computed. The next factor is used if the frequency
/// coincides with a natural frequency and the solution fails.
const FREQUENCY_FACTORS: [f64; 3] = [1.0, 1.0003, 0.9996];

/// Smallest root of the elastic energy that a response must keep after projection on the known ones, relative to its
/// full size, to be added.
const NEW: f64 = 1e-4;

/// Displacements E outside the modes of a body: static responses to the forces that its motion leaves unbalanced,
/// responses to the inertia of these (without which each force would have one natural frequency only), and responses at
/// the frequencies of resonances.
pub(super) struct TruncatedResponses {
    /// Forces B (N x k) with E = K^+ B.
    pub forces: Mat<f64>,
    /// Amplitudes c (k x m) of the unbalanced forces B c(t).
    pub amplitudes: Mat<f64>,
    /// Modal forces g (nf x m) of the unbalanced forces.
    pub in_modes: Mat<f64>,
    /// Responses E (N x k), K-orthogonal to the modes. If a point carries the body, the point is at rest.
    pub responses: Mat<f64>,
    /// Stiffness E'K E of the responses (k x k), the unit matrix but for rounding.
    pub energy: Mat<f64>,
}

impl TruncatedResponses {
    /// Computes the responses for a body along `motion`, given at the instants of `grid`.
    ///
    /// # Errors
    /// The errors of [`free_static_responses_twice`] and [`oscillating_responses`].
    pub(super) fn new(
        view: &NodalView<'_>,
        body: &FlexBody,
        motion: &[Instant],
        grid: &Grid,
        criteria: &ResonanceCriteria,
    ) -> Result<Self> {
        let model = view.model;
        // Compress the unbalanced forces of a few instants, then get amplitudes at all instants.
        let few: Vec<Instant> =
            grid.few(histories(motion, body)).into_iter().map(|i| motion[i].clone()).collect();
        let compressed = Compressed::new(model, &view.residual(&few));
        let UnbalancedAmplitudes { in_modes, compressed: amplitudes } =
            Projected::new(view, compressed.as_ref(), motion).amplitudes(motion);
        let Some(compressed) = compressed else {
            let nothing = || Mat::zeros(view.vectors.nrows(), 0);
            let (forces, responses) = (nothing(), nothing());
            return Ok(Self { forces, amplitudes, in_modes, responses, energy: Mat::zeros(0, 0) });
        };
        let forces = compressed.basis;
        // Static responses to the forces, and to the inertia of the first responses.
        let projection = ModalProjection::new(view, &body.modes().eigenvalue);
        let (mut responses, mut energy) = (Mat::new(), Mat::new());
        let inertia = |static_responses: &Mat<f64>| {
            responses = projection.of(static_responses.clone());
            energy = projection.energy(&responses);
            projection.inertia(&responses, &energy, &amplitudes)
        };
        let first = body.modes().eigenvalue[0];
        let [_, of_inertia] = free_static_responses_twice(&view.coupled, forces.clone(), inertia, first)?;
        // Harmonic responses at resonances of the forces.
        let resonances = resonances(grid, &amplitudes, &energy, criteria);
        let mut missed = Self { forces, amplitudes, in_modes, responses, energy };
        missed.add(&projection, of_inertia);
        for resonance in resonances {
            let forces = combine(
                missed.forces.as_ref().subcols(0, resonance.amplitudes.nrows()),
                resonance.amplitudes.as_ref(),
            );
            missed.add_resonance(&projection, forces, resonance.rate)?;
        }
        Ok(missed.orthonormal(&projection))
    }

    /// Returns the same displacements as amplitudes of K-orthonormal responses. Their natural frequencies are accurate to
    /// rounding, and so are the phases of oscillations after thousands of periods.
    fn orthonormal(mut self, projection: &ModalProjection<'_>) -> Self {
        // Nearly dependent responses leave what rounding is in the larger ones, which a second time removes.
        for _ in 0..2 {
            let Some(unit) = of_unit_energy(&self.energy) else { break };
            let weighted = combine(self.energy.as_ref(), self.amplitudes.as_ref());
            self.amplitudes = gram(unit.as_ref(), weighted.as_ref());
            self.forces = combine(self.forces.as_ref(), unit.as_ref());
            self.responses = combine(self.responses.as_ref(), unit.as_ref());
            self.energy = projection.energy(&self.responses);
        }
        self
    }

    /// Adds the harmonic response of the model to `forces` at the circular frequency `rate`.
    fn add_resonance(&mut self, projection: &ModalProjection<'_>, forces: Mat<f64>, rate: f64) -> Result<()> {
        let conditions = projection.view.held.as_ref().map(Held::conditions);
        for nudge in FREQUENCY_FACTORS {
            let square = (rate * nudge).powi(2);
            let coupled = &projection.view.coupled;
            if let Some(more) = oscillating_responses(coupled, forces.clone(), conditions, square)? {
                self.add(projection, more);
                return Ok(());
            }
        }
        Ok(())
    }

    /// Adds responses to forces whose amplitudes are zero.
    fn add(&mut self, projection: &ModalProjection<'_>, responses: Mat<f64>) {
        let more = projection.more(&self.responses, &self.energy, responses);
        let forces = projection.view.model.pencil().apply_stiffness(more.as_ref());
        let mut amplitudes = Mat::zeros(self.amplitudes.nrows() + more.ncols(), self.amplitudes.ncols());
        amplitudes.as_mut().subrows_mut(0, self.amplitudes.nrows()).copy_from(&self.amplitudes);
        self.amplitudes = amplitudes;
        self.forces = side_by_side(&[self.forces.as_ref(), forces.as_ref()]);
        self.responses = side_by_side(&[self.responses.as_ref(), more.as_ref()]);
        self.energy = projection.energy(&self.responses);
    }

    /// Returns the fewest forces B y (N x p) whose responses leave, at every instant, at most `enough` of the root of
    /// the elastic energy of E z(t). `moving` is z (k x m).
    pub(super) fn dominant(&self, moving: &Mat<f64>, enough: f64) -> Mat<f64> {
        let none = || Mat::zeros(self.forces.nrows(), 0);
        // Principal directions of the elastic energy.
        let Some(unit) = of_unit_energy(&self.energy) else { return none() };
        // w = T'E'K E z: the elastic energy of E z is |w|^2 / 2.
        let w = gram(unit.as_ref(), combine(self.energy.as_ref(), moving.as_ref()).as_ref());
        // Principal directions of w over time; find the smallest number that leaves a small enough rest.
        let Some(directions) = principal_directions(&w, 0.0, MOST_RESPONSES) else { return none() };
        let along = gram(directions.as_ref(), w.as_ref());
        let left = |count: usize, i: usize| -> f64 {
            let whole: f64 = (0..w.nrows()).map(|k| w[(k, i)].powi(2)).sum();
            let taken: f64 = (0..count).map(|k| along[(k, i)].powi(2)).sum();
            not_negative(0.5 * (whole - taken)).sqrt()
        };
        let worst = |count: &usize| (0..w.ncols()).map(|i| left(*count, i)).fold(0.0, larger);
        let count =
            (0..directions.ncols()).find(|count| worst(count) <= enough).unwrap_or(directions.ncols());
        let y = combine(unit.as_ref(), coarse(directions.as_ref().subcols(0, count)).as_ref());
        combine(self.forces.as_ref(), y.as_ref())
    }
}

/// Number of steps from zero to the largest component of a direction. A smaller number leaves more of the responses to
/// the next round.
const STEPS_OF_DIRECTIONS: f64 = 4096.0;

/// Returns directions whose components are rounded to a grid. The motion of the enriched body magnifies differences
/// between directions a thousandfold in a long run (by the phases of its oscillations), and each round magnifies those of
/// the round before: without the grid, last bits decide about the body after four rounds.
fn coarse(directions: MatRef<'_, f64>) -> Mat<f64> {
    let step = |column: ColRef<'_, f64>| column.norm_max().max(f64::MIN_POSITIVE) / STEPS_OF_DIRECTIONS;
    let steps: Vec<f64> = directions.col_iter().map(step).collect();
    Mat::from_fn(directions.nrows(), directions.ncols(), |i, j| {
        (directions[(i, j)] / steps[j]).round() * steps[j]
    })
}

/// Returns the histories whose largest values must be among the evaluated instants: loads, accelerations and spin of
/// the frame, and accelerations of the modes. All are accelerations of a point of the body: F / m, T / (m L), v', L w',
/// L w^2, q'' / sqrt(m) with the mass m and the extent L.
fn histories(motion: &[Instant], body: &FlexBody) -> Vec<Vec<f64>> {
    let (mass, extent) = (body.invariants().mass(), body.extent());
    let (loads, modes) = motion.first().map_or((0, 0), |first| (first.loads.len(), first.qdd.len()));
    let accelerations = |now: &Instant| -> Vec<f64> {
        let of_loads = now.loads.iter().flat_map(|(force, torque)| [force / mass, torque / (mass * extent)]);
        let spin = now.omega.map(|rate| extent * rate * rate);
        let of_frame = [now.velocity_rate, extent * now.omega_rate, spin];
        let components = of_loads.chain(of_frame).flat_map(<[f64; 3]>::from);
        components.chain(now.qdd.iter().map(|qdd| qdd / mass.sqrt())).collect()
    };
    let instants: Vec<Vec<f64>> = motion.iter().map(accelerations).collect();
    let history = |at: usize| instants.iter().map(|now| now[at]).collect();
    (0..6 * loads + 9 + modes).map(history).collect()
}

/// Projection of displacements to the complement of the modes of a body.
struct ModalProjection<'v> {
    view: &'v NodalView<'v>,
    eigenvalues: &'v [f64],
    /// K Psi.
    stiff: Mat<f64>,
}

impl<'v> ModalProjection<'v> {
    fn new(view: &'v NodalView<'v>, eigenvalues: &'v [f64]) -> Self {
        Self { view, eigenvalues, stiff: view.model.pencil().apply_stiffness(view.vectors.as_ref()) }
    }

    /// Returns `responses` with the carrying point at rest and without their part in the modes.
    fn of(&self, mut responses: Mat<f64>) -> Mat<f64> {
        if let Some(held) = &self.view.held {
            held.hold(&mut responses);
        }
        // Static responses have no part in the modes except rounding.
        let shared = gram(self.stiff.as_ref(), responses.as_ref());
        let part = Mat::from_fn(shared.nrows(), shared.ncols(), |p, j| shared[(p, j)] / self.eigenvalues[p]);
        subtract_combination(responses.as_mut(), self.view.vectors.as_ref(), part.as_ref());
        responses
    }

    /// Returns E'K E.
    fn energy(&self, responses: &Mat<f64>) -> Mat<f64> {
        let weighted = self.view.model.pencil().apply_stiffness(responses.as_ref());
        symmetric_part(&gram(responses.as_ref(), weighted.as_ref()))
    }

    /// Returns the inertia forces M E y of the few combinations E y that have nearly all the elastic energy of E c(t).
    ///
    /// * `responses`: E.
    /// * `energy`: E'K E.
    /// * `amplitudes`: c.
    fn inertia(&self, responses: &Mat<f64>, energy: &Mat<f64>, amplitudes: &Mat<f64>) -> Mat<f64> {
        let Some(unit) = of_unit_energy(energy) else {
            return Mat::zeros(responses.nrows(), 0);
        };
        // Amplitudes scaled to the root of the elastic energy; their principal directions over time.
        let moving = gram(unit.as_ref(), combine(energy.as_ref(), amplitudes.as_ref()).as_ref());
        let Some(directions) = principal_directions(&moving, INERTIA_LEFT_OUT, MAX_INERTIA_RESPONSES) else {
            return Mat::zeros(responses.nrows(), 0);
        };
        let few = combine(responses.as_ref(), combine(unit.as_ref(), directions.as_ref()).as_ref());
        self.view.part(self.view.model.pencil().apply_mass(few.as_ref())).forces
    }

    /// Returns the new directions that `further` adds to the `known` responses. They are K-orthogonal to the known
    /// responses and to each other, and scaled to the largest energy of the known ones.
    ///
    /// * `energy`: E'K E of the known responses.
    fn more(&self, known: &Mat<f64>, energy: &Mat<f64>, further: Mat<f64>) -> Mat<f64> {
        let mut further = self.of(further);
        let own = self.energy(&further);
        let sizes: Vec<f64> = (0..own.nrows()).map(|j| own[(j, j)].max(f64::MIN_POSITIVE).sqrt()).collect();
        further = Mat::from_fn(further.nrows(), further.ncols(), |i, j| further[(i, j)] / sizes[j]);
        let Some(unit) = of_unit_energy(energy) else { return further };
        let largest = (0..energy.nrows()).map(|j| energy[(j, j)]).fold(0.0, larger).sqrt();
        let orthonormal = combine(known.as_ref(), unit.as_ref());
        let weighted = self.view.model.pencil().apply_stiffness(orthonormal.as_ref());
        // Orthogonalise twice: the new part may be small compared with the common part.
        for _ in 0..2 {
            let shared = gram(weighted.as_ref(), further.as_ref());
            subtract_combination(further.as_mut(), orthonormal.as_ref(), shared.as_ref());
        }
        let Some((turned, own)) = principal(self.energy(&further), 0.0, usize::MAX) else {
            return Mat::zeros(further.nrows(), 0);
        };
        // A response without a new direction leaves rounding only.
        let kept = own.iter().take_while(|root| **root > NEW).count();
        let scaled = Mat::from_fn(turned.nrows(), kept, |row, k| turned[(row, k)] * largest / own[k]);
        combine(further.as_ref(), scaled.as_ref())
    }
}
