//! A body of a file of another program as a body of ours.

use super::free_surface::{FreeSurface, beside_diagonal, is_free_surface};
use super::{Foreign, ForeignBody, ForeignFrame};
use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::{Error, Result};
use crate::base::provenance::SourceFile;
use crate::base::units::UnitSystem;
use crate::body::flex_body::{
    Certificate, FlexBody, Frame, GeometricStiffness, Group, Interface, MassStructure, Modes, Parts, Source,
    Storage, TermDecision,
};
use crate::body::invariants::{BodyFrame, Expected, Invariants, Numbered, identities, symmetrise};
use crate::model::Nodes;
use faer::Mat;
use nalgebra::Matrix3;
use std::collections::HashSet;

/// A body that was read, and what is to be said of it.
#[derive(Debug, Clone)]
pub struct Adopted {
    /// The body, in the frame of the file.
    pub body: FlexBody,
    /// What was changed, what is missing.
    pub diagnostics: Vec<Diagnostic>,
}

/// Makes a body of `foreign`, which was read from `source`; `units` count where the file states none.
///
/// Modes that are mass-normalised, free-surface and diagonal in K to 1e-9 are taken as they are, to the last bit. Others are made so: the
/// rigid part is removed and the small eigenproblem solved, with the products that the invariants hold (theory 5.2). The body is the
/// same, in other coordinates; its frame is that which rides on the mean motion.
///
/// # Errors
/// [`ForeignUnsound`](Code::ForeignUnsound) for what the reader says; [`ForeignIncomplete`](Code::ForeignIncomplete) when no place of the body is known, modes are rigid motions or depend on each other, or
/// the stiffness is not positive; those of [`FlexBody::new`].
pub fn adopt(foreign: &Foreign, source: SourceFile, units: UnitSystem) -> Result<Adopted> {
    let given = &foreign.body;
    let mut diagnostics: Vec<Diagnostic> =
        given.lacks.iter().map(|lack| Diagnostic::new(Code::ForeignDropped, lack.clone())).collect();
    if !foreign.unsound.is_empty() {
        let refused = |why: &String| Diagnostic::new(Code::ForeignUnsound, why.clone());
        return Err(Error::new(foreign.unsound.iter().map(refused).collect()));
    }
    if given.frames.is_empty() {
        let message = "the file has no node: neither positions nor shapes of the body are known";
        return Err(Diagnostic::new(Code::ForeignIncomplete, message).into());
    }
    let stiffness = mean(&given.modal_stiffness);
    let mut invariants = Invariants::from_numbered(&given.inertia, stiffness, DIGITS);
    restore_symmetries(&mut invariants);
    if let Some(broken) = identities(&invariants, &ANY_BODY).into_iter().find(|check| {
        matches!(check.name, "finite" | "mass_positive" | "second_moment_psd" | "inertia_psd")
            && check.value > BROKEN
    }) {
        let message = format!("inertia is not that of a body: {} does not hold", broken.formula);
        return Err(Diagnostic::new(Code::ForeignIncomplete, message).into());
    }
    if axes_without_inertia(&given.inertia) != 0.0 {
        return Err(Diagnostic::new(Code::ForeignIncomplete, NO_INERTIA).into());
    }
    let mut shape = stacked(&given.frames, |frame| Some(&frame.translation));
    let mut rotation = given
        .frames
        .iter()
        .any(|frame| frame.rotation.is_some())
        .then(|| stacked(&given.frames, |frame| frame.rotation.as_ref()));
    let (mut damping, mut geometric) =
        (given.modal_damping.as_ref().map(mean), given.geometric_stiffness.clone());
    for one in &mut geometric {
        one.matrix = mean(&one.matrix);
    }
    if let Some(missed) = is_free_surface(&invariants) {
        let change = FreeSurface::new(&invariants)?;
        diagnostics.push(change.note(missed));
        invariants = change.invariants(&invariants);
        let positions: Vec<[f64; 3]> = given.frames.iter().map(|frame| frame.position).collect();
        shape = change.shapes(&shape, &positions);
        let turns: Vec<bool> = given.frames.iter().map(|frame| frame.rotation.is_some()).collect();
        rotation = rotation.map(|rotation| change.rotations(&rotation, &turns));
        damping = damping.map(|damping| change.congruent(&damping));
        geometric = geometric
            .into_iter()
            .map(|one| GeometricStiffness { matrix: change.congruent(&one.matrix), load: one.load })
            .collect();
    }
    let eigenvalue = eigenvalues(&invariants);
    let rigid_noise = beside_diagonal(&invariants);
    let damping_ratio = match &damping {
        Some(d) => {
            eigenvalue.iter().enumerate().map(|(j, l)| (0.5 * d[(j, j)] / l.sqrt()).max(0.0)).collect()
        }
        None => vec![0.0; eigenvalue.len()],
    };
    let modes = Modes {
        residual: residuals(&invariants, &eigenvalue),
        provenance: (1..=eigenvalue.len())
            .map(|j| format!("mode {j} of a {} file", foreign.format))
            .collect(),
        truncation: Vec::new(),
        damping_ratio,
        modal_damping: damping,
        shape,
        rotation,
        internal: None,
        eigenvalue,
    };
    let terms = invariants.groups.dropped().map(|group| not_in_file(group, foreign.format)).collect();
    let body = FlexBody::new(Parts {
        source: Source {
            name: given.name.clone(),
            files: vec![source],
            number: None,
            // Nobody knows.
            n_dofs: 0,
            mass_structure: match invariants.general {
                Some(_) => MassStructure::General,
                None => MassStructure::RotationInvariant,
            },
            settings: serde_json::json!({
                "from": foreign.format,
                "dialect": foreign.dialect,
                "frame": BodyFrame::Model.name(),
            }),
        },
        dimension: 3,
        units: given.units.clone().unwrap_or(units),
        frame: Frame { origin: nalgebra::Vector3::zeros(), axes: nalgebra::Matrix3::identity() },
        nodes: nodes(&given.frames),
        modes,
        invariants,
        geometric_stiffness: geometric,
        lumped: Vec::new(),
        certificate: Certificate {
            proved_modes: None,
            shift: 0.0,
            negative_pivots: None,
            rigid_modes: 6,
            remark: format!(
                "read from a {} file: the FE matrices are not known; residuals are those of the reduced matrices",
                foreign.format
            ),
            // What digits of K leave of the modes, as far as the file shows it.
            rigid_noise,
            rigid_residual: 0.0,
            eigenvalue_rounding: 0.0,
            inertia_rounding: 0.0,
            guarantee: None,
            fixed_interface: None,
        },
        interfaces: interfaces(given),
        coordinates: None,
        terms,
        storage: Storage::F64,
    })?;
    let (body, warning) = with_own_rounding(body)?;
    diagnostics.extend(warning);
    Ok(Adopted { body, diagnostics })
}

/// The body with what the digits of its file leave of the identities of inertia, and a warning where this is more than rounding.
fn with_own_rounding(body: FlexBody) -> Result<(FlexBody, Option<Diagnostic>)> {
    let missed = body.identities(BodyFrame::Model).into_iter().filter(|check| !check.passed);
    let missed = missed.map(|check| check.value).fold(0.0, f64::max);
    if missed == 0.0 || missed > BROKEN {
        return Ok((body, None));
    }
    let mut parts = body.into_parts();
    parts.certificate.inertia_rounding = missed;
    let message = format!("the inertia data of the file are those of a body to {missed:.1e} of their size");
    Ok((FlexBody::new(parts)?, Some(Diagnostic::new(Code::ForeignRounded, message))))
}

/// What is asked of a body whatever its modes are.
pub(crate) const ANY_BODY: Expected<'static> = Expected {
    mass_normalised: false,
    free_surface: false,
    frame: BodyFrame::Model,
    origin: nalgebra::Vector3::new(0.0, 0.0, 0.0),
    eigenvalues: None,
    eigenvalue_noise: 0.0,
    eigenvalue_rounding: 0.0,
};

/// What counts as rounding in files of 10 digits and more, relative to Cauchy-Schwarz bounds; what is told twice differs by no more.
pub(crate) const DIGITS: f64 = 1e-9;

/// How far inertia may be from that of a body before nothing can be computed with it: rounding of few digits is far below.
const BROKEN: f64 = 1e-2;

/// What a principal moment of zero means.
pub(crate) const NO_INERTIA: &str = "rotation about an axis through the centre of mass has no inertia: all masses lie on a line, or the inertia of the nodes is missing";

/// Number of principal moments about the centre of mass that are zero but for rounding; NaN where they cannot be computed.
pub(crate) fn axes_without_inertia(inertia: &Numbered) -> f64 {
    const NOTHING: f64 = 1e-12;
    let centre = inertia.i2 / inertia.i1;
    let steiner = (Matrix3::identity() * centre.norm_squared() - centre * centre.transpose()) * inertia.i1;
    let about_centre = inertia.i7 - steiner;
    if about_centre.iter().any(|entry| !entry.is_finite()) {
        return f64::NAN;
    }
    // Rounding is that of the moments about the origin.
    let size = inertia.i7.amax();
    let moments = (0.5 * (about_centre + about_centre.transpose())).symmetric_eigenvalues();
    moments.iter().filter(|moment| moment.abs() <= NOTHING * size).count() as f64
}

fn mean(a: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| 0.5 * (a[(i, j)] + a[(j, i)]))
}

/// What files of few digits leave of symmetries that every body has.
fn restore_symmetries(invariants: &mut Invariants) {
    let j = invariants.second_moment;
    invariants.second_moment = (j + j.transpose()) * 0.5;
    symmetrise(&mut invariants.s);
    if let Some(general) = &mut invariants.general {
        general.modal_mass = mean(&general.modal_mass);
    }
}

/// 3n x nf of the rows of all frames, zeros where one has none.
fn stacked<'f>(
    frames: &'f [ForeignFrame],
    rows: impl Fn(&'f ForeignFrame) -> Option<&'f Mat<f64>>,
) -> Mat<f64> {
    let nf = frames.first().map_or(0, |frame| frame.translation.ncols());
    Mat::from_fn(3 * frames.len(), nf, |row, j| rows(&frames[row / 3]).map_or(0.0, |rows| rows[(row % 3, j)]))
}

/// The diagonal of K_ff, ascending: rounding may have exchanged what is repeated.
fn eigenvalues(invariants: &Invariants) -> Vec<f64> {
    let mut largest = 0.0f64;
    let mut next = |j: usize| {
        largest = largest.max(invariants.modal_stiffness[(j, j)]);
        largest
    };
    (0..invariants.n_modes()).map(&mut next).collect()
}

/// |K x - lambda x| of each unit vector x, relative to lambda.
fn residuals(invariants: &Invariants, eigenvalue: &[f64]) -> Vec<f64> {
    let k = &invariants.modal_stiffness;
    let beside = |j: usize| (0..eigenvalue.len()).filter(|i| *i != j).map(|i| k[(i, j)].powi(2)).sum::<f64>();
    eigenvalue.iter().enumerate().map(|(j, l)| beside(j).sqrt() / (2.0 * l)).collect()
}

fn not_in_file(group: Group, format: &str) -> TermDecision {
    TermDecision {
        group,
        kept: false,
        tier: 0,
        bound: f64::INFINITY,
        limit: f64::INFINITY,
        reason: format!("not told by the {format} file"),
    }
}

/// Node numbers are the labels where all of them are numbers, each once; else 1, 2, ...
fn nodes(frames: &[ForeignFrame]) -> Nodes {
    let numbers: Option<Vec<i64>> = frames.iter().map(|frame| frame.label.parse().ok()).collect();
    let mut seen = HashSet::new();
    let ids = numbers
        .filter(|ids| ids.iter().all(|id| seen.insert(*id)))
        .unwrap_or_else(|| (1..=frames.len() as i64).collect());
    Nodes { ids, positions: frames.iter().map(|frame| frame.position).collect() }
}

/// Frames that the file calls interfaces: single nodes with their reference point there.
fn interfaces(given: &ForeignBody) -> Vec<Interface> {
    let mut found: Vec<Interface> = Vec::new();
    for (i, frame) in given.frames.iter().enumerate() {
        let Some(name) = &frame.interface else { continue };
        match found.iter_mut().find(|interface| interface.name == *name) {
            // Several nodes of one name: their mean is the reference point.
            Some(interface) => {
                interface.nodes.push(i);
                interface.reference = Some(mean_position(given, &interface.nodes));
            }
            None => found.push(Interface {
                name: name.clone(),
                nodes: vec![i],
                coupling: None,
                reference: Some(frame.position),
            }),
        }
    }
    found
}

fn mean_position(given: &ForeignBody, nodes: &[usize]) -> [f64; 3] {
    let sum = |k: usize| nodes.iter().map(|&i| given.frames[i].position[k]).sum::<f64>();
    [0, 1, 2].map(|k| sum(k) / nodes.len() as f64)
}
