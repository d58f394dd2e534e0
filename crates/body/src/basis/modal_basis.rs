//! What every basis gives, and what is checked of it whichever it is.

use super::{BasisKind, CoordinatesInModelAxes, FixedInterface, ModeSettings};
use faer::MatRef;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_eigen::{EigenProblem, EigenSolution, Wanted, energy_noise};
use flexbody_linalg::context::Context;
use flexbody_linalg::{gram, larger};
use flexbody_model::FeModel;

/// A kind of basis. A new one is one file of this room and one variant of
/// [`BasisChoice`](super::BasisChoice).
pub trait Basis {
    /// Kind of the basis, whose name stands in files.
    fn kind(&self) -> BasisKind;

    /// The modes of a model in this basis: mass-normalised, M-orthogonal to the rigid motions, ascending.
    ///
    /// # Errors
    /// Input that does not fit the model: exit code 2; mechanisms, indefinite matrices, no convergence, a
    /// count that contradicts the modes: 3.
    fn modes(&self, task: &Task<'_>) -> Result<ModalBasis>;
}

/// The model and the settings that a basis is computed for.
#[derive(Clone, Copy)]
pub struct Task<'a> {
    /// The model.
    pub model: &'a FeModel,
    /// Which modes and how good.
    pub settings: &'a ModeSettings,
    /// Limits, listener and counter of the work.
    pub context: &'a Context<'a>,
}

/// What a basis lacks of the static response x = K^+ f to a load: |x - x_basis| / |x| in the norm of K, which
/// is sqrt(1 - sum_p (psi_p'f)^2 / lambda_p / f'K^+ f).
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Truncation {
    /// Name of the load.
    pub load: String,
    /// With the free modes alone.
    pub before: f64,
    /// With the residual vectors.
    pub after: f64,
}

/// Modes of a model, in model axes, whatever basis they come from.
#[derive(Debug, Clone)]
pub struct ModalBasis {
    /// Eigenvalues, shapes (N x nf, by internal rows), residuals, completeness, work. Ritz values and vectors
    /// of the basis' span where these are no eigenvectors, which the residuals tell.
    pub solution: EigenSolution,
    /// Largest |r' K r| of the M-normalised rigid modes r, relative to the first flexible eigenvalue: what
    /// digits and node positions leave of rigid motion.
    pub rigid_noise: f64,
    /// For each mode, the standard deviation of lambda that the digits of K explain, relative to lambda.
    pub input_noise: Vec<f64>,
    /// Where each mode comes from.
    pub provenance: Vec<String>,
    /// For each load of the residual vectors, what the basis lacks.
    pub truncation: Vec<Truncation>,
    /// K and M in interface coordinates, of a basis that has them.
    pub coordinates: Option<CoordinatesInModelAxes>,
    /// What the basis is made of and how far it goes, of one with fixed-interface modes.
    pub fixed_interface: Option<FixedInterface>,
    /// Warnings and notes.
    pub diagnostics: Vec<Diagnostic>,
}

/// Relative energy of rigid motion above which the first mode is not a free mode: the body is tied to ground
/// weakly.
const RIGID_ENERGY: f64 = 0.05;

/// Decimal digits of numbers written without loss.
const ALL_DIGITS: u8 = 17;

/// Noise of lambda above which the user is told.
const NOISE_TOLD: f64 = 1e-6;

/// Relative error of the entries of K: half a unit of the last digit that they carry.
pub(super) fn input_error(model: &FeModel) -> f64 {
    0.5 * 10f64.powi(1 - i32::from(model.digits()))
}

/// The eigenproblem of a model for vectors that are there already: nothing is searched, so no estimate is
/// needed.
pub(super) fn problem_of_span<'a>(model: &'a FeModel, rigid: MatRef<'a, f64>) -> EigenProblem<'a> {
    let first_estimate = f64::INFINITY;
    let order = Some(model.elimination());
    EigenProblem { pencil: model.pencil(), rigid, first_estimate, input_error: input_error(model), order }
}

impl ModalBasis {
    /// Takes a solution, all of whose modes are called `provenance`, and measures the noise of its input.
    ///
    /// # Errors
    /// [`NoModes`](Code::NoModes) when it is empty; [`RigidMotionStrained`](Code::RigidMotionStrained) when
    /// rigid motion has energy beside that of the first mode.
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
        if rigid_noise > RIGID_ENERGY {
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

/// Why there is not a single mode.
fn no_modes(model: &FeModel, settings: &ModeSettings, solution: &EigenSolution) -> Diagnostic {
    if settings.wanted == Wanted::Lowest(0) {
        let message = "no mode is asked for, and a body without modes is rigid".to_owned();
        return Diagnostic::new(Code::NoModes, message).with_help("ask for one mode or more");
    }
    let message = match (settings.wanted, solution.next_eigenvalue) {
        (Wanted::Below(_), Some(next)) => {
            let hertz = model.units().frequency_of(next);
            format!("the first flexible mode has {hertz:.6} Hz, above the limit that was given")
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
        .with_help("soft ties to ground, or a thin body whose matrices carry too few digits")
}

/// What the digits of the input leave of the eigenvalues, where that is worth a word.
fn noise_note(model: &FeModel, noise: f64) -> Option<Diagnostic> {
    if noise <= NOISE_TOLD {
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
            "double precision holds no more digits: expect no better of a body as thin or stiff as this",
        )
    })
}
