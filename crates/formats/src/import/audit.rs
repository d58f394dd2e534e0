//! Audit of a file: checks of its format, and identities of every flexible body.

use super::import_body::{
    ANY_BODY, DIGITS, NO_INERTIA, axes_without_inertia, beside_free_surface, is_of_points, turning_part,
};
use super::{AuditCheck, ImportedBody, ImportedFile, ImportedFrame};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::numbers::significant;
use flexbody_body::flex_body::rigid_motions;
use flexbody_body::invariants::{IdentityCheck, Invariants, identities};
use flexbody_linalg::{dense_cholesky, symmetric_eigen};
use libm::log10;

/// Range of the radius of gyration relative to the extent of the frames: a rod has 0.29, a ring 0.5. Values
/// far outside indicate different units of length; the range is wide because frames may cover only a part of
/// a body.
const GYRATION: (f64, f64) = (0.02, 5.0);

/// Facts and checks of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Audit {
    /// Name of the format.
    pub format: &'static str,
    /// Detected dialect of the format.
    pub dialect: String,
    /// Name of the body; empty if the file has none.
    pub name: String,
    /// Mass m. Unit: mass of the file.
    pub mass: f64,
    /// Number of modes.
    pub n_modes: usize,
    /// Number of nodes or frames.
    pub n_frames: usize,
    /// Frequencies sqrt(lambda) / (2 pi) of the modes, in cycles per time unit of the file.
    pub frequencies: Vec<f64>,
    /// Notes on facts that are no errors.
    pub notes: Vec<String>,
    /// All checks, those of the format first.
    pub checks: Vec<AuditCheck>,
}

impl Audit {
    /// Returns the diagnostics of the failed checks.
    pub fn findings(&self) -> Vec<Diagnostic> {
        self.checks.iter().filter_map(AuditCheck::finding).collect()
    }

    /// Returns true if every check passed.
    pub fn passed(&self) -> bool {
        self.checks.iter().all(AuditCheck::passed)
    }
}

/// Checks a file against its format and theory section 10. Identities pass up to `tolerance`, relative to the
/// size of their terms, or up to the rounding of their formulas if that is larger.
pub fn audit(file: &ImportedFile, tolerance: f64) -> Audit {
    let body = &file.body;
    let invariants =
        Invariants::from_numbered(&body.inertia, body.modal_stiffness.clone(), tolerance.max(DIGITS));
    let mut checks = file.checks.clone();
    let mut notes = file.notes.clone();
    let identities_of_any_body = identities(&invariants, &ANY_BODY);
    if let Some(cause) = identities_of_any_body.iter().find(|check| is_cause_of_others(check)) {
        // Checks that depend on the failed cause would only repeat it.
        checks.retain(|check| check.value.is_finite());
        checks.push(of_identity(cause.clone()));
        notes.push("further checks were skipped: they need finite numbers and a positive mass".to_owned());
    } else {
        // For a mass that does not commute with rotations no file states W0, which this identity needs.
        let is_reported = |check: &IdentityCheck| check.name != "velocity_gram_psd";
        let turning = turning_part(body, &invariants);
        let is_judged = |check: &IdentityCheck| turning.is_none() || !is_of_points(check.name);
        let judged = identities_of_any_body.into_iter().filter(|one| is_reported(one) && is_judged(one));
        checks.extend(judged.map(of_identity));
        notes.extend(turning.map(|part| {
            format!(
                "the modes break identities of points of mass by {part:.1e}, as nodes whose rotations carry mass do (beams, shells): this format has no place for the second moments of nodes, and its W2 and W3 are as inexact as that"
            )
        }));
        checks.push(turns(body));
        checks.push(deform(&invariants));
        checks.extend(modal_checks(&invariants));
        checks.extend(size(body));
        notes.push(kind_of_modes(&invariants, &body.frames));
    }
    for check in checks.iter_mut().filter(|check| is_identity(check.code)) {
        check.limit = check.limit.max(tolerance);
    }
    let frequency = |j: usize| {
        let (k, m) = (body.modal_stiffness[(j, j)], body.inertia.i6[(j, j)]);
        (k / m).sqrt() / std::f64::consts::TAU
    };
    Audit {
        format: file.format,
        dialect: file.dialect.clone(),
        name: body.name.clone(),
        mass: body.inertia.i1,
        n_modes: body.n_modes(),
        n_frames: body.frames.len(),
        frequencies: (0..body.n_modes()).map(frequency).collect(),
        notes,
        checks,
    }
}

/// Returns true if a check failed without which the other checks have no meaning.
fn is_cause_of_others(check: &IdentityCheck) -> bool {
    matches!(check.name, "finite" | "mass_positive") && !check.passed
}

/// Checks that the rotation about every axis has inertia; [`import_body`](super::import_body()) rejects other
/// bodies.
fn turns(body: &ImportedBody) -> AuditCheck {
    AuditCheck {
        name: "turns_about_every_axis",
        formula: "principal moments about the centre of mass that are zero",
        value: axes_without_inertia(&body.inertia),
        limit: 0.0,
        code: Code::AuditImplausible,
        meaning: NO_INERTIA.to_owned(),
    }
}

/// Checks that no combination of the modes is a rigid motion. Otherwise frame and modes describe the same
/// motion twice, and the mass matrix of the free body is singular.
fn deform(invariants: &Invariants) -> AuditCheck {
    // An unphysical mass has findings of its own.
    let rigid = rigid_motions(invariants).unwrap_or_default();
    let named = rigid.in_words().unwrap_or_else(|| "modes are rigid motions".to_owned());
    AuditCheck {
        name: "modes_deform",
        formula: "motions of the modes that are rigid",
        value: rigid.count as f64,
        limit: 0.0,
        code: Code::AuditImplausible,
        meaning: format!(
            "{named}: the frame performs the same motions, and the mass matrix of the free body is singular; flexbody convert --from removes them"
        ),
    }
}

/// Returns true for findings that are identities, to which a tolerance applies.
fn is_identity(code: Code) -> bool {
    use Code::{AuditFrame, AuditIdentity, AuditImplausible, AuditLayout, AuditLumped};
    matches!(code, AuditIdentity | AuditLumped | AuditLayout | AuditImplausible | AuditFrame)
}

fn of_identity(check: IdentityCheck) -> AuditCheck {
    let (code, meaning) = match check.name {
        "finite" => (Code::AuditImplausible, "some numbers are missing or not finite"),
        "mass_positive" => (Code::AuditImplausible, "the mass is not positive"),
        "second_moment_symmetric" => (Code::AuditImplausible, "the inertia tensor is not symmetric"),
        "second_moment_psd" | "inertia_psd" => (
            Code::AuditImplausible,
            "no distribution of mass has this inertia and centre of mass: they refer to different points, or products of inertia have the wrong sign",
        ),
        "inertia_triangle" => (
            Code::AuditImplausible,
            "a principal moment is larger than the sum of the others: no body has this inertia",
        ),
        "motion_gram_psd" => (
            Code::AuditIdentity,
            "a rigid-flexible motion has negative kinetic energy: mass, coupling and modal mass come from different mass matrices or units",
        ),
        "scalar_gram_psd" | "s_psd" => (
            Code::AuditIdentity,
            "a motion has negative kinetic energy: the inertia of the modes and the other arrays contradict each other, as with lumped masses beside a consistent modal mass",
        ),
        "s_transposed" | "w3_skew" => (
            Code::AuditLayout,
            "products of modes are not symmetric: rows and columns, or blocks, are mixed up",
        ),
        _ => (Code::AuditIdentity, "entries are larger than the mass of the body allows"),
    };
    AuditCheck {
        name: check.name,
        formula: check.formula,
        value: check.value,
        limit: check.limit,
        code,
        meaning: meaning.to_owned(),
    }
}

/// Returns the checks of mass and stiffness of the modes.
fn modal_checks(invariants: &Invariants) -> Vec<AuditCheck> {
    let (mass, stiffness) = (invariants.modal_mass(), invariants.modal_stiffness());
    let check = |name, formula, value, code, meaning: &str| AuditCheck {
        name,
        formula,
        value,
        limit: 1e-12,
        code,
        meaning: meaning.to_owned(),
    };
    let mut checks = vec![
        check(
            "modal_mass_symmetric",
            "m_ff = m_ff'",
            asymmetry(&mass),
            Code::AuditIdentity,
            "the mass matrix of the modes is not symmetric",
        ),
        check(
            "modal_stiffness_symmetric",
            "K_ff = K_ff'",
            asymmetry(stiffness),
            Code::AuditIdentity,
            "the stiffness matrix of the modes is not symmetric",
        ),
    ];
    checks.push(check(
        "modal_mass_positive",
        "m_ff positive definite",
        f64::from(dense_cholesky(mass).is_none()),
        Code::AuditImplausible,
        "some modes have no mass or are linearly dependent",
    ));
    let least = symmetric_eigen(stiffness.as_ref()).and_then(|eigen| {
        let largest = eigen.values.last().copied()?.abs();
        eigen.values.first().map(|first| if largest > 0.0 { (-first / largest).max(0.0) } else { 1.0 })
    });
    checks.push(check(
        "modal_stiffness_psd",
        "K_ff positive semidefinite, not zero",
        least.unwrap_or(f64::NAN),
        Code::AuditImplausible,
        "some deformation has negative elastic energy, or none has any: stiffness is missing or has the wrong sign",
    ));
    checks
}

/// Returns |A - A'| relative to the largest entry.
fn asymmetry(a: &Mat<f64>) -> f64 {
    let skew = (a - a.transpose()).norm_max();
    if skew == 0.0 { 0.0 } else { skew / a.norm_max() }
}

/// Compares inertia, centre of mass and frames of the body.
fn size(body: &ImportedBody) -> Vec<AuditCheck> {
    let inertia = &body.inertia;
    let positions: Vec<_> = body.frames.iter().map(|frame| nalgebra::Vector3::from(frame.position)).collect();
    let centre = inertia.i2 / inertia.i1;
    let reach = |x: &nalgebra::Vector3<f64>| positions.iter().map(|y| (x - y).norm()).fold(0.0, f64::max);
    let Some(first) = positions.first() else { return Vec::new() };
    // The distance from any frame is at least half of the largest distance between two frames.
    let extent = reach(first);
    if positions.len() < 2 || extent <= 0.0 || !extent.is_finite() {
        return Vec::new();
    }
    let about_centre = 0.5 * inertia.i7.trace() - inertia.i1 * centre.norm_squared();
    let gyration = (about_centre.max(0.0) / inertia.i1).sqrt();
    let ratio = gyration / extent;
    // Factor by which the ratio is outside its range; up to 1 passes.
    let times = (ratio / GYRATION.1).max(GYRATION.0 / ratio);
    let check = |name, formula, value, meaning| AuditCheck {
        name,
        formula,
        value,
        limit: 1.0,
        code: Code::AuditUnits,
        meaning,
    };
    let guess = |factor: f64| match log10(factor).round() {
        d if d.is_finite() && d != 0.0 => format!(", as if units of length differed by about 1e{d:+.0}"),
        _ => String::new(),
    };
    vec![
        check(
            "gyration_fits",
            "radius of gyration / extent of the frames, factor outside 0.02 to 5",
            times,
            format!(
                "the radius of gyration is {}, the frames extend over {}{}",
                significant(gyration, 4),
                significant(extent, 4),
                guess(ratio / 0.3)
            ),
        ),
        check(
            "centre_fits",
            "distance of the centre of mass from the frames / 10 extents",
            positions.iter().map(|x| (x - centre).norm()).fold(f64::INFINITY, f64::min) / (10.0 * extent),
            format!(
                "the centre of mass is {} from the origin, the frames extend over {}{}",
                significant(centre.norm(), 4),
                significant(extent, 4),
                guess(centre.norm() / extent)
            ),
        ),
    ]
}

/// Returns the kind of the modes, and the reference conditions of the frame, in words.
fn kind_of_modes(invariants: &Invariants, frames: &[ImportedFrame]) -> String {
    let Some(by) = beside_free_surface(invariants) else {
        return "modes are mass-normalised free-surface modes".to_owned();
    };
    let at_rest = places_at_rest(frames);
    let places = match &at_rest[..] {
        [] => String::new(),
        [one] => format!("; the frame is fixed to node {one}, which moves in no mode"),
        [first, .., last] => {
            format!("; the frame is fixed to {} nodes that move in no mode, {first} to {last}", at_rest.len())
        }
    };
    format!("modes are not mass-normalised free-surface modes (relative difference {by:.1e}){places}")
}

/// Largest displacement of a node at rest, relative to the largest displacement of the mode. A smaller value
/// misses nodes held with rounding.
const AT_REST: f64 = 1e-9;

/// Returns the labels of the nodes that move in no mode. They may rotate, like the ends of a body whose frame
/// follows its chord.
fn places_at_rest(frames: &[ImportedFrame]) -> Vec<&str> {
    let modes = frames.first().map_or(0, |frame| frame.translation.ncols());
    let size = |frame: &ImportedFrame, j: usize| frame.translation.col(j).norm_max();
    let largest: Vec<f64> =
        (0..modes).map(|j| frames.iter().map(|frame| size(frame, j)).fold(0.0, f64::max)).collect();
    let rests = |frame: &&ImportedFrame| {
        largest.iter().enumerate().all(|(j, largest)| size(frame, j) <= AT_REST * largest)
    };
    frames.iter().filter(rests).map(|frame| frame.label.as_str()).collect()
}
