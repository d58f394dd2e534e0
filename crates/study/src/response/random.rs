//! Random vibration: root mean squares of displacements and recovery rows under stationary random excitation.
//!
//! Inputs f with the one-sided spectral densities S (Hermitian, per hertz) give the states z = Z f of the body the
//! covariance
//!
//! ```text
//! C = integral of Re(Z S Z^H) over the band
//! ```
//!
//! A row r z then has the mean square r C r'. The equivalent stress of von Mises is a quadratic form of six rows, so that
//! its mean square is the sum of those of its linear forms. The integral is a Gauss-Legendre rule on panels that end at
//! the frequencies of the densities and cluster at resonances.

use super::Complex;
use super::band::{Band, Resonance};
use super::densities::SpectralDensities;
use super::ends::{RATE_LOADS, static_columns};
use super::framed_body::{FramedBody, Read};
use super::modal_sum::ModalSum;
use super::model_response::ModelResponse;
use super::place::Place;
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::convert::recovered_rows;
use flexbody_body::flex_body::Recovery;
use flexbody_linalg::{larger, not_negative, parallel, symmetric_eigen};
use flexbody_model::{RecoveryRow, StressPoint};
use nalgebra::DMatrix;

/// Nodes and weights of the Gauss-Legendre rule of eight points on -1 to 1; the negative nodes have the same weights.
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];
/// Smallest number of panels in a band.
const PANELS: usize = 24;
/// Half width of a resonance without damping, relative to its frequency: its peak is not resolved further.
const NARROWEST: f64 = 1e-7;
/// Ratio of the distances of successive panel ends from a resonance.
const GROWTH: f64 = 2.0;

/// Root mean squares under random excitation.
#[derive(Debug, Clone, PartialEq)]
pub struct RandomResponse {
    /// Names of the inputs, with their root mean squares over the band.
    pub inputs: Vec<(String, f64)>,
    /// Band over which the densities were integrated, in hertz.
    pub band: [f64; 2],
    /// Number of frequencies of the integral.
    pub evaluations: usize,
    /// Displacements and rotations, by place and direction.
    pub displacements: Vec<RandomValue>,
    /// All recoveries of the body.
    pub recoveries: Vec<RandomRecovery>,
}

impl RandomResponse {
    /// Returns the largest estimated error of a recovery: of the von Mises stress where it has points, else of its rows;
    /// zero if no error is known.
    pub fn worst_error(&self) -> f64 {
        let errors = self.recoveries.iter().filter_map(|recovery| recovery.errors);
        errors.map(|errors| errors.von_mises.unwrap_or(errors.rows)).fold(0.0, larger)
    }
}

/// Root mean square of a displacement or rotation.
#[derive(Debug, Clone, PartialEq)]
pub struct RandomValue {
    /// Place and direction: `interface tip z`.
    pub name: String,
    /// Root mean square.
    pub rms: f64,
}

/// Root mean squares of the rows of a recovery.
#[derive(Debug, Clone, PartialEq)]
pub struct RandomRecovery {
    /// Name.
    pub name: String,
    /// Label of every row.
    pub rows: Vec<RecoveryRow>,
    /// Root mean square of every row, about its value at rest.
    pub rms: Vec<f64>,
    /// Points with all six stresses.
    pub points: Vec<StressPoint>,
    /// Root of the mean square of the equivalent stress of von Mises at every point.
    pub von_mises: Vec<f64>,
    /// Estimated errors; `None` without the model, or for a recovery that is known for some shapes only.
    pub errors: Option<RandomErrors>,
}

/// Estimated errors of root mean squares: those of the difference from the model, relative to the largest values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RandomErrors {
    /// Largest root mean square of the difference of a row, relative to the largest of the rows of its unit.
    pub rows: f64,
    /// Largest root mean square of the difference of the equivalent stress of von Mises, relative to the largest;
    /// `None` without points.
    pub von_mises: Option<f64>,
}

/// Body under random excitation, with its model if it is known.
pub(super) struct RandomStudy<'a> {
    pub framed: &'a FramedBody,
    pub read: &'a Read<'a>,
    pub reduced: &'a ModalSum,
    pub known: Option<&'a ModelResponse<'a>>,
    pub densities: &'a SpectralDensities,
    /// Names of the inputs.
    pub inputs: Vec<String>,
    pub band: Band,
    pub resonances: &'a [Resonance],
}

/// Covariance of states, factored as C = L L'.
struct Covariance {
    factor: Mat<f64>,
}

impl Covariance {
    /// Returns the root mean squares of `rows` (rows x length of the states).
    fn rms(&self, rows: &Mat<f64>) -> Vec<f64> {
        (0..rows.nrows()).map(|i| self.along(rows, i).iter().map(|v| v * v).sum::<f64>().sqrt()).collect()
    }

    /// Returns r L for one row.
    fn along(&self, rows: &Mat<f64>, i: usize) -> Vec<f64> {
        let column = |j: usize| (0..rows.ncols()).map(|c| rows[(i, c)] * self.factor[(c, j)]).sum();
        (0..self.factor.ncols()).map(column).collect()
    }

    /// Returns the roots of the mean squares of the von Mises stress at `points` of the rows.
    fn von_mises(&self, rows: &Mat<f64>, points: &[StressPoint]) -> Vec<f64> {
        let of_point = |point: &StressPoint| {
            let count = self.factor.ncols();
            let along =
                |row: Option<usize>| row.map_or_else(|| vec![0.0; count], |row| self.along(rows, row));
            let stresses = point.rows.map(along);
            let square = |j: usize| {
                let values: [f64; 6] = std::array::from_fn(|k| stresses[k][j]);
                StressPoint::von_mises_of(&values).powi(2)
            };
            (0..count).map(square).sum::<f64>().sqrt()
        };
        parallel::map(points, of_point)
    }
}

impl RandomStudy<'_> {
    /// Computes the root mean squares. States are, in this order, the coordinates of the body, the forces on it that deform
    /// what the modes leave out, the forces over the square of the frequency, the first and second time derivatives of the coordinates if recoveries depend on
    /// them and, with a model, the coordinates of the enriched response.
    ///
    /// # Errors
    /// [`Usage`](Code::Usage) for a body without damping, whose response has no finite mean square.
    pub(super) fn run(&self) -> Result<RandomResponse> {
        if self.framed.damping().is_none() {
            let message = "the body has no damping, so that random excitation has no finite response";
            return Err(Diagnostic::new(Code::Usage, message).with_help("give --damping RATIO").into());
        }
        let instants = self.frequencies();
        let covariance = self.covariance(&instants);
        let body = &self.framed.at_centre;
        let recoveries =
            body.recoveries().iter().map(|recovery| self.recovery(recovery, &covariance)).collect();
        let inputs = self.inputs.iter().enumerate();
        let square = |i: usize| -> f64 {
            instants.iter().map(|&(hertz, weight)| weight * self.densities.at(hertz)[(i, i)].re).sum()
        };
        Ok(RandomResponse {
            inputs: inputs.map(|(i, name)| (name.clone(), not_negative(square(i)).sqrt())).collect(),
            band: self.band.ends(),
            evaluations: instants.len(),
            displacements: self.displacements(&covariance),
            recoveries,
        })
    }

    /// Returns the frequencies of the integral in hertz, with their weights.
    fn frequencies(&self) -> Vec<(f64, f64)> {
        let [low, high] = self.band.ends();
        let mut ends: Vec<f64> =
            (0..=PANELS).map(|i| low + (high - low) * i as f64 / PANELS as f64).collect();
        ends.extend(self.densities.frequencies());
        for resonance in self.resonances {
            ends.push(resonance.hertz);
            let mut distance = resonance.hertz * resonance.ratio.max(NARROWEST);
            while distance < high.max(resonance.hertz) {
                ends.extend([resonance.hertz - distance, resonance.hertz + distance]);
                distance *= GROWTH;
            }
        }
        ends.retain(|hertz| (low..=high).contains(hertz));
        ends.sort_by(f64::total_cmp);
        ends.dedup_by(|next, last| *next - *last <= 1e-12 * high);
        let mut all = Vec::with_capacity(8 * ends.len());
        for pair in ends.windows(2) {
            let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
            let nodes = GAUSS.iter().flat_map(|(node, weight)| [(-node, weight), (*node, weight)]);
            all.extend(nodes.map(|(node, weight)| (middle + half * node, half * weight)));
        }
        all
    }

    /// Integrates the covariance of all states over the given frequencies, in parts of fixed size, so that it does not depend
    /// on the number of threads.
    fn covariance(&self, frequencies: &[(f64, f64)]) -> Covariance {
        const PART: usize = 64;
        let parts: Vec<&[(f64, f64)]> = frequencies.chunks(PART).collect();
        let sums = parallel::map(&parts, |part| {
            let mut sum: Option<Mat<f64>> = None;
            for &(hertz, weight) in *part {
                let z = self.states(hertz);
                let excited = &z * self.densities.at(hertz) * z.adjoint();
                let own = Mat::from_fn(z.nrows(), z.nrows(), |i, j| weight * excited[(i, j)].re);
                sum = Some(match sum {
                    Some(sum) => sum + own,
                    None => own,
                });
            }
            sum.unwrap_or_else(Mat::new)
        });
        let covariance = sums.into_iter().reduce(|a, b| a + b).unwrap_or_else(Mat::new);
        Covariance { factor: factor(&covariance) }
    }

    /// Returns the states (length x inputs) for unit inputs.
    fn states(&self, hertz: f64) -> DMatrix<Complex<f64>> {
        let omega = self.framed.damped.units().eigenvalue_of(hertz).sqrt();
        let forces = |sum: &ModalSum| match &self.read.base {
            Some(base) => base.forces_of(omega, &sum.at(omega)),
            None => DMatrix::identity(self.reduced.inputs.ncols(), self.inputs.len()),
        };
        let own = forces(self.reduced);
        let coordinates = self.reduced.amplitudes(omega) * &own;
        let rates = [Complex::new(0.0, omega), Complex::new(-omega * omega, 0.0)];
        let rates = rates.iter().filter(|_| self.has_rates()).map(|factor| &coordinates * *factor);
        let mut parts = vec![
            coordinates.clone(),
            &own / self.reduced.lagging(omega),
            own / Complex::new(omega * omega, 0.0),
        ];
        parts.extend(rates);
        if let Some(enriched) = self.known.and_then(|known| known.enriched.as_ref()) {
            parts.push(enriched.amplitudes(omega) * forces(enriched));
        }
        let rows = parts.iter().map(DMatrix::nrows).sum();
        let mut all = DMatrix::zeros(rows, self.inputs.len());
        let mut first = 0;
        for part in parts {
            all.rows_mut(first, part.nrows()).copy_from(&part);
            first += part.nrows();
        }
        all
    }

    /// Returns true if a recovery has columns of the rates of the modal coordinates.
    fn has_rates(&self) -> bool {
        let has = |recovery: &Recovery| RATE_LOADS.iter().any(|load| recovery.of_motion(*load).is_some());
        self.framed.at_centre.recoveries().iter().any(has)
    }

    /// Returns the root mean squares of displacements and rotations.
    fn displacements(&self, covariance: &Covariance) -> Vec<RandomValue> {
        let dimension = self.framed.damped.dimension();
        let names: Vec<String> = self.read.displacements(dimension);
        let (nf, inputs) = (self.reduced.outputs.nrows(), self.reduced.inputs.ncols());
        let length = covariance.factor.nrows();
        let rows = Mat::from_fn(names.len(), length, |o, c| match c {
            c if c < nf => self.reduced.outputs[(c, o)],
            c if c >= nf + inputs && c < nf + 2 * inputs => -self.reduced.rigid[(o, c - nf - inputs)],
            _ => 0.0,
        });
        let rms = covariance.rms(&rows);
        names.into_iter().zip(rms).map(|(name, rms)| RandomValue { name, rms }).collect()
    }

    /// Returns the root mean squares of a recovery, with their estimated errors.
    fn recovery(&self, recovery: &Recovery, covariance: &Covariance) -> RandomRecovery {
        let points = StressPoint::among(&recovery.rows);
        let own = self.rows_of(recovery, covariance.factor.nrows());
        let (rms, von_mises) = (covariance.rms(&own), covariance.von_mises(&own, &points));
        let difference = self.beside_model(recovery, &own);
        let errors = difference.map(|difference| {
            let of_rows = covariance.rms(&difference);
            let of_points = covariance.von_mises(&difference, &points);
            let most = |values: &[f64]| values.iter().copied().fold(0.0, larger);
            let relative = |error: f64, size: f64| if error == 0.0 { 0.0 } else { error / size };
            let of_unit = |alike: Vec<usize>| {
                let most = |values: &[f64]| alike.iter().map(|row| values[*row]).fold(0.0, larger);
                relative(most(&of_rows), most(&rms))
            };
            let of_units = RecoveryRow::by_unit(&recovery.rows).into_iter().map(of_unit);
            RandomErrors {
                rows: of_units.fold(0.0, larger),
                von_mises: (!points.is_empty()).then(|| relative(most(&of_points), most(&von_mises))),
            }
        });
        RandomRecovery {
            name: recovery.name.clone(),
            rows: recovery.rows.clone(),
            rms,
            points,
            von_mises,
            errors,
        }
    }

    /// Returns the rows of a recovery of the body over the states.
    fn rows_of(&self, recovery: &Recovery, length: usize) -> Mat<f64> {
        let nf = recovery.modes.ncols();
        let columns = static_columns(recovery, &self.read.from, &self.framed.damped);
        let (after_forces, rates) =
            (nf + 2 * columns.ncols(), RATE_LOADS.map(|load| recovery.of_motion(load)));
        let has_rates = self.has_rates();
        let of_rate = |i: usize, c: usize| rates[c / nf].map_or(0.0, |columns| columns[(i, c % nf)]);
        Mat::from_fn(recovery.rows.len(), length, |i, c| match c {
            c if c < nf => recovery.modes[(i, c)],
            c if c < nf + columns.ncols() => columns[(i, c - nf)],
            c if has_rates && (after_forces..after_forces + 2 * nf).contains(&c) => {
                of_rate(i, c - after_forces)
            }
            _ => 0.0,
        })
    }

    /// Returns the difference between the rows of the body and those of its model over the states; `None` if the latter are
    /// not known.
    fn beside_model(&self, recovery: &Recovery, own: &Mat<f64>) -> Option<Mat<f64>> {
        let known = self.known?;
        let model = known.model();
        let asked = model.recoveries().iter().find(|one| one.name == recovery.name)?;
        // Modes that leave no unbalanced force lack nothing.
        let Some(shapes) = &known.shapes else { return Some(Mat::zeros(own.nrows(), own.ncols())) };
        let whole = recovered_rows(model, asked, shapes)?;
        let first = own.ncols() - whole.ncols();
        Some(Mat::from_fn(own.nrows(), own.ncols(), |i, c| match c.checked_sub(first) {
            Some(c) => own[(i, first + c)] - whole[(i, c)],
            None => own[(i, c)],
        }))
    }
}

/// Returns L with A = L L' for a positive semidefinite matrix.
fn factor(a: &Mat<f64>) -> Mat<f64> {
    // Numbers of one size: unit and kind of the states do not matter.
    let scale: Vec<f64> = (0..a.ncols()).map(|j| not_negative(a[(j, j)]).sqrt()).collect();
    let over = |value: f64, scale: f64| if scale > 0.0 { value / scale } else { 0.0 };
    let scaled = Mat::from_fn(a.nrows(), a.ncols(), |i, j| {
        over(over(0.5 * (a[(i, j)] + a[(j, i)]), scale[i]), scale[j])
    });
    match symmetric_eigen(scaled.as_ref()) {
        Some(eigen) => Mat::from_fn(a.nrows(), a.ncols(), |i, j| {
            scale[i] * eigen.vectors[(i, j)] * not_negative(eigen.values[j]).sqrt()
        }),
        None => Mat::full(a.nrows(), a.ncols(), f64::NAN),
    }
}

/// Returns the name of an input: the place without its kind, a colon and the direction, as `--from` states it.
pub(super) fn input_names(places: &[Place], dimension: usize) -> Vec<String> {
    let of_place = |place: &Place| {
        let directions = place.directions_of(dimension);
        let name = place.stated_name();
        directions
            .into_iter()
            .map(move |direction| format!("{name}:{}", direction.name()))
            .collect::<Vec<_>>()
    };
    places.iter().flat_map(of_place).collect()
}
