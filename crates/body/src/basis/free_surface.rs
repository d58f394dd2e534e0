//! Free-surface modes: mass-normalised modes of the unsupported body, M-orthogonal to its rigid motions.

use super::failure::explain;
use super::modal_basis::{Basis, ModalBasis, Task, input_error, problem_of_span, rigid_modes};
use super::residual_vectors::{NamedLoads, interface_truncation, with_residual_vectors};
use super::{BasisKind, Loads, ModeSettings};
use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_eigen::{
    Accuracy, EigenProblem, EigenSolution, FactorChoice, Plan, Proof, Wanted, Way, energy_noise, plan, solve,
};
use flexbody_linalg::context::Context;
use flexbody_linalg::{
    Pencil, Tall, combine, contiguous_mut, gram, parallel, subtract_combination, symmetric_eigen,
};
use flexbody_model::{FeModel, centre_and_length};

/// Number of columns multiplied by K or M at a time if only products with other columns are needed; equals
/// the width of one product.
const PANEL_COLUMNS: usize = 8;

/// Basis of the lowest free-surface modes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FreeSurface {
    /// Loads whose responses are added to the modes as residual vectors.
    pub residual_vectors: Vec<Loads>,
}

impl Basis for FreeSurface {
    fn kind(&self) -> BasisKind {
        BasisKind::Free
    }

    fn modes(&self, task: &Task<'_>) -> Result<ModalBasis> {
        if self.residual_vectors.is_empty() {
            let Task { model, settings, context } = *task;
            let mut free = free_surface(model, settings, context)?;
            free.truncation = interface_truncation(model, &free.solution, context);
            return Ok(free);
        }
        free_modes_with(&self.residual_vectors, "residual vector", task)
    }
}

/// Computes free-surface modes and adds the responses to `loads`; `what` is their name in the origin of
/// modes.
pub(super) fn free_modes_with(loads: &[Loads], what: &str, task: &Task<'_>) -> Result<ModalBasis> {
    let Task { model, settings, context } = *task;
    let rigid = rigid_modes(model, &model.pencil())?;
    let problem = problem_of_span(model, rigid.as_ref());
    let loads = NamedLoads::new(model, loads, what, settings)?;
    let free = free_surface(model, settings, context)?;
    with_residual_vectors(model, &problem, free, &loads, settings, context)
}

/// Computes the free-surface modes of `model`.
///
/// # Errors
/// Mechanisms, indefinite matrices, no convergence, or an inertia count that contradicts the modes: exit
/// code 3.
pub fn free_surface(model: &FeModel, settings: &ModeSettings, context: &Context<'_>) -> Result<ModalBasis> {
    let pencil = model.pencil();
    let rigid = rigid_modes(model, &pencil)?;
    let first_estimate = polynomial_estimate(model, &pencil, rigid.as_ref());
    let problem = EigenProblem {
        pencil,
        rigid: rigid.as_ref(),
        first_estimate,
        input_error: input_error(model),
        order: Some(model.elimination()),
    };
    let solution = solve(&problem, settings, context).map_err(|failure| explain(model, failure))?;
    let mut basis = ModalBasis::new(model, &problem, settings, solution, super::FREE_MODE)?;
    describe(&basis.solution, settings, &problem, &mut basis.diagnostics);
    basis.diagnostics.extend(single_precision_note(&basis.solution, settings));
    Ok(basis)
}

/// Returns a diagnostic about the precision of the factor, or about the search without a factor.
pub(super) fn single_precision_note(solution: &EigenSolution, settings: &ModeSettings) -> Option<Diagnostic> {
    let plan = solution.plan.as_ref().filter(|_| settings.factor == FactorChoice::Auto)?;
    let message = match plan.current().way {
        Way::Cycles => {
            "the modes were found by multigrid cycles without a factor, and corrected in double precision"
        }
        _ if plan.has_failed(Way::Cycles) => {
            "multigrid cycles did not converge for this model: a factor was used instead"
        }
        Way::SinglePrecision => {
            "the factor was computed in single precision, and the modes were corrected in double precision"
        }
        _ if plan.has_failed(Way::SinglePrecision) => {
            "a factor in single precision is too inaccurate for the conditioning of this model: the factor was computed in double precision"
        }
        _ => return None,
    };
    Some(Diagnostic::new(Code::FactorPrecision, message))
}

/// Adds diagnostics about the number of modes and the end of the spectrum.
fn describe(
    solution: &EigenSolution,
    settings: &ModeSettings,
    problem: &EigenProblem<'_>,
    notes: &mut Vec<Diagnostic>,
) {
    let given = solution.eigenvalues.len();
    // Known from the rank of M, or because all modes were found.
    let mut finite = solution.finite_modes;
    if let Wanted::Lowest(wanted) = settings.wanted
        && given < wanted
    {
        let message = format!(
            "{wanted} modes were requested, the model has {given} flexible modes with finite frequency"
        );
        notes.push(Diagnostic::new(Code::ModesClamped, message));
        finite = finite.or(Some(given));
    }
    notes.extend(singular_mass_note(problem, finite));
    let below = solution.completeness.modes_below;
    if matches!(settings.wanted, Wanted::Lowest(_)) && below > given {
        let message = format!(
            "mode {given} shares its eigenvalue with other modes that are left out (number: {})",
            below - given
        );
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
                "raise --memory-limit or use a larger machine for the proof; the modes keep their accuracy",
            ),
        });
    }
}

/// Returns a diagnostic if the mass matrix is singular; `finite` is the number of modes with a finite
/// frequency, if known.
fn singular_mass_note(problem: &EigenProblem<'_>, finite: Option<usize>) -> Option<Diagnostic> {
    let pencil = &problem.pencil;
    let at_most = pencil.n() - problem.rigid.ncols();
    let massless = (0..pencil.mass().n()).filter(|&i| pencil.mass().row(i).0.is_empty()).count();
    let singular = match finite {
        Some(finite) if finite < at_most => {
            format!("{finite} of {at_most} flexible modes have a finite frequency")
        }
        None if massless > 0 => format!(
            "{} without mass: {massless}; at most {} of {at_most} flexible modes have a finite frequency",
            if pencil.block() == 1 { "rows" } else { "nodes" },
            at_most - pencil.block() * massless
        ),
        _ => return None,
    };
    Some(Diagnostic::new(Code::MassMatrixSingular, format!("mass matrix is singular: {singular}")))
}

/// Returns an upper bound of the first flexible eigenvalue of a model with these rigid modes. The bound is
/// close for a uniform body and serves as the scale of a shift.
pub fn first_eigenvalue_estimate(model: &FeModel, rigid: MatRef<'_, f64>) -> f64 {
    polynomial_estimate(model, &model.pencil(), rigid)
}

/// Returns the plan of the search for the free modes of a model: the attempts possible within the limits of
/// `context`, and their costs.
///
/// # Errors
/// The errors of the analysis of a model that cannot be factored; FB601 and FB604 if no attempt is within
/// the limits.
pub fn search_plan(model: &FeModel, settings: &ModeSettings, context: &Context<'_>) -> Result<Plan> {
    let rigid = rigid_modes(model, &model.pencil())?;
    let problem = problem_of_span(model, rigid.as_ref());
    plan(&problem, settings, context).map_err(|failure| explain(model, failure))
}

/// Returns the smallest Rayleigh quotient of polynomial fields, M-orthogonal to the rigid modes: an upper
/// bound of the first flexible eigenvalue. Fields of the second degree come within a factor of two for a
/// uniform solid. Fields of the third degree bend a curved shell nearly without stretching (a cylinder with
/// u_x = x^3, u_y = -y^3 exactly); they are used if nodes have rotations. Rows without a position stay
/// zero.
pub(super) fn polynomial_estimate(model: &FeModel, pencil: &Pencil<'_>, rigid: MatRef<'_, f64>) -> f64 {
    let has_rotations = !model.rows().rotations().is_empty();
    let monomials = if has_rotations { [QUADRATIC, CUBIC].concat() } else { QUADRATIC.to_vec() };
    // Polynomial fields, M-orthogonal to rigid motion (twice, against rounding).
    let mut fields = polynomial_fields(model, pencil.n(), &monomials);
    let mass = |x: MatRef<'_, f64>| pencil.apply_mass(x);
    let before = gram_in_panels(fields.as_ref(), mass);
    let m_rigid = pencil.apply_mass(rigid);
    for _ in 0..2 {
        let along = gram(m_rigid.as_ref(), fields.as_ref());
        subtract_combination(fields.as_mut(), rigid, along.as_ref());
    }
    let mut m = gram_in_panels(fields.as_ref(), mass);
    for i in 0..m.nrows() {
        // A rigid field, or a field without mass under a singular mass matrix, is rounding.
        if m[(i, i)] < 1e-10 * before[(i, i)] {
            m[(i, i)] = 0.0;
        }
    }
    let k = gram_in_panels(fields.as_ref(), |x| pencil.apply_stiffness(x));
    // In a shell the bending energy is a small difference of the energies of the fields.
    let bending = has_rotations.then(|| smallest_ratio(&k, &m, 1e-8)).flatten();
    bending
        .and_then(|(_, field)| resolved_ratio(pencil, combine(fields.as_ref(), field.as_ref()).as_ref()))
        .or_else(|| smallest_ratio(&k, &m, 1e-6).map(|(ratio, _)| ratio))
        .filter(|ratio| *ratio > 0.0 && ratio.is_finite())
        .unwrap_or_else(|| trace_ratio(pencil))
}

/// Monomials of the coordinates by their factors: first and second degree, and third degree.
const QUADRATIC: &[&[usize]] = &[&[0], &[1], &[2], &[0, 0], &[1, 1], &[2, 2], &[0, 1], &[1, 2], &[0, 2]];
const CUBIC: &[&[usize]] = &[
    &[0, 0, 0],
    &[1, 1, 1],
    &[2, 2, 2],
    &[0, 0, 1],
    &[0, 0, 2],
    &[0, 1, 1],
    &[1, 1, 2],
    &[0, 2, 2],
    &[1, 2, 2],
    &[0, 1, 2],
];

/// Returns fields with one monomial as displacement along one axis, all columns side by side. Nodal
/// rotations are half the curl of the field.
fn polynomial_fields(model: &FeModel, n: usize, monomials: &[&[usize]]) -> Tall {
    let positions = &model.nodes().positions;
    let (centre, length) = centre_and_length(positions);
    let d = model.dimension();
    let local: Vec<[f64; 3]> =
        positions.iter().map(|r| [0, 1, 2].map(|k| (r[k] - centre[k]) / length)).collect();
    let rows = model.rows();
    let rotations = rows.displacements()..;
    let mut fields = Tall::zeros(n, monomials.len() * d);
    parallel::for_each(fields.as_mut().col_iter_mut().map(contiguous_mut).enumerate(), |(column, field)| {
        let (monomial, component) = (monomials[column / d], column % d);
        for (r, at) in local.iter().zip((component..).step_by(d)) {
            field[at] = monomial.iter().map(|&k| r[k]).product();
        }
        for (row, &(node, axis)) in rotations.clone().zip(rows.rotations()) {
            let slope = |along: usize| slope(monomial, &local[node as usize], along) / length;
            let (next, after) = ((usize::from(axis) + 1) % 3, (usize::from(axis) + 2) % 3);
            // (curl u) along an axis = d u_after / d next - d u_next / d after.
            if component == after {
                field[row] = 0.5 * slope(next);
            } else if component == next {
                field[row] = -0.5 * slope(after);
            }
        }
    });
    fields
}

/// Returns the derivative of a monomial along an axis.
fn slope(monomial: &[usize], r: &[f64; 3], along: usize) -> f64 {
    let without = |at: usize| -> f64 {
        monomial.iter().enumerate().filter(|(other, _)| *other != at).map(|(_, &k)| r[k]).product()
    };
    (0..monomial.len()).filter(|&at| monomial[at] == along).map(without).sum()
}

/// Returns the Rayleigh quotient of a field, if its energy exceeds the rounding errors of the stiffness.
fn resolved_ratio(pencil: &Pencil<'_>, x: MatRef<'_, f64>) -> Option<f64> {
    let energy = gram(x, pencil.apply_stiffness(x).as_ref())[(0, 0)];
    let noise = energy_noise(pencil.stiffness(), x, f64::EPSILON)[0];
    (energy > MIN_ENERGY_PER_ROUNDING * noise)
        .then(|| energy / gram(x, pencil.apply_mass(x).as_ref())[(0, 0)])
}

/// Ratio of energy to its rounding error above which a field gives a valid estimate of the first
/// eigenvalue.
const MIN_ENERGY_PER_ROUNDING: f64 = 1e3;

/// Returns X' f(X), where f takes a few columns at a time, so that f(X) is never stored as a whole.
fn gram_in_panels(x: MatRef<'_, f64>, product: impl Fn(MatRef<'_, f64>) -> Mat<f64>) -> Mat<f64> {
    let mut whole = Mat::zeros(x.ncols(), x.ncols());
    for start in (0..x.ncols()).step_by(PANEL_COLUMNS) {
        let width = PANEL_COLUMNS.min(x.ncols() - start);
        let panel = gram(x, product(x.subcols(start, width)).as_ref());
        whole.as_mut().subcols_mut(start, width).copy_from(&panel);
    }
    whole
}

/// Returns the smallest eigenvalue of the small pencil (K, M) and its eigenvector (one column), restricted
/// to eigenvectors of M above `kept_above` times its largest eigenvalue.
fn smallest_ratio(k: &Mat<f64>, m: &Mat<f64>, kept_above: f64) -> Option<(f64, Mat<f64>)> {
    // Scale the fields to unit mass.
    let scale: Vec<f64> =
        (0..m.nrows()).map(|i| if m[(i, i)] > 0.0 { m[(i, i)].sqrt().recip() } else { 0.0 }).collect();
    let scaled = |a: &Mat<f64>| {
        Mat::from_fn(a.nrows(), a.ncols(), |i, j| 0.5 * (a[(i, j)] + a[(j, i)]) * scale[i] * scale[j])
    };
    let eigen = symmetric_eigen(scaled(m).as_ref())?;
    let largest = *eigen.values.last()?;
    // Directions of M above rounding.
    let kept: Vec<usize> =
        (0..eigen.values.len()).filter(|&i| eigen.values[i] > kept_above * largest).collect();
    let root = Mat::from_fn(m.nrows(), kept.len(), |i, c| {
        eigen.vectors[(i, kept[c])] / eigen.values[kept[c]].sqrt()
    });
    // Lowest eigenpair of K in these directions, back in the unscaled fields.
    let projected = gram(root.as_ref(), combine(scaled(k).as_ref(), root.as_ref()).as_ref());
    let ratios = symmetric_eigen(projected.as_ref())?;
    let ratio = *ratios.values.first()?;
    let field = combine(root.as_ref(), ratios.vectors.as_ref().subcols(0, 1));
    Some((ratio, Mat::from_fn(m.nrows(), 1, |i, _| scale[i] * field[(i, 0)])))
}

/// Returns mean stiffness over mean mass, the last resort for a scale.
fn trace_ratio(pencil: &Pencil<'_>) -> f64 {
    let k: f64 = pencil.stiffness().diagonal().iter().sum();
    let m: f64 = pencil.mass().diagonal().iter().sum::<f64>() * pencil.block() as f64;
    k / m
}
