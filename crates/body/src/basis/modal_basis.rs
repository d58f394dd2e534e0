//! Common interface of all bases, and the checks common to all modes.

use super::{BasisKind, CoordinatesInModelAxes, FixedInterface, ModeSettings};
use faer::MatRef;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_eigen::{EigenProblem, EigenSolution, Wanted, energy_noise};
use flexbody_linalg::context::Context;
use flexbody_linalg::{gram, larger};
use flexbody_model::FeModel;

/// A kind of basis. A new kind needs one file in this folder and one variant of
/// [`BasisChoice`](super::BasisChoice).
pub trait Basis {
    /// Returns the kind of the basis, whose name is stored in files.
    fn kind(&self) -> BasisKind;

    /// Computes the modes of a model in this basis: mass-normalised, M-orthogonal to the rigid motions,
    /// ascending.
    ///
    /// # Errors
    /// Input that does not fit the model: exit code 2. Mechanisms, indefinite matrices, no convergence, or
    /// an inertia count that contradicts the modes: exit code 3.
    fn modes(&self, task: &Task<'_>) -> Result<ModalBasis>;
}

/// The model and the settings that a basis is computed for.
#[derive(Clone, Copy)]
pub struct Task<'a> {
    /// Model to compute modes for.
    pub model: &'a FeModel,
    /// Number and accuracy of the wanted modes.
    pub settings: &'a ModeSettings,
    /// Limits, progress listener and work counter.
    pub context: &'a Context<'a>,
}

/// Truncation error of the static response x = K^+ f to a load: |x - x_basis| / |x| in the K-norm, which is
/// sqrt(1 - sum_p (psi_p'f)^2 / lambda_p / f'K^+ f).
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Truncation {
    /// Name of the load.
    pub load: String,
    /// Error with the free modes alone.
    pub before: f64,
    /// Error with the residual vectors.
    pub after: f64,
}

/// Modes of a model in any basis, in model axes.
#[derive(Debug, Clone)]
pub struct ModalBasis {
    /// Eigenvalues, shapes (N x nf, by internal rows), residuals, completeness and work. If the modes are
    /// no eigenvectors, they are Ritz values and vectors of the span of the basis, with residuals
    /// accordingly.
    pub solution: EigenSolution,
    /// Largest |r' K r| of the M-normalised rigid modes r, relative to the first flexible eigenvalue: the
    /// strain energy of rigid motion due to the digits of the input and of the node positions.
    pub rigid_noise: f64,
    /// Standard deviation of each lambda due to the digits of K, relative to lambda.
    pub input_noise: Vec<f64>,
    /// Origin of each mode.
    pub provenance: Vec<String>,
    /// Truncation error for each load of the residual vectors.
    pub truncation: Vec<Truncation>,
    /// K and M in interface coordinates, for a basis that has them.
    pub coordinates: Option<CoordinatesInModelAxes>,
    /// Composition and frequency limit of a basis with fixed-interface modes.
    pub fixed_interface: Option<FixedInterface>,
    /// Warnings and notes.
    pub diagnostics: Vec<Diagnostic>,
}

/// Relative energy of rigid motion above which the first mode is not a free mode: the body has a weak tie
/// to ground.
const MAX_RIGID_ENERGY: f64 = 0.05;

/// Decimal digits of numbers written without loss.
const ALL_DIGITS: u8 = 17;

/// Relative noise of lambda above which a diagnostic reports the noise.
const REPORTED_NOISE: f64 = 1e-6;

/// Returns the relative error of the entries of K: half a unit of the last digit.
pub(super) fn input_error(model: &FeModel) -> f64 {
    0.5 * 10f64.powi(1 - i32::from(model.digits()))
}

/// Returns the eigenproblem of a model for vectors that already exist: there is no search and no first
/// estimate.
pub(super) fn problem_of_span<'a>(model: &'a FeModel, rigid: MatRef<'a, f64>) -> EigenProblem<'a> {
    let first_estimate = f64::INFINITY;
    let order = Some(model.elimination());
    EigenProblem { pencil: model.pencil(), rigid, first_estimate, input_error: input_error(model), order }
}

impl ModalBasis {
    /// Creates a basis from a solution whose modes all have the origin `provenance`, and measures the noise
    /// of the input.
    ///
    /// # Errors
    /// [`NoModes`](Code::NoModes) if the solution is empty;
    /// [`RigidMotionStrained`](Code::RigidMotionStrained) if the energy of rigid motion is comparable with
    /// that of the first mode.
    pub(super) fn new(
        model: &FeModel,
        problem: &EigenProblem<'_>,
        settings: &ModeSettings,
        solution: EigenSolution,
        provenance: &str,
    ) -> Result<Self> {
        let Some(&first) = solution.eigenvalues.first() else {
            return Err(no_modes(model, settings, &solution).into());
        };
        let (pencil, rigid) = (&problem.pencil, problem.rigid);
        let energy = gram(rigid, pencil.apply_stiffness(rigid).as_ref());
        let rigid_noise = energy.norm_l2() / first;
        if rigid_noise > MAX_RIGID_ENERGY {
            return Err(rigid_motion_strained(rigid_noise).into());
        }
        let noise = energy_noise(pencil.stiffness(), solution.vectors.as_ref(), problem.input_error);
        let relative = noise.iter().zip(&solution.eigenvalues).map(|(noise, lambda)| noise / lambda);
        let input_noise: Vec<f64> = relative.collect();
        let diagnostics = noise_note(model, input_noise.iter().copied().fold(rigid_noise, larger));
        let provenance = vec![provenance.to_owned(); solution.eigenvalues.len()];
        Ok(Self {
            solution,
            rigid_noise,
            input_noise,
            provenance,
            truncation: Vec::new(),
            coordinates: None,
            fixed_interface: None,
            diagnostics: diagnostics.into_iter().collect(),
        })
    }
}

/// Returns the error for a solution without modes, with the reason.
fn no_modes(model: &FeModel, settings: &ModeSettings, solution: &EigenSolution) -> Diagnostic {
    if settings.wanted == Wanted::Lowest(0) {
        let message = "no mode is requested, and a body without modes is rigid".to_owned();
        return Diagnostic::new(Code::NoModes, message).with_help("ask for one mode or more");
    }
    let message = match (settings.wanted, solution.next_eigenvalue) {
        (Wanted::Below(_), Some(next)) => {
            let hertz = model.units().frequency_of(next);
            format!("the first flexible mode has {hertz:.6} Hz, above the given limit")
        }
        _ => "no flexible mode has a finite frequency".to_owned(),
    };
    Diagnostic::new(Code::NoModes, message)
}

fn rigid_motion_strained(rigid_noise: f64) -> Diagnostic {
    let message = format!(
        "rigid motion carries {:.1} % of the energy of the first mode: lambda_rigid / lambda_1 = {rigid_noise:.2e}",
        100.0 * rigid_noise
    );
    Diagnostic::new(Code::RigidMotionStrained, message)
        .with_help("remove soft ties to ground; of a thin body write the matrices with more digits")
}

/// Returns a diagnostic about the noise of the eigenvalues due to the digits of the input, if the noise is
/// large enough.
fn noise_note(model: &FeModel, noise: f64) -> Option<Diagnostic> {
    if noise <= REPORTED_NOISE {
        return None;
    }
    let message = format!(
        "the {} digits of the stiffness values leave a relative noise of {noise:.0e} in the lowest eigenvalues",
        model.digits()
    );
    let diagnostic = Diagnostic::new(Code::NoiseFloor, message);
    Some(if model.digits() < ALL_DIGITS {
        diagnostic
    } else {
        diagnostic.with_help(
            "nothing to do: double precision has no more digits for a body as thin or stiff as this",
        )
    })
}
