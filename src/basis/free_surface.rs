//! Free-surface modes: mass-normalised modes of the unsupported body, M-orthogonal to its rigid motions.

use crate::diagnostic::{Code, Diagnostic};
use crate::eigen::{
    Accuracy, EigenFailure, EigenProblem, EigenSolution, FactorChoice, Precision, Proof, Resume, Wanted,
    energy_noise, solve,
};
use crate::error::{Error, Result};
use crate::linalg::{Pencil, SymmetricMatrix, combine, gram, subtract_combination, symmetric_eigen};
use crate::model::{FeModel, centre_and_length, rigid_count, rigid_fields};
use crate::progress::Watch;
use faer::{Mat, MatRef};

/// What is asked for.
pub use crate::eigen::EigenSettings as ModeSettings;

/// Free-surface modes of a model, in model axes.
#[derive(Debug, Clone)]
pub struct FreeSurfaceModes {
    /// Eigenvalues, shapes (d n x nf, row d i + k, d the dimension), residuals, completeness, work.
    pub solution: EigenSolution,
    /// Largest |r' K r| of the M-normalised rigid modes r, relative to the first flexible eigenvalue: what digits and
    /// node positions leave of rigid motion.
    pub rigid_noise: f64,
    /// For each mode, the standard deviation of lambda that the digits of K explain, relative to lambda.
    pub input_noise: Vec<f64>,
    /// Warnings and notes.
    pub diagnostics: Vec<Diagnostic>,
}

/// Relative energy of rigid motion above which the first mode is not a free mode: the body is tied to ground weakly.
const RIGID_ENERGY: f64 = 0.05;

/// Noise of lambda above which the user is told.
const NOISE_TOLD: f64 = 1e-6;

/// Decimal digits that tell every double-precision number apart.
const ALL_DIGITS: u8 = 17;

/// Computes the free-surface modes of `model`.
///
/// # Errors
/// Mechanisms, indefinite matrices, no convergence, a count that contradicts the modes: exit code 3.
pub fn free_surface(model: &FeModel, settings: &ModeSettings, watch: Watch<'_>) -> Result<FreeSurfaceModes> {
    free_surface_resumed(model, settings, Resume::default(), watch)
}

/// The same with a search that starts where an earlier one stood, or that is kept.
///
/// # Errors
/// As [`free_surface`].
pub fn free_surface_resumed(
    model: &FeModel,
    settings: &ModeSettings,
    resume: Resume<'_>,
    watch: Watch<'_>,
) -> Result<FreeSurfaceModes> {
    compute(model, model.scalar_mass(), settings, resume, watch)
}

/// The same with another mass matrix Ms (a lumped one) in place of the model's.
///
/// # Errors
/// As [`free_surface`].
pub fn free_surface_of(
    model: &FeModel,
    scalar_mass: &SymmetricMatrix,
    settings: &ModeSettings,
    watch: Watch<'_>,
) -> Result<FreeSurfaceModes> {
    compute(model, scalar_mass, settings, Resume::default(), watch)
}

fn compute(
    model: &FeModel,
    scalar_mass: &SymmetricMatrix,
    settings: &ModeSettings,
    resume: Resume<'_>,
    watch: Watch<'_>,
) -> Result<FreeSurfaceModes> {
    let pencil = Pencil::new(model.stiffness(), scalar_mass, model.dimension());
    let positions = &model.nodes().positions;
    let rigid = rigid_modes(&pencil, positions)?;
    let input_error = 0.5 * 10f64.powi(1 - i32::from(model.digits()));
    let first_estimate = quadratic_estimate(&pencil, positions, rigid.as_ref());
    let problem = EigenProblem { pencil, rigid: rigid.as_ref(), first_estimate, input_error, resume };
    let solution = solve(&problem, settings, watch).map_err(|failure| explain(model, failure))?;
    if solution.eigenvalues.is_empty() {
        let message = match (settings.wanted, solution.next_eigenvalue) {
            (Wanted::Below(_), Some(next)) => {
                let hertz = model.units().frequency_of(next);
                format!("the first flexible mode has {hertz:.6} Hz, above the limit that was given")
            }
            _ => "no flexible mode has a finite frequency".to_owned(),
        };
        return Err(Diagnostic::new(Code::NoModes, message).into());
    }
    let mut diagnostics = Vec::new();
    let first = solution.eigenvalues.first().copied().unwrap_or(f64::INFINITY);
    let energy = gram(rigid.as_ref(), pencil.apply_stiffness(rigid.as_ref()).as_ref());
    let rigid_noise = energy.norm_l2() / first;
    if rigid_noise > RIGID_ENERGY {
        let message = format!(
            "rigid motion carries {:.1} % of the energy of the first mode: lambda_rigid / lambda_1 = {rigid_noise:.2e}",
            100.0 * rigid_noise
        );
        return Err(Diagnostic::new(Code::RigidMotionStrained, message)
            .with_help("soft ties to ground, or a thin body whose matrices carry too few digits")
            .into());
    }
    let input_noise: Vec<f64> = energy_noise(model.stiffness(), solution.vectors.as_ref(), input_error)
        .iter()
        .zip(&solution.eigenvalues)
        .map(|(noise, lambda)| noise / lambda)
        .collect();
    let noise = input_noise.iter().fold(rigid_noise, |m, n| m.max(*n));
    if noise > NOISE_TOLD {
        let message = format!(
            "the {} digits of the stiffness values leave a relative noise of {noise:.0e} in the lowest eigenvalues",
            model.digits()
        );
        let diagnostic = Diagnostic::new(Code::NoiseFloor, message);
        diagnostics.push(if model.digits() < ALL_DIGITS {
            diagnostic
        } else {
            diagnostic.with_help(
                "double precision holds no more digits: expect no better of a body as thin or stiff as this",
            )
        });
    }
    describe(&solution, settings, &pencil, &mut diagnostics);
    diagnostics.extend(single_precision_note(&solution, settings));
    Ok(FreeSurfaceModes { solution, rigid_noise, input_noise, diagnostics })
}

/// What the user should know about the precision of the factor.
fn single_precision_note(solution: &EigenSolution, settings: &ModeSettings) -> Option<Diagnostic> {
    let plan = solution.plan.filter(|_| settings.factor == FactorChoice::Auto)?;
    let message = match plan.precision {
        Precision::Single => "the factor is in single precision; the modes are corrected in double precision",
        Precision::Double if plan.single_failed => {
            "a single-precision factor is too poor for the conditioning of this model: factored in double precision"
        }
        Precision::Double => return None,
    };
    Some(Diagnostic::new(Code::FactorPrecision, message))
}

/// Notes about how many modes there are and how they end.
fn describe(
    solution: &EigenSolution,
    settings: &ModeSettings,
    pencil: &Pencil<'_>,
    notes: &mut Vec<Diagnostic>,
) {
    let given = solution.eigenvalues.len();
    let (scalar_mass, dimension) = (pencil.mass(), pencil.block());
    let at_most = pencil.n() - rigid_count(dimension);
    // Known from the rank of Ms, or because all there are were found.
    let mut finite = solution.finite_modes;
    if let Wanted::Lowest(wanted) = settings.wanted
        && given < wanted
    {
        let message = format!(
            "{wanted} modes were asked for, the model has {given} flexible modes with finite frequency"
        );
        notes.push(Diagnostic::new(Code::ModesClamped, message));
        finite = finite.or(Some(given));
    }
    let massless = (0..scalar_mass.n()).filter(|&i| scalar_mass.row(i).0.is_empty()).count();
    let singular = match finite {
        Some(finite) if finite < at_most => {
            Some(format!("{finite} of {at_most} flexible modes have a finite frequency"))
        }
        None if massless > 0 => Some(format!(
            "nodes without mass: {massless}; at most {} of {at_most} flexible modes have a finite frequency",
            at_most - dimension * massless
        )),
        _ => None,
    };
    notes.extend(
        singular.map(|what| {
            Diagnostic::new(Code::MassMatrixSingular, format!("mass matrix is singular: {what}"))
        }),
    );
    let below = solution.completeness.modes_below;
    if matches!(settings.wanted, Wanted::Lowest(_)) && below > given {
        let message = format!("mode {given} shares its eigenvalue with {} that are left out", below - given);
        notes.push(
            Diagnostic::new(Code::RepeatedSplit, message)
                .with_help(format!("ask for {below} modes to keep the body's symmetry")),
        );
    }
    if solution.completeness.proof == Proof::NotProved {
        let message =
            format!("completeness of the {given} modes is not proved: {}", solution.completeness.remark);
        let note = Diagnostic::new(Code::CompletenessUnproved, message);
        notes.push(match settings.accuracy {
            Accuracy::Fast => note,
            _ => note.with_help(
                "the modes keep their accuracy; a larger --memory-limit or machine allows the proof",
            ),
        });
    }
}

/// The M-orthonormal rigid modes from the node positions: six, in the plane three.
fn rigid_modes(pencil: &Pencil<'_>, positions: &[[f64; 3]]) -> Result<Mat<f64>> {
    let (centre, length) = centre_and_length(positions);
    let fields = rigid_fields(positions, pencil.block(), centre, length);
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
    // Twice: the second pass removes what the condition of the first Gram matrix left.
    orthonormal(&fields).and_then(|once| orthonormal(&once)).ok_or_else(|| {
        let message = format!("the {} nodes lie on one line or carry mass on one line only", positions.len());
        Error::from(Diagnostic::new(Code::BodyDegenerate, message))
    })
}

/// The smallest Rayleigh quotient of fields quadratic in the coordinates, M-orthogonal to the rigid modes: an upper
/// bound of the first flexible eigenvalue, within a factor of two for a uniform body.
fn quadratic_estimate(pencil: &Pencil<'_>, positions: &[[f64; 3]], rigid: MatRef<'_, f64>) -> f64 {
    let (centre, length) = centre_and_length(positions);
    let exponents = [(0, 9), (1, 9), (2, 9), (0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];
    let d = pencil.block();
    let mut fields = Mat::zeros(pencil.n(), exponents.len() * d);
    for (i, x) in positions.iter().enumerate() {
        let r = [0, 1, 2].map(|k| (x[k] - centre[k]) / length);
        for (e, &(a, b)) in exponents.iter().enumerate() {
            let value = r[a] * r.get(b).copied().unwrap_or(1.0);
            for k in 0..d {
                fields[(d * i + k, d * e + k)] = value;
            }
        }
    }
    let mass = |fields: &Mat<f64>| gram(fields.as_ref(), pencil.apply_mass(fields.as_ref()).as_ref());
    let before = mass(&fields);
    for _ in 0..2 {
        let along = gram(rigid, pencil.apply_mass(fields.as_ref()).as_ref());
        subtract_combination(fields.as_mut(), rigid, along.as_ref());
    }
    let mut m = mass(&fields);
    for i in 0..m.nrows() {
        // A rigid field, or one that a singular mass matrix does not see: rounding only.
        if m[(i, i)] < 1e-10 * before[(i, i)] {
            m[(i, i)] = 0.0;
        }
    }
    let k = gram(fields.as_ref(), pencil.apply_stiffness(fields.as_ref()).as_ref());
    smallest_ratio(&k, &m).unwrap_or_else(|| trace_ratio(pencil))
}

/// Smallest eigenvalue of the small pencil (K, M) on the well-conditioned part of M.
fn smallest_ratio(k: &Mat<f64>, m: &Mat<f64>) -> Option<f64> {
    let scale: Vec<f64> =
        (0..m.nrows()).map(|i| if m[(i, i)] > 0.0 { m[(i, i)].sqrt().recip() } else { 0.0 }).collect();
    let scaled = |a: &Mat<f64>| {
        Mat::from_fn(a.nrows(), a.ncols(), |i, j| 0.5 * (a[(i, j)] + a[(j, i)]) * scale[i] * scale[j])
    };
    let eigen = symmetric_eigen(scaled(m).as_ref())?;
    let largest = *eigen.values.last()?;
    let kept: Vec<usize> = (0..eigen.values.len()).filter(|&i| eigen.values[i] > 1e-6 * largest).collect();
    let root = Mat::from_fn(m.nrows(), kept.len(), |i, c| {
        eigen.vectors[(i, kept[c])] / eigen.values[kept[c]].sqrt()
    });
    let projected = gram(root.as_ref(), combine(scaled(k).as_ref(), root.as_ref()).as_ref());
    let ratios = symmetric_eigen(projected.as_ref())?;
    ratios.values.first().copied().filter(|v| *v > 0.0 && v.is_finite())
}

/// Mean stiffness over mean mass: a scale when nothing better is known.
fn trace_ratio(pencil: &Pencil<'_>) -> f64 {
    let k: f64 = pencil.stiffness().diagonal().iter().sum();
    let m: f64 = pencil.mass().diagonal().iter().sum::<f64>() * pencil.block() as f64;
    k / m
}

/// A failure that a single-precision factor may have caused by itself: nothing is known about the model then. Energies are
/// another matter: they come from K in double precision.
fn too_poor(failure: &EigenFailure) -> Option<Diagnostic> {
    let (code, why) = match failure {
        EigenFailure::NotConverged { converged, wanted } => {
            (Code::NotConverged, format!("{converged} of {wanted} modes converged"))
        }
        EigenFailure::NotPositiveDefinite { shift } => {
            (Code::FactorizationFailed, format!("rounded, K + {shift:.3e} M is not positive definite"))
        }
        EigenFailure::Inaccurate { residual } => {
            (Code::FactorizationFailed, format!("a probe has a relative residual of {residual:.1e}"))
        }
        _ => return None,
    };
    let message = format!("the modes cannot be found with a single-precision factor: {why}");
    Some(
        Diagnostic::new(code, message)
            .with_help("use --factor auto or f64: the model may be too thin, or unsound"),
    )
}

/// Turns a failure of the eigen-solver into a diagnostic that names nodes.
fn explain(model: &FeModel, failure: EigenFailure) -> Error {
    let d = model.dimension();
    let rigid = rigid_count(d);
    let moving = |vectors: &Mat<f64>| {
        let mut size: Vec<(usize, f64)> = (0..model.nodes().len())
            .map(|i| {
                let square = (0..vectors.ncols())
                    .flat_map(|j| (0..d).map(move |k| (d * i + k, j)))
                    .map(|(r, j)| vectors[(r, j)].powi(2))
                    .sum::<f64>();
                (i, square)
            })
            .collect();
        size.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let named: Vec<String> =
            size.iter().take(5).map(|(i, _)| model.nodes().ids[*i].to_string()).collect();
        named.join(", ")
    };
    let diagnostic = match failure {
        EigenFailure::SinglePrecision(failure) => match too_poor(&failure) {
            Some(found) => found,
            None => return explain(model, *failure),
        },
        EigenFailure::NotConverged { converged, wanted } => {
            Diagnostic::new(Code::NotConverged, format!("{converged} of {wanted} modes converged"))
        }
        EigenFailure::NotPositiveDefinite { shift } => Diagnostic::new(
            Code::StiffnessIndefinite,
            format!("K + {shift:.3e} M is not positive definite: K or M is indefinite"),
        ),
        EigenFailure::NegativeEigenvalue { eigenvalue, vector } => Diagnostic::new(
            Code::StiffnessIndefinite,
            format!("eigenvalue {eigenvalue:.6e} is negative; its mode moves nodes {} most", moving(&vector)),
        ),
        EigenFailure::MassIndefinite => {
            Diagnostic::new(Code::MassIndefinite, "mass matrix has negative eigenvalues beyond rounding")
        }
        // Their eigenvalues are rounding: no two machines would print the same.
        EigenFailure::ZeroEnergy { count, vectors, .. } => {
            let (all, moved) = (count + rigid, moving(&vectors));
            let message = format!(
                "{all} zero-energy modes: {rigid} rigid ones and {count} more, which move nodes {moved} most"
            );
            if all % rigid == 0 {
                let message = format!("{message}; {} separate bodies have as many", all / rigid);
                Diagnostic::new(Code::Mechanism, message).with_help(
                    "bodies that are joined by negligible entries only: remove these entries and use --split, or connect the bodies",
                )
            } else {
                Diagnostic::new(Code::Mechanism, message)
            }
        }
        EigenFailure::CountDiffers { found, counted, shift } => Diagnostic::new(
            Code::CompletenessFailed,
            format!(
                "{found} flexible modes were found below lambda = {shift:.6e}, the inertia count says {counted}"
            ),
        ),
        EigenFailure::Inaccurate { residual } => Diagnostic::new(
            Code::FactorizationFailed,
            format!("factorisation leaves a relative residual of {residual:.1e} in a probe"),
        ),
        EigenFailure::NotCertified { why } => Diagnostic::new(
            Code::FactorizationFailed,
            format!("eigenvalue bounds cannot be guaranteed: {why}"),
        )
        .with_help("use --accuracy standard"),
        EigenFailure::Memory { bytes, available } => Diagnostic::new(
            Code::MemoryShort,
            format!(
                "the factor and the vectors need {:.3} GB on top of the matrices, {:.3} GB are left",
                bytes as f64 * 1e-9,
                available as f64 * 1e-9
            ),
        ),
        EigenFailure::TooLarge => Diagnostic::new(
            Code::MemoryShort,
            "the node graph has more than 2^31 entries, too many for the ordering",
        ),
    };
    diagnostic.into()
}
