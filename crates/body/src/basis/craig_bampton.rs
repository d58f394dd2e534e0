//! Craig-Bampton basis: modes with the interfaces held, and static shapes for unit motions of the interfaces
//! (Craig and Bampton, AIAA J. 6 (1968) 1313; theory section 5), turned into pseudo-free-surface modes.
//!
//! All couplings become one transformation, u = D q + T y: D q moves the nodes of the interfaces as rigid
//! bodies with the interface coordinates q, and T y leaves q zero. A node of a rigid or free interface has
//! no y. At an averaging interface all degrees of freedom are free except as many as it has coordinates,
//! which the mean determines. The fixed-interface problem is the pencil (T'KT, T'MT), solved with the
//! search, proof of completeness and residuals of any other eigenproblem.

use super::failure::explain;
use super::fixed_interface::{MissingResponses, free_estimate};
use super::free_surface::{polynomial_estimate, single_precision_note};
use super::held_interfaces::{check_prescribable, hold, unit_motions};
use super::interface_rows::{
    CoordinatesInModelAxes, CoupledInterface, InterfaceCoordinates, coupled_interfaces,
};
use super::massless::{MasslessMotions, ShapesWithMass};
use super::modal_basis::{Basis, ModalBasis, Task, input_error, problem_of_span, rigid_modes};
use super::pseudo_free_surface::{Independent, independent, largest_shares, named};
use super::{BasisKind, FixedInterface, ModeSettings};
use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::numbers::significant;
use flexbody_eigen::{
    Accuracy, Completeness, EigenFailure, EigenProblem, EigenSolution, Plan, Precision, Proof,
    ResponseAccuracy, Wanted, modes_of_span, solve, static_responses_twice,
};
use flexbody_linalg::context::Context;
use flexbody_linalg::{
    Elimination, ReducedPencil, add_combination, column_products, combine, gram, side_by_side,
    subtract_combination, symmetric_eigen,
};
use flexbody_model::{Coupling, FeModel, rigid_count};

/// Smallest relative M-norm that a shape must keep after projection against the shapes before it. Shapes
/// below this limit are removed as dependent.
const MIN_SHAPE_REMAINDER: f64 = 1e-8;

/// Number of copies of the shapes held at once while they are made independent (measured: 18).
const SHAPE_COPIES: u64 = 20;

/// Craig-Bampton basis: modes with all interfaces held, and constraint modes of all interfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CraigBampton;

impl Basis for CraigBampton {
    fn kind(&self) -> BasisKind {
        BasisKind::CraigBampton
    }

    fn modes(&self, task: &Task<'_>) -> Result<ModalBasis> {
        let Task { model, settings, context } = *task;
        check_possible(model, settings, context)?;
        let joints = coupled_interfaces(model, "interface coordinates")?;
        check_prescribable(model, &joints)?;
        // Fixed-interface modes and constraint modes.
        let parts = Parts::new(model, &joints, settings, context)?;
        let rigid = rigid_modes(model, &model.pencil())?;
        let problem = problem_of_span(model, rigid.as_ref());
        context.phase("pseudo-free-surface modes");
        let failed = |failure| explain(model, failure);
        // Remove rigid motion and dependent shapes.
        let shapes = side_by_side(&[parts.fixed_shapes().as_ref(), parts.constraint.as_ref()]);
        let massless = MasslessMotions::new(model);
        let found =
            independent(&problem.pencil, rigid.as_ref(), shapes, MIN_SHAPE_REMAINDER, massless.as_ref())
                .ok_or_else(|| failed(EigenFailure::MassIndefinite))?;
        let heavy = massless.as_ref().and_then(|massless| massless.removed_from(&found.vectors));
        let light = heavy.as_ref().map_or(0, |heavy| heavy.removed);
        let mut notes = parts.notes(model, settings);
        notes.extend(parts.removed(&found, rigid_count(model.dimension()), light));
        let lost = massless.as_ref().zip(heavy.as_ref());
        notes.extend(lost.map(|(massless, heavy)| parts.nearly_massless(model, massless, heavy)));
        if found.retained.len() == light {
            return Err(nothing_deforms().into());
        }
        // Solve the small eigenproblem in the span.
        let all = ModeSettings { wanted: Wanted::Lowest(usize::MAX), accuracy: Accuracy::Fast, ..*settings };
        let whole = light == 0 && parts.misses_only_rigid_motions(&found, rigid_count(model.dimension()));
        let span = found.vectors;
        let basis = heavy.map_or_else(|| span.clone(), |heavy| heavy.vectors);
        let mut solution = modes_of_span(&problem, basis, &all, context).map_err(failed)?;
        let parted = gram(span.as_ref(), problem.pencil.apply_mass(solution.vectors.as_ref()).as_ref());
        let provenance = parts.provenance(&found.retained, parted.as_ref());
        let coordinates = parts.coordinates(&problem, solution.vectors.as_ref(), model.dimension());
        let fixed_interface = parts.fixed_interface(rigid.as_ref(), &solution, whole);
        solution.completeness = parts.completeness(model, &solution);
        // Memory of the dense shapes counts if it exceeds that of the search.
        let bytes = shape_bytes(problem.pencil.n(), found.retained.len());
        solution.plan = parts.fixed.plan.map(|plan| plan.with_bytes(|search| search.max(bytes)));
        let mut basis = ModalBasis::new(model, &problem, settings, solution, "")?;
        basis.provenance = provenance;
        basis.coordinates = Some(coordinates);
        basis.fixed_interface = fixed_interface;
        basis.diagnostics.extend(notes);
        Ok(basis)
    }
}

/// Returns an error if the basis cannot fulfil the settings or does not fit the memory, before large arrays
/// are made.
fn check_possible(model: &FeModel, settings: &ModeSettings, context: &Context<'_>) -> Result<()> {
    if settings.accuracy == Accuracy::Certified {
        let message = "modes of a Craig-Bampton basis are not eigenvectors and cannot be certified";
        return Err(Diagnostic::new(Code::Usage, message).with_help("use --accuracy standard").into());
    }
    let coordinates = model.interfaces().iter().map(|set| match set.coupling() {
        Coupling::Free => model.dimension() * set.nodes.len(),
        _ => rigid_count(model.dimension()),
    });
    let bytes = shape_bytes(model.pencil().n(), coordinates.sum());
    let available = context.available();
    if bytes > available {
        return Err(explain(model, EigenFailure::Memory { bytes, available }));
    }
    Ok(())
}

fn nothing_deforms() -> Diagnostic {
    let message = "no shape deforms the body: one interface alone has no constraint modes, and no fixed-interface mode was requested";
    Diagnostic::new(Code::ShapesNone, message).with_help("ask for more modes, or raise --max-frequency")
}

/// Fixed-interface modes and constraint modes.
struct Parts<'a> {
    joints: &'a [CoupledInterface],
    names: Vec<String>,
    elimination: Elimination,
    reduced: ReducedPencil,
    /// Fixed-interface modes y = Phi, (T'MT)-orthonormal.
    fixed: EigenSolution,
    /// Constraint modes D + T Y (N x c): response to unit interface coordinates with no loads except at the
    /// interfaces, (T'KT) Y = -T'K D.
    constraint: Mat<f64>,
    /// Part of the responses to the inertia of the constraint modes outside the basis.
    missing_responses: MissingResponses,
}

impl<'a> Parts<'a> {
    fn new(
        model: &FeModel,
        joints: &'a [CoupledInterface],
        settings: &ModeSettings,
        context: &Context<'_>,
    ) -> Result<Self> {
        context.phase("interfaces");
        let pencil = model.pencil();
        let failed = |failure| explain(model, failure);
        let elimination = hold(pencil.n(), joints, context.memory).map_err(failed)?;
        if elimination.is_empty() {
            let message = "the interfaces contain every node of the body: no node is left that can deform";
            return Err(Diagnostic::new(Code::InterfaceCoupling, message)
                .with_help("give the interfaces fewer nodes")
                .into());
        }
        let names = joints.iter().flat_map(|joint| {
            joint.coordinates.iter().map(|coordinate| format!("{} {coordinate}", joint.name))
        });
        let moved = unit_motions(pencil.n(), joints);
        let reduced = elimination.reduced(&pencil);
        let held = reduced.pencil();
        // No rigid motion is left, so the search shift may be far from the first eigenvalue: use the
        // estimate of the free body.
        let rigid = rigid_modes(model, &pencil)?;
        let first_estimate = polynomial_estimate(model, &pencil, rigid.as_ref());
        let none = Mat::zeros(held.n(), 0);
        let problem = EigenProblem {
            pencil: held,
            rigid: none.as_ref(),
            first_estimate,
            input_error: input_error(model),
            order: None,
        };
        let in_model = |failure| failed(expanded(failure, &elimination));
        let reduced_bytes = reduced.bytes();
        let left =
            Context { memory: context.memory.map(|bytes| bytes.saturating_sub(reduced_bytes)), ..*context };
        let mut fixed = fixed_modes(&problem, settings, &left).map_err(in_model)?;
        fixed.plan = fixed.plan.map(|plan| plan.with_bytes(|search| search + reduced_bytes));
        context.phase("constraint modes");
        let lowest = fixed.eigenvalues.first().copied().or(fixed.next_eigenvalue).unwrap_or(first_estimate);
        let precision = fixed.plan.as_ref().map_or(Precision::Double, Plan::precision);
        let mut loads = elimination.restrict(pencil.apply_stiffness(moved.as_ref()).as_ref());
        loads *= faer::Scale(-1.0);
        let inertia = |interior: &Mat<f64>| {
            let constraint = &moved + elimination.expand(interior.as_ref());
            elimination.restrict(pencil.apply_mass(constraint.as_ref()).as_ref())
        };
        let accuracy = ResponseAccuracy::FULL;
        let [interior, correction] =
            static_responses_twice(&problem, loads, inertia, lowest, precision, accuracy, context)
                .map_err(in_model)?;
        let missing_responses = missing_responses(&problem, correction, &fixed);
        let mut constraint = moved + elimination.expand(interior.as_ref());
        restore_rigid_motion(joints, rigid.as_ref(), &mut constraint)
            .ok_or_else(|| failed(EigenFailure::Inaccurate { residual: f64::NAN }))?;
        Ok(Self {
            joints,
            names: names.collect(),
            elimination,
            reduced,
            fixed,
            constraint,
            missing_responses,
        })
    }

    fn fixed_shapes(&self) -> Mat<f64> {
        self.elimination.expand(self.fixed.vectors.as_ref())
    }

    /// Returns kind and name of a shape; fixed-interface modes come first.
    fn name(&self, shape: usize) -> (&'static str, String) {
        match shape.checked_sub(self.fixed.eigenvalues.len()) {
            None => ("fixed-interface mode", format!("number {}", shape + 1)),
            Some(constraint) => ("constraint mode", self.names[constraint].clone()),
        }
    }

    /// Returns the indices of removed shapes, ascending.
    fn removed_shapes(found: &Independent) -> Vec<usize> {
        let removed = found.rigid.iter().chain(found.dependent.iter().map(|(j, _)| j));
        let mut removed: Vec<usize> = removed.chain(&found.massless).copied().collect();
        removed.sort_unstable();
        removed
    }

    /// Returns true if the removed shapes are constraint modes and as many as the rigid motions, which the
    /// constraint modes contain.
    fn misses_only_rigid_motions(&self, found: &Independent, rigid: usize) -> bool {
        let removed = Self::removed_shapes(found);
        removed.len() == rigid && removed[0] >= self.fixed.eigenvalues.len()
    }

    /// Returns the shape with the largest share in each mode. `parted` holds the products of the shapes
    /// `retained` with the modes.
    fn provenance(&self, retained: &[usize], parted: MatRef<'_, f64>) -> Vec<String> {
        let described = |(j, share): (usize, f64)| {
            let (kind, name) = self.name(retained[j]);
            format!("{kind}: {:.0} % {name}", 100.0 * share)
        };
        largest_shares(parted).into_iter().map(described).collect()
    }

    /// Returns the diagnostics about removed shapes. `light`: number of combinations of the others that are left out since
    /// they carry nearly no mass.
    fn removed(&self, found: &Independent, rigid: usize, light: usize) -> Vec<Diagnostic> {
        let removed = Self::removed_shapes(found);
        let all = found.retained.len() + removed.len();
        let note = if self.misses_only_rigid_motions(found, rigid) {
            let (fixed, motions) = (self.fixed.eigenvalues.len(), self.constraint.ncols());
            let message = format!(
                "the {motions} interface motions contain the {rigid} rigid-body motions, which the body frame performs: with {fixed} fixed-interface modes the body has {} modes",
                found.retained.len() - light
            );
            Diagnostic::new(Code::ShapesRigid, message)
                .with_help("nothing to do: every Craig-Bampton body is counted in this way")
        } else {
            let which = removed.iter().map(|&j| self.name(j)).map(|(kind, name)| format!("{kind} {name}"));
            let which = named(which.collect());
            let message = format!(
                "{} of {all} shapes are left out since they are rigid motions, move no mass, or add less than {MIN_SHAPE_REMAINDER:.0e} of their M-norm ({rigid} rigid motions were expected): {which}",
                removed.len()
            );
            Diagnostic::new(Code::ShapesDependent, message)
        };
        vec![note]
    }

    /// Returns the warning about combinations of shapes that are left out of `heavy`.
    fn nearly_massless(
        &self,
        model: &FeModel,
        massless: &MasslessMotions<'_>,
        heavy: &ShapesWithMass,
    ) -> Diagnostic {
        let given = self.fixed.eigenvalues.len();
        let message = format!(
            "{} combinations of shapes with modes from {} Hz on are left out since they carry nearly no mass beside the {given} fixed-interface modes: the body lacks this local flexibility of its interfaces under loads on rotations and nodes without mass",
            heavy.removed,
            significant(model.units().frequency_of(heavy.from), 4),
        );
        let most = massless.most_beside(&self.fixed_shapes(), &self.constraint);
        let mass = "give the rotations of the nodes their mass";
        let help = match most.filter(|most| (1..given).contains(most)) {
            Some(most) => format!("to keep it ask for at most {most} modes, or {mass}"),
            None => format!("to keep it {mass}"),
        };
        Diagnostic::new(Code::ShapesDependent, message).with_help(help)
    }

    /// Returns the composition of the basis. `whole`: the basis spans all motions of the interfaces, a
    /// condition for lower bounds. Returns `None` if the estimates leave the range of numbers.
    fn fixed_interface(
        &self,
        rigid: MatRef<'_, f64>,
        solution: &EigenSolution,
        whole: bool,
    ) -> Option<FixedInterface> {
        let Completeness { proof, shift, negative_pivots, .. } = self.fixed.completeness;
        let modes = self.fixed.eigenvalues.len();
        let counted = negative_pivots.filter(|_| proof == Proof::InertiaCount);
        // A mode below the shift that is left out is known by its eigenvalue.
        let next = self.fixed.next_eigenvalue.filter(|_| counted.is_some_and(|counted| counted > modes));
        let cut = counted.and(next.map(|next| next * (1.0 - MAX_FIXED_EIGENVALUE_ERROR)).or(Some(shift)));
        let (of_rigid, of_modes) =
            (coordinates_of(self.joints, rigid), coordinates_of(self.joints, solution.vectors.as_ref()));
        let free = free_estimate(
            &solution.eigenvalues,
            of_rigid.as_ref(),
            of_modes.as_ref(),
            &self.missing_responses,
            cut.filter(|_| whole),
        )?;
        Some(FixedInterface {
            modes,
            interface_motions: self.constraint.ncols(),
            counted,
            shift,
            next,
            residual: self.fixed.residuals.iter().copied().fold(0.0, f64::max),
            // The stiffness in interface coordinates holds the eigenvalues.
            eigenvalues: Vec::new(),
            free: Some(free),
        })
    }

    /// Returns the diagnostics about the fixed-interface modes.
    fn notes(&self, model: &FeModel, settings: &ModeSettings) -> Vec<Diagnostic> {
        let given = self.fixed.eigenvalues.len();
        let mut notes: Vec<Diagnostic> = single_precision_note(&self.fixed, settings).into_iter().collect();
        if let Wanted::Lowest(wanted) = settings.wanted
            && given < wanted
            && wanted < usize::MAX
        {
            let message = format!("{wanted} fixed-interface modes were requested, the model has {given}");
            notes.push(Diagnostic::new(Code::ModesClamped, message));
        }
        let completeness = &self.fixed.completeness;
        if given > 0 && completeness.proof == Proof::NotProved {
            let message = format!(
                "completeness of the {given} fixed-interface modes is not proved: {}",
                completeness.remark
            );
            notes.push(Diagnostic::new(Code::CompletenessUnproved, message));
        }
        if let (Wanted::Lowest(1..), Some(more)) =
            (settings.wanted, completeness.modes_below.checked_sub(given).filter(|more| *more > 0))
        {
            let hertz =
                self.fixed.eigenvalues.last().map_or(0.0, |&lambda| model.units().frequency_of(lambda));
            let message = format!(
                "fixed-interface mode {given} ({} Hz) shares its eigenvalue with other modes that are left out (number: {more})",
                significant(hertz, 6)
            );
            notes.push(
                Diagnostic::new(Code::RepeatedSplit, message)
                    .with_help(format!("ask for {} modes to keep the body's symmetry", given + more)),
            );
        }
        notes
    }

    /// Returns the completeness of the modes of the span, which are no eigenvectors of the free body: the
    /// proof covers the fixed-interface modes.
    fn completeness(&self, model: &FeModel, solution: &EigenSolution) -> Completeness {
        let (fixed, held) = (self.fixed.eigenvalues.len(), &self.fixed.completeness);
        let hertz = significant(model.units().frequency_of(held.shift), 7);
        let more = held.modes_below.saturating_sub(fixed);
        let proved = match held.proof {
            Proof::NotProved => {
                format!("its {fixed} fixed-interface modes are not proved complete: {}", held.remark)
            }
            Proof::InertiaCount if more == 0 => {
                format!(
                    "its {fixed} fixed-interface modes are all there are below {hertz} Hz (inertia count)"
                )
            }
            Proof::InertiaCount => format!(
                "of the {} fixed-interface modes below {hertz} Hz (inertia count) it has {fixed}",
                held.modes_below
            ),
        };
        Completeness {
            proof: Proof::NotProved,
            shift: solution.eigenvalues.last().copied().unwrap_or(0.0),
            negative_pivots: None,
            modes_below: solution.eigenvalues.len(),
            remark: format!("a Craig-Bampton basis has no modes of the free body; {proved}"),
        }
    }

    /// Returns K and M in the coordinates of the interfaces and of the fixed-interface modes, and the modes
    /// in these coordinates.
    fn coordinates(
        &self,
        problem: &EigenProblem<'_>,
        modes: MatRef<'_, f64>,
        dimension: usize,
    ) -> CoordinatesInModelAxes {
        let (pencil, rigid) = (&problem.pencil, problem.rigid);
        let (c, lambda) = (self.constraint.ncols(), &self.fixed.eigenvalues);
        // K annihilates rigid motion: subtracting it keeps the digits of the energies and makes R'K R = 0
        // exactly.
        let mut deformed = self.constraint.clone();
        for _ in 0..2 {
            let along = gram(rigid, pencil.apply_mass(deformed.as_ref()).as_ref());
            subtract_combination(deformed.as_mut(), rigid, along.as_ref());
        }
        let stiffness = gram(deformed.as_ref(), pencil.apply_stiffness(deformed.as_ref()).as_ref());
        let shapes = side_by_side(&[self.constraint.as_ref(), self.fixed_shapes().as_ref()]);
        let mass = gram(shapes.as_ref(), pencil.apply_mass(shapes.as_ref()).as_ref());
        let mean = |a: &Mat<f64>, i: usize, j: usize| 0.5 * (a[(i, j)] + a[(j, i)]);
        let size = c + lambda.len();
        let q = coordinates_of(self.joints, modes);
        // T y = psi - (D + T Y) q, and eta = Phi' (T'MT) y.
        let mut left = modes.to_owned();
        subtract_combination(left.as_mut(), self.constraint.as_ref(), q.as_ref());
        let y = self.elimination.free_rows(left.as_ref());
        let eta = gram(self.fixed.vectors.as_ref(), self.reduced.pencil().apply_mass(y.as_ref()).as_ref());
        let modal = (1..=lambda.len()).map(InterfaceCoordinates::amplitude);
        let coordinates = InterfaceCoordinates {
            names: self.names.iter().cloned().chain(modal).collect(),
            stiffness: Mat::from_fn(size, size, |i, j| match (i < c, j < c) {
                (true, true) => mean(&stiffness, i, j),
                (false, false) if i == j => lambda[i - c],
                _ => 0.0,
            }),
            mass: Mat::from_fn(size, size, |i, j| mean(&mass, i, j)),
            of_modes: Mat::from_fn(
                size,
                modes.ncols(),
                |i, j| if i < c { q[(i, j)] } else { eta[(i - c, j)] },
            ),
        };
        CoordinatesInModelAxes { coordinates, vectors: self.vectors(dimension) }
    }

    /// Returns the first coordinate of every vector among the coordinates: displacements, and rotations in
    /// space, each with `d` components.
    fn vectors(&self, d: usize) -> Vec<usize> {
        let starts_of_vectors = |(joint, first): (&CoupledInterface, usize)| {
            let (moving, all) = (joint.displacements, joint.coordinates.len());
            // In the plane a rotation is a scalar.
            let turning = if d == 3 { (all - moving) / 3 } else { 0 };
            (0..moving / d + turning).map(move |i| first + d * i)
        };
        starts(self.joints).flat_map(starts_of_vectors).collect()
    }
}

/// Bound of the relative error of a computed fixed-interface eigenvalue, far above the effect of its
/// residual.
const MAX_FIXED_EIGENVALUE_ERROR: f64 = 1e-8;

/// Computes the wanted fixed-interface modes. If none are wanted (static condensation), the first is
/// computed nevertheless, since its eigenvalue limits the frequency range of the basis.
fn fixed_modes(
    problem: &EigenProblem<'_>,
    settings: &ModeSettings,
    context: &Context<'_>,
) -> std::result::Result<EigenSolution, EigenFailure> {
    if settings.wanted != Wanted::Lowest(0) {
        return solve(problem, settings, context);
    }
    let first = solve(problem, &ModeSettings { wanted: Wanted::Lowest(1), ..*settings }, context)?;
    Ok(EigenSolution {
        next_eigenvalue: first.eigenvalues.first().copied(),
        eigenvalues: Vec::new(),
        vectors: Mat::zeros(problem.pencil.n(), 0),
        residuals: Vec::new(),
        rounding_floors: Vec::new(),
        bounds: None,
        ..first
    })
}

/// Returns G and H of the responses y to the inertia of the constraint modes, after removal of the part
/// along the fixed-interface modes.
fn missing_responses(
    problem: &EigenProblem<'_>,
    mut response: Mat<f64>,
    fixed: &EigenSolution,
) -> MissingResponses {
    let pencil = &problem.pencil;
    let whole = column_products(response.as_ref(), pencil.apply_stiffness(response.as_ref()).as_ref());
    for _ in 0..2 {
        let along = gram(fixed.vectors.as_ref(), pencil.apply_mass(response.as_ref()).as_ref());
        subtract_combination(response.as_mut(), fixed.vectors.as_ref(), along.as_ref());
    }
    let symmetric = |products: Mat<f64>| {
        let a = gram(response.as_ref(), products.as_ref());
        Mat::from_fn(a.nrows(), a.ncols(), |i, j| 0.5 * (a[(i, j)] + a[(j, i)]))
    };
    MissingResponses {
        whole,
        stiffness: symmetric(pencil.apply_stiffness(response.as_ref())),
        mass: symmetric(pencil.apply_mass(response.as_ref())),
    }
}

/// Makes the rigid motions R (N x r) in the constraint modes Psi exact: Psi <- Psi + (R - Psi Q) Q^+ with
/// their coordinates Q = C'R. K annihilates rigid motions only to its digits, and a slender body magnifies
/// that error. The coordinates of the shapes do not change.
fn restore_rigid_motion(
    joints: &[CoupledInterface],
    rigid: MatRef<'_, f64>,
    constraint: &mut Mat<f64>,
) -> Option<()> {
    let q = coordinates_of(joints, rigid);
    let scale: Vec<f64> = (0..q.nrows()).map(|i| q.row(i).norm_l2()).collect();
    // Scale the coordinates to one size: rotations and displacements have different units.
    let weighted =
        Mat::from_fn(
            q.nrows(),
            q.ncols(),
            |i, j| {
                if scale[i] > 0.0 { q[(i, j)] / scale[i].powi(2) } else { 0.0 }
            },
        );
    let eigen = symmetric_eigen(gram(weighted.as_ref(), q.as_ref()).as_ref())?;
    let root = Mat::from_fn(q.ncols(), q.ncols(), |i, j| eigen.vectors[(i, j)] / eigen.values[j].sqrt());
    let root = combine(root.as_ref(), root.as_ref().transpose());
    let inverse = combine(root.as_ref(), weighted.as_ref().transpose());
    for _ in 0..2 {
        let mut missing = rigid.to_owned();
        subtract_combination(missing.as_mut(), constraint.as_ref(), q.as_ref());
        add_combination(constraint.as_mut(), missing.as_ref(), inverse.as_ref());
    }
    Some(())
}

/// Returns C'u, the interface coordinates of displacements (N x k).
fn coordinates_of(joints: &[CoupledInterface], u: MatRef<'_, f64>) -> Mat<f64> {
    let blocks = joints.iter().map(|joint| gram(joint.measure(), joint.gather(u).as_ref()));
    let blocks: Vec<Mat<f64>> = blocks.collect();
    let rows: Vec<_> = blocks.iter().flat_map(|block| block.row_iter()).collect();
    Mat::from_fn(rows.len(), u.ncols(), |i, j| rows[i][j])
}

/// Returns the joints, each with the index of its first coordinate.
fn starts(joints: &[CoupledInterface]) -> impl Iterator<Item = (&CoupledInterface, usize)> {
    joints.iter().scan(0, |next, joint| {
        let first = *next;
        *next += joint.coordinates.len();
        Some((joint, first))
    })
}

/// Returns a failure of the fixed-interface problem with its vectors expanded to the rows of the model.
fn expanded(failure: EigenFailure, elimination: &Elimination) -> EigenFailure {
    match failure {
        EigenFailure::NegativeEigenvalue { eigenvalue, vector } => {
            EigenFailure::NegativeEigenvalue { eigenvalue, vector: elimination.expand(vector.as_ref()) }
        }
        EigenFailure::ZeroEnergy { count, eigenvalues, vectors } => {
            let vectors = elimination.expand(vectors.as_ref());
            EigenFailure::ZeroEnergy { count, eigenvalues, vectors }
        }
        EigenFailure::SinglePrecision(inner) => {
            EigenFailure::SinglePrecision(Box::new(expanded(*inner, elimination)))
        }
        other => other,
    }
}

/// Returns the bytes needed for `count` shapes of n rows.
fn shape_bytes(n: usize, count: usize) -> u64 {
    8 * SHAPE_COPIES * (n as u64) * (count as u64)
}
