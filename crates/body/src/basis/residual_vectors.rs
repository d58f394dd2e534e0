//! Residual vectors: static responses K^+ f that a basis cut off by frequency does not have, and those at
//! chosen frequencies (theory section 8).

use super::columns::{Given, columns};
use super::coupled_model::CoupledModel;
use super::failure::explain;
use super::interface_rows::{AXES, CoupledInterface, coupled_interfaces};
use super::massless::on_mass;
use super::modal_basis::{ModalBasis, problem_of_span};
use super::pseudo_free_surface::{independent, part_in_words};
use super::rigid_modes::rigid_modes;
use super::{ModeSettings, Truncation};
use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::provenance::SourceFile;
use flexbody_eigen::{
    Accuracy, EigenFailure, EigenProblem, EigenSolution, Plan, Precision, ResponseAccuracy, Wanted, Way,
    dynamic_responses, modes_of_span, static_responses, static_responses_twice,
};
use flexbody_linalg::context::Context;
use flexbody_linalg::{add_combination, column_products, gram, side_by_side};
use flexbody_model::{Coupling, FeModel, InertialRows, NodeSet, RawShapes};
use nalgebra::Vector3;

/// Part of the M-norm of a response that must be left beside the modes and the vectors before it.
const LEFT: f64 = 1e-8;

/// Part of a load that must be left without its resultants: what moves the body only as a whole needs no
/// mode.
const SELF_EQUILIBRATED: f64 = 1e-10;

/// K^+ f of every column of `loads` (N x m), which are made self-equilibrated by inertia relief; to some
/// digits, for estimates.
///
/// * `first`: about the first flexible eigenvalue.
///
/// # Errors
/// Failures of the factorisation, and responses that are not accurate: exit code 3.
pub fn free_static_responses(model: &CoupledModel<'_>, loads: Mat<f64>, first: f64) -> Result<Mat<f64>> {
    let nothing = Mat::zeros(loads.nrows(), 0);
    let [responses, _] = free_static_responses_twice(model, loads, |_| nothing, first)?;
    Ok(responses)
}

/// The responses of [`free_static_responses`], and those to the loads that `further` returns for these.
///
/// # Errors
/// As [`free_static_responses`].
pub fn free_static_responses_twice(
    model: &CoupledModel<'_>,
    loads: Mat<f64>,
    further: impl FnOnce(&Mat<f64>) -> Mat<f64>,
    first: f64,
) -> Result<[Mat<f64>; 2]> {
    let rigid = model.rigid_modes()?;
    let problem = model.problem(rigid.as_ref());
    let (precision, accuracy) = (Precision::Double, ResponseAccuracy::ROUGH);
    let further = |x: &Mat<f64>| model.restrict(further(&model.expand(x)));
    let loads = model.restrict(loads);
    let found = static_responses_twice(&problem, loads, further, first, precision, accuracy, &Context::QUIET);
    let both = found.map_err(|failure| explain(model.model(), failure))?;
    Ok(both.map(|x| model.expand(&x).into_owned()))
}

/// Nodal forces (N x 6, in the plane N x 3) of unit forces and unit torques along the model axes at the
/// reference point of the interface `name`; which are also the weights that take the motion of that point
/// from the displacements. `None` where the model has no such interface, or it has no reference point.
///
/// # Errors
/// [`InterfaceNode`](Code::InterfaceNode).
pub fn interface_loads(model: &FeModel, name: &str) -> Result<Option<Mat<f64>>> {
    let joints = coupled_interfaces(model, "interface loads")?;
    let joint = joints.iter().find(|joint| joint.name == name && joint.coupling != Coupling::Free);
    Ok(joint.map(|joint| {
        let mut loads = Mat::zeros(model.pencil().n(), joint.loads.len());
        joint.scatter(joint.measure(), &mut loads, 0);
        loads
    }))
}

/// Loads whose static responses are to be in the basis.
#[derive(Debug, Clone, PartialEq)]
pub enum Loads {
    /// The six centrifugal loads that any constant angular velocity about the centre of mass is made of, f(w)
    /// = sum_kl w_k w_l f_kl: f_kl = -T_e'E (S_k S_l + S_l S_k) X_0, once for k = l, of points and directors
    /// (theory section 6). For M = Ms kron I3 f_kl = -Ms (e_k x (e_l x x) + e_l x (e_k x x)).
    Centrifugal,
    /// Unit force and unit torque along every model axis at the reference point of every interface,
    /// distributed over its nodes as a rigid motion of these would be (averaging coupling, also where another
    /// joins the nodes rigidly); unit forces at the nodes of a free interface.
    Interfaces,
    /// Nodal forces.
    User(UserLoads),
    /// What a motion leaves unbalanced at the nodes (N x m): the loads that a body lacks the responses to.
    Motion(Mat<f64>),
    /// The responses (K - w^2 M)^-1 f to loads that oscillate, instead of the static ones: with them the
    /// transfer functions between these loads are those of the model at w, and with the same slope there
    /// (moments of rational Krylov spaces; Grimme, Krylov projection methods for model reduction, 1997).
    At {
        /// The loads, at rest.
        loads: Box<Loads>,
        /// w / 2 pi, positive, in hertz; no natural frequency.
        hertz: f64,
    },
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
    /// Every error of [`ImportedShapes::new`](super::ImportedShapes::new); [`ShapesSize`](Code::ShapesSize) for a load
    /// on a row that has neither stiffness nor mass.
    pub fn new(model: &FeModel, raw: RawShapes) -> Result<Self> {
        let source = raw.source.clone();
        Ok(Self { loads: columns(model, raw, Given::Loads)?, source })
    }
}

impl Loads {
    /// Name in files.
    pub fn name(&self) -> String {
        match self {
            Self::Centrifugal => "centrifugal".to_owned(),
            Self::Interfaces => "interfaces".to_owned(),
            Self::User(_) => "loads".to_owned(),
            Self::Motion(_) => "motion".to_owned(),
            Self::At { loads, hertz } => format!("{}@{hertz}", loads.name()),
        }
    }

    /// Frequency at which they oscillate, in hertz; zero: at rest.
    fn hertz(&self) -> f64 {
        match self {
            Self::At { hertz, .. } => *hertz,
            _ => 0.0,
        }
    }

    /// The file that they were read from.
    pub fn source(&self) -> Option<&SourceFile> {
        match self {
            Self::User(loads) => loads.source.as_ref(),
            Self::At { loads, .. } => loads.source(),
            _ => None,
        }
    }

    /// Names and nodal forces.
    fn forces(&self, model: &FeModel) -> Result<Vec<(String, Mat<f64>)>> {
        match self {
            Self::Centrifugal => Ok(centrifugal(model)),
            Self::Interfaces => interfaces(model),
            Self::User(UserLoads { loads, .. }) => Ok(numbered("load", loads)),
            Self::Motion(loads) => Ok(numbered("motion", loads)),
            Self::At { loads, hertz } => {
                let at_rest = loads.forces(model)?;
                Ok(at_rest
                    .into_iter()
                    .map(|(name, force)| (format!("{name} at {hertz} Hz"), force))
                    .collect())
            }
        }
    }
}

/// The columns of `loads`, each with its number as its name.
fn numbered(what: &str, loads: &Mat<f64>) -> Vec<(String, Mat<f64>)> {
    let one = |j: usize| (format!("{what} {}", j + 1), loads.as_ref().subcols(j, 1).to_owned());
    (0..loads.ncols()).map(one).collect()
}

fn centrifugal(model: &FeModel) -> Vec<(String, Mat<f64>)> {
    let d = model.dimension();
    let rows = InertialRows::new(model, model.centre_of_mass());
    let turning = rows.rigid();
    let momenta = rows.weigh(turning.as_ref().subcols(d, turning.ncols() - d));
    // A plane body spins about z alone.
    let spins: &[(usize, usize)] =
        if d == 2 { &[(2, 2)] } else { &[(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)] };
    let load = |&(k, l): &(usize, usize)| {
        let mut load = Mat::zeros(momenta.nrows(), 1);
        // -e_k x (M B_x e_l) of every vector that turns.
        for (k, l) in if k == l { vec![(k, l)] } else { vec![(k, l), (l, k)] } {
            let momentum = momenta.as_ref().subcols(if d == 2 { 0 } else { l }, 1).to_owned();
            rows.add_turned(|_| -Vector3::ith(k, 1.0), &momentum, &mut load);
        }
        (format!("centrifugal {}{}", AXES[k], AXES[l]), rows.restrict(load))
    };
    spins.iter().map(load).collect()
}

/// The load on each coordinate of every interface.
fn interfaces(model: &FeModel) -> Result<Vec<(String, Mat<f64>)>> {
    let joints = coupled_interfaces(model, "interface loads")?;
    let one = |joint: &CoupledInterface, j: usize| {
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
    /// Of every load the frequency of its oscillation in hertz, and its square w^2 as an eigenvalue; zero: at
    /// rest.
    frequencies: Vec<(f64, f64)>,
}

impl NamedLoads {
    /// The loads of a model.
    ///
    /// # Errors
    /// [`InterfaceNode`](Code::InterfaceNode) without interfaces, [`Usage`](Code::Usage) at accuracy
    /// `certified`: residual vectors have no guaranteed bounds.
    pub(super) fn new(model: &FeModel, loads: &[Loads], what: &str, settings: &ModeSettings) -> Result<Self> {
        if settings.accuracy == Accuracy::Certified {
            let message = format!("{what}s are no eigenvectors and cannot be certified");
            return Err(Diagnostic::new(Code::Usage, message).with_help("use --accuracy standard").into());
        }
        Self::of(model, loads, what)
    }

    /// The loads of a model, whatever accuracy the modes have.
    ///
    /// # Errors
    /// [`InterfaceNode`](Code::InterfaceNode) without interfaces.
    fn of(model: &FeModel, loads: &[Loads], what: &str) -> Result<Self> {
        let (mut names, mut forces, mut frequencies) = (Vec::new(), Vec::new(), Vec::new());
        for loads in loads {
            let frequency = (loads.hertz(), model.units().eigenvalue_of(loads.hertz()));
            for (name, force) in loads.forces(model)? {
                names.push(name);
                forces.push(force);
                frequencies.push(frequency);
            }
        }
        let forces: Vec<_> = forces.iter().map(Mat::as_ref).collect();
        let forces = on_mass(model, side_by_side(&forces))?;
        Ok(Self { what: what.to_owned(), names, forces, frequencies })
    }

    /// The frequencies, each once, with the numbers of its loads.
    fn by_frequency(&self) -> Vec<((f64, f64), Vec<usize>)> {
        let mut groups: Vec<((f64, f64), Vec<usize>)> = Vec::new();
        for (j, frequency) in self.frequencies.iter().enumerate() {
            match groups.iter_mut().find(|(known, _)| known == frequency) {
                Some((_, columns)) => columns.push(j),
                None => groups.push((*frequency, vec![j])),
            }
        }
        groups
    }
}

/// Adds the static responses to `loads` to free-surface modes: M-orthonormalised against them and among each
/// other, Ritz vectors of the span. What they add nothing to is left out and said.
pub(super) fn with_residual_vectors(
    model: &FeModel,
    problem: &EigenProblem<'_>,
    free: ModalBasis,
    loads: &NamedLoads,
    settings: &ModeSettings,
    context: &Context<'_>,
) -> Result<ModalBasis> {
    context.phase(&format!("{}s", loads.what));
    let failed = |failure: EigenFailure| explain(model, failure);
    let modes = &free.solution.vectors;
    let beside = beside_modes(model, problem, &free.solution, loads, ResponseAccuracy::FULL, context)?;
    let responses = Responses::new(problem, &free.solution, loads, beside);
    let added =
        responses.added(problem, modes.as_ref()).ok_or_else(|| failed(EigenFailure::MassIndefinite))?;
    let span = side_by_side(&[modes.as_ref(), added.vectors.as_ref()]);
    let all = ModeSettings { wanted: Wanted::Lowest(usize::MAX), accuracy: Accuracy::Fast, ..*settings };
    let ritz = modes_of_span(problem, span.clone(), &all, context).map_err(failed)?;
    let parts = gram(span.as_ref(), problem.pencil.apply_mass(ritz.vectors.as_ref()).as_ref());
    let provenance = added.provenance(loads, parts.as_ref(), modes.ncols());
    let truncation = responses.truncation(problem, &ritz);
    let mut notes = free.diagnostics;
    notes.extend(added.note(loads));
    // What was proved of the free modes stays: the Ritz values of the others lie above the next eigenvalue.
    let solution = EigenSolution {
        eigenvalues: ritz.eigenvalues,
        vectors: ritz.vectors,
        residuals: ritz.residuals,
        rounding_floors: ritz.rounding_floors,
        ..free.solution
    };
    let mut basis = ModalBasis::new(model, problem, settings, solution, "")?;
    (basis.provenance, basis.truncation, basis.diagnostics) = (provenance, truncation, notes);
    Ok(basis)
}

/// Part of the static response to every load at an interface that the `free` modes lack. Empty without interfaces,
/// and if the responses cannot be computed in the memory that there is: they need a factor of K - sigma M.
pub(super) fn interface_truncation(
    model: &FeModel,
    free: &EigenSolution,
    context: &Context<'_>,
) -> Vec<Truncation> {
    let has_levels = free.plan.as_ref().is_some_and(|plan| plan.current().way == Way::Cycles);
    let unknown = has_levels || free.vectors.ncols() == 0 || !responses_fit(model, free, context);
    if model.interfaces().is_empty() || unknown {
        return Vec::new();
    }
    context.phase("compliance of the interfaces");
    let found = || -> Result<Vec<Truncation>> {
        let rigid = rigid_modes(model, &model.pencil())?;
        let problem = problem_of_span(model, rigid.as_ref());
        let loads = NamedLoads::of(model, &[Loads::Interfaces], "interface load")?;
        let uncounted = context.uncounted();
        let beside = beside_modes(model, &problem, free, &loads, ResponseAccuracy::ROUGH, &uncounted)?;
        Ok(Responses::new(&problem, free, &loads, beside).lacking())
    };
    found().unwrap_or_default()
}

/// True if the responses to all loads at interfaces fit the memory beside a factor like that of the search.
fn responses_fit(model: &FeModel, free: &EigenSolution, context: &Context<'_>) -> bool {
    /// Blocks of all loads that are held at once: forces, responses, and these times K and M.
    const BLOCKS: usize = 5;
    let loads = |set: &NodeSet| if set.coupling() == Coupling::Free { 3 * set.nodes.len() } else { 6 };
    let columns: usize = model.interfaces().iter().map(loads).sum();
    let bytes = (BLOCKS * columns * free.vectors.nrows() * size_of::<f64>()) as u64;
    let factor = free.plan.as_ref().map_or(0, Plan::bytes);
    bytes.saturating_add(factor) <= context.available()
}

/// What free modes do not have of the responses to loads (N x m).
fn beside_modes(
    model: &FeModel,
    problem: &EigenProblem<'_>,
    free: &EigenSolution,
    loads: &NamedLoads,
    accuracy: ResponseAccuracy,
    context: &Context<'_>,
) -> Result<Mat<f64>> {
    let (modes, first) = (free.vectors.as_ref(), free.eigenvalues[0]);
    let precision = free.plan.as_ref().map_or(Precision::Double, Plan::precision);
    let mut beside = Mat::zeros(loads.forces.nrows(), loads.forces.ncols());
    for ((hertz, square), columns) in loads.by_frequency() {
        let forces = Mat::from_fn(beside.nrows(), columns.len(), |i, c| loads.forces[(i, columns[c])]);
        let responses = if square == 0.0 {
            static_responses(problem, modes, forces, first, precision, accuracy, context)
                .map_err(|failure| explain(model, failure))?
        } else {
            dynamic_responses(problem, modes, forces, square, context)
                .map_err(|failure| no_response(model, hertz, failure))?
        };
        for (c, &j) in columns.iter().enumerate() {
            beside.col_mut(j).copy_from(responses.col(c));
        }
    }
    Ok(beside)
}

/// Why there is no response at a frequency.
fn no_response(model: &FeModel, hertz: f64, failure: EigenFailure) -> Error {
    let EigenFailure::Inaccurate { residual } = failure else { return explain(model, failure) };
    let message =
        format!("the responses at {hertz} Hz are found with a relative residual of {residual:.1e} only");
    Diagnostic::new(Code::FactorizationFailed, message)
        .with_help("a natural frequency beyond the modes may be too near: name another frequency")
        .into()
}

/// Responses to loads, and what free modes have of them.
struct Responses<'a> {
    loads: &'a NamedLoads,
    /// K^+ f, at a frequency (K - w^2 M)^-1 f, without what the modes have of it (N x m).
    beside: Mat<f64>,
    /// The same with what the modes have of K^+ f (N x m).
    whole: Mat<f64>,
    /// Squares of the norms of the whole responses in K and in M, and of what is beside the modes.
    energy: Vec<f64>,
    mass: Vec<f64>,
    energy_beside: Vec<f64>,
    mass_beside: Vec<f64>,
    /// Whether each load deforms the body.
    deforms: Vec<bool>,
}

impl<'a> Responses<'a> {
    fn new(
        problem: &EigenProblem<'_>,
        free: &EigenSolution,
        loads: &'a NamedLoads,
        beside: Mat<f64>,
    ) -> Self {
        let (pencil, forces) = (&problem.pencil, &loads.forces);
        let (modes, lambda) = (free.vectors.as_ref(), &free.eigenvalues);
        // K^+ f = Psi Lambda^-1 Psi'f + what the modes do not have.
        let modal = gram(modes, forces.as_ref());
        let amplitudes = Mat::from_fn(modal.nrows(), modal.ncols(), |p, j| modal[(p, j)] / lambda[p]);
        let mut whole = beside.clone();
        add_combination(whole.as_mut(), modes, amplitudes.as_ref());
        let in_stiffness =
            |x: &Mat<f64>| column_products(x.as_ref(), pencil.apply_stiffness(x.as_ref()).as_ref());
        let in_mass = |x: &Mat<f64>| column_products(x.as_ref(), pencil.apply_mass(x.as_ref()).as_ref());
        let energy = in_stiffness(&whole);
        let deforms = deforming(problem, forces, &energy);
        Self {
            loads,
            mass: in_mass(&whole),
            mass_beside: in_mass(&beside),
            energy_beside: in_stiffness(&beside),
            beside,
            whole,
            energy,
            deforms,
        }
    }

    /// What the modes lack, M-orthonormalised against them; `None` when M is indefinite.
    fn added(&self, problem: &EigenProblem<'_>, modes: MatRef<'_, f64>) -> Option<Added> {
        let names = &self.loads.names;
        let mut dropped: Vec<String> = Vec::new();
        let mut used = Vec::new();
        for (j, name) in names.iter().enumerate() {
            let left = self.mass_beside[j].max(0.0);
            if !self.deforms[j] {
                dropped.push(format!("{name} (deforms nothing)"));
            } else if left.sqrt() < LEFT * self.mass[j].sqrt() {
                dropped.push(format!("{name} ({})", part_in_words((left / self.mass[j]).sqrt())));
            } else {
                used.push(j);
            }
        }
        let candidates = Mat::from_fn(self.beside.nrows(), used.len(), |i, j| self.beside[(i, used[j])]);
        let known = side_by_side(&[problem.rigid, modes]);
        let found = independent(&problem.pencil, known.as_ref(), candidates, LEFT)?;
        let name = |j: usize| &names[used[j]];
        dropped.extend(
            found.dependent.iter().map(|&(j, left)| format!("{} ({})", name(j), part_in_words(left))),
        );
        dropped.extend(found.massless.iter().map(|&j| format!("{} (moves no mass)", name(j))));
        dropped.extend(found.rigid.iter().map(|&j| format!("{} (below 1e-5)", name(j))));
        let kept = found.kept.iter().map(|&j| used[j]).collect();
        Some(Added { vectors: found.vectors, kept, dropped })
    }

    /// Returns the part of each static response that the free modes alone lack.
    fn lacking(&self) -> Vec<Truncation> {
        let lacking = |(j, load): (usize, &String)| {
            let error = self.error(self.energy_beside[j], j);
            Truncation { load: load.clone(), before: error, after: error }
        };
        self.loads.names.iter().enumerate().map(lacking).collect()
    }

    /// Norm in K of a part of the response `j`, given by its square, relative to that of the whole response.
    fn error(&self, part: f64, j: usize) -> f64 {
        if self.deforms[j] { (part.max(0.0) / self.energy[j]).sqrt() } else { 0.0 }
    }

    /// What the free modes lack of each static response, and what the modes of the whole span do.
    fn truncation(mut self, problem: &EigenProblem<'_>, ritz: &EigenSolution) -> Vec<Truncation> {
        let modal = gram(ritz.vectors.as_ref(), self.loads.forces.as_ref());
        let amplitudes =
            Mat::from_fn(modal.nrows(), modal.ncols(), |p, j| -modal[(p, j)] / ritz.eigenvalues[p]);
        let mut rest = std::mem::replace(&mut self.whole, Mat::new());
        add_combination(rest.as_mut(), ritz.vectors.as_ref(), amplitudes.as_ref());
        let rest = column_products(rest.as_ref(), problem.pencil.apply_stiffness(rest.as_ref()).as_ref());
        let truncation = |(j, name): (usize, &String)| Truncation {
            load: name.clone(),
            before: self.error(self.energy_beside[j], j),
            after: self.error(rest[j], j),
        };
        let is_static = |(j, _): &(usize, &String)| self.loads.frequencies[*j].1 == 0.0;
        self.loads.names.iter().enumerate().filter(is_static).map(truncation).collect()
    }
}

/// Which loads do more than move the body as a whole.
fn deforming(problem: &EigenProblem<'_>, forces: &Mat<f64>, energy: &[f64]) -> Vec<bool> {
    let resultants = gram(problem.rigid, forces.as_ref());
    let equilibrated = forces - problem.pencil.apply_mass(problem.rigid) * resultants;
    let deforms = |j: usize| {
        equilibrated.col(j).norm_l2() > SELF_EQUILIBRATED * forces.col(j).norm_l2() && energy[j] > 0.0
    };
    (0..forces.ncols()).map(deforms).collect()
}

/// The responses that join the free modes.
struct Added {
    /// M-orthonormal, M-orthogonal to rigid motions and free modes.
    vectors: Mat<f64>,
    /// The load that each of them came from.
    kept: Vec<usize>,
    /// Names of the other loads, each with the reason.
    dropped: Vec<String>,
}

impl Added {
    /// What each mode is made of: a free mode, or mostly the response to a load. `parts` (span x modes) are
    /// the products of the modes with the vectors of the span, `free` of which are free modes.
    fn provenance(&self, loads: &NamedLoads, parts: MatRef<'_, f64>, free: usize) -> Vec<String> {
        let origin = |p: usize| {
            let share = |c: usize| parts[(c, p)].powi(2);
            if (0..free).map(share).sum::<f64>() > 0.5 {
                return "free mode".to_owned();
            }
            let largest = (free..parts.nrows()).max_by(|&a, &b| share(a).total_cmp(&share(b)));
            let largest = largest.expect("the span is more than the free modes");
            let name = &loads.names[self.kept[largest - free]];
            format!("{}: {:.0} % {name}", loads.what, 100.0 * share(largest))
        };
        (0..parts.ncols()).map(origin).collect()
    }

    /// What the user should know of the loads that are left out.
    fn note(&self, loads: &NamedLoads) -> Option<Diagnostic> {
        let NamedLoads { what, names, .. } = loads;
        let dropped = &self.dropped;
        (!dropped.is_empty()).then(|| {
            let message = format!(
                "{} of {} {what}s are left out, they add less than {LEFT:.0e} of their M-norm: {}",
                dropped.len(),
                names.len(),
                dropped.join(", ")
            );
            Diagnostic::new(Code::LoadsCovered, message)
        })
    }
}
