//! Residual vectors: static responses K^+ f that a basis cut off by frequency does not have (theory section 8).

use super::columns::columns;
use super::failure::explain;
use super::joints::{AXES, Joint, joints};
use super::modal_basis::ModalBasis;
use super::pseudo_free_surface::independent;
use super::{ModeSettings, Truncation};
use crate::diagnostic::{Code, Diagnostic};
use crate::eigen::{
    Accuracy, EigenFailure, EigenProblem, EigenSolution, Precision, Wanted, modes_of_span, static_responses,
};
use crate::error::Result;
use crate::linalg::{add_combination, column_products, gram, side_by_side};
use crate::model::{FeModel, RawShapes};
use crate::progress::{Event, Watch};
use crate::provenance::SourceFile;
use faer::Mat;

/// Part of the M-norm of a response that must be left beside the modes and the vectors before it.
const LEFT: f64 = 1e-8;

/// Part of a load that must be left without its resultants: what moves the body only as a whole needs no mode.
const SELF_EQUILIBRATED: f64 = 1e-10;

/// Loads whose static responses are to be in the basis.
#[derive(Debug, Clone, PartialEq)]
pub enum Loads {
    /// The six centrifugal loads f = M (e_k e_l' + e_l e_k' - 2 delta_kl I) x / (1 + delta_kl), up to their sign, that any
    /// constant angular velocity is made of: f(w) = sum_kl w_k w_l f_kl.
    Centrifugal,
    /// Unit force and unit torque along every model axis at the reference point of every interface, distributed over its nodes as
    /// a rigid motion of these would be (averaging coupling, also where another joins the nodes rigidly); unit forces at the
    /// nodes of a free interface.
    Interfaces,
    /// Nodal forces.
    User(UserLoads),
}

/// Nodal forces in the order of a model's degrees of freedom, one load in each column.
#[derive(Debug, Clone, PartialEq)]
pub struct UserLoads {
    loads: Mat<f64>,
    source: Option<SourceFile>,
}

impl UserLoads {
    /// Loads for `model`, given by its matrix rows.
    ///
    /// # Errors
    /// As [`ImportedShapes::new`](super::ImportedShapes::new).
    pub fn new(model: &FeModel, raw: RawShapes) -> Result<Self> {
        let source = raw.source.clone();
        Ok(Self { loads: columns(model, raw, "load")?, source })
    }
}

impl Loads {
    /// Name in files.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Centrifugal => "centrifugal",
            Self::Interfaces => "interfaces",
            Self::User(_) => "loads",
        }
    }

    /// The file that they were read from.
    pub fn source(&self) -> Option<&SourceFile> {
        match self {
            Self::User(loads) => loads.source.as_ref(),
            _ => None,
        }
    }

    /// Names and nodal forces.
    fn forces(&self, problem: &EigenProblem<'_>, model: &FeModel) -> Result<Vec<(String, Mat<f64>)>> {
        match self {
            Self::Centrifugal => Ok(centrifugal(problem, model)),
            Self::Interfaces => interfaces(model),
            Self::User(UserLoads { loads, .. }) => Ok((0..loads.ncols())
                .map(|j| (format!("load {}", j + 1), loads.as_ref().subcols(j, 1).to_owned()))
                .collect()),
        }
    }
}

fn centrifugal(problem: &EigenProblem<'_>, model: &FeModel) -> Vec<(String, Mat<f64>)> {
    let (mut loads, d) = (Vec::new(), model.dimension());
    // A plane body spins about z alone.
    let spins: &[(usize, usize)] =
        if d == 2 { &[(2, 2)] } else { &[(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)] };
    for &(k, l) in spins {
        // The acceleration w x (w x x) = (w w' - w'w I) x. Where its origin lies makes a rigid motion of difference.
        let mut outward = Mat::zeros(problem.pencil.n(), 1);
        for (i, x) in model.nodes().positions.iter().enumerate() {
            let mut add = |component: usize, value: f64| outward[(d * i + component, 0)] += value;
            if k == l {
                (0..d).filter(|&c| c != k).for_each(|c| add(c, x[c]));
            } else {
                add(k, -x[l]);
                add(l, -x[k]);
            }
        }
        let load = problem.pencil.apply_mass(outward.as_ref());
        loads.push((format!("centrifugal {}{}", AXES[k], AXES[l]), load));
    }
    loads
}

/// The load on each coordinate of every interface.
fn interfaces(model: &FeModel) -> Result<Vec<(String, Mat<f64>)>> {
    let joints = joints(model, "interface loads")?;
    let one = |joint: &Joint, j: usize| {
        let mut load = Mat::zeros(model.pencil().n(), 1);
        joint.scatter(joint.measure().subcols(j, 1), &mut load, 0);
        (format!("{} {}", joint.name, joint.loads[j]), load)
    };
    Ok(joints.iter().flat_map(|joint| (0..joint.loads.len()).map(move |j| one(joint, j))).collect())
}

/// All loads side by side.
pub(super) struct NamedLoads {
    /// What a static response is called.
    what: String,
    names: Vec<String>,
    /// N x m.
    forces: Mat<f64>,
}

impl NamedLoads {
    /// The loads of a model.
    ///
    /// # Errors
    /// [`InterfaceNode`](Code::InterfaceNode) without interfaces, [`Usage`](Code::Usage) at accuracy `certified`: residual vectors have no
    /// guaranteed bounds.
    pub fn new(
        problem: &EigenProblem<'_>,
        model: &FeModel,
        loads: &[Loads],
        what: &str,
        settings: &ModeSettings,
    ) -> Result<Self> {
        if settings.accuracy == Accuracy::Certified {
            let message = format!("{what}s are no eigenvectors and cannot be certified");
            return Err(Diagnostic::new(Code::Usage, message).with_help("use --accuracy standard").into());
        }
        let named = loads.iter().map(|loads| loads.forces(problem, model)).collect::<Result<Vec<_>>>()?;
        let (names, forces): (Vec<String>, Vec<Mat<f64>>) = named.into_iter().flatten().unzip();
        let forces: Vec<_> = forces.iter().map(Mat::as_ref).collect();
        Ok(Self { what: what.to_owned(), names, forces: side_by_side(&forces) })
    }
}

/// Adds the static responses to `loads` to free-surface modes: M-orthonormalised against them and among each other, Ritz
/// vectors of the span. What they add nothing to is left out and said.
pub(super) fn with_residual_vectors(
    model: &FeModel,
    problem: &EigenProblem<'_>,
    free: ModalBasis,
    loads: &NamedLoads,
    settings: &ModeSettings,
    watch: Watch<'_>,
) -> Result<ModalBasis> {
    let NamedLoads { what, names, forces } = loads;
    watch(Event::Phase(&format!("{what}s")));
    let failed = |failure: EigenFailure| explain(model, failure);
    let pencil = &problem.pencil;
    let modes = &free.solution.vectors;
    let lambda = &free.solution.eigenvalues;
    let mut counters = free.solution.counters;
    let precision = free.solution.plan.map_or(Precision::Double, |plan| plan.precision);
    let responses =
        static_responses(problem, modes.as_ref(), forces.clone(), lambda[0], precision, &mut counters)
            .map_err(failed)?;
    // K^+ f = Psi Lambda^-1 Psi'f + what the modes do not have.
    let modal = gram(modes.as_ref(), forces.as_ref());
    let amplitudes = Mat::from_fn(modal.nrows(), modal.ncols(), |p, j| modal[(p, j)] / lambda[p]);
    let mut whole = responses.clone();
    add_combination(whole.as_mut(), modes.as_ref(), amplitudes.as_ref());
    let energy = column_products(whole.as_ref(), pencil.apply_stiffness(whole.as_ref()).as_ref());
    let mass = column_products(whole.as_ref(), pencil.apply_mass(whole.as_ref()).as_ref());
    let left = column_products(responses.as_ref(), pencil.apply_mass(responses.as_ref()).as_ref());
    let missed = column_products(responses.as_ref(), pencil.apply_stiffness(responses.as_ref()).as_ref());
    let equilibrated = {
        let resultants = gram(problem.rigid, forces.as_ref());
        forces - pencil.apply_mass(problem.rigid) * resultants
    };
    let deforms = |j: usize| {
        equilibrated.col(j).norm_l2() > SELF_EQUILIBRATED * forces.col(j).norm_l2() && energy[j] > 0.0
    };
    let error = |part: f64, j: usize| if deforms(j) { (part.max(0.0) / energy[j]).sqrt() } else { 0.0 };

    let mut dropped: Vec<String> = Vec::new();
    let mut used = Vec::new();
    for (j, name) in names.iter().enumerate() {
        if !deforms(j) {
            dropped.push(format!("{name} (deforms nothing)"));
        } else if left[j].max(0.0).sqrt() < LEFT * mass[j].sqrt() {
            dropped.push(format!("{name} ({:.0e})", (left[j].max(0.0) / mass[j]).sqrt()));
        } else {
            used.push(j);
        }
    }
    let candidates = Mat::from_fn(responses.nrows(), used.len(), |i, j| responses[(i, used[j])]);
    let known = side_by_side(&[problem.rigid, modes.as_ref()]);
    let found = independent(pencil, known.as_ref(), candidates, LEFT)
        .ok_or_else(|| failed(EigenFailure::MassIndefinite))?;
    dropped.extend(found.dependent.iter().map(|&(j, left)| format!("{} ({left:.0e})", names[used[j]])));
    dropped.extend(found.massless.iter().map(|&j| format!("{} (moves no mass)", names[used[j]])));
    dropped.extend(found.rigid.iter().map(|&j| format!("{} (below 1e-5)", names[used[j]])));

    let span = side_by_side(&[modes.as_ref(), found.vectors.as_ref()]);
    let all = ModeSettings { wanted: Wanted::Lowest(usize::MAX), accuracy: Accuracy::Fast, ..*settings };
    let ritz = modes_of_span(problem, span.clone(), &all, watch).map_err(failed)?;
    let parts = gram(span.as_ref(), pencil.apply_mass(ritz.vectors.as_ref()).as_ref());
    let count = lambda.len();
    let provenance = (0..ritz.eigenvalues.len())
        .map(|p| {
            let share = |c: usize| parts[(c, p)].powi(2);
            if (0..count).map(share).sum::<f64>() > 0.5 {
                return "free mode".to_owned();
            }
            let largest = (count..span.ncols()).max_by(|&a, &b| share(a).total_cmp(&share(b)));
            let largest = largest.expect("the span is more than the free modes");
            let name = &names[used[found.kept[largest - count]]];
            format!("{what}: {:.0} % {name}", 100.0 * share(largest))
        })
        .collect();

    let modal = gram(ritz.vectors.as_ref(), forces.as_ref());
    let amplitudes = Mat::from_fn(modal.nrows(), modal.ncols(), |p, j| -modal[(p, j)] / ritz.eigenvalues[p]);
    let mut rest = whole;
    add_combination(rest.as_mut(), ritz.vectors.as_ref(), amplitudes.as_ref());
    let rest = column_products(rest.as_ref(), pencil.apply_stiffness(rest.as_ref()).as_ref());
    let truncation = names.iter().enumerate().map(|(j, name)| Truncation {
        load: name.clone(),
        before: error(missed[j], j),
        after: error(rest[j], j),
    });
    let truncation = truncation.collect();

    let mut notes = free.diagnostics;
    if !dropped.is_empty() {
        let message = format!(
            "{} of {} {what}s are left out, they add less than {LEFT:.0e} of their M-norm: {}",
            dropped.len(),
            names.len(),
            dropped.join(", ")
        );
        notes.push(Diagnostic::new(Code::LoadsCovered, message));
    }
    counters.stiffness_columns += ritz.counters.stiffness_columns;
    counters.mass_columns += ritz.counters.mass_columns;
    // What was proved of the free modes stays: the Ritz values of the others lie above the next eigenvalue.
    let solution = EigenSolution {
        eigenvalues: ritz.eigenvalues,
        vectors: ritz.vectors,
        residuals: ritz.residuals,
        rounding_floors: ritz.rounding_floors,
        counters,
        ..free.solution
    };
    let mut basis = ModalBasis::new(model, problem, settings, solution, "")?;
    (basis.provenance, basis.truncation, basis.diagnostics) = (provenance, truncation, notes);
    Ok(basis)
}
