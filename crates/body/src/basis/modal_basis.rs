//! Common interface of all bases, their names, the checks common to all modes, and the rigid modes, which are removed
//! from every basis.

use super::{CoordinatesInModelAxes, FixedInterface, ModeSettings};
use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::numbers::significant;
use flexbody_eigen::{EigenProblem, EigenSolution, Wanted, energy_noise};
use flexbody_linalg::context::Context;
use flexbody_linalg::{Pencil, combine, gram, larger, symmetric_eigen};
use flexbody_model::{FeModel, centre_and_length};
use strum::{EnumString, IntoStaticStr, VariantArray};

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
pub(super) const ALL_DIGITS: u8 = 17;

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
            let hertz = significant(model.units().frequency_of(next), 7);
            format!("the first flexible mode has {hertz} Hz, above the given limit")
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

/// Kind of basis: the shapes that span the deformation of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, EnumString, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum BasisKind {
    /// Free-surface modes, and the residual vectors that the model or the scene requests.
    #[default]
    Free,
    /// Modes with the interfaces held, and the static responses to motions of the interfaces (Craig and
    /// Bampton).
    CraigBampton,
    /// Free-surface modes, and the static responses to loads at the interfaces (Craig and Chang).
    CraigChang,
    /// Shapes computed elsewhere and read from a file.
    Imported,
    /// Smallest set of shapes that spans the motion of a scene; another motion may need others.
    Scene,
}

impl BasisKind {
    /// All kinds, in the order of the documentation.
    pub const ALL: &'static [Self] = Self::VARIANTS;

    /// Returns the name in files, reports and on the command line.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Returns the kind with the given name.
    pub fn from_name(name: &str) -> Option<Self> {
        name.parse().ok()
    }

    /// Returns true if the basis consists of free-surface modes only, or if its shapes are chosen from
    /// them. Residual vectors for the loads of a scene may be added, and the frequency band of the scene
    /// may set the number of modes.
    pub fn follows_scene(self) -> bool {
        matches!(self, Self::Free | Self::Scene)
    }

    /// Returns true if the search is for free-surface modes, to which residual vectors may be added.
    pub fn searches_free_modes(self) -> bool {
        self.follows_scene() || self == Self::CraigChang
    }
}

/// Returns the rigid modes of a model from its node positions (N x 6, in the plane N x 3), orthonormal in
/// the mass of `pencil`.
///
/// # Errors
/// [`BodyDegenerate`](Code::BodyDegenerate) if the nodes or the mass lie on one line.
pub fn rigid_modes(model: &FeModel, pencil: &Pencil<'_>) -> Result<Mat<f64>> {
    let positions = &model.nodes().positions;
    let (centre, length) = centre_and_length(positions);
    let fields = model.rigid_fields(centre, length);
    let orthonormal = |r: &Mat<f64>| {
        let mass = gram(r.as_ref(), pencil.apply_mass(r.as_ref()).as_ref());
        let eigen = symmetric_eigen(mass.as_ref())?;
        let largest = eigen.values.last().copied().unwrap_or(0.0);
        // A body on one line has a rotation that moves nothing.
        if eigen.values[0].is_nan() || eigen.values[0] <= 1e-14 * largest {
            return None;
        }
        let root = Mat::from_fn(r.ncols(), r.ncols(), |i, j| eigen.vectors[(i, j)] / eigen.values[j].sqrt());
        Some(combine(r.as_ref(), root.as_ref()))
    };
    // Orthonormalise twice: the second pass removes the error due to the condition of the first Gram
    // matrix.
    orthonormal(&fields)
        .and_then(|once| orthonormal(&once))
        .ok_or_else(|| Error::from(degenerate(model, centre, length)))
}

/// Returns the error FB416, which says if the nodes lie on one line, or only their mass.
fn degenerate(model: &FeModel, centre: [f64; 3], length: f64) -> Diagnostic {
    /// Distance from a line, relative to the extent of the body, below which nodes lie on it.
    const COLLINEAR_DISTANCE: f64 = 1e-7;
    let positions = &model.nodes().positions;
    let nodes = positions.len();
    if model.dimension() == 2 {
        return Diagnostic::new(
            Code::BodyDegenerate,
            format!("all mass of the {nodes} nodes lies in one point"),
        );
    }
    let from_centre = Mat::from_fn(positions.len(), 3, |node, k| (positions[node][k] - centre[k]) / length);
    let spread = symmetric_eigen(gram(from_centre.as_ref(), from_centre.as_ref()).as_ref());
    let is_line = spread.is_none_or(|eigen| eigen.values[1] <= COLLINEAR_DISTANCE.powi(2) * eigen.values[2]);
    if is_line {
        let message = format!("the {nodes} nodes lie on one line, and nothing has inertia about it");
        return Diagnostic::new(Code::BodyDegenerate, message);
    }
    let message =
        format!("the {nodes} nodes do not lie on one line, but all mass does: nothing has inertia about it");
    let help = "use C3D8 or C3D20, or two rows of elements, in a bar of one row of elements of reduced integration (C3D8R), which have their mass in their middles; else look for nodes without mass";
    Diagnostic::new(Code::BodyDegenerate, message).with_help(help)
}
