//! Residual vectors: static responses K^+ f that a basis cut off by frequency does not have (theory section 8).

use super::columns::columns;
use super::failure::explain;
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
use nalgebra::{Matrix3, Vector3};
use std::collections::HashSet;

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
    /// Unit force and unit torque along every model axis at every interface, distributed over its nodes as a rigid
    /// motion of these would be (averaging coupling).
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
    fn forces(&self, problem: &EigenProblem<'_>, model: &FeModel) -> Vec<(String, Mat<f64>)> {
        match self {
            Self::Centrifugal => centrifugal(problem, model),
            Self::Interfaces => interfaces(model),
            Self::User(UserLoads { loads, .. }) => (0..loads.ncols())
                .map(|j| (format!("load {}", j + 1), loads.as_ref().subcols(j, 1).to_owned()))
                .collect(),
        }
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];

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

fn interfaces(model: &FeModel) -> Vec<(String, Mat<f64>)> {
    let (nodes, d) = (model.nodes(), model.dimension());
    let mut loads = Vec::new();
    for set in model.interfaces() {
        let members: HashSet<i64> = set.nodes.iter().copied().collect();
        let places: Vec<usize> = (0..nodes.len()).filter(|&i| members.contains(&nodes.ids[i])).collect();
        let count = places.len() as f64;
        let at = |i: usize| Vector3::from(nodes.positions[i]);
        let centre = places.iter().map(|&i| at(i)).sum::<Vector3<f64>>() / count;
        let arms: Vec<Vector3<f64>> = places.iter().map(|&i| at(i) - centre).collect();
        let inertia: Matrix3<f64> =
            arms.iter().map(|r| Matrix3::identity() * r.norm_squared() - r * r.transpose()).sum();
        // Nodes on one line transmit no torque about it, a single node none at all.
        let inverse = inertia.pseudo_inverse(1e-12 * inertia.trace()).unwrap_or_else(|_| Matrix3::zeros());
        let mut push = |kind: &str, axis: usize, force: &dyn Fn(usize) -> Vector3<f64>| {
            let mut load = Mat::zeros(d * nodes.len(), 1);
            for (place, &i) in places.iter().enumerate() {
                let force = force(place);
                (0..d).for_each(|k| load[(d * i + k, 0)] = force[k]);
            }
            loads.push((format!("{} {kind} {}", set.name, AXES[axis]), load));
        };
        for axis in 0..d {
            push("force", axis, &|_| Vector3::ith(axis, 1.0 / count));
        }
        for axis in if d == 2 { 2..3 } else { 0..3 } {
            let turn = inverse * Vector3::ith(axis, 1.0);
            push("torque", axis, &|place| turn.cross(&arms[place]));
        }
    }
    loads
}

/// All loads side by side.
pub(super) struct NamedLoads {
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
        settings: &ModeSettings,
    ) -> Result<Self> {
        if settings.accuracy == Accuracy::Certified {
            let message = "residual vectors are no eigenvectors and cannot be certified";
            return Err(Diagnostic::new(Code::Usage, message).with_help("use --accuracy standard").into());
        }
        if loads.contains(&Loads::Interfaces) && model.interfaces().is_empty() {
            let message = "the model has no interfaces, so there are no interface loads";
            return Err(Diagnostic::new(Code::InterfaceNode, message)
                .with_help("name node sets as [[interface]] in the manifest")
                .into());
        }
        let (names, forces): (Vec<String>, Vec<Mat<f64>>) =
            loads.iter().flat_map(|loads| loads.forces(problem, model)).unzip();
        let forces: Vec<_> = forces.iter().map(Mat::as_ref).collect();
        Ok(Self { names, forces: side_by_side(&forces) })
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
    let NamedLoads { names, forces } = loads;
    watch(Event::Phase("residual vectors"));
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
            format!("residual vector: {:.0} % {name}", 100.0 * share(largest))
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
            "{} of {} residual vectors are left out, they add less than {LEFT:.0e} of their M-norm: {}",
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
