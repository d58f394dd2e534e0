//! Verification of a body against its model: every invariant and every mode is recomputed from the
//! matrices.

mod interior;
mod recoveries;

use super::recounts::{interface_checks, interface_note, recounts};
use crate::basis::BasisKind;
use crate::convert::{
    BodyModes, NodesInFrame, StressLoads, StressedModes, modal_damping, modal_geometric_stiffness, poor_fits,
    rigid_mass, stress_stiffness, unit_rotations, unusual_node_inertia,
};
use crate::flex_body::{FlexBody, Guarantee, ReferenceConditions, Storage, joined};
use crate::invariants::{
    BodyFrame, DIGITS, IdentityCheck, Invariants, condense_certified, primary_differences,
};
use faer::{Mat, Scale};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::numbers::significant;
use flexbody_eigen::{relative_residual, residual_scale, rounding_residual};
use flexbody_linalg::context::Context;
use flexbody_linalg::{SymmetricMatrix, gram, larger, largest, largest_entry, side_by_side};
use flexbody_model::{CheckedModel, Damping, FeModel, GeometricStiffness, RawModel, UnitLoad};
use libm::pow;
use nalgebra::Vector3;
use recoveries::{limit_of_responses, recovery_checks};

/// Limit for recomputed invariants, relative to their Cauchy-Schwarz bounds: the rounding of their sums.
const MAX_RECOMPUTED_DIFFERENCE: f64 = 1e-12;

/// Name of K_ff in [`primary_differences`].
const STIFFNESS: &str = "modal_stiffness";

/// Allowed difference between two evaluations of K psi, in units of the rounding estimate eps | |K| |psi|
/// |. The shapes were also turned to body axes and back.
const MAX_ROUNDING_ESTIMATES: f64 = 30.0;

/// Evaluates all checks of `body` that need no model: the identities of theory section 10, and the
/// consistency of the numbers stored in the file.
pub fn body_identities(body: &FlexBody) -> Vec<IdentityCheck> {
    let mut checks = body.identities(frame_of(body));
    checks.extend(recounts(body));
    checks
}

/// Result of the checks of a body.
#[derive(Debug, Clone)]
pub struct Checks {
    /// All identities and comparisons.
    pub identities: Vec<IdentityCheck>,
    /// Warnings about interfaces that the modes deform although they are rigid, about unusual inertia of nodes,
    /// and about changed source files.
    pub diagnostics: Vec<Diagnostic>,
}

impl Checks {
    /// Evaluates all checks of `body`, and those against the `model` that it was made of if one is given.
    ///
    /// # Errors
    /// The errors of [`verify`].
    pub fn of(body: &FlexBody, model: Option<&FeModel>) -> Result<Self> {
        let mut checks = Self { identities: body_identities(body), diagnostics: poor_fits(body) };
        checks.diagnostics.extend(unusual_node_inertia(body, model));
        if let Some(model) = model {
            checks.diagnostics.extend(changed_sources(body, model));
            checks.diagnostics.extend(interface_note(body, model));
            checks.identities.extend(verify(body, model)?);
        }
        Ok(checks)
    }

    /// Returns true if every check passed.
    pub fn passed(&self) -> bool {
        self.identities.iter().all(|check| check.passed)
    }
}

/// Returns the model that `body` was made of: all of `raw`, or one of the bodies in it.
///
/// # Errors
/// The errors of [`FeModel::from_raw`]; [`BodyIncomparable`](Code::BodyIncomparable) if the model holds other bodies.
pub fn model_of(body: &FlexBody, raw: RawModel) -> Result<CheckedModel> {
    let Some(number) = body.description().number else { return FeModel::from_raw(raw) };
    let bodies = FeModel::bodies_from_raw(raw)?;
    let count = bodies.len();
    let found = bodies.into_iter().find(|checked| checked.model.number() == Some(number));
    found.ok_or_else(|| {
        let message = format!("the file states {number}, but the matrices of the model hold {count}");
        Diagnostic::new(Code::BodyIncomparable, message).into()
    })
}

/// Returns the intended frame of `body`, as recorded in its settings.
fn frame_of(body: &FlexBody) -> BodyFrame {
    let name = body.source().settings["frame"].as_str();
    name.and_then(BodyFrame::from_name).unwrap_or(BodyFrame::Model)
}

/// Rejects a body that breaks one of [`body_identities`], so that every body written passes `flexbody
/// check`.
///
/// # Errors
/// [`BodyUntrustworthy`](Code::BodyUntrustworthy), one diagnostic per identity that does not hold.
pub fn accept(body: &FlexBody) -> Result<()> {
    let failed = body_identities(body).into_iter().filter(|check| !check.passed);
    let diagnostics: Vec<Diagnostic> = failed
        .map(|check| {
            let IdentityCheck { name, formula, value, limit, .. } = check;
            let message =
                format!("the body violates `{name}` ({formula}): {value:.1e}, expected at most {limit:.1e}");
            Diagnostic::new(Code::BodyUntrustworthy, message)
        })
        .collect();
    if diagnostics.is_empty() { Ok(()) } else { Err(Error::new(diagnostics)) }
}

/// Recomputes invariants, residuals and orthogonality of `body` from the matrices of `model`.
///
/// # Errors
/// [`BodyIncomparable`](Code::BodyIncomparable) if dimension, nodes or rows of the modes differ.
pub fn verify(body: &FlexBody, model: &FeModel) -> Result<Vec<IdentityCheck>> {
    let against = Recomputed::new(body, model)?;
    let mut checks = vec![against.positions()];
    checks.extend(against.invariants());
    checks.extend(against.modes());
    checks.extend(against.damping()?);
    checks.extend(against.geometric_stiffness()?);
    checks.extend(against.inertia_stiffness());
    checks.extend(against.guarantee());
    checks.extend(interface_checks(body, model));
    checks.extend(against.recoveries()?);
    Ok(checks)
}

/// Returns the error about a model that the body was not made of, with the files that it was made of.
fn of_other_model(body: &FlexBody, message: String) -> Error {
    let files: Vec<&str> = body.source().files.iter().map(|file| file.name.as_str()).collect();
    let made_of = if files.is_empty() { String::new() } else { format!(" ({})", files.join(", ")) };
    let help = format!(
        "give the model that the body `{}` was made of{made_of}, or convert this model again",
        body.description().name
    );
    Diagnostic::new(Code::BodyIncomparable, message).with_help(help).into()
}

/// Returns an error if the model has another dimension or other nodes than the body.
fn check_comparable(body: &FlexBody, model: &FeModel) -> Result<()> {
    if body.dimension() != model.dimension() {
        let message = format!("the body has dimension {}, the model {}", body.dimension(), model.dimension());
        return Err(of_other_model(body, message));
    }
    let nodes = model.nodes_of_body();
    if body.nodes().ids != nodes.ids {
        let message = format!(
            "the body has {} nodes, the model {} with other numbers or in another order",
            body.nodes().ids.len(),
            nodes.ids.len()
        );
        return Err(of_other_model(body, message));
    }
    Ok(())
}

/// A body and the data recomputed for its modes from the matrices of its model.
struct Recomputed<'a> {
    body: &'a FlexBody,
    model: &'a FeModel,
    place: NodesInFrame,
    modes: BodyModes,
    /// K and M times the modes.
    kx: Mat<f64>,
    mx: Mat<f64>,
    /// Invariants condensed from the model.
    recomputed: Invariants,
    /// Difference of each stored invariant from the recomputed one, by name.
    differences: Vec<(String, f64)>,
}

impl<'a> Recomputed<'a> {
    fn new(body: &'a FlexBody, model: &'a FeModel) -> Result<Self> {
        check_comparable(body, model)?;
        let place = NodesInFrame::new(model, *body.frame());
        let Some(modes) = BodyModes::of_body(model, body) else {
            let message = "the rows of the body's modes are not those of the model";
            return Err(of_other_model(body, message.to_owned()));
        };
        let pencil = model.pencil();
        let kx = pencil.apply_stiffness(modes.vectors.as_ref());
        let mx = pencil.apply_mass(modes.vectors.as_ref());
        let modal_stiffness = gram(modes.vectors.as_ref(), kx.as_ref());
        let recomputed = modes.condensed(model, &place, modal_stiffness);
        let differences = primary_differences(body.invariants(), &recomputed);
        Ok(Self { body, model, place, modes, kx, mx, recomputed, differences })
    }

    /// Compares the positions of the nodes in the body frame.
    fn positions(&self) -> IdentityCheck {
        let in_frame = self.place.frame.to_body(&self.model.nodes_of_body().positions);
        let recomputed = in_frame.iter().flatten();
        let size = recomputed.clone().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
        let stored = self.body.nodes().positions.iter().flatten();
        let moved = largest(recomputed.zip(stored).map(|(a, b)| (a - b).abs()));
        IdentityCheck::new("positions", "x_body = A' (x_model - origin)", moved / size, 1e-12)
    }

    /// Returns the largest difference of the invariants whose names pass `kept`.
    fn difference_of(&self, kept: impl Fn(&str) -> bool) -> f64 {
        let kept = self.differences.iter().filter(|(name, _)| kept(name));
        largest(kept.map(|(_, difference)| *difference))
    }

    /// Compares the mass invariants with two independent computations.
    fn invariants(&self) -> [IdentityCheck; 2] {
        let body = self.body;
        // Turning shapes and rigid motions rounds them; relative to the small moment of a needle that
        // rounding is larger.
        let inertia = body.invariants().inertia().diagonal();
        let recomputed = MAX_RECOMPUTED_DIFFERENCE
            + body.storage().rounding()
            + 8.0 * f64::EPSILON * (inertia.max() / inertia.min()).sqrt();
        // If the condensation assumed m_ff = I, `orthonormal_recomputed` checks the modal mass.
        let is_of_mass = |name: &str| name != STIFFNESS && (body.groups().w2 || name != "modal_mass");
        [
            IdentityCheck::new(
                "invariants_recomputed",
                "m, c, J, C1, Ibar, S from the matrices",
                self.difference_of(is_of_mass),
                recomputed,
            ),
            IdentityCheck::new(
                "rigid_inertia_recomputed",
                "R' M R = [m, -c~; c~, I0]",
                rigid_inertia_error(body, &rigid_mass(self.model, body.frame())),
                recomputed,
            ),
        ]
    }

    /// Checks K_ff, the residuals and the orthonormality of the modes.
    fn modes(&self) -> Vec<IdentityCheck> {
        let (storage, modes) = (self.body.storage(), &self.modes.vectors);
        let ModeErrors { residual, allowed_residual, stiffness } = self.mode_errors();
        let orthonormality =
            gram(modes.as_ref(), self.mx.as_ref()) - Mat::<f64>::identity(modes.ncols(), modes.ncols());
        let mut checks = vec![
            IdentityCheck::new(
                "stiffness_recomputed",
                "K_ff = Psi' K Psi",
                self.difference_of(|name| name == STIFFNESS),
                MAX_RECOMPUTED_DIFFERENCE + storage.rounding() + stiffness,
            ),
            IdentityCheck::new(
                "orthonormal_recomputed",
                "Psi' M Psi = I",
                largest_entry(orthonormality.as_ref()),
                1e-9 + storage.rounding(),
            ),
        ];
        // Modes of a Craig-Bampton basis are no eigenvectors of K and M.
        let of_modes = || {
            let formula = "|K psi - lambda M psi| / (|K psi| + |lambda M psi|)";
            vec![IdentityCheck::new("residual_recomputed", formula, residual, 2.0 * allowed_residual)]
        };
        let is_craig_bampton = self.body.basis() == Some(BasisKind::CraigBampton);
        let residuals = if is_craig_bampton { self.interior() } else { of_modes() };
        checks.splice(1..1, residuals);
        checks
    }

    /// Computes the residuals and the part of them explained by rounding of products with K. K is large
    /// compared with its lowest eigenvalues, and the rounding of its products is no error of the body.
    fn mode_errors(&self) -> ModeErrors {
        let (modes, storage) = (self.body.modes(), self.body.storage());
        let rounding: Vec<f64> = rounding_residual(self.model.stiffness(), self.modes.vectors.as_ref())
            .into_iter()
            .map(|rounding| storage.roundings() * rounding)
            .collect();
        let (mut residual, mut stored, mut long, mut loose) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
        for (j, &lambda) in modes.eigenvalue.iter().enumerate() {
            let (k_psi, m_psi) = (self.kx.col(j), self.mx.col(j));
            let size = residual_scale(k_psi, m_psi, lambda);
            residual = larger(residual, relative_residual(k_psi, m_psi, lambda));
            stored = stored.max(modes.residual[j]).max(MAX_ROUNDING_ESTIMATES * rounding[j] / size);
            // |psi_p' d(K psi_q)| <= |psi_p| |d(K psi_q)|, relative to sqrt(lambda_p lambda_q).
            long = long.max(self.modes.vectors.col(j).norm_l2() / lambda.sqrt());
            loose = loose.max(rounding[j] / lambda.sqrt());
        }
        ModeErrors { residual, allowed_residual: stored, stiffness: long * loose }
    }

    fn damping(&self) -> Result<Option<IdentityCheck>> {
        let found = damping_check(self.body, self.model, &self.modes.vectors, &self.recomputed)?;
        Ok(found.map(|found| {
            let formula = "D_ff = Psi' D Psi, zeta = D_jj / (2 omega_j)";
            IdentityCheck::new("damping_recomputed", formula, found.largest, found.allowed)
        }))
    }

    fn geometric_stiffness(&self) -> Result<Option<IdentityCheck>> {
        let modal_stiffness = gram(self.modes.vectors.as_ref(), self.kx.as_ref());
        let found = geometric_check(self.body, self.model, &self.modes.vectors, &modal_stiffness)?;
        Ok(found.map(|found| {
            let formula = "Psi' K_geo Psi for every unit load";
            IdentityCheck::new("geometric_stiffness_recomputed", formula, found.largest, found.allowed)
        }))
    }

    /// Compares the stiffness of inertia, computed from the moments of the nodes and from the matrices.
    fn inertia_stiffness(&self) -> Option<IdentityCheck> {
        let recomputed = self.modes.inertia_stiffness(self.model, &self.place.frame);
        let formula = "moments of the nodes and stiffness of inertia from M";
        let check = |value| {
            let limit = MAX_RECOMPUTED_DIFFERENCE + 4.0 * self.body.storage().rounding();
            Some(IdentityCheck::new("inertia_stiffness_recomputed", formula, value, limit))
        };
        match (self.body.inertia_stiffness(), recomputed) {
            (None, None) => None,
            (Some(stored), Some(recomputed)) => check(recomputed.largest_difference(stored)),
            // The body was made by a version without stiffness of inertia, or from another model.
            (None, Some(_)) | (Some(_), None) => check(f64::INFINITY),
        }
    }

    fn recoveries(&self) -> Result<Vec<IdentityCheck>> {
        let modal_stiffness = gram(self.modes.vectors.as_ref(), self.kx.as_ref());
        recovery_checks(self.body, self.model, &self.modes, &self.place, &modal_stiffness)
    }

    /// Checks the bounds that accuracy `certified` guarantees, if the body has them.
    fn guarantee(&self) -> Vec<IdentityCheck> {
        let body = self.body;
        if body.certificate().guarantee.is_some() && !self.model.has_exact_scalar_mass() {
            let formula = "M as stored is the same along x, y and z, as the bounds require";
            let deviation = self.model.mass_deviation().max(f64::MIN_POSITIVE);
            return vec![IdentityCheck::new("certified_mass", formula, deviation, 0.0)];
        }
        let (Some(guarantee), Some(mass)) = (&body.certificate().guarantee, self.model.scalar_mass()) else {
            return Vec::new();
        };
        let (stored, shapes) = (&body.nodes().positions, self.modes.displacements.as_ref());
        let recomputed = condense_certified(mass, stored, shapes, self.model.stiffness(), &body.frame().axes);
        vec![
            IdentityCheck::new(
                "digits_recomputed",
                "invariants to their guaranteed digits",
                excess_of_digits(body, guarantee, &recomputed.invariants),
                1.0,
            ),
            IdentityCheck::new(
                "bounds_recomputed",
                "psi' K psi / psi' M psi between the bounds of lambda",
                outside_of_bounds(guarantee, &recomputed.invariants),
                1e-9 + body.certificate().rigid_noise,
            ),
        ]
    }
}

/// Errors of recomputed modes, and their limits.
struct ModeErrors {
    /// Largest residual.
    residual: f64,
    /// Largest residual stored or explained by rounding.
    allowed_residual: f64,
    /// Rounding error of K_ff, relative to sqrt(lambda_p lambda_q).
    stiffness: f64,
}

/// Returns the largest difference of the invariants in units of the difference that their guaranteed digits
/// allow.
fn excess_of_digits(body: &FlexBody, guarantee: &Guarantee, recomputed: &Invariants) -> f64 {
    let excess = |(name, difference): (String, f64)| {
        let digits = DIGITS.iter().zip(&guarantee.digits).find(|(known, _)| **known == name);
        let scale = digits.map_or(1.0, |(_, digits)| pow(10.0, *digits));
        0.5 * difference * scale
    };
    largest(primary_differences(body.invariants(), recomputed).into_iter().map(excess))
}

/// Returns the largest relative distance of the Rayleigh quotient of a mode from the bounds of its
/// eigenvalue, zero if all quotients lie inside. Stored modes are rounded, so their quotients follow the
/// eigenvalues to the limit of the other checks of modes.
fn outside_of_bounds(guarantee: &Guarantee, recomputed: &Invariants) -> f64 {
    let bounds = guarantee.eigenvalue_lower.iter().zip(&guarantee.eigenvalue_upper);
    let modal_mass = recomputed.modal_mass();
    largest(bounds.enumerate().map(|(j, (lower, upper))| {
        let quotient = recomputed.modal_stiffness()[(j, j)] / modal_mass[(j, j)];
        larger((lower - quotient) / lower, (quotient - upper) / upper)
    }))
}

/// Difference between stored and recomputed matrices relative to the largest entry, and the difference that
/// rounding allows.
#[derive(Clone, Copy)]
struct Difference {
    largest: f64,
    allowed: f64,
}

impl Difference {
    /// Creates the difference of entries up to `size`, recomputed with an absolute rounding error
    /// `rounding`.
    fn new(largest: f64, size: f64, rounding: f64) -> Self {
        let relative = |value: f64| if value == 0.0 { 0.0 } else { value / size };
        let rounding = if rounding > 0.0 { rounding } else { 0.0 };
        // Two matrices that consist of rounding errors differ by at most twice the size.
        Self { largest: relative(largest), allowed: MAX_RECOMPUTED_DIFFERENCE + relative(rounding).min(2.0) }
    }

    /// Returns the difference with the larger ratio of actual to allowed value; NaN counts as worst.
    fn worse(self, other: Self) -> Self {
        let is_worse = other.largest.is_nan() || other.largest * self.allowed > self.largest * other.allowed;
        if is_worse { other } else { self }
    }
}

/// Returns an upper bound of the rounding error of |psi_p' A psi_q|.
fn rounding_of(a: &SymmetricMatrix, shapes: &Mat<f64>, storage: Storage) -> f64 {
    MAX_ROUNDING_ESTIMATES
        * storage.roundings()
        * longest_column(shapes)
        * rounding_residual(a, shapes.as_ref()).into_iter().fold(0.0, f64::max)
}

/// Compares the stored damping with that of the model. Returns `None` if neither has damping.
fn damping_check(
    body: &FlexBody,
    model: &FeModel,
    shapes: &Mat<f64>,
    recomputed: &Invariants,
) -> Result<Option<Difference>> {
    let modes = body.modes();
    let nf = modes.eigenvalue.len();
    let found = modal_damping(model, shapes.as_ref(), &modes.eigenvalue, recomputed)?;
    if found.is_none()
        && modes.modal_damping.is_none()
        && modes.damping_ratio.iter().all(|ratio| *ratio == 0.0)
    {
        return Ok(None);
    }
    let none = || Mat::zeros(nf, nf);
    let (matrix, ratio) =
        found.map_or_else(|| (none(), vec![0.0; nf]), |damping| (damping.matrix, damping.ratio));
    let stored = modes.modal_damping.clone().unwrap_or_else(none);
    let by_ratio =
        |(j, lambda): (usize, &f64)| 2.0 * lambda.sqrt() * (ratio[j] - modes.damping_ratio[j]).abs();
    let by_matrix = largest_entry((&stored - &matrix).as_ref());
    let largest = modes.eigenvalue.iter().enumerate().map(by_ratio).fold(by_matrix, larger);
    let rounding = match model.damping() {
        Some(Damping::Matrix(d)) => rounding_of(d, shapes, body.storage()),
        Some(Damping::Rayleigh { beta, .. }) => beta * rounding_of(model.stiffness(), shapes, body.storage()),
        _ => 0.0,
    };
    Ok(Some(Difference::new(largest, matrix.norm_max().max(stored.norm_max()), rounding)))
}

/// Compares the stored geometric stiffness with that of the model. Returns `None` if neither has any.
///
/// # Errors
/// The errors of stress stiffness that the body had computed from the elements of its deck.
fn geometric_check(
    body: &FlexBody,
    model: &FeModel,
    shapes: &Mat<f64>,
    modal_stiffness: &Mat<f64>,
) -> Result<Option<Difference>> {
    let shift = match body.conditions() {
        // The model gives geometric stiffness about the centre of mass.
        ReferenceConditions::Interface(_) => -body.invariants().first_moment() / body.invariants().mass(),
        _ => Vector3::zeros(),
    };
    let of = StressedModes {
        modes: shapes,
        modal_stiffness,
        lowest: body.modes().eigenvalue.iter().copied().fold(f64::INFINITY, f64::min),
        frame: body.frame(),
    };
    let wanted = StressLoads::recorded(&body.source().settings);
    let computed = stress_stiffness(model, wanted, &of, &Context::QUIET)?;
    let (mut found, rotated) = modal_geometric_stiffness(model, shapes, computed, body.frame(), &shift)?;
    let (mut stored, mut shapes) = (body.geometric_stiffness().to_vec(), shapes.clone());
    let stored_rotated = &body.parts().rotated_stiffness;
    if !stored_rotated.is_empty() {
        // Rotations of the size of the modes, so that both have the same rounding.
        let rotations = unit_rotations(model, body.frame());
        let scale = longest_column(&shapes) / longest_column(&rotations);
        found = joined(&found, &rotated, scale);
        stored = joined(&stored, stored_rotated, scale);
        shapes = side_by_side(&[shapes.as_ref(), (rotations * Scale(scale)).as_ref()]);
    }
    let size = shapes.ncols();
    let matrix_of = |list: &[GeometricStiffness<Mat<f64>>], load: &UnitLoad| {
        let one = list.iter().find(|one| one.load == *load);
        one.map_or_else(|| Mat::zeros(size, size), |stiffness| stiffness.matrix.clone())
    };
    let loads = stored.iter().chain(&found).map(|one| &one.load);
    let difference = |load: &UnitLoad| {
        let (stored, recomputed) = (matrix_of(&stored, load), matrix_of(&found, load));
        // Every component of the kind may contribute.
        let given = model.geometric_stiffness().iter().filter(|stiffness| stiffness.load.kind == load.kind);
        let of_given: f64 =
            given.map(|stiffness| rounding_of(&stiffness.matrix, &shapes, body.storage())).sum();
        let size = stored.norm_max().max(recomputed.norm_max());
        // What is computed from elements is as accurate as the static response to the load.
        let is_given = model.geometric_stiffness().iter().any(|stiffness| stiffness.load.kind == load.kind);
        let rounding = if is_given { of_given } else { size * limit_of_responses(body.storage()) };
        Difference::new(largest_entry((&stored - &recomputed).as_ref()), size, rounding)
    };
    Ok(loads.map(difference).reduce(Difference::worse))
}

/// Returns the largest length of a column.
fn longest_column(x: &Mat<f64>) -> f64 {
    x.col_iter().fold(0.0f64, |longest, column| longest.max(column.norm_l2()))
}

/// Returns the largest difference between R'MR of the unit translations and rotations of the body frame (3
/// x 3 in the plane) and m, c and I0 of the body, relative to the Cauchy-Schwarz bounds. R'MR is computed
/// independently of the condensation.
fn rigid_inertia_error(body: &FlexBody, found: &Mat<f64>) -> f64 {
    let recomputed = body.parts().rigid_mass();
    let error = |i: usize, j: usize| {
        (found[(i, j)] - recomputed[(i, j)]).abs() / (recomputed[(i, i)] * recomputed[(j, j)]).sqrt()
    };
    largest((0..recomputed.nrows()).flat_map(|i| (0..recomputed.ncols()).map(move |j| error(i, j))))
}

/// Returns a warning for every file in the provenance of `body` whose fingerprint differs from that of the
/// model; that of a mass file states both masses if they differ.
fn changed_sources(body: &FlexBody, model: &FeModel) -> Vec<Diagnostic> {
    let files = &body.source().files;
    let masses = || {
        let (now, before) = (rigid_mass(model, body.frame())[(0, 0)], body.invariants().mass());
        let unit = body.units().mass_name();
        let both = format!(
            ": mass {} {unit} now, {} {unit} in the body",
            significant(now, 6),
            significant(before, 6)
        );
        if (now - before).abs() > MAX_RECOMPUTED_DIFFERENCE * before { both } else { String::new() }
    };
    files
        .iter()
        .enumerate()
        .filter_map(|(i, file)| {
            // Several files may have one role: compare them in their order.
            let before = files[..i].iter().filter(|other| other.role == file.role).count();
            let now = model.sources().iter().filter(|other| other.role == file.role).nth(before)?;
            (now.sha256 != file.sha256).then(|| {
                let renamed = if now.name == file.name { String::new() } else { format!(" {}", file.name) };
                let masses = if file.role == "mass" { masses() } else { String::new() };
                let message = format!(
                    "{} file {} differs from the file{renamed} that the body was made of{masses}",
                    file.role, now.name
                );
                Diagnostic::new(Code::BodySourceChanged, message)
            })
        })
        .collect()
}
