//! Residual vectors: static responses K^+ f, or responses at chosen frequencies, without the contribution
//! of the modes of a truncated basis (theory section 8).

use super::coupled_model::CoupledModel;
use super::failure::explain;
use super::imported::{Given, columns};
use super::interface_rows::{AXES, CoupledInterface, coupled_interfaces};
use super::massless::on_mass;
use super::modal_basis::{ModalBasis, problem_of_span, rigid_modes};
use super::pseudo_free_surface::{independent, norm_in_words};
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
use flexbody_linalg::ties::first_largest;
use flexbody_linalg::{add_combination, column_products, gram, side_by_side};
use flexbody_model::{Coupling, FeModel, InertialRows, NodeSet, RawShapes};
use nalgebra::Vector3;

/// Smallest relative M-norm that a response must keep after projection against the modes and the residual
/// vectors before it. Responses below this limit are dropped. A larger value drops more loads; a smaller
/// value admits vectors that consist of rounding errors.
const MIN_RESPONSE_REMAINDER: f64 = 1e-8;

/// Smallest norm of a self-equilibrated load relative to the norm of the load. A load below this limit
/// moves the body only as a rigid body and needs no residual vector.
const MIN_SELF_EQUILIBRATED_NORM: f64 = 1e-10;

/// Returns the static responses K^+ f to all columns of `loads` (N x m), made self-equilibrated by inertia
/// relief. The accuracy is that of an estimate ([`ResponseAccuracy::ROUGH`]).
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

/// Returns the responses of [`free_static_responses`] and the responses to a second set of loads. `further`
/// is called once with the first responses (N x m) and returns the second loads.
///
/// # Errors
/// The errors of [`free_static_responses`].
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

/// Returns the static responses G F to all columns of `loads` (N x m), made self-equilibrated by inertia relief. Interfaces
/// that the couplings of `model` keep rigid move as rigid bodies.
///
/// * `first`: about the first flexible eigenvalue.
///
/// # Errors
/// Failures of the factorisation, and responses that are not accurate: exit code 3.
pub(crate) fn coupled_static_responses(
    model: &CoupledModel<'_>,
    loads: Mat<f64>,
    first: f64,
    accuracy: ResponseAccuracy,
    context: &Context<'_>,
) -> Result<Mat<f64>> {
    let rigid = model.rigid_modes()?;
    let problem = model.problem(rigid.as_ref());
    let loads = model.restrict(loads);
    let nothing = Mat::zeros(loads.nrows(), 0);
    let precision = Precision::Double;
    let found = static_responses(&problem, nothing.as_ref(), loads, first, precision, accuracy, context);
    let responses = found.map_err(|failure| explain(model.model(), failure))?;
    Ok(model.expand(&responses).into_owned())
}

/// Returns the nodal forces (N x 6, of a plane model N x 3) of unit forces and unit torques along the model
/// axes at the reference point of the interface `name`. The transpose of the matrix maps displacements to
/// the motion of that point. Returns `None` if the model has no such interface, or the interface has no
/// reference point.
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

/// Loads whose responses become residual vectors of the basis.
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
    /// Forces that a motion of the reduced body leaves unbalanced at the nodes (N x m).
    Motion(Mat<f64>),
    /// Responses (K - w^2 M)^-1 f to harmonic loads instead of static responses. With these in the basis,
    /// the transfer functions between the loads and their slopes agree with the model at w (moments of
    /// rational Krylov spaces; Grimme, Krylov projection methods for model reduction, 1997).
    At {
        /// Load amplitudes.
        loads: Box<Loads>,
        /// Excitation frequency w / 2 pi in hertz, positive. Must not be a natural frequency.
        hertz: f64,
    },
}

/// Nodal forces in the order of the degrees of freedom of a model, one load per column.
#[derive(Debug, Clone, PartialEq)]
pub struct UserLoads {
    loads: Mat<f64>,
    source: Option<SourceFile>,
}

impl UserLoads {
    /// Creates loads for `model` from forces on its matrix rows.
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

    /// Returns the excitation frequency in hertz; zero for static loads.
    fn hertz(&self) -> f64 {
        match self {
            Self::At { hertz, .. } => *hertz,
            _ => 0.0,
        }
    }

    /// Returns the file that the loads were read from, if any.
    pub fn source(&self) -> Option<&SourceFile> {
        match self {
            Self::User(loads) => loads.source.as_ref(),
            Self::At { loads, .. } => loads.source(),
            _ => None,
        }
    }

    /// Returns the names of the loads and their nodal forces, one matrix per group of loads.
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

/// Returns the columns of `loads`, each named by its number.
fn numbered(what: &str, loads: &Mat<f64>) -> Vec<(String, Mat<f64>)> {
    let one = |j: usize| (format!("{what} {}", j + 1), loads.as_ref().subcols(j, 1).to_owned());
    (0..loads.ncols()).map(one).collect()
}

/// Returns the six centrifugal loads of [`Loads::Centrifugal`], in the plane one, as nodal forces (N x 1 each), in the
/// order of [`LoadKind::SPIN`](flexbody_model::LoadKind::SPIN).
pub(crate) fn centrifugal_loads(model: &FeModel) -> Vec<Mat<f64>> {
    centrifugal(model).into_iter().map(|(_, load)| load).collect()
}

fn centrifugal(model: &FeModel) -> Vec<(String, Mat<f64>)> {
    let d = model.dimension();
    let rows = InertialRows::new(model, model.centre_of_mass());
    let turning = rows.rigid();
    let momenta = rows.weigh(turning.as_ref().subcols(d, turning.ncols() - d));
    // A plane body spins about z only.
    let spins: &[(usize, usize)] =
        if d == 2 { &[(2, 2)] } else { &[(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)] };
    let load = |&(k, l): &(usize, usize)| {
        let mut load = Mat::zeros(momenta.nrows(), 1);
        // -e_k x (M B_x e_l) for every vector that turns with the body, summed over both orders of k and l.
        for (k, l) in if k == l { vec![(k, l)] } else { vec![(k, l), (l, k)] } {
            let momentum = momenta.as_ref().subcols(if d == 2 { 0 } else { l }, 1).to_owned();
            rows.add_turned(|_| -Vector3::ith(k, 1.0), &momentum, &mut load);
        }
        (format!("centrifugal {}{}", AXES[k], AXES[l]), rows.restrict(load))
    };
    spins.iter().map(load).collect()
}

/// Returns a unit load on each coordinate of every interface.
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
    /// Name of the kind of static response in messages.
    what: String,
    names: Vec<String>,
    /// Nodal forces (N x m).
    forces: Mat<f64>,
    /// Excitation frequency of every load in hertz, and its square w^2 as an eigenvalue; both zero for
    /// static loads.
    frequencies: Vec<(f64, f64)>,
}

impl NamedLoads {
    /// Collects the loads of a model.
    ///
    /// # Errors
    /// [`InterfaceNode`](Code::InterfaceNode) without interfaces, [`Usage`](Code::Usage) at accuracy
    /// `certified`: residual vectors have no guaranteed bounds.
    pub(super) fn new(model: &FeModel, loads: &[Loads], what: &str, settings: &ModeSettings) -> Result<Self> {
        if settings.accuracy == Accuracy::Certified {
            let message = format!("{what}s are not eigenvectors and cannot be certified");
            return Err(Diagnostic::new(Code::Usage, message).with_help("use --accuracy standard").into());
        }
        Self::of(model, loads, what)
    }

    /// Collects the loads of a model without a check of the requested accuracy of the modes.
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

    /// Returns each distinct frequency with the indices of its loads.
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

/// Adds the responses to `loads` to free-surface modes: M-orthonormalises them against the modes and
/// against each other and returns the Ritz vectors of the span. Loads whose responses add nothing are
/// dropped and reported in a diagnostic.
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
    // The proofs about the free modes stay valid: the Ritz values of the other modes lie above the next
    // eigenvalue.
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

/// Returns, for the static response to every load at an interface, the part outside the span of the `free`
/// modes. The list is empty without interfaces, and if the responses do not fit the memory: they need a
/// factor of K - sigma M.
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
        let without_counter = context.without_counter();
        let beside = beside_modes(model, &problem, free, &loads, ResponseAccuracy::ROUGH, &without_counter)?;
        Ok(Responses::new(&problem, free, &loads, beside).truncations())
    };
    found().unwrap_or_default()
}

/// Returns true if the responses to all loads at interfaces fit the memory beside a factor of the size that
/// the modal search used.
fn responses_fit(model: &FeModel, free: &EigenSolution, context: &Context<'_>) -> bool {
    /// Number of blocks of all loads held at once: forces, responses, and their products with K and M.
    const LOAD_BLOCKS: usize = 5;
    let loads = |set: &NodeSet| if set.coupling() == Coupling::Free { 3 * set.nodes.len() } else { 6 };
    let columns: usize = model.interfaces().iter().map(loads).sum();
    let bytes = (LOAD_BLOCKS * columns * free.vectors.nrows() * size_of::<f64>()) as u64;
    let factor = free.plan.as_ref().map_or(0, Plan::bytes);
    bytes.saturating_add(factor) <= context.available()
}

/// Returns the parts of the responses to `loads` that lie outside the span of the free modes (N x m).
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
        // Loads of one frequency are solved together.
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

/// Returns the error for a failed response at a frequency.
fn no_response(model: &FeModel, hertz: f64, failure: EigenFailure) -> Error {
    let EigenFailure::Inaccurate { residual } = failure else { return explain(model, failure) };
    let message =
        format!("the responses at {hertz} Hz are found with a relative residual of {residual:.1e} only");
    Diagnostic::new(Code::FactorizationFailed, message)
        .with_help("name another frequency: a natural frequency beyond the modes may be too near")
        .into()
}

/// Responses to loads and their parts outside the free modes.
struct Responses<'a> {
    loads: &'a NamedLoads,
    /// Part of K^+ f, or at a frequency of (K - w^2 M)^-1 f, outside the span of the modes (N x m).
    beside: Mat<f64>,
    /// Whole response: `beside` plus the modal part of K^+ f (N x m).
    whole: Mat<f64>,
    /// Squared norms of the whole responses and of `beside` in K and in M.
    energy: Vec<f64>,
    mass: Vec<f64>,
    energy_beside: Vec<f64>,
    mass_beside: Vec<f64>,
    /// True for each load that deforms the body.
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
        // K^+ f = Psi Lambda^-1 Psi'f + the part outside the modes.
        let modal = gram(modes, forces.as_ref());
        let amplitudes = Mat::from_fn(modal.nrows(), modal.ncols(), |p, j| modal[(p, j)] / lambda[p]);
        let mut whole = beside.clone();
        add_combination(whole.as_mut(), modes, amplitudes.as_ref());
        let in_stiffness =
            |x: &Mat<f64>| column_products(x.as_ref(), pencil.apply_stiffness(x.as_ref()).as_ref());
        let in_mass = |x: &Mat<f64>| column_products(x.as_ref(), pencil.apply_mass(x.as_ref()).as_ref());
        // Energies of the whole responses and of their parts outside the modes.
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

    /// Returns the parts outside the modes, M-orthonormalised against the modes. Returns `None` if M is
    /// indefinite.
    fn added(&self, problem: &EigenProblem<'_>, modes: MatRef<'_, f64>) -> Option<Added> {
        let names = &self.loads.names;
        let mut dropped: Vec<String> = Vec::new();
        let mut used = Vec::new();
        // Drop loads that deform nothing, and responses that the modes already contain.
        for (j, name) in names.iter().enumerate() {
            let left = self.mass_beside[j].max(0.0);
            if !self.deforms[j] {
                dropped.push(format!("{name} (deforms nothing)"));
            } else if left.sqrt() < MIN_RESPONSE_REMAINDER * self.mass[j].sqrt() {
                dropped.push(format!("{name} ({})", norm_in_words((left / self.mass[j]).sqrt())));
            } else {
                used.push(j);
            }
        }
        // M-orthonormalise the others against rigid motions, modes and each other.
        let candidates = Mat::from_fn(self.beside.nrows(), used.len(), |i, j| self.beside[(i, used[j])]);
        let known = side_by_side(&[problem.rigid, modes]);
        let found = independent(&problem.pencil, known.as_ref(), candidates, MIN_RESPONSE_REMAINDER, None)?;
        let name = |j: usize| &names[used[j]];
        dropped.extend(
            found.dependent.iter().map(|&(j, left)| format!("{} ({})", name(j), norm_in_words(left))),
        );
        dropped.extend(found.massless.iter().map(|&j| format!("{} (moves no mass)", name(j))));
        dropped.extend(found.rigid.iter().map(|&j| format!("{} (below 1e-5)", name(j))));
        // The load of each vector.
        let retained = found.retained.iter().map(|&j| used[j]).collect();
        Some(Added { vectors: found.vectors, retained, dropped })
    }

    /// Returns the truncated part of each static response for the free modes alone.
    fn truncations(&self) -> Vec<Truncation> {
        let truncations = |(j, load): (usize, &String)| {
            let error = self.error(self.energy_beside[j], j);
            Truncation { load: load.clone(), before: error, after: error }
        };
        self.loads.names.iter().enumerate().map(truncations).collect()
    }

    /// Returns the K-norm of a part of the response `j`, given by its square, relative to the K-norm of the
    /// whole response.
    fn error(&self, part: f64, j: usize) -> f64 {
        if self.deforms[j] { (part.max(0.0) / self.energy[j]).sqrt() } else { 0.0 }
    }

    /// Returns the relative truncation error of each static response, for the free modes alone and for the
    /// modes of the extended span.
    fn truncation(mut self, problem: &EigenProblem<'_>, ritz: &EigenSolution) -> Vec<Truncation> {
        // Whole response minus its part in the extended span.
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

/// Returns, for every load, true if the load does more than move the body as a rigid body.
fn deforming(problem: &EigenProblem<'_>, forces: &Mat<f64>, energy: &[f64]) -> Vec<bool> {
    // Loads in equilibrium with the inertia forces of rigid motion.
    let resultants = gram(problem.rigid, forces.as_ref());
    let equilibrated = forces - problem.pencil.apply_mass(problem.rigid) * resultants;
    let deforms = |j: usize| {
        equilibrated.col(j).norm_l2() > MIN_SELF_EQUILIBRATED_NORM * forces.col(j).norm_l2()
            && energy[j] > 0.0
    };
    (0..forces.ncols()).map(deforms).collect()
}

/// Responses that are added to the free modes.
struct Added {
    /// M-orthonormal, M-orthogonal to rigid motions and free modes.
    vectors: Mat<f64>,
    /// Index of the load of each vector.
    retained: Vec<usize>,
    /// Names of the dropped loads, each with the reason.
    dropped: Vec<String>,
}

impl Added {
    /// Returns the origin of each mode: a free mode, or mostly the response to a load. `parts` (span x
    /// modes) holds the products of the modes with the vectors of the span, the first `free` of which are
    /// free modes.
    fn provenance(&self, loads: &NamedLoads, parts: MatRef<'_, f64>, free: usize) -> Vec<String> {
        let origin = |p: usize| {
            let share = |c: usize| parts[(c, p)].powi(2);
            if (0..free).map(share).sum::<f64>() > 0.5 {
                return super::FREE_MODE.to_owned();
            }
            let largest = first_largest(free..parts.nrows(), |&c| share(c));
            let largest = largest.expect("the span is more than the free modes");
            let name = &loads.names[self.retained[largest - free]];
            format!("{}: {:.0} % {name}", loads.what, 100.0 * share(largest))
        };
        (0..parts.ncols()).map(origin).collect()
    }

    /// Returns a diagnostic that lists the dropped loads, if there are any.
    fn note(&self, loads: &NamedLoads) -> Option<Diagnostic> {
        let NamedLoads { what, names, .. } = loads;
        let dropped = &self.dropped;
        (!dropped.is_empty()).then(|| {
            let message = format!(
                "{} of {} {what}s are left out since they add less than {MIN_RESPONSE_REMAINDER:.0e} of their M-norm: {}",
                dropped.len(),
                names.len(),
                dropped.join(", ")
            );
            Diagnostic::new(Code::LoadsCovered, message)
        })
    }
}
